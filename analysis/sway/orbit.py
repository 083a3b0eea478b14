"""Frequencies of the two slow swings at finite amplitude, by harmonic balance.

A top that swings sideways in both senses at once, x + iy = A₋ e^{iα₋t} + A₊ e^{iα₊t} + …, repeats itself, in a frame
that turns at α₊, with the beat α₊ − α₋.  In this frame place, axis and height are sums of the beat's harmonics with
real coefficients; the equations of motion at evenly distributed phases of the beat determine them, and both
frequencies, at given amplitudes.  The beat of the thesis's top, 1.3 Hz, is near its vertical swing, 1.2 Hz, which makes
the shift large: −5 % of the split for amplitudes of 1 mm.

Source of the method: Krack & Gross, Harmonic Balance for Nonlinear Vibration Problems (2019), §2.
"""

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.errors import AnalysisError
from analysis.stability import AxialField, SymmetricTop, modes

#: Harmonics of the beat, and phases of it at which the equations hold: the next would change no digit at 2 mm.
_HARMONICS, _PHASES = 4, 20
#: Scale of places [m], and of residuals that count as none.
_MILLIMETRE, _NONE = 1e-3, 1e-6


class NoSwing(AnalysisError):
    """No motion of these amplitudes [m] at this spin [Hz]."""

    def __init__(self, *, amplitudes: tuple[float, float], spin: float) -> None:
        self.amplitudes, self.spin = amplitudes, spin
        super().__init__(
            "no steady swing of {first:.3g} and {second:.3g} mm at a spin of {spin:.4g} Hz in this field: smaller "
            "swings, or the base and the top that they were seen with, are needed",
            first=1e3 * amplitudes[0], second=1e3 * amplitudes[1],
        )  # fmt: skip


def small_swings(field: AxialField, top: SymmetricTop, height: float, spin_hz: float) -> tuple[float, float]:
    """Return the frequencies of the backward and the forward slow swing of small motions [Hz]."""
    backward, forward = sorted(sorted(modes(field, top, height, spin_hz).real.tolist(), key=abs)[:2])
    return backward, forward


def slow_swings(
    field: AxialField, top: SymmetricTop, height: float, spin_hz: float, amplitudes: tuple[float, float]
) -> tuple[float, float]:
    """Return the frequencies of the backward and the forward slow swing [Hz], the backward one negative.

    Args:
        field: on the axis, with four derivatives, shape (5, n).
        top: with the moment of a point; its mass is what floats at the height.
        height: at rest [m].
        spin_hz: turns about the axis per second, positive.
        amplitudes: of the backward and of the forward swing [m].

    Raises:
        NoSwing: the top does not swing steadily there.
    """
    from scipy.optimize import root

    small = 2 * np.pi * np.array(small_swings(field, top, height, spin_hz))
    k = np.arange(-_HARMONICS - 1, _HARMONICS + 1)  # −1 is the backward swing, 0 the forward one
    n, of_height = k.size, np.arange(_HARMONICS + 1)
    phase = 2 * np.pi * np.arange(_PHASES) / _PHASES
    waves, cosines = np.exp(1j * np.outer(phase, k)), np.cos(np.outer(phase, of_height))
    to_waves, to_cosines = waves.conj().T / _PHASES, cosines.T / _PHASES
    mass, turning = top.mass, top.axial * 2 * np.pi * spin_hz
    swings = [_HARMONICS, _HARMONICS + 1]

    def missing(unknown: Array) -> Array:
        place, axis, rise = unknown[:n] * _MILLIMETRE, unknown[n : 2 * n], unknown[2 * n : -2] * _MILLIMETRE
        low, high = unknown[-2:]
        rates = high + k * (high - low)
        z = height + cosines @ rise
        x, lean, leaning = waves @ place, waves @ axis, waves @ (1j * rates * axis)
        upright = np.sqrt(1 - np.abs(lean) ** 2)
        force, weight, torque = _loads(field(z), x, lean, upright)
        straightening = -(lean.conj() * leaning).real / upright
        momentum = 1j * top.transverse * (upright * leaning - lean * straightening) + turning * lean
        sideways = to_waves @ (top.moment * force) / mass + rates**2 * place
        tilting = (1j * rates * (to_waves @ momentum) - to_waves @ (top.moment * torque)) / (1j * turning * 10)
        vertical = to_cosines @ (top.moment * weight / mass - top.gravity)
        vertical[1:] = 2 * vertical[1:] + (of_height[1:] * (high - low)) ** 2 * rise[1:]
        wanted = place[swings] / _MILLIMETRE - np.array(amplitudes) / _MILLIMETRE
        return np.concatenate([sideways.real / _MILLIMETRE, tilting.real / _MILLIMETRE, vertical / _MILLIMETRE, wanted])

    start = np.zeros(2 * n + _HARMONICS + 3)
    start[swings] = np.array(amplitudes) / _MILLIMETRE
    _, stiffness, coupling = top.stiffness(field, np.array([height]))[:, 0]
    for i, rate, amplitude in zip(swings, small, amplitudes, strict=True):
        start[n + i] = (stiffness + mass * rate**2) / -coupling * amplitude
    start[-2:] = small
    with np.errstate(invalid="ignore"):  # a search may step to where an axis is longer than 1
        found = root(missing, start, method="hybr", tol=1e-12)
    if not np.abs(found.fun).max() < _NONE:
        raise NoSwing(amplitudes=amplitudes, spin=spin_hz)
    low, high = found.x[-2:] / (2 * np.pi)
    return float(low), float(high)


def pumps(
    field: AxialField, top: SymmetricTop, height: float, spin_hz: float, amplitudes: tuple[float, float]
) -> Array:
    """Return the coupling of each slow swing to the line at the other swing ± the vertical one [Hz³].

    Stiffnesses change with height, so that a product of either swing and the vertical one moves the other swing.  To
    lowest order backward and forward swing are shifted by ∓ and ± this over beat² − vertical².

    field, top, height, spin_hz, amplitudes: as of `slow_swings`.
    """
    tilt, slope, bend, third = top.moment * field(np.array([height]))[:4, 0]
    rates = 2 * np.pi * np.array(small_swings(field, top, height, spin_hz))
    turning = top.axial * 2 * np.pi * spin_hz
    lean = slope / 2 / (top.transverse * rates**2 - turning * rates - tilt)  # over the place
    inertia = 2 * top.mass * rates + lean**2 * (2 * top.transverse * rates - turning)
    coupling = third / 2 + bend / 2 * lean.sum() + slope * lean.prod()
    others = np.array(amplitudes)[::-1]
    return np.asarray((coupling * others) ** 2 / (2 * top.mass * np.abs(inertia)) / (2 * np.pi) ** 3)


def _loads(field: Array, x: NDArray[np.complex128], lean: NDArray[np.complex128], upright: Array) -> tuple[Array, ...]:
    """Return sideways force, vertical force and sideways torque of a moment of 1 A m² off the axis.

    A field without sources has B_z = b − b″r²/4 + b⁗r⁴/64 and B_r/r = −b′/2 + b‴r²/16.  Complex numbers: x + iy.
    """
    b0, b1, b2, b3, b4 = field
    r2, along = np.abs(x) ** 2, (lean.conj() * x).real
    axial, radial = b0 - b2 * r2 / 4 + b4 * r2**2 / 64, -b1 / 2 + b3 * r2 / 16
    sideways = upright * (-b2 / 2 + b4 * r2 / 16) * x + lean * radial + along * b3 / 8 * x
    vertical = upright * (b1 - b3 * r2 / 4) + along * (-b2 / 2 + b4 * r2 / 16)
    return sideways, vertical, 1j * (upright * radial * x - lean * axial)
