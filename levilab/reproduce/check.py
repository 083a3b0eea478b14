"""A published value beside ours: what is compared with what, how, and the verdict.

Three kinds of findings, with the same properties: a number (`Check`), an equation with a slip (`Erratum`), a sentence
that can be tried (`Statement`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol

from analysis.numbers import digits
from levilab.present.numbers import with_uncertainty
from levilab.present.units import unit as unit_row

if TYPE_CHECKING:
    from collections.abc import Iterable

    from analysis.uncertainty import Estimate
    from levilab.stability.published.printed import Printed

#: What a float loses in a difference of two numbers with few digits.
_FLOAT = 1e-9


class Verdict(Enum):
    """What a comparison says."""

    AGREES = "agrees"
    DIFFERS = "differs, for the reason shown"
    ADDED = "found here, nothing is published"
    UNEXPECTED = "UNEXPECTED"


class Comparison(Enum):
    """What a comparison is worth: what ours is compared with, and whether ours could have come out otherwise."""

    INDEPENDENT = "published"
    FITTED = "published; fitted"
    CONSTRUCTED = "published; by construction"
    RECOMPUTED = "our second way"


@dataclass(frozen=True)
class Rounding:
    """Ours is the published number within half a unit of its last digit, beside our own u."""


@dataclass(frozen=True)
class Within:
    """Ours may differ from the published number by more than its rounding.

    Attributes:
        tolerance: in the number's unit.
        why: where the tolerance comes from.
    """

    tolerance: float
    why: str


@dataclass(frozen=True)
class Among:
    """Ours is no single number: starts that the source does not tell apart give others.

    Attributes:
        low, high: the least and the greatest of ours, in the number's unit.
        step: of the scan, by which each of them may be off.
        why: what the range is of.
    """

    low: float
    high: float
    step: float
    why: str


@dataclass(frozen=True)
class Because:
    """Ours differs for a reason that is computed, too.

    Attributes:
        why: the reason, with what was computed for it.
        explained: what the reason makes of our number, to lie within the tolerance of the published one; or whether
            the reason was found to hold.
        tolerance: in the number's unit, beside the rounding of the print.
    """

    why: str
    explained: float | bool
    tolerance: float = 0.0


Way = Rounding | Within | Among | Because


class Finding(Protocol):
    """What the table of a chapter shows."""

    @property
    def name(self) -> str:
        """What is compared."""
        ...

    @property
    def place(self) -> str:
        """Where it stands in the source."""
        ...

    @property
    def published_text(self) -> str:
        """As published."""
        ...

    @property
    def ours_text(self) -> str:
        """As found here."""
        ...

    @property
    def comparison(self) -> Comparison | None:
        """What the comparison is worth; None where nothing is compared."""
        ...

    @property
    def verdict(self) -> Verdict:
        """What the comparison says."""
        ...

    @property
    def why(self) -> str:
        """How it was compared, or why it differs."""
        ...


@dataclass(frozen=True)
class Check:
    """A number.

    Attributes:
        name: what is compared.
        published: as printed.
        ours: in the unit of the published one.
        way: how they are compared.
        how: what the comparison is worth, of a number that the source prints.
    """

    name: str
    published: Printed
    ours: Estimate
    way: Way = Rounding()
    how: Comparison = Comparison.INDEPENDENT

    @property
    def comparison(self) -> Comparison:
        """What the comparison is worth: a number that the source does not print is ours."""
        return Comparison.RECOMPUTED if self.published.recomputed else self.how

    @property
    def difference(self) -> float:
        """Ours less the published number, in its unit; NaN where we have none."""
        return math.nan if self.ours.value is None else self.ours.value - self.published.value

    @property
    def verdict(self) -> Verdict:
        """What the comparison says."""
        off, room = abs(self.difference), self.published.rounding + (self.ours.u or 0.0)
        if off <= room * (1 + _FLOAT):
            return Verdict.AGREES
        if isinstance(self.way, Within) and off <= self.way.tolerance * (1 + _FLOAT):
            return Verdict.AGREES
        if isinstance(self.way, Among) and self._is_among(self.way):
            return Verdict.AGREES
        return Verdict.DIFFERS if isinstance(self.way, Because) and self._is_explained(self.way) else Verdict.UNEXPECTED

    def _is_among(self, way: Among) -> bool:
        room = (self.published.rounding + way.step) * (1 + _FLOAT)
        return way.low - room <= self.published.value <= way.high + room

    def _is_explained(self, way: Because) -> bool:
        if isinstance(way.explained, bool):
            return way.explained
        off = abs(way.explained - self.published.value)
        return off <= (self.published.rounding + way.tolerance) * (1 + _FLOAT)

    @property
    def place(self) -> str:
        """Where it stands in the source."""
        return self.published.place

    @property
    def published_text(self) -> str:
        """As printed, with its unit."""
        return _with_unit(_raised(self.published.text), self.published.unit)

    @property
    def ours_text(self) -> str:
        """Ours with u, or with one digit more than the print has."""
        if self.ours.value is None or self.ours.u:
            return with_uncertainty(self.ours)
        return _with_unit(_like(self.ours.value, self.published), self.ours.unit)

    @property
    def why(self) -> str:
        """The tolerance with its reason, or why it differs; empty within the rounding of the print."""
        if isinstance(self.way, Because):
            return self.way.why if self.verdict is not Verdict.AGREES else ""
        if isinstance(self.way, Among):
            return self.way.why if abs(self.difference) > self.published.rounding * (1 + _FLOAT) else ""
        if isinstance(self.way, Within) and abs(self.difference) > self.published.rounding:
            return f"within {digits(self.way.tolerance, 2)}: {self.way.why}"
        return "within our u" if abs(self.difference) > self.published.rounding * (1 + _FLOAT) else ""


def _with_unit(number: str, unit: str) -> str:
    """A number's text with its unit; a degree stands at the number.

    >>> _with_unit("1.5", "°"), _with_unit("0.0032", "1/s"), _with_unit("82", "")
    ('1.5°', '0.0032 s⁻¹', '82')
    """
    return f"{number}{unit}" if unit == "°" else f"{number} {unit_row(unit).text}".strip()


def _like(value: float, published: Printed) -> str:
    """A number with as many decimals as the print has and one more, so that its rounding can be seen, at least two.

    >>> from levilab.stability.published.printed import Printed
    >>> _like(22.0799, Printed("22.06", "Hz", "", "")), _like(1.76004e-5, Printed("1.760e-5", "1/rad", "", ""))
    ('22.080', '1.7600×10⁻⁵')
    """
    mantissa, _, power = published.text.lower().partition("e")
    decimals = max(len(mantissa.partition(".")[2]) + 1, 2)
    if not power:
        return f"{value:.{decimals}f}"
    return _raised(f"{value / 10.0 ** int(power):.{decimals}f}e{int(power)}")


def _raised(text: str) -> str:
    """A number's text with its power of ten as people write it."""
    mantissa, _, power = text.lower().partition("e")
    return f"{mantissa}×10{power.translate(_HIGH)}" if power else text


_HIGH = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Erratum:
    """An equation as printed and as corrected, tried on a number that neither of them decides.

    Attributes:
        place: of the equation.
        printed: what is wrong in it.
        corrected: what it should be.
        test: what the number is.
        truth: the number, from elsewhere: a simulation, an exact field, a dimension.
        by_printed: what the printed equation gives for it; None where it gives nothing that can be compared.
        by_corrected: what the corrected one gives.
        tolerance: relative, of by_corrected.
        unit: of the numbers.
        reading: how the correction was read where it says little, or what else the print has for the number.
    """

    place: str
    printed: str
    corrected: str
    test: str
    truth: float
    by_printed: float | None
    by_corrected: float
    tolerance: float
    unit: str = ""
    reading: str = ""

    @property
    def comparison(self) -> Comparison:
        """The source prints the equation, and nothing here was fitted to it."""
        return Comparison.INDEPENDENT

    @property
    def name(self) -> str:
        """What is compared."""
        return self.test

    @property
    def published_text(self) -> str:
        """What the printed equation gives."""
        return self._shown(self.by_printed)

    @property
    def ours_text(self) -> str:
        """What the corrected equation gives, and the truth."""
        return f"{self._shown(self.by_corrected)}; true: {self._shown(self.truth)}"

    def _shown(self, value: float | None) -> str:
        return "—" if value is None else _with_unit(digits(value, 5), self.unit)

    def _is_true(self, value: float) -> bool:
        return math.isclose(value, self.truth, rel_tol=self.tolerance, abs_tol=0.0)

    @property
    def verdict(self) -> Verdict:
        """DIFFERS where the corrected equation is right and the printed one is wrong."""
        wrong = self.by_printed is None or not self._is_true(self.by_printed)
        return Verdict.DIFFERS if self._is_true(self.by_corrected) and wrong else Verdict.UNEXPECTED

    @property
    def why(self) -> str:
        """What is wrong, and what is right."""
        return f"{self.printed}; {self.corrected}" + (f" ({self.reading})" if self.reading else "")


@dataclass(frozen=True)
class Statement:
    """A sentence of a source that can be tried.

    Attributes:
        name: what is tried.
        place: of the sentence.
        said: the sentence, in our words; empty for a fact that the source does not have.
        found: what we found, with its numbers.
        holds: whether that is what the sentence says.
        reason: why it differs, where it does and the reason was found to hold; empty: it must hold.
        how: what trying it is worth, of a sentence that the source has.
    """

    name: str
    place: str
    said: str
    found: str
    holds: bool
    reason: str = ""
    how: Comparison = Comparison.INDEPENDENT

    @property
    def comparison(self) -> Comparison | None:
        """What trying it is worth; None for a fact that the source does not have."""
        return self.how if self.said else None

    @property
    def published_text(self) -> str:
        """The sentence, a dash for none."""
        return self.said or "—"

    @property
    def ours_text(self) -> str:
        """What we found."""
        return self.found

    @property
    def verdict(self) -> Verdict:
        """What trying it says."""
        if self.holds:
            return Verdict.AGREES if self.said else Verdict.ADDED
        return Verdict.DIFFERS if self.reason else Verdict.UNEXPECTED

    @property
    def why(self) -> str:
        """Why it differs; empty where it holds."""
        return "" if self.holds else self.reason


def counts(findings: Iterable[Finding]) -> dict[Verdict, int]:
    """How many of each verdict, in their order."""
    found = [one.verdict for one in findings]
    return {verdict: found.count(verdict) for verdict in Verdict}


def agreeing(findings: Iterable[Finding]) -> dict[Comparison, int]:
    """How many agree, by what their comparison is worth."""
    found = [one.comparison for one in findings if one.verdict is Verdict.AGREES]
    return {comparison: found.count(comparison) for comparison in Comparison}


def as_document(finding: Finding) -> dict[str, Any]:
    """A finding for JSON: texts as people see them, and the numbers with full precision."""
    document: dict[str, Any] = {
        "name": finding.name,
        "place": finding.place,
        "published": finding.published_text,
        "ours": finding.ours_text,
        "verdict": finding.verdict.name.lower(),
        "comparison": finding.comparison.name.lower() if finding.comparison else None,
        "why": finding.why,
    }
    if isinstance(finding, Check):
        document["values"] = {
            "published": finding.published.value,
            "rounding": finding.published.rounding,
            "recomputed": finding.published.recomputed,
            "ours": _finite(finding.ours.value),
            "u": finding.ours.u,
            "unit": finding.ours.unit,
        }
    if isinstance(finding, Erratum):
        document["values"] = {
            "printed": _finite(finding.by_printed),
            "corrected": finding.by_corrected,
            "true": finding.truth,
            "unit": finding.unit,
        }
    return document


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
