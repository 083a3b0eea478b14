"""Errors of the analysis of a magnetometer's record; each carries what was seen as attributes."""

from analysis.errors import AnalysisError
from analysis.numbers import digits


class NoLine(AnalysisError):
    """No line stands out of a magnetometer's noise.

    Attributes:
        lowest, highest: where it was searched [Hz].
        duration: of the record [s].
        gain: of the strongest one, as natural logarithm of a likelihood.
    """

    def __init__(self, *, lowest: float, highest: float, duration: float, gain: float) -> None:
        self.lowest, self.highest, self.duration, self.gain = lowest, highest, duration, gain
        super().__init__(
            f"in {digits(duration, 3)} s no line from {digits(lowest, 3)} to {digits(highest, 3)} Hz stands out of the "
            "noise: bring the sensor nearer to the top, or record longer"
        )
