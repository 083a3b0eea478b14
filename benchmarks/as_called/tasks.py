"""What is compared as called: motions of one top, and an ensemble; each with its contenders, reference and aims."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from as_called import many
from as_called.contenders import CONTENDERS, Contender
from as_called.motions import MOTIONS, Motion, reference

if TYPE_CHECKING:
    from collections.abc import Mapping

    from levilab.benchmark.simulator.motion import Array


@dataclass(frozen=True)
class Task:
    """One motion for one duration, or an ensemble.

    Attributes:
        part: of the benchmark, "called" or "ensemble".
        name: of the motion.
        duration: of each top's motion [s].
        tops: how many there are.
        subject: what contenders prepare themselves for; tasks of one subject share what is prepared.
        contenders: who takes part; the first is ours.
        peer: the contender whose speed ours is divided by.
        aims: the ratio aimed at by the error [m].
        reference: true places at the end, shape (3,) or (n, 3) [m].
    """

    part: str
    name: str
    duration: float
    tops: int
    subject: Any
    contenders: tuple[Contender, ...]
    peer: str
    aims: Mapping[float, float]
    reference: Array


#: Ratios aimed at, at an error of 1e-8 m and of 1e-11 m: in 60 s, in 5 s, where a call's overhead counts, and with the
#: many stops of a square wave.
_LONG, _SHORT, _SQUARE = ({1e-8: a, 1e-11: b} for a, b in ((5.0, 3.0), (2.5, 2.0), (2.0, 2.0)))


def _single(motion: Motion, duration: float) -> Task:
    aims = _SQUARE if motion.drive == "square" else _SHORT if duration <= 5 else _LONG
    return Task("called", motion.name, duration, 1, motion, CONTENDERS, "heyoka", aims, reference(motion, duration))


TASKS = (
    *(_single(motion, duration) for motion in MOTIONS.values() for duration in (5.0, 60.0)),
    Task(
        "ensemble", "1000 tops", many.DURATION, many.SIZE, many.tops(), many.CONTENDERS, "heyoka batch",
        {1e-11: 8.0}, many.reference(),
    ),
)  # fmt: skip
