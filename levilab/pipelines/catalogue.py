"""The analyses: a row each.  A new one gets a folder with the same file names, and a row here."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from levilab.errors import DoesNotSuit, NoneUsable, unquoted
from levilab.pipelines.field.analysis import NEEDS as FIELD_NEEDS
from levilab.pipelines.field.analysis import FieldAnalysis, analyze_scans
from levilab.pipelines.field.device import FieldOptions
from levilab.pipelines.field.document import as_document as field_document
from levilab.pipelines.field.document import recall_scans
from levilab.pipelines.field.document import save_result as save_field
from levilab.pipelines.field.report import field_part
from levilab.pipelines.field.table import field_tables
from levilab.pipelines.limit.analysis import NEEDS as LIMIT_NEEDS
from levilab.pipelines.limit.analysis import LimitAnalysis, LimitOptions, analyze_limits
from levilab.pipelines.limit.document import limit_document, recall_limits, save_limits
from levilab.pipelines.limit.report import limit_part
from levilab.pipelines.limit.table import limit_tables
from levilab.pipelines.precession.analysis import NEEDS as PRECESSION_NEEDS
from levilab.pipelines.precession.analysis import PrecessionAnalysis, PrecessionOptions, analyze_precessions
from levilab.pipelines.precession.document import as_document as precession_document
from levilab.pipelines.precession.document import recall_precessions
from levilab.pipelines.precession.document import save_result as save_precession
from levilab.pipelines.precession.report import precession_part
from levilab.pipelines.precession.table import precession_tables
from levilab.pipelines.spin.analysis import NEEDS as SPIN_NEEDS
from levilab.pipelines.spin.analysis import SpinAnalysis, SpinOptions, analyze_spins
from levilab.pipelines.spin.document import as_document as spin_document
from levilab.pipelines.spin.document import recall_spins
from levilab.pipelines.spin.document import save_result as save_spin
from levilab.pipelines.spin.report import spin_part
from levilab.pipelines.spin.table import spin_tables
from levilab.pipelines.spindown.analysis import NEEDS as SPINDOWN_NEEDS
from levilab.pipelines.spindown.analysis import SpinDownAnalysis, SpinDownOptions, analyze_spindowns
from levilab.pipelines.spindown.document import as_document, recall_spindowns, save_result
from levilab.pipelines.spindown.report import spindown_part
from levilab.pipelines.spindown.table import spindown_tables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from levilab.pipelines.part import ReportPart
    from levilab.pipelines.sources import InputOptions, Needs, Source
    from levilab.present.tables import Table
    from levilab.runs.run import Run


class Analyzed(Protocol):
    """What results of all analyses have in common."""

    @property
    def sources(self) -> tuple[Source[Any], ...]:
        """The inputs."""

    @property
    def home(self) -> Path:
        """The folder that the result belongs to."""

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""

    @property
    def all_warnings(self) -> list[str]:
        """What to know before using the numbers."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """What does not belong to the analysis, and is no cause for a warning."""


A = TypeVar("A", bound=Analyzed)
A_contra = TypeVar("A_contra", bound=Analyzed, contravariant=True)


class Save(Protocol[A_contra]):
    """How an analysis writes."""

    def __call__(self, found: A_contra, folder: Path | None, /, *, first: bool) -> list[Path]:
        """Write the result and the figure, beside the inputs or into a folder; first: whether result.json is its."""


@dataclass(frozen=True)
class Analysis(Generic[A]):
    """One analysis.

    needs: its name, the experiments whose runs suit it, and how it reads runs and data files; options: its own;
    analyze: what lies at the paths; recall: the same, from result.json where it holds; document: the content of
    result.json for a folder; save: see the function of that name; tables: for the terminal; svg: the figure; part: of a
    report.
    """

    needs: Needs[Any]
    options: type[InputOptions]
    analyze: Callable[[Sequence[Path], Any], A]
    recall: Callable[[Sequence[Path], Any], A]
    document: Callable[[A, Path], dict[str, Any]]
    save: Save[A]
    tables: Callable[[A], tuple[Table, ...]]
    svg: Callable[[A], str]
    part: Callable[[A], ReportPart]

    @property
    def name(self) -> str:
        """As in `levilab analyze NAME`."""
        return self.needs.analysis

    def options_from(self, given: Mapping[str, Any]) -> InputOptions:
        """Its options, out of those that were given, some of which belong to other analyses."""
        own = {field.name for field in fields(self.options)}
        return self.options(**{name: value for name, value in given.items() if name in own})


def _spindown_svg(analysis: SpinDownAnalysis) -> str:
    from levilab.pipelines.spindown.figure import spindown_figure  # with matplotlib
    from levilab.present.style import as_svg

    return as_svg(spindown_figure(analysis))


def _spin_svg(analysis: SpinAnalysis) -> str:
    from levilab.pipelines.spin.figure import spin_figure  # with matplotlib
    from levilab.present.style import as_svg

    return as_svg(spin_figure(analysis))


def _field_svg(analysis: FieldAnalysis) -> str:
    from levilab.pipelines.field.figure import field_figure  # with matplotlib
    from levilab.present.style import as_svg

    return as_svg(field_figure(analysis))


def _limit_svg(analysis: LimitAnalysis) -> str:
    from levilab.pipelines.limit.figure import limit_figure  # with matplotlib
    from levilab.present.style import as_svg

    return as_svg(limit_figure(analysis))


def _precession_svg(analysis: PrecessionAnalysis) -> str:
    from levilab.pipelines.precession.figure import precession_figure  # with matplotlib
    from levilab.present.style import as_svg

    return as_svg(precession_figure(analysis))


_TABLE: tuple[Analysis[Any], ...] = (
    Analysis[SpinDownAnalysis](
        SPINDOWN_NEEDS,
        SpinDownOptions,
        analyze_spindowns,
        recall_spindowns,
        as_document,
        save_result,
        spindown_tables,
        _spindown_svg,
        spindown_part,
    ),
    Analysis[SpinAnalysis](
        SPIN_NEEDS,
        SpinOptions,
        analyze_spins,
        recall_spins,
        spin_document,
        save_spin,
        spin_tables,
        _spin_svg,
        spin_part,
    ),
    Analysis[FieldAnalysis](
        FIELD_NEEDS,
        FieldOptions,
        analyze_scans,
        recall_scans,
        field_document,
        save_field,
        field_tables,
        _field_svg,
        field_part,
    ),
    Analysis[LimitAnalysis](
        LIMIT_NEEDS,
        LimitOptions,
        analyze_limits,
        recall_limits,
        limit_document,
        save_limits,
        limit_tables,
        _limit_svg,
        limit_part,
    ),
    Analysis[PrecessionAnalysis](
        PRECESSION_NEEDS,
        PrecessionOptions,
        analyze_precessions,
        recall_precessions,
        precession_document,
        save_precession,
        precession_tables,
        _precession_svg,
        precession_part,
    ),
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
    return analysis.save(found, folder, first=rows[0].name == analysis.name)


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
