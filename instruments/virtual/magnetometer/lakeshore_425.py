"""A virtual Lake Shore 425.  Sources: see lakeshore.py."""

from __future__ import annotations

from typing import ClassVar

from instruments.virtual.core.device import answers
from instruments.virtual.core.line import LineSettings
from instruments.virtual.core.parser import Command
from instruments.virtual.magnetometer.lakeshore import Number, VirtualGaussmeter, field_text


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
        return (
            *super().table(),
            self.numbers("RDGMODE", Number("mode", 1, 2, 1), Number("filter", 0, 1, 1), Number("band", 1, 2, 1)),
            Command("RDGMX", get=answers(lambda: self._extremes().split(",")[1])),
            self.numbers("REL", Number("relative", 0, 1, 0)),
            self.numbers("RELAY", Number("relay", 0, 2, 0), Number("relay_alarm", 1, 3, 3)),
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
