"""Virtual Lake Shore gaussmeters, 425 and 455/475: a flux density in, bytes out.

Sources: Lake Shore Model 425 User's Manual, pages 50 to 57 (message flow, commands), and Model 475 User's Manual,
chapter 6, as far as excerpts were at hand; public drivers of the 455 and 475 for the rest (ranges by probe, times,
the answers OL and NO PROBE).  What had to be assumed is said where it stands.

There is no error queue.  What is not understood is ignored: a question gets no answer.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from instruments.virtual.device import Answer, Clock, VirtualInstrument, answers, does
from instruments.virtual.scpi import Command, ScpiError, none, number
from instruments.virtual.serial_line import LineSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

_MU0 = 4e-7 * math.pi

#: One of UNIT 1 to 4 in tesla: gauss, tesla, oersted and ampere per metre in air.
_UNITS_T = (1e-4, 1.0, 1e-4, _MU0)

#: What the probes answer to TYPE?, and how far off zero they are before they are zeroed (assumed) [T].
_PROBE_TYPES = {"HSE": 40, "HST": 41, "UHS": 42}
_ZERO_ERROR = 5e-6

#: Operational status (425: bits 0 to 4, 6 and 7; 455/475: bit 5 is the end of a field ramp).
_NO_PROBE, _OVERLOAD, _NEW_READING, _ALARM, _RAMP_DONE, _ZERO_DONE = 1, 2, 4, 8, 32, 128

#: How long zeroing takes (assumed) [s].
_ZEROING = 5.0

#: What is in no command: taken for blanks (some programs in C send the NUL behind their strings).
_UNPRINTABLE = re.compile(r"[^ -~]")

#: Noise of a reading, standard deviation, in units of the last digit (assumed).
_NOISE = 0.5

#: An alternating field is looked at so long [s], so often.
_WINDOW, _LOOKS = 0.2, 512
#: A steady one so often, within the time constant of the filter.
_STEADY_LOOKS = 16


@dataclass(frozen=True)
class Field:
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


@dataclass(frozen=True)
class Reading:
    """What stood at the probe.

    instant: of the reading [s]; mode: as in RDGMODE; steady, rms, lowest, highest [T]; frequency [Hz];
    noise: in units of the last digit.
    """

    instant: float
    mode: int
    steady: float
    rms: float
    lowest: float
    highest: float
    frequency: float
    noise: float


class VirtualGaussmeter(VirtualInstrument):
    """What 425, 455 and 475 have in common.

    flux_density: at the probe, along its axis, at a time [s] → [T]; asked at times up to a second back.
    probe: HSE, HST or UHS, None when none is plugged in; zero_error: before ZPROBE [T]; seed: of the noise.
    The extremes (MXHOLD) are of the readings that were asked for, not of those in between.
    """

    takes_blocks = False

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
        self.flux_density, self.probe = flux_density, probe
        self.zero_error = zero_error
        self._noise = np.random.default_rng(seed)
        self._zero = 0.0
        self._zeroed_at: float | None = None
        self._zero_done = False
        self._last: Reading | None = None
        self._told: float | None = None  # the instant of the reading that was told last
        self._relative_to = 0.0
        self._lowest, self._highest = math.inf, -math.inf
        self._last_question = ""
        self._relay_forced = False
        super().__init__(clock, pace=pace)

    # --- messages ---

    def execute(self, message: str) -> Answer | None:
        """Run one message; ``?`` alone asks the last question again."""
        message = _UNPRINTABLE.sub(" ", message).strip()
        if message == "?":
            message = self._last_question
        elif "?" in message:
            self._last_question = message
        return super().execute(message)

    def _common(self) -> tuple[Command, ...]:
        return (Command("*IDN", get=answers(lambda: self.identity)), Command("*RST", set=does(self.reset)))

    def table(self) -> tuple[Command, ...]:
        """The commands of the family."""
        return (
            self.fields("UNIT", Field("unit", 1, 4, 1)),
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
            self.fields("MXHOLD", Field("hold", 0, 1, 0)),
            self.fields("LOCK", Field("locked", 0, 1, 0), Field("lock_code", 0, 999, 123)),
            self.fields("BEEP", Field("beep", 0, 1, 1)),
            self.fields("BRIGT", Field("brightness", 0, 3, 2)),
            Command("KEYST", get=answers(lambda: "00")),
            Command("DFLT", set=self._restore_factory_settings),
            self.fields(
                "ALARM",
                Field("alarm", 0, 1, 0),
                Field("alarm_mode", 1, 2, 1),
                Field("alarm_low", -3.5e9, 3.5e9, 0, whole=False),
                Field("alarm_high", -3.5e9, 3.5e9, 0, whole=False),
                Field("alarm_inside", 1, 2, 1),
                Field("alarm_sort", 0, 1, 0),
                Field("alarm_audible", 0, 1, 1),
            ),
            Command("ALARMST", get=answers(lambda: ",".join(f"{int(on)}" for on in self._alarms()))),
        )

    def fields(self, pattern: str, *fields: Field) -> Command:
        """A row for a header with several numbers; those left out at the end stay as they are."""
        self._defaults |= {field.name: field.default for field in fields}

        def set_(parameters: list[str]) -> None:
            if not 1 <= len(parameters) <= len(fields):
                raise ScpiError(-109 if not parameters else -108)
            given = zip(fields, parameters, strict=False)
            self.settings |= {field.name: field.read(text) for field, text in given}  # all of them or none
            self.changed(fields[0].name)

        return Command(
            pattern, set_, answers(lambda: ",".join(field.spell(self._value(field.name)) for field in fields))
        )

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
        self.settings["auto"] = Field("auto", 0, 1, 1).read(parameters[0]) if parameters else 1.0

    def _set_range(self, parameters: list[str]) -> None:
        """RANGE n: a range chosen by hand switches the automatic choice off."""
        if len(parameters) != 1:
            raise ScpiError(-109)
        self.settings |= {"range": Field("range", 1, len(self._ranges()), 1).read(parameters[0]), "auto": 0.0}

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
            last = self._last = self._look(instant)
        return last

    def _look(self, instant: float) -> Reading:
        steady = self._steady(instant)
        noise = float(self._noise.standard_normal())
        mode = self._mode()
        if mode == 1:
            return Reading(instant, mode, steady, 0.0, steady, steady, 0.0, noise)
        step = _WINDOW / _LOOKS
        field = self._sampled(instant - _WINDOW + step * np.arange(1, _LOOKS + 1))
        rms, lowest, highest = float(field.std()), float(field.min()), float(field.max())
        return Reading(instant, mode, steady, rms, lowest, highest, _frequency(field, step), noise)

    def _sampled(self, times: NDArray[np.floating]) -> NDArray[np.float64]:
        return np.array([self.flux_density(time) for time in np.maximum(times, 0.0).tolist()])

    def _steady(self, instant: float) -> float:
        """The mean over the time constant, the probe's own zero error included [T]."""
        step = self._time_constant() / _STEADY_LOOKS
        field = self._sampled(instant - step * np.arange(_STEADY_LOOKS)[::-1])
        return float(field.mean()) + self.zero_error

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
        return reading.highest + self.zero_error

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
            self._zero = self._steady(self._zeroed_at)
            self._zeroed_at, self._zero_done = None, True

    def _clear_zero(self) -> None:
        self._zero, self._zeroed_at, self._zero_done = 0.0, None, False


class Virtual425(VirtualGaussmeter):
    """A Lake Shore 425.  RDGMODE mode,filter,band: 1 steady or 2 RMS; 0 or 1; 1 wide or 2 narrow.

    Assumed: 3¾ digits, one more with the filter; 0.1 s for the filter, 0.01 s without.
    """

    identity = "LSCI,MODEL425,VIRTUAL,1.0"
    serial_settings = LineSettings(57600, 7, "O", 1.0)
    RANGES_T: ClassVar = {
        "HSE": (3.5e-3, 35e-3, 0.35, 3.5),
        "HST": (35e-3, 0.35, 3.5, 35.0),
        "UHS": (35e-6, 350e-6, 3.5e-3),
    }

    def table(self) -> tuple[Command, ...]:
        """The family's commands and its own."""
        self._defaults |= {"auto": 1.0, "range": 1.0}
        return (
            *super().table(),
            self.fields("RDGMODE", Field("mode", 1, 2, 1), Field("filter", 0, 1, 1), Field("band", 1, 2, 1)),
            Command("RDGMX", get=answers(lambda: self._extremes().split(",")[1])),
            self.fields("REL", Field("relative", 0, 1, 0)),
            self.fields("RELAY", Field("relay", 0, 2, 0), Field("relay_alarm", 1, 3, 3)),
            Command("RELAYST", get=answers(self._relay)),
        )

    def _time_constant(self) -> float:
        return 0.1 if self._value("filter") else 0.01

    def _counts(self) -> float:
        return 35_000.0 if self._value("filter") and self._mode() == 1 else 3500.0

    def _extremes(self) -> str:
        return field_text(0.0) + "," + super()._extremes().split(",")[1]

    def _relay(self) -> str:
        low, high = self._alarms()
        by_alarm = (low, high, low or high)[int(self._value("relay_alarm")) - 1]
        return f"{int((False, True, by_alarm)[int(self._value('relay'))])}"


class Virtual475(VirtualGaussmeter):
    """A Lake Shore 475, or 455.  RDGMODE mode,resolution,filter,peak mode,peak shown.

    mode: 1 steady, 2 RMS, 3 peak; resolution: 1 to 3 for 3 to 5 digits; peak shown: 1 positive, 2 negative, 3 both.
    Field control (CMODE, CSETP, CPARAM) keeps its numbers but controls nothing; there is no data log.
    """

    RANGES_T: ClassVar = {
        "HSE": (350e-6, 3.5e-3, 35e-3, 0.35, 3.5),
        "HST": (3.5e-3, 35e-3, 0.35, 3.5, 35.0),
        "UHS": (3.5e-6, 35e-6, 350e-6, 3.5e-3),
    }
    _BAUD_RATES = (9600, 19200, 38400, 57600)
    #: Time constant and readings per second by digits less 3 (455 manual, section 1.2, after a public driver).
    _TIME_CONSTANTS, _RATES = (0.01, 0.1, 1.0), (30.0, 30.0, 10.0)

    def __init__(self, clock: Clock, *, model: str = "475", **options: object) -> None:
        self.identity = f"LSCI,MODEL{model},VIRTUAL,01012020"
        self.serial_settings = LineSettings(9600, 7, "O", 1.0)
        self._events = 0
        super().__init__(clock, **options)  # type: ignore[arg-type]

    def _common(self) -> tuple[Command, ...]:
        status = self.status
        return (
            *super()._common(),
            Command("*CLS", set=does(self._clear_events)),
            Command("*ESR", get=answers(lambda: f"{status.take_events():03d}")),
            self.fields("*ESE", Field("event_enable", 0, 255, 0)),
            self.fields("*SRE", Field("request_enable", 0, 255, 0)),
            Command("*OPC", set=does(self._note_completion), get=answers(self._complete)),
            Command("*STB", get=answers(lambda: f"{self.status_byte():03d}")),
            Command("*TRG", set=none),
            Command("*TST", get=answers(lambda: "0")),
            Command("*WAI", set=none),
        )

    def table(self) -> tuple[Command, ...]:
        """The family's commands and its own."""
        self._defaults |= {"auto": 1.0, "range": 1.0}
        return (
            *super().table(),
            self.fields(
                "RDGMODE",
                Field("mode", 1, 3, 1),
                Field("resolution", 1, 3, 2),
                Field("band", 1, 3, 1),
                Field("peak_mode", 1, 2, 1),
                Field("peak_shown", 1, 3, 1),
            ),
            Command("RDGPEAK", get=answers(self._peaks)),
            Command("RDGFRQ", get=answers(lambda: field_text(self._reading().frequency))),
            Command(
                "RDGTEMP", get=answers(lambda: field_text(23.0 if self._value("temperature_unit") == 1 else 296.15))
            ),
            Command("RDGOHM", get=answers(lambda: field_text(self._measured()))),
            self.fields("REL", Field("relative", 0, 1, 0), Field("relative_source", 1, 2, 1)),
            self.fields("TUNIT", Field("temperature_unit", 1, 2, 1)),
            self.fields("BAUD", Field("baud", 0, 3, 0)),
            self.fields("MODE", Field("remote", 0, 2, 0)),
            self.fields("OPSTE", Field("operation_enable", 0, 255, 0)),
            Command("OPSTR", get=answers(self._take_events)),
            self.fields("CMODE", Field("control", 0, 1, 0)),
            self.fields("CSETP", Field("setpoint", -3.5e9, 3.5e9, 0, whole=False)),
            self.fields(
                "CPARAM",
                Field("control_p", 0, 1e4, 1, whole=False),
                Field("control_i", 0, 1e4, 1, whole=False),
                Field("control_ramp", 0, 3.5e9, 1, whole=False),
                Field("control_slope", 0, 1e4, 10, whole=False),
            ),
            self.fields("PRBFCOMP", Field("field_compensation", 0, 1, 1)),
            self.fields("PRBTCOMP", Field("temperature_compensation", 0, 1, 1)),
        )

    def changed(self, name: str) -> None:
        """REL with source 2 takes the present field; BAUD sets this end of the line."""
        if name == "relative" and self._value("relative_source") == 2 and self.probe:
            self._relative_to = self._shown()
        elif name == "baud":
            self.serial_settings = replace(self.serial_settings, baud_rate=self._BAUD_RATES[int(self._value("baud"))])
        elif name in {"event_enable", "request_enable"}:
            setattr(self.status, name, int(self._value(name)))

    def _time_constant(self) -> float:
        return self._TIME_CONSTANTS[int(self._value("resolution")) - 1]

    def _interval(self) -> float:
        return 1 / self._RATES[int(self._value("resolution")) - 1]

    def _counts(self) -> float:
        return float(35 * 10 ** (1 + int(self._value("resolution"))))

    def _peak(self, reading: Reading) -> float:
        positive, negative = reading.highest + self.zero_error, reading.lowest + self.zero_error
        shown = int(self._value("peak_shown"))
        return (positive, negative, max(positive, negative, key=abs))[shown - 1]

    def _peaks(self) -> str:
        reading = self._reading()
        peaks = (reading.lowest, reading.highest)
        return ",".join(field_text((peak + self.zero_error - self._zero) / self._unit()) for peak in peaks)

    # --- status (475 manual, 6.1.4) ---

    def _complete(self) -> str:
        """*OPC?: held until what was begun is finished."""
        if self._zeroed_at is not None:
            self.busy_until(self._zeroed_at)
            self._finish_zeroing()
        return "1"

    def _operational_status(self) -> int:
        status = super()._operational_status()
        self._events |= status
        return status

    def _take_events(self) -> str:
        self._operational_status()
        events, self._events = self._events, 0
        return f"{events:03d}"

    def _clear_events(self) -> None:
        self._events = self.status.events = 0

    def status_byte(self, *, message_available: bool = False) -> int:
        """Bit 5: standard events, bit 6: service request, bit 7: operation events."""
        bits = self.status.byte(errors_waiting=False, message_available=message_available)
        operation = 128 * bool(self._events & int(self._value("operation_enable")))
        requested = 64 * bool(operation & self.status.request_enable)
        return bits | operation | requested


def _frequency(field: NDArray[np.float64], step: float) -> float:
    """Of an alternating field, by its rising crossings of the mean [Hz]; 0 if there are fewer than two."""
    level = field - field.mean()
    rising = np.flatnonzero((level[:-1] < 0) & (level[1:] >= 0))
    if len(rising) < 2:
        return 0.0
    at = rising + level[rising] / (level[rising] - level[rising + 1])
    return float((len(at) - 1) / (at[-1] - at[0]) / step)


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
