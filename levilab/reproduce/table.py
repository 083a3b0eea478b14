"""The table of findings: what is published, what was found here, whether they agree."""

from __future__ import annotations

import textwrap
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
#: Characters after which the cells of a report's columns are broken: together they fit the width of a page.
WIDTHS = (34, 24, 34, 46)


def findings_table(title: str, findings: Sequence[Finding], *, broken: bool = False) -> Table:
    """A row a finding; those that nothing explains are red.  broken: long cells have lines of their own."""
    kinds = ["outlier" if one.verdict is Verdict.UNEXPECTED else "" for one in findings]
    cells = [_cells(one) for one in findings]
    if broken:
        cells = [tuple(map(_lines, row, WIDTHS)) for row in cells]
    return table(title, HEADS, [Row(row, kind) for row, kind in zip(cells, kinds, strict=True)])


def _cells(one: Finding) -> tuple[str, ...]:
    agreement = f"{WORDS[one.verdict]}: {one.why}" if one.why else WORDS[one.verdict]
    return f"{one.name}\n{one.place}", one.published_text, one.ours_text, agreement


def _lines(cell: str, width: int) -> str:
    r"""A cell's text in lines of at most so many characters.

    >>> _lines("a long one\n(short)", 6)
    'a long\none\n(short)'
    """
    return "\n".join(textwrap.fill(line, width, break_long_words=False) for line in cell.splitlines())


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
    more = f", and {added} facts stand beside them that the sources do not have" if added else ""
    return said + (f", {unexpected} are UNEXPECTED" if unexpected else ", none is unexpected") + more + "."
