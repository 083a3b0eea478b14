"""The field of a swaying top as a track: a magnetometer above it, or two vertical ones beside it.

A top of moment m at x + iy, which leans by θ(x + iy), makes B_x + iB_y = K (3/d + θ)(x + iy) at a distance d above it,
and B_z = 3K/d x and 3K/d y at (d, 0) and (0, d) at its height, with K = μ₀m/4πd³.  A lean of slow swings and of the
precession has one law, θ = 2(α² + α_v²/2)/g.  A sensor that is ρ off its place changes that by terms of (ρ/d)²; one
that leans, or is off, shows the heights, too: two lines of the vertical swing and two of the beat.  Two unlike gains,
or an angle between the axes that is no right one, make of each line an image of the other sign: s + ε s*, with one ε
for all lines, which the record shows: lines of which none is the other's image have no mean of s².
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from analysis.arrays import Array
from analysis.sway.lines import PRECESSION_HZ, SLOW_HZ, Swings
from analysis.sway.vertical import GRADIENT_PER_M, Places

_MU0_4PI = 1e-7  # [T m/A]
#: Samples at either end that the filter's edge spoils.
_EDGE = 10


def slow_part(times: Array, signal: Places | Array) -> tuple[Array, Places]:
    """Return a record without what is faster than a precession, as the spin's own line, and without its mean.

    Args:
        times: increasing, shape (n,) [s].
        signal: shape (n,).

    Returns:
        Times, evenly, and the slow part, shape (m,).
    """
    from scipy.signal import decimate

    even = np.linspace(times[0], times[-1], times.size)
    regular = np.interp(even, times, signal - signal.mean()).astype(np.complex128)
    fewer = int((times.size - 1) / float(times[-1] - times[0]) / (2 * PRECESSION_HZ[1]))
    if fewer > 1:
        even, regular = even[::fewer], decimate(regular, fewer, ftype="fir")
    return even[_EDGE:-_EDGE], regular[_EDGE:-_EDGE]


def image(times: Array, signal: Places) -> complex:
    """Return ε of a record s + ε s*: the mean of its square over twice the mean of |s|², of the slow lines.

    Args:
        times: evenly, shape (n,) [s]; long against the beat of lines of like frequency and unlike sign.
        signal: shape (n,).
    """
    spectrum = np.fft.fft((signal - signal.mean()) * np.hanning(times.size))
    frequency = np.fft.fftfreq(times.size, float(times[1] - times[0]))
    (slow,) = np.nonzero((frequency > SLOW_HZ[0]) & (frequency < SLOW_HZ[1]))
    forward, backward = spectrum[slow], spectrum[-slow]
    energy = float(np.sum(np.abs(forward) ** 2 + np.abs(backward) ** 2))
    ratio = complex(np.sum(forward * backward)) / energy if energy else 0j
    # ⟨z²⟩ = 2ε⟨|s|²⟩ and ⟨|z|²⟩ = (1 + |ε|²)⟨|s|²⟩
    return 2 * ratio / (1 + math.sqrt(max(1 - 4 * abs(ratio) ** 2, 0.0)))


def without_image(signal: Places, share: complex) -> Places:
    """Return s of s + ε s*."""
    return (signal - share * signal.conj()) / (1 - abs(share) ** 2)


@dataclass(frozen=True)
class Sensor:
    """A magnetometer above the top, or two vertical ones beside it.

    Attributes:
        distance: from the top [m].
        distance_u: its standard uncertainty [m].
        moment: of the top, its size [A m²].
        moment_u: its relative standard uncertainty.
        above: whether it is above the top.
        gravity: [m/s²].
    """

    distance: float
    distance_u: float
    moment: float
    moment_u: float
    above: bool
    gravity: float = 9.82

    @property
    def gain(self) -> float:
        """Flux density of a slow swing, over the place [T/m]."""
        return self._of_lean(GRADIENT_PER_M)

    @property
    def relative_u(self) -> float:
        """Relative standard uncertainty of the gain."""
        return math.hypot(4 * self.distance_u / self.distance, self.moment_u)

    def _of_lean(self, lean: float) -> float:
        near = _MU0_4PI * self.moment / self.distance**3
        return near * (3 / self.distance + (lean if self.above else 0.0))

    def corrected(self, swings: Swings) -> Swings:
        """Return swings that were found in the field over `gain`, with the amplitudes of the place."""

        def share(frequency: Array) -> Array:
            squares = (2 * np.pi * frequency) ** 2 + 0.5 * (2 * math.pi * swings.vertical.value) ** 2
            return np.array([self.gain / self._of_lean(2 * one / self.gravity) for one in squares.tolist()])

        return replace(
            swings,
            amplitude=swings.amplitude * share(swings.frequency),
            size_u=self.relative_u,
            rivals=tuple(map(self.corrected, swings.rivals)),
        )
