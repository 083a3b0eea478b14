"""The rows that both families of generators share, and their numbers, which are clipped and answered in their unit.

Sources: Keysight 33500 Series Operating and Service Guide; Agilent 33220A User's Guide, chapter 4.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from instruments.virtual.core.parser import Value
from instruments.virtual.core.rows import Ask, Both, Do, Number, Own, Row, Switch, Word
from instruments.virtual.generator.channel import INFINITE, Channel, Family, quantity_of
from instruments.virtual.generator.generator import VirtualGenerator


@dataclass(frozen=True)
class Quantity(Number):
    """A number of a channel that is clipped at its limits, with an entry in the error queue.

    Attributes:
        limits: lowest and highest, or a function of the channel that returns them.
        get: returns the number, where it is not kept as sent.
        keep: keeps it, in the same case.
        endless: whether it may be infinite.
    """

    get: Callable[[Channel], float] | None = field(default=None, repr=False)
    keep: Callable[[Channel, float], None] | None = field(default=None, repr=False)
    endless: bool = False

    def _channel(self, device: VirtualGenerator) -> Channel:
        return device.channel(*self.of)

    def range(self, device: VirtualGenerator) -> tuple[float, float]:
        """See the base."""
        return self.limits(self._channel(device)) if callable(self.limits) else self.limits

    def _is_infinite(self, text: str) -> bool:
        if not self.endless:
            return False
        if text[:1].isalpha():
            return text.upper() in {"INF", "INFINITY"}
        return quantity_of(text, (self.unit,))[0] >= INFINITE

    def read(self, device: VirtualGenerator, text: str) -> float:
        """See the base."""
        channel, limits = self._channel(device), self.range(device)
        if self._is_infinite(text):
            return INFINITE
        return channel.read(text, *limits, self.default, self.unit)

    def put(self, device: VirtualGenerator, value: Value) -> None:
        """See the base."""
        if self.keep:
            self.keep(self._channel(device), float(value))
            device.on_change(self.name)
        else:
            super().put(device, value)

    def value(self, device: VirtualGenerator) -> float:
        """See the base."""
        return self.get(self._channel(device)) if self.get else super().value(device)


_PULSE = "[SOURce[n]:][FUNCtion:]PULSe:"
_LEVEL = "[SOURce[n]:]VOLTage[:LEVel][:IMMediate]"
_TURN = (-360.0, 360.0)

#: Of each channel of either family; a setting's name begins with the number of its channel.
CHANNEL: tuple[Row, ...] = (
    # waveform, frequency, phase
    Quantity(
        *("[SOURce[n]:]FREQuency[:CW|:FIXed]", "{n}:frequency", 1e3, Channel.frequency_limits, "HZ"),
        get=lambda c: c.frequency,
        keep=Channel.set_frequency,
    ),
    Quantity("[SOURce[n]:]PHASe[:ADJust]", "{n}:phase", 0.0, _TURN, "DEG"),
    Do("[SOURce[n]:]PHASe:REFerence", lambda _s, _n: None),
    Quantity("[SOURce[n]:]FUNCtion:SQUare:DCYCle", "{n}:duty", 50.0, Channel.square_duties, "PCT"),
    Quantity("[SOURce[n]:]FUNCtion:RAMP:SYMMetry", "{n}:symmetry", 100.0, (0, 100), "PCT"),
    # voltages
    Both(
        f"{_LEVEL}[:AMPLitude]",
        lambda s, n, p: s.set_amplitude(n, p),
        lambda s, n, p: s.amplitude(n, p),
        keeps=("{n}:amplitude_vpp", 0.1),
    ),
    Own(
        "[SOURce[n]:]VOLTage:UNIT",
        lambda s, n, p: s.set_voltage_unit(n, p),
        lambda s, n: s.channel(n)["voltage_unit"],
        keeps=("{n}:voltage_unit", "VPP"),
    ),
    Quantity(f"{_LEVEL}:OFFSet", "{n}:offset", 0.0, Channel.offset_limits, "V"),
    Quantity(
        *(f"{_LEVEL}:HIGH", "{n}:amplitude_vpp", 0.05, Channel.high_limits, "V"),
        get=Channel.high,
        keep=Channel.set_high,
        alias=True,
    ),
    Quantity(
        *(f"{_LEVEL}:LOW", "{n}:amplitude_vpp", -0.05, Channel.low_limits, "V"),
        get=Channel.low,
        keep=Channel.set_low,
        alias=True,
    ),
    Switch("[SOURce[n]:]VOLTage:RANGe:AUTO", "{n}:automatic_range", default=True),
    Switch("OUTPut[n][:STATe]", "{n}:output"),
    Quantity("OUTPut[n]:LOAD", "{n}:load", 50.0, (1, 1e4), "OHM", keep=Channel.set_load, endless=True),
    Word("OUTPut[n]:POLarity", "{n}:polarity", "NORMal INVerted"),
    # pulses
    Quantity(f"{_PULSE}WIDTh", "{n}:pulse_width", 1e-4, Channel.pulse_limits, "S", keep=Channel.set_width),
    Quantity(f"{_PULSE}DCYCle", "{n}:pulse_duty", 10.0, Channel.pulse_duties, "PCT", keep=Channel.set_pulse_duty),
    Word("[SOURce[n]:]FUNCtion:PULSe:HOLD", "{n}:pulse_hold", "WIDTh DCYCle"),
    # bursts and triggers
    Switch("[SOURce[n]:]BURSt:STATe", "{n}:burst"),
    Word("[SOURce[n]:]BURSt:MODE", "{n}:burst_mode", "TRIGgered GATed"),
    Word("[SOURce[n]:]BURSt:GATE:POLarity", "{n}:gate_polarity", "NORMal INVerted"),
    Quantity("[SOURce[n]:]BURSt:PHASe", "{n}:burst_phase", 0.0, _TURN, "DEG"),
    Quantity("[SOURce[n]:]BURSt:INTernal:PERiod", "{n}:burst_period", 1e-2, Channel.burst_periods, "S"),
    Word("TRIGger[n]:SLOPe", "{n}:trigger_slope", "POSitive NEGative"),
    Do("TRIGger[n][:IMMediate]", lambda s, n: s.start(n)),
    # sweeps
    Switch("[SOURce[n]:]SWEep:STATe", "{n}:sweep"),
    Word("[SOURce[n]:]FREQuency:MODE", "{n}:frequency_mode", "CW LIST SWEep FIXed"),
    Word("[SOURce[n]:]SWEep:SPACing", "{n}:sweep_spacing", "LINear LOGarithmic"),
    Quantity("[SOURce[n]:]FREQuency:STARt", "{n}:sweep_start", 100.0, (1e-6, 30e6), "HZ"),
    Quantity("[SOURce[n]:]FREQuency:STOP", "{n}:sweep_stop", 1e3, (1e-6, 30e6), "HZ"),
    # a signal in one command
    Ask("[SOURce[n]:]APPLy", lambda s, n: s.ask_apply(n)),
)

#: Of the whole instrument, of either family.
SHARED: tuple[Row, ...] = (
    Ask("*OPT", lambda _s: '"0,0"'),
    Do("ABORt", lambda s: s.abort()),
    Own("DISPlay:TEXT[:DATA]", lambda s, p: s.set_text(p), lambda s: s.text()),
    Do("DISPlay:TEXT:CLEar", lambda s: s.clear_text()),
    Switch("DISPlay[:WINDow][:STATe]", "display", default=True),
    Switch("OUTPut[1|2]:SYNC[:STATe]", "sync", default=True),
    Switch("OUTPut:TRIGger[:STATe]", "trigger_out"),
    Word("OUTPut:TRIGger:SLOPe", "trigger_out_slope", "POSitive NEGative"),
    Word("FORMat:BORDer", "byte_order", "NORMal SWAPped"),
    Switch("SYSTem:BEEPer:STATe", "beeper", default=True),
    Word("SYSTem:COMMunicate:RLSTate", "remote", "LOCal REMote RWLock"),
    Do("STATus:PRESet"),
    Ask("STATus:QUEStionable[:EVENt|:CONDition]", lambda _s: "+0"),
    Ask("STATus:OPERation[:EVENt|:CONDition]", lambda _s: "+0"),
)


def waveforms(family: Family) -> tuple[Row, ...]:
    """Return the rows that know the waveforms of a family."""
    return (
        Word("[SOURce[n]:]FUNCtion[:SHAPe]", "{n}:waveform", " ".join(waveform.word for waveform in family.waveforms)),
        *(
            Both(f"[SOURce[n]:]APPLy:{waveform.word}", lambda s, n, p, short=waveform.short: s.apply(n, short, p))
            for waveform in family.waveforms
        ),
    )


def pulses(periods: tuple[float, float], edges: tuple[float, float], edge: float) -> tuple[Row, ...]:
    """Return the rows of the times of pulses.  periods, edges: their limits [s]; edge: after ``*RST`` [s]."""
    return (
        Quantity(
            *(f"{_PULSE}PERiod", "{n}:frequency", 1e-3, periods, "S"),
            get=Channel.period,
            keep=Channel.set_period,
            alias=True,
        ),
        Quantity(f"{_PULSE}TRANsition[:BOTH]", "{n}:pulse_edge", edge, edges, "S"),
    )


def burst_cycles(most: float) -> Row:
    """Return the row of the cycles of a burst."""
    return Quantity(
        *("[SOURce[n]:]BURSt:NCYCles", "{n}:burst_cycles", 1.0, (1, most)),
        rounded=lambda v: float(round(v)),
        endless=True,
    )
