"""What the virtual oscilloscopes have in common: sampling, scaling to codes, the trigger, the record.

A record keeps the time of its trigger and the settings it was taken with, not its samples: whoever reads a piece of it
samples the signal for that piece again.  So 24 million points need the memory of one piece, and the signals must be
functions of time.

What is simpler than in the instrument, and said here once: alternating coupling takes the mean of the second around the
arming away and does not droop; trigger coupling, noise rejection, holdoff, bandwidth limit and averaging are settings
without an effect on the samples; the trigger looks at a signal at 20 kHz, for its first hundred thousand looks faster
if the record is short, and then finds the crossing to a small part of a sample.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.virtual.device import Clock, Value, VirtualInstrument, answers
from instruments.virtual.scope_measure import Measured, edges, measure
from instruments.virtual.scpi import (
    Command,
    ScpiError,
    at_most_one,
    choice,
    limit,
    number,
    one,
)

#: The voltage at an input: (start [s], step [s], n) → shape (n,) [V].
Signal = Callable[[float, float, int], NDArray[np.float64]]
Codes = NDArray[np.uint8]

#: Samples taken from a signal at once, and at which places a record is cut into pieces: a multiple of what one block
#: of the DS1000Z holds, so that reading block by block samples every point once.
PIECE = 250_000
#: The coarsest look of the trigger at the signal [s]: a pulse of 3 % of a turn at 60 Hz lasts 0.5 ms.
_COARSEST = 50e-6
#: So many looks are as fine as the record wants; a signal too fast for the coarse ones has triggered by then.
_FINE_LOOKS = 100_000
#: Below the level by this part of a division the trigger is armed again.
_HYSTERESIS = 0.3
#: With sweep AUTO a record is taken without a trigger after this time [s] (assumed; no source at hand).
AUTO_AFTER = 0.05
#: How far a question may look ahead for a trigger; later than this is never [s].
LOOK_AHEAD = 60.0
#: What would end a string or a message.
_NOT_IN_LABELS = dict.fromkeys(map(ord, "\"';\n"))
#: How far back a running scope looks for the last record it may have taken [s].
LOOK_BACK = 600.0
#: Between two records of a running scope [s] (assumed).
_DEAD_TIME = 1e-3


def _open_input(_start: float, _step: float, n: int) -> NDArray[np.float64]:
    return np.zeros(n)


@dataclass(frozen=True)
class Input:
    """One channel as it was set when the scope was armed.

    factor: of the probe, negative if inverted; mean: what the coupling takes away [V]; volts_per_code: of the
    converter; zero: the code of 0 V; lowest, highest: the codes of a clipped trace.
    """

    signal: Signal
    factor: float
    mean: float
    volts_per_code: float
    zero: int
    lowest: int
    highest: int

    def volts(self, start: float, step: float, n: int) -> NDArray[np.float64]:
        """What the scope takes the voltage at the probe's tip for."""
        return self.factor * (self.signal(start, step, n) - self.mean)

    def codes(self, start: float, step: float, n: int) -> Codes:
        """The same as the converter gives it."""
        codes = np.rint(self.volts(start, step, n) / self.volts_per_code) + self.zero
        return np.asarray(np.clip(codes, self.lowest, self.highest), dtype=np.uint8)


@dataclass(frozen=True, eq=False)
class Record:
    """One acquisition.

    trigger: when it was triggered [s]; forced: without an edge; rate: samples per second; points: in memory;
    origin: of the first sample, counted from the trigger [s]; done: when the last sample was taken [s];
    screen: where the screen begins [s from the trigger] and how long it is [s].
    """

    trigger: float
    forced: bool
    rate: float
    points: int
    origin: float
    screen: tuple[float, float]
    inputs: Mapping[int, Input]
    _kept: dict[tuple[int, int, float], tuple[int, Codes]] = field(default_factory=dict)

    @property
    def done(self) -> float:
        """When the last sample was taken [s]."""
        return self.trigger + self.origin + self.points / self.rate

    def codes(self, channel: int, first: int, count: int, *, of: int, start: float, step: float) -> Codes:
        """Codes first … first + count − 1 of those that begin at start [s from the trigger], a step apart [s].

        of: how many there are.
        """
        pieces = range(first // PIECE, -(-(first + count) // PIECE))
        whole = [self._piece(channel, k, of, start, step) for k in pieces]
        offset = first - pieces.start * PIECE if pieces else 0
        return (whole[0] if len(whole) == 1 else np.concatenate([np.empty(0, np.uint8), *whole]))[
            offset : offset + count
        ]

    def _piece(self, channel: int, k: int, of: int, start: float, step: float) -> Codes:
        """Cut at fixed places, so that noise of a seeded signal is the same whichever way a record is read."""
        key = (channel, of, step)
        kept = self._kept.get(key)
        if kept is None or kept[0] != k:
            begin = self.trigger + start + k * PIECE * step
            kept = (k, self.inputs[channel].codes(begin, step, min(PIECE, of - k * PIECE)))
            self._kept.clear()
            self._kept[key] = kept
        return kept[1]


@dataclass
class Edge:
    """Looks for the first edge in a signal, and goes on where it was when it looks again.

    slopes: 1.0 rising, −1.0 falling; step: between looks, fine: how well the crossing is to be placed [s].
    """

    volts: Signal
    level: float
    hysteresis: float
    slopes: tuple[float, ...]
    step: float
    fine: float
    position: float
    _armed: list[bool] = field(default_factory=list)
    _looks: int = 0

    def until(self, stop: float) -> float | None:
        """When the first edge is, if it is before stop [s]."""
        self._armed = self._armed or [False] * len(self.slopes)
        while self.position < stop:
            n = min(_FINE_LOOKS, math.ceil((stop - self.position) / self.step) + 1)
            volts, before = self.volts(self.position, self.step, n), list(self._armed)
            looks = ((self._first(k, slope * volts, slope), slope) for k, slope in enumerate(self.slopes))
            found = [(i, slope) for i, slope in looks if i is not None]
            if found:
                i, slope = min(found)
                at = self._placed(self.position + (i - 1) * self.step, self.step, slope)
                self._armed = before  # the last look may lie behind the stop: such an edge is found again
                return at if at < stop else None
            self.position += (n - 1) * self.step
            self._looks += n
            if self._looks >= _FINE_LOOKS:
                self.step = max(self.step, _COARSEST)
        return None

    def _first(self, k: int, volts: NDArray[np.float64], slope: float) -> int | None:
        """The first sample at or above the level after one below it less the hysteresis."""
        level = slope * self.level
        begin = 0
        if not self._armed[k]:
            below = volts < level - self.hysteresis
            begin = int(np.argmax(below))
            if not below[begin]:
                return None
        above = volts[begin:] >= level
        i = int(np.argmax(above))
        if above[i]:
            return begin + i
        self._armed[k] = True
        return None

    def _placed(self, start: float, step: float, slope: float) -> float:
        """The crossing between two looks, looked at ever closer."""
        while step > self.fine:
            step /= 1000
            volts = self.volts(start, step, 1001)
            above = slope * volts >= slope * self.level
            turns = np.flatnonzero(above[1:] != above[:-1])
            # an edge that only the coarse look saw stands, but for the rounding of its time, at that look
            start += step * (int(turns[0]) if turns.size else 999)
        before, after = self.volts(start, step, 2)
        part = (self.level - before) / (after - before) if after != before else 0.5
        return start + step * float(min(max(part, 0.0), 1.0))


class VirtualOscilloscope(VirtualInstrument):
    """A digital oscilloscope of eight bits; a subclass gives the commands and how codes and records are scaled.

    signals: the voltage at each input, by channel; an input without one is open, 0 V.
    """

    #: Divisions of the screen from left to right; codes of a division; what a code cannot go beyond.
    columns: ClassVar[int]
    lowest: ClassVar[int]
    highest: ClassVar[int] = 255
    #: Bytes per second of a long answer (assumed), and how the words of the trigger slope are meant.
    transfer: ClassVar[float] = 1e6
    SLOPES: ClassVar[dict[str, tuple[float, ...]]] = {
        "POS": (1.0,),
        "NEG": (-1.0,),
        "RFAL": (1.0, -1.0),
        "EITH": (1.0, -1.0),
        "ALT": (1.0, -1.0),
    }
    #: Whether the old record can be read until a single one is complete.
    keeps_old: ClassVar[bool] = False
    #: What a measurement is answered with that the trace does not show.
    no_measurement: ClassVar[float] = 9.9e37

    def __init__(
        self, clock: Clock, *, signals: Mapping[int, Signal], channels: int = 4, identity: str | None = None
    ) -> None:
        self.channels = range(1, channels + 1)
        self._signals = signals
        self.identity = identity or self.identity
        self._headers: dict[str, str] = {}
        self._record: Record | None = None
        self._armed: float | None = None
        self._edge: Edge | None = None
        self._once = False
        self._forced = math.inf
        self._blocked = False
        self._restoring = False
        self.triggered = False
        super().__init__(clock)
        self.run()

    # --- rows of the table ---

    def spell(self, value: float) -> str:
        """A number as this maker prints it."""
        raise NotImplementedError

    def quantity(
        self,
        pattern: str,
        name: str,
        default: float,
        *,
        unit: str = "",
        limits: Callable[[], tuple[float, float]],
        rounded: Callable[[float], float] = lambda value: value,
        spell: Callable[[float], str] | None = None,
    ) -> Command:
        """A row for a number whose limits depend on other settings.  rounded: to what the instrument can do."""
        self._defaults[name] = default
        self._remember(pattern, name)

        def set_(parameters: list[str]) -> None:
            if len(parameters) > 2:  # a second one, as the source of a level, changes nothing here
                raise ScpiError(-108)
            low, high = limits()
            value = number(one(parameters[:1]), low=low, high=high, default=default, unit=unit)
            before, self.settings[name] = self.settings[name], rounded(value)
            self.adjusted(name, float(before))

        def ask(parameters: list[str]) -> str:
            asked = at_most_one(parameters[:1])
            low, high = limits()
            bound = asked.upper() in {"MIN", "MAX", "DEF", "MINIMUM", "MAXIMUM", "DEFAULT"}
            value = limit(asked, low=low, high=high, default=default) if bound else float(self.settings[name])
            return (spell or self.spell)(value)

        return Command(pattern, set_, ask)

    def word(self, pattern: str, name: str, words: tuple[str, ...], default: str) -> Command:
        """A row for one word of several, as everywhere; it is part of the setup."""
        self._remember(pattern, name)
        return super().word(pattern, name, words, default)

    def switch(self, pattern: str, name: str, *, default: bool = False) -> Command:
        """A row for ON or OFF, as everywhere; it is part of the setup."""
        self._remember(pattern, name)
        return super().switch(pattern, name, default=default)

    def text(self, pattern: str, name: str, default: str, *, longest: int) -> Command:
        """A row for a string in quotes, cut to its greatest length, in capitals."""
        self._defaults[name] = default
        self._remember(pattern, name)

        def set_(parameters: list[str]) -> None:
            given = one(parameters)
            if len(given) < 2 or given[0] not in "\"'" or given[-1] != given[0]:
                raise ScpiError(-104)
            self.settings[name] = given[1:-1].translate(_NOT_IN_LABELS)[:longest].upper()

        return Command(pattern, set_, answers(lambda: f'"{self.settings[name]}"'))

    def _remember(self, pattern: str, name: str) -> None:
        short = re.sub(r"\[[^\]]*\]", "", pattern)
        self._headers[name] = ":" + re.sub("[a-z]", "", short)

    def changed(self, name: str) -> None:
        """A setting has changed: what runs begins anew."""
        self.adjusted(name, 0.0)

    def adjusted(self, name: str, before: float) -> None:
        """A number has changed from what it was before."""
        if name.endswith("_probe") and before:
            self._follow_probe(name.removesuffix("_probe"), float(self.settings[name]) / before)
        if not name.startswith("wav") and self._armed is not None and not self._blocked:
            self._arm(once=self._once)

    def _follow_probe(self, channel: str, ratio: float) -> None:
        """With another probe the same volts at the input are other volts at its tip: scale and offset go with it."""
        for what in ("scale", "offset"):
            self.settings[f"{channel}_{what}"] = ratio * float(self.settings[f"{channel}_{what}"])
        if self.settings["trigger_source"] == channel.upper():
            self.settings["trigger_level"] = ratio * float(self.settings["trigger_level"])

    def value(self, name: str) -> float:
        """A setting that is a number."""
        return float(self.settings[name])

    def channel_of(self, text: str) -> int:
        """The channel of ``CHAN1`` or ``CHANnel1``.  Raises ScpiError."""
        words = tuple(f"CHANnel{n}" for n in self.channels)
        return int(choice(text, words)[4:])

    def shown(self) -> list[int]:
        """The channels that are on."""
        return [n for n in self.channels if self.settings[f"chan{n}_display"]]

    # --- what a subclass says of its scaling ---

    def full_scale(self) -> tuple[float, int]:
        """Samples per second and points of the record that would be taken now."""
        raise NotImplementedError

    def screen(self) -> tuple[float, float]:
        """Where the screen begins [s from the trigger] and how long it is [s]."""
        raise NotImplementedError

    def scaling(self, channel: int) -> tuple[float, int]:
        """Volts per code and the code of 0 V, which may lie beyond the converter."""
        raise NotImplementedError

    def division(self, channel: int) -> float:
        """Volts per division."""
        return self.value(f"chan{channel}_scale")

    # --- acquiring ---

    @property
    def now(self) -> float:
        """When the message under way is worked on [s]."""
        now = self.clock.now()
        return max(self._ready, now) if math.isfinite(self._ready) else now

    def _input(self, channel: int, start: float) -> Input:
        signal = self._signals.get(channel, _open_input)
        coupling = self.settings[f"chan{channel}_coupling"]
        if coupling == "GND":
            signal = _open_input
        mean = 0.0
        if coupling == "AC":
            begin = max(0.0, start - 0.5)
            mean = float(np.mean(signal(begin, _COARSEST, round(1 / _COARSEST))))
        factor = self.value(f"chan{channel}_probe") * (-1.0 if self.settings[f"chan{channel}_invert"] else 1.0)
        volts_per_code, zero = self.scaling(channel)
        return Input(signal, factor, mean, volts_per_code, zero, self.lowest, self.highest)

    def run(self) -> None:
        """Begin to acquire, over and over."""
        self._arm(once=False)

    def single(self) -> None:
        """Begin to acquire one record."""
        old = self._record if self.keeps_old else None
        self._arm(once=True)
        self._record = old

    def _arm(self, *, once: bool) -> None:
        self._record, self._armed, self._once = None, self.now, once
        self._edge, self._forced = None, math.inf
        self._next = self._template(self.now)

    def _template(self, armed: float) -> Record:
        """What the next record will be, but for its trigger."""
        rate, points = self.full_scale()
        start, length = self.screen()
        # a record longer than the screen goes beyond it by as much on both sides
        origin = start - (points / rate - length) / 2
        inputs = {n: self._input(n, armed) for n in self.channels}
        return Record(
            trigger=armed,
            forced=False,
            rate=rate,
            points=points,
            origin=origin,
            screen=(start, length),
            inputs=inputs,
        )

    def _searching(self, start: float) -> Edge | None:
        """A look-out for the trigger from this time on, or None if the source is one that never comes."""
        source = str(self.settings["trigger_source"])
        if not source.startswith("CHAN"):
            return None
        channel = int(source[4:])
        step = max(min(_COARSEST, self._next.points / self._next.rate / 1000), 1 / self._next.rate)
        return Edge(
            volts=self._next.inputs[channel].volts,
            level=self.value("trigger_level"),
            hysteresis=_HYSTERESIS * self.division(channel),
            slopes=self.SLOPES[str(self.settings["trigger_slope"])],
            step=step,
            fine=0.01 / self._next.rate,
            position=start,
        )

    @property
    def filled(self) -> float:
        """When the part of the record before the trigger is filled: no trigger is taken earlier [s]."""
        return (self._armed or 0.0) + max(0.0, -self._next.origin)

    def _taken(self, trigger: float, *, forced: bool) -> Record:
        return replace(self._next, trigger=trigger, forced=forced, _kept={})

    def _first_record(self, until: float) -> Record | None:
        """The record for which the scope is armed, if its trigger comes before that time [s]."""
        if self._edge is None:
            self._edge = self._searching(self.filled)
        automatic = self.filled + AUTO_AFTER if self.settings["trigger_sweep"] == "AUTO" else math.inf
        automatic = min(automatic, self._forced)
        edge = self._edge.until(min(until, automatic)) if self._edge else None
        if edge is not None:
            return self._taken(edge, forced=False)
        return self._taken(automatic, forced=True) if automatic <= until else None

    def follow(self) -> None:
        """Let what has happened up to now have happened."""
        if self._armed is None or self._blocked:
            return
        if self._once:
            self._settle(self._first_record(self.now))
            return
        # a scope that runs shows a late record; which of them is the chance of its dead times
        armed, reach = self._armed, 2 * self._next.points / self._next.rate + 2 * AUTO_AFTER
        while True:
            recent = max(armed, self.now - min(reach, LOOK_BACK))
            if recent > armed:
                self._armed, self._edge = recent, None
            record = self._first_record(self.now)
            if self._settle(record):
                return
            if recent == armed or reach >= LOOK_BACK:
                if record is None:  # nothing up to now: the next look begins here
                    self._armed, self._edge = max(armed, self.now + min(0.0, self._next.origin)), None
                return
            self._armed, self._edge, reach = armed, None, 4 * reach

    def _settle(self, record: Record | None) -> bool:
        """Take this record over if it is complete by now."""
        if record is None or record.done > self.now:
            return False
        self._record = record
        self.triggered = True
        if self._once:
            self._armed = None
        else:
            self._armed, self._edge, self._forced = record.done + _DEAD_TIME, None, math.inf
        return True

    def stop(self) -> None:
        """Acquire no more; a scope that ran on its own keeps what it has just seen."""
        self.follow()
        if self._armed is not None and self._record is None and self.settings["trigger_sweep"] == "AUTO":
            length = self._next.points / self._next.rate
            trigger = max(self.now - length, 0.0) - self._next.origin
            self._record = self._taken(trigger, forced=True)
        self._armed = None

    def force(self) -> None:
        """Take the record for which the scope is armed without waiting for an edge."""
        if self.running():
            self._forced = max(self.now, self.filled)

    def digitize(self) -> None:
        """Acquire one record; what comes next has to wait for it, for ever if there is no trigger."""
        self.single()
        record = self._first_record(self.now + LOOK_AHEAD)
        if record is None:
            self._blocked = True
            self.busy_until(math.inf)
            return
        self.busy_until(record.done)
        self._settle(record)

    def abandon(self) -> None:
        """A device clear: what is under way is given up, an acquisition that blocks included."""
        super().abandon()
        if self._blocked:
            self._blocked, self._armed = False, None

    def trigger(self) -> None:
        """``*TRG``."""
        self.force()

    def record(self) -> Record:
        """The latest record; the answer waits for it if one is under way.  Raises ScpiError if there is none."""
        self.follow()
        if self._record is None and self._armed is not None and not self._once and not self._blocked:
            under_way = self._first_record(self.now + LOOK_AHEAD)
            if under_way is not None:
                self.busy_until(under_way.done)
                self._settle(under_way)
        if self._record is None:
            raise ScpiError(-230)
        return self._record

    def running(self) -> bool:
        """Whether the scope acquires or waits for a trigger."""
        self.follow()
        return self._armed is not None

    # --- what it tells ---

    def block(self, data: bytes, *, digits: int) -> str:
        """A definite-length block as text, and the time that it takes."""
        self.busy_until(self._ready + len(data) / self.transfer)
        return f"#{digits}{len(data):0{digits}d}" + data.decode("latin-1")

    def on_screen(self, channel: int, points: int = 50_000) -> Measured:
        """The trace on the screen, from its codes.  Raises ScpiError if there is none."""
        record = self.record()
        start, length = record.screen
        points = max(2, min(points, round(length * record.rate)))
        step = length / points
        codes = record.codes(channel, 0, points, of=points, start=start, step=step)
        scale = record.inputs[channel]
        return Measured((codes.astype(np.float64) - scale.zero) * scale.volts_per_code, step, start)

    def measured(self, name: str, channel: int) -> float:
        """A measurement on the screen, or what stands for none."""
        value = measure(name, self.on_screen(channel))
        return self.no_measurement if value is None else value

    def heights(self) -> dict[int, NDArray[np.float64]]:
        """For the picture: each shown trace, 800 columns from the lower edge of the screen, 0, to the upper, 1."""
        record = self.record()
        heights: dict[int, NDArray[np.float64]] = {}
        start, length = record.screen
        for n in self.shown():
            codes = record.codes(n, 0, 800, of=800, start=start, step=length / 800)
            middle, span = self.window(n)
            heights[n] = 0.5 + (codes.astype(np.float64) - middle) / span
        return heights

    def window(self, channel: int) -> tuple[float, float]:
        """The code in the middle of the screen, and how many codes it is high."""
        raise NotImplementedError

    def autoscale(self) -> None:
        """Scale, offset, time base and level to fit what stands at the inputs."""
        for n in self.channels:
            signal, factor = self._signals.get(n, _open_input), self.value(f"chan{n}_probe")
            volts = factor * signal(max(0.0, self.now - 0.5), _COARSEST, round(0.5 / _COARSEST))
            low, high = float(volts.min()), float(volts.max())
            if high - low < 0.02 * factor:
                continue
            self.settings |= {f"chan{n}_display": True, f"chan{n}_coupling": "DC"}
            self.fit(n, (low + high) / 2, one_two_five((high - low) / 6, up=True))
            found = edges(volts, (low + high) / 2, 0.1 * (high - low))
            if found.size > 1:
                period = float(np.diff(found).mean()) * _COARSEST
                self.settings["time_scale"] = one_two_five(3 * period / self.columns, up=True)
            self.settings |= {"trigger_source": f"CHAN{n}", "trigger_level": (low + high) / 2, "trigger_slope": "POS"}
            break
        self.settings |= {"time_offset": 0.0, "trigger_sweep": "AUTO"}
        self.run()

    def fit(self, channel: int, middle: float, division: float) -> None:
        """Show this voltage in the middle of the screen, with so many volts per division."""
        raise NotImplementedError

    # --- the setup as a whole ---

    def setup(self) -> bytes:
        """All settings, as messages that restore them."""
        return "\n".join(f"{header} {self._spelled(name)}" for name, header in self._headers.items()).encode("latin-1")

    def _spelled(self, name: str) -> str:
        value: Value = self.settings[name]
        if isinstance(value, bool):
            return str(int(value))
        if isinstance(value, float):
            return f"{value:.15G}"
        return f'"{value}"' if name.endswith("_label") else value

    def restore(self, setup: str) -> None:
        """Settings from messages; a setup that is none leaves what it had already set.  Raises ScpiError."""
        if self._restoring:
            raise ScpiError(-224)
        known = set(self._headers.values())
        self._restoring = True
        try:
            for line in setup.split("\n"):
                header = line.partition(" ")[0]
                if header not in known:
                    raise ScpiError(-224)
                self.parser.run(line.partition(";")[0])
        finally:
            self._restoring = False

    def presets(self) -> tuple[Command, ...]:
        """Setups as blocks and in ten places."""
        kept: dict[int, str] = {}

        def place(parameters: list[str]) -> int:
            return int(number(one(parameters), low=0, high=9, default=0))

        def keep(parameters: list[str]) -> None:
            kept[place(parameters)] = self.setup().decode("latin-1")

        def recall(parameters: list[str]) -> None:
            where = place(parameters)
            if where in kept:
                self.restore(kept[where])

        return (Command("*SAV", set=keep), Command("*RCL", set=recall))

    def reset(self) -> None:
        """The state after ``*RST``: it runs."""
        self._blocked = False
        super().reset()
        self.run()


def block_content(text: str) -> str:
    """The content of a definite-length block that was sent as a parameter.  Raises ScpiError."""
    if len(text) < 2 or text[0] != "#" or not "1" <= text[1] <= "9":
        raise ScpiError(-104)
    begin = 2 + int(text[1])
    digits = text[2:begin]
    if not digits.isascii() or not digits.isdigit() or len(text) - begin != int(digits):
        raise ScpiError(-104)
    return text[begin:]


def one_two_five(value: float, *, up: bool = False) -> float:
    """The number of the series 1, 2, 5, 10 … nearest to a positive one, or the next that is not less.

    >>> one_two_five(3e-3), one_two_five(4e-3), one_two_five(2.1, up=True), one_two_five(0.2, up=True)
    (0.002, 0.005, 5.0, 0.2)
    """
    decade = math.floor(math.log10(value))
    series = [float(f"{m}e{decade}") for m in (1, 2, 5, 10, 20)]
    if up:
        return next(s for s in series if s >= value * (1 - 1e-9))
    return min(series, key=lambda s: abs(s - value))
