"""The transverse part of a top's moment, from the amplitude that it has at a distance."""

import math

from analysis.rotation.result import FieldSpin
from analysis.uncertainty import Estimate

#: μ₀/4π [T m/A].
_MU_0_OVER_4_PI = 1e-7


def transverse_moment(spin: FieldSpin, distance: Estimate, below: float = 0.0) -> Estimate | None:
    """Return the transverse part of the moment [A m²]; None with fewer than three axes, or without a distance.

    A dipole that turns about the vertical has at the distance r, in a direction β below the horizontal, three
    components whose squared amplitudes add up to (μ₀ m/4π r³)² (2 + 3 cos²β), however the sensor is turned.

    Args:
        spin: with its amplitudes.
        distance: of the sensor from the axis of the top, horizontally [m], with its standard uncertainty.
        below: how far it lies below the top's centre [m]; as uncertain as the distance.
    """
    if len(spin.amplitude) < 3 or not distance.value:
        return None
    far, u_far = distance.value, distance.u or 0.0
    # noise adds to each square on average
    square = sum(a * a - 2 * u * u for a, u in zip(spin.amplitude, spin.u_amplitude, strict=True))
    u_square = 2 * math.sqrt(sum((a * u) ** 2 for a, u in zip(spin.amplitude, spin.u_amplitude, strict=True)))
    if square <= 0:
        return Estimate(0.0, None, "A m^2")
    r = math.hypot(far, below)
    angles = 2 + 3 * (far / r) ** 2
    value = math.sqrt(square / angles) * r**3 / _MU_0_OVER_4_PI
    # derivatives of ln m = 3 ln r − ½ ln(2 + 3 far²/r²)
    by_far = 3 * far / r**2 - 3 * far * below**2 / r**4 / angles
    by_below = 3 * below / r**2 + 3 * far**2 * below / r**4 / angles
    relative = math.sqrt((u_square / (2 * square)) ** 2 + (u_far * by_far) ** 2 + (u_far * by_below) ** 2)
    return Estimate(value, value * relative, "A m^2")
