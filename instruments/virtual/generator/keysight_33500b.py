"""A virtual 33522B: two channels, 30 MHz, 250 MSa/s."""

import math
from collections.abc import Callable
from typing import ClassVar

from instruments.clock import Clock
from instruments.virtual.core.parameters import parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Both, Do, Own, Row, Switch, Word
from instruments.virtual.generator.arbitrary import DeviceError, plain_name
from instruments.virtual.generator.channel import Channel, Family, Output, Waveform
from instruments.virtual.generator.generator import VirtualGenerator
from instruments.virtual.generator.rows import CHANNEL, INNER, SHARED, Quantity, burst_cycles, pulses, waveforms


def _square_33500(frequency: float) -> tuple[float, float]:
    """Return the limits of the duty cycle: 0.01 to 99.99 %, and no pulse shorter than 16 ns."""
    least = max(0.01, 100 * 16e-9 * frequency)
    return least, 100 - least


#: Limits of the edges of pulses [s], and of samples per second.
_EDGES, _FASTEST = (8.4e-9, 1e-6), 250e6
_FOLDER = "INT:\\BUILTIN\\"
_FIRST_ARB = _FOLDER + "EXP_RISE.ARB"
_FAMILY = Family(
    waveforms=(
        Waveform("SINusoid", 30e6, crest=2 * math.sqrt(2)),
        Waveform("SQUare", 30e6),
        Waveform("TRIangle", 200e3, crest=2 * math.sqrt(3)),
        Waveform("RAMP", 200e3, crest=2 * math.sqrt(3)),
        Waveform("PULSe", 30e6),
        Waveform("PRBS", 50e6, bottom=1e-3, sweeps=False),
        Waveform("NOISe", 30e6, crest=6.6, sweeps=False),  # crest factor 3.3 is the model's, not the manual's
        Waveform("ARB", _FASTEST, sweeps=False),
        Waveform("DC", 30e6, bursts=False, sweeps=False),
    ),
    square=_square_33500,
    arb="ARB",
    library=(
        *("EXP_RISE", "EXP_FALL", "NEG_RAMP", "SINC", "CARDIAC", "GAUSSIAN", "HAVERSINE", "LORENTZ", "D_LORENTZ"),
    ),
    least_vpp=1e-3,
    shortest_pulse=16e-9,
    shortest_edge=_EDGES[0],
    longest_burst=8000.0,
    burst_rest=1e-6,
    points=(8, 1_000_000),
    room=1_000_000,
    latency=185e-9,
    trigger_jitter=2.5e-9,
)


def _rates(channel: Channel) -> tuple[float, float]:
    """Return the limits of samples per second: fewer without a filter."""
    return 1e-6, 62.5e6 if channel["arb_filter"] == "OFF" else _FASTEST


_ARB = "[SOURce[n]:]FUNCtion:ARBitrary"
_CHANNEL: tuple[Row, ...] = (
    *waveforms(_FAMILY),
    *pulses((1 / 30e6, 1e6), _EDGES, 10e-9),
    burst_cycles(100e6),
    Quantity("[SOURce[n]:]SWEep:TIME", "{n}:sweep_time", 1.0, (1e-3, 250e3), "S"),
    Word("TRIGger[n]:SOURce", "{n}:trigger_source", "IMMediate EXTernal TIMer BUS"),
    Quantity("TRIGger[n]:DELay", "{n}:trigger_delay", 0.0, (0, 1000), "S"),
    Quantity("TRIGger[n]:COUNt", "{n}:trigger_count", 1.0, (1, 1e6)),
    Quantity("TRIGger[n]:TIMer", "{n}:trigger_timer", 1.0, (1e-6, 8000), "S"),
    Quantity("TRIGger[n]:LEVel", "{n}:trigger_level", 3.3, (0.9, 3.8), "V"),
    # arbitrary waveforms
    Own(_ARB, lambda s, n, p: s.select(n, p), lambda s, n: f'"{s.channel(n)["arb"]}"', keeps=("{n}:arb", _FIRST_ARB)),
    Quantity(f"{_ARB}:SRATe", "{n}:arb_rate", 40e3, _rates, "SA/S"),
    Quantity(
        *(f"{_ARB}:FREQuency", "{n}:arb_rate", 160.0, lambda c: (1e-6, _FASTEST / c.points), "HZ"),
        get=lambda c: c.number("arb_rate") / c.points,
        keep=lambda c, value: c.set_rate(value * c.points),
        alias=True,
    ),
    Quantity(
        *(f"{_ARB}:PERiod", "{n}:arb_rate", 6.25e-3, lambda c: (c.points / _FASTEST, 1e6), "S"),
        get=lambda c: c.points / c.number("arb_rate"),
        keep=lambda c, value: c.set_rate(1 / value * c.points),
        alias=True,
    ),
    Ask(f"{_ARB}:POINts", lambda s, n: f"{s.channel(n).points:+d}"),
    Quantity(f"{_ARB}:PTPeak", "{n}:amplitude_vpp", 0.1, Channel.amplitude_limits, "V", alias=True),
    Word(f"{_ARB}:FILTer", "{n}:arb_filter", "NORMal *STEP OFF"),
    Word(f"{_ARB}:ADVance", "{n}:arb_advance", "TRIGger *SRATe"),
    Quantity("[SOURce[n]:]PHASe:ARBitrary", "{n}:arb_phase", 0.0, (-360, 360), "DEG"),
    Both("[SOURce[n]:]DATA:ARBitrary[1]", lambda s, n, p: s.keep(n, p)),
    Both("[SOURce[n]:]DATA:ARBitrary[1]:DAC", lambda s, n, p: s.keep(n, p, full_scale=32767.0)),
    Ask("[SOURce[n]:]DATA:VOLatile:CATalog", lambda s, n: ",".join(f'"{name}"' for name in s.channel(n).memory.held)),
    Ask("[SOURce[n]:]DATA:VOLatile:FREE", lambda s, n: f"{s.channel(n).memory.free:+d}"),
    Do("[SOURce[n]:]DATA:VOLatile:CLEar", lambda s, n: s.clear_memory(n)),
    Both("MMEMory:LOAD:DATA[n]", lambda s, n, p: s.load(n, p)),
    # noise and random bits
    Quantity("[SOURce[n]:]FUNCtion:NOISe:BANDwidth", "{n}:noise_bandwidth", 1e5, (1e-3, 30e6), "HZ"),
    Quantity("[SOURce[n]:]FUNCtion:PRBS:BRATe", "{n}:prbs_rate", 1e3, (1e-3, 50e6), "HZ"),
    Word("[SOURce[n]:]FUNCtion:PRBS:DATA", "{n}:prbs_data", "PN7 PN9 PN11 PN15 PN20 PN23"),
    Quantity("[SOURce[n]:]FUNCtion:PRBS:TRANsition[:BOTH]", "{n}:prbs_edge", 8.4e-9, _EDGES, "S"),
    # what the model keeps, and does nothing with
    Quantity("[SOURce[n]:]MARKer:CYCle", "{n}:marker_cycle", 2.0, (2, 100e6)),
    Quantity("[SOURce[n]:]MARKer:POINt", "{n}:marker_point", 10.0, (4, 1e6)),
    Switch("[SOURce[n]:]BPSK:STATe", "{n}:bpsk"),
    Word("[SOURce[n]:]BPSK:SOURce", "{n}:bpsk_source", "INTernal EXTernal"),
    Quantity("[SOURce[n]:]BPSK[:PHASe]", "{n}:bpsk_phase", 180.0, (0, 360), "DEG"),
    Quantity("[SOURce[n]:]BPSK:INTernal:RATE", "{n}:bpsk_rate", 10.0, (1e-3, 1e6), "HZ"),
    Own(
        "[SOURce[n]:]LIST:FREQuency",
        lambda s, n, p: s.set_list(n, p),
        lambda s, n: s.frequencies(n),
        keeps=("{n}:list", "1e2,1e3,5.5e2"),
    ),
    Quantity("[SOURce[n]:]LIST:DWELl", "{n}:list_dwell", 1.0, (1e-6, 3600), "S"),
    Quantity("[SOURce[n]:]PHASe:MODulation", "{n}:modulation_phase", 0.0, (-360, 360), "DEG"),
    Quantity("[SOURce[n]:]PWM:DEViation:DCYCle", "{n}:pwm_duty", 1.0, (0, 100), "PCT"),
    Switch("[SOURce[n]:]SUM:STATe", "{n}:sum"),
    Word("[SOURce[n]:]SUM:SOURce", "{n}:sum_source", "INTernal EXTernal CH1 CH2"),
    Quantity("[SOURce[n]:]SUM:AMPLitude", "{n}:sum_amplitude", 0.1, (0, 100), "PCT"),
    Word("[SOURce[n]:]SUM:INTernal:FUNCtion", "{n}:sum_function", INNER),
    Quantity("[SOURce[n]:]SUM:INTernal:FREQuency", "{n}:sum_frequency", 100.0, (1e-6, 30e6), "HZ"),
    Switch("[SOURce[n]:]AM:DSSC", "{n}:am_dssc"),
    Do("[SOURce[n]:]PHASe:SYNChronize", lambda _s, _n: None),
    Do("INITiate[n][:IMMediate][:ALL]", lambda _s, _n: None),
    Switch("INITiate[n]:CONTinuous", "{n}:continuous", default=True),
    Word("OUTPut[n]:MODE", "{n}:output_mode", "NORMal GATed"),
    Word("OUTPut[n]:SYNC:MODE", "{n}:sync_mode", "NORMal CARRier MARKer"),
    Word("OUTPut[n]:SYNC:POLarity", "{n}:sync_polarity", "NORMal INVerted"),
)
_SHARED: tuple[Row, ...] = (
    Word("OUTPut[1|2]:SYNC:SOURce", "sync_source", "CH1 CH2"),
    Word("OUTPut:TRIGger:SOURce", "trigger_out_source", "CH1 CH2"),
    Word("ROSCillator:SOURce", "clock_source", "INTernal EXTernal"),
    Word("ROSCillator:SOURce:AUTO", "clock_automatic", "ON OFF"),
    Word("UNIT:ARBitrary:ANGLe", "arb_angle_unit", "DEGree RADian SECond SAMPle"),
)


class Virtual33500B(VirtualGenerator):
    """A 33522B: two channels, 30 MHz, 250 MSa/s.  The coil hangs on channel 1.

    Source: Keysight 33500 Series Operating and Service Guide.
    """

    identity = "Agilent Technologies,33522B,VIRTUAL,4.00-levilab"
    family = _FAMILY
    numbered = (1, 2)
    CHANNEL_ROWS: ClassVar = (*CHANNEL, *_CHANNEL)
    ROWS: ClassVar = (*SHARED, *_SHARED)

    def __init__(self, clock: Clock, *, listener: Callable[[float, Output], None] | None = None) -> None:
        super().__init__(clock, listener=listener)
        for channel in self.channels:
            _empty(channel)

    def keep(self, n: int, parameters: list[str], *, full_scale: float = 1.0) -> None:
        """DATA:ARBitrary: a waveform with its name.  Raises ScpiError."""
        if len(parameters) < 2:
            raise ScpiError(-109)
        name = plain_name(parameters[0])
        if name in self.channel(n).memory.held:
            raise DeviceError(786, "Specified arb waveform already exists")
        self.store(n, name, parameters[1:], full_scale=full_scale)

    def clear_memory(self, n: int) -> None:
        """DATA:VOLatile:CLEar: nothing but the waveform that is there after ``*RST``."""
        channel = self.channel(n)
        channel["arb"] = _FIRST_ARB
        _empty(channel)
        self.on_change(channel.prefix + "arb")

    def load(self, n: int, parameters: list[str]) -> None:
        """MMEMory:LOAD:DATA: a built-in waveform from its file.  Raises ScpiError."""
        channel, name = self.channel(n), plain_name(parameter(parameters))
        values = channel.library.get(name.removeprefix(_FOLDER).removesuffix(".ARB"))
        if values is None or not name.startswith(_FOLDER):
            raise DeviceError(-256, "File name not found")
        channel.memory.held[name] = values

    def set_list(self, n: int, parameters: list[str]) -> None:
        """LIST:FREQuency: the frequencies of a list sweep, which this model only keeps.  Raises ScpiError."""
        if not 1 <= len(parameters) <= 128:
            raise ScpiError(-109 if not parameters else -108)
        channel = self.channel(n)
        limits = channel.frequency_limits()
        channel["list"] = ",".join(str(channel.read(text, *limits, 1e3, "HZ")) for text in parameters)

    def frequencies(self, n: int) -> str:
        """LIST:FREQuency?: with three digits of exponent, as the instrument prints its lists."""
        numbers = (f"{float(text):+.8E}" for text in str(self.channel(n)["list"]).split(","))
        return ",".join(f"{number[:-2]}0{number[-2:]}" for number in numbers)


def _empty(channel: Channel) -> None:
    """Hold nothing but the waveform that is there after ``*RST``."""
    channel.memory.held = {_FIRST_ARB: channel.library["EXP_RISE"]}
