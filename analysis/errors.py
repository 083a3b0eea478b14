"""What an analysis raises when the readings do not allow it; each carries what was seen as attributes."""

from collections.abc import Iterable

from analysis.numbers import digits


class AnalysisError(Exception):
    """The readings do not allow this analysis. The text is one sentence fit for a person."""


class TooFewReadings(AnalysisError):
    """Fewer readings than the analysis needs."""

    def __init__(self, *, seen: int, needed: int) -> None:
        self.seen, self.needed = seen, needed
        super().__init__(f"{seen} usable readings, at least {needed} are needed: record longer or more often")


class TooFewPulses(AnalysisError):
    """Fewer pulses than a frequency and its slope need, or none that return regularly.

    Attributes:
        duration: of the record [s].
    """

    def __init__(self, *, seen: int, needed: int, duration: float) -> None:
        self.seen, self.needed, self.duration = seen, needed, duration
        wanted = f", at least {needed} are needed" if seen < needed else " that do not return regularly"
        super().__init__(
            f"{seen} pulses in {digits(duration, 3)} s{wanted}: record longer, or look at the trace: "
            "does light reach the detector, is the trigger level inside the pulse?"
        )


class OnlyHum(TooFewPulses):
    """Hum of the mains, and too few pulses or none."""

    def __init__(self, *, seen: int, needed: int, duration: float) -> None:
        super().__init__(seen=seen, needed=needed, duration=duration)
        text = f"the trace holds hum of the mains, and in {digits(duration, 3)} s no pulses that return regularly: "
        self.args = (text + "shield the detector from lamps, and look at the trace",)


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


class TooFewHeights(AnalysisError):
    """A scan at too few heights to distinguish strength, origin and background.

    Attributes:
        lowest, highest: of those seen [m].
    """

    def __init__(self, *, seen: int, needed: int, lowest: float, highest: float) -> None:
        self.seen, self.needed, self.lowest, self.highest = seen, needed, lowest, highest
        span = f" (from {1e3 * lowest:.4g} to {1e3 * highest:.4g} mm)" if seen else ""
        where = f" (all at {1e3 * lowest:.4g} mm)" if seen == 1 else span
        super().__init__(
            f"readings at {seen} height{'s' * (seen != 1)}{where}, at least {needed} are needed: "
            "scan on, from below to above the place where the top floats"
        )


class FieldStandsStill(AnalysisError):
    """A flux density that is the same at several heights.

    Attributes:
        low, high: of these heights [m].
        value: of all [T].
    """

    def __init__(self, *, low: float, high: float, value: float) -> None:
        self.low, self.high, self.value = low, high, value
        super().__init__(
            f"the flux density stays at {1e3 * value:.6g} mT from {1e3 * low:.4g} to {1e3 * high:.4g} mm, where it "
            "must change: the probe is saturated, or not moved; choose a larger range or leave these readings out"
        )


class FieldTurnsOver(AnalysisError):
    """A flux density that changes its sign where that of a ring does not.

    Attributes:
        low, high: heights between which it does [m].
        reversal: where the base's own changes its sign [m].
    """

    def __init__(self, *, low: float, high: float, reversal: float) -> None:
        self.low, self.high, self.reversal = low, high, reversal
        super().__init__(
            f"the flux density changes its sign between {1e3 * low:.4g} and {1e3 * high:.4g} mm, this base's does so "
            f"at about {digits(1e3 * reversal, 3)} mm: was the probe turned over in between, or not on the axis?"
        )


class NoField(AnalysisError):
    """A scan in which the probe sees nothing of a base.

    Attributes:
        largest: of its readings [T].
        background_u: of their zero [T].
    """

    def __init__(self, *, largest: float, background_u: float) -> None:
        self.largest, self.background_u = largest, background_u
        super().__init__(
            f"the flux density is nowhere above {digits(1e3 * largest, 3)} mT, which zero and background alone may "
            f"make (u = {digits(1e3 * background_u)} mT): is the base there, and was the probe zeroed in its chamber?"
        )


class ImpossibleRing(AnalysisError):
    """Radii that no ring has."""

    def __init__(self, *, inner: float, outer: float) -> None:
        self.inner, self.outer = inner, outer
        super().__init__(
            f"inner radius {inner:g} m, outer radius {outer:g} m: 0 < inner < outer is expected; correct the radii"
        )


class NotFitted(AnalysisError):
    """A search that did not end."""

    def __init__(self, *, what: str, advice: str) -> None:
        self.what = what
        super().__init__(f"{what}: the fit did not converge; {advice}")


class ImpossibleCylinder(AnalysisError):
    """A part of a top with a value that no cylinder has."""

    def __init__(self, *, part: str, quantity: str, seen: float, expected: str) -> None:
        self.part, self.quantity, self.seen, self.expected = part, quantity, seen, expected
        super().__init__(f"part {part}: {quantity} = {seen:g}, {expected} is expected: correct it")
