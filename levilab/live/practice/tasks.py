"""Tasks with a goal that the bench recognizes: a row a task."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from levilab.live.practice.commands import CommandRefused
from levilab.simulator.scene import Scene
from levilab.texts.text import Text

#: A held top swings about its drive by less than this [Hz].
_HELD_HZ = 0.5


@dataclass(frozen=True)
class Look:
    """What the bench sees at a moment.

    Attributes:
        time_s: bench time [s].
        floats: whether the top is up.
        spin_hz: that was counted last [Hz]; None: no light pulses.
        drive_hz: None while the output is off [Hz].
        follows: whether the drive holds the top.
        answer: that a person gave.
        fell_after_s: how long a top was up that has fallen since the last look [s]; None: none has.
    """

    time_s: float
    floats: bool
    spin_hz: float | None
    drive_hz: float | None
    follows: bool
    answer: float | None = None
    fell_after_s: float | None = None

    @property
    def is_held(self) -> bool:
        """Whether the top is up, and counted near a drive that holds it."""
        near = None not in (self.spin_hz, self.drive_hz) and abs(self.spin_hz - self.drive_hz) < _HELD_HZ  # type: ignore[operator]
        return self.floats and self.follows and near


@dataclass(frozen=True)
class Task:
    """A row.

    Attributes:
        title, does: the goal, and what to do.
        teaches: said once it is reached.
        needs: the control of the page that it begins with.
        holds: whether the goal is there at a moment.
        for_s: how long it has to be there without a break [s].
        found: said of the top that reached it; empty: nothing.
        hidden: what the bench changes, and does not say: keys of a scene by a random number from 0 to 1.
        answers: to choose from; none: no answer is asked.
        measures: the experiment that is recorded before an answer.
        right: the answer, from the random number of what is hidden.
        wrong: said of another answer, its value.
    """

    title: str
    does: str
    teaches: str
    needs: str
    holds: Callable[[Look], bool]
    for_s: float = 0.0
    found: Callable[[Scene], str] = lambda _: ""
    hidden: Callable[[float], dict[str, Any]] = lambda _: {}
    answers: Mapping[str, float] = field(default_factory=dict)
    measures: str = ""
    right: Callable[[float], float] = lambda _: math.nan
    wrong: Callable[[float], str] = lambda _: ""


def _mass(chance: float) -> dict[str, Any]:
    """Return a mass above those that float, 24.25 to 24.97 g, of which washers of 0.2 g are a part."""
    return {"top.mass_kg": 25.0e-3 + 0.1e-3 * chance}


def _say_mass(scene: Scene) -> str:
    return Text("this top floats with {mass:.2f} g; “All as usual” brings the usual one", mass=1e3 * scene.top.mass_kg)


#: A drag that slows 30 Hz by 0.11 Hz/s: exponent → law and coefficient.  C ω^n = 0.7 rad/s² at 188 rad/s.
_LAWS = {1.0: ("stokes", 3.7e-3), 1.5: ("disc", 2.7e-4), 2.0: ("newton", 2.0e-5)}


def exponent_of(chance: float) -> float:
    """Return the exponent that a random number hides."""
    return [*_LAWS][min(int(3 * chance), 2)]


def _law(chance: float) -> dict[str, Any]:
    law, coefficient = _LAWS[exponent_of(chance)]
    return {"drag.law": law, "drag.coefficient": coefficient}


def _say_exponent(n: float) -> str:
    return Text("n = {value:g} is not it: now a top floats in other air, so record once more", value=n)


def _say_slope(b: float) -> str:
    return Text("b = {value:g} is not it: look at the line of the result once more, and record another", value=b)


TASKS: dict[str, Task] = {
    "catch": Task(
        "Catch it", "Let the drive take hold of the top: match the spin, then drive on.",
        "a drive holds a top only near its own spin, since the torque must not change its sense in every turn",
        "match", lambda look: look.is_held,
    ),
    "hold": Task(
        "Hold it for three minutes", "A free top is down after 90 s. Keep this one up, with a drive that holds it.",
        "the drive gives back what the air takes: the top turns behind it by the angle at which both torques are equal",
        "drive", lambda look: look.is_held, for_s=180.0,
    ),
    "mass": Task(
        "Find the mass that floats", "This top is too heavy by some tenths of a gram. Take washers off (What if), and "
        "put the top back, until it floats for 20 s.",
        "of 25 g only some tenths are free: field and weight balance at a height at which the field also holds the top",
        "washers_g", lambda look: look.floats, for_s=20.0, found=_say_mass, hidden=_mass,
    ),
    "fast": Task(
        "Reach 57 Hz", "Take the top up with the drive. At 0.1 Hz/s it is lost near 61 Hz: more slowly it goes on.",
        "the air takes the more the faster the top spins, and a ramp takes its part of the drive's torque, too",
        "frequency", lambda look: look.is_held and (look.spin_hz or 0.0) >= 57.0,
    ),
    "guess": Task(
        "Find n", "The drag goes as ω to the n. Record a spin-down in this air of another kind, analyze it, and say n.",
        "with n = 1 the spin halves in equal times; the higher n, the more the curve flattens; a fit tells best",
        "record", lambda look: look.answer is not None, hidden=_law,
        answers={"n = 1": 1.0, "n = 3/2": 1.5, "n = 2": 2.0},
        measures="spin", right=exponent_of, wrong=_say_exponent,
    ),
    "stem": Task(
        "Count the stem", "How often does the stem of a held top go round in a turn of the drive? Record the "
        "precession, analyze it, and say the slope b of its line.",
        "a top that follows its drive leans to a side that turns with it, so its stem goes round once a turn at every "
        "frequency: b = 1, and the line begins at 0",
        "experiment", lambda look: look.answer is not None, answers={"b = 1/2": 0.5, "b = 1": 1.0, "b = 2": 2.0},
        measures="precession", right=lambda _: 1.0, wrong=_say_slope,
    ),
}  # fmt: skip


class Tasks:
    """The tasks of a person: the one under way, and those that were reached.

    Attributes:
        name: of the task under way, in TASKS; empty: none.
        share: the part of the way to its goal, from 0 to 1.
        done: names of those that were reached, in order.
        is_measured: whether its experiment was recorded since it began.

    Args:
        seed: of the random numbers that hide what is hidden.
    """

    def __init__(self, seed: int) -> None:
        self._random, self._chance = np.random.default_rng(seed), 0.0
        self.name, self.share, self.done, self.is_measured = "", 0.0, list[str](), False
        self._since: float | None = None  # when the goal was there first, without a break, bench time [s]

    @property
    def hidden(self) -> dict[str, Any]:
        """What the task under way hides: keys of a scene."""
        return TASKS[self.name].hidden(self._chance) if self.name else {}

    def label(self, group: str, *, on_the_bench: bool) -> str:
        """Return the name of a group for a run: one of a top that a task hides is none of its others'.

        on_the_bench: whether the run is of the top on the bench.
        """
        return ": ".join(filter(None, (group, TASKS[self.name].title if self.hidden and on_the_bench else "")))

    def begin(self, name: str) -> None:
        """Begin a task in the place of the one under way; empty: none.  Raises CommandRefused."""
        if name and name not in TASKS:
            raise CommandRefused("{name}: one of {known} is expected", f"task = {name}", ", ".join(TASKS))
        self.name, self.share, self._since, self._chance = name, 0.0, None, float(self._random.uniform())
        self.is_measured = False

    def take_run(self, experiment: str) -> None:
        """Note that a run of an experiment was recorded."""
        self.is_measured |= bool(self.name) and experiment == TASKS[self.name].measures

    def is_right(self, answer: float) -> bool:
        """Return whether an answer is right.  Raises CommandRefused where none is asked, or it would be a guess."""
        if not self.name or not TASKS[self.name].answers:
            raise CommandRefused("no task asks for an answer: begin one that does")
        if not self.is_measured:
            raise CommandRefused("that would be a guess: first record what the task names, and analyze it")
        return answer == TASKS[self.name].right(self._chance)

    def look(self, look: Look) -> Task | None:
        """Return the task under way if its goal is reached at a moment."""
        task = TASKS.get(self.name)
        if task and (after := look.fell_after_s) and task.holds(replace(look, floats=True)):  # until it fell
            look, self._since = replace(look, floats=True), look.time_s - after
        if task is None or not task.holds(look):
            self._since, self.share = None, 0.0
            return None
        self._since = look.time_s if self._since is None else self._since
        self.share = min(1.0, (look.time_s - self._since) / task.for_s) if task.for_s else 1.0
        if self.share < 1:
            return None
        self.reach(self.name)
        return task

    def reach_at_once(self, look: Look) -> None:
        """Note the goals that are there and need neither time nor an answer, also those of other tasks."""
        for name, task in TASKS.items():
            if not task.for_s and not task.answers and task.holds(look):
                self.reach(name)

    def reach(self, name: str) -> None:
        """Note that a goal is reached, whether its task is under way or not."""
        self.done += [name] * (name not in self.done)
