"""What the virtual Lake Shore gaussmeters, 425 and 455/475, have in common: a flux density in, bytes out.

Sources: Lake Shore Model 425 User's Manual, pages 50 to 57 (message flow, commands), and Model 475 User's Manual,
chapter 6, as far as excerpts were at hand; public drivers of the 455 and 475 for the rest (ranges by probe, times,
the answers OL and NO PROBE).  What had to be assumed is said where it stands.

There is no error queue.  What is not understood is ignored: a question gets no answer.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from instruments.virtual.core.device import VirtualInstrument, answers, does
from instruments.virtual.core.parameters import number
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.core.rows import Ask, Do
from instruments.virtual.magnetometer.hall_probe import HallProbe, Reading

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.clock import Clock
    from instruments.virtual.core.device import Answer
    from instruments.virtual.core.line import LineSettings
    from instruments.virtual.core.steps import Steps

_MU0 = 4e-7 * math.pi

#: One of UNIT 1 to 4 in tesla: gauss, tesla, oersted and ampere per metre in air.
_UNITS_T = (1e-4, 1.0, 1e-4, _MU0)

#: What the probes answer to TYPE?, and how far off zero they are before they are zeroed (assumed) [T].
_PROBE_TYPES = {"HSE": 40, "HST": 41, "UHS": 42}
_ZERO_ERROR = 5e-6

#: Operational status (425: bits 0 to 4, 6 and 7; 455/475: bit 5 is the end of a field ramp).
_NO_PROBE, _OVERLOAD, _NEW_READING, _ALARM, _ZERO_DONE = 1, 2, 4, 8, 128

#: How long zeroing takes (assumed) [s].
_ZEROING = 5.0

#: What is in no command: taken for blanks (some programs in C send the NUL behind their strings).
_UNPRINTABLE = re.compile(r"[^ -~]")

#: Noise of a reading, standard deviation, in units of the last digit (assumed).
_NOISE = 0.5


@dataclass(frozen=True)
class Number:
    """One of the numbers behind a header.  whole: printed as n, else as ±nnn.nnnE±nn."""

    name: str
    low: float
    high: float
    default: float
    whole: bool = True

    def read(self, text: str) -> float:
        """The parameter.  Raises ScpiError."""
        value = number(text, low=self.low, high=self.high, default=self.default)
        if self.whole and value != int(value):
            raise ScpiError(-224, text[:20])
        return value

    def spell(self, value: float) -> str:
        """The number as the instrument prints it."""
        return f"{int(value)}" if self.whole else field_text(value)


def field_text(value: float) -> str:
    """A number as these instruments print it, ±nnn.nnnE±nn.

    >>> field_text(12.3456), field_text(-3.5e-5), field_text(0.0)
    ('+123.456E-01', '-350.000E-07', '+000.000E+00')
    """
    if not value:
        return "+000.000E+00"
    exponent = math.floor(math.log10(abs(value))) - 2
    if round(abs(value) / 10.0**exponent, 3) >= 1000:
        exponent += 1
    return f"{value / 10.0**exponent:+08.3f}E{exponent:+03d}"


class VirtualGaussmeter(VirtualInstrument):
    """What 425, 455 and 475 have in common.

    flux_density: at the probe, along its axis, at a time [s] → [T]; asked at times up to a second back.
    probe: HSE, HST or UHS, None when none is plugged in; zero_error: before ZPROBE [T]; seed: of the noise.
    The extremes (MXHOLD) are of the readings that were asked for, not of those in between.
    """

    takes_blocks = False
    COMMON: ClassVar = (Ask("*IDN", lambda d: d.identity), Do("*RST", lambda d: d.reset()))
    line_end = "\r\n"
    #: Ranges by probe, lowest first [T].
    RANGES_T: ClassVar[dict[str, tuple[float, ...]]]
    serial_settings: LineSettings

    def __init__(
        self,
        clock: Clock,
        *,
        flux_density: Callable[[float], float],
        probe: str | None = "HSE",
        zero_error: float = _ZERO_ERROR,
        seed: int = 0,
        pace: float = 10e-3,  # the manuals of the family: typically 10 ms until the answer begins
    ) -> None:
        self.probe, self._hall = probe, HallProbe(flux_density, zero_error)
        self._noise = np.random.default_rng(seed)
        self._zero = 0.0
        self._zeroed_at: float | None = None
        self._zero_done = False
        self._last: Reading | None = None
        self._told: float | None = None  # the instant of the reading that was told last
        self._relative_to = 0.0
        self._lowest, self._highest = math.inf, -math.inf
        self._last_question = ""
        super().__init__(clock, pace=pace)

    # --- messages ---

    def steps(self, message: str) -> Steps[Answer | None]:
        """Run one message; ``?`` alone asks the last question again."""
        message = _UNPRINTABLE.sub(" ", message).strip()
        if message == "?":
            message = self._last_question
        elif "?" in message:
            self._last_question = message
        return super().steps(message)

    def table(self) -> tuple[Command, ...]:
        """The commands of the family."""
        self._defaults |= {"auto": 1.0, "range": 1.0}
        return (
            self.numbers("UNIT", Number("unit", 1, 4, 1)),
            Command("AUTO", self._set_auto, answers(lambda: f"{int(self._value('auto'))}")),
            Command("RANGE", self._set_range, answers(lambda: f"{self._range() + 1}")),
            Command("RDGFIELD", get=answers(lambda: self._tell(self._shown))),
            Command("RDGREL", get=answers(lambda: self._tell(lambda: self._shown() - self._relative_to))),
            Command("RDGMNMX", get=answers(self._extremes)),
            Command("OPST", get=answers(lambda: f"{self._operational_status():03d}")),
            Command("TYPE", get=answers(lambda: f"{_PROBE_TYPES.get(self.probe or '', 0):02d}")),
            Command("PRBSENS", get=answers(lambda: field_text(0.0 if self.probe is None else 1.0))),
            Command("PRBSNUM", get=answers(lambda: "" if self.probe is None else "H00001")),
            Command("RELSP", self._set_relative_to, answers(lambda: field_text(self._relative_to / self._unit()))),
            Command("ZPROBE", set=does(self._begin_zeroing)),
            Command("ZCLEAR", set=does(self._clear_zero)),
            Command("MXRST", set=does(self._reset_extremes)),
            self.numbers("MXHOLD", Number("hold", 0, 1, 0)),
            self.numbers("LOCK", Number("locked", 0, 1, 0), Number("lock_code", 0, 999, 123)),
            self.numbers("BEEP", Number("beep", 0, 1, 1)),
            self.numbers("BRIGT", Number("brightness", 0, 3, 2)),
            Command("KEYST", get=answers(lambda: "00")),
            Command("DFLT", set=self._restore_factory_settings),
            self.numbers(
                "ALARM",
                Number("alarm", 0, 1, 0),
                Number("alarm_mode", 1, 2, 1),
                Number("alarm_low", -3.5e9, 3.5e9, 0, whole=False),
                Number("alarm_high", -3.5e9, 3.5e9, 0, whole=False),
                Number("alarm_inside", 1, 2, 1),
                Number("alarm_sort", 0, 1, 0),
                Number("alarm_audible", 0, 1, 1),
            ),
            Command("ALARMST", get=answers(lambda: ",".join(f"{int(on)}" for on in self._alarms()))),
        )

    def numbers(self, pattern: str, *numbers: Number) -> Command:
        """A row for a header with several numbers; those left out at the end stay as they are."""
        self._defaults |= {one.name: one.default for one in numbers}

        def set_(parameters: list[str]) -> None:
            if not 1 <= len(parameters) <= len(numbers):
                raise ScpiError(-109 if not parameters else -108)
            given = zip(numbers, parameters, strict=False)
            self.settings |= {one.name: one.read(text) for one, text in given}  # all of them or none
            self.changed(numbers[0].name)

        tell = answers(lambda: ",".join(one.spell(self._value(one.name)) for one in numbers))
        return Command(pattern, set_, tell)

    def _value(self, name: str) -> float:
        return float(self.settings[name])

    def _unit(self) -> float:
        return _UNITS_T[int(self._value("unit")) - 1]

    def _restore_factory_settings(self, parameters: list[str]) -> None:
        if parameters == ["99"]:  # so that nobody does it by mistake
            self.reset()

    # --- ranges ---

    def _ranges(self) -> tuple[float, ...]:
        return self.RANGES_T[self.probe or "HSE"]

    def _set_auto(self, parameters: list[str]) -> None:
        """AUTO off/on.  PyMeasure sends it bare: taken for on."""
        self.settings["auto"] = Number("auto", 0, 1, 1).read(parameters[0]) if parameters else 1.0

    def _set_range(self, parameters: list[str]) -> None:
        """RANGE n: a range chosen by hand switches the automatic choice off."""
        if len(parameters) != 1:
            raise ScpiError(-109)
        self.settings |= {"range": Number("range", 1, len(self._ranges()), 1).read(parameters[0]), "auto": 0.0}

    def _range(self) -> int:
        """The index of the range in use; the automatic choice goes down at nine tenths of the lower range."""
        ranges = self._ranges()
        index = min(int(self._value("range")), len(ranges)) - 1
        if self._value("auto") and self.probe:
            size = abs(self._measured())
            while index < len(ranges) - 1 and size > ranges[index]:
                index += 1
            while index > 0 and size <= 0.9 * ranges[index - 1]:
                index -= 1
            self.settings["range"] = float(index + 1)
        return index

    # --- readings ---

    def _time_constant(self) -> float:
        """Of the filter for steady fields [s]."""
        raise NotImplementedError

    def _counts(self) -> float:
        """Steps of the last digit in a full range."""
        raise NotImplementedError

    def _interval(self) -> float:
        """From one reading to the next [s]."""
        return 1 / 30

    def _reading(self) -> Reading:
        """The latest reading at the time at which the message is worked on."""
        self._finish_zeroing()
        interval = self._interval()
        instant = math.floor(self._ready / interval + 1e-9) * interval
        last = self._last
        if last is None or (last.instant, last.mode) != (instant, self._mode()):
            noise = float(self._noise.standard_normal())
            last = self._last = self._hall.look(instant, self._mode(), self._time_constant(), noise)
        return last

    def _mode(self) -> int:
        """1: steady, 2: RMS, 3: peak."""
        return int(self._value("mode"))

    def _measured(self) -> float:
        """The reading in the present mode before it is rounded [T]."""
        reading = self._reading()
        if self._mode() == 2:
            return reading.rms
        if self._mode() == 3:
            return self._peak(reading) - self._zero
        return reading.steady - self._zero

    def _peak(self, reading: Reading) -> float:
        """Which of the peaks is shown [T]."""
        return reading.highest + self._hall.zero_error

    def _shown(self) -> float:
        """The reading as the instrument rounds it [T]."""
        resolution = self._ranges()[self._range()] / self._counts()
        reading = self._reading()
        shown = round((self._measured() + _NOISE * reading.noise * resolution) / resolution) * resolution
        self._told = reading.instant
        self._lowest, self._highest = min(self._lowest, shown), max(self._highest, shown)
        return shown

    def _overloaded(self) -> bool:
        return self.probe is not None and abs(self._measured()) > self._ranges()[self._range()]

    def _tell(self, value: Callable[[], float]) -> str:
        """A field [T] in the present unit, or why there is none."""
        if self.probe is None:
            return "NO PROBE"
        return "OL" if self._overloaded() else field_text(value() / self._unit())

    def _extremes(self) -> str:
        """RDGMNMX?: both, or on the 425 zero and the greatest."""
        self._tell(self._shown)
        seen = [value if math.isfinite(value) else 0.0 for value in (self._lowest, self._highest)]
        return ",".join(field_text(value / self._unit()) for value in seen)

    def _reset_extremes(self) -> None:
        self._lowest, self._highest = math.inf, -math.inf

    def _set_relative_to(self, parameters: list[str]) -> None:
        """RELSP: in the present unit."""
        if len(parameters) != 1:
            raise ScpiError(-109)
        limit = 35.0 / self._unit()
        self._relative_to = self._unit() * number(parameters[0], low=-limit, high=limit, default=0.0)

    def _alarms(self) -> tuple[bool, bool]:
        """Whether the low and the high alarm are on."""
        if not self._value("alarm") or self.probe is None:
            return False, False
        size = self._measured() / self._unit()
        if self._value("alarm_mode") == 1:
            size = abs(size)
        low, high = self._value("alarm_low"), self._value("alarm_high")
        if self._value("alarm_inside") == 2:
            return (low < size < high,) * 2
        return size < low, size > high

    # --- status and zero ---

    def _operational_status(self) -> int:
        if self.probe is None:
            return _NO_PROBE
        new = self._reading().instant != self._told
        return (
            _OVERLOAD * self._overloaded()
            + _NEW_READING * new
            + _ALARM * any(self._alarms())
            + _ZERO_DONE * self._zero_done
        )

    def _begin_zeroing(self) -> None:
        self._zero_done = False
        self._zeroed_at = self._ready + _ZEROING

    def _finish_zeroing(self) -> None:
        if self._zeroed_at is not None and self._ready >= self._zeroed_at:
            self._zero = self._hall.steady(self._zeroed_at, self._time_constant())
            self._zeroed_at, self._zero_done = None, True

    def _clear_zero(self) -> None:
        self._zero, self._zeroed_at, self._zero_done = 0.0, None, False
