"""Oscilloscopes: a trace with time base, scaling and trigger, whatever the model.

Facts and their sources stand with each driver.
"""

from __future__ import annotations

import math
import re
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol, cast

import numpy as np

from instruments.errors import BadAnswer, InstrumentError, NoAnswer, OutOfRange
from instruments.scpi import ScpiInstrument, Setting

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from instruments.transport import Transport

#: Between two questions whether the record is complete [s].
_POLL = 0.02
#: Beyond the transport's time-out, a block may take this long on its way [s]; 1 MB over a slow link.
_BLOCK_PATIENCE = 10.0
#: No scope of these families has a longer record; a preamble that says so was misheard.
_MOST_POINTS = 100_000_000


class Clock(Protocol):
    """The time that passes while a trigger is waited for: the wall's, or the bench's own."""

    def now(self) -> float:
        """The time [s]."""

    def sleep(self, duration: float) -> None:
        """Let time pass [s]."""


class _Wall:
    """The wall clock."""

    def now(self) -> float:
        return time.monotonic()

    def sleep(self, duration: float) -> None:
        time.sleep(duration)


class NeverTriggered(InstrumentError):
    """No trigger came in time.  level_v: its level [V]; source: its channel; waited_s: for how long [s]."""

    def __init__(self, address: str, *, level_v: float, source: str, waited_s: float) -> None:
        self.level_v, self.source, self.waited_s = level_v, source, waited_s
        super().__init__(
            address,
            f"no trigger at {level_v:g} V on {source} within {waited_s:g} s: is the signal there, does it cross this "
            'level, is the probe factor 1 and the coupling DC?  Look at it with sweep="auto", which needs no trigger',
        )


class NothingAcquired(InstrumentError):
    """A trace was asked for, but none was taken since the scope was prepared: what it holds would be an old one."""

    def __init__(self, address: str) -> None:
        super().__init__(address, "nothing was acquired since the last preparation or failure: call acquire() first")


@dataclass(frozen=True, eq=False)
class Trace:
    """One channel's record.

    codes: of the converter, shape (n,), uint8 or uint16; dt_s: between samples [s]; t0_s: of the first one, counted
    from the trigger [s]; volts_per_code, offset_v: what a code means [V]; channel: which input.
    """

    codes: NDArray[np.uint8] | NDArray[np.uint16]
    dt_s: float
    t0_s: float
    volts_per_code: float
    offset_v: float
    channel: int

    @property
    def volts(self) -> NDArray[np.float64]:
        """The voltage at each sample, shape (n,) [V]: eight bytes per sample."""
        return self.codes.astype(np.float64) * self.volts_per_code + self.offset_v


@dataclass(frozen=True)
class Preamble:
    """How to read a record.  points: how many; the rest as in :class:`Trace`."""

    points: int
    dt_s: float
    t0_s: float
    volts_per_code: float
    offset_v: float

    @property
    def plausible(self) -> bool:
        """Whether a scope can have such a record."""
        numbers = (self.dt_s, self.t0_s, self.volts_per_code, self.offset_v)
        return 1 <= self.points <= _MOST_POINTS and self.dt_s > 0 and all(map(math.isfinite, numbers))


class Oscilloscope(Protocol):
    """What every oscilloscope offers."""

    def identity(self) -> str:
        """Maker, model, serial number, firmware."""

    def settings(self) -> dict[str, bool | float | str]:
        """Its settings as they stand."""

    def prepare(
        self,
        *,
        channels: Sequence[int] = (1,),
        duration_s: float,
        points: int,
        volts_per_division: float,
        offset_v: float = 0.0,
        coupling: str = "DC",
        trigger_level_v: float,
        trigger_slope: str = "rising",
        trigger_source: int = 1,
        sweep: str = "normal",
    ) -> None:
        """Set the scope up; the trigger is in the middle of the record.

        channels: which are recorded, all with the same scaling, input 1 MΩ, probe 1:1;
        duration_s: the record is at least as long [s]; points: it has at least so many if the converter is fast enough
        and the memory large enough; volts_per_division: of eight [V]; offset_v: voltage in the middle of the screen;
        coupling: DC or AC; trigger_level_v: [V]; trigger_slope: rising, falling or either; trigger_source: a channel;
        sweep: normal or single wait for the trigger, auto takes a record without one if it does not come.
        Raises OutOfRange before anything is sent that the scope does not have, CommandRefused.
        """

    def acquire(self, *, timeout_s: float) -> None:
        """Take one record.  timeout_s: how long the trigger is waited for [s].  Raises NeverTriggered."""

    def trace(self, channel: int) -> Trace:
        """The record of one channel, whole: one byte per point.  Raises NothingAcquired."""

    def blocks(self, channel: int) -> Iterator[NDArray[np.uint8]]:
        """The codes of the same record, piece by piece as they come: never more than one piece in memory."""

    def off(self) -> None:
        """Acquire no more."""

    def close(self) -> None:
        """Give the instrument back."""


_SLOPES = {"rising": "POS", "falling": "NEG"}


class _Channel(ScpiInstrument):
    """The settings of one input: headers that begin with its name."""

    def __init__(self, scope: ScpiInstrument, number: int) -> None:
        super().__init__(scope.transport)
        self.scope, self.number = scope, number
        self.head = f"CHAN{number}:"
        # only its question is used here: commands go through the scope, which reads its error queue
        self.transport = cast("Transport", _Headed(scope.transport, self.head))

    def command(self, message: str) -> None:
        """Send a command of this input."""
        self.scope.command(self.head + message)


class _Headed:
    """A transport for questions that begin with the same header, and for what an answer that makes no sense needs."""

    def __init__(self, transport: Transport, head: str) -> None:
        self.address, self._transport, self._head = transport.address, transport, head

    def query(self, message: str, *, patience: float = 0.0) -> str:
        return self._transport.query(self._head + message, patience=patience)

    def clear(self) -> None:
        self._transport.clear()


class _Scope(ScpiInstrument):
    """What both drivers do in the same way."""

    #: Its inputs, by class; how its trigger slopes are called.
    CHANNEL: ClassVar[type[_Channel]] = _Channel
    SLOPES: ClassVar[dict[str, str]] = _SLOPES
    SWEEPS: ClassVar[dict[str, str]] = {}

    def __init__(self, transport: Transport, *, clock: Clock | None = None) -> None:
        """Drive the scope.  clock: the one its trigger is waited for with; by default the wall's."""
        super().__init__(transport)
        self._clock: Clock = clock or _Wall()
        self._acquired = False
        self._duration = 0.0
        self._channels: tuple[int, ...] = (1,)
        self._sweep = "normal"

    def identity(self) -> str:
        """The answer to ``*IDN?``; see :class:`Oscilloscope`."""
        answer = super().identity()
        model = answer.split(",")[1] if "," in answer else answer
        self._inputs = self._number_of_inputs(model)
        return answer

    _inputs: int | None = None

    @staticmethod
    def _number_of_inputs(model: str) -> int:
        """The last digit of the model's number: DS1054Z, DSO-X 1102G."""
        digits = re.findall(r"\d", model)
        return int(digits[3]) if len(digits) > 3 and digits[3] in "1248" else 4

    def settings(self) -> dict[str, bool | float | str]:
        """Every declared setting, those of the prepared channels as ``channel1_…``."""
        channels = {
            f"channel{n}_{name}": value
            for n in self._channels
            for name, value in self.CHANNEL(self, n).settings().items()
        }
        return super().settings() | channels

    def _check(self, name: str, value: object, choices: Sequence[object]) -> None:
        if value not in choices:
            raise OutOfRange(self.transport.address, name, value, "one of " + ", ".join(map(str, choices)))

    def _begin(self, *, channels: Sequence[int], coupling: str, slope: str, source: int, sweep: str) -> int:
        """What is checked before anything is sent; the number of inputs.  A new preparation ends the old record."""
        self._acquired = False
        self._check("sweep", sweep, tuple(self.SWEEPS))
        self._check("trigger_slope", slope, tuple(self.SLOPES))
        self._check("coupling", coupling, ("DC", "AC"))
        if self._inputs is None:
            self.identity()
        inputs = self._inputs or 4
        for channel in (*channels, source):
            self._check("channel", channel, range(1, inputs + 1))
        self._channels, self._sweep = tuple(channels), sweep
        return inputs

    def off(self) -> None:
        """Acquire no more; see :class:`Oscilloscope`."""
        self.forget_errors()
        self.command(":STOP")

    def acquire(self, *, timeout_s: float) -> None:
        """Take one record; see :class:`Oscilloscope`."""
        self._acquired = False
        self._start()
        deadline = self._clock.now() + self._duration + timeout_s
        while not self._complete():
            if self._clock.now() >= deadline:
                self._give_up(timeout_s)
            self._clock.sleep(_POLL)
        self._acquired = True

    def _start(self) -> None:
        raise NotImplementedError

    def _complete(self) -> bool:
        raise NotImplementedError

    def _give_up(self, waited: float) -> None:
        """Stop the scope, that it may not trigger when nobody waits for it.  Raises NeverTriggered."""
        self.command(":STOP")
        level, source = self._trigger()
        raise NeverTriggered(self.transport.address, level_v=level, source=source, waited_s=waited)

    def _trigger(self) -> tuple[float, str]:
        raise NotImplementedError

    def trace(self, channel: int) -> Trace:
        """The record of one channel; see :class:`Oscilloscope`."""
        preamble = self.preamble(channel)
        codes = np.empty(preamble.points, dtype=np.uint8)
        at = 0
        for piece in self._pieces(preamble):
            codes[at : at + piece.size] = piece
            at += piece.size
        return Trace(codes, preamble.dt_s, preamble.t0_s, preamble.volts_per_code, preamble.offset_v, channel)

    def blocks(self, channel: int) -> Iterator[NDArray[np.uint8]]:
        """The codes of one channel, piece by piece; see :class:`Oscilloscope`."""
        yield from self._pieces(self.preamble(channel))

    def preamble(self, channel: int) -> Preamble:
        """How the record of one channel is read; it is the one that is read next.  Raises NothingAcquired."""
        if not self._acquired:
            raise NothingAcquired(self.transport.address)
        self._check("channel", channel, self._channels)
        self._select(channel)
        answer = self.transport.query(":WAV:PRE?")
        fields = answer.split(",")
        try:
            numbers = [float(field) for field in fields]
            preamble = self._read_preamble(numbers)
        except (ValueError, OverflowError):
            preamble = None
        # of some nothing follows, of others no record that any of these scopes has
        if preamble is None or not preamble.plausible:
            raise BadAnswer(self.transport.address, ":WAV:PRE?", answer, "ten numbers, with points and their distance")
        return preamble

    def _select(self, channel: int) -> None:
        raise NotImplementedError

    def _read_preamble(self, numbers: list[float]) -> Preamble:
        raise NotImplementedError

    def _pieces(self, preamble: Preamble) -> Iterator[NDArray[np.uint8]]:
        raise NotImplementedError

    def _block(self, points: int) -> NDArray[np.uint8]:
        """The next block, which must hold so many codes.  Raises BadAnswer, CommandRefused."""
        self.raise_errors(":WAV:DATA?")
        try:
            block = self.transport.query_block(":WAV:DATA?", patience=_BLOCK_PATIENCE)
        except NoAnswer:
            self.raise_errors(":WAV:DATA?")  # the reason stands in the queue, if there is one
            raise
        if len(block) != points:
            raise BadAnswer(self.transport.address, ":WAV:DATA?", f"{len(block)} bytes", f"{points} bytes")
        return np.frombuffer(block, dtype=np.uint8)


class _RigolChannel(_Channel):
    """An input of a DS1000Z."""

    display = Setting("DISP", bool)
    probe_factor = Setting("PROB", float, low=0.01, high=1000.0)
    coupling = Setting("COUP", str, choices=("AC", "DC", "GND"))
    inverted = Setting("INV", bool)
    scale = Setting("SCAL", float, unit="V", low=1e-3, high=1e4)
    offset = Setting("OFFS", float, unit="V", low=-1e5, high=1e5)


class RigolDS1000Z(_Scope):
    """Rigol DS1000Z and MSO1000Z: DS1054Z, DS1104Z Plus, MSO1104Z, DS1202Z-E and others.

    Source: MSO1000Z/DS1000Z Programming Guide as public drivers quote it (ds1054z, PyMeasure's DS1000Z).

    - The screen has twelve divisions; time and volts per division go in steps of 1, 2, 5 (volts: any value).
    - The memory has 12 000 · 10ⁿ or 24 million points for one channel, half for two, a quarter for more, and can be
      read only when the scope has stopped, 250 000 bytes at a time.
    - Code 127 is the middle of the screen, 25 codes are a division; V = (code − yorigin − yreference)·yincrement.
    - ``:CHAN1:OFFS`` is added to the trace: what is in the middle of the screen is its negative.
    - Before a record is complete `:TRIG:STAT?` answers RUN, WAIT, TD or AUTO, then STOP; it may still say STOP when it
      is asked just after `:SINGle`, so STOP counts once another word was heard or a while has gone by.
    """

    MODELS: ClassVar[str] = r"(DS|MSO)1\d{3}Z.*"
    CHANNEL = _RigolChannel
    SLOPES: ClassVar[dict[str, str]] = _SLOPES | {"either": "RFAL"}
    SWEEPS: ClassVar[dict[str, str]] = {"normal": "NORM", "single": "SING", "auto": "AUTO"}

    time_scale = Setting(":TIM:SCAL", float, unit="s", low=5e-9, high=50.0)
    time_offset = Setting(":TIM:OFFS", float, unit="s", low=-300.0, high=5000.0)
    memory_depth = Setting(":ACQ:MDEP", str)
    acquisition_type = Setting(":ACQ:TYPE", str, choices=("NORM", "AVER", "PEAK", "HRES"))
    trigger_mode = Setting(":TRIG:MODE", str)
    trigger_source = Setting(":TRIG:EDGE:SOUR", str)
    trigger_slope = Setting(":TRIG:EDGE:SLOP", str, choices=("POS", "NEG", "RFAL"))
    trigger_level = Setting(":TRIG:EDGE:LEV", float, unit="V", low=-1e5, high=1e5)
    sweep = Setting(":TRIG:SWE", str, choices=("AUTO", "NORM", "SING"))

    #: Points of one block; of the memory, for one channel; how long a STOP may be an old one [s].
    _LONGEST_BLOCK = 250_000
    _DEPTHS = (12_000, 120_000, 1_200_000, 12_000_000, 24_000_000)
    _SETTLED = 0.2
    #: With sweep auto the trigger is forced after this time [s].
    _PATIENCE = 0.1

    def prepare(
        self,
        *,
        channels: Sequence[int] = (1,),
        duration_s: float,
        points: int,
        volts_per_division: float,
        offset_v: float = 0.0,
        coupling: str = "DC",
        trigger_level_v: float,
        trigger_slope: str = "rising",
        trigger_source: int = 1,
        sweep: str = "normal",
    ) -> None:
        """Set the scope up; see :class:`Oscilloscope`.

        The record has twelve divisions of 1, 2 or 5 · 10ⁿ s: up to twice and a half as long as was asked for.
        It runs meanwhile, for some firmware takes no memory depth when it has stopped.
        """
        inputs = self._begin(
            channels=channels, coupling=coupling, slope=trigger_slope, source=trigger_source, sweep=sweep
        )
        shown = sorted({*channels, trigger_source})
        scale = self._time_scale(duration_s)
        depth = self._depth(points, len(shown))
        self.forget_errors()
        self.command(":RUN")
        for n in range(1, inputs + 1):
            channel = _RigolChannel(self, n)
            channel.display = n in shown
            if n in shown:
                channel.probe_factor = 1.0
                channel.coupling = coupling
                channel.inverted = False
                channel.scale = volts_per_division
                channel.offset = -offset_v
        self.command(":TIM:MODE MAIN")
        self.time_scale = scale
        self.time_offset = 0.0
        self.acquisition_type = "NORM"
        self.memory_depth = str(depth)
        self.trigger_mode = "EDGE"
        self.trigger_source = f"CHAN{trigger_source}"
        self.trigger_slope = self.SLOPES[trigger_slope]
        self.trigger_level = trigger_level_v
        self.sweep = self.SWEEPS[sweep]
        self._duration = 12 * scale

    def _time_scale(self, duration: float) -> float:
        """The least time per division with which twelve of them are as long."""
        scales = (float(f"{m}e{k}") for k in range(-9, 2) for m in (1, 2, 5))
        found = next((s for s in scales if s >= 5e-9 and 12 * s >= duration * (1 - 1e-9)), None)
        if found is None or duration <= 0:
            raise OutOfRange(self.transport.address, "duration_s", duration, "0 to 600 s")
        return found

    def _depth(self, points: int, shown: int) -> int:
        share = {1: 1, 2: 2}.get(shown, 4)
        found = next((depth // share for depth in self._DEPTHS if depth // share >= points), None)
        if found is None or points < 1:
            raise OutOfRange(self.transport.address, "points", points, f"1 to {self._DEPTHS[-1] // share}")
        return found

    def _start(self) -> None:
        self.command(":SING")
        self._started, self._seen, self._forced = self._clock.now(), False, False

    def _complete(self) -> bool:
        status = self.transport.query(":TRIG:STAT?")
        if status not in {"TD", "WAIT", "RUN", "AUTO", "STOP"}:
            raise BadAnswer(self.transport.address, ":TRIG:STAT?", status, "TD, WAIT, RUN, AUTO or STOP")
        waited = self._clock.now() - self._started
        if status == "STOP":
            return self._seen or waited >= self._SETTLED
        self._seen = True
        if self._sweep == "auto" and status == "WAIT" and not self._forced and waited >= self._PATIENCE:
            self.command(":TFOR")
            self._forced = True
        return False

    def _trigger(self) -> tuple[float, str]:
        return self.trigger_level, self.trigger_source

    def _select(self, channel: int) -> None:
        self.command(f":WAV:SOUR CHAN{channel}")
        self.command(":WAV:MODE RAW")
        self.command(":WAV:FORM BYTE")

    def _read_preamble(self, numbers: list[float]) -> Preamble:
        _, _, points, _, dt, t0, _, per_code, origin, reference = numbers
        return Preamble(int(points), dt, t0, per_code, -(origin + reference) * per_code)

    def _pieces(self, preamble: Preamble) -> Iterator[NDArray[np.uint8]]:
        for first in range(1, preamble.points + 1, self._LONGEST_BLOCK):
            last = min(preamble.points, first + self._LONGEST_BLOCK - 1)
            self.transport.write(f":WAV:STAR {first}")
            self.transport.write(f":WAV:STOP {last}")
            yield self._block(last - first + 1)


class _KeysightChannel(_Channel):
    """An input of an InfiniiVision scope."""

    display = Setting("DISP", bool)
    probe_factor = Setting("PROB", float, low=0.1, high=1e4)
    coupling = Setting("COUP", str, choices=("AC", "DC"))
    inverted = Setting("INV", bool)
    scale = Setting("SCAL", float, unit="V", low=5e-4, high=1e5)
    offset = Setting("OFFS", float, unit="V", low=-1e5, high=1e5)


class KeysightDSOX(_Scope):
    """Keysight (Agilent) InfiniiVision 1000 and 2000 X-Series: DSOX1102G, EDUX1002A, MSO-X 2024A and others.

    Source: Programmer's Guides of the InfiniiVision X-Series; PyMeasure's driver and its suite for a real DSOX1102G.

    - The guide's way for a trigger that may not come: `:SINGle`, then the operation register until its bit 3 (run) is
      gone, `:AER?` telling that the scope was armed at all.  `:DIGitize` would block the link until a device clear.
    - The record is as long as the screen, ten divisions, and has up to a million points (2000 X-Series without
      the memory option: 100 000); `:WAV:POIN` thins it out.
    - ``*RST`` sets the probe to 10:1: without a probe every voltage would read ten times too large.
    - V = (code − yreference)·yincrement + yorigin; code 0 is "no sample", 1 and 255 are clipped.
    """

    MODELS: ClassVar[str] = r"(DSO|MSO|EDU)-?X ?[12]\d{3}[A-Z]*"
    CHANNEL = _KeysightChannel
    SLOPES: ClassVar[dict[str, str]] = _SLOPES | {"either": "EITH"}
    SWEEPS: ClassVar[dict[str, str]] = {"normal": "NORM", "single": "NORM", "auto": "AUTO"}

    time_range = Setting(":TIM:RANG", float, unit="s", low=50e-9, high=500.0)
    time_position = Setting(":TIM:POS", float, unit="s", low=-500.0, high=500.0)
    time_reference = Setting(":TIM:REF", str, choices=("LEFT", "CENT", "RIGH"))
    acquisition_type = Setting(":ACQ:TYPE", str, choices=("NORM", "AVER", "HRES", "PEAK"))
    trigger_mode = Setting(":TRIG:MODE", str)
    trigger_source = Setting(":TRIG:EDGE:SOUR", str)
    trigger_slope = Setting(":TRIG:EDGE:SLOP", str, choices=("POS", "NEG", "EITH", "ALT"))
    trigger_level = Setting(":TRIG:EDGE:LEV", float, unit="V", low=-1e5, high=1e5)
    sweep = Setting(":TRIG:SWE", str, choices=("AUTO", "NORM"))

    _RUNNING = 8
    #: Points that can be asked for.
    _POINTS = (*(m * 10**k for k in range(2, 6) for m in (1, 2, 5)), 1_000_000)
    _points = 1000

    def prepare(
        self,
        *,
        channels: Sequence[int] = (1,),
        duration_s: float,
        points: int,
        volts_per_division: float,
        offset_v: float = 0.0,
        coupling: str = "DC",
        trigger_level_v: float,
        trigger_slope: str = "rising",
        trigger_source: int = 1,
        sweep: str = "normal",
    ) -> None:
        """Set the scope up; see :class:`Oscilloscope`.  The record is as long as was asked for."""
        inputs = self._begin(
            channels=channels, coupling=coupling, slope=trigger_slope, source=trigger_source, sweep=sweep
        )
        if not 50e-9 <= duration_s <= 500:
            raise OutOfRange(self.transport.address, "duration_s", duration_s, "50e-9 to 500 s")
        if not 1 <= points <= self._POINTS[-1]:
            raise OutOfRange(self.transport.address, "points", points, f"1 to {self._POINTS[-1]}")
        shown = {*channels, trigger_source}
        self.forget_errors()
        self.command(":STOP")
        for n in range(1, inputs + 1):
            channel = _KeysightChannel(self, n)
            channel.display = n in shown
            if n in shown:
                channel.probe_factor = 1.0
                channel.coupling = coupling
                channel.inverted = False
                channel.scale = volts_per_division
                channel.offset = offset_v
        self.command(":TIM:MODE MAIN")
        self.time_reference = "CENT"
        self.time_range = duration_s
        self.time_position = 0.0
        self.acquisition_type = "NORM"
        self.trigger_mode = "EDGE"
        self.trigger_source = f"CHAN{trigger_source}"
        self.trigger_slope = self.SLOPES[trigger_slope]
        self.trigger_level = trigger_level_v
        self.sweep = self.SWEEPS[sweep]
        self._points = next(p for p in self._POINTS if p >= points)
        self._duration = duration_s

    def _start(self) -> None:
        self._number(":AER?")  # reading it forgets an earlier arming
        self.command(":SING")
        self._armed = False

    def _complete(self) -> bool:
        self._armed = self._armed or bool(self._number(":AER?"))
        running = self._number(":OPER:COND?") & self._RUNNING
        return self._armed and not running

    def _number(self, question: str) -> int:
        answer = self.transport.query(question)
        try:
            return int(answer)
        except ValueError:
            raise BadAnswer(self.transport.address, question, answer, "a whole number") from None

    def _trigger(self) -> tuple[float, str]:
        return self.trigger_level, self.trigger_source

    def _select(self, channel: int) -> None:
        self.command(f":WAV:SOUR CHAN{channel}")
        self.command(":WAV:FORM BYTE")
        self.command(":WAV:UNS 1")
        self.command(":WAV:POIN:MODE RAW")
        self.command(f":WAV:POIN {self._points}")

    def _read_preamble(self, numbers: list[float]) -> Preamble:
        _, _, points, _, dt, t0, _, per_code, origin, reference = numbers
        return Preamble(int(points), dt, t0, per_code, origin - reference * per_code)

    def _pieces(self, preamble: Preamble) -> Iterator[NDArray[np.uint8]]:
        yield self._block(preamble.points)
