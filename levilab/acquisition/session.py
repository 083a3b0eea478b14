"""An acquisition under way: what the steps of every experiment act on."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from instruments.errors import InstrumentError, SettingsLost
from levilab.bench.person import Person, Task, ask_no_person
from levilab.computer import utc_now
from levilab.errors import LevilabError
from levilab.present.units import unit
from levilab.runs.events import RunEvent
from levilab.settings import Settings
from levilab.telemetry.messages import Count
from levilab.texts.text import Text, in_language

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from instruments.drivers.oscilloscope import Trace
    from levilab.bench.bench import Bench
    from levilab.interruption import Stop
    from levilab.present.progress import Display
    from levilab.runs.channel import Channel
    from levilab.runs.run import Run
    from levilab.runs.writer import RunWriter

S = TypeVar("S", bound=Settings)
T = TypeVar("T")

#: Longest sleep between two checks for Ctrl-C [s], by the clock on the wall: one that jumps sleeps through at once.
_NAP_S = 0.2
#: Pauses [s] before the tries to reach an instrument again, half a minute in all.
REOPENING_S = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0)
#: An instrument that is lost this many times in a row, with no reading in between, is broken.
MOST_LOSSES = 5

#: A reading: channel → value.  A value that is not known has no key.
Row = dict[str, float]


class ExperimentFailed(LevilabError):
    """The experiment cannot go on, for a reason that lies on the bench.

    Attributes:
        observed: what was seen; the text without what is to be done about it.
        advice: what is to be done; empty where `observed` says it.
    """

    def __init__(self, observed: str, advice: str = "", /, **values: object) -> None:
        if values:  # then both are templates
            observed, advice = Text(observed, **values), Text(advice, **values)
        self.observed, self.advice = observed, advice
        super().__init__(Text("{observed}: {advice}", observed=observed, advice=advice) if advice else observed)


class DidNotFollow(ExperimentFailed):
    """The drive did not bring the top to where it should, or the counts of a free top are not its spin."""


class NoLight(ExperimentFailed):
    """The counter counts nothing."""


class NotHeld(Exception):
    """The top does not spin with the drive; what is seen instead.

    Attributes:
        spin: [Hz]; None where no top is seen.
        drive: [Hz].
    """

    def __init__(self, spin: float | None, drive: float) -> None:
        self.spin, self.drive = spin, drive
        seen = "no top seen" if spin is None else Text("a spin of {spin:.2f} Hz", spin=spin)
        super().__init__(Text("{seen} under a drive of {drive:.2f} Hz", seen=seen, drive=drive))


@dataclass(frozen=True)
class Earlier:
    """The run that is resumed.

    Attributes:
        replay: its world is virtual, and is brought to where the run left it.
    """

    run: Run
    rows: list[Row]
    replay: bool


@dataclass
class Doing:
    """What an acquisition does at present, for the person at the bench and for views.

    Attributes:
        text: its present work; empty while readings come.
        share: of the way to the first reading; None once readings come.
        end: bench times between which it is expected to end [s]; None where that is not known.
        seen: channel → what an instrument answered last, in a reading or outside of one.
        count: the last count of the spin, in a reading or outside of one; None where there was nothing to count.
        records: channel → the oscilloscope's latest record, with its number and the bench time [s].
        lost: kinds of instruments that do not answer.
    """

    text: str = "connected"
    share: float | None = 0.0
    end: tuple[float, float] | None = None
    seen: dict[str, float] = field(default_factory=dict)
    count: Count | None = None
    records: dict[str, tuple[int, float, Trace]] = field(default_factory=dict)
    lost: set[str] = field(default_factory=set)


def last_count(bench: Bench, spin: float | None) -> Count | None:
    """Return a count of the spin that ends now, with its gate; None where there was nothing to count."""
    gate_s = float(bench.counter.last_set.get("gate_s", 0.0))
    return None if spin is None else Count(spin, bench.clock.now(), gate_s)


@dataclass
class Session(Generic[S]):
    """An acquisition under way.

    Attributes:
        bench: the open instruments.
        settings: of the experiment.
        channels: the columns of the readings.
        writer: the run folder.
        show: what the person at the bench sees.
        stop: whether the end was asked for.
        person: carries out what the experiment asks of a person at the bench.
        earlier: the run that is resumed, if one is.
        rows: the readings so far, those of the resumed run included.
        zero: bench time of time_s = 0 [s], None before it is reached.
        last_request_time: when the last reading was asked for [s].
        called: what one reading of this experiment is called.
        began: when this session began to measure: at time zero, or when it resumed the run, maybe days later [s].
        doing: its present work.
        look: called whenever that changes; while bench time passes the clock calls it.
    """

    bench: Bench
    settings: S
    channels: tuple[Channel, ...]
    writer: RunWriter
    show: Display
    stop: Stop
    person: Person = ask_no_person
    earlier: Earlier | None = None
    rows: list[Row] = field(default_factory=list)
    zero: float | None = None
    last_request_time: float = 0.0
    began: float = 0.0
    called: str = "reading"
    doing: Doing = field(default_factory=Doing)
    look: Callable[[], None] = lambda: None
    _replaying: bool = False
    _losses: int = 0  # since the last reading
    _lost: bool = False  # since the last reading was asked for
    _headed: bool = False  # whether the heads of the readings were shown

    # --- time ---

    def now(self) -> float:
        """Return the seconds since time zero."""
        return self.bench.clock.now() - (self.zero or 0.0)

    def time_spent(self) -> float:
        """Return the seconds since this session began to measure."""
        return self.now() - self.began

    def wait(self, duration: float) -> None:
        """Let bench time pass [s].  Raises Interrupted if the end was asked for."""
        clock = self.bench.clock
        end = clock.now() + duration
        while True:
            self.stop.check()
            left = end - clock.now()
            if left <= 0:
                return
            wall = clock.wall_duration(left)
            clock.sleep(left * _NAP_S / wall if wall > _NAP_S else left)

    def begin(
        self, start: Callable[[], object], *, resumed: str = "without driving again", reading_s: float = 0.0
    ) -> None:
        """Bring the top to where reading begins: that moment is time zero.

        A resumed run is taken up where it was left, without starting again: a real top has gone on meanwhile; the one
        of a virtual bench is started once more, which is no event of the run, and left alone up to the last reading.

        Args:
            start: brings the top there.
            resumed: how it goes on, for the event of a resumed run.
            reading_s: how long a reading takes, if it is long; its time is the middle.
        """
        if self.earlier is None:
            start()
            self.zero = self.bench.clock.now()
            self.writer.update(time_zero_utc=utc_now())
            return
        if self.earlier.replay:
            with self._replay():
                start()
            self.zero = self.bench.clock.now()
            self.wait(self.rows[-1]["time_s"] + reading_s / 2)
        else:
            self.zero = self.bench.clock.now() - self.earlier.run.elapsed()
        self.began = self.now()
        count = len(self.rows)
        called = self.called + "s" * (count != 1)
        self.event(
            RunEvent.RESUMED,
            Text("resumed after {count} {called}, {resumed}", count=count, called=called, resumed=resumed),
        )

    @contextlib.contextmanager
    def _replay(self) -> Iterator[None]:
        self._replaying = True
        try:
            yield
        finally:
            self._replaying = False

    def readings_every(self, interval_s: float, longest_s: float) -> Iterator[float]:
        """Wait for each multiple of the interval after time zero, and yield the time at which it came [s].

        Ends after longest_s.  What passes while a lost instrument is reached again is left out, not caught up with.
        """
        k = int(self.now() // interval_s) + 1 if self.rows else 0
        while True:
            self.wait(k * interval_s - self.now())
            self.last_request_time, self._lost = self.now(), False
            yield self.last_request_time
            k = max(k + 1, math.ceil(self.now() / interval_s)) if self._lost else k + 1
            if self.now() > longest_s:
                name = self.writer.record.experiment
                self.event(
                    RunEvent.LONGEST,
                    Text("{longest:g} s are over ({experiment:s}.longest_s)", longest=longest_s, experiment=name),
                )
                return

    # --- display and record ---

    def event(self, kind: RunEvent, text: str, **data: Any) -> None:
        """Record and show an event; `time_s` among the data is its time where that is not now [s]."""
        if not self._replaying:
            self._write_event(kind, text, **data)
            self.doing.text = text
            self.show.message(text)
            self.look()

    def _write_event(self, kind: RunEvent, text: str, **data: Any) -> None:
        now = None if self.zero is None else self.now()
        self.writer.event(data.pop("time_s", now), kind, text, **data)

    def warn(self, text: str, **values: object) -> None:
        """Record and show a warning about the readings, with values in it; every result of the run repeats it."""
        self.event(RunEvent.WARNING, Text(text, **values) if values else text)

    def progress(self, text: str, share: float) -> None:
        """Show how far the bench is on the way to the first reading.

        Args:
            text: its present work.
            share: of the way, from 0 to 1.
        """
        if not self._replaying:
            self.doing.text, self.doing.share = text, share
            self.show.preparing(text, share)
            self.look()

    def saw(self, channel: str, value: float | None) -> None:
        """Note an instrument's answer, whether or not it becomes part of a reading; None: nothing to count.

        Args:
            channel: as in readings.csv.
            value: in the unit of the channel.
        """
        if value is None:
            self.doing.seen.pop(channel, None)
        else:
            self.doing.seen[channel] = value
        if channel == "spin_frequency_hz":
            self.doing.count = last_count(self.bench, value)

    def ask(self, task: Task) -> str:
        """Let the person at the bench do or answer something.  Both stand in the events.

        Returns the answer, empty where nothing but Enter was typed or no person is at the bench.  The first Ctrl-C
        ends the wait.
        """
        self._write_event(RunEvent.ASKED_THE_PERSON, task.text)
        with self.stop.at_once():
            answer = self.person(task).strip()
        if answer:
            self._write_event(RunEvent.ANSWERED, answer)
        return answer

    def keep(self, row: Row, time_left_s: float | tuple[float, float]) -> None:
        """Write a reading to the disk, then show it.

        Args:
            row: the reading.
            time_left_s: expected until the end, or how much at least and at most.

        Raises:
            ExperimentFailed: its time does not come after the last one's.
        """
        if self.rows and not row["time_s"] > self.rows[-1]["time_s"]:
            raise ExperimentFailed(
                "the clock went back: {now} s after {before} s", now=row["time_s"], before=self.rows[-1]["time_s"]
            )
        self.writer.reading(row)
        self.rows.append(row)
        self._losses = 0
        self.doing.seen |= row
        self.doing.text, self.doing.share = "", None
        least, most = time_left_s if isinstance(time_left_s, tuple) else (time_left_s, time_left_s)
        now = self.bench.clock.now()
        self.doing.end = now + least, now + most
        if not self._headed:
            self._headed = True
            self.show.message("  ".join(f"{_head(one):>{_width(one)}}" for one in self._shown))
        self.show.reading(Text("{values:n}", values=self._format_values(row)), row["time_s"], (least, most))
        self.look()

    def keep_trace(self, input_: int, channel: str, time_s: float) -> Trace:
        """Fetch a record from the oscilloscope and write it down, raw, while it comes.

        What has come when the link breaks is kept as a record that is shorter than announced.

        Args:
            input_: of the oscilloscope.
            channel: the quantity that it shows.
            time_s: when the record was taken.

        Raises:
            InstrumentError: as the driver's `trace`.
        """

        def arrived(part: Trace, points: int) -> None:
            self.writer.arriving(time_s, part, channel, points)

        try:
            trace = self.bench.oscilloscope.trace(input_, arrived)
        except SettingsLost:
            self.writer.forget_what_arrived()
            raise
        except InstrumentError:
            if cut_short := self.writer.keep_what_arrived():
                self.event(RunEvent.CUT_SHORT, cut_short)
            raise
        number = self.writer.trace(time_s, trace, channel)
        self.doing.records[channel] = number, time_s + (self.zero or 0.0), trace
        return trace

    def _format_values(self, row: Row) -> str:
        """Return the values of a reading as they stand in a line, below their heads."""
        texts = (_with_unit(row[one.name], one) if one.name in row else "" for one in self._shown)
        return "  ".join(f"{text:>{_width(one)}}" for text, one in zip(texts, self._shown, strict=True))

    @property
    def _shown(self) -> tuple[Channel, ...]:
        """The channels that stand in a line; uncertainties do not."""
        return tuple(channel for channel in self.channels if "_u_" not in channel.name)

    # --- instruments that lose their link, or their settings ---

    def check_settings(self, kind: str) -> None:
        """Raise SettingsLost where an instrument no longer has the settings that it was given."""
        if changed := self.bench.changed_settings(kind):
            raise SettingsLost(self.bench.address(kind), changed)

    def reconnect(self, kind: str, error: InstrumentError, set_up: Callable[[], None]) -> None:
        """Reach an instrument that failed in the middle of a run again and set it up, or give up; see `insist`.

        Raises the error that began it after the last of the tries in REOPENING_S, or where it is lost again and again.
        """
        self._losses, self._lost = self._losses + 1, True
        self.doing.lost.add(kind)
        self.event(RunEvent.INSTRUMENT_LOST, Text("{kind}: {why}", kind=kind, why=error))
        if self._losses > MOST_LOSSES:
            raise error
        for tries, pause in enumerate(REOPENING_S, 1):
            self.wait(pause)
            try:
                self.bench.reopen(kind)
                set_up()
            except InstrumentError as again:
                self.event(
                    RunEvent.NOT_REACHED,
                    Text("{kind}, try {tries} of {most}: {why}", kind, tries, len(REOPENING_S), again),
                )
            else:
                self.doing.lost.discard(kind)
                self.event(RunEvent.FOUND_AGAIN, Text("{kind} answers again and is set up as before", kind=kind))
                return
        raise error

    def insist(self, kind: str, attempt: Callable[[], T], set_up: Callable[[], None]) -> T:
        """Return the result of an attempt; repeat it where the instrument fails and is reached again."""
        while True:
            try:
                return attempt()
            except InstrumentError as error:
                self.reconnect(kind, error, set_up)


# --- the line of a reading ---


def _head(channel: Channel) -> str:
    """Return the heading of a channel's values: its name without the unit, which stands beside each value."""
    name = channel.name.removesuffix(f"_{channel.unit.lower()}")
    return in_language(name.removesuffix("_frequency").replace("_", " "))


def _width(channel: Channel) -> int:
    """Return the width of a channel's values with their unit, and of its heading."""
    width = 10 if channel.unit == "s" else 12 if channel.unit == "Hz" else 12 + len(channel.unit)
    return max(width, len(_head(channel)))


def _with_unit(value: float, channel: Channel) -> str:
    decimals = unit(channel.unit).decimals  # with these, points stand below each other
    return f"{value:{'.6g' if decimals is None else f'.{decimals}f'}} {channel.unit}".rstrip()
