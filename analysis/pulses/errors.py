"""Errors of the analysis of pulses; each carries what was seen as attributes."""

from analysis.errors import AnalysisError


class TooFewPulses(AnalysisError):
    """Fewer pulses than a frequency and its slope need, or none that return regularly.

    Attributes:
        duration: of the record [s].
    """

    HINT = "record longer, or look at the trace: does light reach the detector, is the trigger level inside the pulse?"

    def __init__(self, *, seen: int, needed: int, duration: float) -> None:
        self.seen, self.needed, self.duration = seen, needed, duration
        super().__init__(
            "{seen} pulses in {duration:.3g} s, at least {needed} are needed: {hint}"
            if seen < needed
            else "{seen} pulses in {duration:.3g} s that do not return regularly: {hint}",
            hint=self.HINT,
        )


class OnlyHum(TooFewPulses):
    """Hum of the mains, and too few pulses or none."""

    HINT = "the trace holds hum of the mains, shield the detector from lamps, and look at the trace"
