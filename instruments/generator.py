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


class _Drive(ScpiInstrument):
    """What both families do with their settings.  OUTPUT: how the headers of the output begin."""

    OUTPUT: ClassVar[str]

    waveform: Setting[str]
    frequency: Setting[float]
    amplitude: Setting[float]
    offset: Setting[float]
    output: Setting[bool]

    def prepare(self, *, waveform: str, frequency_hz: float, amplitude_vpp: float) -> None:
        """Set the signal, and nothing else: what was left on, burst, sweep or modulation, is reset first.

        See :class:`Generator`.  The reset switches the output off.
        """
        self.command("*RST")
        self.command(f"{self.OUTPUT}:LOAD INF")
        self.command("VOLT:UNIT VPP")
        self._shape(waveform)
        self.frequency = frequency_hz
        self.offset = 0.0
        self.amplitude = amplitude_vpp

    def _shape(self, waveform: str) -> None:
        self.waveform = waveform

    def off(self) -> None:
        """Switch the output off, and see that it is.  Raises CommandRefused if it is not.

        What stands in the error queue, of an exchange cut off perhaps, is no reason to doubt it: the answer is.
        """
        self.forget_errors()
        self.transport.write(f"{self.OUTPUT} OFF")
        if self.output:
            raise CommandRefused(self.transport.address, f"{self.OUTPUT} OFF", ("the output is still on",))


class Keysight33500B(_Drive):
    """Agilent/Keysight 33500B series (they identify as 33509B to 33522B, or 33500-33522A).

    Source: Keysight 33500 Series Operating and Service Guide.  The coil is no 50 Ω load: with the load set
    to INFinity the amplitude on the display is the voltage at the coil's series resistor.
    """

    MODELS: ClassVar[str] = r"335\d\d[AB]"
    OUTPUT: ClassVar[str] = "OUTP1"

    waveform = Setting("FUNC", str, choices=("SIN", "SQU", "TRI", "RAMP"))
    frequency = Setting("FREQ", float, unit="Hz", low=1e-6, high=30e6)
    amplitude = Setting("VOLT", float, unit="Vpp", low=2e-3, high=20.0)
    offset = Setting("VOLT:OFFS", float, unit="V", low=-10.0, high=10.0)
    load = Setting("OUTP1:LOAD", float, unit="ohm", low=1.0, high=9.9e37)
    output = Setting("OUTP1", bool)


class Agilent33220A(_Drive):
    """Agilent 33220A: one channel, 20 MHz, an older dialect.

    Source: Agilent 33220A User's Guide, chapter 4; public drivers of the model.  It has no triangle of its own: that
    is a ramp of 50 % symmetry, and so `waveform` answers RAMP for it.
    """

    MODELS: ClassVar[str] = "33220A"
    OUTPUT: ClassVar[str] = "OUTP"

    waveform = Setting("FUNC", str, choices=("SIN", "SQU", "RAMP"))
    symmetry = Setting("FUNC:RAMP:SYMM", float, unit="percent", low=0.0, high=100.0)
    frequency = Setting("FREQ", float, unit="Hz", low=1e-6, high=20e6)
    amplitude = Setting("VOLT", float, unit="Vpp", low=20e-3, high=20.0)
    offset = Setting("VOLT:OFFS", float, unit="V", low=-10.0, high=10.0)
    load = Setting("OUTP:LOAD", float, unit="ohm", low=1.0, high=9.9e37)
    output = Setting("OUTP", bool)

    def _shape(self, waveform: str) -> None:
        triangle = waveform.upper() == "TRI"
        self.waveform = "RAMP" if triangle else waveform
        if triangle:
            self.symmetry = 50.0
