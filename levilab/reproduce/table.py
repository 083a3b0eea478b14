"""The table of findings: what is published, what was found here, whether they agree."""

from collections.abc import Sequence

from levilab.present.tables import Row, Table, table
from levilab.reproduce.check import Comparison, Finding, Kind, Verdict, agreeing, counts
from levilab.reproduce.run import Reproduction

HEADS = ("", "compared with", "here", "agreement")
#: Heads of the overview for those that agree.
KINDS = {
    Comparison.INDEPENDENT: "agree with\nthe source",
    Comparison.RANGE: "agree,\na range",
    Comparison.FITTED: "agree,\nfitted",
    Comparison.CONSTRUCTED: "agree by\nconstruction",
    Comparison.RECOMPUTED: "agree with our\nsecond way",
}


def findings_table(title: str, findings: Sequence[Finding]) -> Table:
    """Return a row a finding; those that nothing explains are red."""
    return table(
        title, HEADS, [Row(_cells(one), "outlier" if one.verdict is Verdict.UNEXPECTED else "") for one in findings]
    )


def _cells(one: Finding) -> tuple[str, ...]:
    agreement = f"{one.verdict.value}: {one.why}" if one.why else one.verdict.value
    return f"{one.name}\n{one.place}", _comparison(one), one.ours_text, agreement


def _comparison(one: Finding) -> str:
    """Return the value to compare with, and below it the kind of comparison."""
    if one.comparison is None:
        return one.published_text
    what = "what the print gives" if one.kind is Kind.EQUATION else one.comparison.value
    return f"{one.published_text}\n{what}"


def overview(found: Reproduction) -> Table:
    """Return a table with a row a chapter: counts of each verdict."""
    heads = ("chapter", *KINDS.values(), "differ for\na reason", "found\nhere", "unexpected")
    rows = [
        Row((f"{chapter.title} ({chapter.name})", *numbers(of_chapter.findings)))
        for chapter, of_chapter in found.chapters
    ]
    total = Row(("together", *numbers(found.findings)), "together")
    return table("", heads, [*rows, total], numbers=heads[1:])


def numbers(findings: Sequence[Finding]) -> list[str]:
    """Return the counts of a row of the overview."""
    others = [count for verdict, count in counts(findings).items() if verdict is not Verdict.AGREES]
    return [str(n) for n in (*agreeing(findings).values(), *others)]


#: How values and statements agree, in the order of `agreeing`.
_HOW = (
    "with what a source prints or says", "within the range that starts alike leave open", "after a fit to them",
    "by construction", "with a second computation of our own",
)  # fmt: skip


def in_words(found: Reproduction) -> str:
    """Return the counts in a sentence."""
    agree, differ, added, unexpected = (found.counts[verdict] for verdict in Verdict)
    how = ", ".join(f"{n} {how}" for how, n in zip(_HOW, agreeing(found.findings).values(), strict=True) if n)
    said = f"{agree} values and statements agree: {how or 'none'}. {differ} differ for a reason that was computed, too"
    facts = "1 fact stands" if added == 1 else f"{added} facts stand"
    more = f", and {facts} beside them that the sources do not have" if added else ""
    return said + (f", {unexpected} are UNEXPECTED" if unexpected else ", none is unexpected") + more + "."
