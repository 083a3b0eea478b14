"""A virtual Lake Shore 425.  Sources: see lakeshore.py."""

from typing import ClassVar

from instruments.virtual.core.line import LineSettings
from instruments.virtual.magnetometer.lakeshore import FAMILY, Field, Fields, VirtualGaussmeter

_RDGMODE = Fields("RDGMODE", (Field("mode", 1, 2, 1), Field("filter", 0, 1, 1), Field("band", 1, 2, 1)))


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

    ROWS: ClassVar = (*FAMILY, _RDGMODE)

    def _time_constant(self) -> float:
        return 0.1 if self.value("filter") else 0.01

    def _counts(self) -> float:
        return 35_000.0 if self.value("filter") and self._mode() == 1 else 3500.0
