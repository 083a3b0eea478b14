"""What the analysis of a spin reads: records of a detector's signal or of a magnetometer, or times of pulses."""

from __future__ import annotations

import os
import zlib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from analysis.pulses import Track, track_of_blocks, track_of_samples
from analysis.rotation.record import FEWEST
from levilab.errors import DataError, DoesNotSuit
from levilab.formats.waveforms.record import read_record
from levilab.formats.waveforms.waveform import PulseTimes, Waveform
from levilab.pipelines.inputs.source import Readings
from levilab.pipelines.options import InputOptions
from levilab.pipelines.spin.magnetometer import FieldRecord, read_field_record
from levilab.runs.run import Run
from levilab.runs.traces import INDEX, undescribed_codes
from levilab.runs.waveforms import run_waveforms
from levilab.texts.note import Note, of_file
from levilab.texts.text import Text, how_many

#: Channels whose frequency is no spin, as experiments call them, with what it is.
NO_SPIN = {"laser": "how often the stem cuts the laser: its precession", "drive": "that of the drive"}
_UNDESCRIBED = "{path:s} has no line in {index:s}, as a process that was killed leaves it: it is left out"
_CHOSEN = "has records of {names:s}; {chosen:s} is analyzed, the option `channel` chooses another"


@dataclass(frozen=True, eq=False)
class Records(Readings):
    """One input.

    Attributes:
        waveforms: one for a file, one a record for a run, none for a list of times.
        channel: its name.
        pulses: the list.
        origin: the file or folder.
        field: samples of a magnetometer.
    """

    origin: Path
    waveforms: tuple[Waveform, ...]
    channel: str
    pulses: PulseTimes | None
    warnings: tuple[str, ...]
    field: FieldRecord | None = None

    def __len__(self) -> int:
        if self.field:
            return len(self.field)
        return sum(waveform.count for waveform in self.waveforms) + (len(self.pulses.times) if self.pulses else 0)

    @property
    def fingerprint(self) -> float:
        """A number made of the path."""
        return float(zlib.crc32(os.fsencode(self.origin.resolve())))

    def same_as(self, other: Records) -> bool:
        """Return whether it is the same input: nothing is averaged, so a copy by another name does no harm."""
        return self.origin.resolve() == other.origin.resolve()

    @property
    def kind(self) -> str:
        """What it is, in words."""
        if self.field:
            return self.field.kind
        if self.pulses:
            return self.pulses.format
        if len(self.waveforms) > 1:
            return Text("{records} of an oscilloscope", records=how_many(len(self.waveforms), "record"))
        return self.waveforms[0].format


def track_of_record(
    record: Waveform, channel: str | None, window: float, method: Literal["auto", "edges", "matched", "likelihood"]
) -> Track:
    """Return the frequency in windows of a long record [s]; samples at even times are read in blocks.

    Raises AnalysisError.
    """
    if record.times is not None:
        return track_of_samples(record.samples(channel), record.times, window=window, method=method)
    return track_of_blocks(record.blocks(channel), record.rate, start=record.start, window=window, method=method)


def read_spin_file(path: Path, options: InputOptions) -> Records:
    """Return a data file.

    Raises:
        DoesNotSuit: it holds neither samples nor pulse times.
        DataError: it cannot be used.
    """
    field = read_field_record(path, options)
    if field and len(field) < FEWEST:
        few = "{path:s}: holds {n} samples of a field, at least {fewest} are needed: record longer"
        raise DoesNotSuit(few, path=path, n=len(field), fewest=FEWEST)
    if field:
        return Records(path, (), "", None, field.warnings, field)
    record = read_record(path, columns=options.columns, rate=options.rate, guess=options.guess)
    if isinstance(record, PulseTimes):
        return Records(path, (), "", record, record.warnings)
    chosen, notes = choose_channel(record, options.channel)
    return Records(path, (record,), chosen, None, (*record.warnings, *notes))


def choose_channel(record: Waveform, channel: str | None) -> tuple[str, tuple[str, ...]]:
    """Return the name of the channel of a record that is analyzed; and a note where several leave a choice."""
    chosen = record.signals[record.signal(channel)].name
    if channel is not None or len(record.signals) == 1:
        return chosen, ()
    text = Text(_CHOSEN, names=tuple(one.name for one in record.signals), chosen=chosen)
    return chosen, (of_file("channels", Text("{path:s}: {message}", path=record.path.name, message=text)),)


def read_spin_run(run: Run, options: InputOptions) -> Records:
    """Return the records of a run: of one channel, the one with the most records unless it is named.

    A laser and a drive are taken where they are named alone: theirs is the frequency of something else.

    Raises:
        DoesNotSuit: the run keeps none that show a spin.
        DataError: one is damaged, or none is of the channel.
    """
    found = run_waveforms(run)
    if not found:
        raise DoesNotSuit("{path:s}: keeps no record of an oscilloscope", path=run.folder)
    names = Counter(waveform.signals[0].name for waveform in found)
    chosen = options.channel or _shows_a_spin(run, names)
    of_channel = tuple(w for w in found if w.signals[0].name.casefold() == chosen.casefold())
    if not of_channel:
        raise DataError(
            "{path:s}: has no record of {chosen:s}, but of {names:s}: name one with `channel`",
            path=run.folder,
            chosen=repr(chosen),
            names=(*names,),
        )
    left_out = undescribed_codes(run.folder)
    warnings: list[str] = [Note("undescribed", Text(_UNDESCRIBED, path, INDEX)) for path in left_out]
    warnings += [text for waveform in found for text in waveform.warnings]
    if chosen.casefold() in NO_SPIN:
        what = NO_SPIN[chosen.casefold()]
        warnings.append(Note("no spin", Text("the frequency of {chosen:s} is no spin, but {what}", chosen, what)))
    if options.channel is None and len(names) > 1:
        warnings.append(Note("channels", Text(_CHOSEN, names=(*names,), chosen=chosen)))
    return Records(run.folder, of_channel, chosen, None, tuple(warnings))


def _shows_a_spin(run: Run, names: Counter[str]) -> str:
    """Return the channel with the most records of those that show a spin.  Raises DoesNotSuit."""
    spins = [name for name, _ in names.most_common() if name.casefold() not in NO_SPIN]
    if spins:
        return spins[0]
    raise DoesNotSuit(
        "{path:s}: keeps records of {names:s}, none of which shows the spin: levilab analyze precession reads such "
        "a run; `channel` = {first:s} takes the frequency of its pulses",
        path=run.folder,
        names=(*names,),
        first=next(iter(names)),
    )
