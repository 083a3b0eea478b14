"""A virtual 33522B: two channels, 30 MHz, 250 MSa/s."""

import math
from typing import ClassVar

from instruments.virtual.core.parameters import parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Both, Do, Own, Row, Switch, Word
from instruments.virtual.generator.arbitrary import DeviceError, plain_name, samples
from instruments.virtual.generator.channel import Channel, Family, Waveform
from instruments.virtual.generator.generator import VirtualGenerator
from instruments.virtual.generator.rows import CHANNEL, SHARED, Quantity, burst_cycles, pulses, waveforms


def _square_33500(frequency: float) -> tuple[float, float]:
    """Return the limits of the duty cycle: 0.01 to 99.99 %, and no pulse shorter than 16 ns."""
    least = max(0.01, 100 * 16e-9 * frequency)
    return least, 100 - least


#: Limits of the edges of pulses [s], and of samples per second.
_EDGES, _FASTEST = (8.4e-9, 1e-6), 250e6
#: The waveform that is there after ``*RST``, and samples in the memory of a channel.
_FIRST_ARB, _ROOM = "INT:\\BUILTIN\\EXP_RISE.ARB", 1_000_000
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
    least_vpp=1e-3,
    shortest_pulse=16e-9,
    shortest_edge=_EDGES[0],
    longest_burst=8000.0,
    burst_rest=1e-6,
    first_arb=_FIRST_ARB,
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
    # arbitrary waveforms
    Own(_ARB, lambda s, n, p: s.select(n, p), lambda s, n: f'"{s.channel(n)["arb"]}"', keeps=("{n}:arb", _FIRST_ARB)),
    Quantity(f"{_ARB}:SRATe", "{n}:arb_rate", 40e3, _rates, "SA/S"),
    Word(f"{_ARB}:FILTer", "{n}:arb_filter", "NORMal *STEP OFF"),
    Word(f"{_ARB}:ADVance", "{n}:arb_advance", "TRIGger *SRATe"),
    Both("[SOURce[n]:]DATA:ARBitrary[1]", lambda s, n, p: s.keep(n, p)),
    Both("[SOURce[n]:]DATA:ARBitrary[1]:DAC", lambda s, n, p: s.keep(n, p, full_scale=32767.0)),
    Ask("[SOURce[n]:]DATA:VOLatile:CATalog", lambda s, n: ",".join(f'"{name}"' for name in s.channel(n).held)),
    Ask("[SOURce[n]:]DATA:VOLatile:FREE", lambda s, n: f"{s.room(n):+d}"),
    Do("[SOURce[n]:]DATA:VOLatile:CLEar", lambda s, n: s.clear_memory(n)),
    Quantity("[SOURce[n]:]FUNCtion:PRBS:BRATe", "{n}:prbs_rate", 1e3, (1e-3, 50e6), "HZ"),
    Do("[SOURce[n]:]PHASe:SYNChronize", lambda _s, _n: None),
    Do("INITiate[n][:IMMediate][:ALL]", lambda _s, _n: None),
    Switch("INITiate[n]:CONTinuous", "{n}:continuous", default=True),
)


class Virtual33500B(VirtualGenerator):
    """A 33522B: two channels, 30 MHz, 250 MSa/s.  The coil hangs on channel 1.

    Source: Keysight 33500 Series Operating and Service Guide.
    """

    identity = "Agilent Technologies,33522B,VIRTUAL,4.00-levilab"
    family = _FAMILY
    numbered = (1, 2)
    CHANNEL_ROWS: ClassVar = (*CHANNEL, *_CHANNEL)
    ROWS: ClassVar = (*SHARED, Word("OUTPut[1|2]:SYNC:SOURce", "sync_source", "CH1 CH2"))

    # --- arbitrary waveforms ---

    def room(self, n: int) -> int:
        """Return how many more samples the memory of a channel can hold."""
        return _ROOM - sum(values.size for values in self.channel(n).held.values())

    def keep(self, n: int, parameters: list[str], *, full_scale: float = 1.0) -> None:
        """DATA:ARBitrary: a waveform with its name, as numbers or as a block.

        full_scale: the number that stands for 1, of a converter's codes if it is another one.  Raises ScpiError.
        """
        if len(parameters) < 2:
            raise ScpiError(-109)
        name, held = plain_name(parameters[0]), self.channel(n).held
        if name in held:
            raise DeviceError(786, "Specified arb waveform already exists")
        kind = ("<" if self.settings["byte_order"] == "SWAP" else ">") + ("f4" if full_scale == 1.0 else "i2")
        held[name] = samples(parameters[1:], full_scale=full_scale, block=kind, most=self.room(n))

    def select(self, n: int, parameters: list[str]) -> None:
        """FUNCtion:ARBitrary: the waveform of this name.  Raises ScpiError."""
        channel, name = self.channel(n), plain_name(parameter(parameters))
        if name not in channel.held:
            raise DeviceError(785, "Specified arb waveform does not exist")
        channel["arb"] = name
        self.on_change(channel.prefix + "arb")

    def clear_memory(self, n: int) -> None:
        """DATA:VOLatile:CLEar: nothing but the waveform that is there after ``*RST``."""
        channel = self.channel(n)
        channel["arb"] = _FIRST_ARB
        channel.empty()
        self.on_change(channel.prefix + "arb")
