"""The driver of Keysight's 33500B series."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from instruments.drivers.generator.drive import (
    DriveGenerator,
    LoadSetting,
    OutputSwitch,
    amplitude_setting,
    frequency_setting,
    offset_setting,
)
from instruments.drivers.setting import Setting
from instruments.ieee488 import INFINITY, Form

if TYPE_CHECKING:
    from instruments.clock import Clock
    from instruments.links.transport import Transport


class Keysight33500B(DriveGenerator):
    """Agilent/Keysight 33500B series (they identify as 33509B to 33522B, or 33500-33522A).

    Source: Keysight 33500 Series Operating and Service Guide.  The coil is no 50 Ω load: with the load set
    to INFinity the amplitude on the display is the voltage at the coil's series resistor.
    """

    MODELS: ClassVar[str] = r"335\d\d[AB]"
    #: Operating and Service Guide, "typical response" of its queries.
    NUMBER: ClassVar[Form] = Form(r"[+-]\d\.\d{15}E[+-]\d{2}", "+1.000000000000000E+03")
    OUTPUT: ClassVar[str] = "OUTP1"
    #: Those of the series that have a second channel, which nothing here drives.
    TWO_CHANNELS: ClassVar[frozenset[str]] = frozenset({"33510B", "33512B", "33520B", "33522A", "33522B"})

    waveform = Setting(
        "FUNC",
        str,
        choices=("SINusoid", "SQUare", "TRIangle", "RAMP"),
        answers=("PULSe", "PRBS", "NOISe", "ARBitrary", "DC"),
    )
    frequency = frequency_setting(30e6, digits=16)
    amplitude = amplitude_setting(2e-3)
    offset = offset_setting(digits=16)
    load = LoadSetting("OUTP1:LOAD", float, unit="ohm", low=1.0, high=INFINITY)
    output = OutputSwitch("OUTP1", bool)

    def __init__(self, transport: Transport, *, clock: Clock | None = None) -> None:
        super().__init__(transport, clock=clock)
        self._model = ""

    def identity(self) -> str:
        """Ask ``*IDN?``; the answer says how many channels there are."""
        answer = super().identity()
        self._model = answer.split(",")[1].strip().upper()
        return answer

    def outputs(self) -> tuple[str, ...]:
        """Return the beginning of the headers of each output; `*IDN?` is sent first if it was not yet."""
        if not self._model:
            self.identity()
        return ("OUTP1", "OUTP2") if self._model in self.TWO_CHANNELS else ("OUTP1",)
