"""Held spins → tables, and their part of a report."""

from collections.abc import Iterator, Mapping

import numpy as np

from analysis.held import Hold
from levilab.pipelines.hold.analysis import QUANTITIES, HoldAnalysis, text_of
from levilab.pipelines.hold.readings import HoldReadings
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.part import VALUE_U, FigureText, ReportPart, input_parts, points_of, title_of
from levilab.pipelines.row import cells_of
from levilab.pipelines.spindown.words import SYMBOLS
from levilab.present.document.blocks import Paragraph, Tabular
from levilab.present.numbers import plain, short_name, with_uncertainty, without_unit
from levilab.present.tables import Table, table
from levilab.texts.text import Sentences, Text, how_many


def hold_tables(analysis: HoldAnalysis) -> tuple[Table, ...]:
    """Return a row for each held spin, and one for each law.  Each fits a terminal of 80 columns."""
    return spins_table(analysis), *([laws_table(analysis)] if analysis.combined.laws else [])


def spins_table(analysis: HoldAnalysis) -> Table:
    """Return a row for each held spin."""
    cells = cells_of(QUANTITIES, analysis.runs)
    rows = zip([short_name(source.name) for source in analysis.sources], *cells, strict=True)
    heads = ("run", *(one.head for one in QUANTITIES))
    return table(title_of("Held spins", analysis.sources), heads, list(rows), numbers=heads[1:])


def laws_table(analysis: HoldAnalysis) -> Table:
    """Return a row for each drag law, with its constants beside those of the spin-down."""
    found = analysis.combined
    rows = []
    for law in found.laws:
        constants = Sentences(
            *(Text("{symbol} = {value}", SYMBOLS[name], without_unit(one)) for name, one in law.constants.items()),
            between=", ",
        )
        spindown, pull = found.beside.get(law.name, (None, None))
        beside = without_unit(spindown) if spindown else "—"
        rows.append((law.name, constants, plain(law.statistics.reduced_chi_square, 3), beside, plain(pull, 2)))
    heads = ("law", "constants", "χ²/dof", "spin-down's", "pull")[: 5 if found.beside else 3]
    cells = [row[: len(heads)] for row in rows]
    return table("Drag laws through the held spins, constants in SI", heads, cells, numbers=heads[2::2])


def hold_columns(analysis: HoldAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the readings of each held spin; residual_hz is from their mean."""
    for source in analysis.sources:
        one = source.readings
        yield {
            "time_s": one.time,
            "spin_frequency_hz": one.spin,
            "spin_frequency_u_hz": one.u,
            "share": one.share,
            "residual_hz": one.spin - one.spin.mean(),
        }


_MEANING = (
    "A drive that the top triggers holds its spin; the share s of the full amplitude that this takes shows the drag: "
    "the full amplitude gains g, so d = s g/(1 − s), with what the spin changed meanwhile taken into account."
)


def hold_part(analysis: HoldAnalysis) -> ReportPart:
    """Return what the held spins say."""
    laws = (Tabular("hold-laws", laws_table(analysis)),) if analysis.combined.laws else ()
    values = Paragraph(_MEANING, "What it means."), Tabular("hold-spins", spins_table(analysis), VALUE_U)
    return ReportPart(
        subject="held spin",
        heading="Held spins: the drag by the amplitude that balances it",
        lead=how_many(len(analysis.runs), "held spin"),
        values=values,
        result=(*values, *laws),
        figure=FigureText(
            title="Drag at held spins.",
            caption=Sentences(
                "The drag that the amplitude balanced at each held spin, with its u, and the drag laws through it.",
                "Below, both over the best law." if analysis.combined.best else "",
            ),
            points=points_of(analysis, _points, "readings", *(["ratios"] if analysis.combined.best else [])),
        ),
        inputs=input_parts(analysis, _in_words, lambda *_: (), text_of),
    )  # fmt: skip


def _in_words(source: Source[HoldReadings], *_: object) -> tuple[str, ...]:
    one = source.readings
    return (
        Text("{readings} from {begin:.1f} s to {end:.1f} s", how_many(len(one), "reading"), one.time[0], one.time[-1]),
        Text("{measured} of the gain at the full amplitude", measured=how_many(len(one.gains), "measurement")),
    )


def _points(run: Hold) -> Iterator[tuple[str, ...]]:
    drag = (Text("drag = {drag:n}", drag=with_uncertainty(run.drag)),) if run.drag else ()
    yield Text("spin = {spin:n}", spin=with_uncertainty(run.spin)), *drag
