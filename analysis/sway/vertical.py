"""The vertical swing of a top: what the field, the heights and the places sideways say about its frequency.

Each gives a probability along a grid of frequencies, with the amplitudes of all lines fitted at each: the lines of the
vertical swing may be as weak as the noise, or missing, and then a slope at one frequency says nothing about others.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array

if TYPE_CHECKING:
    from collections.abc import Callable

Places = NDArray[np.complex128]

#: B′/2B [1/m] that the prior of the vertical swing follows from, and that swing's standard uncertainty [Hz].
GRADIENT_PER_M, VERTICAL_U_HZ = 9.3, 0.03
#: No top floats whose vertical swing is slower [Hz].
_SLOWEST_HZ = 0.2
#: The grid: to either side of what is expected, in its u; points in the width of a line; to either side of the most
#: probable frequency, in the u that a normal distribution has there, and points.
_FAR, _IN_A_LINE, _NEAR, _POINTS = 4.0, 6, 6.0, 25
#: What the lines leave is at least this part of what they explain: rounding.
_FINEST = 1e-9


class Vertical(NamedTuple):
    """A frequency of the vertical swing and its standard uncertainty [Hz]."""

    value: float
    u: float


def vertical_swing(backward: float, forward: float, gradient: float = GRADIENT_PER_M, gravity: float = 9.82) -> float:
    """Return the frequency of the vertical swing that goes with two slow ones [Hz].

    A field without sources and currents has α_v² = g B′/2B − 2|α₋α₊|: what stiffens the swings sideways softens the
    one up and down.

    Args:
        backward: slow swing, negative [Hz].
        forward: slow swing, positive [Hz].
        gradient: B′/2B at the top [1/m].
        gravity: [m/s²].
    """
    return math.sqrt(max(gravity * gradient / (4 * math.pi**2) + 2 * backward * forward, _SLOWEST_HZ**2))


def of_heights(late: Array, heights: Array, expected: Vertical, beat: float) -> Vertical:
    """Return the vertical swing as heights have it.

    Args:
        late: times from the middle, shape (n,) [s].
        heights: shape (n,) [m].
        expected: without them.
        beat: of the slow swings, which is seen in the heights, too [Hz].
    """
    beats = np.exp(2j * np.pi * late * beat)[:, None].view(np.float64)
    still = np.linalg.qr(np.column_stack([np.ones_like(late), late, beats]))[0]
    rest = heights - still @ (still.T @ heights)

    def misfit(rise: float) -> float:
        lines = np.exp(2j * np.pi * late * rise)[:, None].view(np.float64)
        return _misfit(rest, lines - still @ (still.T @ lines))

    return _posterior(misfit, expected, float(np.ptp(late)))


def of_places(
    late: Array, places: Places, swings: Places, others: Places, expected: Vertical, *, rows: Beside
) -> Vertical:
    """Return the vertical swing as the lines beside the slow swings have it.

    Args:
        late: times from the middle, shape (n,) [s].
        places: shape (n,) [m].
        swings: backward and forward, with their amplitudes, shape (n, 2) [m].
        others: what else is in the places, with free amplitudes, shape (n, k).
        expected: without them.
        rows: of lines whose amplitudes do not follow from those of the swings.
    """
    others = np.linalg.qr(np.concatenate([swings, others], axis=1))[0]

    def rest(columns: Places) -> Array:
        left = columns - others @ (others.conj().T @ columns)
        return np.concatenate([left.real, left.imag])

    def misfit(rise: float) -> float:
        up = np.exp(2j * np.pi * late * rise)
        (ahead, back), free = beside(swings, up, BESIDE[:2]).T, beside(swings, up, rows).T
        return _misfit(rest(places), rest(np.column_stack([ahead + back, 1j * (back - ahead), *free, *(1j * free)])))

    return _posterior(misfit, expected, float(np.ptp(late)))


#: Of each line: how often the backward, the forward and the vertical swing are in its frequency.
Beside = tuple[tuple[int, int, int], ...]
#: The lines beside the slow swings: the two that are near them, by which forward and backward swing are coupled while
#: the top rises and sinks, two that are far, and those of the third order; and lines of the heights alone: the vertical
#: swing and the beat.
BESIDE: Beside = (
    *((0, 1, -1), (1, 0, 1), (0, 1, 1), (1, 0, -1), (-1, 2, -1), (2, -1, 1)),
    *((-1, 2, 0), (2, -1, 0), (0, 1, -2), (1, 0, 2), (-1, 2, -2), (2, -1, 2)),
)
ALONE: Beside = ((0, 0, 1), (0, 0, -1), (-1, 1, 0), (1, -1, 0))


def beside(waves: Places, up: Places, rows: Beside) -> Places:
    """Return the waves of lines, a column each, by those of swings and of the vertical swing, shape (n,)."""
    powers = [{1: one, 2: one * one, -1: 1 / one, -2: 1 / (one * one)} for one in (*waves[:, :2].T, up)]
    return np.array([math.prod(of[k] for of, k in zip(powers, row, strict=True) if k) for row in rows]).T


def _misfit(rest: Array, lines: Array) -> float:
    """Return −2 times the logarithm of the likelihood of what the others leave, but for a constant.

    The lines may be there or not, each as probable; their amplitudes cost what a prior as wide as one reading costs
    (Schwarz, Ann. Stat. 6, 461 (1978)).
    """
    energy = float(np.linalg.norm(rest) ** 2)
    if not energy:  # as of heights that are all alike
        return 0.0
    left = max(energy - float(np.linalg.norm(np.linalg.qr(lines)[0].T @ rest) ** 2), _FINEST**2 * energy)
    there = rest.size * math.log(left / energy) + lines.shape[1] * math.log(rest.size)
    return -2 * float(np.logaddexp(-there / 2, 0.0))


def _posterior(misfit: Callable[[float], float], expected: Vertical, length: float) -> Vertical:
    """Return mean and standard deviation of the probability that goes with −2 log L and a normal prior."""

    def whole(rise: float) -> float:
        return misfit(rise) + ((rise - expected.value) / expected.u) ** 2

    count = 2 * math.ceil(_FAR * expected.u * length * _IN_A_LINE / 2) + 3
    coarse = np.linspace(-_FAR, _FAR, count) * expected.u + expected.value
    values = np.array([whole(rise) for rise in coarse.tolist()])
    k = int(np.clip(np.argmin(values), 1, count - 2))
    step = coarse[1] - coarse[0]
    bend = max(float(values[k - 1] - 2 * values[k] + values[k + 1]) / step**2, 2 / expected.u**2)
    top = coarse[k] + np.clip((values[k - 1] - values[k + 1]) / (2 * step * bend), -step, step)
    fine = np.linspace(-_NEAR, _NEAR, _POINTS) * math.sqrt(2 / bend) + top
    grid, first = np.unique(np.concatenate([coarse, fine]), return_index=True)
    values = np.concatenate([values, [whole(rise) for rise in fine.tolist()]])[first]
    weights = np.exp((values.min() - values) / 2) * np.gradient(grid)
    mean = float(np.average(grid, weights=weights))
    between = float(np.interp(mean, grid, np.gradient(grid)))  # what is sharper than the grid has a u of its step
    scatter = math.sqrt(float(np.average((grid - mean) ** 2, weights=weights)))
    return Vertical(mean, max(scatter, between / math.sqrt(12)))
