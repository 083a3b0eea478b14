"""What people are shown of each drag law: one row a law, for tables, figures and reports."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True)
class StraightLine:
    """What falls or rises in a straight line where a law holds.

    Attributes:
        quantity: for text.
        axis: for the axis of a figure, with its unit.
        transform: of ω [rad/s].
    """

    quantity: str
    axis: str
    transform: Callable[[Array], Array]


@dataclass(frozen=True)
class ShownLaw:
    """How people are shown a law.

    Attributes:
        equation: as a figure's label.
        meaning: what takes the spin where it holds, in a sentence.
        straight: None if nothing is.
    """

    equation: str
    meaning: str
    straight: StraightLine | None = None


#: By the names of `analysis.spindown.drag.LAWS`, in their order.
#: Their colours are in `levilab.present.looks`.
SHOWN_LAWS = MappingProxyType({
    "stokes": ShownLaw(
        "ω̇ = −C₁ω",
        "The torque of the drag is proportional to the spin, as of eddy currents, or of air that creeps.",
        StraightLine("ln ω", "ln ω   (ω in rad/s)", np.log),
    ),
    "newton": ShownLaw(
        "ω̇ = −C₂ω²",
        "The torque of the drag is proportional to the square of the spin, as of air that is stirred up.",
        StraightLine("1/ω", "1/ω  [s/rad]", lambda omega: 1 / omega),
    ),
    "disc": ShownLaw(
        "ω̇ = −Cω$^{3/2}$",
        "The torque of the drag is proportional to the spin to the power 3/2, as of the laminar layer of air on a disc "
        "(von Kármán, 1921).",
        StraightLine("ω^−½", "ω$^{−1/2}$  [(s/rad)$^{1/2}$]", lambda omega: omega**-0.5),
    ),
    "mixed": ShownLaw(
        "ω̇ = −C₁ω − C₂ω²",
        "The torque of the drag has a part that is proportional to the spin and one that is to its square.",
    ),
    "power": ShownLaw(
        "ω̇ = −cωⁿ", "The torque of the drag is proportional to a power n of the spin, which the fit chose.",
    ),
})  # fmt: skip

#: The laws' parameters in the field's letters.
SYMBOLS = MappingProxyType({
    "start_frequency": "ν₀", "c1": "C₁", "c2": "C₂", "c32": "C₃/₂", "c": "c", "exponent": "n",
    "moment_tilt": "δ", "resonance": "ν_r", "wobble": "K",
})  # fmt: skip
