"""The analyses: a row each.  A new one gets a folder with the same file names, and a row here."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic

from levilab.errors import DataError, DoesNotSuit, NoneUsable, unquoted
from levilab.pipelines.analyzed import A
from levilab.pipelines.budget import budgets_of_result
from levilab.pipelines.field.document import DOCUMENT as FIELD
from levilab.pipelines.field.quantities import FIELD_ROW
from levilab.pipelines.field.quantities import QUANTITIES as FIELD_QUANTITIES
from levilab.pipelines.field.report import field_part
from levilab.pipelines.field.table import field_columns, field_tables
from levilab.pipelines.limit.document import DOCUMENT as LIMIT
from levilab.pipelines.limit.quantities import LIMIT_ROW
from levilab.pipelines.limit.quantities import QUANTITIES as LIMIT_QUANTITIES
from levilab.pipelines.limit.report import limit_part
from levilab.pipelines.limit.table import limit_columns, limit_tables
from levilab.pipelines.precession.document import DOCUMENT as PRECESSION
from levilab.pipelines.precession.quantities import PRECESSION_ROW
from levilab.pipelines.precession.quantities import QUANTITIES as PRECESSION_QUANTITIES
from levilab.pipelines.precession.report import precession_part
from levilab.pipelines.precession.table import precession_columns, precession_tables
from levilab.pipelines.result import Place, is_of_another, read_inputs, results_in
from levilab.pipelines.result import save as save_files
from levilab.pipelines.row import symbols_of
from levilab.pipelines.sources import collect, data_files
from levilab.pipelines.spin.document import DOCUMENT as SPIN
from levilab.pipelines.spin.quantities import QUANTITIES as SPIN_QUANTITIES
from levilab.pipelines.spin.quantities import SPIN_ROW
from levilab.pipelines.spin.report import spin_part
from levilab.pipelines.spin.table import spin_columns, spin_tables
from levilab.pipelines.spindown.document import DOCUMENT as SPINDOWN
from levilab.pipelines.spindown.laws import SYMBOLS
from levilab.pipelines.spindown.quantities import SPINDOWN_ROW
from levilab.pipelines.spindown.report import spindown_part
from levilab.pipelines.spindown.table import spindown_columns, spindown_tables
from levilab.present.clock import moment
from levilab.present.numbers import short_name
from levilab.runs.run import RECORD, find_run, find_runs

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    import numpy as np
    from rich.console import Console

    from levilab.pipelines.document import Document, Looked
    from levilab.pipelines.options import InputOptions
    from levilab.pipelines.part import ReportPart
    from levilab.pipelines.result import Written
    from levilab.pipelines.row import Column
    from levilab.pipelines.sources import Needs, Source
    from levilab.present.document.blocks import Block
    from levilab.present.style import Figure
    from levilab.present.tables import Table
    from levilab.runs.run import Run

#: Starts of runs that the terminal shows; the report has all.
MOST_STARTS = 6
#: From this number on, warnings that are like an earlier one are only counted.
MANY_ALIKE = 3


@dataclass(frozen=True)
class Analysis(Generic[A]):
    """One analysis.

    Attributes:
        result: how it is carried out, and its result.json.
        tables: for the terminal.
        part: of a report.
        columns: the readings of each input as columns of a table, with residuals.
        row: the columns that an input has as one row of a table of many.
        symbols: of its quantities, for people.
    """

    result: Document[Any, Any, Any, A, Any]
    tables: Callable[[A], tuple[Table, ...]]
    part: Callable[[A], ReportPart]
    columns: Callable[[A], Iterable[Mapping[str, np.ndarray]]]
    row: tuple[Column, ...] = ()
    symbols: Mapping[str, str] = field(default_factory=dict)

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
        return self.result.recall(self.result.look(paths, options))

    def document(self, found: A, folder: Path) -> dict[str, Any]:
        """The content of result.json for a folder."""
        content: dict[str, Any] = self.result.of(found, Place(folder)).as_dict()
        return content

    def settings_of(self, found: A) -> dict[str, Any]:
        """How it was analyzed, as result.json has it."""
        settings: dict[str, Any] = self.result.settings(found.options).model_dump(mode="json", by_alias=True)
        return settings

    def budgets(self, found: A) -> tuple[Block, ...]:
        """What the uncertainties of its numbers are made of, as blocks of a document."""
        return budgets_of_result(found, self.symbols)

    def figure(self, found: A) -> Figure:
        """The figure."""
        # with matplotlib
        from levilab.pipelines.field.figure import field_figure
        from levilab.pipelines.limit.figure import limit_figure
        from levilab.pipelines.precession.figure import precession_figure
        from levilab.pipelines.spin.figure import spin_figure
        from levilab.pipelines.spindown.figure import spindown_figure

        figures: dict[str, Callable[[Any], Figure]] = {
            "spindown": spindown_figure,
            "spin": spin_figure,
            "field": field_figure,
            "limit": limit_figure,
            "precession": precession_figure,
        }
        return figures[self.name](found)

    def png(self, found: A) -> bytes:
        """The figure."""
        from levilab.present.style import as_png  # with matplotlib

        return as_png(self.figure(found))


_TABLE: tuple[Analysis[Any], ...] = (
    Analysis(SPINDOWN, spindown_tables, spindown_part, spindown_columns, SPINDOWN_ROW, SYMBOLS),
    Analysis(SPIN, spin_tables, spin_part, spin_columns, SPIN_ROW, symbols_of(SPIN_QUANTITIES)),
    Analysis(FIELD, field_tables, field_part, field_columns, FIELD_ROW, symbols_of(FIELD_QUANTITIES.values())),
    Analysis(LIMIT, limit_tables, limit_part, limit_columns, LIMIT_ROW, symbols_of(LIMIT_QUANTITIES)),
    Analysis(
        PRECESSION,
        precession_tables,
        precession_part,
        precession_columns,
        PRECESSION_ROW,
        symbols_of(PRECESSION_QUANTITIES),
    ),
)
ANALYSES = MappingProxyType({analysis.name: analysis for analysis in _TABLE})


def analyze_suiting(
    paths: Sequence[Path], given: Mapping[str, Any], tell: Callable[[str], None] | None = None
) -> list[tuple[Analysis[Any], Any]]:
    """Each analysis that suits what lies at the paths, with what it found.

    Of several paths each analysis takes those that suit it.  Raises DataError: no analysis suits a path, or damage.

    Args:
        paths: run folders, data files, folders to search.
        given: options by their names, of any analysis.
        tell: called with the reason why an analysis found nothing usable in a folder.
    """

    def analyze(analysis: Analysis[Any], inputs: Sequence[Path]) -> Any:
        return analysis.analyze(inputs, analysis.options_from(given))

    return list(_suiting(analyze, paths, given, tell))


def recall_suiting(
    paths: Sequence[Path], given: Mapping[str, Any], tell: Callable[[str], None] | None = None
) -> list[tuple[Analysis[Any], Any]]:
    """Each analysis that has a result of what lies at the paths, as it was found; in the order of the catalogue.

    An input that has no result is analyzed by those that are for its experiment, and a data file by all that suit.
    Raises DataError: no analysis suits a path, or damage.

    Args:
        paths: run folders, data files, folders to search, and results that lie elsewhere: their files, or a folder with
            nothing to analyze in it.
        given: options by their names, of any analysis.
        tell: called with the reason why an analysis found nothing usable in a folder.
    """
    places, written = _split(paths)

    def look(analysis: Analysis[Any], places: Sequence[Path]) -> Looked[Any, Any, Any]:
        own = [one for one in written if one.analysis == analysis.name]
        inputs = [*places, *(path for one in own for path in one.inputs)]
        if not inputs:
            raise DoesNotSuit(f"{written[0].file}: is no result of {analysis.name}")
        return analysis.result.look(inputs, analysis.options_from(given), [one.file for one in own])

    looked = list(_suiting(look, places, given, tell, of_none=[one.analysis for one in written]))
    have = {source.path for _, at in looked for source in at.found.sources if at.has_result(source)}

    def is_wanted(analysis: Analysis[Any], at: Looked[Any, Any, Any]) -> bool:
        return any(
            at.has_result(source) or (source.path not in have and _is_for(analysis, source))
            for source in at.found.sources
        )

    wanted = [(analysis, at) for analysis, at in looked if is_wanted(analysis, at)] or looked[:1]
    return [(analysis, analysis.result.recall(at)) for analysis, at in wanted]


def _split(paths: Sequence[Path]) -> tuple[list[Path], list[Written]]:
    """What is to be read or searched, and the results that were named by their own paths.  Raises DataError."""
    places: list[Path] = []
    written: list[Written] = []
    for path in paths:
        results = []
        if path.suffix == ".json" and path.is_file():
            results = [read_inputs(path)]
        elif path.is_dir() and not (path / RECORD).exists() and not find_runs(path) and not data_files(path):
            results = results_in(path)
        written += results
        places += [] if results else [path]
    return places, written


def _is_for(analysis: Analysis[Any], source: Source[Any]) -> bool:
    """Whether an input is a data file, or a run of an experiment that the analysis is for."""
    return source.run is None or _is_for_run(analysis, source.run)


def _is_for_run(analysis: Analysis[Any], run: Run) -> bool:
    return run.record.experiment in analysis.needs.experiments


def remarks(of_each: Sequence[Sequence[str]]) -> list[str]:
    """What several analyses say, each once; runs that one of them passed over count only if all did."""
    said = list(dict.fromkeys(text for texts in of_each for text in texts))
    kinds = [text for text in said if re.fullmatch(r"passed over: \d+ \w+ runs?", text)]
    taken = {text for text in kinds if not all(text in texts for texts in of_each)}
    return [text for text in said if text not in taken]


def _suiting(
    run: Callable[[Analysis[Any], Sequence[Path]], Any],
    paths: Sequence[Path],
    given: Mapping[str, Any],
    tell: Callable[[str], None] | None = None,
    *,
    of_none: Collection[str] = (),
) -> Iterator[tuple[Analysis[Any], Any]]:
    """What suits, one after the other, each carried out when it is asked for.

    Args:
        run: an analysis, and those of the paths that suit it → what it finds.
        paths: run folders, data files, folders to search.
        given: options by their names.
        tell: called with the reason why an analysis found nothing usable.
        of_none: the analyses that are carried out even where none of the paths suits them.
    """
    errors: list[DoesNotSuit] = []
    unusable: list[NoneUsable] = []
    left = dict.fromkeys(paths)  # no analysis took these
    said: set[str] = set()  # what is wrong with inputs, as the other analyses say
    for analysis in ANALYSES.values():
        try:
            found, taken = _of_those_that_suit(run, analysis, paths, given, of_none=analysis.name in of_none)
        except DoesNotSuit as error:
            errors.append(error)
            continue
        except NoneUsable as error:  # of one analysis; a run that was broken off at once keeps no other from its own
            unusable.append(error)
            continue
        left = {path: None for path in left if path not in taken}
        said.update(_warnings_of(found))
        yield analysis, found
    if len(errors) + len(unusable) == len(ANALYSES):
        raise [*unusable, *errors][0]
    refusals = (_refusal(analysis, path, given) for path in left for analysis in ANALYSES.values())
    if not unusable and (refusal := next(filter(None, refusals), None)):
        raise refusal  # that of the first analysis
    for left_out in unusable:
        if tell and not said.issuperset(left_out.reasons):
            tell(str(left_out))


def _warnings_of(found: Any) -> Sequence[str]:
    """What an analysis, or a look at its inputs, warns of."""
    warnings: Sequence[str] = getattr(getattr(found, "found", found), "warnings", ())
    return warnings


def _of_those_that_suit(
    run: Callable[[Analysis[Any], Sequence[Path]], Any],
    analysis: Analysis[Any],
    paths: Sequence[Path],
    given: Mapping[str, Any],
    *,
    of_none: bool,
) -> tuple[Any, Sequence[Path]]:
    """What an analysis finds in the paths that suit it, and these.  Raises DoesNotSuit: there are none."""
    try:
        return run(analysis, paths), paths
    except DoesNotSuit:
        if len(paths) == 1 and not of_none:
            raise
        suiting = [path for path in paths if not _refusal(analysis, path, given)]
        if len(suiting) == len(paths) or not (suiting or of_none):
            raise
    return run(analysis, suiting), suiting


def _refusal(analysis: Analysis[Any], path: Path, given: Mapping[str, Any]) -> DoesNotSuit | None:
    """Why a path does not suit an analysis; None where it does, or is damaged, which is for the analysis to say."""
    options = analysis.options_from(given)
    try:
        collect([find_run(path)], analysis.needs, lambda _: options)
    except DoesNotSuit as error:
        return error
    except DataError:
        return None
    return None


def save(analysis: Analysis[A], found: A, folder: Path | None = None, *, with_figure: bool = True) -> list[Path]:
    """Write the result and the figure beside the inputs, or into a folder; returns the files.  Raises CannotWrite.

    The name result.json belongs to the first row that is for the run's experiment, or where none is to the first one
    that takes the run; with data files and with several inputs, which may be of any kind, to the first row of all.
    Every other analysis has its name in its result's, and into a given folder also one that would replace another's.
    """
    run = found.sources[0].run if len(found.sources) == 1 else None
    rows = [row for row in ANALYSES.values() if run is None or row.needs.take(run)]
    if run is not None:
        rows = [row for row in rows if _is_for_run(row, run)] or rows
    place = replace(found.place, folder=folder or found.output_folder)
    first = rows[0].name == analysis.name and not (folder and is_of_another(place.result(), analysis.name))
    picture = analysis.png(found) if with_figure else None
    return save_files(analysis.result.of(found, place), place, picture, first=first)


def print_analysis(
    analysis: Analysis[A], found: A, in_words: Callable[[str], str] = unquoted, console: Console | None = None
) -> None:
    """The tables, what the data say, and the warnings.

    Args:
        analysis: the row of the catalogue.
        found: what it found.
        in_words: a message as the person reads it.
        console: where it is printed, by default the terminal.
    """
    from rich.markup import escape

    from levilab.present.terminal import draw, terminal  # with rich

    console = console or terminal()
    for table in analysis.tables(found):
        console.print(draw(table))
    starts = [f"{short_name(one.name)} {moment(one.start)}" for one in found.sources if one.start]
    if starts:
        more = f"; and {len(starts) - MOST_STARTS} more" if len(starts) > MOST_STARTS else ""
        console.print(f"[bold]Start, local time.[/bold] {escape('; '.join(starts[:MOST_STARTS]))}{more}")
    console.print(f"[bold]What the data say.[/bold] {escape(found.text)}")
    for first, *others in found.grouped_warnings:
        many = len(others) >= MANY_ALIKE
        more = f" (and {len(others)} more like this one)" if many else ""
        for warning in [first] if many else [first, *others]:
            console.print(f"[yellow]note:[/yellow] {escape(in_words(warning))}{more}")
