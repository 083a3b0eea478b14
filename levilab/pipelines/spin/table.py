"""Spin frequencies → tables, for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.pipelines.part import title_of
from levilab.pipelines.row import cells_of
from levilab.pipelines.spin.quantities import OF_A_RUN
from levilab.present.clock import with_clock
from levilab.present.numbers import column, plain, short_name, with_decimals
from levilab.present.tables import Table, table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import numpy as np

    from levilab.pipelines.sources import Source
    from levilab.pipelines.spin.analysis import SpinAnalysis, SpinRun
    from levilab.pipelines.spin.readings import Records

#: Values of a series that are printed; result.json has all.
MOST_VALUES = 12


def spin_tables(analysis: SpinAnalysis) -> tuple[Table, ...]:
    """Return frequency, slope and time of each input; the quality of its pulses; of one input its series."""
    tables = [frequency_table(analysis), *quality_tables(analysis).values()]
    if len(analysis.runs) == 1 and len(analysis.runs[0].series) > 1:
        tables.append(series_table(analysis.sources[0], analysis.runs[0], MOST_VALUES))
    return tuple(tables)


def frequency_table(analysis: SpinAnalysis) -> Table:
    """Return the result."""
    spins, slopes = (column(getattr(run.spin, name) for run in analysis.runs) for name in ("frequency", "chirp"))
    several = any(run.which for run in analysis.runs)
    rows = [
        (
            short_name(source.name),
            spin,
            slope,
            *([run.which or "all"] * several),
            with_decimals(run.spin.reference_time, 4),
            run.spin.method,
            plain(None if run.spin.bound is None else 1e3 * run.spin.bound, 2),
        )
        for source, run, spin, slope in zip(analysis.sources, analysis.runs, spins, slopes, strict=True)
    ]
    heads = ("input", "spin [Hz]", "slope [Hz/s]", *(["of"] * several), "at [s]", "method", "bound\n[mHz]")
    return table(title_of("Spin frequency", analysis.sources, "input"), heads, rows, numbers=["at [s]", heads[-1]])


def quality_tables(analysis: SpinAnalysis) -> dict[str, Table]:
    """Return the tables of the quality of the pulses, and of the lines of magnetometers, by their names."""
    made = {"spin-pulses": pulse_table} if any(not run.line for run in analysis.runs) else {}
    made |= {"spin-line": line_table} if any(run.line for run in analysis.runs) else {}
    return {name: make(analysis) for name, make in made.items()}


def line_table(analysis: SpinAnalysis) -> Table:
    """Return a table of the lines of magnetometers: amplitude and noise of each axis, and the moment that turns."""
    of_lines = [(source, run) for source, run in zip(analysis.sources, analysis.runs, strict=True) if run.line]
    several = any(run.which for _, run in of_lines)
    quantities = [one for one in OF_A_RUN if any(one.find(run) for _, run in of_lines)]
    cells = zip(*cells_of(quantities, [run for _, run in of_lines]), strict=True)
    rows = [
        (
            short_name(source.name),
            source.readings.kind,
            *row,
            " ".join(plain(1e6 * noise, 2) for noise in run.line.noise),
            plain(run.line.snr_db),
        )
        for (source, run), row in zip(of_lines, cells, strict=True)
        if run.line
    ]
    title = "The line" + (", of several windows that of the one above" if several else "")
    heads = ("input", "what it is", *(one.head for one in quantities), "noise [µT]", "S/N\n[dB]")
    return table(title, heads, rows, numbers=heads[2:])


def pulse_table(analysis: SpinAnalysis) -> Table:
    """Return a table of the quality of the pulses."""
    several = any(run.which for run in analysis.runs)
    rows = [
        (
            short_name(source.name),
            source.readings.kind,
            str(run.spin.pulses),
            str(run.spin.missing),
            str(run.spin.doubled),
            plain(1e6 * run.spin.scatter),
            plain(run.spin.snr_db),
        )
        for source, run in zip(analysis.sources, analysis.runs, strict=True)
        if not run.line
    ]
    numbers = ("pulses", "missing", "doubled", "scatter\n[µs]", "S/N\n[dB]")
    title = "The pulses" + (", of several records or windows those of the one above" if several else "")
    return table(title, ("input", "what it is", *numbers), rows, numbers=numbers)


def series_table(source: Source[Records], run: SpinRun, most: int) -> Table:
    """Return frequency against time, thinned out evenly."""
    series = run.series
    step = max(-(-len(series) // most), 1)
    heads, clocks = with_clock(source.time_zero, series.time.tolist(), ("time [s]", "spin [Hz]", "u [mHz]"))
    rows = [
        (*clocks[k], with_decimals(series.time[k], 2), f"{series.frequency[k]:.4f}", plain(1e3 * float(series.u[k]), 2))
        for k in range(0, len(series), step)
    ]
    which = "each" if step == 1 else f"every {step}th"
    return table(f"Frequency against time, {which} of {len(series)} {series.of}s", heads, rows, numbers=heads)


# --- readings as columns of tables for programs ---


def spin_columns(analysis: SpinAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the series of each input: a row for each window of a long record, or for each of several records."""
    for run in analysis.runs:
        yield {
            "time_s": run.series.time,
            "spin_frequency_hz": run.series.frequency,
            "spin_frequency_u_hz": run.series.u,
        }
