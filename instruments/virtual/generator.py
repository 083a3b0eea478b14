"""A virtual 33500B: what it puts out is told to whoever listens."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from instruments.virtual.device import Clock, VirtualInstrument

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.scpi import Command

_WAVEFORMS = ("SINusoid", "SQUare", "TRIangle", "RAMP")


@dataclass(frozen=True)
class Output:
    """What stands at the terminals from some time on.

    waveform: short form; frequency [Hz]; amplitude: half of peak to peak [V], 0 when off; offset [V].
    """

    waveform: str
    frequency: float
    amplitude: float
    offset: float


class Virtual33500B(VirtualInstrument):
    """Bytes in, a signal out.  listener: called with the time [s] and the new Output at each change."""

    identity = "Agilent Technologies,33522B,VIRTUAL,4.00-levilab"

    def __init__(self, clock: Clock, *, listener: Callable[[float, Output], None] | None = None) -> None:
        self._listener = listener
        super().__init__(clock)

    def table(self) -> tuple[Command, ...]:
        """Its commands; source: Keysight 33500 Series Operating and Service Guide."""
        source = "[SOURce[1]:]"
        return (
            self.word(source + "FUNCtion", "waveform", _WAVEFORMS, "SIN"),
            self.numeric(source + "FREQuency[:CW|:FIXed]", "frequency", low=1e-6, high=30e6, default=1e3, unit="HZ"),
            # 20 Vpp is the open-circuit limit; 100 mVpp the state after *RST
            self.numeric(source + "VOLTage", "amplitude_vpp", low=2e-3, high=20.0, default=0.1, unit="VPP"),
            self.word(source + "VOLTage:UNIT", "voltage_unit", ("VPP", "VRMS", "DBM"), "VPP"),
            self.numeric(source + "VOLTage:OFFSet", "offset", low=-10, high=10, default=0, unit="V"),
            self.numeric(source + "PHASe", "phase", low=-360, high=360, default=0, unit="DEG"),
            self.switch("OUTPut[1]", "output"),
            self.numeric("OUTPut[1]:LOAD", "load", low=1.0, high=9.9e37, default=50.0, unit="OHM"),
        )

    def changed(self, name: str) -> None:
        """Tell the listener what stands at the terminals now."""
        if self._listener:
            self._listener(self.clock.now(), self.signal())

    def signal(self) -> Output:
        """What stands at the terminals."""
        on = bool(self.settings["output"])
        return Output(
            waveform=str(self.settings["waveform"]),
            frequency=float(self.settings["frequency"]),
            amplitude=float(self.settings["amplitude_vpp"]) / 2 if on else 0.0,
            offset=float(self.settings["offset"]) if on else 0.0,
        )
