"""The step that a tolerance takes, and the error at the end, forecast from the first second or two of a motion.

The compositions are symplectic, so their error is that of a slightly other motion: its frequencies are off by a little,
its phases by more and more, in proportion to the time.  A drive adds an error that does not grow.  Both are seen in the
first second or two, by a second run with other steps; the rest of the motion is integrated once.

    mean square of the error at the time t = offset² + (rate·t)²

The motion is integrated in the careful way instead (`levilab.simulator.single`), with coarser runs of all of it, where
this law may not hold: where the top falls, where the error grows faster in the pilot run or at the end, where the drag
has a kink that the spin comes near to, with a magnet of finite size, with events, and near to the limit of rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from levilab.simulator.accuracy import comes_near_zero, has_kink, rounding_error, turning_rate
from levilab.simulator.energy import spins_of
from levilab.simulator.kernels.loads import Disc, PiecewiseLinear
from levilab.simulator.kernels.motion import TIME, N, R
from levilab.simulator.kernels.splitting import mean_squares
from levilab.simulator.problem import NO_LIMITS, STEPS_IN_A_CALL, Problem, integrate, integrate_to_end
from levilab.simulator.stops import STEPS_BETWEEN_STOPS, Stops, even_stops, stops_between

if TYPE_CHECKING:
    from collections.abc import Callable

Array = NDArray[np.float64]

#: The pilot run takes this share of the duration, and so many seconds at least: about one turn of the slow sideways
#: mode, and many of the precession.
PILOT_SHARE, PILOT_S, PILOT_SHARE_OF_SHORT = 1 / 30, 2.0, 1 / 5
#: Shorter motions [s] are integrated in the careful way.
SHORTEST_S = 1.0
#: Stops of the pilot run, where both runs are compared.
PILOT_STOPS = 16
#: The other run of the pilot has steps so many times as long, or as short where they would be too long.
STEP_RATIO = 1.4
#: The longest step, as the angle [rad] by which the axis turns meanwhile: near it a scheme is hardly of its order, and
#: at 1.3 times as much no longer stable.
LONGEST_TURN = 7.5
LONGEST_TURN_COMPARED = 8.2

#: A typical error is this times (angle in a step)^order times the time [rad/s]; a sine's part that does not grow is
#: that of so many seconds.  Without a drive it is that of a top that leans by 0.02 rad, and grows with its lean.
#: They are medians of random scenes; within a factor of 3 the first pilot run is the beginning of the result.
TYPICAL_RATE, TYPICAL_LEAN_RAD = 5e-12, 0.02
TYPICAL_RATE_OF_SINE, TYPICAL_OFFSET_OF_SINE_S, TYPICAL_RATE_OF_CORNERS = 1.3e-10, 4.0, 3e-11
TYPICAL_RATE_OF_ANY_SPLIT = 6e-11

#: The share of the tolerance that the error is to have, by forecast, and the most.
AIM, MOST = 0.16, 0.22
#: The share of the tolerance that the estimate is to have where it was above the tolerance.
AIM_AGAIN = 0.6
#: An estimate is so many times what is forecast; the place's error grows less evenly, and is far below the axis's.
SAFETY, SAFETY_PLACE = 3.5, 8.0
#: An estimate from two runs of all of the motion is so many times what they give.
SAFETY_COMPARED = 3.0
#: The last seconds that are integrated twice [s].
TAIL_S = 2.0
#: At this ratio of steps the law error ∝ step^order is no longer trusted, and another pilot run is made.
MOST_EXTRAPOLATION = 1.8
#: Pilot runs and runs of the whole motion at most; then the careful way is taken.
MOST_PILOTS, MOST_TRIES = 4, 2
#: Mean squares of the differences in the later and in the earlier half of the pilot run differ by a factor of 7 where
#: the error grows in proportion to the time.  Above this neighbours may part exponentially: all of it is run twice.
#: At the upper edge of the spins the place's shows it first, by 12 to 800; in regular motions it is at most 8.5.
MOST_GROWTH = 10.0
#: Shorter rests of a motion [s] are not checked at the end.
SHORTEST_TO_CHECK_S = 8.0
#: The error may grow so many times as fast at the end as in the pilot run, for the motion changes.
MOST_CHANGE = 10.0
#: The tolerance is so many times the error by rounding at least.
LEAST_OF_ROUNDING = 50.0
#: The error of a rate is at least this share of the differences over the time: a small one may be chance.
LEAST_RATE_SHARE, LEAST_RATE_SHARE_DRIVEN = 0.2, 0.06


@dataclass(frozen=True)
class Outcome:
    """A motion integrated once, at the step that was forecast.

    Attributes:
        states: at the stops, shape (n, 18).
        steps: how many were taken.
        step: their length [s].
        errors: of place [m] and axis [rad] at the end, estimated.
        tries: how many times all of the motion was integrated.
    """

    states: Array
    steps: int
    step: float
    errors: tuple[float, float]
    tries: int


@dataclass(frozen=True)
class _Trend:
    """How the errors of place [m] and axis [rad] grow: pairs of offset and rate."""

    offset2: tuple[float, float]
    rate2: tuple[float, float]
    growth: float

    def at(self, time: float) -> tuple[float, float]:
        """Return the errors of place [m] and axis [rad] so long [s] after the start."""
        (a, b), (c, d), t2 = self.offset2, self.rate2, time * time
        return math.sqrt(a + c * t2), math.sqrt(b + d * t2)

    def times(self, factor: float) -> _Trend:
        """Return the trend of errors so many times as large."""
        (a, b), (c, d), f2 = self.offset2, self.rate2, factor * factor
        return _Trend((a * f2, b * f2), (c * f2, d * f2), self.growth)


@dataclass(frozen=True)
class _Pilot:
    """The beginning of a motion, integrated at two steps.

    Attributes:
        states: of the run at `step`, at its stops, shape (n, 18).
        steps: taken in it.
        step: [s].
        trend: of the errors at that step.
    """

    states: Array
    steps: int
    step: float
    trend: _Trend


def run_by_forecast(
    problem: Problem,
    duration: float,
    tolerance: float,
    samples: Array,
    progress: Callable[[float], None] | None = None,
) -> Outcome | None:
    """Integrate a motion at the step that its tolerance takes, by forecast.

    Args:
        problem: where it starts, and what moves it.
        duration: [s], negative to go back in time.
        tolerance: wanted error of the place [m] and the axis [rad] at the end.
        samples: times at which the state is wanted, too, shape (n,) [s].
        progress: called with the share of the steps that are done.

    Returns:
        The motion; None where the forecast may not hold.
    """
    drive = problem.scene.drive
    smooth = drive.off_s is None or drive.waveform == "off"
    if (
        abs(duration) < SHORTEST_S
        or turning_rate(problem.model, problem.start) == 0
        or isinstance(problem.model.magnet, Disc)
        or not smooth
    ):
        return None
    return _Forecast(problem, duration, tolerance, samples).run(progress)


class _Forecast:
    """The search for the step, and the run at it."""

    def __init__(self, problem: Problem, duration: float, tolerance: float, samples: Array) -> None:
        self.problem, self.duration, self.tolerance, self.samples = problem, duration, tolerance, samples
        self.begin = float(problem.start[TIME])
        self.end = self.begin + duration
        self.lasts, self.sign = abs(duration), math.copysign(1.0, duration)
        self.order = problem.scheme.order
        self.kinked = isinstance(problem.model.drive, PiecewiseLinear)
        turning = turning_rate(problem.model, problem.start)
        self.longest = min(LONGEST_TURN / turning, self.lasts / 8)
        self.longest_compared = LONGEST_TURN_COMPARED / turning
        self.turning = turning
        #: Time between stops that every step has to divide, if there is one [s].
        self.cell: float | None = None
        if self.kinked:
            self.cell = 0.5 / problem.scene.drive.frequency_hz
            self.longest_compared = max(self.longest_compared, self.cell)
            self.corners = stops_between(self.begin, self.end, self.cell, problem.scene.drive, samples)
            self.intervals = np.abs(np.diff(self.corners.times))
        elif samples.size > PILOT_STOPS:
            self.cell = abs(float(samples[0]) - self.begin)

    def run(self, progress: Callable[[float], None] | None) -> Outcome | None:
        """Return the motion, or None."""
        pilot = self._search()
        tries = 0
        while pilot is not None and tries < MOST_TRIES:
            tries += 1
            found = self._integrate(pilot, progress)
            errors = None if found is None else self._errors(*found, pilot)
            if found is None or errors is None:
                return None
            if max(errors) <= self.tolerance:
                return Outcome(*found, pilot.step, errors, tries)
            pilot = self._shorter(pilot, max(errors))
        return None

    def _search(self) -> _Pilot | None:
        """Return the beginning of the motion at a step that fits, or that step and no beginning."""
        step = self._fitting(self._typical_step())
        for _ in range(MOST_PILOTS):
            pilot = self._pilot(step)
            share = 0.0 if pilot is None else max(pilot.trend.at(self.lasts)) / self.tolerance
            if pilot is None or share == 0:
                return None
            wanted = self._fitting(pilot.step * (AIM / share) ** (1 / self.order))
            if max(wanted / pilot.step, pilot.step / wanted) > MOST_EXTRAPOLATION:
                step = wanted
                continue
            begun = abs(float(pilot.states[-1, TIME]) - self.begin) / self.lasts
            # longer steps have to make up for a second beginning
            keep = share <= MOST and wanted * (1 - begun) <= pilot.step
            return pilot if keep else self._at_other_step(pilot, wanted)
        return None

    def _shorter(self, pilot: _Pilot, error: float) -> _Pilot | None:
        """Return a shorter step after one whose error was too large; None where that is no matter of the step."""
        step = self._fitting(pilot.step * (AIM_AGAIN * self.tolerance / error) ** (1 / self.order))
        fits = pilot.step / MOST_EXTRAPOLATION <= step < pilot.step
        return self._at_other_step(pilot, step) if fits else None

    def _at_other_step(self, pilot: _Pilot, step: float) -> _Pilot:
        """Return what a pilot run says of another step, and no beginning."""
        trend = pilot.trend.times((step / pilot.step) ** self.order)
        return _Pilot(self.problem.start[None], 0, step, trend)

    def _typical_step(self) -> float:
        drive, lasts = self.problem.model.drive, self.lasts
        if self.problem.scheme.any_split:
            error = TYPICAL_RATE_OF_ANY_SPLIT * lasts
        elif drive is None:
            lean = math.hypot(*self.problem.start[N][:2].tolist())
            error = TYPICAL_RATE * (max(lean, 1e-3) / TYPICAL_LEAN_RAD) ** 0.65 * lasts
        elif self.kinked:
            error = TYPICAL_RATE_OF_CORNERS * lasts
        else:
            error = TYPICAL_RATE_OF_SINE * (lasts + TYPICAL_OFFSET_OF_SINE_S)
        angle = (AIM * self.tolerance / error) ** (1 / self.order)
        return float(min(angle, LONGEST_TURN) / self.turning)

    def _fitting(self, step: float) -> float:
        """Return the longest step [s] up to this one that divides the time between stops."""
        step = min(step, self.longest)
        return step if self.cell is None else self.cell / math.ceil(self.cell / step * (1 - 1e-9))

    # --- the pilot run ---

    def _pilot(self, step: float) -> _Pilot | None:
        """Integrate the beginning at this step [s] and another one, and compare."""
        wanted = max(min(PILOT_S, max(1.0, self.lasts * PILOT_SHARE_OF_SHORT)), PILOT_SHARE * self.lasts)
        if wanted > 0.7 * self.lasts:
            wanted = self.lasts
        most = STEPS_IN_A_CALL / 4 * step
        if most < min(1.0, self.lasts):
            return None
        wanted = min(wanted, most)
        one, other, ratio = self._pilot_stops(step, wanted)
        start = self.problem.start
        states, through = self.problem.advance_to_stops(start, one, self.problem.escape)
        compared, finished = self.problem.advance_to_stops(start, other, NO_LIMITS)
        if not (through and finished):
            return None
        every = (one.times.size - 1) // (other.times.size - 1)
        least = LEAST_RATE_SHARE if self.problem.model.drive is None else LEAST_RATE_SHARE_DRIVEN
        trend = _trend(states, every, compared, abs(ratio**self.order - 1), least)
        if trend is None:
            return None
        length = abs(one.times[1] - one.times[0]) / one.counts[0] if not self.kinked else step
        return _Pilot(states, int(one.counts.sum()), float(length), trend)

    def _pilot_stops(self, step: float, lasts: float) -> tuple[Stops, Stops, float]:
        """Return the stops of both runs of the pilot, and how many times as long the steps of the other one are."""
        begin, sign = self.begin, self.sign
        if self.kinked and self.cell is not None:
            count = round(self.cell / step)
            others = self._other_count_of_cell(count)
            until = int(np.searchsorted(np.cumsum(self.intervals), lasts * (1 - 1e-9))) + 1
            one, other = (self._at_corners(self.cell / n, 0, until) for n in (count, others))
            return one, other, count / others
        if self.cell is not None:
            count = round(self.cell / step)
            cells = max(1, math.ceil(max(4.0, lasts / (PILOT_STOPS * step)) / count))
            blocks = max(min(int(self.samples.size / cells), math.ceil(lasts / (cells * self.cell))), 1)
            inside, step = count * cells, self.cell / count
            times = np.concatenate([[begin], self.samples[: blocks * cells]])
            one = even_stops(times, count)
            others = self._other_count(step, inside)
            return one, even_stops(times[::cells], others), inside / others
        inside = max(4, math.ceil(lasts / (PILOT_STOPS * step)))
        blocks = max(6, round(lasts / (inside * step)))
        length = lasts if lasts == self.lasts else min(blocks * inside * step, self.lasts)
        blocks = max(blocks, math.ceil(length / (inside * self.longest) * (1 - 1e-9)))
        ends: Array = np.linspace(begin, begin + sign * length, blocks + 1)
        others = self._other_count(length / (blocks * inside), inside)
        return even_stops(ends, inside), even_stops(ends, others), inside / others

    def _other_count(self, step: float, count: int) -> int:
        """Return how many steps the other run takes where the one takes `count`."""
        fewer = round(count / STEP_RATIO)
        return fewer if step * count / fewer <= self.longest_compared else math.ceil(STEP_RATIO * count)

    def _at_corners(self, step: float, first: int, last: int) -> Stops:
        """Return the stops from one corner of the drive to another, by number, with steps no longer than this [s]."""
        part = self.corners.part(first, last)
        counts = np.ceil(self.intervals[first:last] / step * (1 - 1e-9)).astype(np.int64)
        return replace(part, counts=np.maximum(counts, 1))

    def _other_count_of_cell(self, count: int) -> int:
        """Return how many steps the other run takes between two corners of the drive, where the one takes `count`."""
        cell = self.cell or 0.0
        fewer = min(count - 1, int(count / (STEP_RATIO - 0.07)))
        return fewer if fewer and cell / fewer <= self.longest_compared else math.ceil(STEP_RATIO * count)

    # --- all of the motion ---

    def _integrate(self, pilot: _Pilot, progress: Callable[[float], None] | None) -> tuple[Array, int] | None:
        """Integrate from the end of the pilot run, or from the start where it is at another step.

        Returns:
            The states at the stops, and the steps taken; None where the top falls.
        """
        states, steps = pilot.states, pilot.steps
        if self.samples.size and self.cell is None:  # the pilot run does not stop at them
            states, steps = self.problem.start[None], 0
        reached = float(states[-1, TIME])
        if abs(self.end - reached) <= 1e-9 * self.lasts:
            if progress is not None:
                progress(1.0)
            return states, steps
        if self.kinked:
            stops = self._at_corners(pilot.step, len(states) - 1, self.intervals.size)
        else:
            stops = self._stops(reached, pilot.step, (self.samples - reached) * self.sign > 1e-12)
        rest, fell, taken = integrate(replace(self.problem, start=states[-1]), stops, progress)
        return None if fell is not None else (np.concatenate([states, rest[1:]]), steps + taken)

    def _errors(self, states: Array, steps: int, pilot: _Pilot) -> tuple[float, float] | None:
        """Estimate the errors of place [m] and axis [rad] at the end; None where no estimate holds."""
        problem = self.problem
        if has_kink(problem.model.drag) and np.any(comes_near_zero(spins_of(problem.scene, states))):
            return None
        rounding = rounding_error(problem.scheme, steps, states[-1])
        if LEAST_OF_ROUNDING * max(rounding) > self.tolerance:
            return None
        found = None if problem.model.drive is not None else self._trend_to_the_end(states, pilot)
        if found is None:
            found = self._compared(states, pilot.step)
        return None if found is None else (found[0] + rounding[0], found[1] + rounding[1])

    def _stops(self, reached: float, step: float, which: NDArray[np.bool_]) -> Stops:
        """Return the stops from a time on, with some before the end, where a second run begins."""
        drive, samples = self.problem.scene.drive, self.samples[which]
        if samples.size or self.sign * (self.end - reached) < SHORTEST_TO_CHECK_S:
            return stops_between(reached, self.end, step * (1 + 1e-9), drive, samples)
        count = math.ceil(abs(self.end - reached) / step * (1 - 1e-9))
        inside = max(4, math.ceil(TAIL_S / (PILOT_STOPS * step)))
        blocks = min(PILOT_STOPS, (count - 1) // inside)
        before = count - inside * blocks
        exact = (self.end - reached) / count
        cuts = [*range(0, before, STEPS_BETWEEN_STOPS), *range(before, count + 1, inside)]
        return Stops(
            reached + exact * np.array(cuts, dtype=np.float64),
            np.diff(cuts),
            np.ones(len(cuts) - 1),
            np.zeros(len(cuts) - 1),
        )

    def _trend_to_the_end(self, states: Array, pilot: _Pilot) -> tuple[float, float] | None:
        """Estimate the errors at the end from the trend of the pilot run, and from that of the last seconds.

        Returns:
            The errors of place [m] and axis [rad]; None where they may have grown in another way.
        """
        if pilot.trend.growth > MOST_GROWTH:
            return None
        place, axis = pilot.trend.at(self.lasts)
        tail = self._tail(states, pilot.step)
        if tail is not None:
            every, first, stops, factor = tail
            ends, through = self.problem.advance_to_stops(states[first], stops, NO_LIMITS)
            trend = _trend(states[first:], every, ends, factor) if through else None
            if trend is None or trend.growth > MOST_GROWTH:
                return None
            others = trend.at(self.lasts)
            if max(others) > MOST_CHANGE * max(place, axis):
                return None
            place, axis = math.hypot(place, others[0]) / math.sqrt(2), math.hypot(axis, others[1]) / math.sqrt(2)
        return SAFETY_PLACE * place, SAFETY * axis

    def _tail(self, states: Array, step: float) -> tuple[int, int, Stops, float] | None:
        """Return what a second run of the last seconds needs; None where the motion is short.

        Returns:
            How many stops of the first run there are to one of the second, the state it begins at, its stops, and how
            many times as large as the error the difference is.
        """
        times = states[:, TIME]
        if self.lasts < SHORTEST_TO_CHECK_S or len(times) < PILOT_STOPS // 2:
            return None
        first = int(np.searchsorted(times * self.sign, (self.end - self.sign * 1.01 * TAIL_S) * self.sign))
        first = min(first, len(times) - 3)
        every = max(1, (len(times) - 1 - first) // PILOT_STOPS)
        first = len(times) - 1 - every * ((len(times) - 1 - first) // every)
        cuts = times[first::every]
        count = max(1, round(abs(cuts[1] - cuts[0]) / step))
        others = self._other_count(abs(cuts[1] - cuts[0]) / count, count)
        return every, first, even_stops(cuts, others), abs((count / others) ** self.order - 1)

    def _compared(self, states: Array, step: float) -> tuple[float, float] | None:
        """Estimate the errors at the end from a second run of all of the motion."""
        if self.kinked and self.cell is not None:
            count = round(self.cell / step)
            others = self._other_count_of_cell(count)
            stops = self._at_corners(self.cell / others, 0, self.intervals.size)
        else:
            count = math.ceil(self.lasts / step)
            others = self._other_count(step, count)
            stops = stops_between(self.begin, self.end, self.lasts / others * (1 + 1e-9), self.problem.scene.drive)
        ratio = count / others
        end = integrate_to_end(self.problem, stops)
        factor = abs(ratio**self.order - 1)
        place, axis = (math.dist(end[part].tolist(), states[-1][part].tolist()) / factor for part in (R, N))
        if not math.isfinite(place + axis):
            return None
        return SAFETY_COMPARED * place, SAFETY_COMPARED * axis


def _trend(states: Array, every: int, others: Array, factor: float, least: float = LEAST_RATE_SHARE) -> _Trend | None:
    """Fit the trend of an error to the differences of two runs, which are `factor` times the error.

    Args:
        states: of the one at its stops, shape (n·every + 1, 18).
        every: how many stops of the one there are to one of the other.
        others: of the other at its stops, shape (n + 1, 18).
        factor: see above.
        least: of the rate, as a share of the differences over the time.
    """
    if len(others) < 3:
        return None
    early_t2, *early, late_t2, late_place, late_axis = mean_squares(states, every, others)
    if not min(early) > 0:
        return None
    growth = max(late_place / early[0], late_axis / early[1])
    if not growth < math.inf:
        return None
    offsets, rates = [], []
    for before, after in zip(early, (late_place, late_axis), strict=True):
        rate2 = max((after - before) / (late_t2 - early_t2), least**2 * after / late_t2)
        rates.append(rate2 / factor**2)
        offsets.append(max(after - rate2 * late_t2, 0.0) / factor**2)
    return _Trend((offsets[0], offsets[1]), (rates[0], rates[1]), growth)
