"""The step that a tolerance takes, and the error at the end, forecast from the first seconds of a motion.

The compositions are symplectic, so their error is that of a slightly other motion: its frequencies are off by a little,
its phases by more and more, in proportion to the time.  A drive adds an error that does not grow:

    mean square of the error at the time t = offset² + (rate·t)²

A pilot run, the first seconds at two steps, shows offset and rate; error ∝ stepᵖ gives the step that the tolerance
takes.  The motion is cut into cells, at whose ends every run stops: between the corners of a drive, between samples,
and where neither is, into sixteenths of the pilot run.  A step divides its cell.

1. `search`: pilot runs, until one has nearly the right step.
2. `integrate_rest`: the rest of the motion at that step; the pilot run is its beginning, where its step is right.
3. `errors`: the forecast for the end, if a second run of the last seconds agrees; else from a second run of everything.

No forecast is made where its law may not hold (`run_by_forecast` returns None): where the top falls, where the drag
has a kink that the spin comes near to, with a magnet of finite size, and near to the limit of rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from levilab.simulator.accuracy import comes_near_zero, has_kink, rounding_error, turning_rate
from levilab.simulator.energy import spins_of
from levilab.simulator.kernels.loads import Disc, PiecewiseLinear
from levilab.simulator.kernels.motion import TIME, N, R
from levilab.simulator.kernels.splitting import mean_squares
from levilab.simulator.problem import NO_LIMITS, STEPS_IN_A_CALL, Problem, integrate, integrate_to_end
from levilab.simulator.stops import Stops, even_stops, stops_between

if TYPE_CHECKING:
    from collections.abc import Callable

Array = NDArray[np.float64]

#: Shorter motions [s] are integrated in the careful way.
SHORTEST_S = 1.0
#: The pilot run takes a fifth of a short motion, within these bounds [s], and a thirtieth of a long one: about one turn
#: of the slow sideways mode, and many of the precession.
PILOT_SHARE_OF_SHORT, PILOT_S, PILOT_SHARE = 1 / 5, (1.0, 2.0), 1 / 30
#: Blocks of a pilot run, at whose ends the two runs are compared.
BLOCKS = 16
#: Ratio of the steps of both runs: the other has the longer ones, or the shorter where the longer would be too long.
STEP_RATIO = 1.4
#: The longest step, and that of the other run, as the angle [rad] by which the axis turns meanwhile: from 1.3 times as
#: much on a scheme is no longer stable.
LONGEST_TURN, LONGEST_TURN_COMPARED = 7.5, 8.2

#: The first pilot run has the step of a typical error: this rate [rad/s] × time × (angle in a step)^order, medians of
#: random scenes.  Within a factor of 3 the first pilot run is the beginning of the result.
TYPICAL_RATES = {"undriven": 5e-12, "sine": 1.3e-10, "corners": 3e-11, "any split": 6e-11}

#: The share of the tolerance that the error is to have, by forecast, without a drive and with one, where the estimate
#: is surer; how far a forecast may lie above it (a factor); the share that the estimate is to have in a second try.
AIM, AIM_DRIVEN, MOST, AIM_AGAIN = 0.16, 0.35, 1.4, 0.6
#: Above this ratio of steps error ∝ stepᵖ is not trusted, and another pilot run is made.
MOST_EXTRAPOLATION = 1.8
#: Pilot runs, and runs of the whole motion, at most; then the careful way is taken.
MOST_PILOTS, MOST_TRIES = 3, 2

#: Safety factors of the estimates: of a forecast, for place and axis, and of a comparison of two whole runs.
SAFETY, SAFETY_COMPARED = (8.0, 3.5), 2.0
#: Mean squares of the differences in the later and the earlier half of a run differ by 7 where the error grows in
#: proportion to the time.  Above this, in the pilot run or in the last seconds, neighbours may part exponentially: all
#: of the motion is run twice.
MOST_GROWTH = 10.0
#: Ratio of the blocks of the last seconds to those of the pilot run: in fewer the place's error may grow as the square
#: of the time, by 14 to 31.
LAST_BLOCKS = 2
#: Shorter motions [s] are not checked at the end.
SHORTEST_TO_CHECK_S = 8.0
#: Least ratio of the tolerance to the error by rounding.
LEAST_OF_ROUNDING = 50.0
#: The rate of an error is at least this share of the differences over the time: a small one may be chance.
LEAST_RATE_SHARE = 0.2


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
    goes_off = drive.off_s is not None and drive.waveform != "off"
    if abs(duration) < SHORTEST_S or goes_off or isinstance(problem.model.magnet, Disc):
        return None
    turning = float(turning_rate(problem.model, problem.start))
    if turning == 0:
        return None
    cells = cells_of(problem, duration, samples)
    return _Forecast(problem, abs(duration), tolerance, turning, cells).run(progress)


# --- where runs stop ---


@dataclass(frozen=True)
class Cells:
    """A motion cut into cells, at whose ends every run stops.

    Attributes:
        stops: their ends, shape (n + 1,), and the drive in each.
        length: of a cell [s]; some may be shorter.
        block: number of cells in a block, at whose end two runs are compared.
    """

    stops: Stops
    length: float
    block: int

    @cached_property
    def lengths(self) -> Array:
        """Of each of them, shape (n,) [s]."""
        return np.abs(np.diff(self.stops.times))

    def fitting(self, step: float) -> float:
        """Return the longest step [s] up to this one that divides a cell."""
        return self.length / math.ceil(self.length / step * (1 - 1e-9))

    def run(self, step: float, first: int, last: int) -> Stops:
        """Return the stops of cells from first to last, exclusive, with steps no longer than this one [s]."""
        part = self.stops.part(first, last)
        counts = np.ceil(self.lengths[first:last] / step * (1 - 1e-9)).astype(np.int64)
        return replace(part, counts=np.maximum(counts, 1))

    def other_run(self, step: float, longest: float, first: int, last: int) -> tuple[Stops, float]:
        """Return the stops of a run to compare with that of `step`, and how many times as long its steps are.

        It stops at the ends of blocks, and at the last cell's.

        Args:
            step: of the run that it is compared with [s].
            longest: steps beyond it are unstable [s].
            first: cell.
            last: cell, exclusive.
        """
        count = self.block * round(self.length / step)
        fewer = min(round(count / STEP_RATIO), count - 1)
        stable = fewer > 0 and self.length * self.block / fewer <= longest
        others = fewer if stable else math.ceil(STEP_RATIO * count)
        ends = np.append(np.arange(first, last, self.block), last)
        whole = self.length * self.block / others
        lengths = np.abs(np.diff(self.stops.times[ends]))
        counts = np.maximum(np.ceil(lengths / whole * (1 - 1e-9)).astype(np.int64), 1)
        stops = Stops(self.stops.times[ends], counts, self.stops.levels[ends[:-1]], self.stops.slopes[ends[:-1]])
        return stops, count / others


def cells_of(problem: Problem, duration: float, samples: Array) -> Cells:
    """Cut a motion at the corners of its drive and at samples, and where neither is, into sixteenths of a pilot run."""
    begin, lasts = float(problem.start[TIME]), abs(duration)
    end = begin + duration
    block = _pilot_of(lasts) / BLOCKS
    if isinstance(problem.model.drive, PiecewiseLinear):
        length = 0.5 / problem.scene.drive.frequency_hz
        return Cells(stops_between(begin, end, length, problem.scene.drive, samples), length, 1)
    between = abs(float(samples[0]) - begin) if samples.size else lasts
    parts = math.ceil(between / block * (1 - 1e-9))
    length = between / parts
    count = math.ceil(lasts / length * (1 - 1e-9))
    times = begin + math.copysign(length, duration) * np.arange(count + 1, dtype=np.float64)
    times[parts * np.arange(1, samples.size + 1)] = samples
    times[-1] = end
    return Cells(even_stops(times, 1), length, max(1, int(block / length * (1 + 1e-9))))


# --- how an error grows ---


@dataclass(frozen=True)
class Trend:
    """Errors of place [m] and axis [rad], a column each, that grow with the time.

    Attributes:
        offset2, rate2: squares of offset and rate, shape (2,).
        growth: mean square of the differences in the later half over that in the earlier one, the larger of both.
    """

    offset2: tuple[float, float]
    rate2: tuple[float, float]
    growth: float

    def at(self, time: float) -> tuple[float, float]:
        """Return the errors of place [m] and axis [rad] at a time [s] after the start."""
        place, axis = (math.sqrt(a + b * time * time) for a, b in zip(self.offset2, self.rate2, strict=True))
        return place, axis


def trend_of(states: Array, every: int, others: Array, factor: float) -> Trend | None:
    """Fit the trend of an error to the differences of two runs.

    Args:
        states: of the one at its stops, shape (n, 18).
        every: how many stops of the one there are to one of the other.
        others: of the other at its stops, shape (k, 18).
        factor: ratio of the differences to the error.

    Returns:
        The trend; None where runs are too short to show one.
    """
    if len(others) < 3:
        return None
    early_t2, *early, late_t2, late_place, late_axis = mean_squares(states, every, others)
    late = (late_place, late_axis)
    if not (min(early) > 0 and max(late) < math.inf):
        return None
    rate2 = [
        max((b - a) / (late_t2 - early_t2), LEAST_RATE_SHARE**2 * b / late_t2) for a, b in zip(early, late, strict=True)
    ]
    offset2 = [max(b - rate * late_t2, 0.0) for b, rate in zip(late, rate2, strict=True)]
    return Trend(
        (offset2[0] / factor**2, offset2[1] / factor**2),
        (rate2[0] / factor**2, rate2[1] / factor**2),
        max(late_place / early[0], late_axis / early[1]),
    )


# --- the search for the step, and the run at it ---


@dataclass(frozen=True)
class _Beginning:
    """What a run begins with.

    Attributes:
        step: of the run [s].
        errors: of place [m] and axis [rad] at the end, by forecast.
        growth: of the pilot run that forecast them.
        states: at the ends of the cells that are done, shape (n + 1, 18).
    """

    step: float
    errors: tuple[float, float]
    growth: float
    states: Array


class _Forecast:
    """The search for the step, and the run at it."""

    def __init__(self, problem: Problem, lasts: float, tolerance: float, turning: float, cells: Cells) -> None:
        self.problem, self.lasts, self.tolerance, self.turning, self.cells = problem, lasts, tolerance, turning, cells
        self.order = problem.scheme.order
        self.driven = problem.model.drive is not None
        self.aim = AIM_DRIVEN if self.driven else AIM
        self.all = cells.lengths.size
        self.pilot = self._pilot_cells()

    def run(self, progress: Callable[[float], None] | None) -> Outcome | None:
        """Return the motion, or None."""
        beginning = self.search()
        for tries in range(1, MOST_TRIES + 1):
            if beginning is None:
                return None
            states = self.integrate_rest(beginning, progress)
            if states is None:
                return None
            steps = int(self.cells.run(beginning.step, 0, self.all).counts.sum())
            errors = self.errors(states, steps, beginning)
            if errors is None:
                return None
            if max(errors) <= self.tolerance:
                return Outcome(states, steps, beginning.step, errors, tries)
            beginning = self._shorter(beginning, max(errors))
        return None

    def search(self) -> _Beginning | None:
        """Return the step that fits, with the beginning of the motion where it was found at this step."""
        step = self._fitting(self._typical_step())
        for _ in range(MOST_PILOTS):
            pilot = self._pilot(step)
            if pilot is None:
                return None
            share = max(pilot.errors) / self.tolerance
            wanted = self._fitting(step * (self.aim / share) ** (1 / self.order))
            if 1 / MOST_EXTRAPOLATION <= wanted / step <= MOST_EXTRAPOLATION:
                # longer steps have to make up for a second beginning
                keep = share <= MOST * self.aim and wanted * (1 - self.pilot / self.all) <= step
                return pilot if keep else self._at_other_step(pilot, wanted)
            step = wanted
        return None

    def _typical_step(self) -> float:
        """Return the step [s] at which a typical error is the one aimed at."""
        drive = self.problem.model.drive
        if self.problem.scheme.any_split:
            rate = TYPICAL_RATES["any split"]
        elif drive is None:
            rate = TYPICAL_RATES["undriven"]
        elif isinstance(drive, PiecewiseLinear):
            rate = TYPICAL_RATES["corners"]
        else:
            rate = TYPICAL_RATES["sine"]
        return float((self.aim * self.tolerance / (rate * self.lasts)) ** (1 / self.order) / self.turning)

    def _fitting(self, step: float) -> float:
        return self.cells.fitting(min(step, LONGEST_TURN / self.turning))

    def _pilot_cells(self) -> int:
        """Return how many cells the pilot run has: whole blocks, or all cells."""
        wanted = _pilot_of(self.lasts)
        cells = int(np.searchsorted(np.cumsum(self.cells.lengths), wanted * (1 - 1e-9))) + 1
        cells = self.cells.block * math.ceil(cells / self.cells.block)
        return cells if wanted <= 0.7 * self.lasts and cells < self.all else self.all

    def _pilot(self, step: float) -> _Beginning | None:
        """Integrate the beginning at this step [s] and another one; None where the top falls or no trend is seen."""
        stops = self.cells.run(step, 0, self.pilot)
        if stops.counts.sum() > STEPS_IN_A_CALL:
            return None
        states, through = self.problem.advance_to_stops(self.problem.start, stops, self.problem.escape)
        trend = self._trend(states, step, 0, self.pilot) if through else None
        return None if trend is None else _Beginning(step, trend.at(self.lasts), trend.growth, states)

    def _trend(self, states: Array, step: float, first: int, last: int) -> Trend | None:
        """Compare a run, whose states begin at the cell `first`, with another one of the same cells."""
        stops, ratio = self._other_run(step, first, last)
        others, through = self.problem.advance_to_stops(states[0], stops, NO_LIMITS)
        if not through:
            return None
        whole = len(others) if (last - first) % self.cells.block == 0 else len(others) - 1
        return trend_of(states, self.cells.block, others[:whole], abs(ratio**self.order - 1))

    def _other_run(self, step: float, first: int, last: int) -> tuple[Stops, float]:
        return self.cells.other_run(step, LONGEST_TURN_COMPARED / self.turning, first, last)

    def _at_other_step(self, pilot: _Beginning, step: float) -> _Beginning:
        """Return what a pilot run says of another step, and no beginning."""
        place, axis = (error * (step / pilot.step) ** self.order for error in pilot.errors)
        return _Beginning(step, (place, axis), pilot.growth, self.problem.start[None])

    def _shorter(self, begun: _Beginning, error: float) -> _Beginning | None:
        """Return a shorter step after one whose error was too large; None where that is no matter of the step."""
        step = self._fitting(begun.step * (AIM_AGAIN * self.tolerance / error) ** (1 / self.order))
        return self._at_other_step(begun, step) if begun.step / MOST_EXTRAPOLATION <= step < begun.step else None

    # --- all of the motion ---

    def integrate_rest(self, begun: _Beginning, progress: Callable[[float], None] | None) -> Array | None:
        """Integrate the cells that are left; returns the states at all of them, or None where the top falls."""
        done = len(begun.states) - 1
        if done == self.all:
            if progress is not None:
                progress(1.0)
            return begun.states
        rest = replace(self.problem, start=begun.states[-1])
        states, fell, _ = integrate(rest, self.cells.run(begun.step, done, self.all), progress)
        return None if fell is not None else np.concatenate([begun.states, states[1:]])

    def errors(self, states: Array, steps: int, begun: _Beginning) -> tuple[float, float] | None:
        """Estimate the errors of place [m] and axis [rad] at the end; None where no estimate holds."""
        problem = self.problem
        if has_kink(problem.model.drag) and np.any(comes_near_zero(spins_of(problem.scene, states))):
            return None
        rounding = rounding_error(problem.scheme, steps, states[-1])
        if LEAST_OF_ROUNDING * max(rounding) > self.tolerance:
            return None
        found = None if self.driven else self._confirmed(states, begun)
        if found is None:
            found = self._compared(states, begun.step)
        return None if found is None else (found[0] + rounding[0], found[1] + rounding[1])

    def _confirmed(self, states: Array, begun: _Beginning) -> tuple[float, float] | None:
        """Estimate the errors from the forecast and a second run of the last seconds; None where these disagree."""
        forecast = begun.errors
        if begun.growth > MOST_GROWTH:
            return None
        if self.lasts >= SHORTEST_TO_CHECK_S:
            first = max(self.all - LAST_BLOCKS * BLOCKS * self.cells.block, 0)
            trend = self._trend(states[first:], begun.step, first, self.all)
            if trend is None or trend.growth > MOST_GROWTH:
                return None
            last = trend.at(self.lasts)
            forecast = (
                math.hypot(forecast[0], last[0]) / math.sqrt(2),
                math.hypot(forecast[1], last[1]) / math.sqrt(2),
            )
        return SAFETY[0] * forecast[0], SAFETY[1] * forecast[1]

    def _compared(self, states: Array, step: float) -> tuple[float, float] | None:
        """Estimate the errors at the end from a second run of all of the motion."""
        stops, ratio = self._other_run(step, 0, self.all)
        end = integrate_to_end(self.problem, stops)
        factor = SAFETY_COMPARED / abs(ratio**self.order - 1)
        place, axis = (factor * math.dist(end[part].tolist(), states[-1][part].tolist()) for part in (R, N))
        return (place, axis) if math.isfinite(place + axis) else None


def _pilot_of(lasts: float) -> float:
    """Return how long the pilot run of a motion lasts [s]."""
    return max(min(max(PILOT_SHARE_OF_SHORT * lasts, PILOT_S[0]), PILOT_S[1]), PILOT_SHARE * lasts)
