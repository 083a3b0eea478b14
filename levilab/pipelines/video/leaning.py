"""The dot on the stem or the turn of the side, and the height → how the top leans, precesses and rises."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.film.swing import Swing, swing_of
from analysis.film.turning import windows_of
from analysis.uncertainty import Estimate

#: Where the precession and the vertical swing are looked for [Hz].
PRECESSION_HZ, VERTICAL_HZ = (3.0, 20.0), (0.5, 3.0)
#: u of the precession of a short film, relative: 40 tops from above are off by 0.1 % (rms), one from beside by 1.4 %.
_SHORT = 0.007
#: Order of the polynomial for what is slower than the vertical swing, of a film of some seconds.
_SLOWER = 3
#: u of the vertical swing, in parts of what a film resolves: the beat of the slow swings, near it, moves it by so much
#: (rms of 59 tops, from above and from beside).
_BEAT = 0.11
#: Share of the pictures in which a dot is seen, at least.
_SEEN = 0.8


@dataclass(frozen=True, eq=False)
class Leaning:
    """How a top leans.

    Attributes:
        x: of the unit vector along its axis, from the mean, to the right, shape (n,).
        y: upwards in the picture, shape (n,).
        time: middles of the readings of the precession, shape (m,) [s].
        precession: with its sense, counter-clockwise from above is positive, shape (m,) [Hz].
        u: shape (m,) [Hz].
        middle: precession in the middle of the film; None: it does not stand out [Hz].
        tilt: its amplitude [rad].
    """

    x: Array
    y: Array
    time: Array
    precession: Array
    u: Array
    middle: Estimate | None
    tilt: Estimate | None


@dataclass(frozen=True, eq=False)
class Rising:
    """How a top rises.

    Attributes:
        z: of the rim above its mean height, shape (n,) [m].
        swing: frequency of the vertical swing; None: it does not stand out [Hz].
        amplitude: of it [m].
    """

    z: Array
    swing: Estimate | None
    amplitude: Estimate | None


def leaning_of(times: Array, offsets: NDArray[np.complex128] | Array) -> Leaning | None:
    """Return how a top leans; None where its dot is not seen.

    Args:
        times: shape (n,) [s].
        offsets: of the dot from the middle of the rim over its height, NaN where it is not seen, shape (n,); real
            numbers from beside, where the sense of the precession is not seen.
    """
    seen = np.isfinite(offsets.real)
    if seen.mean() < _SEEN:
        return None
    lean = np.interp(times, times[seen], offsets[seen].real) + 1j * np.interp(times, times[seen], offsets[seen].imag)
    lean -= lean.mean()
    # a real swing is two lines of half its amplitude
    lines = 1 if np.iscomplexobj(offsets) else 2
    seconds = [(times[part].mean(), swing_of(times[part], lean[part], PRECESSION_HZ)) for part in windows_of(times)]
    rows = [(t, one.frequency, one.u, lines * one.amplitude, lines * one.u_amplitude) for t, one in seconds if one]
    time, frequency, u, size, u_size = np.array(rows).reshape(-1, 5).T
    frequency = frequency if lines == 1 else np.abs(frequency)
    middle = _in_the_middle(time - (times[0] + times[-1]) / 2, frequency, u) if time.size else None
    tilt = Estimate(float(size.mean()), float(np.sqrt(np.sum(u_size**2))) / size.size, "rad") if time.size else None
    return Leaning(lean.real, lean.imag, time, frequency, u, middle, tilt)


def _in_the_middle(late: Array, frequency: Array, u: Array) -> Estimate:
    """Return the frequency at time zero of a straight line through readings, or of their mean where they are few."""
    design = np.vander(late, 2 if late.size > 2 else 1, increasing=True) / u[:, None]
    inverse = np.linalg.inv(design.T @ design)
    found = inverse @ design.T @ (frequency / u)
    freedom, value = late.size - design.shape[1], abs(float(found[0]))
    if freedom == 0:
        return Estimate(value, float(np.hypot(np.sqrt(inverse[0, 0]), _SHORT * value)), "Hz")
    worse = float(np.sum((frequency / u - design @ found) ** 2)) / freedom
    return Estimate(value, float(np.sqrt(inverse[0, 0] * max(worse, 1.0))), "Hz")


def rising_of(times: Array, z: Array) -> Rising:
    """Return how a top rises.

    Args:
        times: shape (n,) [s].
        z: height above its mean, shape (n,) [m].
    """
    one: Swing | None = swing_of(times, z.astype(np.complex128), VERTICAL_HZ, _SLOWER)
    if one is None:
        return Rising(z, None, None)
    # a real swing is two lines of half its amplitude
    size = Estimate(2 * one.amplitude, 2 * one.u_amplitude, "m")
    return Rising(z, Estimate(abs(one.frequency), float(np.hypot(one.u, _BEAT / np.ptp(times))), "Hz"), size)
