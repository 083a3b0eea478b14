"""Slow swings → tables, and their part of a report."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.part import VALUE_U, FigureText, ReportPart, input_parts, points_of, title_of
from levilab.pipelines.row import cells_of
from levilab.pipelines.sway.analysis import QUANTITIES, SwayAnalysis, SwayRun
from levilab.pipelines.sway.readings import SwayReadings
from levilab.present.document.blocks import Listing, Paragraph, Tabular
from levilab.present.numbers import short_name, with_decimals, with_uncertainty, without_unit
from levilab.present.tables import Table, table
from levilab.texts.text import Sentences, Text, how_many


def sway_tables(analysis: SwayAnalysis) -> tuple[Table, ...]:
    """Return the quantities, a column a track, and of each track the windows.  Each fits a terminal of 80 columns."""
    return quantities_table(analysis), *(windows_table(run, short_name(source.name)) for source, run in analysis.each)


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
            with_decimals(one.time, 0),
            with_decimals(float(spin), 1),
            *(without_unit(Estimate(float(f), float(u), "Hz")) for f, u in zip(one.frequency, one.u, strict=True)),
            *["—"] * (3 - one.frequency.size),
            without_unit(Estimate(*one.vertical, "Hz")),
            with_decimals(1e3 * float(split), 1),
            with_decimals(1e3 * float(expected), 1),
        )
        for one, spin, split, expected in zip(
            run.swings, run.spin, run.geometry.splits, run.geometry.expected, strict=True
        )
    ]
    heads = (
        "t\n[s]", "spin\n[Hz]", "backward\n[Hz]", "forward\n[Hz]", "precession\n[Hz]", "vertical\n[Hz]", "split\n[mHz]",
        "predicted\n[mHz]",
    )  # fmt: skip
    return table(Text("Windows of {name:s}", name=name), heads, rows, numbers=heads)


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
            "vertical_frequency_hz": np.array([one.vertical.value for one in swings]),
            "vertical_frequency_u_hz": np.array([one.vertical.u for one in swings]),
            "split_hz": found.splits,
            "split_predicted_hz": found.expected,
            "residual_hz": found.splits - found.expected,
        }


_VALUES = Sentences(
    VALUE_U,
    "Ω_g/2π is what the split would be of small swings of a slow top, brought to a spin of 30 Hz: the "
    "frequencies are corrected for the size of the swings and of the precession. Predicted: (I₃ω₃/m)(B′/2B)² with the "
    "form of the base's field at the height at which the swings are as fast as seen; neither the strength of the base "
    "nor the moment of the top is needed. All lines: swings and precession of all windows as roots of one "
    "quartic; the ratio is the part of the angular momentum that the slow swings carry along.",
)


def sway_part(analysis: SwayAnalysis) -> ReportPart:
    """Return what the swings say, and the windows."""
    return ReportPart(
        subject="slow swings",
        heading="Slow swings of a floating top: geometric magnetism",
        lead=how_many(sum(len(run.swings) for run in analysis.runs), "window"),
        result=(
            Paragraph(Sentences(*_meaning(analysis)), "What it means."),
            Tabular("sway-values", quantities_table(analysis), _VALUES, first_column_wraps=True),
        ),
        figure=FigureText(
            title="Slow swings.",
            caption=(
                "How far the slow swings are split, against the spin, with the prediction and with no split at all; "
                "and the spectrum of one window, whose negative frequencies turn against the spin."
            ),
            points=points_of(analysis, _points, "readings"),
        ),
        runs_title="Window by window",
        runs=tuple(
            Tabular(f"sway-windows-{k}", windows_table(run, source.name))
            for k, (source, run) in enumerate(analysis.each)
        ),
        inputs=input_parts(analysis, _in_words, _readings),
    )


def _in_words(source: Source[SwayReadings], run: SwayRun, *_: object) -> tuple[str, ...]:
    time = source.readings.time
    noise = 1e3 * max(one.noise for one in run.swings)
    size = 1e3 * math.sqrt(max(one.size for one in run.swings))
    rate = (len(time) - 1) / float(time[-1] - time[0])
    return (
        Text("{n} places from {begin:.1f} s to {end:.1f} s, {rate:.0f} a second", len(time), time[0], time[-1], rate),
        Text("swings: {size:.2g} mm at most, root of the sum of both amplitudes' squares", size=size),
        Text("residuals of a coordinate: standard deviation {noise:.2g} mm at most", noise=noise),
    )


def _readings(_: Source[SwayReadings], run: SwayRun, *__: object) -> tuple[Listing]:
    return (Listing("sway-readings", replace(windows_table(run, ""), title="Windows")),)


def _points(run: SwayRun) -> Iterator[tuple[str, ...]]:
    """Yield the lines of each window of the figure."""
    for spin, split, expected in zip(run.spin, run.geometry.splits, run.geometry.expected, strict=True):
        yield (
            Text("spin = {hz:.2f} Hz", hz=spin),
            Text("split = {mhz:.1f} mHz", mhz=1e3 * split),
            Text("predicted = {mhz:.1f} mHz", mhz=1e3 * expected),
        )


# --- what it means ---

_WHY = (
    "A top that floats sways to and fro in a second or two. If its moment kept its direction, it would sway equally "
    "fast clockwise and counterclockwise; the moment follows the field instead, takes the angular momentum along, "
    "and the top is pushed aside as a charge in a magnetic field."
)


def _meaning(analysis: SwayAnalysis) -> Iterator[str]:
    """Yield the meaning of the first track in sentences that a student understands."""
    run = analysis.runs[0]
    found, first, last = run.geometry, run.swings[0], run.swings[-1]
    shift = 100 * abs(float(found.shifts.sum(axis=1).mean()) / float(found.splits.mean()))
    yield _WHY
    yield Text(
        "It sways at {against:.3f} Hz against and {along:.3f} Hz with the spin while it spins at {spin:.1f} Hz, and at "
        "{later_against:.3f} Hz and {later_along:.3f} Hz at {later_spin:.1f} Hz.",
        against=abs(first.frequency[0]),
        along=first.frequency[1],
        spin=run.spin[0],
        later_against=abs(last.frequency[0]),
        later_along=last.frequency[1],
        later_spin=run.spin[-1],
    )
    large = "Its swings are so large that the split is shifted by {percent:n} %, which is taken away."
    yield Text(large, percent=digits(shift))
    if found.of_precession:
        yield Text(
            "The precession, another motion, gives B′/2B = {precession:n}, the field {field:n} and the slow swings "
            "{swings:n}.",
            precession=with_uncertainty(found.of_precession),
            field=with_uncertainty(found.of_base),
            swings=with_uncertainty(found.gradient),
        )
