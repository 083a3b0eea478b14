"""How good a result is, from the same motion with longer steps."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Estimated errors are about so many times the true ones: they are to bound them.
CAUTION = 6.0


def estimate(fine: Array, twice: Array, four: Array, order: int) -> Any:
    """Estimated error of results at step h, from those at 2h and 4h; arrays of shape (…, 3), result (…).

    From one doubling to the next the differences shrink by a factor q, and what is left of them is their sum,
    about q times the last one.  Where the order p is seen q is 2^−p; where rounding or chaos rules they do not
    shrink, and the estimate is as large as the difference.
    """
    last = np.linalg.norm(fine - twice, axis=-1)
    before = np.linalg.norm(twice - four, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        shrink = np.clip(np.nan_to_num(last / before, nan=1.0, posinf=1.0), 2.0**-order, 1.0)
    return CAUTION * last * shrink
