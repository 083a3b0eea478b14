"""The mark on a top: its phase in each picture, by the pattern that turns with the top.

The pattern is the mean of the pictures, each turned back by its phase, and the phase is where picture and pattern agree
best: both are found in turn.  Light that stands still is the median over the pictures.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array

Waves = NDArray[np.complex128]


#: Of one turn, where picture and pattern are compared; a parabola goes on from there.
_FINE = 512
#: Pattern and phases are found in turn.
_ROUNDS = 3
#: Pictures of which the pattern is made, and that are compared at a time.
_MOST = 2000
#: Samples that the noise of a picture is alike over: rays are closer than pixels.
_CORRELATED = 3.0
#: A mark that turns by less from one picture to the next looks like a sway [turns].
_SLOWEST = 0.08


@dataclass(frozen=True, eq=False)
class Phases:
    """Phase of the mark in each picture.

    Attributes:
        phase: from x towards y, downwards, 0 to 1, shape (n,) [turns].
        u: standard uncertainty of each, shape (n,) [turns].
        angle: of the mark's middle at phase 0, at which a row of the picture is read [turns].
        share: of what changes in each picture that the pattern describes, shape (n,): little where the mark is hidden.
    """

    phase: Array
    u: Array
    angle: float
    share: Array


def phases_of(profiles: Array) -> Phases:
    """Return the phases of a mark.

    Args:
        profiles: brightness along bands of the top, shape (n, bands, rays).
    """
    chosen = profiles[:: -(-len(profiles) // _MOST)]
    still = np.median(chosen, axis=0)
    waves, _ = _changes(chosen, still)
    power = np.mean(np.abs(waves[:, :, 1]) ** 2, axis=0)
    best = int(np.argmax(power))
    phase = -np.angle(waves[:, best, 1]) / (2 * np.pi)
    for _ in range(_ROUNDS):
        pattern = np.mean(waves * _turned(-phase, waves.shape[2]), axis=0)
        phase = _agreement(np.sum(waves * pattern.conj(), axis=1))
    found = [_compare(part, still, pattern) for part in np.array_split(profiles, -(-len(profiles) // _MOST))]
    phases, u, share = (np.concatenate(columns) for columns in zip(*found, strict=True))
    rays = profiles.shape[2]
    shape = np.fft.irfft(pattern, rays, axis=1)[best]
    middle = np.sum(np.abs(shape) ** 3 * np.exp(2j * np.pi * np.arange(rays) / rays))
    return Phases(phases % 1, u, float(np.angle(middle)) / (2 * np.pi), share)


def without_pull(places: Waves, phase: Array) -> Waves:
    """Return places without the part that turns with the mark.

    A light mark beside the rim pulls the circle through the edge towards it, by 0.01 pixels in a sharp picture and 0.2
    in a coarsely coded one; and the middle of the rim may lie beside the axis.  Second differences leave the sway out.

    Args:
        places: x + iy, y downwards, shape (n,).
        phase: of the mark, shape (n,) [turns].
    """
    turn = np.exp(2j * np.pi * phase)
    step = np.diff(phase)
    if np.median(np.abs(step - np.rint(step))) < _SLOWEST:
        return places
    fast, seen = np.diff(turn, 2), np.diff(places, 2)
    return np.asarray(places - np.vdot(fast, seen) / np.vdot(fast, fast) * turn)


def _changes(profiles: Array, still: Array) -> tuple[Waves, Array]:
    """Return what changes in pictures, as Fourier coefficients along the bands, and as it is."""
    changing = profiles - still
    changing -= changing.mean(axis=2, keepdims=True)
    return np.fft.rfft(changing, axis=2), changing


def _turned(phase: Array, count: int) -> Waves:
    """Return factors that turn Fourier coefficients by phases, shape (n, 1, count)."""
    return np.asarray(np.exp(-2j * np.pi * np.arange(count) * phase[:, None])[:, None])


def _compare(profiles: Array, still: Array, pattern: Waves) -> tuple[Array, Array, Array]:
    """Return phases of pictures by the pattern, their standard uncertainties [turns], and the share it describes."""
    waves, changing = _changes(profiles, still)
    rays = profiles.shape[2]
    phase = _agreement(np.sum(waves * pattern.conj(), axis=1))
    expected = np.fft.irfft(pattern * _turned(phase, waves.shape[2]), rays, axis=2)
    contrast = np.sum(changing * expected, axis=(1, 2)) / np.maximum(np.sum(expected**2, axis=(1, 2)), 1e-30)
    rest = changing - contrast[:, None, None] * expected
    slope = np.fft.irfft(2j * np.pi * np.arange(waves.shape[2]) * pattern, rays, axis=1)
    left = np.sum(rest**2, axis=(1, 2))
    signal = np.maximum(contrast, 1e-3) ** 2 * max(float(np.sum(slope**2)), 1e-30)
    u = np.sqrt(left / (rest[0].size / _CORRELATED - 3) / signal)
    return phase, u, 1 - left / np.maximum(np.sum(changing**2, axis=(1, 2)), 1e-30)


def _agreement(waves: Waves) -> Array:
    """Return where the correlation of picture and pattern is greatest, shape (n,) [turns].

    Args:
        waves: its Fourier coefficients, shape (n, m).
    """
    seen = np.fft.irfft(waves, _FINE, axis=1)
    best = np.argmax(seen, axis=1)
    k = np.arange(len(seen))
    left, middle, right = (seen[k, (best + by) % _FINE] for by in (-1, 0, 1))
    bend = left - 2 * middle + right
    return np.asarray((best + np.where(bend < 0, 0.5 * (left - right) / np.where(bend < 0, bend, 1), 0.0)) / _FINE % 1)
