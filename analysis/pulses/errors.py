"""Errors of the analysis of pulses; each carries what was seen as attributes."""

from analysis.errors import AnalysisError
from analysis.numbers import digits


class TooFewPulses(AnalysisError):
    """Fewer pulses than a frequency and its slope need, or none that return regularly.

    Attributes:
        duration: of the record [s].
    """

    HINT = "record longer, or look at the trace: does light reach the detector, is the trigger level inside the pulse?"

    def __init__(self, *, seen: int, needed: int, duration: float) -> None:
        self.seen, self.needed, self.duration = seen, needed, duration
        wanted = f", at least {needed} are needed" if seen < needed else " that do not return regularly"
        super().__init__(f"{seen} pulses in {digits(duration, 3)} s{wanted}: {self.HINT}")


class OnlyHum(TooFewPulses):
    """Hum of the mains, and too few pulses or none."""

    HINT = "the trace holds hum of the mains, shield the detector from lamps, and look at the trace"
