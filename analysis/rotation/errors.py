"""Errors of the analysis of a magnetometer's record; each carries what was seen as attributes."""

from analysis.errors import AnalysisError


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
            "in {duration:.3g} s no line from {lowest:.3g} to {highest:.3g} Hz stands out of the noise: bring the "
            "sensor nearer to the top, or record longer"
        )
