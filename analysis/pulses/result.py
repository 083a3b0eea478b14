"""The result of a pulse analysis."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from analysis.uncertainty import Estimate

#: How the slope itself changes, as a multiple of slope²/frequency, and its standard uncertainty.  Slower and slower: n
#: under a drag in proportion to the n-th power of the spin, which is 1 to 2; an even ramp, 0, is three u away.
UNDER_DRAG, UNDER_DRAG_U = 1.5, 0.5
#: Faster and faster: only a drive does that.
UNDER_DRIVE, UNDER_DRIVE_U = 0.0, 0.6

#: Odds of a bend that neither a drag nor an even ramp makes, as the swing of a top about its drive does, before the
#: pulses are seen, times the part of what it may be that pulses leave open.  The bend is fitted from four standard
#: uncertainties on: there the pulses have made it 12 to 1.
OTHER_BEND = 0.004

Method = Literal["edges", "matched", "likelihood"]


@dataclass(frozen=True)
class Finding:
    """A remark for the user: a short name, the same in all versions, and a sentence.

    Names: fell-back, missing, doubled, wrong, half, double, mains, hum, clipped, gap, not-finite, spikes, wander,
    curved, correlated, scattered, few-pulses, unsteady, coarse; no-pulses of a run with several records.
    """

    name: str
    text: str


@dataclass(frozen=True)
class SpinFrequency:
    """The spin frequency of a top at one time, and its slope.

    Attributes:
        frequency: at the reference time [Hz].
        chirp: its slope there [Hz/s]; independent of the frequency, or of the bend where there is one.
        phase: there [turns], from 0 to 1; the middle of a pulse passes at 0.
        reference_time: [s]; the middle of the record, moved a little where pulses are missing on one side.
        method: that found it.
        bound: Cramér–Rao bound of the frequency [Hz], for the noise and the pulse as estimated; None for lists of
            times, where it is the uncertainty itself.
        pulses: so many were used.
        missing: turns without a pulse.
        doubled: pulses beyond one a turn.
        scatter: standard deviation of one pulse's time [s].
        snr_db: 20 log₁₀ of the pulse's height over the noise of a sample; None for lists of times.
        notes: findings.
        bend: how the slope itself changes [Hz/s²], the same at all times; None where no third degree was fitted.
        correlations: of frequency and chirp, frequency and bend, chirp and bend; 0 without a bend.
        unfitted: the bend [Hz/s²] that a third degree would show, with u by the scatter alone; None where it was
            fitted, the degree was given, or there are fewer than eight pulses.
        freedom: degrees of freedom of the scatter that u comes from; u has Student's factor for them.  None: not known.
    """

    frequency: Estimate
    chirp: Estimate
    phase: Estimate
    reference_time: float
    method: Method
    bound: float | None
    pulses: int
    missing: int
    doubled: int
    scatter: float
    snr_db: float | None
    notes: tuple[Finding, ...] = ()
    bend: Estimate | None = None
    correlations: tuple[float, float, float] = (0.0, 0.0, 0.0)
    unfitted: Estimate | None = None
    freedom: float | None = None

    def at(self, time: float) -> Estimate:
        """The frequency at another time [s], along the slope and its bend."""
        away = time - self.reference_time
        frequency, chirp, bend = self.frequency, self.chirp, self.bend or Estimate(0.0, 0.0, "Hz/s^2")
        assert frequency.value is not None
        assert chirp.value is not None
        assert bend.value is not None
        value = frequency.value + chirp.value * away + bend.value * away**2 / 2
        if frequency.u is None or chirp.u is None or bend.u is None:
            return Estimate(value, None, "Hz")
        f, c, b = frequency.u, chirp.u * away, bend.u * away**2 / 2
        fc, fb, cb = self.correlations
        return Estimate(
            value, math.sqrt(max(f * f + c * c + b * b + 2 * (fc * f * c + fb * f * b + cb * c * b), 0.0)), "Hz"
        )

    def under_drag(self) -> SpinFrequency:
        """The same for a top whose slope may change as air drag or an even ramp has it.

        Under ν′ = −cνⁿ the slope changes by ν″ = nν′²/ν a second, and ν″ by ν‴ = n(2n − 1)ν′³/ν².  A parabola of turns
        through times over a span T gives a frequency in the middle that is ν″T²/40 too high; with a third degree
        nothing of that is left.  Either of them gives a slope that is ν‴T²/56 too high.  Both are taken off, with
        n = 1.5 ± 0.5 for a top that gets slower, or with the bend that was fitted where it is one of a drag.

        Where no third degree was fitted there may still be a bend that no drag makes: what it would do to the
        frequency is in u, as probable as the pulses make it.
        """
        frequency, chirp = self.frequency, self.chirp
        if not frequency.value or not chirp.value:
            return self
        span2 = ((self.pulses + self.missing - 1) / frequency.value) ** 2
        second, third = chirp.value**2 / frequency.value, chirp.value**3 / frequency.value**2
        n, u_n = (UNDER_DRAG, UNDER_DRAG_U) if chirp.value < 0 else (UNDER_DRIVE, UNDER_DRIVE_U)
        if self.bend is None:
            u_bend = math.hypot(u_n * second, self._other_bend(n * second, u_n * second))
            frequency = _less(frequency, n * second * span2 / 40, u_bend * span2 / 40)
        else:
            assert self.bend.value is not None
            fitted, u_fitted = self.bend.value / second, (self.bend.u or 0.0) / second
            if abs(fitted - n) > 3 * math.hypot(u_n, u_fitted):
                return self
            share = u_n**2 / (u_n**2 + u_fitted**2)
            n, u_n = n + share * (fitted - n), math.sqrt(1 - share) * u_n
        most = third * span2 / 56
        chirp = _less(chirp, n * (2 * n - 1) * most, abs(4 * n - 1) * u_n * most)
        return replace(self, frequency=frequency, chirp=chirp)

    def _other_bend(self, expected: float, u_expected: float) -> float:
        """Root mean square of what a bend that was not fitted adds to the expected one [Hz/s²].

        The average over two models, with and without it, about the one that is shown (K. P. Burnham & D. R. Anderson,
        Model Selection (2002), §4.3); the evidence is the ratio of Student's likelihoods.
        """
        if self.unfitted is None or self.unfitted.value is None or not self.unfitted.u:
            return 0.0
        freedom = max(self.pulses - 4, 1)
        away, u = self.unfitted.value - expected, math.hypot(self.unfitted.u, u_expected)
        log_odds = math.log(OTHER_BEND) + 0.5 * (freedom + 1) * math.log1p((away / u) ** 2 / freedom)
        probability = 1 / (1 + math.exp(-min(log_odds, 50.0)))
        return math.sqrt(probability) * math.hypot(away, u)


def _less(estimate: Estimate, bias: float, u_bias: float) -> Estimate:
    """An estimate with a bias taken off, and its uncertainty added."""
    assert estimate.value is not None
    u = None if estimate.u is None else math.hypot(estimate.u, u_bias)
    return Estimate(estimate.value - bias, u, estimate.unit)
