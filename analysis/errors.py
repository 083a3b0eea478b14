"""What an analysis raises when the readings do not allow it; each carries what was seen as attributes."""


class AnalysisError(Exception):
    """The readings do not allow this analysis. The text is one sentence fit for a person.

    Attributes:
        sentence: with the names of its values in braces; other languages have it by this key.
        values: its attributes, and what a sentence has beside them.
    """

    def __init__(self, sentence: str, /, **values: object) -> None:
        self.sentence, self.values = sentence, vars(self) | values
        super().__init__(sentence.format(**self.values))


class TooFewReadings(AnalysisError):
    """Fewer readings than the analysis needs."""

    def __init__(self, *, seen: int, needed: int) -> None:
        self.seen, self.needed = seen, needed
        super().__init__("{seen} usable readings, at least {needed} are needed: record longer or more often")


class ShapesDiffer(AnalysisError):
    """Two columns of one table that do not have the same length, or are no columns at all."""

    def __init__(self, *, quantity: str, seen: tuple[int, ...], expected: tuple[int, ...]) -> None:
        self.quantity, self.seen, self.expected = quantity, seen, expected
        super().__init__(
            "{quantity} has shape {shape}, {wanted} was expected: give one value for each time, as one column",
            shape=str(seen), wanted=str(expected),
        )  # fmt: skip


class NotFinite(AnalysisError):
    """A reading that is no number."""

    def __init__(self, *, quantity: str, index: int, value: float) -> None:
        self.quantity, self.index, self.value = quantity, index, value
        super().__init__(
            "{quantity} number {number} is {value}, a finite number was expected: leave that reading out",
            number=index + 1,
        )


class TimesNotIncreasing(AnalysisError):
    """Times that stand still or run backwards."""

    def __init__(self, *, index: int, before: float, after: float) -> None:
        self.index, self.before, self.after = index, before, after
        super().__init__(
            "time number {number} is {after:g} s and follows {before:g} s, increasing times were expected: "
            "sort the readings, or analyse joined runs one by one",
            number=index + 1,
        )


class NotPositive(AnalysisError):
    """A quantity that must be above zero and is not."""

    def __init__(self, *, quantity: str, unit: str, index: int, value: float) -> None:
        self.quantity, self.unit, self.index, self.value = quantity, unit, index, value
        super().__init__(
            "{quantity} number {number} is {value:g} {unit}, more than zero was expected: "
            "leave the reading out or correct it",
            number=index + 1,
        )
