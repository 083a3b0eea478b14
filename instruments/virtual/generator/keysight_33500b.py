"""A virtual 33522B: two channels, 30 MHz, 250 MSa/s."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.generator.arbitrary import Refused, plain_name
from instruments.virtual.generator.family import (
    CHOICES,
    DEG,
    HZ,
    INNER,
    PERCENT,
    PLAIN,
    SWITCHES,
    Choice,
    Family,
    Plain,
    S,
    V,
    Waveform,
)
from instruments.virtual.generator.generator import VirtualGenerator

if TYPE_CHECKING:
    from instruments.virtual.generator.channel import Channel

#: Settings on which nothing else depends, beyond those of both families; see family.py.
_PLAIN: tuple[Plain, ...] = (
    ("FUNCtion:NOISe:BANDwidth", "noise_bandwidth", 1e-3, 30e6, 1e5, HZ),
    ("FUNCtion:PRBS:TRANsition[:BOTH]", "prbs_edge", 8.4e-9, 1e-6, 8.4e-9, S),
    ("MARKer:CYCle", "marker_cycle", 2, 100e6, 2, ("",)),
    ("BPSK[:PHASe]", "bpsk_phase", 0, 360, 180, DEG),
    ("BPSK:INTernal:RATE", "bpsk_rate", 1e-3, 1e6, 10, HZ),
    ("LIST:DWELl", "list_dwell", 1e-6, 3600, 1, S),
    ("MARKer:POINt", "marker_point", 4, 1e6, 10, ("",)),
    ("PHASe:ARBitrary", "arb_phase", -360, 360, 0, DEG),
    ("PHASe:MODulation", "modulation_phase", -360, 360, 0, DEG),
    ("PWM:DEViation:DCYCle", "pwm_duty", 0, 100, 1, PERCENT),
    ("SUM:AMPLitude", "sum_amplitude", 0, 100, 0.1, PERCENT),
    ("SUM:INTernal:FREQuency", "sum_frequency", 1e-6, 30e6, 100, HZ),
)
_CHOICES: tuple[Choice, ...] = (
    ("FUNCtion:ARBitrary:FILTer", "arb_filter", ("NORMal", "STEP", "OFF"), "STEP"),
    ("FUNCtion:ARBitrary:ADVance", "arb_advance", ("TRIGger", "SRATe"), "SRAT"),
    ("FUNCtion:PRBS:DATA", "prbs_data", ("PN7", "PN9", "PN11", "PN15", "PN20", "PN23"), "PN7"),
    ("BPSK:SOURce", "bpsk_source", ("INTernal", "EXTernal"), "INT"),
    ("SUM:SOURce", "sum_source", ("INTernal", "EXTernal", "CH1", "CH2"), "INT"),
    ("SUM:INTernal:FUNCtion", "sum_function", INNER, "SIN"),
)


def _square_33500(frequency: float) -> tuple[float, float]:
    """0.01 to 99.99 %, and no pulse shorter than 16 ns."""
    least = max(0.01, 100 * 16e-9 * frequency)
    return least, 100 - least


_FOLDER = "INT:\\BUILTIN\\"
_FIRST_ARB = _FOLDER + "EXP_RISE.ARB"


class Virtual33500B(VirtualGenerator):
    """A 33522B: two channels, 30 MHz, 250 MSa/s.  The coil hangs on channel 1.

    Source: Keysight 33500 Series Operating and Service Guide.
    """

    identity = "Agilent Technologies,33522B,VIRTUAL,4.00-levilab"
    outputs = 2
    trigger_sources = ("IMMediate", "EXTernal", "TIMer", "BUS")
    family = Family(
        waveforms=(
            Waveform("SINusoid", 30e6, crest=2 * math.sqrt(2)),
            Waveform("SQUare", 30e6),
            Waveform("TRIangle", 200e3, crest=2 * math.sqrt(3)),
            Waveform("RAMP", 200e3, crest=2 * math.sqrt(3)),
            Waveform("PULSe", 30e6),
            Waveform("PRBS", 50e6, bottom=1e-3, sweeps=False),
            Waveform("NOISe", 30e6, crest=6.6, sweeps=False),  # crest factor 3.3 is the model's, not the manual's
            Waveform("ARB", 250e6, sweeps=False),
            Waveform("DC", 30e6, bursts=False, sweeps=False),
        ),
        square=_square_33500,
        arb="ARB",
        least_vpp=1e-3,
        shortest_pulse=16e-9,
        shortest_edge=8.4e-9,
        longest_edge=1e-6,
        first_edge=10e-9,
        longest_period=1e6,
        most_cycles=100e6,
        longest_burst=8000.0,
        burst_rest=1e-6,
        longest_delay=1000.0,
        longest_sweep=250e3,
        points=(8, 1_000_000),
        room=1_000_000,
        plain=(*PLAIN, *_PLAIN),
        choices=(*CHOICES, *_CHOICES),
        modes=(*SWITCHES, "BPSK", "SUM"),
    )

    def arbitrary_rows(self, channel: Channel) -> tuple[Command, ...]:
        """Arbitrary waveforms, each channel's own, and what else only this family has."""
        source, output, trigger = self.headers(channel)
        prefix, arb = channel.prefix, source + "FUNCtion:ARBitrary"
        self._defaults[prefix + "arb"] = _FIRST_ARB
        channel.memory.held[_FIRST_ARB] = channel.library["EXP_RISE"]

        def rate_limits() -> tuple[float, float]:
            return 1e-6, 62.5e6 if channel["arb_filter"] == "OFF" else 250e6

        def per_sample(value: float) -> None:
            channel["arb_rate"] = value * channel.points

        rate = partial(self.quantity, channel, name="arb_rate")
        return (
            Command(arb, partial(self._select, channel), answers(lambda: f'"{channel["arb"]}"')),
            rate(pattern=arb + ":SRATe", limits=rate_limits, default=40e3, units=("", "SA/S")),
            rate(
                pattern=arb + ":FREQuency",
                limits=lambda: (1e-6, 250e6 / channel.points),
                default=160.0,
                units=HZ,
                get=lambda: channel.number("arb_rate") / channel.points,
                put=per_sample,
            ),
            rate(
                pattern=arb + ":PERiod",
                limits=lambda: (channel.points / 250e6, 1e6),
                default=6.25e-3,
                units=S,
                get=lambda: channel.points / channel.number("arb_rate"),
                put=lambda value: per_sample(1 / value),
            ),
            Command(arb + ":POINts", get=answers(lambda: f"{channel.points:+d}")),
            self.quantity(
                channel,
                arb + ":PTPeak",
                "amplitude_vpp",
                channel.amplitude_limits,
                0.1,
                units=V,
                get=lambda: channel.number("amplitude_vpp"),
                put=lambda value: channel.__setitem__("amplitude_vpp", value),
            ),
            self.quantity(channel, source + "FUNCtion:PRBS:BRATe", "prbs_rate", lambda: (1e-3, 50e6), 1e3, units=HZ),
            *self._memory_rows(channel, source + "DATA"),
            Command("[SOURce[1|2]:]PHASe:SYNChronize", set=does(lambda: None)),
            Command(f"INITiate[{channel.index}][:IMMediate][:ALL]", set=does(lambda: None)),
            self.switch(f"INITiate{_suffix(channel)}:CONTinuous", prefix + "continuous", default=True),
            self.switch(source + "AM:DSSC", prefix + "am_dssc"),
            self._list_row(channel, source + "LIST:FREQuency"),
            self.word(f"{output}:MODE", prefix + "output_mode", ("NORMal", "GATed"), "NORM"),
            self.word(f"{output}:SYNC:MODE", prefix + "sync_mode", ("NORMal", "CARRier", "MARKer"), "NORM"),
            self.word(f"{output}:SYNC:POLarity", prefix + "sync_polarity", ("NORMal", "INVerted"), "NORM"),
            self.quantity(channel, f"{trigger}:COUNt", "trigger_count", lambda: (1, 1e6), 1.0),
            self.quantity(channel, f"{trigger}:TIMer", "trigger_timer", lambda: (1e-6, 8000), 1.0, units=S),
            self.quantity(channel, f"{trigger}:LEVel", "trigger_level", lambda: (0.9, 3.8), 3.3, units=V),
        )

    def _list_row(self, channel: Channel, pattern: str) -> Command:
        """The frequencies of a list sweep, which this model only keeps."""
        key = channel.prefix + "list"
        self._defaults[key] = "1e2,1e3,5.5e2"

        def keep(parameters: list[str]) -> None:
            if not 1 <= len(parameters) <= 128:
                raise ScpiError(-109 if not parameters else -108)
            low, high = channel.frequency_limits()
            self.settings[key] = ",".join(str(channel.read(text, low, high, 1e3, HZ)) for text in parameters)

        def tell() -> str:
            numbers = (f"{float(text):+.8E}" for text in str(self.settings[key]).split(","))
            # three digits of exponent, as the instrument prints its lists
            return ",".join(f"{number[:-2]}0{number[-2:]}" for number in numbers)

        return Command(pattern, keep, answers(tell))

    def _shared(self) -> tuple[Command, ...]:
        return (
            *super()._shared(),
            self.word("OUTPut[1|2]:SYNC:SOURce", "sync_source", ("CH1", "CH2"), "CH1"),
            self.word("OUTPut:TRIGger:SOURce", "trigger_out_source", ("CH1", "CH2"), "CH1"),
            self.word("ROSCillator:SOURce", "clock_source", ("INTernal", "EXTernal"), "INT"),
            self.word("ROSCillator:SOURce:AUTO", "clock_automatic", ("ON", "OFF"), "ON"),
            self.word("UNIT:ARBitrary:ANGLe", "arb_angle_unit", ("DEGree", "RADian", "SECond", "SAMPle"), "DEG"),
        )

    def _memory_rows(self, channel: Channel, data: str) -> tuple[Command, ...]:
        def keep(parameters: list[str], *, dac: bool) -> None:
            if len(parameters) < 2:
                raise ScpiError(-109)
            name = plain_name(parameters[0])
            if name in channel.memory.held:
                raise Refused(786, "Specified arb waveform already exists")
            self.store(channel, name, parameters[1:], dac=dac, full_scale=32767.0 if dac else 1.0)

        def clear() -> None:
            channel["arb"] = _FIRST_ARB
            channel.memory.held = {_FIRST_ARB: channel.library["EXP_RISE"]}
            self.changed(channel.prefix + "arb")

        def load(parameters: list[str]) -> None:
            name = plain_name(one(parameters))
            values = channel.library.get(name.removeprefix(_FOLDER).removesuffix(".ARB"))
            if values is None or not name.startswith(_FOLDER):
                raise Refused(-256, "File name not found")
            channel.memory.held[name] = values

        memory = channel.memory
        return (
            Command(data + ":ARBitrary[1]", partial(keep, dac=False)),
            Command(data + ":ARBitrary[1]:DAC", partial(keep, dac=True)),
            Command(data + ":VOLatile:CATalog", get=answers(memory.names)),
            Command(data + ":VOLatile:FREE", get=answers(lambda: f"{memory.free:+d}")),
            Command(data + ":VOLatile:CLEar", set=does(clear)),
            *self.attributes(channel, data),
            Command(f"MMEMory:LOAD:DATA{_suffix(channel)}", load),
        )

    def _select(self, channel: Channel, parameters: list[str]) -> None:
        name = plain_name(one(parameters))
        if name not in channel.memory.held:
            raise Refused(785, "Specified arb waveform does not exist")
        channel["arb"] = name
        self.changed(channel.prefix + "arb")


def _suffix(channel: Channel) -> str:
    return "[1]" if channel.index == 1 else str(channel.index)
