"""The slow swings of a place over time: signed frequencies, amplitudes and uncertainties, window by window.

In a window the place x + iy is a sum of waves: the backward and the forward slow swing and the precession, each with
a frequency and a slope, and of lines of the second and third order, at sums and differences of the slow swings' and
the vertical swing's frequencies, since the field changes with height.  A height z in the stiffness, a force −κzx, makes
of the forward swing a line at α₊ − α_v, of the backward one a line at α₋ + α_v, by one and the same complex share, as
(α₊ − α)(α − α₋) is equal at both.  These lines may be stronger than the swing beside them: the share says which is
which.  Where the height is known, it gives the vertical swing.  Noise that is correlated is worth fewer readings.
Amplitudes are linear; frequencies and share follow by Gauss and Newton from the peaks of a spectrum, from several
starts.  The likeliest fit is not always the right one: others are kept as its rivals.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.checks import check_finite, check_increasing
from analysis.errors import AnalysisError, ShapesDiffer, TooFewReadings
from analysis.lines import Line, spectral_lines
from analysis.residuals import independent
from analysis.sway.vertical import (
    ALONE,
    BESIDE,
    VERTICAL_U_HZ,
    Beside,
    Places,
    Vertical,
    beside,
    of_heights,
    of_places,
    vertical_swing,
)

if TYPE_CHECKING:
    from collections.abc import Sequence


#: Length of a window [s]: in a longer one the precession's slope changes.  Least number of samples of a window.
WINDOW_S, FEWEST = 20.0, 100
#: Where the slow swings and the precession of a top are looked for [Hz]: the thesis's top has 0.3 to 1.1 and 4 to 12 Hz
#: over its window of masses and spins.
SLOW_HZ, PRECESSION_HZ = (0.15, 1.6), (2.5, 15.0)
#: Prior of the slopes [Hz/s]: a spin that falls by up to 0.4 Hz/s changes the slow swings by up to 6 mHz per Hz and the
#: precession by up to 0.5 Hz per Hz.
_SLOPES_U = np.array([2e-3, 2e-3, 0.2])
#: Slopes with which the precession is looked for [Hz/s].
_SLOPES = (0.0, 0.03, 0.06, 0.1, 0.15)
#: Spans of time in a second, over which the vertical swing is looked for in means: all its lines are slower than 5 Hz.
_SPANS_HZ = 20.0
#: Peaks of the spectrum that are tried for either swing, and steps of Gauss and Newton at most.
_TRIED, _STEPS = 3, 25
#: A sensor's image, over its line, that is left where the whole record has shown it: prior.
_IMAGE = 0.05
#: Amplitudes of lines, over the places: those of the heights alone in a sensor that leans, and what the coupling of the
#: swings leaves of others in full motions of 1 mm.  u of the share of its line in either swing, real and imaginary.
_ALONE, _BEYOND, _SHARE_U = 0.1, 0.02, 0.5
#: By that share, the amplitudes of forward less and of backward plus vertical swing, over those of the swings.
_OF_EITHER = np.array([[1, 1], [-1j, 1j]])
#: Rounding: the noise is no smaller a part of the places, and frequencies differ by no smaller a part of their effect.
_FINEST = 1e-8
#: The number of likeliest swings of a window that are kept, and how far their −2 log L may be above the least.
_KEPT, _FARTHEST = 6, 100.0


class NoSwings(AnalysisError):
    """A window without two slow swings; from and to which time [s]."""

    def __init__(self, *, start: float, end: float) -> None:
        self.start, self.end = start, end
        super().__init__(
            "from {start:.4g} to {end:.4g} s no swing to either side stands out of the noise between {low:g} and "
            "{high:g} Hz: give the top a small push sideways, or look at a longer record",
            low=SLOW_HZ[0], high=SLOW_HZ[1],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Swings:
    """The slow swings in one window.

    Attributes:
        time: middle of the window [s].
        frequency: of the backward (negative) and the forward swing and, if seen, of the precession, shape (2 or 3,),
            signed: positive in the sense of the spin [Hz].
        u: standard uncertainties, same shape [Hz].
        amplitude: same shape [m].
        vertical: the vertical swing, as the lines beside the slow swings and the heights have it [Hz].
        noise: standard deviation of a coordinate [m].
        misfit: −2 times the logarithm of the likelihood and the priors, but for a constant.
        backwards: amplitude of the strongest line where a precession would be that turns against the spin [m].
        size_u: relative standard uncertainty that all amplitudes have in common.
        rivals: other lines that may be the swings, less likely by this window alone.
        mistake: standard uncertainty of the split from these [Hz].
    """

    time: float
    frequency: Array
    u: Array
    amplitude: Array
    vertical: Vertical
    noise: float
    misfit: float
    backwards: float = 0.0
    size_u: float = 0.0
    rivals: tuple[Swings, ...] = ()
    mistake: float = 0.0

    @property
    def weakness(self) -> float:
        """−2 log of the amplitudes' probability, but for a constant: a swing is likelier the stronger line."""
        return -4 * float(np.sum(np.log(self.amplitude[:2])))

    @property
    def size(self) -> float:
        """Sum of the squares of both slow swings' amplitudes [m²]."""
        return float(np.sum(self.amplitude[:2] ** 2))

    @property
    def split(self) -> float:
        """By how much the forward swing is faster than the backward one [Hz]."""
        return float(self.frequency[0] + self.frequency[1])

    @property
    def u_split(self) -> float:
        """Its standard uncertainty [Hz]."""
        return math.hypot(self.u[0], self.u[1])


def swings_of(
    times: Array, places: Places, heights: Array | None = None, *, window: float = WINDOW_S, rising: bool = False
) -> list[Swings]:
    """Return the swings of all windows in which they stand out.

    Args:
        times: increasing, not necessarily evenly, shape (n,) [s].
        places: x + iy, shape (n,) [m], seen so that the spin is positive.
        heights: shape (n,) [m]; None where they are not known.
        window: [s].
        rising: whether the places show the heights, and an image of each line, too, as a magnetometer does that leans.

    Raises:
        TooFewReadings, ShapesDiffer, NotFinite, TimesNotIncreasing: see `analysis.errors`.
        NoSwings: they stand out in none.
    """
    t, s, z = _check(times, places, heights)
    borders = np.searchsorted(t, np.linspace(t[0], t[-1], max(round(float(t[-1] - t[0]) / window), 1) + 1))
    borders[-1] = t.size
    parts = [slice(*ends) for ends in itertools.pairwise(borders.tolist()) if ends[1] - ends[0] >= FEWEST]

    each = (swings_in_window(t[part], s[part], None if z is None else z[part], rising=rising) for part in parts)
    found = [one for one in each if one]
    if not found:
        raise NoSwings(start=float(t[0]), end=float(t[-1]))
    return found


def _check(times: Array, places: Places, heights: Array | None) -> tuple[Array, Places, Array | None]:
    t, s = np.asarray(times, dtype=np.float64), np.asarray(places, dtype=np.complex128)
    z = None if heights is None else np.asarray(heights, dtype=np.float64)
    columns = [("time", t), ("place", s)] + ([] if z is None else [("height", z)])
    for quantity, values in columns:
        if t.ndim != 1 or values.shape != t.shape:
            raise ShapesDiffer(quantity=quantity, seen=values.shape, expected=(t.size,))
    if t.size < FEWEST:
        raise TooFewReadings(seen=t.size, needed=FEWEST)
    for quantity, values in columns:
        check_finite(quantity, np.abs(values))
    check_increasing(t)
    return t, s, z


def swings_in_window(t: Array, s: Places, heights: Array | None = None, *, rising: bool = False) -> Swings | None:
    """Return the swings of one window; None where they do not stand out.

    Args:
        t: shape (n,) [s].
        s: shape (n,) [m].
        heights: shape (n,) [m]; None where they are not known.
        rising: see `swings_of`.
    """
    s = s - s.mean()
    lines = _spectrum(t, s)
    forward, seen = _peaks(lines, SLOW_HZ)[:2], _peaks(lines, (-SLOW_HZ[1], -SLOW_HZ[0]))[:_TRIED]
    if not (forward and seen):
        return None
    # two lines that are nearer than the window resolves have one peak between them
    apart = 0.6 / float(t[-1] - t[0])
    starts = [np.array([backward, forward[0]]) for backward in {*seen, seen[0] - apart, seen[0] + apart}]
    starts += [np.array([backward, one]) for backward in seen[:2] for one in forward[1:]]
    rows = BESIDE + ALONE if rising else BESIDE
    still = _still(t, s, rising=rising)

    def fit(slow: Array, rise: float | None = None, line: _Precession | None = None) -> _Fit:
        start, slopes = (slow, [0, 0]) if line is None else ([*slow, line.frequency], [0, 0, line.slope])
        return _fit(
            t, s, np.array(start), np.array(slopes), _expected(t, heights, slow), still=still, rows=rows, rise=rise
        )

    fits = [fit(start) for start in starts]
    best = _likeliest(fits)[0]
    # either swing, or both, may be the line that the other makes with the vertical swing
    (back, ahead), rise = best.swings.frequency.tolist(), best.vertical(t, s).value
    fits += [fit(np.array(slow), ahead - back) for slow in ((back, back + rise), (ahead - rise, ahead))]
    fits += [fit(np.array(slow), rise) for slow in ((back, ahead), (ahead - rise, back + rise))]
    line, mirror = _precession(t, best.rest), _precession(t, best.rest.conj())
    ends = [fit(one.swings.frequency, one.swings.vertical.value, line) for one in _likeliest(fits)]
    likeliest = _likeliest(ends)
    worth = _worth(likeliest[0].rest)
    first, *rivals = (
        replace(one.swings, vertical=one.vertical(t, s), misfit=worth * one.swings.misfit, u=one.swings.u / worth**0.5)
        for one in likeliest
    )
    return replace(first, backwards=0.0 if mirror is None else mirror.amplitude, rivals=tuple(rivals))


def _still(t: Array, s: Places, *, rising: bool) -> Places:
    """Return columns of what is no line, shape (n, 2 or 3): an offset, a drift, and what is left of a sensor's image.

    A record s + ε s* has an image of each line, all with one ε: it is not taken for a line of the motion then.
    """
    late, size = t - t.mean(), float(np.linalg.norm(s)) / math.sqrt(t.size)
    image = [_IMAGE / size * s.conj()] if rising and size else []
    return np.stack([np.ones_like(s), late / late[-1], *image], axis=1)


def _worth(rest: Places) -> float:
    """Return the independent readings that each one is worth, by the correlation of neighbouring residuals."""
    correlation = float(np.vdot(rest[:-1], rest[1:]).real / np.linalg.norm(rest) ** 2)
    return independent(rest.size, max(correlation, 0.0)) / rest.size


def _likeliest(fits: Sequence[_Fit]) -> list[_Fit]:
    """Return the likeliest of unlike fits, the likeliest first; readings count as the best fit's residuals have it."""
    worth = _worth(min(fits, key=lambda one: one.swings.misfit + one.swings.weakness).rest)

    def improbable(fit: _Fit) -> float:
        return worth * fit.swings.misfit + fit.swings.weakness

    kept: list[_Fit] = []
    for one in sorted(fits, key=improbable):
        apart = [np.abs(one.swings.frequency - other.swings.frequency)[:2].max() for other in kept]
        if not apart or min(apart) > one.swings.u[:2].max():
            kept.append(one)
    least = improbable(kept[0])
    return [one for one in kept if improbable(one) - least < _FARTHEST][:_KEPT]


def _expected(t: Array, heights: Array | None, slow: Array) -> Vertical:
    """Return the vertical swing that goes with the slow ones [Hz], and, where the heights are known, with them."""
    backward, forward = slow.tolist()
    expected = Vertical(vertical_swing(backward, forward), VERTICAL_U_HZ)
    if heights is None:
        return expected
    return of_heights(_in_spans(t, t - t.mean()), _in_spans(t, heights), expected, forward - backward)


class _Precession(NamedTuple):
    """A line: amplitude [m], frequency [Hz] and slope [Hz/s]."""

    amplitude: float
    frequency: float
    slope: float


def _precession(t: Array, rest: Places) -> _Precession | None:
    """Return the strongest line where the precession is looked for; None without one."""
    late = t - t.mean()
    found = [
        _Precession(line.amplitude, line.frequency, slope)
        for slope in _SLOPES
        for line in _spectrum(t, rest * np.exp(-1j * np.pi * slope * late**2))
        if PRECESSION_HZ[0] < line.frequency < PRECESSION_HZ[1]
    ]
    return max(found, default=None)


def mirrored(swings: Sequence[Swings]) -> bool | None:
    """Return whether the precession turns backwards, as it does in a mirror or from below; None where none is seen."""
    ahead = sum(float(one.amplitude[2]) for one in swings if one.frequency.size > 2)
    back = sum(one.backwards for one in swings)
    return back > ahead if max(ahead, back) else None


def _in_spans(t: Array, values: NDArray[Any]) -> NDArray[Any]:
    """Return the mean of values at times [s], shapes (n, …) and (n,), over each span that has any."""
    first = np.flatnonzero(np.diff(np.floor((t - t[0]) * _SPANS_HZ), prepend=-1))
    count = np.diff(first, append=t.size).reshape(-1, *[1] * (values.ndim - 1))
    return np.add.reduceat(values, first) / count


def _spectrum(t: Array, s: Places) -> Sequence[Line]:
    regular = np.interp(np.linspace(t[0], t[-1], t.size), t, s)
    return spectral_lines(regular - regular.mean(), (t.size - 1) / float(t[-1] - t[0])).lines


def _peaks(lines: Sequence[Line], between: tuple[float, float]) -> list[float]:
    """Return the frequencies of the lines between two [Hz], the strongest first."""
    return [line.frequency for line in lines if between[0] < line.frequency < between[1]]


class _Fit(NamedTuple):
    """Swings, what they leave of the places, and what they were fitted with: waves, others, and the vertical swing."""

    swings: Swings
    rest: Places
    waves: Places
    others: Places
    expected: Vertical
    alone: Beside

    def vertical(self, t: Array, s: Places) -> Vertical:
        """Return the vertical swing by the lines beside the slow ones, wherever they are [Hz]."""
        late, s, waves, others = (_in_spans(t, one) for one in (t - t.mean(), s, self.waves, self.others))
        return of_places(late, s, waves, others, self.expected, rows=self.alone)


def _fit(
    t: Array,
    s: Places,
    start: Array,
    slopes_start: Array,
    known: Vertical,
    *,
    still: Places,
    rows: Beside,
    rise: float | None = None,
) -> _Fit:
    """Return the swings of greatest likelihood near a start [Hz] with slopes [Hz/s], shape (2 or 3,).

    known: of the vertical swing without the places; still: see `_still`; rows: of the lines beside the slow ones;
    rise: where the vertical swing is looked for first, there unless given [Hz].
    """
    late, half, count = t - t.mean(), float(t[-1] - t[0]) / 2, start.size
    q = np.concatenate([start, slopes_start, [known.value if rise is None else rise, 0, 0]])
    known_u = np.concatenate([_SLOPES_U[:count], [known.u, _SHARE_U, _SHARE_U]])
    most = np.concatenate([np.full(count, 0.3 / half), np.full(count, 0.3 / half**2), [0.1 / half, 0.3, 0.3]])
    # the field's part of what is known goes with the slow swings, that of the heights does not
    of_field, follows = vertical_swing(start[0], start[1]), (known.u / VERTICAL_U_HZ) ** 2
    turn, size = 2j * np.pi * late, float(np.linalg.norm(s)) / math.sqrt(t.size)
    noise, parts = size, [_ALONE if row in ALONE else _BEYOND for row in rows]
    widths = size * np.array([1.0] * count + parts + [1.0] * still.shape[1])
    for _ in range(_STEPS):
        waves = np.exp(turn * (q[:count, None] + late / 2 * q[count:-3, None]))
        lines = beside(waves.T, np.exp(turn * q[-3]), rows).T
        linear, share = np.concatenate([waves, lines, still.T]), q[-2:] @ _OF_EITHER
        linear[1::-1] += share[:, None] * lines[:2]
        mirror = linear.conj()
        # lines that are as one do not cancel each other
        normal = mirror @ linear.T + 2 * np.diag((noise / widths) ** 2)
        amplitudes = np.linalg.solve(normal, mirror @ s)
        rest = s - amplitudes @ linear
        left = np.linalg.norm(rest) / math.sqrt(2 * (t.size - len(linear) - count))
        noise = math.hypot(float(left), _FINEST * size)
        sizes = amplitudes[count : count + len(rows)] + np.pad(share * amplitudes[1::-1], (0, len(rows) - 2))
        moved = (np.array(rows).T * sizes) @ lines
        moving = waves * amplitudes[:count, None]
        moving[:2] += moved[:2]
        shared = _OF_EITHER * amplitudes[1::-1] @ lines[:2]
        slopes = np.concatenate([moving * turn, late / 2 * moving * turn, moved[2:] * turn, shared])
        paid = np.linalg.solve(normal, mirror @ slopes.T).T
        real = np.concatenate([(slopes - paid @ linear) / noise, 2**0.5 * paid / widths], axis=1).view(np.float64)
        information, gradient = real @ real.T, slopes.view(np.float64) @ rest.view(np.float64) / noise**2
        # its own slopes would move the swings by 1e-6 Hz
        off = q[count:] / known_u
        off[-3] -= (known.value + follows * (vertical_swing(q[0], q[1]) - of_field)) / known.u
        information[count:, count:] += np.diag(1 / known_u**2)
        gradient[count:] -= off / known_u
        scale = np.sqrt(np.diagonal(information))
        unlike = information / np.outer(scale, scale) + _FINEST * np.eye(scale.size)
        covariance = np.linalg.inv(unlike) / np.outer(scale, scale)
        step, u = np.clip(covariance @ gradient, -most, most), np.sqrt(np.diagonal(covariance))
        q += step
        if np.abs(step[:count]).max() < 1e-3 * u[:count].min():
            break
    found = Swings(
        time=float(t.mean()),
        frequency=q[:count],
        u=u[:count],
        amplitude=np.abs(amplitudes[:count]),
        vertical=Vertical(float(q[-3]), float(u[-3])),
        noise=noise,
        misfit=2 * t.size * math.log(noise**2) + float(off @ off) + 2 * float(np.linalg.norm(amplitudes / widths)) ** 2,
    )
    steady = np.concatenate([waves[2:], lines[[not row[2] for row in rows]], still.T]).T
    return _Fit(found, rest, waves[:2].T * amplitudes[:2], steady, known, rows[len(BESIDE) : -2])  # without the beat
