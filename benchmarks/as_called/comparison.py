"""Points of every contender on every task, and the ratios that they come to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from as_called.contenders import Contender
from levilab.benchmark.simulator.peers import Point, best_time_and_result
from levilab.benchmark.simulator.work_precision import Ratio, best_speed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from as_called.contenders import Call
    from as_called.tasks import Task

ROUNDS = 3
#: How long a point is repeated in a round [s].
LEAST = 0.05


@dataclass(frozen=True)
class Case:
    """A task with a point for each contender and tolerance."""

    task: Task
    points: tuple[Point, ...]

    def speed(self, method: str, error: float) -> float:
        """Return the speed of one contender at an achieved error [m], at its best setting; NaN if it has none."""
        return best_speed([point for point in self.points if point.method == method], error)

    @property
    def ratios(self) -> tuple[Ratio, ...]:
        """Ours against the task's peer at each of its errors."""
        ours, peer = self.task.contenders[0].name, self.task.peer
        return tuple(
            Ratio(ours, peer, error, self.speed(ours, error), self.speed(peer, error), aim)
            for error, aim in self.task.aims.items()
        )


def measure_calls(
    tasks: Sequence[Task], *, quick: bool = False, tell: Callable[[str], None] = lambda _: None
) -> tuple[Case, ...]:
    """Measure every contender that is installed on every task.

    In ROUNDS, of which each point keeps its best.  What a contender prepares for a subject serves all durations and
    rounds.
    """
    prepared = cache(Contender.call_for)
    best: dict[tuple[int, Contender, float], Point] = {}
    rounds = 1 if quick else ROUNDS
    for number in range(rounds):
        for i, task in enumerate(tasks):
            tell(f"round {number + 1} of {rounds}: {task.name} as called, {task.duration:g} s")
            for contender in task.contenders:
                if contender.installed and number < (contender.rounds or rounds):
                    for tolerance in contender.tolerances[:: 2 if quick else 1]:
                        key = i, contender, tolerance
                        point = _point(task, contender, tolerance, prepared(contender, task.subject, tolerance))
                        best[key] = max(point, best.get(key, point), key=lambda p: p.speed)
    return tuple(
        Case(task, tuple(point for (at, *_), point in best.items() if at == i)) for i, task in enumerate(tasks)
    )


def _point(task: Task, contender: Contender, tolerance: float, call: Call) -> Point:
    seconds, places = best_time_and_result(lambda: call(task.duration), LEAST)
    error = float(np.abs(places - task.reference).max())
    setting = f"tolerance {tolerance:g}{contender.variant}"
    return Point(contender.name, setting, error, task.tops * task.duration / seconds)
