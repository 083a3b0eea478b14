"""A virtual 33220A: one channel, 20 MHz, 14 bits; an older dialect of the same language."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import at_most_one, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.generator.arbitrary import Refused, plain_name
from instruments.virtual.generator.family import Family, Waveform
from instruments.virtual.generator.generator import VirtualGenerator

if TYPE_CHECKING:
    from instruments.virtual.generator.channel import Channel

#: The waveforms that it is made with; 64 K points in each of the others.
_BUILT_IN = ("EXP_RISE", "EXP_FALL", "NEG_RAMP", "SINC", "CARDIAC")
_KEPT = 4


def _square(frequency: float) -> tuple[float, float]:
    """20 to 80 % up to 10 MHz, 40 to 60 % above."""
    return (20.0, 80.0) if frequency <= 10e6 else (40.0, 60.0)


class Virtual33220A(VirtualGenerator):
    """The 33220A.  Source: Agilent 33220A User's Guide, chapter 4."""

    identity = "Agilent Technologies,33220A,VIRTUAL,2.02-2.02-22-2"
    family = Family(
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
        least_vpp=10e-3,
        shortest_pulse=20e-9,
        shortest_edge=5e-9,
        longest_edge=100e-9,
        first_edge=5e-9,
        longest_period=2000.0,
        most_cycles=50_000,
        longest_burst=500.0,
        burst_rest=200e-9,
        longest_delay=85.0,
        longest_sweep=500.0,
        points=(1, 65_536),
        room=65_536,
    )

    @staticmethod
    def printed(value: float) -> str:
        """A number as this family prints it: fourteen digits.

        >>> Virtual33220A.printed(1000.0)
        '+1.0000000000000E+03'
        """
        return f"{value:+.13E}"

    def arbitrary_rows(self, channel: Channel) -> tuple[Command, ...]:
        """The waveform in the volatile memory, four that are kept, and the built-in ones."""
        self._defaults["arb"] = "EXP_RISE"
        channel.library = {name: channel.library[name] for name in _BUILT_IN}
        data = "[SOURce[1]:]DATA"

        def keep(parameters: list[str], *, dac: bool) -> None:
            if len(parameters) < 2:
                raise ScpiError(-109)
            if plain_name(parameters[0]) != "VOLATILE":
                raise ScpiError(-224, parameters[0][:20])
            channel.memory.held.pop("VOLATILE", None)
            self.store(channel, "VOLATILE", parameters[1:], dac=dac, full_scale=8191.0 if dac else 1.0)
            self.changed("arb")

        def catalogue() -> str:
            return ",".join(f'"{name}"' for name in (*sorted(channel.memory.held, reverse=True), *_BUILT_IN))

        def kept() -> list[str]:
            return [name for name in channel.memory.held if name != "VOLATILE"]

        return (
            Command("[SOURce[1]:]FUNCtion:USER", partial(self._select, channel), answers(lambda: str(channel["arb"]))),
            Command(data, partial(keep, dac=False)),
            Command(data + ":DAC", partial(keep, dac=True)),
            Command(data + ":COPY", partial(self._copy, channel)),
            Command(data + ":DELete[:NAME]", partial(self._delete, channel)),
            Command(data + ":DELete:ALL", set=does(lambda: self._forget(channel, [*channel.memory.held]))),
            Command(data + ":CATalog", get=answers(catalogue)),
            Command(data + ":NVOLatile:CATalog", get=answers(lambda: ",".join(f'"{k}"' for k in kept()) or '""')),
            Command(data + ":NVOLatile:FREE", get=answers(lambda: f"{_KEPT - len(kept()):+d}")),
            *self.attributes(channel, data),
            self.switch("[SOURce[1]:]MARKer[:STATe]", "marker"),
            Command("[SOURce[1]:]PHASe:UNLock:ERRor:STATe", set=lambda _: None, get=answers(lambda: "0")),
        )

    def _select(self, channel: Channel, parameters: list[str]) -> None:
        name = plain_name(one(parameters))
        if name not in channel.memory.held and name not in _BUILT_IN:
            raise Refused(785, "Specified arb waveform does not exist")
        channel["arb"] = name
        self.changed("arb")

    def _copy(self, channel: Channel, parameters: list[str]) -> None:
        """DATA:COPY: from the volatile memory into one of four places."""
        if not parameters:
            raise ScpiError(-109)
        name, held = plain_name(parameters[0]), channel.memory.held
        if at_most_one(parameters[1:]).upper() not in {"", "VOLATILE"}:
            raise Refused(784, "Name of source arb waveform for copy must be VOLATILE")
        if "VOLATILE" not in held:
            raise Refused(785, "Specified arb waveform does not exist")
        if name in _BUILT_IN:
            raise Refused(782, "Cannot overwrite a built-in waveform")
        if name not in held and len(held) > _KEPT:
            raise Refused(781, "Not enough memory to store new arb waveform; use DATA:DELETE")
        held[name] = held["VOLATILE"]

    def _delete(self, channel: Channel, parameters: list[str]) -> None:
        name = plain_name(one(parameters))
        if name in _BUILT_IN:
            raise Refused(786, "Cannot delete a built-in arb waveform")
        if name == channel["arb"]:
            raise Refused(787, "Cannot delete the currently selected active arb waveform")
        if name not in channel.memory.held:
            raise Refused(785, "Specified arb waveform does not exist")
        self._forget(channel, [name])

    @staticmethod
    def _forget(channel: Channel, names: list[str]) -> None:
        for name in names:
            if name != channel["arb"]:
                del channel.memory.held[name]
