"""What people are shown of each drag law, made from the rows of `analysis.spindown.drag.LAWS`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from analysis.spindown.drag import LAWS

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from analysis.spindown.drag import DragLaw

    Array = NDArray[np.float64]


@dataclass(frozen=True)
class StraightLine:
    """The function of ω that is a straight line in time where a law of one power holds.

    Attributes:
        quantity: for text.
        axis: for the axis of a figure, with its unit.
        transform: of ω [rad/s].
    """

    quantity: str
    axis: str
    transform: Callable[[Array], Array]


def straight_line(law: DragLaw) -> StraightLine | None:
    """Return the straight line of a law; None for a law of several terms or of a free exponent.

    >>> [straight_line(LAWS[name]).quantity for name in ("stokes", "newton", "disc")]
    ['ln ω', '1/ω', 'ω^−½']
    """
    if law.exponent is None:
        return None
    (m,) = law.orders
    if m == 0:
        return StraightLine("ln ω", "ln ω   (ω in rad/s)", np.log)
    if m == 1:
        return StraightLine("1/ω", "1/ω  [s/rad]", lambda omega: 1 / omega)
    power = str(Fraction(m).limit_denominator(100))
    text = "½" if math.isclose(m, 0.5) else power
    return StraightLine(f"ω^−{text}", f"ω$^{{−{power}}}$  [(s/rad)$^{{{power}}}$]", lambda omega: np.asarray(omega**-m))


#: The laws that have a straight line.
STRAIGHT_LINES = MappingProxyType({law.name: line for law in LAWS.values() if (line := straight_line(law))})
#: Parameters of the laws in the field's letters, then of what the counter sees beside the spin.
SYMBOLS = MappingProxyType(
    {"start_frequency": "ν₀"}
    | {name: symbol for law in LAWS.values() for name, symbol in zip(law.constants, law.symbols, strict=True)}
    | {"moment_tilt": "δ", "resonance": "ν_r", "wobble": "K"}
)
