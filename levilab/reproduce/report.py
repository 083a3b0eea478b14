"""The report of a reproduction: a document of blocks."""

from levilab.present.document.blocks import (
    Banner,
    Block,
    Code,
    Document,
    Fact,
    Facts,
    Paragraph,
    Section,
    Tabular,
    Verdict,
    Warnings,
)
from levilab.reproduce.chapters import CHAPTERS, Chapter
from levilab.reproduce.check import Found
from levilab.reproduce.run import Reproduction
from levilab.reproduce.table import HEADS, findings_table, in_words, overview
from levilab.software import software_versions

HOW_TO_READ = (
    "A published number has the precision of its print: it agrees if ours lies within half a unit of its last digit, "
    "or within a tolerance that its row gives with the reason. Where it differs, the reason is computed, too, and "
    "shown: what it makes of our number must give the published one. Below each number that ours is compared with "
    "stands what it is. Published: a source prints it, and nothing here was adjusted to it. Fitted: a mass was chosen "
    "for it. By construction: readings were made to return it. Our second way: where a figure has no numbers, they "
    "were computed by us with other code, apart from levilab; these test levilab, not the source."
)


def document_of(found: Reproduction) -> Document:
    """Return the report; the same findings always make the same."""
    unexpected = tuple(f"{chapter.title}: {finding.name}: {finding.why}" for chapter, finding in found.unexpected)
    counted = Tabular("overview", overview(found), first_column_wraps=True, narrow="turn")
    summary: list[Block] = [Verdict(in_words(found)), counted, Paragraph(HOW_TO_READ)]
    if unexpected:
        summary.insert(1, Warnings((unexpected,)))
    return Document(
        title="The Levitron thesis, reproduced",
        lead="Tables and figures of the master's thesis, and of two papers, made again with levilab: the published "
        "value beside ours",
        blocks=(
            Section("Summary", tuple(summary), anchor="summary"),
            *(_section(chapter, of_chapter) for chapter, of_chapter in found.chapters),
            _how(found),
        ),
        banner=Banner("SYNTHETIC.", "Motions are simulated, readings are drawn at random: nothing here was measured."),
        contents=True,
    )


def _section(chapter: Chapter, found: Found) -> Section:
    marks = (Banner("SYNTHETIC.", found.synthetic),) if found.synthetic else ()
    findings = Tabular(chapter.name, findings_table("", found.findings), wraps=HEADS, narrow="stack")
    return Section(chapter.title, (*marks, Paragraph(found.said), *found.blocks, findings), anchor=chapter.name)


def _how(found: Reproduction) -> Section:
    names = [chapter.name for chapter, _ in found.chapters]
    chosen = "" if len(names) == len(CHAPTERS) else f' --only "{",".join(names)}"'
    versions = ", ".join(f"{name} {version}" for name, version in software_versions().items())
    return Section(
        "How to reproduce this",
        (
            Paragraph("The same versions on the same kind of processor give the same numbers."),
            Code(f"levilab reproduce{chosen}"),
            Facts((Fact("Versions here", (versions,)),)),
        ),
        anchor="reproduce",
    )
