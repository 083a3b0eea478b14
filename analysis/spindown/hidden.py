"""What a tilt that readings do not show could do to the constants of a drag law.

Noise hides the tilt of a top's moment (`analysis.spindown.tilt`), and the laws take it up: with a moment 0.03 rad off
the axis and readings good to 0.03 Hz the exponent is 0.05 too large.  Whether there is a tilt is then a matter of what
is known beforehand.  To first order a count with a tilt differs from one without by A b₁ + K b₂, so all is linear: A
and K are known beforehand as normal, the readings add what they tell, and the ratio of the two evidences says how
probable a tilt is after all.  The variance is that of an average over two models, about the one that is shown
(K. P. Burnham & D. R. Anderson, Model Selection (2002), §4.3), with the weight from the evidence.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.spindown.drag import LAWS
from analysis.spindown.lawfit import Solution
from analysis.spindown.tilt import LAST_GAP, WOBBLE, WOBBLE_U, CountedLaw

Array = NDArray[np.float64]

# Probability of a tilt before the readings.  Every real top has one; the virtual one that only spins, and made-up
# readings, have none.  With 1/2 the uncertainties of readings without a tilt would be 1.45 times as large, with 1/4
# they are 1.2 times; see docs/decisions/0011.
TILTED = 0.25
# A = tan²θ at the last reading, if that is near the fall: δ = 0.03 rad and its like.
A, A_U = 0.008, 0.006
# No top was seen to fall at a spin much above 22 Hz: where a run ends earlier its tilt is smaller in this measure [Hz].
HIGHEST_RESONANCE_HZ = 22.0
# A top that turns slower has fallen long ago, and what is read has no such tilt [Hz].
SLOWEST_HZ = 15.0
# Points that a difference between two counts is worked out at; between them it is a straight line.
MOST_POINTS = 400


@dataclass(frozen=True, eq=False)
class HiddenTilt:
    """A tilt that may be there.

    Attributes:
        probability: after the readings.
        spread: what it adds to the covariance of the dimensionless parameters, shape (p, p).
    """

    probability: float
    spread: Array


def bend(plain: Solution, law: CountedLaw, *, amplitude: float = 0.0, gap: float, wobble: float = 0.0) -> Array:
    """By how much a count with tilt or wobble differs from the law itself, in units of u, shape (n,)."""
    readings = plain.readings
    few = np.linspace(0.0, 1.0, min(len(readings), MOST_POINTS))
    with np.errstate(all="ignore"):
        more = law.spin(few, np.array([*plain.q, amplitude, gap, wobble])) - law.law.spin(few, plain.q)
    return np.asarray(np.interp(readings.tau, few, more) * readings.weight)


def hidden_tilt(plain: Solution, noise: float) -> HiddenTilt | None:
    """What may be hidden in the noise; None where no tilt is to be expected, or nothing can be said.

    Args:
        plain: a law without the tilt.
        noise: standard deviation of a reading in units of its u, correlated noise counted as if it were larger.
    """
    readings, covariance = plain.readings, plain.curvature.covariance
    last_hz = float(readings.x[-1]) * readings.reference_hz
    if covariance is None or not last_hz > SLOWEST_HZ or not np.isfinite(noise) or noise <= 0:
        return None
    ratio = (last_hz / HIGHEST_RESONANCE_HZ) ** 2 - 1
    gap = max(LAST_GAP, float(np.log(ratio)) if ratio > 0 else LAST_GAP)
    if gap > 1:
        return None  # more than twice the square of the resonance: a tilt is no larger than δ/3
    nearer = float(np.exp(-2 * (gap - LAST_GAP)))
    law = CountedLaw(LAWS[plain.law.name], float(readings.x[-1]))
    bends = np.array([bend(plain, law, amplitude=A, gap=gap) / A, bend(plain, law, gap=gap, wobble=WOBBLE) / WOBBLE])
    if not np.isfinite(bends).all():
        return None
    beforehand, u = np.array([A * nearer, WOBBLE]), np.array([A_U * nearer, WOBBLE_U])
    q, _ = np.linalg.qr(plain.slopes.T)
    # in units of what is known beforehand; what the law's own parameters can follow tells nothing
    own = (bends - (bends @ q) @ q.T) * u[:, None]
    noise = max(noise, 1e-5 * float(np.abs(own).max()))  # readings without noise: as good as these
    own, mean = own / noise, beforehand / u
    after = np.linalg.inv(np.eye(2) + own @ own.T)
    found = after @ (mean + own @ plain.residuals / noise)
    evidence = 0.5 * (np.linalg.slogdet(after)[1] + found @ np.linalg.solve(after, found) - mean @ mean)
    odds = TILTED / (1 - TILTED) * float(np.exp(np.clip(evidence, -50.0, 50.0)))
    probability = odds / (1 + odds)
    with np.errstate(over="ignore", invalid="ignore"):
        moved = -covariance @ plain.slopes @ (bends * u[:, None]).T
        spread = probability * moved @ (after + np.outer(found, found)) @ moved.T
    return HiddenTilt(probability, spread) if np.isfinite(spread).all() else None
