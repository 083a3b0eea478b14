"""Spin frequencies → tables, the meaning of the numbers, and their part of a report."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.part import VALUE_U, FigureText, ReportPart, input_parts, title_of
from levilab.pipelines.row import cells_of
from levilab.pipelines.spin.analysis import MOST_DRAWN, OF_A_RUN, SpinAnalysis, SpinRun, in_a_sentence, shown_time
from levilab.pipelines.spin.readings import Records
from levilab.present.clock import with_clock
from levilab.present.document.blocks import Block, Listing, Paragraph, Points, Tabular
from levilab.present.numbers import column, enumeration, plain, short_name, with_decimals, with_uncertainty
from levilab.present.tables import Table, table
from levilab.texts.text import Sentences, Text, how_many

#: A slope, or a scatter of records, is seen beyond this multiple of u.
_SEEN = 3.0
#: What air takes of the spin of a free top at 20 to 45 Hz, a second: 0.3 %, and twice or half of it for other tops.
_AIR = (1.5e-3, 6e-3)
#: An uncertainty within this factor of the bound can hardly be made better by another method.
_AT_BOUND = 1.5
#: Inputs that sentences are made of; of more there is a table.
_MOST = 4


def meaning(analysis: SpinAnalysis) -> tuple[str, ...]:
    """Return the sentences, of each input."""
    several = len(analysis.runs) > 1
    made = ((source.name, Sentences(*_sentences(run))) for source, run in analysis.each[:_MOST])
    return tuple(Text("{name:s}: {text}", name=name, text=text) if several else text for name, text in made if text)


@dataclass(frozen=True)
class _Change:
    """How the spin changes.

    Attributes:
        slope: [Hz/s]; u: its standard uncertainty [Hz/s].
        lasts_s: how long it was watched [s].
    """

    slope: float
    u: float
    lasts_s: float


def _change(run: SpinRun) -> _Change | None:
    """Return the slope through all records, or of the one; None where it is not known."""
    spin, trend = run.spin, run.trend
    if trend and trend.value is not None and trend.u is not None:
        return _Change(trend.value, trend.u, float(np.ptp(run.series.time)))
    if spin.chirp.value is None or not spin.chirp.u or not spin.frequency.value:
        return None
    turns = spin.pulses + spin.missing - spin.doubled
    return _Change(spin.chirp.value, spin.chirp.u, turns / spin.frequency.value)


def _sentences(run: SpinRun) -> Iterator[str]:
    spin = run.spin
    frequency = spin.frequency
    if not frequency.value:
        return
    turns = "The top turns with {spin:n}{at}, {rpm:.0f} times a minute."
    at = Text(" at {time:.3g} s", time=float(spin.reference_time)) if len(run.series) > 1 else ""
    yield Text(turns, spin=with_uncertainty(frequency), at=at, rpm=60 * frequency.value)
    if run.swing and run.swing[1] > _SEEN:
        far, units = run.swing
        yield Text(
            "That is one {of} of {n}: they scatter about the curve of a drag by {hz:n} Hz, {times:n} times their "
            "uncertainties, so the spin itself swings, as that of a driven top does.",
            of=run.series.of,
            n=len(run.series),
            hz=digits(far),
            times=digits(units),
        )
    yield from _about_line(run)
    if (change := _change(run)) is None:
        return
    yield from _about_change(change, frequency.value)
    if spin.bound and "frequency" in run.parts:
        ratio = run.parts["frequency"].pulses / spin.bound
        if ratio < _AT_BOUND:
            yield "With such noise no other method would find it much better."
        elif not run.line:
            yield Text(
                "The uncertainty is {times:n} times the least that any method could reach with such noise: "
                "the pulses themselves scatter, or the samples lie far apart.",
                times=digits(ratio),
            )


def _about_line(run: SpinRun) -> Iterator[str]:
    """Yield the sense of rotation, and the part of the moment that turns."""
    if run.line and run.line.sense:
        # beside the top a dipole's field turns against the dipole
        way = "clockwise" if run.line.sense > 0 else "counterclockwise"
        yield Text("Seen from above it turns {way}, if the phone lay beside it with its screen up.", way=way)
    if run.transverse and run.transverse.value:
        yield Text("The part of its moment that turns is {moment:n}.", moment=with_uncertainty(run.transverse))
        if run.tilt:
            yield Text("The moment leans by {tilt:n} from the axis.", tilt=with_uncertainty(run.tilt))


def _about_change(change: _Change, frequency: float) -> Iterator[str]:
    """Yield what the change of a spin [Hz] means."""
    share = change.slope / frequency
    lost = with_uncertainty(Estimate(100 * abs(share), 100 * change.u / frequency, "%"))
    if abs(change.slope) < _SEEN * change.u:
        most = (abs(change.slope) + 2 * change.u) / frequency
        yield Text(
            "In {time:n} s no change of its spin shows beyond the uncertainty: it loses or gains less "
            "than {percent:n} % a second.",
            time=digits(change.lasts_s),
            percent=digits(100 * most),
        )
        yield (
            "A free top loses some 0.3 % a second to the air: a longer record shows that, or one more a while later."
            if most > _AIR[0]
            else "That is less than air takes from a free top: does a drive hold it?"
        )
    elif share > 0:
        yield Text("It gains {lost:n} of its spin a second: something drives it.", lost=lost)
    elif _AIR[0] < -share < _AIR[1]:
        yield Text("It loses {lost:n} of its spin a second, as a free top does in air.", lost=lost)
    else:
        why = "more than air takes: does it touch something, or does a drive brake it?" if -share > _AIR[1] else (
            "less than air takes from a free top: does a drive hold it?"
        )  # fmt: skip
        yield Text("It loses {lost:n} of its spin a second, {why}", lost=lost, why=why)


#: Values of a series that are printed; result.json has all.
MOST_IN_TERMINAL = 12


def spin_tables(analysis: SpinAnalysis) -> tuple[Table, ...]:
    """Return frequency, slope and time of each input; the quality of its pulses; of one input its series."""
    tables = [frequency_table(analysis), *quality_tables(analysis).values()]
    if len(analysis.runs) == 1 and len(analysis.runs[0].series) > 1:
        tables.append(series_table(analysis.sources[0], analysis.runs[0], MOST_IN_TERMINAL))
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
            shown_time(run.spin),
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
    of_lines = [(source, run) for source, run in analysis.each if run.line]
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
    title = "The line, of several windows that of the one above" if several else "The line"
    heads = ("input", "kind of record", *(one.head for one in quantities), "noise [µT]", "S/N\n[dB]")
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
        for source, run in analysis.each
        if not run.line
    ]
    numbers = ("pulses", "missing", "doubled", "scatter\n[µs]", "S/N\n[dB]")
    title = "The pulses, of several records or windows those of the one above" if several else "The pulses"
    return table(title, ("input", "kind of record", *numbers), rows, numbers=numbers)


def series_table(source: Source[Records], run: SpinRun, most: int) -> Table:
    """Return frequency against time, thinned out evenly."""
    series = run.series
    step = max(-(-len(series) // most), 1)
    heads, clocks = with_clock(source.time_zero, series.time.tolist(), ("time [s]", "spin [Hz]", "u [mHz]"))
    rows = [
        (*clocks[k], with_decimals(series.time[k], 2), f"{series.frequency[k]:.4f}", plain(1e3 * float(series.u[k]), 2))
        for k in range(0, len(series), step)
    ]
    which = "each" if step == 1 else Text("one in {step}", step=step)
    title = Text("Frequency against time, {which} of {n} {of}", which=which, n=len(series), of=f"{series.of}s")
    return table(title, heads, rows, numbers=heads)


# --- readings as columns of tables for programs ---


def spin_columns(analysis: SpinAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the series of each input: a row for each window of a long record, or for each of several records."""
    for run in analysis.runs:
        yield {
            "time_s": run.series.time,
            "spin_frequency_hz": run.series.frequency,
            "spin_frequency_u_hz": run.series.u,
        }


#: Values of a series printed in the page; more stay in result.json.
MOST_VALUES = 40
#: A series with more values has none that answers to the pointer.
MOST_POINTS = 300


def spin_part(analysis: SpinAnalysis) -> ReportPart:
    """Return frequencies, pulses, and frequency against time."""
    return ReportPart(
        subject="spin frequency",
        heading="Spin frequency of a top",
        lead=_count_pulses(analysis),
        result=(
            Paragraph(Sentences(*meaning(analysis), between="\n"), "What it means."),
            Tabular("spin-frequencies", frequency_table(analysis), _FREQUENCIES, first_column_wraps=True),
        ),
        figure=FigureText(
            title="Spin frequency.",
            caption=(
                "Traces with the turns found in them, turns laid over each other, what the fit leaves over, and the "
                "frequency in time."
            ),
            points=_points(analysis),
        ),
        runs_title="The line" if all(run.line for run in analysis.runs) else "The pulses",
        runs=tuple(
            Tabular(name, replace(one, title=""), _QUALITY[name], first_column_wraps=True)
            for name, one in quality_tables(analysis).items()
        ),
        inputs=input_parts(analysis, _in_words, _series, in_a_sentence),
    )


def _count_pulses(analysis: SpinAnalysis) -> str:
    """Return the number of pulses of single records, and of records or windows, of which each has its pulses."""
    counts = {}
    for name, is_line in (("pulse", False), ("turn", True)):
        if number := sum(run.spin.pulses for run in analysis.runs if not run.which and bool(run.line) is is_line):
            counts[name] = number
    for run in analysis.runs:
        if run.which:
            counts[run.series.of] = counts.get(run.series.of, 0) + len(run.series)
    said = [how_many(count, name) for name, count in counts.items()]
    return Text("{counts} used", counts=enumeration(said))


_FREQUENCIES = Sentences(
    VALUE_U,
    "The spin is that at the time given, its slope the change of the spin in a second. bound: no method does better "
    "with this noise (Cramér–Rao). Of several records or windows this table, that of the pulses and the budgets are of "
    "the one in the middle; the text gives the slope in the middle of all.",
)
_QUALITY = {
    "spin-pulses": (
        "missing: turns without a pulse; doubled: pulses beyond one a turn; scatter: standard deviation of one pulse's "
        "time; S/N: height of a pulse over the noise of a sample."
    ),
    "spin-line": (
        "A: amplitude of the field that turns with the top, in each axis; noise: standard deviation of a sample there; "
        "S/N: amplitude over noise, in the axis where it is greatest."
    ),
}


def _in_words(source: Source[Records], run: SpinRun, *_: object) -> tuple[str, ...]:
    records, count = source.readings, len(source.readings)
    found = (
        Text("{n} turns", n=run.line.turns)
        if run.line
        else Text("{n} pulses, {missing} missing", n=run.spin.pulses, missing=run.spin.missing)
    )
    of = Text("{which}: {found}", which=run.which, found=found) if run.which else found
    what = "samples" if run.line else "pulse times" if records.pulses else Text("samples of {channel}", records.channel)
    return Text("{kind}; {n} {what}", kind=records.kind, n=count, what=what), of


def _series(source: Source[Records], run: SpinRun, *_: object) -> tuple[Block, ...]:
    """Return frequency against time, where there is more than one value."""
    if len(run.series) <= 1:
        return ()
    return (Listing("spin-series", series_table(source, run, MOST_VALUES)),)


def _points(analysis: SpinAnalysis) -> tuple[Points, ...]:
    """Return what each value of the frequency against time answers, of the inputs that are drawn."""
    return tuple(
        Points(f"readings-{k}", tuple(map(_point, run.series.time, run.series.frequency, run.series.u)))
        for k, run in enumerate(analysis.runs[:MOST_DRAWN])
        if 1 < len(run.series) <= MOST_POINTS
    )


def _point(time: float, frequency: float, u: float) -> str:
    spin = Estimate(float(frequency), float(u), "Hz")
    return f"t = {digits(float(time), 6)} s\nν = {with_uncertainty(spin)}"
