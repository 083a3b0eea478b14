"""Spin frequencies at some paths, each by itself: nothing is averaged over different tops or times."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from analysis.arrays import Array
from analysis.budget import rest
from analysis.comparison import weighted_mean
from analysis.drag import fit_curve
from analysis.errors import AnalysisError
from analysis.pulses import (
    Finding,
    Phase,
    SpinFrequency,
    Track,
    collect_findings,
    phases,
    spin_of_times,
    spin_of_trace,
    track_of_times,
)
from analysis.pulses.errors import OnlyHum
from analysis.rotation import FieldSpin, spin_of_field, track_of_field, transverse_moment
from analysis.uncertainty import Estimate
from levilab.errors import DataError
from levilab.formats.waveforms.waveform import PulseTimes, Waveform
from levilab.pipelines.analyzed import Analyzed
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import SpinOptions
from levilab.pipelines.row import Column, Quantity, columns_of, entry
from levilab.pipelines.spin.magnetometer import FieldRecord, findings_of, spin_of_line, track_middle
from levilab.pipelines.spin.readings import Records, track_of_record
from levilab.pipelines.spin.words import NEAR_UNUSED, finding_text, finding_weight
from levilab.present.numbers import with_decimals, with_uncertainty
from levilab.texts.note import Note, kind_of
from levilab.texts.text import Sentences, Text


def _correlation(k: int) -> Callable[[SpinFrequency], Any]:
    """Return a function to the correlation of a pair; None without a bend, which needs no such."""
    return lambda spin: spin.correlations[k] if spin.bend else None


#: With a bend the frequency at another time has an uncertainty that needs these.
CORRELATIONS = ("correlation_frequency_chirp", "correlation_frequency_bend", "correlation_chirp_bend")
#: Of `analysis.pulses.result.SpinFrequency`.
QUANTITIES = (
    Quantity("frequency", "Hz", "spin at reference_time_s; of a long record or of several, in the middle one"),
    Quantity("chirp", "Hz/s", "its change with time", "slope"),
    Quantity("bend", "Hz/s^2", "the change of the chirp, where a third degree was fitted", optional=True),
    Quantity("phase", "1", "turns at the reference time", column=False),
    Quantity("reference_time", "s", "time of the frequency", has_u=False),
    Quantity("bound", "Hz", "Cramér–Rao bound of the frequency's uncertainty", has_u=False),
    Quantity("scatter", "s", "standard deviation of one pulse's time", has_u=False),
    Quantity("snr", "dB", "signal to noise", of="snr_db", has_u=False),
    *(
        Quantity(name, "1", "", of=_correlation(k), has_u=False, optional=True, column=False)
        for k, name in enumerate(CORRELATIONS)
    ),
)


def _axis(k: int) -> Callable[[SpinRun], Estimate | None]:
    """Return a function to the amplitude in an axis; None where the record lacks it."""

    def amplitude(run: SpinRun) -> Estimate | None:
        line = run.line
        return Estimate(line.amplitude[k], line.u_amplitude[k], "T") if line and k < len(line.amplitude) else None

    return amplitude


#: Of a run; all but the last of a magnetometer.
OF_A_RUN = (
    *(
        Quantity(f"amplitude_{k}", "T", f"of the turning field, axis {k}", of=_axis(k - 1), optional=True, fine=True)
        for k in (1, 2, 3)
    ),
    Quantity("transverse_moment", "A m^2", "the part of the moment that turns", "μ_t", of="transverse", optional=True),
    Quantity("moment_tilt", "rad", "angle between moment and axis", "tilt", of="tilt", optional=True),
    Quantity("drive_offset", "Hz", "spin less the frequency of the drive, while it is held", "ν − ν_d", optional=True),
)

SPIN_ROW = (
    *columns_of(QUANTITIES),
    entry("method", "text", "how the pulses were found"),
    entry("pulses", "count", "pulses that were found", "result.spin.pulses"),
    entry("missing", "count", "pulses that are missing", "result.spin.missing"),
    entry("doubled", "count", "pulses that were counted twice", "result.spin.doubled"),
    entry("records", "count", "windows or records with a frequency each", "result.series.time"),
    Column("notes", "text", "names of the findings",
           lambda part: " ".join(note["name"] for note in part["result"]["notes"])),
)  # fmt: skip


#: A longer record is cut into windows [s]: a top that coasts loses 3 % of its spin meanwhile, and a parabola of the
#: phase still holds.
LONGEST_WHOLE_S = 12.0
#: Length of a window of a longer record [s].
WINDOW_S = 2.0
#: A spin this multiple of u beside the drive's frequency is not locked to it.
NOT_LOCKED = 3.0
#: Standard uncertainty of the place of a phone's sensor [m]: where it sits in the phone is seldom known better.
DISTANCE_U_M = 0.005


@dataclass(frozen=True, eq=False)
class Series:
    """Frequency against time.

    Attributes:
        time: a value for each window or record, shape (m,) [s].
        frequency: likewise [Hz].
        u: its standard uncertainty [Hz].
        phases: (what the top did, from, to [s]).
        of: what each value is of, in words.
    """

    time: Array
    frequency: Array
    u: Array
    phases: tuple[tuple[str, float, float], ...] = ()
    of: str = "record"

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True)
class UParts:
    """What u of a frequency, or of its slope, is made of; the squares add up.

    Attributes:
        pulses: of the places of the pulses.
        drag: how the slope changes meanwhile.
        step: of the sampling interval, where it comes from rounded times.
    """

    pulses: float
    drag: float = 0.0
    step: float = 0.0


@dataclass(frozen=True, eq=False)
class SpinRun:
    """One input.

    Attributes:
        spin: its frequency; of a long record or of several, that of the window or record in the middle.
        series: all of them.
        notes: findings.
        parts: "frequency", "chirp" → what u of it is made of; empty where that is not known.
        code: one step of the oscilloscope's or sound card's numbers over the noise of a sample; None: not known.
        line: of a magnetometer, the same with what its axes tell.
        transverse: the part of the moment that turns, where the magnetometer's distance is given [A m²].
        tilt: of the moment, where that is given, too [rad].
        drive_offset: spin less the frequency of the drive, where that is given [Hz].
    """

    spin: SpinFrequency
    series: Series
    notes: tuple[Finding, ...]
    parts: Mapping[str, UParts] = field(default_factory=dict)
    code: float | None = None
    line: FieldSpin | None = None
    transverse: Estimate | None = None
    tilt: Estimate | None = None
    drive_offset: Estimate | None = None

    @property
    def which(self) -> str:
        """Of several records or windows the one that `spin` is of, as "record 3 of 5"; empty of a single one."""
        if len(self.series) < 2:
            return ""
        place = int(np.abs(self.series.time - self.spin.reference_time).argmin()) + 1
        return Text("{of} {place} of {n}", of=self.series.of, place=place, n=len(self.series))

    @property
    def trend(self) -> Estimate | None:
        """The slope through several records in their middle [Hz/s]; None of a single one, and where phases differ.

        Records far apart show a slope that is far too small for one of them.  A record in which a drive was switched
        has several slopes.  Where they scatter about the curve by more than their u, u grows by the same factor.
        """
        return self._line[0] if self._line else None

    @property
    def swing(self) -> tuple[float, float] | None:
        """How far several records scatter about that curve [Hz], and in units of their u; None where there is none."""
        return self._line[1:] if self._line and len(self.series) > 2 else None

    @cached_property
    def _line(self) -> tuple[Estimate, float, float] | None:
        series = self.series
        if len(series.phases) > 1 or not np.all(series.u > 0) or not np.ptp(series.time) > 0:
            return None
        curve, freedom = fit_curve(series.time, series.frequency, series.u), max(len(series) - 2, 1)
        units = math.sqrt(curve.chi_square / freedom)
        far = math.sqrt(float(np.sum(curve.residuals**2)) / freedom)
        return Estimate(curve.slope, curve.u * max(1.0, units), "Hz/s"), far, units


class SpinAnalysis(Analyzed[Records, SpinRun, None, SpinOptions]):
    """Spin frequencies, each by itself."""

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        texts = [in_a_sentence(run) for run in self.runs]
        if len(texts) == 1:
            return texts[0]
        of_each = zip(self.sources[:MOST_SENTENCES], texts, strict=False)
        named = (Text("{name:s}: {text}", name=source.name, text=text) for source, text in of_each)
        more = len(texts) - MOST_SENTENCES
        return Sentences(*named, Text("And {more} more, in the table.", more=more) if more > 0 else "", between="\n")

    @property
    def averaged(self) -> tuple[()]:
        """None: nothing is averaged over different tops or times."""
        return ()

    def about_all(self) -> Iterable[str]:
        """Yield what to know of the method."""
        method = self.options.method
        if method != "auto" and all(source.readings.pulses for source in self.sources):
            yield Text("the method {method} was chosen, but a list of pulse times leaves no choice", method=method)
        if self.options.near is not None and not any(source.readings.field for source in self.sources):
            yield Note("near", NEAR_UNUSED, weight="advice")
        if self.options.distance_m is not None and not any(run.transverse for run in self.runs):
            yield "a distance was given, but no record of a magnetometer has three axes: no tilt follows"

    def about_run(self, run: SpinRun) -> Iterable[str]:
        """Return what to know of one input."""
        for note in run.notes:
            text = Text("{text} ({kind:s})", text=finding_text(note, run.series.of), kind=note.name)
            yield Note(note.name, text, weight=finding_weight(note))


#: Number of samples that show the steps of a converter; closer numbers than this part of their range are rounding.
_MOST_FOR_STEP, _ROUNDING = 20_000, 1e-7
#: Inputs that the text describes at most, and that the figure draws.
MOST_SENTENCES, MOST_DRAWN = 4, 3


def spin_of_source(source: Source[Records], options: SpinOptions) -> SpinRun:
    """Return the spin of one input.  Raises DataError, which names the file."""
    run = _spin_of(source, options)
    return run if options.drive is None else replace(run, drive_offset=drive_offset(run.series, options.drive))


def drive_offset(series: Series, drive: float) -> Estimate:
    """Return the mean of the spin less the drive's frequency [Hz], while the spin is held; where it never is, at all.

    Where the values scatter by more than their u, u grows by that ratio.
    """
    held = [(start <= series.time) & (series.time <= end) for kind, start, end in series.phases if kind == "held"]
    chosen = np.any(held, axis=0) if held else np.ones(len(series), dtype=bool)
    mean, u, chi_square = weighted_mean(series.frequency[chosen] - drive, series.u[chosen])
    return Estimate(mean, u * max(1.0, math.sqrt(chi_square / max(chosen.sum() - 1, 1))), "Hz")


def _spin_of(source: Source[Records], options: SpinOptions) -> SpinRun:
    records = source.readings
    try:
        if records.field:
            return _of_field(records.field, options)
        if records.pulses:
            return _of_times(records.pulses)
        if len(records.waveforms) == 1:
            return _of_waveform(records.waveforms[0], records.channel, options)
        return _of_several(records, options)
    except AnalysisError as error:
        channels = [note for note in records.warnings if kind_of(note) == "channels"]
        said = Text("{path:s}: {error}", path=source.path, error=error)
        raise DataError(Sentences(said, *channels, between="; ")) from error


def _of_times(pulses: PulseTimes) -> SpinRun:
    times, step = pulses.times, pulses.interval_step
    if times[-1] - times[0] <= LONGEST_WHOLE_S:
        spin = spin_of_times(times, interval_step=step)
        return replace(_of_one(spin), parts=parts_of(spin, spin))
    return _of_track(track_of_times(times, window=WINDOW_S, interval_step=step))


def _of_waveform(waveform: Waveform, channel: str, options: SpinOptions) -> SpinRun:
    if waveform.duration <= LONGEST_WHOLE_S:
        samples = waveform.samples(channel)
        spin = spin_of_trace(samples, waveform.rate, start=waveform.start, method=options.method, times=waveform.times)
        found = _with_rate(spin, waveform)
        return replace(_of_one(found), parts=parts_of(spin, found), code=_code(samples, found))
    return _of_track(track_of_record(waveform, channel, WINDOW_S, options.method))


def _of_field(record: FieldRecord, options: SpinOptions) -> SpinRun:
    if record.duration <= LONGEST_WHOLE_S:
        line = spin_of_field(record.times, record.field, near=options.near)
        spin = spin_of_line(line)
        run = _of_one(spin)
    else:
        track = track_of_field(record.times, record.field, near=options.near)
        line = track.spins[track_middle(track)]
        spin = spin_of_line(line)
        series = Series(track.time, track.frequency, track.u, tuple(map(_phase, phases(track))), of="window")
        run = SpinRun(spin, series, findings_of(track.spins))
    moment = None
    if options.distance_m is not None:
        distance = Estimate(options.distance_m, options.distance_u_m or DISTANCE_U_M, "m")
        moment = transverse_moment(line, distance, options.below_m or 0.0)
    return replace(
        run, parts=parts_of(spin, spin), line=line, transverse=moment, tilt=_tilt(moment, options.moment_a_m2)
    )


def _tilt(transverse: Estimate | None, moment: float | None) -> Estimate | None:
    """Return the angle of a moment whose size and transverse part are known [rad]."""
    if transverse is None or transverse.value is None or not moment or transverse.value >= moment:
        return None
    value = math.asin(transverse.value / moment)
    u = None if transverse.u is None else transverse.u / moment / math.cos(value)
    return Estimate(value, u, "rad")


def _with_rate(spin: SpinFrequency, waveform: Waveform) -> SpinFrequency:
    """Return the same with the uncertainty of the sampling rate in that of the frequency."""
    value, u = spin.frequency.value, spin.frequency.u
    if waveform.step_u == 0 or value is None or u is None:
        return spin
    return replace(spin, frequency=replace(spin.frequency, u=math.hypot(u, value * waveform.step_u / waveform.step)))


def _of_several(records: Records, options: SpinOptions) -> SpinRun:
    """Return a spin for each record of a run; what has no pulses is left out with a note, unless none has."""
    spins: list[SpinFrequency] = []
    parts: list[tuple[Mapping[str, UParts], float | None]] = []
    numbers: list[int] = []  # of the records that gave them
    missed: AnalysisError | None = None
    for number, waveform in enumerate(records.waveforms, 1):
        try:
            samples = waveform.samples()
            spin = spin_of_trace(samples, waveform.rate, start=waveform.start, method=options.method)
            spins.append(spin)
            parts.append((parts_of(spin, spin), _code(samples, spin)))
            numbers.append(number)
        except AnalysisError as error:
            missed = error
    if not spins:
        assert missed
        raise missed
    series = _with_start(Series(*_columns(spins), of="record"), records.waveforms[0].start_u)
    all_of_them = len(records.waveforms)
    notes = collect_findings({number: spin.notes for number, spin in zip(numbers, spins, strict=True)}, all_of_them)
    if missed:
        left_out = all_of_them - len(spins)
        notes = (*notes, Finding("no-pulses", "hum" * isinstance(missed, OnlyHum), (left_out, all_of_them)))
    return SpinRun(spins[len(spins) // 2], series, notes, *parts[len(spins) // 2])


def parts_of(spin: SpinFrequency, found: SpinFrequency) -> dict[str, UParts]:
    """Return the parts of the uncertainties, from those without and with that of the sampling interval."""
    parts = {}
    for name, pulses in zip(("frequency", "chirp"), spin.u_of_pulses or (), strict=False):
        more, whole = getattr(spin, name).u, getattr(found, name).u
        if all(size is not None and math.isfinite(size) for size in (pulses, more, whole)):
            parts[name] = UParts(min(pulses, more), rest(more, pulses), rest(whole, more))
    return parts


def _code(samples: Array, spin: SpinFrequency) -> float | None:
    """Return one step of the numbers of a record over the noise of a sample; None where that is not known."""
    some = np.unique(samples[:_MOST_FOR_STEP])
    if spin.snr_db is None or some.size < 2:
        return None
    height = float(some[-1] - some[0])  # of a pulse, and of noise on either side: no less than the pulse
    step = float(np.diff(some).min())
    return step / (height * 10 ** (-spin.snr_db / 20)) if step > _ROUNDING * height else None


def _with_start(series: Series, u_s: float) -> Series:
    """Return the same with the uncertainty of the times [s] in that of the frequencies at them, by their slope."""
    if u_s == 0 or len(series) < 2:
        return series
    return replace(series, u=np.hypot(series.u, u_s * np.gradient(series.frequency, series.time)))


def _of_one(spin: SpinFrequency) -> SpinRun:
    return SpinRun(spin, Series(*_columns([spin])), spin.notes)


def _of_track(track: Track) -> SpinRun:
    middle = int(np.abs(track.time - 0.5 * (track.time[0] + track.time[-1])).argmin())
    series = Series(track.time, track.frequency, track.u, tuple(map(_phase, phases(track))), of="window")
    spin = track.spins[middle]
    return SpinRun(spin, series, track.notes, parts_of(spin, spin))


def _phase(phase: Phase) -> tuple[str, float, float]:
    return phase.kind, phase.start, phase.end


def _columns(spins: Sequence[SpinFrequency]) -> tuple[Array, Array, Array]:
    rows = [(spin.reference_time, spin.frequency.value, spin.frequency.u) for spin in spins]
    time, frequency, u = np.array(rows, dtype=np.float64).T
    return time, frequency, u


#: Decimals of the time that a spin holds for, at least and at most [s].
_LEAST_DECIMALS, _MOST_DECIMALS = 3, 9


def shown_time(spin: SpinFrequency) -> str:
    """Return the time that a spin holds for [s], to the digit in which the slope makes a third of u.

    The spin of a top that slows by 0.15 Hz/s, known to 1 µHz, holds for a time to the microsecond.
    """
    slope, u = abs(spin.chirp.value or 0.0), spin.frequency.u or 0.0
    needed = math.ceil(math.log10(1.5 * slope / u)) if slope > 0 and u > 0 else 0  # half of the last digit is lost
    return with_decimals(spin.reference_time, min(max(needed, _LEAST_DECIMALS), _MOST_DECIMALS))


def in_a_sentence(run: SpinRun) -> str:
    """Return what the data say of one input."""
    spin, series = run.spin, run.series
    folds = run.line.folds[1:] if run.line and run.line.doubtful else ()
    at = Text(
        "{spin:n}{others} at {time:n} s",
        spin=with_uncertainty(spin.frequency),
        others=Text(" or {folds:.2f} Hz", folds=tuple(fold.frequency for fold in folds)) if folds else "",
        time=shown_time(spin),
    )
    drive = _about_drive(run)
    if len(series) == 1:
        return Sentences(Text("The spin is {at}, its slope {slope:n}.", at, with_uncertainty(spin.chirp)), drive)
    phases = tuple(
        Text("{kind} {start:.1f} to {end:.1f} s", kind=kind, start=round(start, 1) + 0.0, end=end)
        for kind, start, end in series.phases[:6]
    )
    way = Text(
        "The spin goes from {first:.3f} Hz at {begin:.1f} s to {last:.3f} Hz at {end:.1f} s ({n} {of}{phases}); "
        "{at}, {which}.",
        first=series.frequency[0],
        begin=series.time[0],
        last=series.frequency[-1],
        end=series.time[-1],
        n=len(series),
        of=f"{series.of}s",
        phases=Text("; {phases}", phases=phases) if phases else "",
        at=at,
        which=run.which,
    )
    said = "In the middle of all {of} its slope is {slope:n}."
    trend = Text(said, f"{series.of}s", with_uncertainty(run.trend)) if run.trend else ""
    return Sentences(way, trend, drive)


def _about_drive(run: SpinRun) -> str:
    """Return whether the top is locked to a drive whose frequency is given, as a sentence."""
    off, kinds = run.drive_offset, {kind for kind, *_ in run.series.phases}
    if off is None or off.value is None or not off.u:
        return ""
    said = "The top {follows} the drive: while it is held, the spin less the drive's frequency is {off:n}{beware}."
    if kinds and "held" not in kinds:
        said = "The top {follows} the drive: it is never held; its mean spin less the drive's is {off:n}{beware}."
    locked = (not kinds or "held" in kinds) and abs(off.value) <= NOT_LOCKED * off.u
    return Text(
        said,
        "is locked to" if locked else "is not locked to",
        with_uncertainty(off),
        " (if it is the spin: the drive's coil has a field of this frequency, too)" if run.line and locked else "",
    )
