"""What a tilt that readings do not show could do to the constants of a drag law.

Noise hides the tilt of a top's moment (`analysis.spindown.tilt`), and the laws take it up: with a moment 0.03 rad off
the axis and readings good to 0.03 Hz the exponent is 0.05 too large.  Whether there is a tilt is then a matter of what
is known beforehand.  To first order a count with a tilt differs from one without by A b₁ + K b₂, so all is linear: A
and K are known beforehand as normal, the readings add their information, and the ratio of the two evidences says how
probable a tilt is after all.  The variance is that of an average over two models, about the one that is shown
(K. P. Burnham & D. R. Anderson, Model Selection (2002), §4.3), with the weight from the evidence.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.spindown.drag import LAWS
from analysis.spindown.lawfit import HiddenTilt, Solution
from analysis.spindown.tilt import LAST_GAP, UNKNOWN_ORIGIN, CountedLaw, Wobble

Array = NDArray[np.float64]

# Probability of a tilt before anything is read.  Every real top has one; the virtual one that only spins, and made-up
# readings, have none.
TILTED = 0.25
# A = tan²θ at the last reading, if that is near the fall: δ = 0.03 rad and its like.
A, A_U = 0.008, 0.006


class Normal(NamedTuple):
    """A normal distribution."""

    mean: float
    deviation: float

    def density(self, x: float) -> float:
        """At x."""
        z = (x - self.mean) / self.deviation
        return float(np.exp(-z * z / 2) / (self.deviation * np.sqrt(2 * np.pi)))


# Where readings of a top end that is read until it falls [Hz].  With a tilted moment it falls before the resonance:
# 80 simulated tops.  Without, it falls at the limit of a sleeping top: ten measured limits, 21.86 ± 0.25 Hz (PHYSICS.md
# §5), and the last of the readings, one each 10 s, lies some tenths above.
END_IF_TILTED, END_IF_UPRIGHT = Normal(24.8, 1.6), Normal(22.2, 0.5)
# A run may as well end for another reason, or be of another top: so often, anywhere in so wide a range [Hz].
STOPPED, RANGE_HZ = 0.2, 25.0
# No top was seen to fall at a spin much above 22 Hz: where a run ends earlier its tilt is smaller in this measure [Hz].
HIGHEST_RESONANCE_HZ = 22.0
# A top that turns slower has fallen long ago, and what is read has no such tilt [Hz].
SLOWEST_HZ = 15.0
# Points that a difference between two counts is worked out at; between them it is a straight line.
MOST_POINTS = 400
# What a wobble is worked out with: all is linear in it.
_WOBBLE = UNKNOWN_ORIGIN.value


def odds_of_tilt(last_hz: float) -> float:
    """Odds of a tilt before the readings, but for the spin at which they end [Hz].

    >>> [round(odds_of_tilt(last), 3) for last in (19.0, 21.9, 25.0)]
    [0.345, 0.029, 8.58]
    """
    tilted, upright = (
        (1 - STOPPED) * end.density(last_hz) + STOPPED / RANGE_HZ for end in (END_IF_TILTED, END_IF_UPRIGHT)
    )
    return TILTED / (1 - TILTED) * tilted / upright


def bends(plain: Solution, law: CountedLaw, shapes: Sequence[tuple[float, float, float]]) -> Array:
    """By how much counts with tilts or wobbles differ from the law itself, in units of u, shape (r, n).

    Args:
        plain: the law.
        law: with the tilt.
        shapes: amplitude A, gap and wobble of each.
    """
    readings = plain.readings
    few = np.linspace(0.0, 1.0, min(len(readings), MOST_POINTS))
    with np.errstate(all="ignore"):
        more = law.spins(few, np.array([[*plain.q, *shape] for shape in shapes])) - law.law.spin(few, plain.q)
    return np.array([np.interp(readings.tau, few, row) * readings.weight for row in more])


def hidden_tilt(plain: Solution, noise: float, wobble: Wobble = UNKNOWN_ORIGIN) -> HiddenTilt | None:
    """What may be hidden in the noise; None where no tilt is to be expected, or nothing can be said.

    Args:
        plain: a law without the tilt.
        noise: standard deviation of a reading in units of its u, correlated noise counted as if it were larger.
        wobble: as expected.
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
    bent = bends(plain, law, [(A, gap, 0.0), (0.0, gap, _WOBBLE)]) / np.array([[A], [_WOBBLE]])
    if not np.isfinite(bent).all():
        return None
    beforehand, u = np.array([A * nearer, wobble.value]), np.array([A_U * nearer, wobble.u])
    q, _ = np.linalg.qr(plain.slopes.T)
    # in units of what is known beforehand; what the law's own parameters can follow is no evidence
    own = (bent - (bent @ q) @ q.T) * u[:, None]
    noise = max(noise, 1e-5 * float(np.abs(own).max()))  # readings without noise: as good as these
    own, mean = own / noise, beforehand / u
    after = np.linalg.inv(np.eye(2) + own @ own.T)
    found = after @ (mean + own @ plain.residuals / noise)
    evidence = 0.5 * (np.linalg.slogdet(after)[1] + found @ np.linalg.solve(after, found) - mean @ mean)
    odds = odds_of_tilt(last_hz) * float(np.exp(np.clip(evidence, -50.0, 50.0)))
    probability = odds / (1 + odds)
    with np.errstate(over="ignore", invalid="ignore"):
        moved = -covariance @ plain.slopes @ (bent * u[:, None]).T
        spread = probability * moved @ (after + np.outer(found, found)) @ moved.T
        # a top has one tilt, and nutates anew in each run: by about the same, what is expected, and by chance
        own = probability * after[1, 1] * np.outer(moved[:, 1], moved[:, 1])
    return HiddenTilt(probability, spread, spread - own) if np.isfinite(spread).all() else None
