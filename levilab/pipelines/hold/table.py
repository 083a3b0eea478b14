"""Held spins → tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.pipelines.hold.quantities import QUANTITIES
from levilab.pipelines.part import title_of
from levilab.pipelines.row import cells_of
from levilab.pipelines.spindown.laws import SYMBOLS
from levilab.present.numbers import plain, short_name, without_unit
from levilab.present.tables import Table, table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import numpy as np

    from levilab.pipelines.hold.analysis import HoldAnalysis


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
        constants = ", ".join(f"{SYMBOLS[name]} = {without_unit(one)}" for name, one in law.constants.items())
        spindown, pull = found.beside.get(law.name, (None, None))
        beside = without_unit(spindown) if spindown else "—"
        rows.append((law.name, constants, plain(law.statistics.chi_square, 3), beside, plain(pull, 2)))
    shown = 5 if found.beside else 3
    heads = ("law", "constants", "χ²", "spin-down's", "pull")[:shown]
    cells = [row[:shown] for row in rows]
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
