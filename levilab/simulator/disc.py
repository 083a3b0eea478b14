"""A magnet of finite size: a disc of even magnetisation as dipoles at the nodes of a quadrature over its volume.

Rings are Gauss–Legendre in r², layers Gauss–Legendre along the axis, angles equal.  The field of a ring is smooth as
far as the ring's edge is away, at a distance D, so each of the three errors falls geometrically with its number of
nodes, at a rate that is set by the disc's size over D.  The rates and factors below bound what was measured of force
and torque, against a rule of 2800 nodes, for radii of 5 to 30 mm, heights of 2 to 20 mm and D of 31 to 75 mm.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from analysis.arrays import Array
from levilab.simulator.numbers import ceil, hypot, largest, log, smallest, uniform
from levilab.simulator.parts import Base, Top

#: Relative error of force and torque that the number of nodes is chosen for.
TARGET = 1e-11

#: Nodes at most, for a disc that all but touches the base: rings, layers, angles.
MOST = (8, 8, 20)


class Rule(NamedTuple):
    """How many nodes: rings × layers × angles."""

    rings: int
    layers: int
    angles: int

    def with_more(self, number: int) -> Rule:
        """Return the rule with a number more of each, or fewer: one of each less has a well larger error."""
        return Rule(max(self.rings + number, 1), max(self.layers + number, 1), max(self.angles + number, 3))


def rule_for(radius: Any, height: Any, distance: Any) -> Rule:
    """Return the smallest rule for a disc of this radius and height at this distance from the base's edge, all [m].

    >>> rule_for(0.0144, 0.0033, 0.0763)
    Rule(rings=4, layers=4, angles=8)
    """
    across, along = radius / distance, height / 2 / distance
    half = across / 2
    return Rule(
        _number(1000, half * half * half * half, MOST[0]),
        _number(15, along * along, MOST[1]),
        # the disc feels a harmonic of the angle in proportion to its lean and its distance from the base's axis
        max(_number(100, across / 8, MOST[2]), 6),
    )


def _number(factor: float, rate: Any, most: int) -> int:
    """Return the least n with factor · rateⁿ ≤ TARGET."""
    return most if rate >= 1 else min(max(int(uniform(ceil(math.log(TARGET / factor) / log(rate)))), 1), most)


def distance_to(base: Base, place: Any) -> Any:
    """Return the distance [m] of a place, three numbers, from the nearest edge of the base."""
    away = hypot(place[0], place[1])
    above = largest(abs(place[2] - base.origin_m) - base.thickness_m / 2, 0.0)
    inner, outer = (hypot(radius - away, above) for radius in (base.inner_radius_m, base.outer_radius_m))
    return largest(smallest(inner, outer), 1e-9)


def nodes_of(top: Top, rule: Rule) -> Array:
    """Return the nodes of a rule, shape (n, 4): place along e₁, e₂, axis [m], and weight; the weights add up to 1."""
    x, wx = np.polynomial.legendre.leggauss(rule.rings)
    z, wz = np.polynomial.legendre.leggauss(rule.layers)
    radius, height = uniform(top.magnet_radius_m), uniform(top.magnet_height_m)
    rings = radius * np.sqrt((x + 1) / 2)
    angles = 2 * np.pi * np.arange(rule.angles) / rule.angles
    return np.array(
        [
            [ring * math.cos(angle), ring * math.sin(angle), layer * height / 2, u * w / 4 / rule.angles]
            for ring, u in zip(rings, wx, strict=True)
            for angle in angles
            for layer, w in zip(z, wz, strict=True)
        ]
    )
