"""What the virtual Lake Shore gaussmeters, 425 and 455/475, have in common: a flux density in, bytes out.

Sources: Lake Shore Model 425 User's Manual, pages 50 to 57 (message flow, commands), and Model 475 User's Manual,
chapter 6, as far as excerpts were at hand; public drivers of the 455 and 475 for the rest (ranges by probe, times,
the answers OL and NO PROBE).  What had to be assumed is said where it stands.

There is no error queue.  What is not understood is ignored: a question gets no answer.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from instruments.clock import Clock
from instruments.virtual.core.device import Answer, VirtualInstrument
from instruments.virtual.core.line import LineSettings
from instruments.virtual.core.parameters import no_parameters, number
from instruments.virtual.core.parser import ScpiError, Value
from instruments.virtual.core.rows import Ask, Do, Own, Row
from instruments.virtual.core.steps import Steps
from instruments.virtual.magnetometer.hall_probe import HallProbe, Reading

_MU0 = 4e-7 * math.pi

#: One of UNIT 1 to 4 in tesla: gauss, tesla, oersted and ampere per metre in air.
_UNITS_T = (1e-4, 1.0, 1e-4, _MU0)

#: What the probes answer to TYPE?, and how far off zero they are before they are zeroed (assumed) [T].
_PROBE_TYPES = {"HSE": 40, "HST": 41, "UHS": 42}
_ZERO_ERROR = 5e-6

#: Operational status (425: bits 0 to 4, 6 and 7; 455/475: bit 5 is the end of a field ramp).
_NO_PROBE, _OVERLOAD, _NEW_READING, _ZERO_DONE = 1, 2, 4, 128

#: How long zeroing takes (assumed) [s].
_ZEROING = 5.0

#: What is in no command: taken for blanks (some programs in C send the NUL behind their strings).
_UNPRINTABLE = re.compile(r"[^ -~]")

#: Noise of a reading, standard deviation, in units of the last digit (assumed).
_NOISE = 0.5


@dataclass(frozen=True)
class Field:
    """One of the numbers behind a header.  whole: printed as n, else as ±nnn.nnnE±nn."""

    name: str
    low: float
    high: float
    default: float
    whole: bool = True

    def read(self, text: str) -> float:
        """Return the parameter.  Raises ScpiError."""
        value = number(text, low=self.low, high=self.high, default=self.default)
        if self.whole and value != int(value):
            raise ScpiError(-224, text[:20])
        return value

    def spell(self, value: float) -> str:
        """Return the number as the instrument prints it."""
        return f"{int(value)}" if self.whole else field_text(value)


@dataclass(frozen=True)
class Fields(Row):
    """A header with several numbers; those left out at the end stay as they are."""

    fields: tuple[Field, ...]

    def defaults(self) -> dict[str, Value]:
        """See the base."""
        return {field.name: field.default for field in self.fields}

    def set(self, device: Any, parameters: list[str]) -> None:
        """See the base."""
        if not 1 <= len(parameters) <= len(self.fields):
            raise ScpiError(-109 if not parameters else -108)
        given = zip(self.fields, parameters, strict=False)
        device.settings |= {field.name: field.read(text) for field, text in given}  # all of them or none
        device.on_change(self.fields[0].name)

    def ask(self, device: Any, parameters: list[str]) -> str:
        """See the base."""
        no_parameters(parameters)
        return ",".join(field.spell(device.settings[field.name]) for field in self.fields)


def field_text(value: float) -> str:
    """Return a number as these instruments print it, ±nnn.nnnE±nn.

    >>> field_text(12.3456), field_text(-3.5e-5), field_text(0.0)
    ('+123.456E-01', '-350.000E-07', '+000.000E+00')
    """
    if not value:
        return "+000.000E+00"
    exponent = math.floor(math.log10(abs(value))) - 2
    if round(abs(value) / 10.0**exponent, 3) >= 1000:
        exponent += 1
    return f"{value / 10.0**exponent:+08.3f}E{exponent:+03d}"


#: The commands of the family.
FAMILY: tuple[Row, ...] = (
    Fields("UNIT", (Field("unit", 1, 4, 1),)),
    Own("AUTO", lambda d, p: d.set_auto(p), lambda d: f"{d.value('auto'):.0f}", ("auto", 1.0)),
    Own("RANGE", lambda d, p: d.set_range(p), lambda d: f"{d.range_index() + 1}", ("range", 1.0)),
    Ask("RDGFIELD", lambda d: d.reading_text()),
    Ask("OPST", lambda d: f"{d.operational_status():03d}"),
    Ask("TYPE", lambda d: f"{_PROBE_TYPES.get(d.probe or '', 0):02d}"),
    Do("ZPROBE", lambda d: d.begin_zeroing()),
    Do("ZCLEAR", lambda d: d.clear_zero()),
)


class VirtualGaussmeter(VirtualInstrument):
    """What 425, 455 and 475 have in common.

    flux_density: at the probe, along its axis, at a time [s] → [T]; asked at times up to a second back.
    probe: HSE, HST or UHS, None when none is plugged in; zero_error: before ZPROBE [T]; seed: of the noise.
    """

    takes_blocks = False
    COMMON: ClassVar[tuple[Row, ...]] = (Ask("*IDN", lambda d: d.identity), Do("*RST", lambda d: d.reset()))
    ROWS: ClassVar = FAMILY
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
        identity: str | None = None,
        pace: float = 10e-3,  # the manuals of the family: typically 10 ms until the answer begins
    ) -> None:
        self.probe, self._hall = probe, HallProbe(flux_density, zero_error)
        self._noise = np.random.default_rng(seed)
        self._zero = 0.0
        self._zeroed_at: float | None = None
        self._zero_done = False
        self._last: Reading | None = None
        self._answered: float | None = None  # the instant of the latest reading that was answered
        self._last_question = ""
        super().__init__(clock, identity=identity, pace=pace)

    # --- messages ---

    def steps(self, message: str) -> Steps[Answer | None]:
        """Run one message; ``?`` alone asks the last question again."""
        message = _UNPRINTABLE.sub(" ", message).strip()
        if message == "?":
            message = self._last_question
        elif "?" in message:
            self._last_question = message
        return super().steps(message)

    def _unit(self) -> float:
        return _UNITS_T[int(self.value("unit")) - 1]

    # --- ranges ---

    def _ranges(self) -> tuple[float, ...]:
        return self.RANGES_T[self.probe or "HSE"]

    def set_auto(self, parameters: list[str]) -> None:
        """AUTO off/on.  PyMeasure sends it bare: taken for on."""
        self.settings["auto"] = Field("auto", 0, 1, 1).read(parameters[0]) if parameters else 1.0

    def set_range(self, parameters: list[str]) -> None:
        """RANGE n: a range chosen by hand switches the automatic choice off."""
        if len(parameters) != 1:
            raise ScpiError(-109)
        self.settings |= {"range": Field("range", 1, len(self._ranges()), 1).read(parameters[0]), "auto": 0.0}

    def range_index(self) -> int:
        """Return the index of the range in use; the automatic choice goes down at nine tenths of the lower range."""
        ranges = self._ranges()
        index = min(int(self.value("range")), len(ranges)) - 1
        if self.value("auto") and self.probe:
            size = abs(self.field())
            while index < len(ranges) - 1 and size > ranges[index]:
                index += 1
            while index > 0 and size <= 0.9 * ranges[index - 1]:
                index -= 1
            self.settings["range"] = float(index + 1)
        return index

    # --- readings ---

    def _time_constant(self) -> float:
        """Return the time constant of the filter for steady fields [s]."""
        raise NotImplementedError

    def _counts(self) -> float:
        """Return the steps of the last digit in a full range."""
        raise NotImplementedError

    def _interval(self) -> float:
        """Return the time from one reading to the next [s]."""
        return 1 / 30

    def reading(self) -> Reading:
        """Return the latest reading at the time at which the message is worked on."""
        self._finish_zeroing()
        interval = self._interval()
        instant = math.floor(self._ready / interval + 1e-9) * interval
        last = self._last
        if last is None or (last.instant, last.mode) != (instant, self._mode()):
            noise = float(self._noise.standard_normal())
            last = self._last = self._hall.look(instant, self._mode(), self._time_constant(), noise)
        return last

    def _mode(self) -> int:
        """Return the mode: 1 steady, 2 RMS, 3 peak."""
        return int(self.value("mode"))

    def field(self) -> float:
        """Return the reading in the present mode before it is rounded [T]."""
        reading = self.reading()
        if self._mode() == 2:
            return reading.rms
        if self._mode() == 3:
            return self._peak(reading) - self._zero
        return reading.steady - self._zero

    def _peak(self, reading: Reading) -> float:
        """Return the peak on display [T]."""
        return reading.highest + self._hall.zero_error

    def displayed_field(self) -> float:
        """Return the reading as the instrument rounds it [T]."""
        resolution = self._ranges()[self.range_index()] / self._counts()
        reading = self.reading()
        shown = round((self.field() + _NOISE * reading.noise * resolution) / resolution) * resolution
        self._answered = reading.instant
        return shown

    def _is_overloaded(self) -> bool:
        return self.probe is not None and abs(self.field()) > self._ranges()[self.range_index()]

    def reading_text(self) -> str:
        """RDGFIELD?: the reading in the present unit, or why there is none."""
        if self.probe is None:
            return "NO PROBE"
        return "OL" if self._is_overloaded() else field_text(self.displayed_field() / self._unit())

    # --- status and zero ---

    def operational_status(self) -> int:
        """OPST?: what the probe and the last reading are like."""
        if self.probe is None:
            return _NO_PROBE
        new = self.reading().instant != self._answered
        return _OVERLOAD * self._is_overloaded() + _NEW_READING * new + _ZERO_DONE * self._zero_done

    def begin_zeroing(self) -> None:
        """ZPROBE: in a while the present field counts as zero."""
        self._zero_done = False
        self._zeroed_at = self._ready + _ZEROING

    def _finish_zeroing(self) -> None:
        if self._zeroed_at is not None and self._ready >= self._zeroed_at:
            self._zero = self._hall.steady(self._zeroed_at, self._time_constant())
            self._zeroed_at, self._zero_done = None, True

    def clear_zero(self) -> None:
        """ZCLEAR: the zero is the probe's own."""
        self._zero, self._zeroed_at, self._zero_done = 0.0, None, False
