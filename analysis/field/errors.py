"""Errors of the analysis of a scan of the field; each carries what was seen as attributes."""

from analysis.errors import AnalysisError


class TooFewHeights(AnalysisError):
    """A scan at too few heights to distinguish strength, origin and background.

    Attributes:
        lowest, highest: of those seen [m].
    """

    def __init__(self, *, seen: int, needed: int, lowest: float, highest: float) -> None:
        self.seen, self.needed, self.lowest, self.highest = seen, needed, lowest, highest
        super().__init__(
            "different heights: {seen}, from {low_mm:.4g} to {high_mm:.4g} mm, at least {needed} are needed: {advice}"
            if seen
            else "different heights: 0, at least {needed} are needed: {advice}",
            advice="scan on, from below to above the place where the top floats", low_mm=1e3 * lowest,
            high_mm=1e3 * highest,
        )  # fmt: skip


class FieldStandsStill(AnalysisError):
    """A flux density that is the same at several heights.

    Attributes:
        low, high: of these heights [m].
        value: of all [T].
    """

    def __init__(self, *, low: float, high: float, value: float) -> None:
        self.low, self.high, self.value = low, high, value
        super().__init__(
            "the flux density stays at {mt:.6g} mT from {low_mm:.4g} to {high_mm:.4g} mm, where it must change: the "
            "probe is saturated, or not moved; choose a larger range or leave these readings out",
            mt=1e3 * value, low_mm=1e3 * low, high_mm=1e3 * high,
        )  # fmt: skip


class FieldTurnsOver(AnalysisError):
    """A flux density that changes its sign where that of a ring does not.

    Attributes:
        low, high: heights between which it does [m].
        reversal: where the base's own changes its sign [m].
    """

    def __init__(self, *, low: float, high: float, reversal: float) -> None:
        self.low, self.high, self.reversal = low, high, reversal
        super().__init__(
            "the flux density changes its sign between {low_mm:.4g} and {high_mm:.4g} mm, this base's does so at "
            "about {at_mm:.3g} mm: was the probe turned over in between, or not on the axis?",
            low_mm=1e3 * low, high_mm=1e3 * high, at_mm=1e3 * reversal,
        )  # fmt: skip


class NoField(AnalysisError):
    """A scan in which the probe sees nothing of a base.

    Attributes:
        largest: of its readings [T].
        background_u: of their zero [T].
    """

    def __init__(self, *, largest: float, background_u: float) -> None:
        self.largest, self.background_u = largest, background_u
        super().__init__(
            "the flux density is nowhere above {mt:.3g} mT, which zero and background alone may make (u = {u_mt:.2g} "
            "mT): is the base there, and was the probe zeroed in its chamber?",
            mt=1e3 * largest, u_mt=1e3 * background_u,
        )  # fmt: skip


class ImpossibleRing(AnalysisError):
    """Radii that no ring has."""

    def __init__(self, *, inner: float, outer: float) -> None:
        self.inner, self.outer = inner, outer
        super().__init__(
            "inner radius {inner:g} m, outer radius {outer:g} m: 0 < inner < outer is expected; correct the radii"
        )


class NotFitted(AnalysisError):
    """A search that did not end."""

    def __init__(self, *, what: str, advice: str) -> None:
        self.what, self.advice = what, advice
        super().__init__("{what}: the fit did not converge; {advice}")
