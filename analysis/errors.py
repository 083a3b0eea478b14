"""What an analysis raises when the readings do not allow it; each carries what was seen as attributes."""

from collections.abc import Iterable


class AnalysisError(Exception):
    """The readings do not allow this analysis. The text is one sentence fit for a person."""


class TooFewReadings(AnalysisError):
    """Fewer readings than the analysis needs."""

    def __init__(self, *, seen: int, needed: int) -> None:
        self.seen, self.needed = seen, needed
        super().__init__(f"{seen} usable readings, at least {needed} are needed: record longer or more often")


class ShapesDiffer(AnalysisError):
    """Two columns of one table that do not have the same length, or are no columns at all."""

    def __init__(self, *, quantity: str, seen: tuple[int, ...], expected: tuple[int, ...]) -> None:
        self.quantity, self.seen, self.expected = quantity, seen, expected
        super().__init__(
            f"{quantity} has shape {seen}, {expected} was expected: give one value for each time, as one column"
        )


class NotFinite(AnalysisError):
    """A reading that is no number."""

    def __init__(self, *, quantity: str, index: int, value: float) -> None:
        self.quantity, self.index, self.value = quantity, index, value
        super().__init__(
            f"{quantity} number {index + 1} is {value}, a finite number was expected: leave that reading out"
        )


class TimesNotIncreasing(AnalysisError):
    """Times that stand still or run backwards."""

    def __init__(self, *, index: int, before: float, after: float) -> None:
        self.index, self.before, self.after = index, before, after
        super().__init__(
            f"time number {index + 1} is {after:g} s and follows {before:g} s, increasing times were expected: "
            "sort the readings, or analyse joined runs one by one"
        )


class NotPositive(AnalysisError):
    """A quantity that must be above zero and is not."""

    def __init__(self, *, quantity: str, unit: str, index: int, value: float) -> None:
        self.quantity, self.unit, self.index, self.value = quantity, unit, index, value
        super().__init__(
            f"{quantity} number {index + 1} is {value:g} {unit}, more than zero was expected: "
            "leave the reading out or correct it"
        )


class NoSpinDown(AnalysisError):
    """A spin that does not fall: first and last are medians of the first and last third [Hz]."""

    def __init__(self, *, first: float, last: float) -> None:
        self.first, self.last = first, last
        super().__init__(
            f"the spin goes from {first:.6g} Hz to {last:.6g} Hz, a falling spin was expected: is the drive still on?"
        )


class UnknownName(AnalysisError):
    """A name that is in no table of this analysis."""

    def __init__(self, *, kind: str, seen: str, known: Iterable[str]) -> None:
        self.kind, self.seen, self.known = kind, seen, tuple(known)
        super().__init__(f"no {kind} is called {seen!r}: choose from {', '.join(self.known)}")


class NothingToCombine(AnalysisError):
    """No run, or no drag law that was fitted to every run."""

    def __init__(self, *, runs: int) -> None:
        self.runs = runs
        super().__init__(
            f"{runs} runs have no drag law in common, at least one run and one law were expected: "
            "fit the same laws to each run"
        )


class NoRange(AnalysisError):
    """Points that all lie at one drive frequency [Hz]."""

    def __init__(self, *, at: float, seen: int) -> None:
        self.at, self.seen = at, seen
        super().__init__(
            f"all {seen} points are at a drive frequency of {at:g} Hz, a line needs several: sweep the drive"
        )
