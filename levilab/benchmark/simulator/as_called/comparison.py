"""Points of every contender on every motion, and the ratios that they come to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from levilab.benchmark.simulator.as_called.contenders import CONTENDERS, Contender
from levilab.benchmark.simulator.motion import MOTIONS, Motion, reference
from levilab.benchmark.simulator.peers import Point, best_time
from levilab.benchmark.simulator.speeds import Ratio, best_speed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from levilab.benchmark.simulator.as_called.contenders import Call
    from levilab.benchmark.simulator.motion import Array

ROUNDS = 3
#: How long a point is repeated in a round [s].
LEAST = 0.05
DURATIONS = (5.0, 60.0)
#: Errors at which speeds are compared [m].
ERRORS = (1e-8, 1e-11)
#: The ratios to heyoka that are aimed at: motion, duration [s] → at each of ERRORS.
AIMS = {
    (name, duration): (2.0, 2.0) if name == "square" else (2.5, 2.0) if duration == 5.0 else (5.0, 3.0)
    for name in MOTIONS
    for duration in DURATIONS
}


@dataclass(frozen=True)
class Case:
    """A motion of a duration [s], with a point for each contender and tolerance."""

    motion: str
    duration: float
    points: tuple[Point, ...]

    def of(self, method: str) -> list[Point]:
        """The points of one contender, from loose to tight."""
        return [point for point in self.points if point.method == method]

    @property
    def ratios(self) -> tuple[Ratio, ...]:
        """`simulate` against heyoka, each at its best setting for each of ERRORS."""
        own, theirs = self.of("simulate"), self.of("heyoka")
        aims = AIMS[self.motion, self.duration]
        return tuple(
            Ratio("simulate", "heyoka", error, best_speed(own, error), best_speed(theirs, error), aim)
            for error, aim in zip(ERRORS, aims, strict=True)
        )


def cases(
    *, quick: bool = False, contenders: Sequence[Contender] = CONTENDERS, tell: Callable[[str], None] = lambda _: None
) -> tuple[Case, ...]:
    """Measure every contender that is installed on every motion.

    In ROUNDS, of which each point keeps its best.  What a contender prepares for a motion serves all durations and
    rounds.
    """
    tell("as called: building the integrators")
    ready = [
        (motion, contender, _setting(tolerance), contender.prepare(motion, tolerance))
        for motion in MOTIONS.values()
        for contender in contenders
        if contender.installed
        for tolerance in contender.tolerances[:: 2 if quick else 1]
    ]
    best: dict[tuple[str, float], dict[tuple[str, str], Point]] = {}
    rounds = 1 if quick else ROUNDS
    for number in range(rounds):
        for motion, contender, setting, call in ready:
            if number >= (contender.rounds or rounds):
                continue
            tell(f"as called, round {number + 1} of {rounds}: {motion.name}, {contender.name}, {setting}")
            for duration in DURATIONS:
                points = best.setdefault((motion.name, duration), {})
                key = contender.name, setting
                point = _measure(motion, duration, contender, setting, call)
                points[key] = max(point, points.get(key, point), key=lambda p: p.speed)
    return tuple(Case(name, duration, tuple(points.values())) for (name, duration), points in best.items())


def _setting(tolerance: float) -> str:
    return f"tolerance {tolerance:g}"


def _measure(motion: Motion, duration: float, contender: Contender, setting: str, call: Call) -> Point:
    places: list[Array] = []
    seconds = best_time(lambda: places.append(call(duration)), LEAST)
    error = float(np.abs(places[-1] - reference(motion, duration)).max())
    return Point(contender.name, setting, error, duration / seconds)
