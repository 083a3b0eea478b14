"""A virtual 33220A: one channel, 20 MHz, 14 bits; an older dialect of the same language.

It has one of its arbitrary waveforms, which is built in.
"""

import math
from typing import ClassVar

from instruments.virtual.core.rows import Row, Word
from instruments.virtual.generator.channel import Family, Waveform
from instruments.virtual.generator.generator import VirtualGenerator
from instruments.virtual.generator.rows import CHANNEL, SHARED, Quantity, burst_cycles, pulses, waveforms

#: Limits of the edges of pulses [s].
_EDGES = (5e-9, 100e-9)


def _square(frequency: float) -> tuple[float, float]:
    """Return the limits of the duty cycle: 20 to 80 % up to 10 MHz, 40 to 60 % above."""
    return (20.0, 80.0) if frequency <= 10e6 else (40.0, 60.0)


_FAMILY = Family(
    waveforms=(
        Waveform("SINusoid", 20e6, crest=2 * math.sqrt(2)),
        Waveform("SQUare", 20e6),
        Waveform("RAMP", 200e3, crest=2 * math.sqrt(3)),
        Waveform("PULSe", 5e6, bottom=500e-6, sweeps=False),
        Waveform("NOISe", 20e6, crest=6.6, sweeps=False),  # crest factor 3.3 is the model's, not the manual's
        Waveform("DC", 20e6, bursts=False, sweeps=False),
        Waveform("USER", 6e6),
    ),
    square=_square,
    least_vpp=10e-3,
    shortest_pulse=20e-9,
    shortest_edge=_EDGES[0],
    longest_burst=500.0,
    burst_rest=200e-9,
    first_arb="EXP_RISE",
)

_CHANNEL: tuple[Row, ...] = (
    *waveforms(_FAMILY),
    *pulses((1 / 5e6, 2000), _EDGES, 5e-9),
    burst_cycles(50e3),
    Quantity("[SOURce[n]:]SWEep:TIME", "{n}:sweep_time", 1.0, (1e-3, 500), "S"),
    Word("TRIGger[n]:SOURce", "{n}:trigger_source", "IMMediate EXTernal BUS"),
    Quantity("TRIGger[n]:DELay", "{n}:trigger_delay", 0.0, (0, 85), "S"),
    Word("[SOURce[n]:]FUNCtion:USER", "{n}:arb", "EXP_RISE"),
)


class Virtual33220A(VirtualGenerator):
    """The 33220A.  Source: Agilent 33220A User's Guide, chapter 4."""

    identity = "Agilent Technologies,33220A,VIRTUAL,2.02-2.02-22-2"
    family = _FAMILY
    CHANNEL_ROWS: ClassVar = (*CHANNEL, *_CHANNEL)
    ROWS: ClassVar = SHARED

    def spell(self, value: float) -> str:
        """Return a number with fourteen digits: +1.0000000000000E+03."""
        return f"{value:+.13E}"
