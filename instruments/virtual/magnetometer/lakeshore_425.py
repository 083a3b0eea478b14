"""A virtual Lake Shore 425.  Sources: see lakeshore.py."""

from typing import ClassVar

from instruments.virtual.core.line import LineSettings
from instruments.virtual.core.rows import Ask, Row
from instruments.virtual.magnetometer.lakeshore import FAMILY, Field, Fields, VirtualGaussmeter, field_text

_OWN: tuple[Row, ...] = (
    Fields("RDGMODE", (Field("mode", 1, 2, 1), Field("filter", 0, 1, 1), Field("band", 1, 2, 1))),
    Ask("RDGMX", lambda d: d.extremes().split(",")[1]),
    Fields("REL", (Field("relative", 0, 1, 0),)),
    Fields("RELAY", (Field("relay", 0, 2, 0), Field("relay_alarm", 1, 3, 3))),
    Ask("RELAYST", lambda d: d.relay()),
)


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

    ROWS: ClassVar = (*FAMILY, *_OWN)

    def _time_constant(self) -> float:
        return 0.1 if self.value("filter") else 0.01

    def _counts(self) -> float:
        return 35_000.0 if self.value("filter") and self._mode() == 1 else 3500.0

    def extremes(self) -> str:
        """See the base: zero and the greatest."""
        return field_text(0.0) + "," + super().extremes().split(",")[1]

    def relay(self) -> str:
        """RELAYST?: whether the relay is on."""
        low, high = self.alarms()
        by_alarm = (low, high, low or high)[int(self.value("relay_alarm")) - 1]
        return f"{int((False, True, by_alarm)[int(self.value('relay'))])}"
