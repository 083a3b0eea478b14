"""The analyses: a row each.  A new one gets a folder with the same file names, and a row here."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic

from levilab.errors import DoesNotSuit, NoneUsable, unquoted
from levilab.pipelines.analyzed import A
from levilab.pipelines.field.document import DOCUMENT as FIELD
from levilab.pipelines.field.report import field_part
from levilab.pipelines.field.table import field_tables
from levilab.pipelines.limit.document import DOCUMENT as LIMIT
from levilab.pipelines.limit.report import limit_part
from levilab.pipelines.limit.table import limit_tables
from levilab.pipelines.precession.document import DOCUMENT as PRECESSION
from levilab.pipelines.precession.report import precession_part
from levilab.pipelines.precession.table import precession_tables
from levilab.pipelines.result import Place
from levilab.pipelines.result import save as save_files
from levilab.pipelines.spin.document import DOCUMENT as SPIN
from levilab.pipelines.spin.report import spin_part
from levilab.pipelines.spin.table import spin_tables
from levilab.pipelines.spindown.document import DOCUMENT as SPINDOWN
from levilab.pipelines.spindown.report import spindown_part
from levilab.pipelines.spindown.table import spindown_tables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from levilab.pipelines.document import Document
    from levilab.pipelines.part import ReportPart
    from levilab.pipelines.sources import InputOptions, Needs
    from levilab.present.tables import Table
    from levilab.runs.run import Run


@dataclass(frozen=True)
class Analysis(Generic[A]):
    """One analysis.

    result: how it is carried out, and its result.json; tables: for the terminal; part: of a report.  Its figure is in
    `levilab.pipelines.figures`.
    """

    result: Document[Any, Any, Any, A, Any]
    tables: Callable[[A], tuple[Table, ...]]
    part: Callable[[A], ReportPart]

    @property
    def needs(self) -> Needs[Any]:
        """Its name, the experiments whose runs suit it, and how it reads runs and data files."""
        return self.result.method.needs

    @property
    def name(self) -> str:
        """As in `levilab analyze NAME`."""
        return self.needs.analysis

    def options_from(self, given: Mapping[str, Any]) -> InputOptions:
        """Its options, out of those that were given, some of which belong to other analyses."""
        kind = self.result.method.options
        own = {field.name for field in fields(kind)}
        return kind(**{name: value for name, value in given.items() if name in own})  # type: ignore[no-any-return]

    def analyze(self, paths: Sequence[Path], options: InputOptions) -> A:
        """What lies at the paths.  Raises DataError."""
        return self.result.method.analyze(paths, options)

    def recall(self, paths: Sequence[Path], options: InputOptions) -> A:
        """The same, from result.json where it holds.  Raises DataError."""
        return self.result.recall(paths, options)

    def document(self, found: A, folder: Path) -> dict[str, Any]:
        """The content of result.json for a folder."""
        content: dict[str, Any] = self.result.of(found, Place(folder)).as_dict()
        return content

    def png(self, found: A) -> bytes:
        """The figure."""
        from levilab.pipelines.figures import FIGURES  # with matplotlib
        from levilab.present.style import as_png

        return as_png(FIGURES[self.name](found))

    def svg(self, found: A) -> str:
        """The figure."""
        from levilab.pipelines.figures import FIGURES  # with matplotlib
        from levilab.present.style import as_svg

        return as_svg(FIGURES[self.name](found))


_TABLE: tuple[Analysis[Any], ...] = (
    Analysis(SPINDOWN, spindown_tables, spindown_part),
    Analysis(SPIN, spin_tables, spin_part),
    Analysis(FIELD, field_tables, field_part),
    Analysis(LIMIT, limit_tables, limit_part),
    Analysis(PRECESSION, precession_tables, precession_part),
)
ANALYSES = MappingProxyType({analysis.name: analysis for analysis in _TABLE})


def analyze_suiting(
    paths: Sequence[Path], given: Mapping[str, Any], tell: Callable[[str], None] | None = None
) -> list[tuple[Analysis[Any], Any]]:
    """Each analysis that suits what lies at the paths, with what it found.  Raises DataError: none suits, or damage.

    Args:
        paths: run folders, data files, folders to search.
        given: options by their names, of any analysis.
        tell: called with the reason why an analysis found nothing usable in a folder.
    """
    return list(_suiting(lambda analysis: analysis.analyze(paths, analysis.options_from(given)), tell))


def recall_suiting(paths: Sequence[Path], given: Mapping[str, Any]) -> tuple[Analysis[Any], Any]:
    """The first analysis that suits, with what it found or had found before.  Raises DataError if none does.

    An analysis that is for the runs' experiment goes before one that suits only because a run keeps records, too.
    """
    suiting = _suiting(lambda analysis: analysis.recall(paths, analysis.options_from(given)))
    first = next(suiting)
    return next((one for one in itertools.chain([first], suiting) if _is_for(*one)), first)


def _is_for(analysis: Analysis[A], found: A) -> bool:
    """Whether an input is a data file, or a run of an experiment that the analysis is for."""
    return any(source.run is None or _is_for_run(analysis, source.run) for source in found.sources)


def _is_for_run(analysis: Analysis[Any], run: Run) -> bool:
    return run.record.experiment in analysis.needs.experiments


def _suiting(
    run: Callable[[Analysis[Any]], Any], tell: Callable[[str], None] | None = None
) -> Iterator[tuple[Analysis[Any], Any]]:
    """What suits, one after the other, each carried out when it is asked for."""
    errors: list[DoesNotSuit] = []
    unusable: list[NoneUsable] = []
    for analysis in ANALYSES.values():
        try:
            found = run(analysis)
        except DoesNotSuit as error:
            errors.append(error)
        except NoneUsable as error:  # of one analysis; a run that was broken off at once keeps no other from its own
            unusable.append(error)
        else:
            yield analysis, found
    if len(errors) + len(unusable) == len(ANALYSES):
        raise [*unusable, *errors][0]
    if tell:
        for left_out in unusable:
            tell(str(left_out))


def save(analysis: Analysis[A], found: A, folder: Path | None = None) -> list[Path]:
    """Write the result and the figure beside the inputs, or into a folder; returns the files.  Raises CannotWrite.

    The name result.json belongs to the first row that is for the run's experiment, or where none is to the first one
    that takes the run; with data files and with several inputs, which may be of any kind, to the first row of all.
    Every other analysis has its name in its result's.
    """
    run = found.sources[0].run if len(found.sources) == 1 else None
    rows = [row for row in ANALYSES.values() if run is None or row.needs.take(run)]
    if run is not None:
        rows = [row for row in rows if _is_for_run(row, run)] or rows
    place = replace(found.place, folder=folder or found.home)
    result = analysis.result.of(found, place)
    return save_files(result, place, analysis.png(found), first=rows[0].name == analysis.name)


def print_analysis(analysis: Analysis[A], found: A, in_words: Callable[[str], str] = unquoted) -> None:
    """The tables, what the data say, and the warnings, on the terminal.  in_words: a message as the person reads it."""
    from rich.markup import escape

    from levilab.present.terminal import draw, terminal  # with rich

    console = terminal()
    for table in analysis.tables(found):
        console.print(draw(table))
    console.print(f"[bold]What the data say.[/bold] {escape(found.text)}")
    for warning in found.all_warnings:
        console.print(f"[yellow]note:[/yellow] {escape(in_words(warning))}")
