"""A virtual Lake Shore 475 or 455.  Sources: see lakeshore.py."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from instruments.virtual.core.device import answers, does
from instruments.virtual.core.line import LineSettings
from instruments.virtual.core.parameters import none
from instruments.virtual.core.parser import Command
from instruments.virtual.magnetometer.lakeshore import Number, VirtualGaussmeter, field_text

if TYPE_CHECKING:
    from instruments.clock import Clock
    from instruments.virtual.magnetometer.hall_probe import Reading


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
            self.numbers("*ESE", Number("event_enable", 0, 255, 0)),
            self.numbers("*SRE", Number("request_enable", 0, 255, 0)),
            Command("*OPC", set=does(self._note_completion), get=answers(self._complete)),
            Command("*STB", get=answers(lambda: f"{self.status_byte():03d}")),
            Command("*TRG", set=none),
            Command("*TST", get=answers(lambda: "0")),
            Command("*WAI", set=none),
        )

    def table(self) -> tuple[Command, ...]:
        """The family's commands and its own."""
        return (
            *super().table(),
            self.numbers(
                "RDGMODE",
                Number("mode", 1, 3, 1),
                Number("resolution", 1, 3, 2),
                Number("band", 1, 3, 1),
                Number("peak_mode", 1, 2, 1),
                Number("peak_shown", 1, 3, 1),
            ),
            Command("RDGPEAK", get=answers(self._peaks)),
            Command("RDGFRQ", get=answers(lambda: field_text(self._reading().frequency))),
            Command(
                "RDGTEMP", get=answers(lambda: field_text(23.0 if self._value("temperature_unit") == 1 else 296.15))
            ),
            Command("RDGOHM", get=answers(lambda: field_text(self._measured()))),
            self.numbers("REL", Number("relative", 0, 1, 0), Number("relative_source", 1, 2, 1)),
            self.numbers("TUNIT", Number("temperature_unit", 1, 2, 1)),
            self.numbers("BAUD", Number("baud", 0, 3, 0)),
            self.numbers("MODE", Number("remote", 0, 2, 0)),
            self.numbers("OPSTE", Number("operation_enable", 0, 255, 0)),
            Command("OPSTR", get=answers(self._take_events)),
            self.numbers("CMODE", Number("control", 0, 1, 0)),
            self.numbers("CSETP", Number("setpoint", -3.5e9, 3.5e9, 0, whole=False)),
            self.numbers(
                "CPARAM",
                Number("control_p", 0, 1e4, 1, whole=False),
                Number("control_i", 0, 1e4, 1, whole=False),
                Number("control_ramp", 0, 3.5e9, 1, whole=False),
                Number("control_slope", 0, 1e4, 10, whole=False),
            ),
            self.numbers("PRBFCOMP", Number("field_compensation", 0, 1, 1)),
            self.numbers("PRBTCOMP", Number("temperature_compensation", 0, 1, 1)),
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
        positive, negative = reading.highest + self._hall.zero_error, reading.lowest + self._hall.zero_error
        shown = int(self._value("peak_shown"))
        return (positive, negative, max(positive, negative, key=abs))[shown - 1]

    def _peaks(self) -> str:
        reading = self._reading()
        peaks = (reading.lowest, reading.highest)
        return ",".join(field_text((peak + self._hall.zero_error - self._zero) / self._unit()) for peak in peaks)

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
