"""Edges: place each turn's pulse by the signal right of its middle minus the signal left of it."""

from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array
from analysis.pulses.matched import turn_times
from analysis.pulses.regression import Fit, Grid, fit_turns, median
from analysis.uncertainty import student

#: Samples on either side, as a part of the width at half height: 0.92 of the information of a Gaussian pulse.
SIDE = 0.93
GROSS = 4.5


@dataclass(frozen=True)
class Edges:
    """The places of the pulses by their edges.

    fit: phase against time; turns: used; noise: of a sample; height: of the pulse; bound [Hz]; missing, wrong: turns.
    """

    fit: Fit
    turns: int
    noise: float
    height: float
    bound: float
    missing: int
    wrong: int


def place_edges(
    samples: Array, rate: float, fit: Fit, *, width: float, sign: int, degree: int | None = None
) -> Edges | None:
    """Improve a phase that is right to a fraction of the pulse's width [s]; None: fewer than four turns."""
    times, numbers, frequency = turn_times(fit, 0.0, samples.size / rate)
    side = max(round(SIDE * width * rate), 1)
    middle = np.rint(times * rate).astype(np.intp)
    inside = (middle - 2 * side >= 0) & (middle + 2 * side < samples.size)
    times, numbers, frequency, middle = times[inside], numbers[inside], frequency[inside], middle[inside]
    if times.size < 4:
        return None
    x = np.lib.stride_tricks.sliding_window_view(samples, 4 * side + 1)[middle - 2 * side]
    left, right, heights = (x @ _sums(side)).T
    mean = np.median(x, axis=0) if times.size < 8 else np.full(times.size, 1 / times.size) @ x
    centre, ends = float(mean[2 * side]), float(0.5 * (mean[side] + mean[3 * side]))
    floor = 0.5 * float(mean[0] + mean[-1])
    gain = 2 * (centre - ends)
    place = (middle + (right - left) / gain) / rate
    phase = numbers - (place - times) * frequency
    heights = sign * heights
    typical = median(heights)
    use = heights > 0.3 * typical
    missing = int(np.count_nonzero(~use))
    if np.count_nonzero(use) < 4 or missing > 0.6 * times.size:
        return None
    grid = Grid(1 / rate, _steepness(x, side, abs(centre - floor)))
    for _ in range(4):
        new_fit = fit_turns(times[use], phase[use], degree=degree, jump=fit.jump, grid=grid)
        away = np.abs(phase - new_fit.phase(times))
        spread = 1.4826 * median(away[use])
        new = (heights > 0.3 * typical) & (away < student(new_fit.scatter.freedom, GROSS) * max(spread, 1e-12))
        if np.array_equal(new, use) or np.count_nonzero(new) < 4:
            break
        use = new
    rest = (x if use.all() else x[use]) - mean
    noise = float(np.sqrt(np.einsum("ij,ij->", rest, rest) / rest.size))
    slope = 0.5 * (mean[2:] - mean[:-2])
    information = float(slope @ slope) * (rate / float(frequency.mean())) ** 2
    bound = float(np.sqrt(new_fit.unit_covariance[1, 1] / information)) * noise / new_fit.half
    wrong = times.size - missing - int(np.count_nonzero(use))
    return Edges(new_fit, int(np.count_nonzero(use)), noise, sign * (centre - floor), bound, missing, wrong)


def _steepness(x: Array, side: int, height: float) -> float:
    """Return the part of its height that a flank climbs between two samples: 1 for a step, 1/k for k even ones.

    From the squares of the steps in each piece, since in the mean of pieces that lie a sample apart a step is two
    smaller ones; those on either side of the pulse are noise.  x: pieces of 4 side + 1 samples, shape (turns, …).
    """
    squares = np.diff(x, axis=1) ** 2
    inner = squares[:, side : 3 * side]
    noise = float(squares[:, :side].mean() + squares[:, 3 * side :].mean()) / 2
    of_flanks = float(inner.sum()) / len(x) - noise * inner.shape[1]
    return float(min(max(of_flanks / (2 * max(height, 1e-150) ** 2), 0.0), 1.0))


def _sums(side: int) -> Array:
    """Return the weights of 4 side + 1 samples for left, right and height, shape (4 side + 1, 3)."""
    sums = np.zeros((4 * side + 1, 3))
    sums[side : 2 * side, 0] = 1.0
    sums[2 * side + 1 : 3 * side + 1, 1] = 1.0
    sums[2 * side - side // 2 : 2 * side + side // 2 + 1, 2] = 1 / (2 * (side // 2) + 1)
    sums[[0, -1], 2] -= 0.5
    return sums
