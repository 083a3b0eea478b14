"""The type of arrays: numbers, in the shape that a docstring says."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
