"""The driver of Lake Shore's 425."""

from collections.abc import Mapping
from typing import Any, ClassVar

from instruments.drivers.magnetometer.lakeshore import ZERO_DONE, LakeShoreGaussmeter, ListedNumbers
from instruments.errors import NoAnswer
from instruments.ieee488 import Form


class LakeShore425(LakeShoreGaussmeter):
    """Lake Shore 425, at its USB socket, which is a serial port to the computer.

    Sources: Model 425 User's Manual, pages 50 (at most 30 messages a second, 30 ms after each) and 52 to 57
    (commands); Lake Shore's own Python driver (57600 baud, 7 data bits, odd parity); the socs agent of the Simons
    Observatory (bits of OPST?); PyMeasure (ranges).
    """

    MODELS: ClassVar[str] = "MODEL425"
    SERIAL: ClassVar[Mapping[str, Any]] = {
        "baud_rate": 57600,
        "data_bits": 7,
        "parity": "odd",
        "stop_bits": 1,
        "pause": 0.03,
    }
    RANGES_T: ClassVar = {
        "HSE": (3.5e-3, 35e-3, 0.35, 3.5),
        "HST": (35e-3, 0.35, 3.5, 35.0),
        "UHS": (35e-6, 350e-6, 3.5e-3),
    }
    #: Mode, filter, band.
    mode = ListedNumbers("RDGMODE", str, form=Form(r"0?[12],0?[01],0?[12]", "1,1,1"))
    _STEADY = "1,1,1"  # with the filter

    #: Zeroing is over after some seconds; more questions than this mean that it never will be.
    _LONGEST_ZEROING = 600

    def zero(self) -> None:
        """Zero the probe and wait for the bit that says that it is done; see :class:`Magnetometer`."""
        self.transport.write("ZPROBE")
        for _ in range(self._LONGEST_ZEROING):
            if self._status() & ZERO_DONE:
                return
        raise NoAnswer(self.transport.address, "ZPROBE", self._LONGEST_ZEROING * self.SERIAL["pause"])
