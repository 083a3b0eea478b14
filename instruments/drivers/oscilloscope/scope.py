"""What the drivers of oscilloscopes do in the same way: preparing, waiting for the trigger, reading, and comparing.

A scope that was reset, or whose keys were turned, gives good records of something else: its probe factor makes every
voltage ten times too large, its level lets no pulse trigger.  So the driver keeps its settings, and compares before
it hands a record out and before it says that the signal never triggered.
"""

import contextlib
import functools
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.drivers import Value
from instruments.drivers.oscilloscope import NeverTriggered, NothingAcquired, Preamble, Trace
from instruments.drivers.oscilloscope.setup import Channel, Setup
from instruments.drivers.scpi import ScpiInstrument
from instruments.drivers.setting import Setting
from instruments.errors import InstrumentError, NoAnswer, OutOfRange, SettingsLost
from instruments.ieee488 import PLAIN_BLOCK, BlockForm, Form
from instruments.links.transport import Transport

#: Between two questions whether the record is complete [s].
_POLL = 0.02
#: What the scopes of Rigol and Keysight can trigger on, and where: words of both guides' :TRIGger chapters.
TRIGGER_MODES = (
    *("EDGE", "GLITch", "PATTern", "TV", "DELay", "EBURst", "OR", "RUNT", "SHOLd", "TRANsition", "USB"),
    *("SBUS1", "SBUS2", "PULSe", "SLOPe", "VIDeo", "TIMeout", "WINDows", "NEDGe", "DURATion", "RS232", "IIC", "SPI"),
)
TRIGGER_SOURCES = (
    *(f"CHANnel{n}" for n in range(1, 5)),
    *("EXTernal", "EXT5", "AC", "ACLine", "LINE", "WGEN", "WMOD", "NONE"),
    *(f"D{n}" for n in range(16)),
    *(f"DIGital{n}" for n in range(16)),
)
#: With sweep auto a scope that cannot do so itself is triggered after this time [s].
_FORCED_AFTER_S = 0.1
#: Beyond the transport's time-out, a block may take this long on its way [s]; 1 MB over a slow link.
_BLOCK_PATIENCE = 10.0


class Scope(ScpiInstrument):
    """What the drivers do in the same way; a subclass gives headers, time base, states and blocks.

    CHANNEL: the class of its inputs; SOURCE: how an input is called as the trigger's source; STOP: ends every
    acquisition; MAIN, EDGE: the settings that choose the time base, and the trigger on edges; OFFSET_SIGN: of the
    voltage in the middle of the screen, in its offset; WHILE_SETTING_UP: how it acquires then; SLOPES, SWEEPS: its
    words for them; CODES: of a clipped trace, and of no sample; CHANGED_BY_ACQUIRE: settings that acquire() leaves in
    another state than they were prepared; PREAMBLE: the form of each of its ten fields; COLUMNS, TIME_SCALES: divisions
    of the screen, and what one may be [s], for `_time_scale`; FORCE: triggers at once, for `_force_trigger`.
    """

    CHANNEL: ClassVar[type[Channel]]
    INPUT_COUPLINGS: ClassVar[tuple[str, ...]] = ("DC", "AC")
    SOURCE: ClassVar[str] = "CHAN{}"
    STOP: ClassVar[str] = ":STOP"
    MAIN: ClassVar[Mapping[str, Value]] = {"time_mode": "MAIN"}
    EDGE: ClassVar[Mapping[str, Value]] = {"trigger_mode": "EDGE"}
    OFFSET_SIGN: ClassVar[float] = 1.0
    WHILE_SETTING_UP: ClassVar[str]
    SLOPES: ClassVar[Mapping[str, str]]
    SWEEPS: ClassVar[Mapping[str, str]]
    CODES: ClassVar[tuple[int, int, int | None]] = (0, 255, None)
    CHANGED_BY_ACQUIRE: ClassVar[Mapping[str, str]] = {}
    PREAMBLE: ClassVar[tuple[Form, ...]]
    COLUMNS: ClassVar[int]
    TIME_SCALES: ClassVar[tuple[float, ...]]
    FORCE: ClassVar[str]

    trigger_source: Setting[str]
    trigger_level: Setting[float]

    ended: float = -math.inf

    def __init__(self, transport: Transport, *, clock: Clock | None = None) -> None:
        """Drive the scope.  clock: the one its trigger is waited for with; by default the wall's."""
        super().__init__(transport, clock=clock)
        self._acquired = False
        self._duration = 0.0
        self._setup: Setup | None = None
        self._prepared: tuple[ScpiInstrument, ...] = ()

    def identity(self) -> str:
        """Return the answer to ``*IDN?``; see :class:`instruments.drivers.oscilloscope.Oscilloscope`."""
        answer = super().identity()
        self._inputs = self._number_of_inputs(answer.split(",")[1])
        return answer

    _inputs: int | None = None

    @functools.cached_property
    def channel(self) -> dict[int, Channel]:
        """Its inputs by number: ``scope.channel[1].scale``.  Asked for its identity, where it was not yet."""
        if self._inputs is None:
            self.identity()
        return {n: self.CHANNEL(self, n) for n in range(1, (self._inputs or 4) + 1)}

    def command(self, message: str) -> None:
        """Send a command; a reset takes the inputs' settings, too."""
        super().command(message)
        if message.upper().startswith("*RST") and self._inputs:
            for channel in self.channel.values():
                channel.last_set.clear()

    @staticmethod
    def _number_of_inputs(model: str) -> int:
        """Return the last digit of the model's number: DS1054Z, DSO-X 1102G."""
        digits = re.findall(r"\d", model)
        return int(digits[3]) if len(digits) > 3 and digits[3] in "1248" else 4

    def settings(self) -> dict[str, bool | float | str]:
        """Return every declared setting, those of the prepared channels as ``channel1_…``."""
        channels = {
            f"channel{n}_{name}": value for n in self._channels for name, value in self.channel[n].settings().items()
        }
        return super().settings() | channels

    @property
    def _channels(self) -> tuple[int, ...]:
        return self._setup.channels if self._setup else (1,)

    # --- preparing ---

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
        """Set the scope up; see :class:`instruments.drivers.oscilloscope.Oscilloscope`."""
        setup = Setup(
            tuple(channels),
            duration_s,
            points,
            volts_per_division,
            offset_v,
            coupling,
            trigger_level_v,
            trigger_slope,
            trigger_source,
            sweep,
        )
        self._acquired = False  # a new preparation ends the old record, even one that is refused
        inputs = self._check_setup(setup)
        times = self._times(setup)
        self._setup = setup
        self._prepared = (*(self.channel[n] for n in setup.shown), self)
        for part in self._prepared:
            part.last_set.clear()
        self.forget_errors()
        self.command(self.WHILE_SETTING_UP)
        for n in range(1, inputs + 1):  # first, for the trigger's level depends on their scales
            if n in setup.shown:
                self._apply(self.channel[n], self._scaling(setup))
            else:
                self.channel[n].display = False
        self._apply(self, {**self.MAIN} | times | self._trigger(setup))
        self._check_taken()

    def _check_setup(self, setup: Setup) -> int:
        """Check the inputs before anything is sent, and return how many there are.  Raises OutOfRange."""
        self._check("sweep", setup.sweep, tuple(self.SWEEPS))
        self._check("trigger_slope", setup.trigger_slope, tuple(self.SLOPES))
        self._check("coupling", setup.coupling, self.INPUT_COUPLINGS)
        if self._inputs is None:
            self.identity()
        inputs = self._inputs or 4
        for channel in (*setup.channels, setup.trigger_source):
            self._check("channel", channel, range(1, inputs + 1))
        return inputs

    def _check(self, name: str, value: object, choices: Sequence[object]) -> None:
        if value not in choices:
            raise OutOfRange(self.transport.address, name, value, "one of " + ", ".join(map(str, choices)))

    def _times(self, setup: Setup) -> dict[str, Value]:
        """Return the settings of time base and memory, in the order in which they are set.  Raises OutOfRange."""
        raise NotImplementedError

    def _time_scale(self, duration: float) -> float:
        """Return the least time per division with which the screen is as long [s].  Raises OutOfRange."""
        found = next((s for s in self.TIME_SCALES if self.COLUMNS * s >= duration * (1 - 1e-9)), None)
        if found is None or duration <= 0:
            longest = self.COLUMNS * self.TIME_SCALES[-1]
            raise OutOfRange(self.transport.address, "duration_s", duration, f"0 to {longest:g} s")
        self._duration = self.COLUMNS * found
        return found

    def _scaling(self, setup: Setup) -> dict[str, Value]:
        return {
            "display": True,
            "probe_factor": 1.0,
            "coupling": setup.coupling,
            "inverted": False,
            "scale": setup.volts_per_division,
            "offset": self.OFFSET_SIGN * setup.offset_v,
        }

    def _trigger(self, setup: Setup) -> dict[str, Value]:
        return {
            **self.EDGE,
            "trigger_source": self.SOURCE.format(setup.trigger_source),
            "trigger_slope": self.SLOPES[setup.trigger_slope],
            "trigger_level": setup.trigger_level_v,
            "sweep": self.SWEEPS[setup.sweep],
        }

    def _apply(self, part: ScpiInstrument, wanted: Mapping[str, Value]) -> None:
        for name, value in wanted.items():
            setattr(part, name, value)

    # --- comparing ---

    def lost_settings(self) -> dict[str, tuple[object, object]]:
        """Return the settings that differ from the values set: name → (as set, now).

        Those of the prepared inputs as ``channel1_…``; what acquire() changes by itself is none of them.
        """
        differing: dict[str, tuple[object, object]] = {}
        for part in self._prepared:
            head = f"channel{part.number}_" if isinstance(part, Channel) else ""
            found = part.changed_settings()
            differing |= {
                head + name: both for name, both in found.items() if both[1] != self.CHANGED_BY_ACQUIRE.get(name)
            }
        return differing

    def rounding(self, row: Setting[Any]) -> float:
        """Return a part of a division, or of the record."""
        return self._setup.rounding(row.unit) if self._setup else 0.0

    def _check_taken(self) -> None:
        """Check that the scope has set what was sent to it.

        Raises OutOfRange for a voltage or a time that it set otherwise, without a word; SettingsLost if more than these
        differ, as after a reset.
        """
        differing = self.lost_settings()
        if not differing:
            return
        if all(name.endswith(("_v", "_s", "_div")) for name in differing):
            name, (wanted, now) = next(iter(differing.items()))
            raise OutOfRange(self.transport.address, name, wanted, f"{now}, as the scope has set it")
        raise SettingsLost(self.transport.address, differing)

    def _check_kept(self) -> None:
        """Raise SettingsLost, and hand nothing out, if the scope is no longer as it was prepared."""
        if differing := self.lost_settings():
            self._acquired = False
            raise SettingsLost(self.transport.address, differing)

    @contextlib.contextmanager
    def _report_changed_settings(self) -> Iterator[None]:
        """Raise SettingsLost in the place of an error that came because the scope was changed."""
        try:
            yield
        except SettingsLost:
            raise
        except InstrumentError as error:
            differing: dict[str, tuple[object, object]] = {}
            with contextlib.suppress(InstrumentError):  # if it does not answer at all, the first error is raised
                differing = self.lost_settings()
            if not differing:
                raise
            self._acquired = False
            raise SettingsLost(self.transport.address, differing) from error

    # --- acquiring ---

    def off(self) -> None:
        """Acquire no more; see :class:`instruments.drivers.oscilloscope.Oscilloscope`."""
        self.forget_errors()
        self.command(self.STOP)

    def acquire(self, *, timeout_s: float) -> None:
        """Take one record; see :class:`instruments.drivers.oscilloscope.Oscilloscope`."""
        self._acquired = False
        try:
            self._start()
            self._started, self._forced = self.clock.now(), False
            self._wait(timeout_s)
        except BaseException:
            with contextlib.suppress(InstrumentError):  # the first error is raised
                self.off()  # it may not trigger later, when no program waits for it
            raise
        self._acquired, self.ended = True, self.clock.now()

    def _wait(self, timeout: float) -> None:
        """Wait until the record is complete.  Raises NeverTriggered, SettingsLost."""
        deadline = self.clock.now() + self._duration + timeout
        while not self._complete():
            if self.clock.now() >= deadline:
                self._check_kept()
                level, source = self.trigger_level, self.trigger_source
                raise NeverTriggered(self.transport.address, level_v=level, source=source, waited_s=timeout)
            self.clock.sleep(_POLL)

    def _force_trigger(self) -> None:
        """Trigger once, with sweep auto, after a while."""
        waits = self._setup is not None and self._setup.sweep == "auto" and not self._forced
        if waits and self.clock.now() - self._started >= _FORCED_AFTER_S:
            self.command(self.FORCE)
            self._forced = True

    def _start(self) -> None:
        raise NotImplementedError

    def _complete(self) -> bool:
        raise NotImplementedError

    # --- reading ---

    def trace(self, channel: int, arrived: Callable[[Trace, int], None] | None = None) -> Trace:
        """Return the record of one channel; see :class:`instruments.drivers.oscilloscope.Oscilloscope`."""
        self._check_readable(channel)
        with self._report_changed_settings():
            preamble = self.preamble(channel)
            scaling = (preamble.dt_s, preamble.t0_s, preamble.volts_per_code, preamble.offset_v)
            codes = np.empty(preamble.points, dtype=np.uint8)
            at = 0
            for piece in self._pieces(preamble):
                codes[at : at + piece.size] = piece
                at += piece.size
                if arrived:
                    arrived(Trace(codes[:at], *scaling, channel, *self.CODES), preamble.points)
        self._check_kept()
        return Trace(codes, *scaling, channel, *self.CODES)

    def blocks(self, channel: int) -> Iterator[NDArray[np.uint8]]:
        """Yield the codes of one channel in pieces; see :class:`instruments.drivers.oscilloscope.Oscilloscope`."""
        self._check_readable(channel)
        self._check_kept()
        with self._report_changed_settings():
            yield from self._pieces(self.preamble(channel))
        self._check_kept()

    def _check_readable(self, channel: int) -> None:
        if not self._acquired:
            raise NothingAcquired(self.transport.address)
        self._check("channel", channel, self._channels)

    def preamble(self, channel: int) -> Preamble:
        """Read the preamble of one channel's record, the next to be fetched.  Raises NothingAcquired."""
        self._check_readable(channel)
        self._select(channel)
        answer = self.transport.query(":WAV:PRE?")
        try:
            fields = answer.split(",")
            numbers = [form.number(field) for form, field in zip(self.PREAMBLE, fields, strict=True)]
            preamble = self._read_preamble(numbers)
        except ValueError:
            preamble = None
        # a scope prints all exponents with as many digits: where one has fewer, a byte is missing
        exponents = {len(field) for field in re.findall(r"[Ee][+-]\d+", answer)}
        # 0: bytes, as requested; of other formats nothing follows, or no record that these scopes can have
        if preamble is None or len(exponents) > 1 or int(numbers[0]) != 0 or not preamble.plausible:
            self.reject(":WAV:PRE?", answer, "ten numbers, with format 0, points and their distance")
        return preamble

    def _select(self, channel: int) -> None:
        raise NotImplementedError

    def _read_preamble(self, numbers: list[float]) -> Preamble:
        raise NotImplementedError

    def _pieces(self, preamble: Preamble) -> Iterator[NDArray[np.uint8]]:
        raise NotImplementedError

    def _block(self, points: int, question: str = ":WAV:DATA?", form: BlockForm = PLAIN_BLOCK) -> NDArray[np.uint8]:
        """Return the next block, which must hold this number of codes.  Raises BadAnswer, CommandRefused."""
        self.raise_errors(question)
        try:
            with self.clearing_on_bad_answer():
                block = self.transport.query_block(question, patience=_BLOCK_PATIENCE, form=form)
        except NoAnswer:
            self.raise_errors(question)  # the reason stands in the queue, if there is one
            raise
        if len(block) != points:
            self.reject(question, f"{len(block)} bytes", f"{points} bytes")
        return np.frombuffer(block, dtype=np.uint8)
