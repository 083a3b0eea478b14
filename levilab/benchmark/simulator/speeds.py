"""Speeds at a wanted error, from points at settings, and the ratio of two of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from levilab.benchmark.simulator.peers import Point


@dataclass(frozen=True)
class Ratio:
    """speed, peer_speed: simulated seconds per second for the error [m]; NaN where a side has no such point."""

    ours: str
    peer: str
    error: float
    speed: float
    peer_speed: float
    aim: float

    @property
    def ratio(self) -> float:
        """How many times faster."""
        return self.speed / self.peer_speed


def best_speed(points: Iterable[Point], error: float) -> float:
    """Return the speed at which the best method reaches an error, between two of its points; NaN if none does.

    Between two settings of a method the logarithm of the speed is taken as linear in that of the error; beyond the
    loosest setting nothing is assumed.
    """
    methods: dict[str, list[Point]] = {}
    for point in points:
        if point.error > 0 and math.isfinite(point.error):
            key = f"{point.method}{point.setting.partition(',')[2]}"
            methods.setdefault(key, []).append(point)
    speeds = (_between(rows, error) for rows in methods.values())
    return max((speed for speed in speeds if not math.isnan(speed)), default=math.nan)


def _between(rows: list[Point], error: float) -> float:
    good = [p.speed for p in rows if p.error <= error]
    best = max(good, default=math.nan)
    for p in rows:
        for q in rows:
            if p.error <= error < q.error and q.speed > p.speed:
                share = math.log(error / p.error) / math.log(q.error / p.error)
                # only neighbours: nothing in between
                if not any(p.error < r.error < q.error for r in rows):
                    best = max(best, math.exp(math.log(p.speed) + share * math.log(q.speed / p.speed)))
    return best
