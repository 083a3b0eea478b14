"""The step that a tolerance takes, measured on the beginning of a motion.

A composition of order p has the error c·hᵖ.  The compositions are symplectic, so that their error is that of slightly
other frequencies: it grows in proportion to the time.  Two short runs at the steps h and 2h show how fast it grows, and
with the order the step at which the whole motion has the error that is wanted.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from analysis.arrays import Array
from levilab.simulator.accuracy import SAFETY_FACTOR
from levilab.simulator.kernels.motion import TIME, N, R
from levilab.simulator.problem import Problem, Stretch
from levilab.simulator.stops import Stops

#: A pilot run lasts a tenth of the motion, and a second at least: two thirds of a turn of the slow sideways swing and
#: seven of the precession.  In less the part of an error that swings outweighs the one that grows.
PILOT_SHARE, SHORTEST_PILOT_S = 0.1, 1.0
#: Times at which the two runs are compared.
COMPARISONS = 16
#: The estimate wanted of the result, as a share of the tolerance: a pilot run may be wrong by a factor of two.
AIM = 0.5
#: A drive adds an error that does not grow.  The growing part is taken for this share of the whole at the least: the
#: error swings, and a lower share may be chance.
LEAST_GROWING_SHARE = 0.2
#: A step shorter than the pilot run's by more than this ratio takes another pilot run: the error of far longer steps
#: is not yet in proportion to hᵖ.
TRUSTED_RATIO = 2.0


@dataclass(frozen=True)
class Pilot:
    """The error of a motion as its beginning shows it.

    Attributes:
        step: of the whole motion, for the wanted error [s].
        offset, rate: of the error √(offset² + (rate·t)²), the larger of place [m] and axis [rad], over stepᵖ.
    """

    step: float
    offset: float
    rate: float

    def error_at(self, time: float) -> float:
        """Return the error over stepᵖ at a time [s] after the start."""
        return math.hypot(self.offset, self.rate * time)


def step_power(stops: Stops, order: int) -> float:
    """Return the mean of stepᵖ over the time [sᵖ]: the error of a run is in proportion to it."""
    lengths = abs(stops.times[1:] - stops.times[:-1])
    return float(lengths @ (lengths / stops.counts) ** order / lengths.sum())


def pilot_of(problem: Problem, duration: float, tolerance: float, longest: float) -> Pilot | None:
    """Measure the step that a tolerance takes.

    Args:
        problem: where the motion starts, and what moves it.
        duration: [s], negative to go back in time.
        tolerance: wanted error of the place [m] and the axis [rad] at the end.
        longest: no step is longer [s].

    Returns:
        The step and the error's rate; None for a motion so short that it is its own pilot run, and where the top falls.
    """
    lasts = max(PILOT_SHARE * abs(duration), SHORTEST_PILOT_S)
    if 2 * lasts > abs(duration):
        return None
    order = problem.scheme.order
    found, step = None, longest / 2
    for _ in range(2):
        trend = _trend(problem, math.copysign(lasts, duration), step)
        if trend is None:
            return found
        found = Pilot(longest, *trend)
        wanted = (AIM / SAFETY_FACTOR * tolerance / found.error_at(duration)) ** (1 / order)
        found = replace(found, step=min(wanted, longest))
        nearer = min(wanted, longest / 2)
        if nearer >= step / TRUSTED_RATIO:
            break
        step = nearer
    return found


def _trend(problem: Problem, duration: float, step: float) -> tuple[float, float] | None:
    """Return offset and rate of the error, from runs at a step [s] and at twice that; None if the top falls."""
    begin, order = float(problem.start[TIME]), problem.scheme.order
    elapsed: Array = duration / COMPARISONS * np.arange(1, COMPARISONS + 1, dtype=np.float64)
    stops = problem.stops(begin + duration, step, begin + elapsed, escape=problem.escape)
    twice = (
        problem.stops(begin + duration, 2 * step, begin + elapsed, escape=problem.escape)
        if problem.triggered
        else replace(stops, counts=(stops.counts + 1) // 2)
    )
    both = [stops, twice]
    runs, powers = [], [step_power(one, order) for one in both]
    stretches = [Stretch(problem.start, one, problem.escape) for one in both]
    for one, (states, through) in zip(both, problem.advance_together(stretches), strict=True):
        if not through:
            return None
        runs.append(states[np.searchsorted(abs(one.times - begin), abs(elapsed) * (1 - 1e-9))])
    if powers[1] == powers[0]:
        return None
    apart = (runs[1] - runs[0]) / (powers[1] - powers[0])
    squares = np.maximum(*((apart[:, part] ** 2).sum(axis=1) for part in (R, N)))
    early, late = squares.reshape(2, -1).mean(axis=1).tolist()
    t2_early, t2_late = (elapsed**2).reshape(2, -1).mean(axis=1).tolist()
    if not 0 < late < math.inf:
        return None
    rate2 = max((late - early) / (t2_late - t2_early), LEAST_GROWING_SHARE**2 * late / t2_late)
    return math.sqrt(max(late - rate2 * t2_late, 0.0)), math.sqrt(rate2)
