"""A virtual Lake Shore 475 or 455.  Sources: see lakeshore.py."""

from typing import ClassVar

from instruments.virtual.core.line import LineSettings
from instruments.virtual.core.rows import Ask, Do, Row
from instruments.virtual.magnetometer.hall_probe import Reading
from instruments.virtual.magnetometer.lakeshore import FAMILY, Field, Fields, VirtualGaussmeter, field_text

_COMMON: tuple[Row, ...] = (
    *VirtualGaussmeter.COMMON,
    Do("*CLS", lambda d: d.clear_status()),
    Ask("*ESR", lambda d: f"{d.status.take_events():03d}"),
    Fields("*ESE", (Field("event_enable", 0, 255, 0),)),
    Fields("*SRE", (Field("request_enable", 0, 255, 0),)),
    Do("*OPC", lambda d: d.note_completion()),
    Ask("*OPC", lambda d: d.completion()),
    Ask("*STB", lambda d: f"{d.status_byte():03d}"),
    Do("*TRG"),
    Ask("*TST"),
    Do("*WAI"),
)
_RDGMODE = (
    Field("mode", 1, 3, 1),
    Field("resolution", 1, 3, 2),
    Field("band", 1, 3, 1),
    Field("peak_mode", 1, 2, 1),
    Field("peak_shown", 1, 3, 1),
)
_CPARAM = (
    Field("control_p", 0, 1e4, 1, whole=False),
    Field("control_i", 0, 1e4, 1, whole=False),
    Field("control_ramp", 0, 3.5e9, 1, whole=False),
    Field("control_slope", 0, 1e4, 10, whole=False),
)
_OWN: tuple[Row, ...] = (
    Fields("RDGMODE", _RDGMODE),
    Ask("RDGTEMP", lambda d: field_text(23.0 if d.value("temperature_unit") == 1 else 296.15)),
    Ask("RDGOHM", lambda d: field_text(d.field())),
    Fields("TUNIT", (Field("temperature_unit", 1, 2, 1),)),
    Fields("MODE", (Field("remote", 0, 2, 0),)),
    Fields("CMODE", (Field("control", 0, 1, 0),)),
    Fields("CSETP", (Field("setpoint", -3.5e9, 3.5e9, 0, whole=False),)),
    Fields("CPARAM", _CPARAM),
    Fields("PRBFCOMP", (Field("field_compensation", 0, 1, 1),)),
    Fields("PRBTCOMP", (Field("temperature_compensation", 0, 1, 1),)),
)


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
    #: Time constant and readings per second by digits less 3 (455 manual, section 1.2, after a public driver).
    _TIME_CONSTANTS, _RATES = (0.01, 0.1, 1.0), (30.0, 30.0, 10.0)

    identity = "LSCI,MODEL475,VIRTUAL,01012020"
    serial_settings = LineSettings(9600, 7, "O", 1.0)
    COMMON: ClassVar = _COMMON
    ROWS: ClassVar = (*FAMILY, *_OWN)

    def on_change(self, name: str) -> None:
        """Set the masks of the status."""
        if name in {"event_enable", "request_enable"}:
            setattr(self.status, name, int(self.value(name)))

    def reset(self) -> None:
        """*RST; the masks of the status stay as they are (IEEE 488.2, 10.32)."""
        masks = {name: self.settings[name] for name in ("event_enable", "request_enable")}
        super().reset()
        self.settings |= masks
        for name in masks:
            self.on_change(name)

    def _time_constant(self) -> float:
        return self._TIME_CONSTANTS[int(self.value("resolution")) - 1]

    def _interval(self) -> float:
        return 1 / self._RATES[int(self.value("resolution")) - 1]

    def _counts(self) -> float:
        return float(35 * 10 ** (1 + int(self.value("resolution"))))

    def _peak(self, reading: Reading) -> float:
        positive, negative = reading.highest + self._hall.zero_error, reading.lowest + self._hall.zero_error
        shown = int(self.value("peak_shown"))
        return (positive, negative, max(positive, negative, key=abs))[shown - 1]

    # --- status (475 manual, 6.1.4) ---

    def completion(self) -> str:
        """*OPC?: held until what was begun is finished."""
        if self._zeroed_at is not None:
            self.busy_until(self._zeroed_at)
            self._finish_zeroing()
        return "1"

    def status_byte(self, *, message_available: bool = False) -> int:
        """Bit 5: standard events, bit 6: service request; there is no error queue."""
        return self.status.byte(errors_waiting=False, message_available=message_available)
