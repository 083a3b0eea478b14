"""Errors of the analysis of a scan of the field; each carries what was seen as attributes."""

from analysis.errors import AnalysisError
from analysis.numbers import digits


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
