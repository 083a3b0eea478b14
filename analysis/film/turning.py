"""Phases at the times of pictures → spin.

Times at even distances fold it: the spins that describe the phases as well are choices, which the result names.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander
from numpy.polynomial.polynomial import polyvander
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.drag import EXPONENT, EXPONENT_U
from analysis.errors import TooFewReadings
from analysis.film.errors import NoMark
from analysis.uncertainty import student

#: Spins with which a top floats, or is lost at, with room for a driven one [Hz].
LOW, HIGH = 14.0, 75.0
#: Length of the stretch in which the spin is first looked for [s]: a free top slows down by 0.1 Hz/s at most.
_FIRST_S = 0.5
_FEWEST = 12
#: Least coherence of a mark that turns.
_COHERENT = 0.6
#: Another spin is excluded from this difference of χ² on.
_EXCLUDED = 25.0
#: Gain of the frequency in following the phase.
_GAIN = 0.03
#: Time from a row to the next one where it is not known, as a standard deviation [s]: 5 to 30 µs in phones.
_LINE_TIME = 20e-6
#: 1/distance of a camera beside the top, and its standard deviation: from 0.25 to 1 m each factor is as probable [1/m].
_NEARNESS, _NEARNESS_U = 2.16, 0.85
#: Harmonics of the angle in a phase, and how large they may be, as a standard deviation [turns]: a top of 30 mm
#: that turns about a point 0.2 mm beside the middle of its rim adds 0.003.
_HARMONICS, _HARMONIC = 2, 0.003
#: How far the turns swing with the sway of the top, as a standard deviation [turns], and how slowly at least and how
#: fast at most [Hz].  Else they would be taken for rows that are late, since the rows of the mark sway, too; in a long
#: film both average out.  A tilt of 25 mrad turns the mark by half its square.
_SWING, _SWING_HZ, _MOST_SWINGS = 5e-5, (0.3, 3.0), 24
#: Highest order of the polynomial (Chebyshev's) for the turns of a film, and the number of orders that are free.  The
#: others have a prior, as a fall has them beyond its third order, by the greatest relative slope of a free top's spin:
#: 0.1 Hz/s of 14 Hz [1/s].
_ORDER, _FREE, _SLOWS = 36, 3, 0.007
#: What a drive adds to each order, as standard deviations: nothing, or each decade as probable [turns].  Orders above
#: those of a swing at this frequency fall off as their fifth power [Hz].  One top in thirty is driven.
_DRIVES, _DRIVE_HZ, _DRIVEN = np.append(0.0, 3 * 10.0 ** np.arange(-4, 4)), 0.1, 0.03
#: A drive that is switched off, or begins to sweep, changes the slope of the spin at once, a kink: at any time, by the
#: greatest relative slope of a free top as a standard deviation, in one film of a hundred.
_KINK = 0.01
#: Numbers of times that are tried for it, first in the whole film, then about the best one, and of pictures at most.
_TRIED = ((100, 300), (40, 3000))
#: Terms of the spin after a kink: a shift of its time, the change of the slope, and changes of that by drag.
_TERMS = 6
#: Length of a reading of the spin [s], and the fewest pictures in it.
WINDOW_S, _FEWEST_IN_WINDOW = 1.0, 12


@dataclass(frozen=True, eq=False)
class Turning:
    """How a top turned.

    Attributes:
        smooth: spin in each picture, a polynomial through the film, shape (n,) [Hz].
        time: middles of the readings of the spin, shape (m,) [s].
        spin: shape (m,) [Hz].
        u: shape (m,) [Hz].
        middle: time of `frequency` [s].
        frequency: spin at the middle of the film, with the sense of the phase [Hz].
        u_frequency: [Hz].
        chirp: its slope [Hz/s].
        u_chirp: [Hz/s].
    """

    smooth: Array
    time: Array
    spin: Array
    u: Array
    middle: float
    frequency: float
    u_frequency: float
    chirp: float
    u_chirp: float


def coherence(times: Array, phase: Array, frequencies: Array) -> Array:
    """Return how well phases turn at each frequency, 0 to 1, shape (m,)."""
    return np.asarray(np.abs(np.exp(2j * np.pi * (phase - frequencies[:, None] * times)).mean(axis=1)))


def spins_of_start(times: Array, phase: Array, u: Array) -> list[tuple[float, float]]:
    """Return spins, of either sense, that describe a stretch in the middle of the film, best first, with χ² [Hz].

    Spins too slow to float are among them.

    Raises:
        NoMark: nothing turns.
        TooFewReadings: too few pictures.
    """
    near = np.abs(times - np.median(times)) <= _FIRST_S / 2
    if near.sum() < _FEWEST:
        raise TooFewReadings(seen=int(near.sum()), needed=_FEWEST)
    t, p, w = times[near] - times[near].mean(), phase[near], u[near]
    raster = np.arange(-HIGH, HIGH, 0.1 / np.ptp(t))
    height = coherence(t, p, raster)
    peaks = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])) + 1
    if not peaks.size or height[peaks].max() < _COHERENT:
        raise NoMark(coherence=float(height.max()))
    found = []
    for k in peaks[height[peaks] > _COHERENT * height[peaks].max()]:
        f, rest = _line(t, p, float(raster[k]))
        found.append((f, float(np.sum((rest / w) ** 2))))
    scale = max(min(chi for _, chi in found) / (t.size - 2), 1.0)
    return sorted(((f, chi / scale) for f, chi in found), key=lambda one: one[1])


def _line(t: Array, phase: Array, frequency: float) -> tuple[float, Array]:
    """Return the frequency of phases near one, and their residuals [turns]."""
    for _ in range(3):
        rest = phase - frequency * t
        rest = rest - np.angle(np.exp(2j * np.pi * rest).mean()) / (2 * np.pi)
        rest -= np.rint(rest)
        slope = float(t @ rest / (t @ t))
        frequency += slope
    return frequency, rest - slope * t


def choices_of(found: list[tuple[float, float]], near: float | None) -> tuple[list[float], list[float]]:
    """Return the spins that the pictures do not exclude, best first, of either sense [Hz].

    First those with which a top floats, then slower ones, as of a film in slow motion.

    Args:
        found: spins and their χ².
        near: about where the spin is, to 10 % [Hz].
    """
    least = found[0][1]
    seen = [f for f, chi in found if chi < least + _EXCLUDED]
    if near is not None:
        return [f for f in seen if abs(abs(f) / near - 1) < 0.1], []
    return [f for f in seen if abs(f) >= LOW], [f for f in seen if abs(f) < LOW]


def turning_of(times: Array, phase: Array, u: Array, rows: Array, aside: Array, *, start: float) -> Turning:
    """Follow the phase from the middle of the film to both ends, and fit the spin.

    Args:
        times: of the phases, increasing, shape (n,) [s].
        phase: shape (n,) [turns].
        u: standard uncertainties, shape (n,) [turns].
        rows: of the mark, by which its time may be late, shape (n,); zeros: it is not [pixels].
        aside: place to the right, with which the line of sight of a camera beside the top turns, shape (n,); zeros: of
            a camera above [m].
        start: spin in the middle [Hz].
    """
    middle = int(np.searchsorted(times, np.median(times)))
    turns = np.empty_like(phase)
    _follow(times[middle:], phase[middle:], turns[middle:], start, float(phase[middle]))
    _follow(times[middle::-1], phase[middle::-1], turns[middle::-1], start, float(phase[middle]))
    turns += _NEARNESS * aside / (2 * np.pi)
    centre, half = float((times[0] + times[-1]) / 2), float(np.ptp(times)) / 2
    late = (times - centre) / half
    swings = min(int(_SWING_HZ[1] * 4 * half), _MOST_SWINGS) if np.any(rows) else 0
    orders = np.arange(_FREE, _FREE + swings)
    sways = _SWING * np.minimum(orders / (4 * half * _SWING_HZ[0]), 1) ** 4
    swing = sways * chebvander(late, _FREE + swings)[:, _FREE:-1]
    late_rows, sight = _LINE_TIME * start * (rows - rows.mean()), _NEARNESS_U * aside / (2 * np.pi)
    nuisance = np.column_stack([late_rows, sight, swing])
    smooth = _Smooth.of(abs(start), half)
    columns = smooth.columns(np.append(late, 0.0), smooth.time_of_kink(late, turns, u, nuisance))
    basis, at_centre = columns[:, :-1], columns[:, -1]
    first = _fit(basis[0], turns, u, nuisance, smooth)[0][: basis.shape[2]]
    nuisance = np.column_stack([nuisance, _waves(basis[0] @ first)])
    chirp = float(at_centre[2] @ first)
    slower = chirp * min(chirp / start, 0.0)  # of the slope, a second; that of an even drive stays
    drag = slower * (half * late) ** 3 / 6
    more = np.column_stack([nuisance, EXPONENT_U * drag])
    value, covariance, rest, noise = _fit(basis[0], turns - EXPONENT * drag, u, more, smooth)
    found, error = value[: basis.shape[2]], covariance[: basis.shape[2], : basis.shape[2]]
    power = EXPONENT + EXPONENT_U * float(value[-1])
    speed = basis[1] @ found + power * slower * (half * late) ** 2 / 2
    terms = np.concatenate([basis[:2], np.stack([nuisance, np.zeros(nuisance.shape)])], axis=2)
    readings = np.array([
        _reading(times[part], rest[part], noise * u[part], terms[:, part], covariance[:-1, :-1])
        for part in windows_of(times)
    ]).reshape(-1, 3)  # fmt: skip
    return Turning(
        smooth=np.asarray(speed),
        time=readings[:, 0],
        spin=readings[:, 1] + np.interp(readings[:, 0], times, speed),
        u=readings[:, 2],
        middle=centre,
        frequency=float(at_centre[1] @ found),
        u_frequency=float(np.sqrt(at_centre[1] @ error @ at_centre[1])),
        chirp=float(at_centre[2] @ found),
        u_chirp=float(np.sqrt(at_centre[2] @ error @ at_centre[2])),
    )


@dataclass(frozen=True, eq=False)
class _Smooth:
    """Smooth turns of a film, as a free top and a driven one have them, without a kink and with it.

    Attributes:
        spin: [Hz].
        half: half the length of the film [s].
        scales: standard deviations of the coefficients, shape (k, m), in the first half without a kink; those of the
            `_FREE` first ones do not count, and the last row is the widest.
        chances: of each row, relative, shape (k,).
    """

    spin: float
    half: float
    scales: Array
    chances: Array

    @classmethod
    def of(cls, spin: float, half: float) -> "_Smooth":
        """Return them for a spin [Hz] and half the length of a film [s]."""
        orders = np.arange(_FREE, _ORDER + 1)
        falls = spin * half * min(_SLOWS * half / 2, 1) ** orders / orders
        drives = np.minimum(4 * half * _DRIVE_HZ / orders, 1) ** 5
        widths = np.hypot(falls, _DRIVES[:, None] * drives)
        chances = np.append(1.0, np.full(len(widths) - 1, _DRIVEN / len(widths)))
        both = [np.pad(widths, ((0, 0), (_FREE, _TERMS)), constant_values=((1, 1), (1, kink))) for kink in (0, 1)]
        return cls(spin, half, np.concatenate(both), np.append(chances, _KINK * chances))

    def beside(self, nuisance: Array) -> tuple[Array, Array]:
        """Return standard deviations of all coefficients, and a matrix with a one for each that has a prior."""
        scales = np.pad(self.scales, ((0, 0), (0, nuisance.shape[1])), constant_values=1)
        return scales, np.diag(np.arange(scales.shape[1]) >= _FREE).astype(float)

    def columns(self, late: Array, kink: float) -> Array:
        """Return turns, spins and slopes of the polynomials and of a kink, shape (3, n, m); see `kinks`."""
        values, powers = chebvander(late, _ORDER), np.eye(_ORDER + 1)
        smooth = [values[:, : _ORDER + 1 - n] @ chebder(powers, n) / self.half**n for n in range(3)]
        kinks = [self.kinks(late, kink, n) for n in range(3)]
        return np.concatenate([smooth, kinks], axis=2)

    def kinks(self, late: Array, kink: float | Array, derivative: int = 0) -> Array:
        """Return turns (or spins, or slopes) of a change of the slope at once, in standard deviations of its prior.

        The columns are a shift of its time, the change, and its own changes.

        Args:
            late: times, from -1 at the start of the film to 1 at its end, shape (n,).
            kink: its time, from -1 to 1, or several, shape (k, 1).
            derivative: 0 of turns, 1 of spins, 2 of slopes.

        Returns:
            Shape (n, _TERMS), or (k, n, _TERMS).
        """
        after, term = np.maximum(late - kink, 0) * self.half, np.arange(_TERMS)
        sizes = self.spin * _SLOWS**term
        sizes[0] = sizes[1] * 2 * self.half / math.sqrt(12)
        sizes *= (1 / (term + 1), 1, term)[derivative]
        powers = polyvander(after, _TERMS)[..., np.maximum(term + 1 - derivative, 0)]
        return np.asarray(sizes * powers * (late > kink)[..., None])

    def time_of_kink(self, late: Array, turns: Array, u: Array, nuisance: Array) -> float:
        """Return the time by which a kink describes turns best, from -1 to 1."""
        (scales, has_prior), without = self.beside(nuisance), len(self.scales) // 2
        columns, best, wide = np.column_stack([self.columns(late, 0.0)[0], nuisance, turns]) / u[:, None], 0.0, 1.0
        for times, pictures in _TRIED:
            some = slice(None, None, -(-late.size // pictures))
            orthonormal, triangle = np.linalg.qr(columns[some, :-1])
            tried = np.clip(best + wide * np.linspace(-1, 1, times), -1, 1)
            kinks = self.kinks(late[some], tried[:, None])[..., 1:] / u[some, None]
            more = np.concatenate([kinks, np.tile(columns[some, -1:], (times, 1, 1))], axis=2)
            seen = orthonormal.T @ more
            unseen = more.mT @ more - seen.mT @ seen
            logs = [_evidence_with(triangle * scale, has_prior, seen, unseen) for scale in scales[:without]]
            of_each = np.logaddexp.reduce(logs + np.log(self.chances[:without, None]))
            best, wide = float(tried[np.argmax(of_each)]), 2 / (times - 1)
        return best


def _waves(turns: Array) -> Array:
    """Return harmonics of the angle of smooth turns, in standard deviations of their priors, shape (n, 4) [turns].

    They are of a mark that does not turn about the middle of the rim, and of a camera that looks from the side.  Waves
    of turns with their noise would explain the noise where two turns take a whole number of pictures.
    """
    angles = 2 * np.pi * np.arange(1, _HARMONICS + 1) * turns[:, None]
    return _HARMONIC * np.concatenate([np.cos(angles), np.sin(angles)], axis=1)


def _follow(times: Array, phase: Array, turns: Array, frequency: float, start: float) -> None:
    """Write the turns of phases, each the nearest to the one before going on at the spin so far."""
    turns[0] = now = start
    for k, step in enumerate(np.diff(times), 1):
        expected = now + frequency * step
        off = phase[k] - expected
        off -= round(off)
        turns[k] = now = expected + off
        frequency += _GAIN * off / step * min(1.0, abs(step) / 0.01)


def _fit(
    basis: NDArray[np.floating], turns: Array, u: Array, nuisance: Array, smooth: _Smooth
) -> tuple[Array, Array, Array, float]:
    """Return coefficients of a basis, shape (n, m), and of the nuisance, their covariance, residuals, and their noise.

    The nuisance has a prior of 1.  All priors of the smooth turns count by their evidence.  The noise is that of the
    residuals from the widest prior, in units of u, and 1 at least: see `_slow_noise`.
    """
    m = basis.shape[1]
    design = np.concatenate([basis, nuisance], axis=1)
    triangle = np.linalg.qr(np.column_stack([design, turns]) / u[:, None])[1]
    scales, has_prior = smooth.beside(nuisance)
    (widest,), (spread,), _ = _solutions(triangle, scales[-1:], has_prior)
    known = float(np.sum((np.diag(spread) / scales[-1] ** 2)[_FREE:m]))
    rest = (turns - design @ widest) / u
    noise = max(_slow_noise(rest, float(np.ptp(turns)), m - known), 1.0)
    values, covariances, logs = _solutions(triangle / noise, scales, has_prior)
    weight = smooth.chances * np.exp(logs - logs.max())
    weight /= weight.sum()
    found = weight @ values
    off = values - found
    covariance = np.tensordot(weight, covariances, 1) + (off.T * weight) @ off
    return found, covariance, turns - design @ found, noise


def _slow_noise(rest: Array, turns: float, fitted: float) -> float:
    """Return the noise of residuals that is slower than the spin, widened as few means show it.

    Errors that neighbouring pictures share count in the spin, errors that come with each turn average out.  The means
    are weighted by a raised cosine of two turns, so that they change evenly with the spin.

    Args:
        rest: residuals in units of u, shape (n,).
        turns: of the top, in the film.
        fitted: number of parameters that the residuals determined.
    """
    length = rest.size * min(2 / turns, 1 / 3)
    late = np.arange(-int(length / 2), int(length / 2) + 1)
    weights = np.cos(np.pi * late / length) ** 2
    weights /= weights.sum()
    means = np.convolve(rest, weights, "valid")
    freedom = max(rest.size * float(weights @ weights) - fitted, 1.0)
    worth = freedom * means.size / rest.size
    return student(freedom) * math.sqrt(float(means @ means) / worth)


def _solutions(triangle: Array, scales: Array, has_prior: Array) -> tuple[Array, Array, Array]:
    """Return coefficients, their covariances, and the logarithms of the evidence of priors, each of its first axis k.

    Args:
        triangle: of the weighted columns and the goal, shape (m + 1, m + 1).
        scales: standard deviations of each prior, shape (k, m).
        has_prior: one where a coefficient has a prior, shape (m, m).
    """
    priors = np.broadcast_to(has_prior, (len(scales), *has_prior.shape))
    orthonormal, root = np.linalg.qr(np.concatenate([triangle[:, :-1] * scales[:, None], priors], axis=1))
    goal = np.append(triangle[:, -1], np.zeros(len(has_prior)))[:, None]
    along, inverse = orthonormal.mT @ goal, scales[:, :, None] * np.linalg.inv(root)
    squares = np.sum((goal - orthonormal @ along) ** 2, axis=(1, 2))
    logs = -0.5 * squares - np.sum(np.log(np.abs(np.diagonal(root, axis1=1, axis2=2))), axis=1)
    return (inverse @ along)[..., 0], inverse @ inverse.mT, logs


def _evidence_with(triangle: Array, has_prior: Array, seen: Array, unseen: Array) -> Array:
    """Return logarithms of the evidence with a kink, for each of several times, shape (k,).

    Args:
        triangle: of the weighted columns, in standard deviations of the prior, shape (m, m).
        has_prior: as of `_solutions`.
        seen: components along these columns of those of a kink, and of the goal, shape (k, m, p + 1).
        unseen: scalar products of what is left of them, shape (k, p + 1, p + 1).
    """
    orthonormal, root = np.linalg.qr(np.concatenate([triangle, has_prior]))
    along = orthonormal[: len(triangle)].T @ seen
    left = unseen + seen.mT @ seen - along.mT @ along
    information = left[:, :-1, :-1] + np.eye(left.shape[1] - 1)
    gain = np.sum(left[:, :-1, -1] * np.linalg.solve(information, left[:, :-1, -1:])[:, :, 0], axis=1)
    alone = left[:, -1, -1] + 2 * np.sum(np.log(np.abs(np.diag(root))))
    return np.asarray(0.5 * (gain - np.linalg.slogdet(information)[1] - alone))


def windows_of(times: Array) -> list[NDArray[np.intp]]:
    """Return the pictures of readings of the spin, one after another."""
    count = max(round(float(np.ptp(times)) / WINDOW_S), 1)
    edges = np.searchsorted(times, np.linspace(times[0], times[-1], count + 1)[1:-1])
    return [part for part in np.split(np.arange(times.size), edges) if part.size >= _FEWEST_IN_WINDOW]


def _reading(times: Array, rest: Array, u: Array, terms: Array, covariance: Array) -> tuple[float, float, float]:
    """Return time and spin of some pictures beyond the smooth one of the film, by their residuals, and its u.

    Args:
        times: shape (n,) [s].
        rest: residuals, shape (n,) [turns].
        u: shape (n,) [turns].
        terms: columns of the film's fit, and their slopes in the smooth spin, shape (2, n, m).
        covariance: of their coefficients, shape (m, m).
    """
    at = float((times[0] + times[-1]) / 2)
    line, own = np.polyfit(times - at, rest, 1, w=1 / u, cov="unscaled")
    shares = np.polyfit(times - at, terms[0], 1)[0] - [np.interp(at, times, speed) for speed in terms[1].T]
    return at, float(line[0]), float(np.sqrt(own[0, 0] + shares @ covariance @ shares))
