"""The table of findings: what is published, what was found here, whether they agree."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.present.tables import Row, Table, table
from levilab.reproduce.check import Verdict, counts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from levilab.reproduce.check import Finding
    from levilab.reproduce.run import Reproduction

#: The words of a verdict before its reason.
WORDS = {
    Verdict.AGREES: "agrees",
    Verdict.DIFFERS: "differs, because",
    Verdict.ADDED: "found here",
    Verdict.UNEXPECTED: "UNEXPECTED",
}
HEADS = ("", "published", "here", "agreement")


def findings_table(title: str, findings: Sequence[Finding]) -> Table:
    """A row a finding; those that nothing explains are red."""
    return table(
        title, HEADS, [Row(_cells(one), "outlier" if one.verdict is Verdict.UNEXPECTED else "") for one in findings]
    )


def _cells(one: Finding) -> tuple[str, ...]:
    agreement = f"{WORDS[one.verdict]}: {one.why}" if one.why else WORDS[one.verdict]
    return f"{one.name}\n{one.place}", one.published_text, one.ours_text, agreement


def overview(found: Reproduction) -> Table:
    """A row a chapter: how many agree, differ for a reason, are found here alone, and are unexpected."""
    heads = ("chapter", "agree", "differ for a reason", "found here", "unexpected")
    rows = [
        Row((f"{chapter.title} ({chapter.name})", *(str(n) for n in counts(of_chapter.findings).values())))
        for chapter, of_chapter in found.chapters
    ]
    total = Row(("together", *(str(n) for n in found.counts.values())), "together")
    return table("", heads, [*rows, total], numbers=heads[1:])


def in_words(found: Reproduction) -> str:
    """The counts in a sentence."""
    agree, differ, added, unexpected = (found.counts[verdict] for verdict in Verdict)
    said = f"{agree} values and statements agree, {differ} differ for a reason that was computed, too"
    facts = "1 fact stands" if added == 1 else f"{added} facts stand"
    more = f", and {facts} beside them that the sources do not have" if added else ""
    return said + (f", {unexpected} are UNEXPECTED" if unexpected else ", none is unexpected") + more + "."
