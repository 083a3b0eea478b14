"""What a table of readings must fulfil before an analysis may trust it."""

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError, NotPositive, TimesNotIncreasing
from analysis.numbers import digits
from analysis.pulses import Finding, Track, phases, track_of_times
from analysis.pulses.times import FASTEST_BY_HAND_HZ
from analysis.pulses.track import UNLIKE
from analysis.rotation import FieldTrack, track_of_field
from analysis.rotation.track import WINDOW_S as FIELD_WINDOW_S
from analysis.spindown.fall import FALLS_BETWEEN_HZ
from analysis.spindown.readings import NoSpinDown, check_readings
from analysis.spindown.tilt import Release
from levilab.errors import DataError, DoesNotSuit
from levilab.formats.columns import SHORTHANDS, NoTable, TableError
from levilab.formats.table import FEWEST, Table, read_table, refuse
from levilab.formats.titles import PER_MINUTE
from levilab.formats.understanding import (
    LEAST_FALL,
    SLOWEST_SPIN_HZ,
    is_possible_loss,
    is_possible_spin,
    length_of,
    possible_spins,
    possible_times,
)
from levilab.formats.waveforms.header import NoRate, NoWaveform
from levilab.formats.waveforms.record import read_record
from levilab.formats.waveforms.waveform import PulseTimes, Waveform
from levilab.pipelines.inputs.source import Readings
from levilab.pipelines.options import InputOptions
from levilab.pipelines.spin.magnetometer import FieldRecord, findings_of, read_field_record
from levilab.pipelines.spin.readings import choose_channel, track_of_record
from levilab.pipelines.spin.words import NEAR_UNUSED, finding_text, finding_weight
from levilab.runs.events import RunEvent
from levilab.runs.run import Run
from levilab.texts.note import Note, Weight, is_doubt, of_file
from levilab.texts.text import Sentences, Text, how_many, text_of

#: Columns of a table that are looked at.
QUANTITIES = ("time_s", "spin_frequency_hz", "spin_frequency_u_hz")
#: Length of a window of a record, in which its frequency is one reading [s].
WINDOW_S = 2.0
#: No top falls below this: the published limits are 21.86 Hz, less five times their scatter [Hz].
_LOWEST_FALL_HZ = 20.6
#: Nor floats faster, by linear theory [Hz]; and the most marks on a rim that are thought of.
_FASTEST_HZ, _MOST_MARKS = 80.6, 6
#: No counter is as uncertain [Hz].
_MOST_U_HZ = 10.0
#: Whole uncertainties of one counter differ by no more; five random digits from 1 on do in 97 of 100 tables [Hz].
_MOST_APART_HZ = 2.0
#: Steps that are larger than resolution and scatter by this factor do not vanish twice by chance.
_REPEATS = 4.0
#: A first time above this, three years, counts from 1970; as dates, such times count from the first reading [s].
_SINCE_1970_S = 1e8
_NAMED = "{name:s}: {text}"


@dataclass(frozen=True, eq=False)
class SpinReadings(Readings):
    """Spin readings, each array of shape (n,): increasing `time` [s], positive `frequency` and its `u` [Hz].

    release: how the top came to its first reading; None: not known.
    upright: whether the top is known to have no tilt: it stands on a virtual bench, and only spins there.
    doubtful: whether the unit is in doubt; means over several runs leave such a run out.
    """

    time: "NDArray[np.float64]"
    frequency: "NDArray[np.float64]"
    u: "NDArray[np.float64] | None"
    warnings: tuple[str, ...]
    release: Release | None = None
    upright: bool = False
    doubtful: bool = False

    compared: ClassVar[tuple[str, ...]] = ("time", "frequency")


def read_run_readings(run: "Run", options: "InputOptions") -> SpinReadings:
    """Return the readings of a run of the experiment `spin`, which drives the top up."""
    readings = replace(
        spin_readings(run.readings(), options), release=release_of(run.events()), upright=run.record.world == "spin"
    )
    return _part(readings, options, run.folder)


def release_of(events: "Iterable[Mapping[str, Any]]") -> Release | None:
    """Return the slowest spin at which a drive held the top, by the events of a run; None: no drive did."""
    spins, driven_s = [], 0.0
    for event in events:
        if event["kind"] in {RunEvent.DRIVE_ON, RunEvent.DRIVEN_BEFORE} and event.get("frequency_hz"):
            spins.append(event["frequency_hz"])
        driven_s += event.get("driven_s") or 0.0
    return Release(min(spins), driven_s) if spins else None


def read_spin_file(path: "Path", options: "InputOptions") -> SpinReadings:
    """Return the readings in a data file: a table of them, or a long record of a signal or of pulse times.

    Raises:
        DoesNotSuit: it holds neither.
        DataError: it cannot be used.
    """
    field = read_field_record(path, options)
    if field and field.duration < FEWEST * FIELD_WINDOW_S:  # beside it in a zip there may be a table of frequencies
        with suppress(DataError):
            return _read_pulses_or_table(path, options)
    readings = field_readings(path, field, options) if field else _read_pulses_or_table(path, options)
    if options.near is not None and not field:
        readings = replace(readings, warnings=(*readings.warnings, Note("near", NEAR_UNUSED, weight="advice")))
    return _part(readings, options, path)


def _part(readings: SpinReadings, options: "InputOptions", path: "Path") -> SpinReadings:
    """Return the readings between the times and the spins of the options, with notes on the rest.

    Raises DataError: too few.
    """
    spins = getattr(options, "between", None)
    if (ends := _ends(options)) != (-math.inf, math.inf):
        readings = _between(readings, readings.time, ends, path, unit="s", options="`start`, `stop`")
    if spins is not None:
        readings = _between(readings, readings.frequency, spins, path, unit="Hz", options="`between`")
    return readings


def _ends(options: "InputOptions | None") -> tuple[float, float]:
    """Return the first and the last time that `start` and `stop` ask for [s], infinite where they are not given."""
    start, stop = (getattr(options, name, None) for name in ("start_s", "stop_s"))
    return -math.inf if start is None else start, math.inf if stop is None else stop


def _inside(values: "NDArray[np.float64]", ends: tuple[float, float]) -> "NDArray[np.intp]":
    """Return the numbers of the values between two ends."""
    return np.flatnonzero((values >= ends[0]) & (values <= ends[1]))


def _between(
    readings: SpinReadings,
    values: "NDArray[np.float64]",
    ends: tuple[float, float],
    path: "Path",
    *,
    unit: str,
    options: str,
) -> SpinReadings:
    """Return the readings whose values lie between two ends, in a unit, which options gave, with a note on the rest."""
    (low, high), inside = ends, _inside(values, ends)
    said = "from {low:g} {unit:s} on" if high == math.inf else "up to {high:g} {unit:s}"
    said = said if math.inf in {-low, high} else "between {low:g} {unit:s} and {high:g} {unit:s}"
    where = Text(said, low=low, high=high, unit=unit)
    if inside.size < FEWEST:
        said = (
            "{path:s}: {n} of {readings} {where} are too few, at least {fewest} are needed: they go from "
            "{first:.4g} {unit:s} to {last:.4g} {unit:s}, choose {options:s} in it"
        )
        first, last = values[[0, -1]]
        all_of_them = how_many(len(readings), "reading")
        raise DataError(said, path, inside.size, all_of_them, where, FEWEST, first, last, unit=unit, options=options)
    if inside.size == len(readings):
        return readings
    part = slice(inside[0], inside[-1] + 1)
    u = None if readings.u is None else readings.u[part]
    kept = replace(readings, time=readings.time[part], frequency=readings.frequency[part], u=u)
    said = "only the {n} of {all} readings {where} are fitted, as asked; the others are not"
    text = Text(said, len(kept), len(readings), where)
    return replace(kept, warnings=(*readings.warnings, Note("between", text)))


def _read_pulses_or_table(path: "Path", options: "InputOptions") -> SpinReadings:
    asks: NoRate | None = None
    try:
        record = read_record(path, columns=options.columns, rate=options.rate, guess=options.guess)
    except NoRate as error:
        if not options.guess:
            raise DoesNotSuit(text_of(error)) from error
        asks = error
    except NoWaveform:
        pass
    except DataError as error:
        if not options.guess:  # a damaged record that was found in a folder
            raise DoesNotSuit(text_of(error)) from error
        raise
    else:
        return record_readings(record, options)
    try:
        return spin_readings(_read_spin_table(path, options), options)
    except NoTable as error:
        raise asks or error from None


def _read_spin_table(path: "Path", options: "InputOptions") -> Table:
    table = read_table(path, quantities=QUANTITIES, needed=QUANTITIES[:2], **options.of_tables)
    if options.channel is not None:
        said = "{name:s}: is a table of readings and has no channels: `columns` chooses its columns"
        table = replace(table, warnings=(of_file("no channels", Text(said, path.name)), *table.warnings))
    return table


def record_readings(record: "Waveform | PulseTimes", options: "InputOptions") -> SpinReadings:
    """Return the frequency in each window of a long record, while the top coasts.

    Raises:
        DoesNotSuit: it is too short for a spin-down, or the spin does not fall.
        DataError: there are no pulses in it.
    """
    path, channels = record.path, tuple[str, ...]()
    times = record.times if isinstance(record, PulseTimes) else None
    duration = record.duration if not isinstance(record, PulseTimes) else float(record.times[-1] - record.times[0])
    _must_last(path, duration, WINDOW_S)
    try:
        if isinstance(record, PulseTimes):
            track = track_of_times(record.times, window=WINDOW_S)
        else:
            _, channels = choose_channel(record, options.channel)
            track = track_of_record(record, options.channel, WINDOW_S, "auto")
    except AnalysisError as error:
        said = Text("{path:s}: {error}", path=path, error=text_of(error))
        raise (DataError if options.guess else DoesNotSuit)(Sentences(said, *channels, between="; ")) from error
    part, (start, stop) = slice(*_coasting(track, options)[0]), _ends(options)
    frequency = track.frequency[part][(track.time[part] >= start) & (track.time[part] <= stop)]
    notes = [_note(path, note, _weight_of(note, frequency)) for note in track.notes]
    what = Text(
        "a list of pulse times of {s:n} s" if times is not None else "a record of {s:n} s", s=digits(duration, 3)
    )
    readings = _of_track(path, track, WINDOW_S, what, options=options, notes=((*record.warnings, *channels), notes))
    too_fast = any(note.kind == "fast" and is_doubt(note) for note in notes)
    marks = [] if too_fast else _of_marks(path.name, readings.frequency)
    return replace(readings, warnings=(*marks, *readings.warnings), doubtful=too_fast or any(map(is_doubt, marks)))


def _weight_of(found: Finding, frequency: "NDArray[np.float64]") -> Weight:
    """Return the weight of a finding, by the frequencies [Hz] of the windows that are used."""
    if found.name == "unlike":
        return "doubt" if np.any(np.abs(np.diff(np.log(frequency))) > UNLIKE) else "warning"
    return (
        "warning" if found.name == "fast" and frequency.max(initial=0.0) < FASTEST_BY_HAND_HZ else finding_weight(found)
    )


def _note(path: "Path", found: Finding, weight: Weight) -> Note:
    return of_file(found.name, Text(_NAMED, name=path.name, text=finding_text(found)), weight)


def field_readings(path: "Path", record: "FieldRecord", options: "InputOptions") -> SpinReadings:
    """Return the frequency in each window of a magnetometer's record, while the top coasts.  Raises as above."""
    _must_last(path, record.duration, FIELD_WINDOW_S)
    try:
        track = track_of_field(record.times, record.field, near=options.near)
    except AnalysisError as error:
        raise (DataError if options.guess else DoesNotSuit)("{path:s}: {error}", path, error) from error
    found = findings_of(track.spins)
    notes = [_note(path, note, finding_weight(note)) for note in found]
    what = Text("a magnetometer's record of {s:n} s", s=digits(record.duration, 3))
    window = record.duration / round(record.duration / FIELD_WINDOW_S)
    readings = _of_track(path, track, window, what, options=options, notes=(record.warnings, notes))
    return replace(readings, doubtful=any(spin.doubtful for spin in track.spins))


def _must_last(path: "Path", duration: float, window: float) -> None:
    if duration < FEWEST * window:
        short = "{path:s}: lasts {s:n} s, a spin-down needs {fewest} windows of {window:g} s at least"
        raise DoesNotSuit(short, path, digits(duration, 3), FEWEST, window)


def _of_track(
    path: "Path",
    track: "Track | FieldTrack",
    window: float,
    what: str,
    *,
    options: "InputOptions",
    notes: "tuple[Iterable[str], Iterable[str]]",
) -> SpinReadings:
    """Return the windows in which the top coasts.  notes: of the record, and of what was found in it."""
    (first, last), *others = _coasting(track, options)
    start, end = track.frequency[first], track.frequency[last - 1]
    if last - first < FEWEST or end > (1 - LEAST_FALL) * start:
        rises = (
            "{path:s}: the spin in it goes from {start:.6g} Hz to {end:.6g} Hz in {n} windows of {window:.3g} s, a "
            "falling spin is expected: is the drive still on?"
        )
        raise DoesNotSuit(rises, path=path, start=start, end=end, n=last - first, window=window)
    text = "{name:s}: {what}: each reading is the frequency in a window of {window:.3g} s"
    how_read = [of_file("windows", Text(text, name=path.name, what=what, window=window), "advice")]
    if last - first < len(track.time):
        text = "{name:s}: the top coasts from {start:.1f} s to {end:.1f} s; the windows before and after are left out"
        begin, stop = track.time[first], track.time[last - 1]
        how_read.append(of_file("coasts", Text(text, name=path.name, start=begin, end=stop), "advice"))
    if others:
        text = "{name:s}: it coasts from {start:.1f} s to {end:.1f} s, too: `start` and `stop` choose"
        begin, stop = track.time[others[0][0]], track.time[others[0][1] - 1]
        how_read.append(of_file("coasts again", Text(text, path.name, begin, stop), "advice"))
    part = slice(first, last)
    of_record, of_track = notes
    return SpinReadings(track.time[part], track.frequency[part], track.u[part], (*of_record, *how_read, *of_track))


def _coasting(track: "Track | FieldTrack", options: "InputOptions") -> list[tuple[int, int]]:
    """Return the windows [first, end) in which the top coasts: the phase with most asked for, and others; or all.

    The phase in which `start` lies counts twice.  Others have as many windows asked for as a fit needs.
    """
    start, stop = _ends(options)
    begin = int(np.searchsorted(track.time, start)) if start > -math.inf else -1
    end = int(np.searchsorted(track.time, stop, "right"))
    asked = {
        phase.windows: min(phase.windows[1], end) - max(phase.windows[0], begin)
        for phase in phases(track)
        if phase.kind == "coasting" and phase.windows[1] - phase.windows[0] >= FEWEST
    }
    order = sorted(asked, key=lambda one: (-max(asked[one], 0) * (1 + (one[0] <= begin)), one[0] - one[1]))
    others = [one for one in order[1:] if asked[one] >= FEWEST]
    return [*order[:1], *others] or [(0, len(track.time))]


def spin_readings(table: Table, options: "InputOptions | None" = None) -> SpinReadings:
    """Return the readings of a spin-down: time, spin frequency and, if the table has it, its standard uncertainty.

    Args:
        table: with `time_s` and `spin_frequency_hz`.
        options: `start_s` and `stop_s`, between which the spin must fall; all are returned.

    Raises:
        TableError: a column is missing, there are too few readings, times repeat or go back, the spin does not fall,
            or a frequency or an uncertainty is not positive; the line of the file is named.
    """
    table = _without_start(_without_rest(table))
    time, frequency = table.column("time_s"), table.column("spin_frequency_hz")
    u = table.columns.get("spin_frequency_u_hz")
    if time.size < FEWEST:
        what = "holds {n}, at least {fewest} are needed: record longer"
        raise TableError(table.path, Text(what, n=how_many(time.size, "reading"), fewest=FEWEST))
    _must_be_ordinary(table, time, frequency)
    notes = table.warnings
    if u is not None:
        notes = (*_of_decimals(table, frequency, u), *_of_steps(table, frequency, u), *notes)
        _must_be_possible(table, u, frequency)
    time = time - time[0] if time[0] > _SINCE_1970_S else time
    part = _part_of_times(time, options)
    doubts, repeats = list[Note](), list[Note]()
    if time[part].size:  # else the options are wrong
        try:  # as the fit does; here, too, since one run under the drive spoils no search of a folder
            check_readings(table.column("time_s")[part], frequency[part], None if u is None else u[part])
        except AnalysisError as error:
            raise _in_the_file(_rows(table, part), error) from error
        doubts = _doubts(table, time[part], frequency[part]) or _of_marks(table.path.name, frequency[part], table)
        doubts = doubts or _of_seconds(table, time[part])
        repeats = _of_repeats(table.path.name, time[part], frequency[part])
    doubtful = any(map(is_doubt, [*doubts, *notes]))  # of the unit
    return SpinReadings(time, frequency, u, (*doubts, *repeats, *notes), doubtful=doubtful)


def _part_of_times(time: "NDArray[np.float64]", options: "InputOptions | None") -> slice:
    """Return the rows from the first to the last one between `start_s` and `stop_s`; none where they are too few."""
    inside = _inside(time, _ends(options))
    return slice(inside[0], inside[-1] + 1) if inside.size >= FEWEST else slice(0)


def _rows(table: Table, part: slice) -> Table:
    columns = {name: values[part] for name, values in table.columns.items()}
    return replace(table, columns=columns, lines=table.lines[part])


def _without_rest(table: Table) -> Table:
    """Return a table without its last rows of 0 Hz, which a counter writes once the top lies, with a note on them."""
    end = int(np.flatnonzero(table.column("spin_frequency_hz")).max(initial=-1)) + 1
    left_out = len(table.lines) - end
    if not left_out or end < FEWEST:
        return table
    rows = how_many(left_out, "row")
    note = (
        f"{table.path.name}: the last {rows} of 0 Hz, after the top fell, {'is' if left_out == 1 else 'are'} left out"
    )
    return replace(_rows(table, slice(end)), warnings=(*table.warnings, of_file("rest", note, "advice")))


def _without_start(table: Table) -> Table:
    """Return a table without its first rows, in which the spin rises from row to row up to its highest, with a note."""
    time, frequency = table.column("time_s"), table.column("spin_frequency_hz")
    top = int(np.argmax(frequency)) if frequency.size else 0
    if top < 2 or frequency.size - top < FEWEST:
        return table
    if np.any(np.diff(frequency[: top + 1]) <= 0) or frequency[0] > (1 - LEAST_FALL) * frequency[top]:
        return table
    said = (
        "{name:s}: the top coasts from {start:.1f} s to {end:.1f} s; the rows before, in which it speeds up, are left "
        "out"
    )
    note = of_file("coasts", Text(said, name=table.path.name, start=time[top], end=time[-1]), "advice")
    return replace(_rows(table, slice(top, None)), warnings=(*table.warnings, note))


#: Readings that may be lower than a top floats: its fall, and what is counted of one that lies.
_FALLEN = 3


def _doubt(text: str, say: str = "") -> Note:
    """Return a doubt; say: the advice in it, whose options are those of the doubt."""
    return Note("unit", text, weight="doubt", names_input=True, options=say.options if isinstance(say, Note) else {})


def _doubts(table: Table, time: "NDArray[np.float64]", frequency: "NDArray[np.float64]") -> list[Note]:
    """Return doubts about units: a spin that no such top has, readings closer than a turn, turns counted twice."""
    middle, step = float(np.median(frequency)), float(np.median(np.diff(time)))
    if not is_possible_spin(middle):
        spins = possible_spins(middle / table.factors.get("spin_frequency_hz", 1.0)).items()
        say = _say_unit(table, "f", {unit: Text("{spin:n} Hz", digits(spin, 3)) for unit, spin in spins})
        if not say and is_possible_spin(1e3 * middle):
            say = "; if its point stands behind the thousands, write the numbers without it"
        text = "{name:s}: the spin is about {spin:n} Hz, a Levitron spins at 20 to 60 Hz{say}"
        return [_doubt(Text(text, name=table.path.name, spin=digits(middle, 4), say=say), say)]
    low = float(np.sort(frequency)[min(_FALLEN, len(frequency) - 1)])
    if low < SLOWEST_SPIN_HZ:
        text = (
            "{name:s}: the spin goes down to {low:n} Hz, and no Levitron floats below 15 Hz: if every second turn was "
            "counted, say so with its column, as f=NAME [1/0.5s]; leave out rows after the fall"
        )
        return [_doubt(Text(text, name=table.path.name, low=digits(low, 4)))]
    if step * middle < 1:  # nor does a counter give a reading in less
        doubt = Text(
            "{name:s}: the readings lie {step:.3g} ms apart, the top needs {turn:.3g} ms for a turn; if the times are "
            "in seconds, say so with their column, as t=NAME [s]{points}",
            name=table.path.name, step=1e3 * step, turn=1e3 / middle,
            points="; if their point stands behind the thousands, write them without it"
            if 1e3 * step * middle >= 1 and table.factors.get("time_s") == 1e-3 else "",
        )  # fmt: skip
        return [_doubt(doubt)]
    lasts, (first, last) = float(time[-1] - time[0]), frequency[[0, -1]].tolist()
    loss, factor = math.log(first / last) / lasts, table.factors.get("time_s", 1.0)
    if loss > 0 and not is_possible_loss(loss):
        units = possible_times(loss * factor).items()
        say = _say_unit(table, "t", {unit: length_of(lasts / factor * of) for unit, of in units})
        text = "{name:s}: the spin goes from {first:.4g} to {last:.4g} Hz in {length}, in air it takes minutes{say}"
        return [_doubt(Text(text, table.path.name, first, last, length_of(lasts), say), say)]
    return []


def _of_marks(name: str, frequency: "NDArray[np.float64]", table: Table | None = None) -> list[Note]:
    """Return the doubt about turns counted twice; a warning where a hand may start a top so fast."""
    first, last = frequency[[0, -1]].tolist()
    numbers = range(2, _MOST_MARKS + 1)  # with which the spin falls to the lower limit, and begins above it
    marks = next((n for n in numbers if _LOWEST_FALL_HZ < last / n < FALLS_BETWEEN_HZ[0] < first / n), None)
    by_hand = first <= FASTEST_BY_HAND_HZ
    if first <= (0.0 if marks else _FASTEST_HZ):
        return []
    n = marks or math.ceil(first / FASTEST_BY_HAND_HZ)
    said = (
        "{name:s}: the spin goes from {first:.4g} to {last:.4g} Hz, and no fall at 21 to 25 Hz is seen; if there are "
        "{n} marks a turn, it goes from {begin:.3g} to {end:.3g} Hz{say}"
        if by_hand
        else "{name:s}: the spin goes from {first:.4g} to {last:.4g} Hz, no hand starts a top so fast: with {n} marks "
        "a turn it would go from {begin:.3g} to {end:.3g} Hz{say}"
    )
    say = _say_marks(table, n) if table else ""
    text = Text(said, name=name, first=first, last=last, n=n, begin=first / n, end=last / n, say=say)
    return [of_file("marks", text) if by_hand else _doubt(text, say)]


def _of_repeats(name: str, time: "NDArray[np.float64]", frequency: "NDArray[np.float64]") -> list[Note]:
    """Return the doubt about equal readings in a row while the spin falls, as of a logger that hung."""
    steps = np.diff(frequency)
    falls = -float(np.median(steps))
    bends = np.round(np.abs(np.diff(steps)), 9)  # the least is the resolution
    stands = np.flatnonzero((steps[1:] == 0) & (steps[:-1] == 0))
    if not stands.size or falls < _REPEATS * max(bends[bends > 0].min(initial=math.inf), np.median(bends)):
        return []
    first, last = time[[stands[0], stands[0] + 2]].tolist()
    said = (
        "{name:s}: three readings from {first:.6g} s to {last:.6g} s are equal, between others the spin falls by "
        "{hz:n} Hz: did the logger hang, or a drive hold the top? Leave them out"
    )
    return [of_file("repeats", Text(said, name, first, last, digits(falls, 2)), "doubt")]


def _say_marks(table: Table, marks: int) -> str:
    """Return the advice to take a part of the unit of the spin; nothing for periods."""
    factor, n = table.factors.get("spin_frequency_hz"), table.numbers.get("spin_frequency_hz")
    per, unit = (PER_MINUTE, "min") if factor == PER_MINUTE else (1, "s")
    if not factor or not n:
        return ""
    said = '; `columns` = "f={n} [1/{length:g}{unit:s}]" divides the numbers by {marks}'
    length = marks * per / factor
    return Note("marks", Text(said, n, length, unit, marks), options={"columns": f"f={n} [1/{length:g}{unit}]"})


def _say_unit(table: Table, key: Literal["t", "f"], units: Mapping[str, str]) -> str:
    """Return the advice to say the unit of a column, with what its numbers are in each."""
    n = table.numbers.get(SHORTHANDS[key], 0)
    meant = tuple(Text('"{key:s}={n} [{unit:s}]" ({value})', key, n, unit, value) for unit, value in units.items())
    if not meant or not n:
        return ""
    answer = {"columns": f"{key}={n} [{next(iter(units))}]"} if len(units) == 1 else {}
    return Note("say unit", Text("; say the unit: `columns` = {columns}", columns=meant), options=answer)


#: Beyond these a number is no measurement: 3000 years (a clock in ms since 1970 shows 1.8e12), and spins whose powers
#: would leave the range of floating point.
LONGEST_S, SLOWEST_HZ, HIGHEST_HZ = 1e11, 1e-9, 1e12


def _must_be_ordinary(table: Table, time: "NDArray[np.float64]", frequency: "NDArray[np.float64]") -> None:
    size = np.abs(frequency)
    for wrong, values, what, allowed in (
        (np.abs(time) > LONGEST_S, time, "a time", Text("up to {most:g} s", LONGEST_S)),
        (size > HIGHEST_HZ, frequency, "a frequency", Text("up to {most:g} Hz", HIGHEST_HZ)),
        ((size > 0) & (size < SLOWEST_HZ), frequency, "a frequency", Text("from {least:g} Hz", SLOWEST_HZ)),
    ):
        unit = Text(", and say it: t=NAME [ms]" if values is time else "")
        said = "{what} of {value:.9g} is no measurement, {allowed}: check the unit{unit}"
        refuse(table, wrong, said, what, values, allowed, unit)


def _in_the_file(table: Table, error: AnalysisError) -> TableError:
    """Return the error of the readings, with its line in the file and the way to mend it there."""
    if isinstance(error, TimesNotIncreasing):
        before, after = (int(line) for line in table.lines[error.index - 1 : error.index + 1])
        what = "is repeated" if error.before == error.after else "comes"
        text = "the time {now:.16g} s {what} after {then:.16g} s in line {line}, times must increase: {advice}"
        frequency = table.column("spin_frequency_hz")
        times = table.column("time_s")
        turned = np.all(np.diff(times) < 0) and np.all(np.diff(frequency) > 0)
        again = times[error.index :]
        rises = np.all(np.diff(again[:FEWEST]) > 0)
        restarts = np.sum(again <= error.before) >= FEWEST and again.max() > times[0] and rises
        advice = (
            "sort the rows by time, the latest comes first; or, if the columns are exchanged, name them the other way "
            "round with `columns`"
            if turned
            else "a second run seems to begin here: repeat the titles above it, or analyze each by itself"
            if restarts
            else "sort the readings by time, or correct one"
        )
        return TableError(table.path, text, error.after, what, error.before, before, advice, line=after)
    if isinstance(error, NotPositive):
        what, advice = _ABOVE_0[error.quantity]
        if error.quantity == "spin frequency" and error.value == 0:
            advice = "Hz, as after a fall or without a pulse: delete such rows"
        line = int(table.lines[error.index])
        return TableError(table.path, "{what} is {value:.9g} {advice}", what, error.value, advice, line=line)
    spun = _why_no_fall(table) if isinstance(error, NoSpinDown) else ""
    return TableError(table.path, Sentences(text_of(error), spun, between=". "))


def _why_no_fall(table: Table) -> Text:
    """Return where the spin rises, and the likely cause."""
    time, steps = table.column("time_s"), np.diff(table.column("spin_frequency_hz"))
    k = int(np.argmax(steps))
    if np.all(steps >= 0) and steps[k] > 0:
        return Text("It rises from row to row: were the rows sorted by the spin, or is the drive still on?")
    if steps[k] > steps.max(initial=0.0, where=np.arange(steps.size) != k) + abs(steps.min()):
        said = (
            "It rises by {hz:n} Hz from {first:.6g} s to {last:.6g} s, in lines {line} and {next}: was the top spun "
            "again? `start` and `stop` choose a part"
        )
        return Text(said, digits(float(steps[k]), 3), time[k], time[k + 1], *table.lines[k : k + 2].tolist())
    return Text("Is the drive still on?")


#: What the analysis calls a column, in the words of a file, and what to do.
_ABOVE_0 = {
    "spin frequency": ("the frequency", "Hz; above 0 is expected: a sign is the sense of the spin, give the magnitude"),
    "standard uncertainty": ("the uncertainty", "Hz, but must be above 0: correct it or remove the column"),
}


def _of_decimals(table: Table, frequency: "NDArray[np.float64]", u: "NDArray[np.float64]") -> list[Note]:
    """Refuse whole uncertainties of whole numbers that are larger than a digit; warn of digits that scatter so."""
    whole = np.all(np.concatenate([frequency, u]) % 1 == 0) and not table.factors.get("spin_frequency_hz", 1.0) % 1
    said = (
        "{hz:g} and {u:g} are taken for a spin and its uncertainty; if they are one number with a decimal comma, "
        "separate the columns by ; or tab, or write a point"
    )
    refuse(table, np.full(u.shape, bool(whole and u.max() >= _MOST_U_HZ)), said, frequency, u)
    text = Text(_NAMED, table.path.name, Text(said, frequency[0], u[0]))
    return [of_file("decimals", text)] if whole and np.ptp(u) > _MOST_APART_HZ else []


def _of_steps(table: Table, frequency: "NDArray[np.float64]", u: "NDArray[np.float64]") -> list[Note]:
    """Return the doubt about uncertainties that are the steps from reading to reading, as a column Δf has them."""
    steps = np.abs(np.diff(frequency))
    if np.ptp(steps) == 0 or not any(np.allclose(one, steps, rtol=1e-3) for one in (u[1:], u[:-1])):
        return []
    said = "{name:s}: the uncertainties are the steps from reading to reading: leave their column out"
    return [_doubt(Text(said, name=table.path.name))]


def _of_seconds(table: Table, time: "NDArray[np.float64]") -> list[Note]:
    """Return the doubt about decimals of minutes that may be seconds: read as these, the times are even, else not."""
    whole, decimals = np.divmod(np.round(time * (100 / 60), 6), 100)
    steps, of_seconds = np.diff(time), np.diff(60 * whole + decimals)
    even = np.ptp(of_seconds) <= 0.01 * of_seconds.mean() and np.ptp(steps) > 0.1 * steps.mean()
    if table.factors.get("time_s") != 60 or decimals.max() >= 60 or not even:
        return []
    said = (
        "{name:s}: no time has decimals above .59, and as seconds they would lie {step:n} s apart: write {time:.2f} as "
        "{minutes:.0f}:{seconds:02.0f}"
    )
    last = float(time[-1] / 60)
    return [_doubt(Text(said, table.path.name, digits(of_seconds[0], 3), last, whole[-1], decimals[-1]))]


def _must_be_possible(table: Table, u: "NDArray[np.float64]", frequency: "NDArray[np.float64]") -> None:
    """Refuse an uncertainty below the rounding of the number itself, or one that is not above 0."""
    above_0 = (u > 0) & (frequency > 0)
    said = "an uncertainty of {u:.3g} Hz for {hz:.9g} Hz cannot be meant: correct it or drop the column"
    refuse(table, above_0 & ((u < 1e-15 * frequency) | (u > 1e15 * frequency)), said, u, frequency)
