"""A generator as the drive of a coil: its limits, its settings, its output."""

import re
from dataclasses import dataclass
from typing import Any, ClassVar, cast

from instruments.clock import Clock
from instruments.drivers.generator import NO_LIMITS, OPEN_V, Limits, check_peak
from instruments.drivers.scpi import ScpiInstrument
from instruments.drivers.setting import Owner, Setting
from instruments.errors import CommandRefused, OutOfRange
from instruments.ieee488 import INFINITY
from instruments.links.transport import Transport


@dataclass(eq=False)
class LimitedSetting(Setting[float]):
    """A setting that the coil may stand less of than the instrument can do.

    quantity: its name to :meth:`Limits.check`; partner: the setting that shares the voltage of the terminals with it.
    """

    quantity: str = ""
    partner: str = ""

    def __set__(self, instrument: Owner, value: float) -> None:
        address = instrument.transport.address
        cast("DriveGenerator", instrument).limits.check(address, **{self.quantity: value})
        self._check(address, value)
        if self.partner in instrument.last_set:
            both = {self.quantity: value, self.partner: cast("float", instrument.last_set[self.partner])}
            check_peak(address, **both)
        super().__set__(instrument, value)


@dataclass(eq=False)
class LoadSetting(Setting[float]):
    """The load that the display is for.  Where the coil has limits they are those of the open terminals."""

    def __set__(self, instrument: Owner, value: float) -> None:
        if cast("DriveGenerator", instrument).limits != NO_LIMITS and not value >= INFINITY:
            allowed = f"{INFINITY:g}: limits.drive_amplitude_vpp in the bench file is that of the open terminals"
            raise OutOfRange(instrument.transport.address, self.name, value, allowed)
        super().__set__(instrument, value)


@dataclass(eq=False)
class OutputSwitch(Setting[bool]):
    """The output.  Where the coil has limits, nothing goes on that was not set under them."""

    def __set__(self, instrument: Owner, value: bool) -> None:  # noqa: FBT001 - the assigned value
        drive = cast("DriveGenerator", instrument)
        if value and drive.limits != NO_LIMITS and not drive.prepared_here:
            allowed = "prepare() first: what stands there may be beyond limits.drive_amplitude_vpp in the bench file"
            raise OutOfRange(instrument.transport.address, self.name, value, allowed)
        super().__set__(instrument, value)


def frequency_setting(high: float, digits: int) -> LimitedSetting:
    """Return the frequency, in steps of 1 µHz, up to the highest of the family [Hz], which prints the digits."""
    return LimitedSetting(
        "FREQ", float, "Hz", low=1e-6, high=high, resolution=1e-6, digits=digits, quantity="frequency_hz"
    )


def amplitude_setting(low: float) -> LimitedSetting:
    """Return the amplitude, of four digits (data sheets), from the lowest of the family on [V, peak to peak].

    With a load other than an open circuit the lowest amplitude is smaller.
    """
    return LimitedSetting(
        *("VOLT", float, "Vpp", low, 20.0), span=(0.0, 20.0), digits=4, quantity="amplitude_vpp", partner="offset_v"
    )


def offset_setting(digits: int) -> LimitedSetting:
    """Return the offset, with four digits of 10 V, of the digits that the family prints [V]."""
    low, high = -OPEN_V, OPEN_V
    return LimitedSetting(
        *("VOLT:OFFS", float, "V", low, high),
        resolution=1e-3,
        digits=digits,
        quantity="offset_v",
        partner="amplitude_vpp",
    )


def burst_setting(header: str, low: float, high: float, *, unit: str = "", **more: Any) -> Setting[float]:
    """Return a number of a burst, which `settings` asks for once it was set."""
    return Setting(header, float, unit, low, high, resolution=1e-6, on_demand=True, **more)


def burst_word(header: str, *choices: str, **more: Any) -> Setting[str]:
    """Return a word of a burst, which `settings` asks for once it was set."""
    return Setting(header, str, choices=choices, on_demand=True, **more)


class DriveGenerator(ScpiInstrument):
    """What both families do with their settings.

    BURST: the words for bursts of cycles, for a trigger from outside, for its falling and for its rising edge;
    OUTPUT: how the headers of the output begin; TWO_OUTPUTS: the models that have a second one, which nothing here
    drives (regular expression); TRIANGLE_IS_RAMP: whether it has no triangle, but a symmetry of ramps.
    """

    BURST: ClassVar[tuple[str, str, str, str]] = ("TRIG", "EXT", "NEG", "POS")
    OUTPUT: ClassVar[str]
    TWO_OUTPUTS: ClassVar[str] = ""
    TRIANGLE_IS_RAMP: ClassVar[bool] = False

    waveform: Setting[str]
    frequency: Setting[float]
    amplitude: Setting[float]
    offset: Setting[float]
    output: Setting[bool]
    symmetry: Setting[float]
    burst: Setting[bool] = Setting("BURS:STAT", bool, on_demand=True)
    burst_mode: Setting[str] = burst_word("BURS:MODE", "TRIGgered", "GATed")
    burst_phase: Setting[float] = burst_setting("BURS:PHAS", -360.0, 360.0, unit="deg")
    burst_cycles: Setting[float]
    trigger_source: Setting[str]
    trigger_slope: Setting[str]
    trigger_delay: Setting[float]
    #: Whether the signal that is set is one of :meth:`prepare`, under the limits as they are.
    prepared_here: bool

    def __init__(self, transport: Transport, *, clock: Clock | None = None) -> None:
        super().__init__(transport, clock=clock)
        self._limits = NO_LIMITS
        self.prepared_here = False

    @property
    def limits(self) -> Limits:
        """What the coil stands.

        New limits are for what comes: the signal that is set counts as prepared no longer, so the output does not go on
        before :meth:`prepare` has set one under them.  An output that is on is left on: :meth:`off` ends it.
        """
        return self._limits

    @limits.setter
    def limits(self, limits: Limits) -> None:
        self._limits = limits
        self.prepared_here = False

    def __exit__(self, *_error: object) -> None:
        """Switch the outputs off and close the link.  Raises CommandRefused if one is still on."""
        try:
            self.off()
        finally:
            self.close()

    def command(self, message: str) -> None:
        """Send a command; after a reset, or one that was cut off, no program answers for the signal."""
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
        self._reset()
        self._shape(waveform)
        self.frequency = frequency_hz
        self._level(amplitude_vpp, offset_v)
        self.prepared_here = True

    def prepare_triggered(
        self,
        *,
        waveform: str,
        frequency_hz: float,
        amplitude_vpp: float,
        phase_deg: float,
        rising: bool = True,
    ) -> None:
        """Set bursts that an edge at the trigger input starts, from a reset as `prepare`; see :class:`Generator`."""
        row = type(self).burst_phase
        if not row.low <= phase_deg <= row.high:
            raise OutOfRange(self.transport.address, row.name, phase_deg, f"{row.low:g} to {row.high:g} {row.unit}")
        self.prepare(waveform=waveform, frequency_hz=frequency_hz, amplitude_vpp=amplitude_vpp)
        self.prepared_here = False
        self._set_burst(phase_deg, rising=rising)
        self.prepared_here = True

    def _set_burst(self, phase_deg: float, *, rising: bool) -> None:
        """Set what a burst is like and what starts it, and then choose bursts."""
        self.burst_mode, self.trigger_source = self.BURST[:2]
        self.burst_cycles, self.burst_phase = 1.0, phase_deg
        self.trigger_slope, self.trigger_delay = self.BURST[2 + rising], 0.0
        self.burst = True

    def _reset(self) -> None:
        """Switch all outputs off, and choose a plain signal and voltages peak to peak at the open terminals."""
        self.command("*RST")
        self.command(f"{self.OUTPUT}:LOAD INF")
        self.command("VOLT:UNIT VPP")

    def _level(self, amplitude_vpp: float, offset_v: float) -> None:
        """Set amplitude and offset: first an offset of 0, for any other leaves the amplitude less room."""
        self.offset = 0.0
        self.amplitude = amplitude_vpp
        if offset_v:
            self.offset = offset_v

    def _shape(self, waveform: str) -> None:
        """Set the waveform; a triangle is a ramp of 50 % where the instrument has none."""
        triangle = waveform.upper() == "TRI" and self.TRIANGLE_IS_RAMP
        self.waveform = "RAMP" if triangle else waveform
        if triangle:
            self.symmetry = 50.0

    def outputs(self) -> tuple[str, ...]:
        """Return the beginning of the headers of each output; `*IDN?` is sent first where the model is to be known."""
        if self.TWO_OUTPUTS and not self._fields:
            self.identity()
        two = self.TWO_OUTPUTS and re.fullmatch(self.TWO_OUTPUTS, self._fields[1], re.IGNORECASE)
        return (self.OUTPUT, self.OUTPUT.replace("1", "2")) if two else (self.OUTPUT,)

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
        self.last_set[type(self).output.name_with_unit] = False
        for other in outputs[1:]:
            if self._is_on(other):
                raise CommandRefused(self.transport.address, f"{other} OFF", ("the output is still on",))

    def _is_on(self, output: str) -> bool:
        question = f"{output}?"
        answer = self.transport.query(question)
        try:
            return {"0": False, "1": True}[self.field_of(answer, output, "")]
        except (ValueError, KeyError):
            self.reject(question, answer, "0 or 1, or ON or OFF")
