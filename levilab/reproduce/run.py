"""The chapters, one after the other: which are wanted, what each found, and all of it as one JSON document."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from levilab.errors import UsageError, list_known
from levilab.reproduce.chapters import CHAPTERS, Chapter
from levilab.reproduce.check import Finding, Found, Verdict, as_document, counts
from levilab.software import software_versions

SCHEMA = "levilab-reproduction/1"


@dataclass(frozen=True)
class Reproduction:
    """All chapters that were computed.

    Attributes:
        chapters: each with what it found, in their order.
    """

    chapters: tuple[tuple[Chapter, Found], ...]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of all chapters."""
        return tuple(finding for _, found in self.chapters for finding in found.findings)

    @property
    def counts(self) -> dict[Verdict, int]:
        """How many of each verdict."""
        return counts(self.findings)

    @property
    def unexpected(self) -> tuple[tuple[Chapter, Finding], ...]:
        """What neither agrees nor differs for a reason that was found to hold."""
        return tuple(
            (chapter, finding)
            for chapter, found in self.chapters
            for finding in found.findings
            if finding.verdict is Verdict.UNEXPECTED
        )

    @property
    def as_expected(self) -> bool:
        """Whether all agree, or differ for a reason that holds."""
        return not self.unexpected


def choose(only: str | None) -> list[Chapter]:
    """Return the chapters of a list with commas, in the order of the report; all for None.

    Raises:
        UsageError: there is no such chapter, or the list is empty.

    >>> [chapter.name for chapter in choose("errata, limits")]
    ['limits', 'errata']
    """
    if only is None:
        return list(CHAPTERS.values())
    names = [name.strip() for name in only.split(",") if name.strip()]
    for name in names or [only]:
        if name not in CHAPTERS:
            raise UsageError("only", list_known(name, CHAPTERS), value=name or "''")
    return [chapter for chapter in CHAPTERS.values() if chapter.name in names]


def reproduce(chapters: Iterable[Chapter], progress: Callable[[float, str], None] | None = None) -> Reproduction:
    """Make chapters.  progress: called with the share that is done, and with what is next."""
    wanted, done = list(chapters), []
    for k, chapter in enumerate(wanted):
        if progress is not None:
            progress(k / len(wanted), f"reproducing: {chapter.name}")
        done.append((chapter, chapter.make()))
    return Reproduction(tuple(done))


def document(found: Reproduction) -> dict[str, Any]:
    """Return all of it for JSON."""
    return {
        "schema": SCHEMA,
        "synthetic": True,
        "software": software_versions(),
        "counts": {verdict.name.lower(): count for verdict, count in found.counts.items()},
        "as_expected": found.as_expected,
        "chapters": [
            {
                "name": chapter.name,
                "title": chapter.title,
                "synthetic_how": of_chapter.synthetic,
                "findings": [as_document(finding) for finding in of_chapter.findings],
            }
            for chapter, of_chapter in found.chapters
        ],
    }
