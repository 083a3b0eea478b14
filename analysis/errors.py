"""What an analysis raises when the readings do not allow it; each carries what was seen as attributes."""


class AnalysisError(Exception):
    """The readings do not allow this analysis. The text is one sentence fit for a person."""


class TooFewReadings(AnalysisError):
    """Fewer readings than the analysis needs."""

    def __init__(self, *, seen: int, needed: int) -> None:
        self.seen, self.needed = seen, needed
        super().__init__(f"{seen} usable readings, at least {needed} are needed: record longer or more often")
