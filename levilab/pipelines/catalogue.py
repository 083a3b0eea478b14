"""The analyses: a row each.  A new one gets a folder with the same file names, and a row here."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic

from levilab.errors import unquote
from levilab.pipelines.analyzed import A
from levilab.pipelines.budget import budgets_of_result
from levilab.pipelines.field.document import DOCUMENT as FIELD
from levilab.pipelines.field.report import field_columns, field_curve, field_curve_u, field_part, field_tables
from levilab.pipelines.field.words import FIELD_ROW
from levilab.pipelines.field.words import QUANTITIES as FIELD_QUANTITIES
from levilab.pipelines.hold.analysis import HOLD_ROW
from levilab.pipelines.hold.analysis import QUANTITIES as HOLD_QUANTITIES
from levilab.pipelines.hold.document import DOCUMENT as HOLD
from levilab.pipelines.hold.report import hold_columns, hold_part, hold_tables
from levilab.pipelines.limit.analysis import LIMIT_ROW
from levilab.pipelines.limit.analysis import QUANTITIES as LIMIT_QUANTITIES
from levilab.pipelines.limit.document import DOCUMENT as LIMIT
from levilab.pipelines.limit.report import limit_columns, limit_part, limit_tables
from levilab.pipelines.precession.document import DOCUMENT as PRECESSION
from levilab.pipelines.precession.report import (
    precession_columns,
    precession_curve,
    precession_curve_u,
    precession_part,
    precession_tables,
)
from levilab.pipelines.precession.words import PRECESSION_ROW
from levilab.pipelines.precession.words import QUANTITIES as PRECESSION_QUANTITIES
from levilab.pipelines.result import Place
from levilab.pipelines.row import symbols_of
from levilab.pipelines.spin.analysis import QUANTITIES as SPIN_QUANTITIES
from levilab.pipelines.spin.analysis import SPIN_ROW
from levilab.pipelines.spin.document import DOCUMENT as SPIN
from levilab.pipelines.spin.report import spin_columns, spin_part, spin_tables
from levilab.pipelines.spindown.document import DOCUMENT as SPINDOWN
from levilab.pipelines.spindown.report import (
    spindown_columns,
    spindown_curve,
    spindown_curve_u,
    spindown_part,
    spindown_tables,
)
from levilab.pipelines.spindown.words import SPINDOWN_ROW, SYMBOLS
from levilab.pipelines.sway.analysis import QUANTITIES as SWAY_QUANTITIES
from levilab.pipelines.sway.analysis import SWAY_ROW
from levilab.pipelines.sway.document import DOCUMENT as SWAY
from levilab.pipelines.sway.report import sway_columns, sway_part, sway_tables
from levilab.pipelines.video.analysis import QUANTITIES as VIDEO_QUANTITIES
from levilab.pipelines.video.analysis import VIDEO_ROW
from levilab.pipelines.video.document import DOCUMENT as VIDEO
from levilab.pipelines.video.report import video_columns, video_files, video_part, video_tables
from levilab.present.clock import moment
from levilab.present.numbers import short_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    import numpy as np
    from rich.console import Console

    from levilab.pipelines.document import Document
    from levilab.pipelines.options import InputOptions
    from levilab.pipelines.part import ReportPart
    from levilab.pipelines.row import Column
    from levilab.pipelines.sources import Needs
    from levilab.present.document.blocks import Block
    from levilab.present.style import Figure
    from levilab.present.tables import Table

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
        compared: quantities that groups of a class compare; empty: the constants of the law, or where there is none
            the first quantities.
        files: tables for other analyses that are saved with the result, by their names.
        curve: the fitted curve of an input, by its number and the model's name, as a function of arrays in SI; None:
            there is none.
        curve_u: its standard uncertainty, likewise.
    """

    result: Document[Any, Any, Any, A, Any]
    tables: Callable[[A], tuple[Table, ...]]
    part: Callable[[A], ReportPart]
    columns: Callable[[A], Iterable[Mapping[str, np.ndarray]]]
    row: tuple[Column, ...] = ()
    symbols: Mapping[str, str] = field(default_factory=dict)
    files: Callable[[A], Mapping[str, str]] = lambda _: {}
    compared: tuple[str, ...] = ()
    curve: Callable[[A, int, str], Callable[[np.ndarray], np.ndarray]] | None = None
    curve_u: Callable[[A, int, str], Callable[[np.ndarray], np.ndarray]] | None = None

    @property
    def needs(self) -> Needs[Any]:
        """Its name, the experiments whose runs suit it, and how it reads runs and data files."""
        return self.result.method.needs

    @property
    def name(self) -> str:
        """As in `levilab analyze NAME`."""
        return self.needs.analysis

    def options_from(self, given: Mapping[str, Any]) -> InputOptions:
        """Choose its options out of those that were given, some of which belong to other analyses."""
        kind = self.result.method.options
        own = {field.name for field in fields(kind)}
        return kind(**{name: value for name, value in given.items() if name in own})  # type: ignore[no-any-return]

    def analyze(self, paths: Sequence[Path], options: InputOptions) -> A:
        """Analyze the inputs at the paths.  Raises DataError."""
        return self.result.method.analyze(paths, options)

    def recall(self, paths: Sequence[Path], options: InputOptions) -> A:
        """Read the same from result.json where that holds.  Raises DataError."""
        return self.result.recall(paths, options)

    def document(self, found: A, folder: Path) -> dict[str, Any]:
        """Return the content of result.json for a folder."""
        content: dict[str, Any] = self.result.of(found, Place(folder)).as_dict()
        return content

    def settings_of(self, found: A) -> dict[str, Any]:
        """Return the options of an analysis as result.json has them."""
        settings: dict[str, Any] = self.result.settings(found.options).model_dump(mode="json", by_alias=True)
        return settings

    def budgets(self, found: A) -> tuple[Block, ...]:
        """Return the budgets of its uncertainties, as blocks of a document."""
        return budgets_of_result(found, self.symbols)

    def figure(self, found: A) -> Figure:
        """Draw the figure."""
        # with matplotlib
        from levilab.pipelines.field.figure import field_figure
        from levilab.pipelines.hold.figure import hold_figure
        from levilab.pipelines.limit.figure import limit_figure
        from levilab.pipelines.precession.figure import precession_figure
        from levilab.pipelines.spin.figure import spin_figure
        from levilab.pipelines.spindown.figure import spindown_figure
        from levilab.pipelines.sway.figure import sway_figure
        from levilab.pipelines.video.figure import video_figure

        figures: dict[str, Callable[[Any], Figure]] = {
            "spindown": spindown_figure,
            "spin": spin_figure,
            "field": field_figure,
            "limit": limit_figure,
            "precession": precession_figure,
            "sway": sway_figure,
            "hold": hold_figure,
            "video": video_figure,
        }
        return figures[self.name](found)

    def png(self, found: A) -> bytes:
        """Draw the figure, as PNG."""
        from levilab.present.style import as_png  # with matplotlib

        return as_png(self.figure(found))


_TABLE: tuple[Analysis[Any], ...] = (
    Analysis(
        SPINDOWN,
        spindown_tables,
        spindown_part,
        spindown_columns,
        SPINDOWN_ROW,
        SYMBOLS,
        curve=spindown_curve,
        curve_u=spindown_curve_u,
    ),
    Analysis(
        SPIN, spin_tables, spin_part, spin_columns, SPIN_ROW, symbols_of(SPIN_QUANTITIES), compared=("frequency",)
    ),
    Analysis(
        FIELD,
        field_tables,
        field_part,
        field_columns,
        FIELD_ROW,
        symbols_of(FIELD_QUANTITIES.values()),
        curve=field_curve,
        curve_u=field_curve_u,
        compared=("strength", "origin", "thickness"),
    ),
    Analysis(
        LIMIT, limit_tables, limit_part, limit_columns, LIMIT_ROW, symbols_of(LIMIT_QUANTITIES), compared=("mean",)
    ),
    Analysis(
        PRECESSION,
        precession_tables,
        precession_part,
        precession_columns,
        PRECESSION_ROW,
        symbols_of(PRECESSION_QUANTITIES),
        curve=precession_curve,
        curve_u=precession_curve_u,
        compared=("slope", "intercept"),
    ),
    Analysis(SWAY, sway_tables, sway_part, sway_columns, SWAY_ROW, symbols_of(SWAY_QUANTITIES)),
    Analysis(HOLD, hold_tables, hold_part, hold_columns, HOLD_ROW, symbols_of(HOLD_QUANTITIES)),
    Analysis(VIDEO, video_tables, video_part, video_columns, VIDEO_ROW, symbols_of(VIDEO_QUANTITIES), video_files),
)
ANALYSES = MappingProxyType({analysis.name: analysis for analysis in _TABLE})


def print_analysis(
    analysis: Analysis[A],
    found: A,
    in_words: Callable[[str], str] = unquote,
    console: Console | None = None,
    *,
    tables: bool = True,
) -> None:
    """Print the tables, what the data say, and the warnings.

    Args:
        analysis: the row of the catalogue.
        found: what it found.
        in_words: a message as the person reads it.
        console: where it is printed, by default the terminal.
        tables: whether tables are printed.
    """
    from rich.markup import escape

    from levilab.present.terminal import draw, terminal  # with rich

    console = console or terminal()
    for doubt in found.doubts:
        console.print(f"[bold yellow]Before you use the numbers.[/bold yellow] {escape(in_words(doubt))}")
    for table in analysis.tables(found) if tables else ():
        console.print(draw(table))
    starts = [f"{short_name(one.name)} {moment(one.start)}" for one in found.sources if one.start]
    if starts:
        more = f"; and {len(starts) - MOST_STARTS} more" if len(starts) > MOST_STARTS else ""
        console.print(f"[bold]Start, local time.[/bold] {escape('; '.join(starts[:MOST_STARTS]))}{more}")
    console.print(f"[bold]What the data say.[/bold] {escape(found.text)}")
    for first, *others in (group for group in found.grouped_warnings if group[0] not in found.doubts):
        many = len(others) >= MANY_ALIKE
        more = f" (and {len(others)} more like this one)" if many else ""
        for warning in [first] if many else [first, *others]:
            console.print(f"[yellow]note:[/yellow] {escape(in_words(warning))}{more}")
