"""Limits → tables, for the terminal and the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from levilab.pipelines.part import title_of
from levilab.present.numbers import share, short_name, without_unit
from levilab.present.tables import Row, Table, table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from levilab.pipelines.limit.analysis import LimitAnalysis, Limits

HEADS = ("limits", "tops", "mean [Hz]", "scatter [Hz]", "trend [Hz/top]", "outliers")


def limit_tables(analysis: LimitAnalysis) -> tuple[Table, ...]:
    """Return the runs, and theory beside them where it says something.  Each fits a terminal of 80 columns."""
    theory = theory_table(analysis)
    return (runs_table(analysis), theory) if theory.rows else (runs_table(analysis),)


def runs_table(analysis: LimitAnalysis) -> Table:
    """Return the statistics, run by run and of each kind together."""
    rows = [
        Row((f"{short_name(source.name)} ({_group(analysis, k)})", *_cells(run)))
        for k, (source, run) in enumerate(zip(analysis.sources, analysis.runs, strict=True))
    ]
    rows += [
        Row((f"{group.statistics.runs} runs ({_group(analysis, group.runs[0])})", *_cells(group)), "together")
        for group in analysis.groups
        if len(group.runs) > 1
    ]
    return table(title_of("Limits of the spin", analysis.sources), HEADS, rows, numbers=["tops"])


def _cells(limits: Limits) -> tuple[str, ...]:
    found = limits.statistics
    outliers = ", ".join(str(i + 1) for i in found.outliers) or "none"
    return (
        str(found.n),
        without_unit(found.mean),
        without_unit(found.scatter) if found.scatter else "—",
        without_unit(found.trend) if found.trend else "—",
        outliers if found.trend else "—",
    )


def theory_table(analysis: LimitAnalysis) -> Table:
    """Return what theory says, and how far the mean is from it."""
    rows = [
        Row(
            (
                one.name if analysis.number(group) is None else f"{analysis.number(group)}: {one.name}",
                f"{one.expected:.2f}",
                without_unit(one.difference),
                share(one.p),
                "—" if one.agrees is None else "yes" if one.agrees else "no",
            )
        )
        for group in analysis.groups
        for one in group.comparisons
    ]
    devices = list(dict.fromkeys(group.device.name for group in analysis.groups))
    top = devices[0] if len(devices) == 1 else f"{len(devices)} kinds of top"
    heads = ("theory", "[Hz]", "mean − theory [Hz]", "p", "agrees")
    return table(f"Beside theory, for {top}", heads, rows)


def _group(analysis: LimitAnalysis, run: int) -> str:
    """Return the group that a run is of: its kind, and its number where there are several, as in result.json."""
    group = next(group for group in analysis.groups if run in group.runs)
    number = analysis.number(group)
    return group.which if number is None else f"{group.which} {number}"


# --- readings as columns of tables for programs ---


def limit_columns(analysis: LimitAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the tops of each run; residual_hz: limit less the mean of the run, which includes outliers."""
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        limit, n = source.readings.limit, len(source.readings)
        given, found = analysis.options.reading_u, run.statistics
        u = np.full(n, np.nan) if source.readings.u is None else source.readings.u
        yield {
            "top": np.arange(1, n + 1),
            "spin_frequency_hz": limit,
            "spin_frequency_u_hz": u if given is None else np.full(n, given),
            "residual_hz": limit - (np.nan if found.mean.value is None else found.mean.value),
            "outlier": np.isin(np.arange(n), found.outliers),
        }
