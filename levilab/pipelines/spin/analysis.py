"""Spin frequencies at some paths, each by itself: nothing is averaged over different tops or times."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from analysis.errors import AnalysisError
from analysis.pulses import Finding, phases, spin_of_times, spin_of_trace, track_of_blocks, track_of_times
from levilab.errors import DataError
from levilab.pipelines.analyzed import Analyzed, Method
from levilab.pipelines.sources import InputOptions, Needs
from levilab.pipelines.spin.readings import Records, read_spin_file, read_spin_run
from levilab.present.numbers import with_uncertainty
from levilab.runs.traces import INDEX
from levilab.runs.waveforms import has_traces

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from analysis.pulses import Phase, SpinFrequency, Track
    from levilab.formats.waveforms.waveform import Waveform
    from levilab.pipelines.sources import Source

    Array = NDArray[np.float64]

SPIN = "spin"
#: The runs and files that suit.
NEEDS = Needs(
    analysis=SPIN,
    experiments=frozenset({"trace"}),
    read_file=read_spin_file,
    read_run=read_spin_run,
    data=INDEX,
    also=has_traces,
    wanted="run with traces",
)
#: A longer record is cut into windows [s]: a top that coasts loses 3 % of its spin meanwhile, and a parabola of the
#: phase still holds.
LONGEST_WHOLE_S = 12.0
#: Length of a window of a longer record [s].
WINDOW_S = 2.0


@dataclass(frozen=True)
class SpinOptions(InputOptions):
    """How pulses are found, see `analysis.pulses.spin_of_trace`."""

    method: Literal["auto", "edges", "matched", "likelihood"] = "auto"


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


@dataclass(frozen=True, eq=False)
class SpinRun:
    """One input.

    Attributes:
        spin: its frequency; of a long record or of several, that of the window or record in the middle.
        series: all of them.
        notes: findings.
    """

    spin: SpinFrequency
    series: Series
    notes: tuple[Finding, ...]


class SpinAnalysis(Analyzed[Records, SpinRun, None, SpinOptions]):
    """Spin frequencies, each by itself."""

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        texts = [in_a_sentence(run) for run in self.runs]
        if len(texts) == 1:
            return texts[0]
        named = (f"{source.name}: {text}" for source, text in zip(self.sources[:MOST_SENTENCES], texts, strict=False))
        more = len(texts) - MOST_SENTENCES
        return " ".join(named) + (f" And {more} more, in the table." if more > 0 else "")

    @property
    def averaged(self) -> tuple[()]:
        """None: nothing is averaged over different tops or times."""
        return ()

    def about_all(self) -> Iterable[str]:
        """What to know of the method."""
        method = self.options.method
        if method != "auto" and all(source.readings.pulses for source in self.sources):
            yield f"the method {method} was chosen, but a list of pulse times leaves no choice"

    def about_run(self, run: SpinRun) -> Iterable[str]:
        """What to know of one input."""
        return (f"{note.text} ({note.name})" for note in run.notes)


#: The text describes so many inputs at most.
MOST_SENTENCES = 4


def spin_of_source(source: Source[Records], options: SpinOptions) -> SpinRun:
    """The spin of one input.  Raises DataError, which names the file."""
    records = source.readings
    try:
        if records.pulses:
            return _of_times(records.pulses.times)
        if len(records.waveforms) == 1:
            return _of_waveform(records.waveforms[0], records.channel, options)
        return _of_several(records, options)
    except AnalysisError as error:
        raise DataError(f"{source.path}: {error}") from error


METHOD = Method(
    needs=NEEDS,
    kind=SpinAnalysis,
    options=SpinOptions,
    fit=spin_of_source,
    of_files=frozenset({"columns", "rate"}),  # a run may have records of several channels
    passes_over=True,
)


def analyze_spins(paths: Sequence[Path], options: SpinOptions) -> SpinAnalysis:
    """Find the spin frequency of every record found at the paths.

    Raises DataError for what cannot be used; the text names the file.
    """
    return METHOD.analyze(paths, options)


def _of_times(times: Array) -> SpinRun:
    if times[-1] - times[0] <= LONGEST_WHOLE_S:
        return _of_one(spin_of_times(times).under_drag())
    return _of_track(track_of_times(times, window=WINDOW_S))


def _of_waveform(waveform: Waveform, channel: str, options: SpinOptions) -> SpinRun:
    if waveform.duration <= LONGEST_WHOLE_S:
        samples = waveform.samples(channel)
        spin = spin_of_trace(samples, waveform.rate, start=waveform.start, method=options.method).under_drag()
        return _of_one(_with_rate(spin, waveform))
    blocks = waveform.blocks(channel)
    return _of_track(
        track_of_blocks(blocks, waveform.rate, start=waveform.start, window=WINDOW_S, method=options.method)
    )


def _with_rate(spin: SpinFrequency, waveform: Waveform) -> SpinFrequency:
    """The same with the uncertainty of the sampling rate in that of the frequency."""
    value, u = spin.frequency.value, spin.frequency.u
    if waveform.step_u == 0 or value is None or u is None:
        return spin
    return replace(spin, frequency=replace(spin.frequency, u=math.hypot(u, value * waveform.step_u / waveform.step)))


def _of_several(records: Records, options: SpinOptions) -> SpinRun:
    """A spin for each record of a run; what has no pulses is left out with a note, unless none has."""
    spins: list[SpinFrequency] = []
    numbers: list[int] = []  # of the records that gave them
    missed: AnalysisError | None = None
    for number, waveform in enumerate(records.waveforms, 1):
        try:
            samples = waveform.samples()
            spin = spin_of_trace(samples, waveform.rate, start=waveform.start, method=options.method)
            spins.append(spin.under_drag())
            numbers.append(number)
        except AnalysisError as error:
            missed = error
    if not spins:
        assert missed
        raise missed
    series = _with_start(Series(*_columns(spins), of="record"), records.waveforms[0].start_u)
    all_of_them = len(records.waveforms)
    notes = _by_record(dict(zip(numbers, spins, strict=True)), all_of_them)
    if missed:
        left_out = all_of_them - len(spins)
        text = f"{left_out} of {all_of_them} records are left out, the last of them for this: {missed}"
        notes = (*notes, Finding("no-pulses", text))
    return SpinRun(spins[len(spins) // 2], series, notes)


def _with_start(series: Series, u_s: float) -> Series:
    """The same with the uncertainty of the times [s] in that of the frequencies at them, by their slope."""
    if u_s == 0 or len(series) < 2:
        return series
    return replace(series, u=np.hypot(series.u, u_s * np.gradient(series.frequency, series.time)))


def _by_record(spins: Mapping[int, SpinFrequency], all_of_them: int) -> tuple[Finding, ...]:
    """Each finding once, with the records that it is of: the table shows the record in the middle, which may lack it.

    spins: the number of a record, from 1 → its spin.
    """
    found: dict[str, dict[int, str]] = {}
    for number, spin in spins.items():
        for note in spin.notes:
            found.setdefault(note.name, {}).setdefault(number, note.text)
    notes = []
    for name, texts in found.items():
        first, text = next(iter(texts.items()))
        where = f"{len(texts)} of {all_of_them} records, number {first} first" if len(texts) > 1 else f"record {first}"
        notes.append(Finding(name, text if all_of_them == 1 else f"{where}: {text}"))
    return tuple(notes)


def _of_one(spin: SpinFrequency) -> SpinRun:
    return SpinRun(spin, Series(*_columns([spin])), spin.notes)


def _of_track(track: Track) -> SpinRun:
    middle = int(np.abs(track.time - 0.5 * (track.time[0] + track.time[-1])).argmin())
    series = Series(track.time, track.frequency, track.u, tuple(map(_phase, phases(track))), of="window")
    return SpinRun(track.spins[middle], series, track.notes)


def _phase(phase: Phase) -> tuple[str, float, float]:
    return phase.kind, phase.start, phase.end


def _columns(spins: Sequence[SpinFrequency]) -> tuple[Array, Array, Array]:
    rows = [(spin.reference_time, spin.frequency.value, spin.frequency.u) for spin in spins]
    time, frequency, u = np.array(rows, dtype=np.float64).T
    return time, frequency, u


def in_a_sentence(run: SpinRun) -> str:
    """What the data say of one input."""
    spin, series = run.spin, run.series
    at = f"{with_uncertainty(spin.frequency)} at {spin.reference_time:.4g} s"
    if len(series) == 1:
        return f"The spin is {at}, its slope {with_uncertainty(spin.chirp)}."
    ends = f"{series.frequency[0]:.3f} Hz at {series.time[0]:.1f} s to {series.frequency[-1]:.3f} Hz"
    phases = ", ".join(f"{kind} {start:.1f} to {end:.1f} s" for kind, start, end in series.phases[:6])
    in_phases = f"; {phases}" if phases else ""
    return f"The spin goes from {ends} at {series.time[-1]:.1f} s ({len(series)} {series.of}s{in_phases}); {at}."
