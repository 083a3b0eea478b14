"""The result of a pulse analysis."""

import math
from dataclasses import dataclass
from typing import Literal

from analysis.pulses.jump import Jump
from analysis.uncertainty import Estimate

Method = Literal["edges", "matched", "likelihood", "line"]


@dataclass(frozen=True)
class Finding:
    """What to know of a trace before using its frequency, without words.

    Attributes:
        name: a short name, the same in all versions: a row of `levilab.pipelines.spin.words`, which lists `values`.
        of: which of the cases of that name; empty where there is one.
        values: what was seen.
        where: number of the first window or record of several with this finding, from 1 on; how many have it; how many
            there are.  Empty: of the only one.
    """

    name: str
    of: str = ""
    values: tuple[float, ...] = ()
    where: tuple[int, ...] = ()


@dataclass(frozen=True)
class SpinFrequency:
    """The spin frequency of a top at one time, and its slope.

    Attributes:
        frequency: at the reference time [Hz].
        chirp: its slope there [Hz/s].
        phase: there [turns], from 0 to 1; the middle of a pulse passes at 0.
        reference_time: [s]; the middle of the record, moved a little where pulses are missing on one side.
        method: by which it was found; line: of a magnetometer, whose turns count as pulses.
        bound: Cramér–Rao bound of the frequency [Hz], for the noise and the pulse as estimated; None for lists of
            times, where it is the uncertainty itself.
        pulses: number of those used.
        missing: turns without a pulse.
        doubled: pulses beyond one a turn.
        scatter: standard deviation of one pulse's time [s].
        snr_db: 20 log₁₀ of the pulse's height over the noise of a sample; None for lists of times.
        notes: findings.
        bend: change of the slope [Hz/s²], the same at all times; None where the slope was said to stay.
        correlations: of frequency and chirp, frequency and bend, chirp and bend.
        u_of_pulses: standard uncertainties of frequency [Hz] and slope [Hz/s], had the bend been known; None: not
            known.
        freedom: degrees of freedom of the scatter that u comes from; u has Student's factor for them.  None: not known.
        jump: of the record's time; None: there is none.
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
    u_of_pulses: tuple[float, float] | None = None
    freedom: float | None = None
    jump: Jump | None = None

    def at(self, time: float) -> Estimate:
        """Return the frequency at another time [s], along the slope and its bend."""
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
