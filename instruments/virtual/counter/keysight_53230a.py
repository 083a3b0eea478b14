"""A virtual 53230A: counts what crosses its trigger level in the light it is shown."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from instruments.ieee488 import INFINITY, NOT_A_NUMBER
from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import at_most_one, block_text, choice, limit, none, nr3, number, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.counter.counter import DARK, Function, VirtualCounter, darkness
from instruments.virtual.counter.edges import Input
from instruments.virtual.counter.measurements import Looks, Measurement, Span
from instruments.virtual.counter.parameters import channels_of, without_channels
from instruments.virtual.counter.run import Run

if TYPE_CHECKING:
    from instruments.clock import Clock
    from instruments.virtual.core.steps import Steps
    from instruments.virtual.counter.edges import Array, Signal

#: From the end of a measurement to the beginning of the next, but for gap-free ones [s] (estimated).
_DEAD = 1e-3
#: Digits a second: a gate of 1 s resolves a part in 10¹² (53230A data sheet: 12 digits/s, 20 ps).
_RESOLUTION = 1e-12
#: Schmitt trigger of the input [V] (53230A data sheet: 20 mV, 40 mV typical); ten times that in the 50 V range,
#: and about twice with noise rejection.
_HYSTERESIS = 0.04


class Virtual53230A(VirtualCounter):
    """A reciprocal counter: whole periods between the first edge and the first one after the gate, over their time.

    signal, second: the voltages at the inputs 1 and 2; resolution: of a gate of 1 s, relative.

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

    def __init__(
        self,
        clock: Clock,
        *,
        signal: Signal,
        second: Signal = darkness,
        identity: str | None = None,
        resolution: float = _RESOLUTION,
    ) -> None:
        self._resolution = resolution
        super().__init__(clock, signal=signal, second=second, identity=identity)
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

    def _gate_for(self, name: str, plain: list[str]) -> float:
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
        return min(max(self._resolution * expected / resolution, 1e-4), 1e3)

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

    # --- settings ---

    def _gate(self) -> tuple[Command, ...]:
        sources = ("TIME", "EXTernal", "ADVanced", "IMMediate")
        return (
            self.word("[SENSe[1]:]FREQuency:GATE:SOURce", "gate_source", sources, "TIME"),
            self.numeric("[SENSe[1]:]FREQuency:GATE:TIME", "gate", low=1e-6, high=1e3, default=0.1, unit="S"),
            self.word("[SENSe[1]:]FREQuency:GATE:POLarity", "gate_polarity", ("POSitive", "NEGative"), "POS"),
            self.word("[SENSe[1]:]FREQuency:MODE", "mode", ("AUTO", "RECiprocal", "CONTinuous", "RCONtinuous"), "AUTO"),
            self.word("[SENSe[1]:]TOTalize:GATE:SOURce", "total_source", sources, "TIME"),
            self.numeric("[SENSe[1]:]TOTalize:GATE:TIME", "total_gate", low=1e-6, high=1e3, default=0.1, unit="S"),
            self.word("[SENSe[1]:]TINTerval:GATE:SOURce", "interval_source", ("IMMediate", "ADVanced"), "IMM"),
            self.word("[SENSe[1]:]ROSCillator:SOURce", "reference", ("INTernal", "EXTernal"), "INT"),
            self.toggle("[SENSe[1]:]ROSCillator:SOURce:AUTO", "reference_auto", default=True),
            self.numeric(
                "[SENSe[1]:]ROSCillator:EXTernal:FREQuency", "reference_hz", low=1e6, high=1e7, default=1e7, unit="HZ"
            ),
        )

    def _input(self, channel: int, suffix: str) -> tuple[Command, ...]:
        head, name = f"INPut{suffix}:", str(channel)
        level = f"{head}LEVel[1]"
        return (
            self.word(head + "COUPling", "coupling" + name, ("AC", "DC"), "AC"),
            self.numeric(
                head + "IMPedance", "impedance" + name, low=50, high=1e6, default=1e6, unit="OHM", values=(50, 1e6)
            ),
            self.numeric(head + "PROBe", "probe_factor" + name, low=1, high=10, default=1, values=(1, 10)),
            self.numeric(head + "RANGe", "range" + name, low=5, high=50, default=5, unit="V", values=(5, 50)),
            self.word(head + "SLOPe[1]", "slope" + name, ("POSitive", "NEGative"), "POS"),
            self.toggle(head + "NREJect", "noise_rejection" + name),
            self.toggle(head + "FILTer[:LPASs][:STATe]", "filter" + name),
            self.automatic(level + ":AUTO", channel),
            self.level(level + "[:ABSolute]", channel, lambda: self._greatest_level(channel), nr3),
            self.integer(level + ":RELative", "relative" + name, low=10, high=90, default=50),
            Command(level + ":MAXimum", get=answers(lambda: nr3(self._extremes(channel)[1]))),
            Command(level + ":MINimum", get=answers(lambda: nr3(self._extremes(channel)[0]))),
            Command(level + ":PTPeak", get=answers(lambda: nr3(float(np.ptp(self._extremes(channel)))))),
        )

    def _triggering(self) -> tuple[Command, ...]:
        return (
            self.integer("SAMPle:COUNt", "samples", low=1, high=1e6, default=1),
            self.integer("TRIGger:COUNt", "triggers", low=1, high=1e6, default=1),
            self.word("TRIGger:SOURce", "trigger_source", ("IMMediate", "EXTernal", "BUS"), "IMM"),
            self.word("TRIGger:SLOPe", "trigger_slope", ("POSitive", "NEGative"), "NEG"),
            self.numeric("TRIGger:DELay", "trigger_delay", low=0, high=3600, default=0, unit="S"),
        )

    def _system(self) -> tuple[Command, ...]:
        return (
            Command("SYSTem:TIMeout", self._set_timeout, self._ask_timeout),
            self.numeric("SYSTem:ALEVel:FREQuency", "slowest", low=50, high=1e4, default=50, unit="HZ"),
            Command("SYSTem:PRESet", set=does(self.reset)),
            Command("STATus:OPERation:CONDition", get=answers(self._operation)),
            Command("STATus:OPERation[:EVENt]", get=answers(lambda: "+0")),
            Command("STATus:QUEStionable:CONDition", get=answers(lambda: f"{16384 * self._memory.lost:+d}")),
            Command("STATus:QUEStionable[:EVENt]", get=answers(lambda: f"{16384 * self._memory.lost:+d}")),
            self.integer("STATus:OPERation:ENABle", "operation_enable", low=0, high=65535, default=0),
            self.integer("STATus:QUEStionable:ENABle", "questionable_enable", low=0, high=65535, default=0),
            Command("STATus:PRESet", set=none),
            self.toggle("DISPlay[:WINDow][:STATe]", "display", default=True),
            Command("*OPT", get=answers(lambda: "0")),
        )

    def _operation(self) -> str:
        """Bit 4: measuring; bit 5: waiting for a trigger."""
        if self.idle(self._ready):
            return "+0"
        return "+32" if self._run and self._run.waiting else "+16"

    def _set_timeout(self, parameters: list[str]) -> None:
        text = one(parameters)
        seconds = (
            number(text, low=0.01, high=INFINITY, default=INFINITY, unit="S")
            if text.upper() not in {"MAX", "MAXIMUM"}
            else 2000.0
        )
        if 2000.0 < seconds < INFINITY:
            raise ScpiError(-222)
        self.settings["timeout"] = seconds

    def _ask_timeout(self, parameters: list[str]) -> str:
        asked = at_most_one(parameters)
        return nr3(limit(asked, low=0.01, high=2000, default=INFINITY) if asked else float(self.settings["timeout"]))

    # --- inputs ---

    def _wide(self, channel: int) -> float:
        """How much larger everything is in the 50 V range."""
        return 10.0 if float(self.settings[f"range{channel}"]) > 5 else 1.0

    def _greatest_level(self, channel: int) -> float:
        return 5.125 * self._wide(channel) * float(self.settings[f"probe_factor{channel}"])

    def entry(self, channel: int, *, falling: bool) -> Input:
        """See the base.  A probe's factor is in the levels, not in the voltage at the input."""
        setting = {name: self.settings[f"{name}{channel}"] for name in ("automatic", "level", "probe_factor")}
        relative = float(self.settings[f"relative{channel}"]) / 100
        noisy = 2.0 if self.settings[f"noise_rejection{channel}"] else 1.0
        return Input(
            level=None if setting["automatic"] else float(setting["level"]) / float(setting["probe_factor"]),
            hysteresis=_HYSTERESIS * self._wide(channel) * noisy,
            window=1 / float(self.settings["slowest"]),
            upper=relative,
            lower=relative,
            alternating=self.settings[f"coupling{channel}"] == "AC",
            falling=falling,
        )

    def _extremes(self, channel: int) -> tuple[float, float]:
        entry = self.entry(channel, falling=False)
        low, high = entry.extremes(self._signals[channel], min(self._ready, self.clock.now() + 1.0))
        self.busy_until(self._ready + entry.window)
        return low, high

    # --- readings ---

    def _memory_rows(self) -> tuple[Command, ...]:
        return (
            Command("R", get=self._remove_what_is_there),
            Command("DATA:REMove", get=self._remove),
            Command("DATA:POINts", get=answers(lambda: f"{self.there() - self._memory.fetched:+d}")),
            Command("DATA:LAST", get=answers(self._last)),
            Command("FORMat[:DATA]", self._set_format, answers(self._format)),
            self.word("FORMat:BORDer", "byte_order", ("NORMal", "SWAPped"), "NORM"),
        )

    def _calculation(self) -> tuple[Command, ...]:
        self._defaults["format"] = "ASC"
        head = "CALCulate[1]:AVERage:"
        names = {"AVERage": "mean", "SDEViation": "sdev", "MINimum": "min", "MAXimum": "max"}
        names |= {"PTPeak": "ptp", "ADEViation": "adev"}
        return (
            self.toggle("CALCulate[1][:STATe]", "mathematics"),
            self.toggle("CALCulate[1]:AVERage[:STATe]", "averaging"),
            Command(head + "ALL", get=answers(lambda: self._statistic("mean", "sdev", "min", "max"))),
            Command(head + "COUNt[:CURRent]", get=answers(lambda: f"{self.there() - self._counted_from:+d}")),
            Command(head + "CLEar[:IMMediate]", set=does(self._clear_statistics)),
            *(
                Command(head + word, get=answers(lambda name=name: self._statistic(name)))  # type: ignore[misc]
                for word, name in names.items()
            ),
        )

    # --- the memory ---

    def _fetch(self) -> Steps[str]:
        """FETCh?: all readings, when there are all; they stay in the memory."""
        if self._run is None and not self._memory.held:
            raise ScpiError(-230)
        if not (yield from self.wait_for()):
            return ""
        values, _ = self._memory.part(self._memory.fetched, self._memory.held)
        return self._spell(values, head="#0")

    def _remove_what_is_there(self, parameters: list[str]) -> str:
        """R? [n]: at most n of the readings that are there, as a block, taken out of the memory."""
        text = at_most_one(parameters)
        most = number(text, low=1, high=1e6, default=1e6) if text else math.inf
        there = self.there()
        if there == self._memory.fetched and self.idle(self._ready):
            raise ScpiError(-230)
        return self._take(int(min(most, there - self._memory.fetched)), as_block=True)

    def _remove(self, parameters: list[str]) -> Steps[str]:
        """DATA:REMove? n[,WAIT]: n readings, taken out of the memory, waited for if they are still to come."""
        words = without_channels(parameters)
        if not words:
            raise ScpiError(-109)
        if len(words) > 2 or (len(words) == 2 and words[1].upper() != "WAIT"):
            raise ScpiError(-224)
        count = int(number(words[0], low=1, high=1e6, default=1))
        there = self.there()
        if there - self._memory.fetched < count:
            gone = self._run.taken - self._memory.held if self._run else 0
            wanted = gone + self._memory.fetched + count
            if len(words) == 1 or self._run is None or wanted > self._run.wanted:
                raise ScpiError(-230)
            if not (yield from self.wait_for(wanted)):
                return ""
        return self._take(count, as_block=False)

    def _take(self, count: int, *, as_block: bool) -> str:
        start = self._memory.fetched
        self._memory.fetched += count
        values, _ = self._memory.part(start, start + count)
        if as_block and self.settings["format"] == "ASC":
            return block_text(",".join(map(nr3, values)).encode())
        return self._spell(values)

    def _last(self) -> str:
        there = self.there()
        return nr3(float(self._memory.part(there - 1, there)[0][0]) if there else NOT_A_NUMBER)

    # --- formats and statistics ---

    def _spell(self, values: Array, head: str = "") -> str:
        """Readings in the format that is set.  head: of a block, if it does not tell its length."""
        if self.settings["format"] == "ASC":
            return ",".join(map(nr3, values))
        data = values.astype("<f8" if self.settings["byte_order"] == "SWAP" else ">f8").tobytes()
        return head + data.decode("latin-1") if head else block_text(data)

    def _set_format(self, parameters: list[str]) -> None:
        words = without_channels(parameters)
        if not words:
            raise ScpiError(-109)
        wanted = choice(words[0], ("ASCii", "REAL"))
        length = {"ASC": "15", "REAL": "64"}[wanted]
        if len(words) > 2 or (len(words) == 2 and words[1].upper() not in {length, "DEF", "MIN", "MAX"}):
            raise ScpiError(-224)
        self.settings["format"] = wanted

    def _format(self) -> str:
        return "ASC,15" if self.settings["format"] == "ASC" else "REAL,64"

    def _statistic(self, *names: str) -> str:
        found = self.statistics()
        return ",".join(nr3(found[name]) for name in names)

    def _clear_statistics(self) -> None:
        self._counted_from = self.there()
