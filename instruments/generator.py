"""Function generators: the drive.  Waveform, frequency, amplitude, offset, output, whatever the model."""

from __future__ import annotations

from typing import ClassVar, Protocol

from instruments.errors import CommandRefused
from instruments.scpi import ScpiInstrument, Setting


class Generator(Protocol):
    """What every generator offers."""

    #: of the signal [Hz], and whether it is on the terminals
    frequency: float
    output: bool

    def identity(self) -> str:
        """Maker, model, serial number, firmware."""

    def settings(self) -> dict[str, bool | float | str]:
        """Its settings as they stand."""

    def prepare(self, *, waveform: str, frequency_hz: float, amplitude_vpp: float) -> None:
        """Set the signal; the output is off afterwards."""

    def off(self) -> None:
        """Switch the output off."""

    def close(self) -> None:
        """Give the instrument back."""


class Keysight33500B(ScpiInstrument):
    """Agilent/Keysight 33500B series (they identify as 33509B to 33522B, or 33500-33522A).

    Source: Keysight 33500 Series Operating and Service Guide.  The coil is no 50 Ω load: with the load set
    to INFinity the amplitude on the display is the voltage at the coil's series resistor.
    """

    MODELS: ClassVar[str] = r"335\d\d[AB]"

    waveform = Setting("FUNC", str, choices=("SIN", "SQU", "TRI", "RAMP"))
    frequency = Setting("FREQ", float, unit="Hz", low=1e-6, high=30e6)
    amplitude = Setting("VOLT", float, unit="Vpp", low=2e-3, high=20.0)
    offset = Setting("VOLT:OFFS", float, unit="V", low=-10.0, high=10.0)
    load = Setting("OUTP1:LOAD", float, unit="ohm", low=1.0, high=9.9e37)
    output = Setting("OUTP1", bool)

    def prepare(self, *, waveform: str, frequency_hz: float, amplitude_vpp: float) -> None:
        """Set the signal, and nothing else: what was left on, burst, sweep or modulation, is reset first.

        See :class:`Generator`.  The reset switches the output off.
        """
        self.command("*RST")
        self.command("OUTP1:LOAD INF")
        self.command("VOLT:UNIT VPP")
        self.waveform = waveform
        self.frequency = frequency_hz
        self.offset = 0.0
        self.amplitude = amplitude_vpp

    def off(self) -> None:
        """Switch the output off, and see that it is.  Raises CommandRefused if it is not.

        What stands in the error queue, of an exchange cut off perhaps, is no reason to doubt it: the answer is.
        """
        self.forget_errors()
        self.transport.write("OUTP1 OFF")
        if self.output:
            raise CommandRefused(self.transport.address, "OUTP1 OFF", ("the output is still on",))
