"""Function generators: the drive.  Waveform, frequency, amplitude, offset, output, whatever the model."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol, cast

from instruments.errors import BadAnswer, CommandRefused, OutOfRange
from instruments.ieee488 import INFINITY
from instruments.scpi import ScpiInstrument, Setting

if TYPE_CHECKING:
    from instruments.links.transport import Transport

#: The highest voltage of either family without a load [V]: offset and half of peak to peak together.
OPEN_V = 10.0


@dataclass(frozen=True)
class Limits:
    """What the coil stands.  More is refused before anything is sent, never clipped.

    drive_amplitude_vpp, drive_offset_v: largest; drive_frequency_hz, drive_lowest_hz: the range.  The names are those
    in bench.toml.  Without a word there is no limit beside the instrument's own.
    """

    drive_amplitude_vpp: float = math.inf
    drive_offset_v: float = math.inf
    drive_frequency_hz: float = math.inf
    drive_lowest_hz: float = -math.inf

    def check(
        self, address: str, *, frequency_hz: float | None = None, amplitude_vpp: float = 0.0, offset_v: float = 0.0
    ) -> None:
        """Raise OutOfRange if this signal is more than they allow.  frequency_hz: None where there is none."""
        rows = (
            ("drive_amplitude_vpp", amplitude_vpp, 0.0, self.drive_amplitude_vpp),
            ("drive_offset_v", abs(offset_v), 0.0, self.drive_offset_v),
            ("drive_frequency_hz", frequency_hz, -math.inf, self.drive_frequency_hz),
            ("drive_lowest_hz", frequency_hz, self.drive_lowest_hz, math.inf),
        )
        for name, value, low, high in rows if self != NO_LIMITS else ():
            if value is not None and not low <= value <= high:  # nan is in no range
                allowed = f"up to {high:g}" if high < math.inf else f"from {low:g} on"
                raise OutOfRange(address, name, value, f"{allowed} (limits.{name} in the bench file)")


#: Of a generator by itself.
NO_LIMITS = Limits()


def check_peak(address: str, amplitude_vpp: float, offset_v: float) -> None:
    """Raise OutOfRange for a signal that the terminals cannot give: the instrument would clip it."""
    peak = abs(offset_v) + amplitude_vpp / 2
    if not peak <= OPEN_V:
        raise OutOfRange(address, "|offset| + Vpp/2", peak, f"up to {OPEN_V:g} V")


class Generator(Protocol):
    """What every generator offers.

    waveform: a short word; frequency [Hz]; amplitude, peak to peak, and offset of the open terminals [V]; output:
    whether the signal is on the terminals; limits: what the coil stands.
    """

    waveform: str
    frequency: float
    amplitude: float
    offset: float
    output: bool
    limits: Limits

    def identity(self) -> str:
        """Maker, model, serial number, firmware."""

    def settings(self) -> dict[str, bool | float | str]:
        """Its settings as they stand."""

    def prepare(self, *, waveform: str, frequency_hz: float, amplitude_vpp: float, offset_v: float = 0.0) -> None:
        """Set the signal; the output is off afterwards.  Raises OutOfRange beyond the limits, with nothing sent."""

    def off(self) -> None:
        """Switch all outputs off, and see that they are."""

    def close(self) -> None:
        """Give the instrument back."""


@dataclass(eq=False)
class _Limited(Setting[float]):
    """A setting that the coil may stand less of than the instrument can do.

    quantity: its name to :meth:`Limits.check`; partner: the setting that shares the voltage of the terminals with it.
    """

    quantity: str = ""
    partner: str = ""

    def __set__(self, instrument: ScpiInstrument, value: float) -> None:
        address = instrument.transport.address
        cast("_Drive", instrument).limits.check(address, **{self.quantity: value})
        self._check(address, value)
        if self.partner in instrument.set_to:
            both = {self.quantity: value, self.partner: cast("float", instrument.set_to[self.partner])}
            check_peak(address, **both)
        super().__set__(instrument, value)


@dataclass(eq=False)
class _Load(Setting[float]):
    """The load that the display is for.  Where the coil has limits they are those of the open terminals."""

    def __set__(self, instrument: ScpiInstrument, value: float) -> None:
        if cast("_Drive", instrument).limits != NO_LIMITS and not value >= INFINITY:
            allowed = f"{INFINITY:g}: limits.drive_amplitude_vpp in the bench file is that of the open terminals"
            raise OutOfRange(instrument.transport.address, self.name, value, allowed)
        super().__set__(instrument, value)


@dataclass(eq=False)
class _Switch(Setting[bool]):
    """The output.  Where the coil has limits, nothing goes on that was not set under them."""

    def __set__(self, instrument: ScpiInstrument, value: bool) -> None:  # noqa: FBT001 - it is what is assigned
        drive = cast("_Drive", instrument)
        if value and drive.limits != NO_LIMITS and not drive.prepared_here:
            allowed = "prepare() first: what stands there may be beyond limits.drive_amplitude_vpp in the bench file"
            raise OutOfRange(instrument.transport.address, self.name, value, allowed)
        super().__set__(instrument, value)


def _frequency(high: float) -> _Limited:
    return _Limited("FREQ", float, unit="Hz", low=1e-6, high=high, quantity="frequency_hz")


def _amplitude(low: float) -> _Limited:
    return _Limited("VOLT", float, unit="Vpp", low=low, high=20.0, quantity="amplitude_vpp", partner="offset_v")


def _offset() -> _Limited:
    return _Limited(
        "VOLT:OFFS", float, unit="V", low=-OPEN_V, high=OPEN_V, quantity="offset_v", partner="amplitude_vpp"
    )


class _Drive(ScpiInstrument):
    """What both families do with their settings.  OUTPUT: how the headers of the output begin."""

    OUTPUT: ClassVar[str]

    waveform: Setting[str]
    frequency: Setting[float]
    amplitude: Setting[float]
    offset: Setting[float]
    output: Setting[bool]

    def __init__(self, transport: Transport) -> None:
        super().__init__(transport)
        #: What the coil stands.
        self.limits = NO_LIMITS
        #: Whether the signal that is set is one of :meth:`prepare`.
        self.prepared_here = False

    def command(self, message: str) -> None:
        """As every instrument; after a reset, or one that was cut off, the signal is nobody's."""
        if message.upper().startswith("*RST"):
            self.prepared_here = False
        super().command(message)

    def prepare(self, *, waveform: str, frequency_hz: float, amplitude_vpp: float, offset_v: float = 0.0) -> None:
        """Set the signal, and nothing else: what was left on, burst, sweep or modulation, is reset first.

        See :class:`Generator`.  The reset switches all outputs off.
        """
        address = self.transport.address
        self.limits.check(address, frequency_hz=frequency_hz, amplitude_vpp=amplitude_vpp, offset_v=offset_v)
        check_peak(address, amplitude_vpp, offset_v)
        self.command("*RST")
        self.command(f"{self.OUTPUT}:LOAD INF")
        self.command("VOLT:UNIT VPP")
        self._shape(waveform)
        self.frequency = frequency_hz
        self._level(amplitude_vpp, offset_v)
        self.prepared_here = True

    def _level(self, amplitude_vpp: float, offset_v: float) -> None:
        """The offset that was there leaves no room for the amplitude, nor the amplitude after a reset for much."""
        self.offset = 0.0
        self.amplitude = amplitude_vpp
        if offset_v:
            self.offset = offset_v

    def _shape(self, waveform: str) -> None:
        self.waveform = waveform

    def outputs(self) -> tuple[str, ...]:
        """How the headers of all its outputs begin."""
        return (self.OUTPUT,)

    def off(self) -> None:
        """Switch every output off, and see that it is.  Raises CommandRefused if one is not.

        What stands in the error queue, of an exchange cut off perhaps, is no reason to doubt it: the answer is.
        """
        self.forget_errors()
        self.transport.write(f"{self.OUTPUT} OFF")  # at once, before anything is asked
        outputs = self.outputs()
        for other in outputs[1:]:
            self.transport.write(f"{other} OFF")
        if self.output:
            raise CommandRefused(self.transport.address, f"{self.OUTPUT} OFF", ("the output is still on",))
        for other in outputs[1:]:
            if self._is_on(other):
                raise CommandRefused(self.transport.address, f"{other} OFF", ("the output is still on",))

    def _is_on(self, output: str) -> bool:
        question = f"{output}?"
        answer = self.transport.query(question).strip()
        with self.resynchronised():
            if answer not in {"0", "1"}:
                raise BadAnswer(self.transport.address, question, answer, "0 or 1")
        return answer == "1"


class Keysight33500B(_Drive):
    """Agilent/Keysight 33500B series (they identify as 33509B to 33522B, or 33500-33522A).

    Source: Keysight 33500 Series Operating and Service Guide.  The coil is no 50 Ω load: with the load set
    to INFinity the amplitude on the display is the voltage at the coil's series resistor.
    """

    MODELS: ClassVar[str] = r"335\d\d[AB]"
    OUTPUT: ClassVar[str] = "OUTP1"
    #: Those of the series that have a second channel, which nothing here drives.
    TWO_CHANNELS: ClassVar[frozenset[str]] = frozenset({"33510B", "33512B", "33520B", "33522A", "33522B"})

    waveform = Setting("FUNC", str, choices=("SIN", "SQU", "TRI", "RAMP"))
    frequency = _frequency(30e6)
    amplitude = _amplitude(2e-3)
    offset = _offset()
    load = _Load("OUTP1:LOAD", float, unit="ohm", low=1.0, high=INFINITY)
    output = _Switch("OUTP1", bool)

    def __init__(self, transport: Transport) -> None:
        super().__init__(transport)
        self._model = ""

    def identity(self) -> str:
        """As every instrument; it says how many channels there are."""
        answer = super().identity()
        self._model = answer.split(",")[1].strip().upper() if "," in answer else answer.upper()
        return answer

    def outputs(self) -> tuple[str, ...]:
        """How the headers of all its outputs begin; it is asked who it is where nobody has asked yet."""
        if not self._model:
            self.identity()
        return ("OUTP1", "OUTP2") if self._model in self.TWO_CHANNELS else ("OUTP1",)


class Agilent33220A(_Drive):
    """Agilent 33220A: one channel, 20 MHz, an older dialect.

    Source: Agilent 33220A User's Guide, chapter 4; public drivers of the model.  It has no triangle of its own: that
    is a ramp of 50 % symmetry, and so `waveform` answers RAMP for it.
    """

    MODELS: ClassVar[str] = "33220A"
    OUTPUT: ClassVar[str] = "OUTP"

    waveform = Setting("FUNC", str, choices=("SIN", "SQU", "RAMP"))
    symmetry = Setting("FUNC:RAMP:SYMM", float, unit="percent", low=0.0, high=100.0)
    frequency = _frequency(20e6)
    amplitude = _amplitude(20e-3)
    offset = _offset()
    load = _Load("OUTP:LOAD", float, unit="ohm", low=1.0, high=INFINITY)
    output = _Switch("OUTP", bool)

    def _shape(self, waveform: str) -> None:
        triangle = waveform.upper() == "TRI"
        self.waveform = "RAMP" if triangle else waveform
        if triangle:
            self.symmetry = 50.0
