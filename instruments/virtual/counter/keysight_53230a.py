"""A virtual 53230A: counts what crosses its trigger level in the light it is shown."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, ClassVar

from instruments.ieee488 import INFINITY
from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import number, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.counter.counter import DARK, Function, darkness
from instruments.virtual.counter.keysight_53230a_readings import Readings53230A
from instruments.virtual.counter.measurements import Looks, Measurement, Span
from instruments.virtual.counter.parameters import channels_of, without_channels
from instruments.virtual.counter.run import Run

if TYPE_CHECKING:
    from instruments.virtual.core.device import Clock
    from instruments.virtual.core.steps import Steps
    from instruments.virtual.counter.edges import Signal

#: From the end of a measurement to the beginning of the next, but for gap-free ones [s] (estimated).
_DEAD = 1e-3
#: Digits a second: a gate of 1 s resolves a part in 10¹² (53230A data sheet: 12 digits/s, 20 ps).
_RESOLUTION = 1e-12


class Virtual53230A(Readings53230A):
    """A reciprocal counter: whole periods between the first edge and the first one after the gate, over their time.

    signal, second: the voltages at the inputs 1 and 2.

    Sources: Keysight 53220A/53230A Programmer's Reference and User's Guide.  The guide gives readings a three-digit
    exponent; here it has two, as for every other instrument on this bench.  The time-out is 1 s in the guide and off
    in the reference, when shipped: here 1 s, and neither a reset nor a configuration changes it.
    """

    identity = "Keysight Technologies,53230A,VIRTUAL,3.09-levilab"
    functions: ClassVar = {
        "FREQ": Function("FREQuency"),
        "PER": Function("PERiod"),
        "SPER": Function("SPERiod"),
        "TINT": Function("TINTerval", inputs=2),
        "PWID": Function("PWIDth"),
        "NWID": Function("NWIDth"),
        "PDUT": Function("PDUTycycle"),
        "NDUT": Function("NDUTycycle"),
        "TOT": Function("TOTalize:TIMed"),
    }

    def __init__(self, clock: Clock, *, signal: Signal, second: Signal = darkness) -> None:
        super().__init__(clock, signal=signal, second=second)
        self.settings["timeout"] = 1.0

    def table(self) -> tuple[Command, ...]:
        """Its commands; sources: see the class."""
        return (
            *self._measuring(),
            *self._gate(),
            *self._input(1, "[1]"),
            *self._input(2, "2"),
            *self._triggering(),
            *self._memory_rows(),
            *self._calculation(),
            *self._system(),
        )

    def reset(self) -> None:
        """*RST; the time-out is in memory that keeps."""
        timeout = self.settings["timeout"]
        super().reset()
        self.settings["timeout"] = timeout

    # --- configuration ---

    def _measuring(self) -> tuple[Command, ...]:
        rows: list[Command] = []
        for name, function in self.functions.items():
            header = "[:SCALar][:VOLTage]:" + function.header

            def configure(parameters: list[str], name: str = name) -> None:
                self._configure(name, parameters)

            def measure(parameters: list[str], name: str = name) -> Steps[str]:
                self._configure(name, parameters)
                return (yield from self._read())

            rows += [
                Command("CONFigure" + header, configure, answers(self._configuration)),
                Command("MEASure" + header, get=measure),
            ]
        return (
            *rows,
            Command("CONFigure", get=answers(self._configuration)),
            Command("[SENSe[1]:]FUNCtion[:ON]", self._set_function, answers(lambda: f'"{self._function}"')),
            Command("INITiate[:IMMediate]", set=does(self._initiate)),
            Command("READ", get=answers(self._read)),
            Command("FETCh", get=answers(self._fetch)),
            Command("ABORt", set=does(self.abandon)),
        )

    def _configure(self, name: str, parameters: list[str]) -> None:
        """CONFigure: gate, trigger and level as after power-on; what is expected, and how finely, sets the gate."""
        channels = channels_of(parameters)
        if len(channels) > self.functions[name].inputs:
            raise ScpiError(-108)
        plain = without_channels(parameters)
        if len(plain) > 2:
            raise ScpiError(-108)
        gate = self._gate_for(name, plain)
        self.choose(name, channels or (1,))
        self.settings |= {"gate_source": "TIME", "gate": gate, "total_gate": gate, "mode": "AUTO"}
        self.settings |= {"samples": 1.0, "triggers": 1.0, "trigger_source": "IMM", "trigger_delay": 0.0}
        self.settings |= {f"automatic{channel}": True for channel in self._channels}
        self.settings |= {f"relative{channel}": 50.0 for channel in self._channels}

    @staticmethod
    def _gate_for(name: str, plain: list[str]) -> float:
        """The gate that resolves this [s].  Raises ScpiError."""
        expected, resolution = (
            math.nan
            if text.upper() in {"MIN", "MINIMUM", "MAX", "MAXIMUM", "DEF", "DEFAULT"}
            else number(text, low=0, high=1e12, default=0.1, unit="HZ" if name == "FREQ" else "S")
            for text in [*plain, "DEF", "DEF"][:2]
        )
        if name == "TOT":
            return 0.1 if math.isnan(expected) else min(max(expected, 1e-6), 1e3)
        if math.isnan(expected) or math.isnan(resolution) or not resolution:
            return 0.1
        return min(max(_RESOLUTION * expected / resolution, 1e-4), 1e3)

    def _configuration(self) -> str:
        where = ",".join(f"(@{channel})" for channel in self._channels)
        return f'"{self._function} {where}"'

    def _set_function(self, parameters: list[str]) -> None:
        self.choose_as_told(re.sub(r"[(@),]", " ", one(parameters).strip("\"'")).split())

    # --- measuring ---

    def _initiate(self) -> None:
        """INITiate: one run of as many readings as triggers and samples make."""
        gate = float(self.settings["total_gate" if self._function == "TOT" else "gate"])
        # a time-out below the gate counts as twice the gate
        timeout = float(self.settings["timeout"])
        timeout = timeout if timeout >= gate else 2 * gate
        gated = self._function in {"FREQ", "PER", "TOT"}
        gapless = self._function in {"FREQ", "PER"} and self.settings["mode"] in {"CONT", "RCON"}
        triggers = 1.0 if gapless else float(self.settings["triggers"])

        def measure(looks: Looks, begin: float, _: int) -> Measurement:
            deadline = begin + timeout if timeout < INFINITY else math.inf
            return self.measure(looks, Span(begin, gate, deadline))

        self.begin(
            Run(
                begin=self._ready,
                looks=self.looks(),
                measure=measure,
                samples=float(self.settings["samples"]),
                triggers=triggers,
                dead=0.0 if gapless else _DEAD,
                delay=float(self.settings["trigger_delay"]),
                least=gate if gated else 0.0,
                quiet=timeout if timeout < INFINITY else 10 * gate + DARK,
                immediate=self.settings["trigger_source"] == "IMM",
            )
        )

    def _read(self) -> Steps[str]:
        """READ?: INITiate, and the answer comes with the last reading."""
        if self.settings["trigger_source"] == "BUS":
            # the question would wait for a trigger that cannot come before it is answered
            raise ScpiError(-221)
        self._initiate()
        return (yield from self._fetch())
