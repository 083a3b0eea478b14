"""The folder of tables beside a report: what is in it, writing it, taking away what an earlier report left there."""

from __future__ import annotations

import csv
import re
from typing import TYPE_CHECKING

from levilab.files import replace_atomically, writing
from levilab.present.document.blocks import Banner, Details, Section, Tabular
from levilab.report.tables.latex import as_latex, title_of
from levilab.report.tables.values import Values, as_csv

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from levilab.present.document.blocks import Block, Document

#: The list of the files, which is one of them.
CONTENTS = "contents.csv"
_HEADS = ("file", "what")
#: Tables of a report that hold no results: what happened, which settings changed, hashes.
_NO_RESULTS = frozenset({"events", "changes", "data"})
#: A name that this module gave: nothing else is ever taken away.
_OURS = re.compile(r"[a-z0-9][a-z0-9_-]*\.(csv|tex)")


def folder_of(report: Path) -> Path:
    """Return the folder of a report's tables.

    >>> from pathlib import Path
    >>> folder_of(Path("out/report.pdf")).as_posix()
    'out/report.tables'
    """
    return report.with_suffix(".tables")


def write_tables(document: Document, values: Iterable[Values], folder: Path) -> list[Path]:
    """Write all tables of a report into a folder; those of an earlier report are replaced.

    Args:
        document: the report, whose tables are written as LaTeX.
        values: what is written as CSV.
        folder: which is made; other files in it stay.

    Returns:
        The files, the list of them first.

    Raises:
        CannotWrite: the folder or a file cannot be written.
    """
    files = {**dict(_csv_files(values)), **dict(_latex_files(document))}
    listed = tuple((name, about) for name, (about, _) in sorted(files.items()))
    contents = as_csv(Values(CONTENTS, "", _HEADS, listed))
    with writing(f"{folder}: the tables could not be written", "choose another place with `out`"):
        folder.mkdir(parents=True, exist_ok=True)
        for name in _listed_before(folder / CONTENTS) - files.keys():
            (folder / name).unlink(missing_ok=True)
        for name, (_, text) in files.items():
            replace_atomically(folder / name, text)
        replace_atomically(folder / CONTENTS, contents)
    return [folder / CONTENTS, *(folder / name for name in sorted(files))]


def _listed_before(contents: Path) -> set[str]:
    """Return the files of an earlier report."""
    if not contents.is_file():
        return set()
    text = contents.read_text(encoding="utf-8", errors="replace")
    return {row[0] for row in csv.reader(text.splitlines()) if row and _OURS.fullmatch(row[0])} - {CONTENTS}


def _csv_files(values: Iterable[Values]) -> Iterator[tuple[str, tuple[str, str]]]:
    names = _Names()
    for one in values:
        yield f"{names.new(one.name)}.csv", (one.about, as_csv(one))


def _latex_files(document: Document) -> Iterator[tuple[str, tuple[str, str]]]:
    names = _Names()
    for block, around in _tables_in(document.blocks, document.banner.lead if document.banner else ""):
        mark = around if block.mark is None else block.mark
        name = names.new(block.name)
        latex = as_latex(name, block.table, note=block.note, mark=mark)
        yield f"{name}.tex", (block.table.title or title_of(block.name), latex)


def _tables_in(blocks: Sequence[Block], mark: str) -> Iterator[tuple[Tabular, str]]:
    """Yield every table of results with its mark: that of the section, or of the document."""
    mark = next((block.lead for block in blocks if isinstance(block, Banner)), mark)
    for block in blocks:
        if isinstance(block, Tabular) and block.name not in _NO_RESULTS:
            yield block, mark
        elif isinstance(block, Section | Details):
            yield from _tables_in(block.blocks, mark)


class _Names:
    """Names of files, each once."""

    def __init__(self) -> None:
        self._used: dict[str, int] = {}

    def new(self, name: str) -> str:
        """Return the name, and from the second use on a number."""
        plain = re.sub(r"[^a-z0-9_]+", "-", name.lower()).strip("-_") or "table"
        self._used[plain] = self._used.get(plain, 0) + 1
        return plain if self._used[plain] == 1 else f"{plain}-{self._used[plain]}"
