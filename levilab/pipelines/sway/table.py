"""Slow swings → tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.uncertainty import Estimate
from levilab.pipelines.part import title_of
from levilab.pipelines.row import cells_of
from levilab.pipelines.sway.quantities import QUANTITIES
from levilab.present.numbers import plain, short_name, with_decimals, without_unit
from levilab.present.tables import Table, table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from levilab.pipelines.sway.analysis import SwayAnalysis, SwayRun


def sway_tables(analysis: SwayAnalysis) -> tuple[Table, ...]:
    """Return the quantities, a column a track, and of each track the windows.  Each fits a terminal of 80 columns."""
    each = zip(analysis.sources, analysis.runs, strict=True)
    return quantities_table(analysis), *(windows_table(run, short_name(source.name)) for source, run in each)


def quantities_table(analysis: SwayAnalysis) -> Table:
    """Return a row for each quantity."""
    cells = cells_of(QUANTITIES, [run.geometry for run in analysis.runs])
    rows = [(one.head, *row) for one, row in zip(QUANTITIES, cells, strict=True)]
    heads = ("", *(short_name(source.name) for source in analysis.sources))
    return table(title_of("Slow swings", analysis.sources, "track"), heads, rows, numbers=heads[1:])


def windows_table(run: SwayRun, name: str) -> Table:
    """Return the swings, window by window."""
    rows = [
        (
            with_decimals(one.time, 1),
            with_decimals(float(spin), 2),
            *(without_unit(Estimate(float(f), float(u), "Hz")) for f, u in zip(one.frequency, one.u, strict=True)),
            *["—"] * (3 - one.frequency.size),
            "/".join(plain(1e3 * a) for a in one.amplitude[:2].tolist()),
            with_decimals(1e3 * float(split), 1),
            with_decimals(1e3 * float(expected), 1),
        )
        for one, spin, split, expected in zip(
            run.swings, run.spin, run.geometry.splits, run.geometry.expected, strict=True
        )
    ]
    heads = (
        "t [s]", "spin\n[Hz]", "backward\n[Hz]", "forward\n[Hz]", "precession\n[Hz]", "size\n[mm]", "split\n[mHz]",
        "predicted\n[mHz]",
    )  # fmt: skip
    return table(f"Windows of {name}", heads, rows, numbers=heads)


# --- windows as columns of tables for programs ---


def sway_columns(analysis: SwayAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the windows of each track; split_hz and split_predicted_hz are those of small swings."""
    for run in analysis.runs:
        found, swings = run.geometry, run.swings
        frequency = np.array([[*one.frequency, np.nan][:3] for one in swings])
        u = np.array([[*one.u, np.nan][:3] for one in swings])
        yield {
            "time_s": np.array([one.time for one in swings]),
            "spin_frequency_hz": run.spin,
            "backward_frequency_hz": frequency[:, 0],
            "backward_frequency_u_hz": u[:, 0],
            "forward_frequency_hz": frequency[:, 1],
            "forward_frequency_u_hz": u[:, 1],
            "precession_frequency_hz": frequency[:, 2],
            "precession_frequency_u_hz": u[:, 2],
            "split_hz": found.splits,
            "split_predicted_hz": found.expected,
            "residual_hz": found.splits - found.expected,
        }
