"""The top from its parts: mass and moments of inertia of coaxial cylinders, with their uncertainties.

A hollow cylinder of mass m, radii r < R and height H has ½m(R² + r²) about its axis and m(3(R² + r²) + H²)/12 about a
line across through its middle; Steiner's theorem adds m(c − c̄)² for one whose middle lies at c, with the centre of mass
of the whole at c̄ (any textbook, e.g. Goldstein, Classical Mechanics, §5.3).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array
from analysis.errors import AnalysisError
from analysis.uncertainty import Estimate


class ImpossibleCylinder(AnalysisError):
    """A part of a top with a value that no cylinder has."""

    def __init__(self, *, part: str, quantity: str, seen: float, expected: str) -> None:
        self.part, self.quantity, self.seen, self.expected = part, quantity, seen, expected
        super().__init__("part {part:s}: {quantity} = {seen:g}, {expected} is expected: correct it")


@dataclass(frozen=True)
class Cylinder:
    """A uniform part of the top, on its axis.

    Attributes:
        name: for messages.
        mass: [kg].
        outer_radius, inner_radius: [m]; inner_radius 0: full.
        height: [m].
        offset: of its middle along the axis, from any mark of the top [m].
        mass_u, outer_radius_u, inner_radius_u, height_u, offset_u: standard uncertainties.
    """

    name: str
    mass: float
    outer_radius: float
    inner_radius: float = 0.0
    height: float = 0.0
    offset: float = 0.0
    mass_u: float = 0.0
    outer_radius_u: float = 0.0
    inner_radius_u: float = 0.0
    height_u: float = 0.0
    offset_u: float = 0.0


@dataclass(frozen=True, eq=False)
class Top:
    """A symmetric top.

    Attributes:
        mass: [kg].
        transverse: I₁ about the centre of mass, across the axis [kg m²].
        axial: I₃ about the axis [kg m²].
        centre: of mass, along the axis, from the mark that the offsets are counted from [m].
        covariance: of mass, I₁ and I₃, shape (3, 3).
    """

    mass: Estimate
    transverse: Estimate
    axial: Estimate
    centre: Estimate
    covariance: Array


def top_of(parts: Sequence[Cylinder]) -> Top:
    """Put the parts together; their uncertainties are taken as independent and carried on to first order.

    Raises:
        ImpossibleCylinder: a part without mass, or with radii or a height that no cylinder has.

    >>> disc = top_of([Cylinder("disc", mass=0.02, outer_radius=0.01)])
    >>> disc.axial.value == 2 * disc.transverse.value
    True
    """
    if not parts:
        raise ImpossibleCylinder(part="(none)", quantity="number of parts", seen=0, expected="at least 1")
    for part in parts:
        _check(part)
    quantities = ("mass", "outer_radius", "inner_radius", "height", "offset")
    m, outer, inner, h, c = np.array([[getattr(part, name) for part in parts] for name in quantities])
    u = np.array([[getattr(part, f"{name}_u") for part in parts] for name in quantities])
    mass = float(m.sum())
    centre = float(m @ c) / mass
    away, squares = c - centre, outer**2 + inner**2
    transverse = m * (squares / 4 + h**2 / 12 + away**2)
    axial = m * squares / 2
    none = np.zeros_like(m)
    # by mass, outer and inner radius, height, offset of each part, shape (4, 5, parts); the centre moves with none of
    # the first two quantities' slopes, since the parts balance about it
    slopes = np.array(
        [
            [none + 1, none, none, none, none],
            [transverse / m, m * outer / 2, m * inner / 2, m * h / 6, 2 * m * away],
            [axial / m, m * outer, m * inner, none, none],
            [away / mass, none, none, none, m / mass],
        ]
    ).reshape(4, -1)
    covariance = slopes @ np.diag(u.ravel() ** 2) @ slopes.T
    values = (mass, float(transverse.sum()), float(axial.sum()), centre)
    sizes = np.sqrt(np.diagonal(covariance))
    units = ("kg", "kg m^2", "kg m^2", "m")
    found = [Estimate(value, float(size), unit) for value, size, unit in zip(values, sizes, units, strict=True)]
    return Top(found[0], found[1], found[2], found[3], covariance[:3, :3])


def _check(part: Cylinder) -> None:
    rules = (
        ("mass", part.mass > 0, "more than 0 kg"),
        ("outer_radius", part.outer_radius > 0, "more than 0 m"),
        ("inner_radius", 0 <= part.inner_radius < part.outer_radius, "from 0 to less than outer_radius"),
        ("height", part.height >= 0, "0 m or more"),
        *((f"{name}_u", getattr(part, f"{name}_u") >= 0, "0 or more") for name in
          ("mass", "outer_radius", "inner_radius", "height", "offset")),
    )  # fmt: skip
    for quantity, holds, expected in (*rules, ("offset", True, "a finite number")):
        seen = float(getattr(part, quantity))
        if not holds or not math.isfinite(seen):
            raise ImpossibleCylinder(part=part.name, quantity=quantity, seen=seen, expected=expected)
