"""The driver of Lake Shore's 455 and 475."""

from collections.abc import Mapping
from typing import Any, ClassVar

from instruments.drivers.magnetometer.lakeshore import LakeShoreGaussmeter, ListedNumbers
from instruments.ieee488 import Form


class LakeShore475(LakeShoreGaussmeter):
    """Lake Shore 455 and 475, at RS-232 or GPIB.

    Sources: Model 475 User's Manual, chapter 6, in part (``*OPC?`` is held until what was begun is finished); public
    drivers of the 455 and 475 after their manuals (RS-232: 7 data bits, odd parity, 9600 baud or what is set at the
    front panel, at most 20 messages a second; ranges by probe; OPST?).
    """

    MODELS: ClassVar[str] = "MODEL4[57]5"
    SERIAL: ClassVar[Mapping[str, Any]] = {
        "baud_rate": 9600,
        "data_bits": 7,
        "parity": "odd",
        "stop_bits": 1,
        "pause": 0.05,
    }
    RANGES_T: ClassVar = {
        "HSE": (350e-6, 3.5e-3, 35e-3, 0.35, 3.5),
        "HST": (3.5e-3, 35e-3, 0.35, 3.5, 35.0),
        "UHS": (3.5e-6, 35e-6, 350e-6, 3.5e-3),
    }
    #: Mode, resolution, filter, peak mode, peak shown.
    mode = ListedNumbers("RDGMODE", str, form=Form(r"0?[123],0?[123],0?[123],0?[12],0?[123]", "1,2,1,1,1"))
    _STEADY = "1,2,1,1,1"  # four digits: 10 Hz

    #: How long zeroing may take [s].
    _LONGEST_ZEROING = 20.0

    def zero(self) -> None:
        """Zero the probe and wait until the instrument says that it is done; see :class:`Magnetometer`."""
        answer = self.transport.query("ZPROBE;*OPC?", patience=self._LONGEST_ZEROING)
        if answer != "1":
            self.reject("ZPROBE;*OPC?", answer, "1")
