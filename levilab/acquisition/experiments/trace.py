"""Records of the oscilloscope: raw codes into the run folder, written as they come."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, PositiveFloat, PositiveInt

from analysis.errors import AnalysisError
from analysis.pulses.trace import spin_of_trace
from instruments.drivers.oscilloscope import NeverTriggered, Trace
from instruments.drivers.oscilloscope.sound import SilentInput
from instruments.errors import CommandRefused, InstrumentError, OutOfRange
from levilab.acquisition.driving import HELD_WITHIN_HZ, check_drive
from levilab.acquisition.experiment import Experiment, ExperimentSettings, ModelOf
from levilab.acquisition.session import ExperimentFailed, Row, Session
from levilab.bench.config import BenchConfig, Limits
from levilab.runs.channel import Channel
from levilab.runs.events import RunEvent
from levilab.runs.traces import INDEX, described_times, undescribed_codes
from levilab.simulator.scene import Scene
from levilab.texts.text import Text

#: A signal that moves by fewer codes than this is none: nothing is plugged in, or it is far too small for the scale.
_FEWEST_CODES = 3
#: Divisions from its middle in which a scope records and triggers: 5 for the DS1000Z, more for others.
_HALF_SCREEN = 5
#: Added where the oscilloscope refuses a setting (manuals of the DS1000Z, :CHANnel<n>:OFFSet, and of the DSO-X 1000).
_OFFSETS = (
    "a DS1000Z takes trace.offset_v from -2 to 2 V, and from 0.5 V a division (trace.volts_per_division) on from -100 "
    "to 100 V; a DSOX1000 from -2 to 2 V, and from 0.2 V a division on from -50 to 50 V"
)
#: What the light of the tape is called, and so few of its pulses say how fast it turns.
TAPE, _FEWEST_PULSES = "tape", 3
#: A record of which more than this share lies beyond the screen is worth a warning.
_CLIPPED_SHARE = 1e-3


def _distinct(channels: tuple[int, ...]) -> tuple[int, ...]:
    if len(set(channels)) < len(channels):
        raise ValueError("each channel is expected once")
    return channels


class TraceSettings(ExperimentSettings):
    """Records of one or several channels, all with one scaling, at an interval.

    Attributes:
        drive_frequency_hz: without it the generator is not needed and not touched.
    """

    channels: Annotated[tuple[PositiveInt, ...], Field(min_length=1), AfterValidator(_distinct)] = Field(
        default=(1,), description="channels of the oscilloscope to record,"
    )
    shows: tuple[str, ...] = Field(default=(TAPE,), description="what each of them shows")
    duration_s: PositiveFloat = Field(default=0.5, description="least length of a record")
    points: PositiveInt = Field(default=6000, description="least number of points of a record")
    volts_per_division: float = Field(default=0.2, ge=1e-3, le=10.0)
    offset_v: float = Field(default=0.65, ge=-100.0, le=100.0, description="voltage in the middle of the screen")
    coupling: Literal["DC", "AC"] = Field(default="DC", description="DC or AC")
    trigger_channel: PositiveInt | None = Field(
        default=None, description="the first of the channels, if not given", examples=[1]
    )
    trigger_level_v: float = Field(default=0.65, description="half way between dark and the pulse")
    trigger_slope: Literal["rising", "falling", "either"] = Field(
        default="rising", description="rising, falling or either"
    )
    trigger_patience_s: PositiveFloat = Field(default=5.0, description="longest wait for a trigger")
    records: PositiveInt = Field(default=10, description="number of records")
    interval_s: PositiveFloat = Field(
        default=10.0, description="time from one record to the next, if the scope is fast enough"
    )
    drive_frequency_hz: PositiveFloat | None = Field(
        default=None, description="drive meanwhile; needs the generator", examples=[30.0]
    )
    drive_amplitude_vpp: PositiveFloat = 10.0

    @property
    def trigger_source(self) -> int:
        """The channel that triggers."""
        return self.trigger_channel or self.channels[0]

    def label(self, channel: int) -> str:
        """Return the meaning of a channel, as it stands beside its traces."""
        k = self.channels.index(channel)
        return self.shows[k] if k < len(self.shows) else f"channel {channel}"

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for a trigger beyond the screen, and for a drive that the bench does not allow."""
        low, high = (self.offset_v + k * self.volts_per_division for k in (-_HALF_SCREEN, _HALF_SCREEN))
        if self.trigger_source in self.channels and not low <= self.trigger_level_v <= high:
            said = (
                "{table:s}.trigger_level_v = {trigger_level_v:g} is beyond what the oscilloscope records, "
                "{low:g} to {high:g} V: change it, {table:s}.offset_v or {table:s}.volts_per_division"
            )
            raise self.refusal(table, said, "trigger_level_v", "offset_v", "volts_per_division", low=low, high=high)
        if self.drive_frequency_hz is not None:
            check_drive(table, limits, self.drive_amplitude_vpp, [("drive_frequency_hz", self.drive_frequency_hz)])

    def for_bench(self, config: BenchConfig, model_of: ModelOf) -> Self:
        """See the base: the whole range of an input that is AC coupled only, triggered where the signal passes 0."""
        scope = model_of("oscilloscope")
        if scope is None or "DC" in scope.driver.INPUT_COUPLINGS:
            return self
        suited: dict[str, object] = {
            "channels": (1,), "shows": (TAPE,), "volts_per_division": 0.25, "offset_v": 0.0, "coupling": "AC",
            "trigger_level_v": 0.0,
        }  # fmt: skip
        return self.model_copy(update={key: suited[key] for key in suited.keys() - self.model_fields_set})

    def for_scene(self, scene: Scene) -> Self:
        """See the base: the laser beside the tape, and the scene's drive, where neither was set."""
        changes: dict[str, object] = {}
        if not {"channels", "shows"} & self.model_fields_set:
            changes |= {"channels": (1, 3), "shows": (TAPE, "laser")}
        if "drive_frequency_hz" not in self.model_fields_set and scene.drive.waveform != "off":
            changes["drive_frequency_hz"] = scene.drive.frequency_hz
        return self.model_copy(update=changes)


def channels(settings: TraceSettings) -> tuple[Channel, ...]:
    """Write a row of readings.csv for each record."""
    trigger = f"oscilloscope, channel {settings.trigger_source}, which triggers"
    if settings.trigger_source not in settings.channels:
        trigger = f"oscilloscope, channel {settings.channels[0]}"
    shown = (
        Channel("time_s", "s", "bench clock when the record was complete, from the moment the first was asked for"),
        Channel("record", "", "number of the record, in traces.jsonl those of all its channels one after the other"),
        Channel("lowest_v", "V", trigger),
        Channel("highest_v", "V", trigger),
    )
    if TAPE not in [settings.label(channel) for channel in settings.channels]:
        return shown
    tape = "the pulses of the tape in the record, by the oscilloscope's clock"
    return (
        *shown,
        Channel("tape_frequency_hz", "Hz", f"{tape}, in its middle"),
        Channel("tape_frequency_u_hz", "Hz", "its standard uncertainty, without the clock's"),
    )


def also_needs(settings: TraceSettings) -> tuple[str, ...]:
    """Return the generator, if the top is to be driven."""
    return ("generator",) if settings.drive_frequency_hz else ()


def run(session: Session[TraceSettings]) -> None:
    """Take record after record; those that a resumed run has are kept."""
    settings = session.settings
    _prepare_scope(session)
    _drive(session)
    session.begin(lambda: None, resumed=Text("the next record is number {number}", number=len(session.rows) + 1))
    if session.earlier:
        _note_what_was_cut_short(session)
    if len(session.rows) >= settings.records:
        return
    watch = _Watch(session)
    for _ in session.readings_every(settings.interval_s, math.inf):
        if traces := _take(session):
            watch.look(traces)
        if len(session.rows) >= settings.records:
            return


def _note_what_was_cut_short(session: Session[TraceSettings]) -> None:
    """Note codes without a line, or channels without a row, left by a process killed in the middle of a record."""
    folder = session.writer.folder
    if left := undescribed_codes(folder):
        text = Text(
            "{names}: the run was cut short before {file} said how to read it; it stays, and is left out",
            names=", ".join(left),
            file=INDEX,
        )
        session.event(RunEvent.CUT_SHORT, text)
    number, channels = len(session.rows) + 1, len(session.settings.channels)
    last = session.rows[-1]["time_s"] if session.rows else -math.inf
    # the channels of a record are kept after its time was noted, and before its row
    more = sum(time >= last for time in described_times(folder)) - (channels if session.rows else 0)
    if more > 0:
        text = Text(
            "record {number} was cut short after {some} of {all} channels; it is taken again", number, more, channels
        )
        session.event(RunEvent.CUT_SHORT, text, record=number)


# --- setting up ---


def _prepare_scope(session: Session[TraceSettings], sweep: str = "normal") -> None:
    settings = session.settings
    try:
        session.bench.oscilloscope.prepare(
            channels=settings.channels,
            duration_s=settings.duration_s,
            points=settings.points,
            volts_per_division=settings.volts_per_division,
            offset_v=settings.offset_v,
            coupling=settings.coupling,
            trigger_level_v=settings.trigger_level_v,
            trigger_slope=settings.trigger_slope,
            trigger_source=settings.trigger_source,
            sweep=sweep,
        )
    except CommandRefused as refused:
        raise InstrumentError(refused.address, f"{refused.reason}: {_OFFSETS}") from refused


def _drive(session: Session[TraceSettings]) -> None:
    """Switch the drive on, if there is to be one."""
    settings = session.settings
    if settings.drive_frequency_hz is None:
        return
    session.stop.check()  # the drive does not go on once the end was asked for
    session.bench.generator.prepare(
        waveform="SIN", frequency_hz=settings.drive_frequency_hz, amplitude_vpp=settings.drive_amplitude_vpp
    )
    session.event(RunEvent.DRIVE_ON, Text("drive on at {drive_frequency_hz:g} Hz", settings.drive_frequency_hz))
    session.bench.generator.output = True
    session.bench.record_settings("generator")


# --- the drive, between records ---


@dataclass
class _Watch:
    """Looks at the drive after each record: whether the generator is as it was set, and whether the top follows it.

    lost: whether the last record showed a top that does not.
    """

    session: Session[TraceSettings]
    lost: bool = False

    def look(self, traces: list[Trace]) -> None:
        """Return the drive's settings for a record; set a generator that was changed or lost up again."""
        session, drive = self.session, self.session.settings.drive_frequency_hz
        if drive is None:
            return
        number = len(session.rows)
        try:
            session.check_settings("generator")
        except InstrumentError as error:
            session.warn(
                "record {number} may be of another drive: the generator was changed, or failed ({why})",
                number=number,
                why=error,
            )
            session.reconnect("generator", error, lambda: _drive(session))
            return
        tape = next((one for one in traces if session.settings.label(one.channel) == TAPE), None)
        spin = None if tape is None else spin_of_record(tape, session.settings.trigger_level_v)
        lost = spin is not None and abs(spin - drive) > HELD_WITHIN_HZ
        if spin is not None and lost and not self.lost:
            session.warn(
                "record {number} shows a tape of {spin:.2f} Hz: the drive of {drive:g} Hz lost the top",
                number=number,
                spin=spin,
                drive=drive,
            )
        elif spin is not None and self.lost and not lost:
            session.event(
                RunEvent.LOCKED,
                Text("record {number} shows a tape of {spin:.2f} Hz: the top follows the drive again", number, spin),
            )
        self.lost = lost


def spin_of_record(trace: Trace, level_v: float) -> float | None:
    """Return the rate of rises through a level: the median of the intervals [Hz]; None of fewer than three.

    It passes once more only after it was below by a quarter of its range: noise on a flank is no pulse.
    """
    volts = trace.volts[~np.isnan(trace.volts)]
    if not volts.size:
        return None
    lower = level_v - 0.25 * float(np.ptp(volts))
    side = np.where(volts > level_v, 1, np.where(volts < lower, -1, 0))
    seen = np.flatnonzero(side)  # between the two levels it stays on the side where it was
    up = seen[1:][np.diff(side[seen]) > 0]
    return None if up.size < _FEWEST_PULSES else 1 / (float(np.median(np.diff(up))) * trace.dt_s)


# --- records ---


def _take(session: Session[TraceSettings]) -> list[Trace]:
    """Take and keep a record, a trace each channel; none where the oscilloscope was lost and is set up again.

    Raises ExperimentFailed where no trigger comes.
    """
    settings, number = session.settings, len(session.rows) + 1
    traces: list[Trace] = []
    try:
        session.bench.oscilloscope.acquire(timeout_s=settings.trigger_patience_s)
        now = session.now()  # the record's way to this computer takes longer
        for channel in settings.channels:
            trace = session.keep_trace(channel, settings.label(channel), now)
            traces.append(trace)
            if problem := _problem(trace, settings):
                session.event(
                    RunEvent.LOOK_AT_THE_SCALE,
                    Text("record {number}: {problem}", number=number, problem=problem),
                    record=number,
                    channel=trace.channel,
                )
    except SilentInput:
        raise
    except NeverTriggered as never:
        raise ExperimentFailed(_why_no_trigger(session)) from never
    except OutOfRange:
        raise
    except InstrumentError as error:
        if traces:
            text = Text(
                "record {number} was cut short after {some} of {all} channels",
                number=number,
                some=len(traces),
                all=len(settings.channels),
            )
            session.event(RunEvent.CUT_SHORT, Text("{said}; it is taken again", said=text), record=number)
        session.reconnect("oscilloscope", error, lambda: _prepare_scope(session))
        return []
    _keep(session, traces, now)
    return traces


def _why_no_trigger(session: Session[TraceSettings]) -> str:
    """Return a description of the signal, by a record without a trigger."""
    settings, count = session.settings, len(session.rows)
    where = Text("at {level:g} V on channel {channel}", level=settings.trigger_level_v, channel=settings.trigger_source)
    said = Text(
        "no trigger {where} within {seconds:g} s, after {count} of {records} records",
        where=where,
        seconds=settings.trigger_patience_s,
        count=count,
        records=settings.records,
    )
    try:
        _prepare_scope(session, sweep="auto")
        session.bench.oscilloscope.acquire(timeout_s=settings.trigger_patience_s)
        low, high = _range(session.bench.oscilloscope.trace(_channel_in_message(settings)))
    except InstrumentError:
        low = high = math.nan
    if math.isnan(low):
        return Text("{said}, and no record without one: is the signal there?", said=said)
    level = settings.trigger_level_v
    if settings.trigger_source not in settings.channels:
        return Text(
            "{said}: is the signal plugged in there, and does it cross this level (trace.trigger_level_v)?", said=said
        )
    advice = "is the top up and lit?" if low < level < high or high - low < 0.1 else "set trace.trigger_level_v between"
    return Text("{said}: the signal there lies between {low:.2f} and {high:.2f} V; {advice}", said, low, high, advice)


def _channel_in_message(settings: TraceSettings) -> int:
    """Return the channel whose range the message names: the one that triggers, if it is recorded."""
    return settings.trigger_source if settings.trigger_source in settings.channels else settings.channels[0]


def _range(trace: Trace) -> tuple[float, float]:
    """Return the lowest and the highest voltage of a trace [V], NaN where it has no sample."""
    volts = trace.volts[~np.isnan(trace.volts)]
    return (float(volts.min()), float(volts.max())) if volts.size else (math.nan, math.nan)


def _keep(session: Session[TraceSettings], traces: list[Trace], time_s: float) -> None:
    """Keep the row that says that the traces of a record are there.  time_s: when it was taken."""
    settings, number = session.settings, len(session.rows) + 1
    shown = next(trace for trace in traces if trace.channel == _channel_in_message(settings))
    low, high = _range(shown)
    row: Row = {"time_s": time_s, "record": number}
    if not math.isnan(low):
        row |= {"lowest_v": low, "highest_v": high}
    tape = next((trace for trace in traces if settings.label(trace.channel) == TAPE), None)
    session.keep(row | ({} if tape is None else _frequency(tape)), (settings.records - number) * settings.interval_s)


def _frequency(tape: Trace) -> Row:
    """Return the frequency of the tape in the middle of a record, as `levilab analyze spin` has it; empty without."""
    try:
        found = spin_of_trace(tape.volts, 1 / tape.dt_s).at(tape.dt_s * tape.codes.size / 2)
    except AnalysisError:
        return {}
    named = {"tape_frequency_hz": found.value, "tape_frequency_u_hz": found.u}
    return {name: value for name, value in named.items() if value is not None}


def _problem(trace: Trace, settings: TraceSettings) -> str:
    """Return the fault of a trace's scale, empty if it has none."""
    codes = trace.codes if trace.none is None else trace.codes[trace.codes != trace.none]
    what = Text("channel {channel} ({label})", channel=trace.channel, label=settings.label(trace.channel))
    if not codes.size or int(codes.max()) - int(codes.min()) < _FEWEST_CODES:
        return Text("{what} shows nothing: is it plugged in, and on?", what=what)
    clipped = float(trace.clipped.mean())
    if clipped > _CLIPPED_SHARE:
        return Text(
            "{what} is beyond the screen for {percent:.2g} % of it: raise trace.volts_per_division", what, 100 * clipped
        )
    return ""


EXPERIMENT = Experiment(
    name="trace",
    about="records of the oscilloscope, raw codes, written as they come",
    instruments=("oscilloscope",),
    settings=TraceSettings,
    channels=channels,
    run=run,
    also_needs=also_needs,
    called="record",
)
