"""A virtual 33220A: one channel, 20 MHz, 14 bits; an older dialect of the same language."""

import math
from typing import ClassVar

from instruments.virtual.core.parameters import optional_parameter, parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Both, Do, Own, Row, Switch, Word
from instruments.virtual.generator.arbitrary import DeviceError, plain_name
from instruments.virtual.generator.channel import Family, Waveform
from instruments.virtual.generator.generator import VirtualGenerator
from instruments.virtual.generator.rows import CHANNEL, SHARED, Quantity, burst_cycles, pulses, waveforms

#: The waveforms that it is made with; 64 K points in each of the others.
_BUILT_IN = ("EXP_RISE", "EXP_FALL", "NEG_RAMP", "SINC", "CARDIAC")
_KEPT = 4
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
    arb="USER",
    library=_BUILT_IN,
    least_vpp=10e-3,
    shortest_pulse=20e-9,
    shortest_edge=_EDGES[0],
    longest_burst=500.0,
    burst_rest=200e-9,
    points=(1, 65_536),
    room=65_536,
)

_DATA = "[SOURce[n]:]DATA"
_CHANNEL: tuple[Row, ...] = (
    *waveforms(_FAMILY),
    *pulses((1 / 5e6, 2000), _EDGES, 5e-9),
    burst_cycles(50e3),
    Quantity("[SOURce[n]:]SWEep:TIME", "{n}:sweep_time", 1.0, (1e-3, 500), "S"),
    Word("TRIGger[n]:SOURce", "{n}:trigger_source", "IMMediate EXTernal BUS"),
    Quantity("TRIGger[n]:DELay", "{n}:trigger_delay", 0.0, (0, 85), "S"),
    # arbitrary waveforms
    Own(
        "[SOURce[n]:]FUNCtion:USER",
        lambda s, n, p: s.select(n, p),
        lambda s, n: s.channel(n)["arb"],
        keeps=("{n}:arb", "EXP_RISE"),
    ),
    Both(_DATA, lambda s, n, p: s.keep(n, p)),
    Both(f"{_DATA}:DAC", lambda s, n, p: s.keep(n, p, full_scale=8191.0)),
    Both(f"{_DATA}:COPY", lambda s, n, p: s.copy(n, p)),
    Both(f"{_DATA}:DELete[:NAME]", lambda s, n, p: s.delete(n, p)),
    Do(f"{_DATA}:DELete:ALL", lambda s, n: s.delete_all(n)),
    Ask(f"{_DATA}:CATalog", lambda s, n: s.catalogue(n)),
    Ask(f"{_DATA}:NVOLatile:CATalog", lambda s, n: ",".join(f'"{name}"' for name in s.copies(n)) or '""'),
    Ask(f"{_DATA}:NVOLatile:FREE", lambda s, n: f"{_KEPT - len(s.copies(n)):+d}"),
    Switch("[SOURce[n]:]MARKer[:STATe]", "marker"),
    Own("[SOURce[n]:]PHASe:UNLock:ERRor:STATe", lambda _s, _n, _p: None, lambda _s, _n: "0"),
)


class Virtual33220A(VirtualGenerator):
    """The 33220A.  Source: Agilent 33220A User's Guide, chapter 4."""

    identity = "Agilent Technologies,33220A,VIRTUAL,2.02-2.02-22-2"
    family = _FAMILY
    BUILT_IN = _BUILT_IN
    CHANNEL_ROWS: ClassVar = (*CHANNEL, *_CHANNEL)
    ROWS: ClassVar = SHARED

    def spell(self, value: float) -> str:
        """Return a number with fourteen digits: +1.0000000000000E+03."""
        return f"{value:+.13E}"

    # --- arbitrary waveforms: one in the volatile memory, four that are kept, and the built-in ones ---

    def keep(self, n: int, parameters: list[str], *, full_scale: float = 1.0) -> None:
        """Put DATA into the volatile memory.  Raises ScpiError."""
        if len(parameters) < 2:
            raise ScpiError(-109)
        if plain_name(parameters[0]) != "VOLATILE":
            raise ScpiError(-224, parameters[0][:20])
        self.store(n, "VOLATILE", parameters[1:], full_scale=full_scale)
        self.on_change(f"{n}:arb")

    def catalogue(self, n: int) -> str:
        """DATA:CATalog?: what is held, then what is built in."""
        return ",".join(f'"{name}"' for name in (*sorted(self.channel(n).memory.held, reverse=True), *_BUILT_IN))

    def copies(self, n: int) -> list[str]:
        """Return the names in the four places."""
        return [name for name in self.channel(n).memory.held if name != "VOLATILE"]

    def copy(self, n: int, parameters: list[str]) -> None:
        """DATA:COPY: from the volatile memory into one of four places.  Raises ScpiError."""
        if not parameters:
            raise ScpiError(-109)
        name, held = plain_name(parameters[0]), self.channel(n).memory.held
        if optional_parameter(parameters[1:]).upper() not in {"", "VOLATILE"}:
            raise DeviceError(784, "Name of source arb waveform for copy must be VOLATILE")
        if "VOLATILE" not in held:
            raise DeviceError(785, "Specified arb waveform does not exist")
        if name in _BUILT_IN:
            raise DeviceError(782, "Cannot overwrite a built-in waveform")
        if name not in held and len(held) > _KEPT:
            raise DeviceError(781, "Not enough memory to store new arb waveform; use DATA:DELETE")
        held[name] = held["VOLATILE"]

    def delete(self, n: int, parameters: list[str]) -> None:
        """DATA:DELete: a waveform that is not selected.  Raises ScpiError."""
        channel, name = self.channel(n), plain_name(parameter(parameters))
        if name in _BUILT_IN:
            raise DeviceError(786, "Cannot delete a built-in arb waveform")
        if name == channel["arb"]:
            raise DeviceError(787, "Cannot delete the currently selected active arb waveform")
        if name not in channel.memory.held:
            raise DeviceError(785, "Specified arb waveform does not exist")
        del channel.memory.held[name]

    def delete_all(self, n: int) -> None:
        """DATA:DELete:ALL: all but the one that is selected."""
        channel = self.channel(n)
        channel.memory.held = {name: held for name, held in channel.memory.held.items() if name == channel["arb"]}
