"""The settings of a virtual 53230A: gate, inputs, triggers, and what stands by itself.  Sources: see its class."""

from __future__ import annotations

import numpy as np

from instruments.ieee488 import INFINITY
from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import at_most_one, limit, none, nr3, number, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.counter.counter import VirtualCounter
from instruments.virtual.counter.edges import Input

#: Schmitt trigger of the input [V] (53230A data sheet: 20 mV, 40 mV typical); ten times that in the 50 V range,
#: and about twice with noise rejection.
_HYSTERESIS = 0.04


class Settings53230A(VirtualCounter):
    """Rows for settings, and how the inputs look at their signals with them."""

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
            self.numeric(head + "IMPedance", "impedance" + name, low=50, high=1e6, default=1e6, unit="OHM"),
            self.numeric(head + "PROBe", "probe_factor" + name, low=1, high=10, default=1),
            self.numeric(head + "RANGe", "range" + name, low=5, high=50, default=5, unit="V"),
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
