"""A published value beside ours: what is compared with what, how, and the verdict.

A number is compared by `check`, an equation with a slip by `erratum`, a sentence that can be tried by `statement`.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.files import finite
from levilab.present.document.blocks import Block
from levilab.present.numbers import with_uncertainty
from levilab.present.units import unit as unit_row
from levilab.simulator.published.printed import Printed

#: What a float loses in a difference of two numbers with few digits.
_FLOAT = 1e-9


class Verdict(Enum):
    """Outcome of a comparison, as it stands before its reason."""

    AGREES = "agrees"
    DIFFERS = "differs, because"
    ADDED = "found here"
    UNEXPECTED = "UNEXPECTED"


class Comparison(Enum):
    """What a comparison is worth: what ours is compared with, and whether ours could have come out otherwise."""

    INDEPENDENT = "published"
    RANGE = "published; a range"
    FITTED = "published; fitted"
    CONSTRUCTED = "published; by construction"
    RECOMPUTED = "our second way"


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


#: None: ours is the published number within half a unit of its last digit, beside our own u.
Way = Within | Among | Because | None


class Kind(Enum):
    """What is compared: a number, an equation with a slip, a sentence that can be tried."""

    NUMBER = "number"
    EQUATION = "equation"
    SENTENCE = "sentence"


@dataclass(frozen=True)
class Finding:
    """A row of a chapter's table.

    Attributes:
        kind: of what is compared.
        name: what is compared.
        place: where it stands in the source.
        published_text: as published; a dash for nothing.
        ours_text: as found here.
        verdict: what the comparison says.
        comparison: what the comparison is worth; None for a fact that the source does not have.
        why: how it was compared, or why it differs.
        values: the numbers with full precision, for JSON; none of a sentence.
    """

    kind: Kind
    name: str
    place: str
    published_text: str
    ours_text: str
    verdict: Verdict
    comparison: Comparison | None
    why: str
    values: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Found:
    """What a chapter found.

    Attributes:
        findings: in their order.
        blocks: figures, and what is said about them.
        said: what the chapter says in a sentence or two, above its table.
        synthetic: which measurements are synthetic or simulated, and how; empty where none is.
    """

    findings: tuple[Finding, ...]
    blocks: tuple[Block, ...]
    said: str
    synthetic: str = ""


def check(
    name: str,
    published: Printed,
    value: float | None,
    way: Way = None,
    how: Comparison = Comparison.INDEPENDENT,
    *,
    u: float | None = None,
) -> Finding:
    """Compare a number.

    Args:
        name: what is compared.
        published: as printed.
        value: ours, in the unit of the published one.
        way: how they are compared.
        how: what the comparison is worth, of a number that the source prints; one that it does not print is ours.
        u: standard uncertainty of ours.
    """
    ours = Estimate(value, u, published.unit)
    off = math.nan if ours.value is None else abs(ours.value - published.value)
    verdict = _judge(published, ours, way, off)
    beyond = off > published.rounding * (1 + _FLOAT)
    if isinstance(way, Because):
        why = way.why if verdict is not Verdict.AGREES else ""
    elif isinstance(way, Among):
        why = f"{way.why}: any value from {_like(way.low, published)} to {_like(way.high, published)} would agree"
        how = Comparison.RANGE
    elif isinstance(way, Within) and beyond:
        why = f"within {digits(way.tolerance, 2)}: {way.why}"
    else:
        why = "within our u" if beyond else ""
    values = {
        "published": published.value,
        "rounding": published.rounding,
        "recomputed": published.recomputed,
        "ours": finite(ours.value),
        "u": ours.u,
        "unit": ours.unit,
    }
    in_print = ours.value is not None and not ours.u  # with one digit more than the print has
    return Finding(
        Kind.NUMBER,
        name,
        published.place,
        _with_unit(_with_power(published.text), published.unit),
        _with_unit(_like(ours.value or 0.0, published), ours.unit) if in_print else with_uncertainty(ours),
        verdict,
        Comparison.RECOMPUTED if published.recomputed else how,
        why,
        values,
    )


def _judge(published: Printed, ours: Estimate, way: Way, off: float) -> Verdict:
    """Return what a comparison of numbers says, `off` being their distance."""
    if off <= (published.rounding + (ours.u or 0.0)) * (1 + _FLOAT):
        return Verdict.AGREES
    if isinstance(way, Within) and off <= way.tolerance * (1 + _FLOAT):
        return Verdict.AGREES
    if isinstance(way, Among):
        room = (published.rounding + way.step) * (1 + _FLOAT)
        return Verdict.AGREES if way.low - room <= published.value <= way.high + room else Verdict.UNEXPECTED
    if not isinstance(way, Because):
        return Verdict.UNEXPECTED
    holds = way.explained
    if not isinstance(holds, bool):
        holds = abs(holds - published.value) <= (published.rounding + way.tolerance) * (1 + _FLOAT)
    return Verdict.DIFFERS if holds else Verdict.UNEXPECTED


def erratum(
    place: str,
    printed: str,
    corrected: str,
    test: str,
    *,
    truth: float,
    by_printed: float | None,
    by_corrected: float,
    tolerance: float = 1e-9,
    unit: str = "",
    reading: str = "",
) -> Finding:
    """Try an equation as printed and as corrected on a number that neither of them decides.

    The source prints the equation, and nothing here was fitted to it.  The verdict is DIFFERS where the corrected
    equation is right and the printed one is wrong.

    Args:
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

    def is_true(value: float | None) -> bool:
        return value is not None and math.isclose(value, truth, rel_tol=tolerance, abs_tol=0.0)

    def text(value: float | None) -> str:
        return "—" if value is None else _with_unit(digits(value, 5), unit)

    return Finding(
        Kind.EQUATION,
        test,
        place,
        text(by_printed),
        f"{text(by_corrected)}; true: {text(truth)}",
        Verdict.DIFFERS if is_true(by_corrected) and not is_true(by_printed) else Verdict.UNEXPECTED,
        Comparison.INDEPENDENT,
        f"{printed}; {corrected}" + (f" ({reading})" if reading else ""),
        {"printed": finite(by_printed), "corrected": by_corrected, "true": truth, "unit": unit},
    )


def statement(
    name: str,
    place: str,
    said: str,
    found: str,
    *,
    holds: bool,
    reason: str = "",
    how: Comparison = Comparison.INDEPENDENT,
) -> Finding:
    """Try a sentence of a source.

    Args:
        name: what is tried.
        place: of the sentence.
        said: the sentence, in our words; empty for a fact that the source does not have.
        found: what we found, with its numbers.
        holds: whether that is what the sentence says.
        reason: why it differs, where it does and the reason was found to hold; empty: it must hold.
        how: what trying it is worth, of a sentence that the source has.
    """
    if holds:
        verdict = Verdict.AGREES if said else Verdict.ADDED
    else:
        verdict = Verdict.DIFFERS if reason else Verdict.UNEXPECTED
    return Finding(
        Kind.SENTENCE, name, place, said or "—", found, verdict, how if said else None, "" if holds else reason
    )


def _with_unit(number: str, unit: str) -> str:
    """Return a number's text with its unit; a degree stands at the number.

    >>> _with_unit("1.5", "°"), _with_unit("0.0032", "1/s"), _with_unit("82", "")
    ('1.5°', '0.0032 s⁻¹', '82')
    """
    return f"{number}{unit}" if unit == "°" else f"{number} {unit_row(unit).text}".strip()


def _like(value: float, published: Printed) -> str:
    """Return a number with one decimal more than the print, at least two, so that its rounding is seen.

    >>> from levilab.simulator.published.printed import Printed
    >>> _like(22.0799, Printed("22.06", "Hz", "", "")), _like(1.76004e-5, Printed("1.760e-5", "1/rad", "", ""))
    ('22.080', '1.7600×10⁻⁵')
    """
    mantissa, _, power = published.text.lower().partition("e")
    decimals = max(len(mantissa.partition(".")[2]) + 1, 2)
    if not power:
        return f"{value:.{decimals}f}"
    return _with_power(f"{value / 10.0 ** int(power):.{decimals}f}e{int(power)}")


def _with_power(text: str) -> str:
    mantissa, _, power = text.lower().partition("e")
    return f"{mantissa}×10{power.translate(_HIGH)}" if power else text


_HIGH = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def counts(findings: Iterable[Finding]) -> dict[Verdict, int]:
    """Count the findings of each verdict, in their order."""
    found = [one.verdict for one in findings]
    return {verdict: found.count(verdict) for verdict in Verdict}


def agreeing(findings: Iterable[Finding]) -> dict[Comparison, int]:
    """Count those that agree, by the worth of their comparison."""
    found = [one.comparison for one in findings if one.verdict is Verdict.AGREES]
    return {comparison: found.count(comparison) for comparison in Comparison}


def as_document(finding: Finding) -> dict[str, Any]:
    """Return a finding for JSON: texts as people see them, and the numbers with full precision."""
    document: dict[str, Any] = {
        "name": finding.name,
        "place": finding.place,
        "published": finding.published_text,
        "ours": finding.ours_text,
        "verdict": finding.verdict.name.lower(),
        "comparison": finding.comparison.name.lower() if finding.comparison else None,
        "why": finding.why,
    }
    if finding.values:
        document["values"] = dict(finding.values)
    return document
