"""A virtual 53230A: counts what crosses its trigger level in the light it is shown."""

import math
from typing import Any, ClassVar

from instruments.clock import Clock
from instruments.ieee488 import INFINITY, NOT_A_NUMBER
from instruments.virtual.core.parameters import block_text, choice, limit, number, optional_parameter, parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Both, Do, Number, Own, Row, Switch, Word
from instruments.virtual.core.signal import Array
from instruments.virtual.core.steps import Steps
from instruments.virtual.counter.counter import (
    AUTOMATIC,
    DARK,
    INPUT,
    LEVEL,
    SHARED,
    SYSTEM,
    Count,
    Function,
    VirtualCounter,
    channels_of,
    without_channels,
)
from instruments.virtual.counter.edges import TriggerInput
from instruments.virtual.counter.measurements import GateTime, Inputs, Measurement
from instruments.virtual.counter.run import Run

#: From the end of a measurement to the beginning of the next, but for gap-free ones [s] (estimated).
_DEAD = 1e-3
#: Schmitt trigger of the input [V] (53230A data sheet: 20 mV, 40 mV typical); ten times that in the 50 V range.
_HYSTERESIS = 0.04


_FUNCTIONS = {
    "FREQ": Function("FREQuency"),
    "PER": Function("PERiod"),
    "SPER": Function("SPERiod"),
    "TINT": Function("TINTerval", inputs=2),
}
_HEADERS = {name: "[:SCALar][:VOLTage]:" + function.header for name, function in _FUNCTIONS.items()}

_MEASURING: tuple[Row, ...] = (
    *(
        Own("CONFigure" + header, lambda d, p, f=name: d.configure(f, p), lambda d: d.configuration())
        for name, header in _HEADERS.items()
    ),
    *(Both("MEASure" + header, answer=lambda d, p, f=name: d.measure_once(f, p)) for name, header in _HEADERS.items()),
    Ask("READ", lambda d: d.read()),
    Ask("FETCh", lambda d: d.fetch()),
)
_GATE: tuple[Row, ...] = (
    Word("[SENSe[1]:]FREQuency:GATE:SOURce", "gate_source", "TIME EXTernal ADVanced IMMediate"),
    Number("[SENSe[1]:]FREQuency:GATE:TIME", "gate", 0.1, (1e-6, 1e3), "S"),
    Word("[SENSe[1]:]FREQuency:GATE:POLarity", "gate_polarity", "POSitive NEGative"),
    Word("[SENSe[1]:]FREQuency:MODE", "mode", "AUTO RECiprocal CONTinuous RCONtinuous"),
    Word("[SENSe[1]:]TINTerval:GATE:SOURce", "interval_source", "IMMediate ADVanced"),
    Word("[SENSe[1]:]ROSCillator:SOURce", "reference", "INTernal EXTernal"),
    Switch("[SENSe[1]:]ROSCillator:SOURce:AUTO", "reference_auto", default=True),
    Number("[SENSe[1]:]ROSCillator:EXTernal:FREQuency", "reference_hz", 1e7, (1e6, 1e7), "HZ"),
)
_INPUT: tuple[Row, ...] = (
    *INPUT,
    Number("INPut[n]:PROBe", "probe_factor{n}", 1.0, (1, 10), values=(1, 10)),
    Number("INPut[n]:RANGe", "range{n}", 5.0, (5, 50), "V", values=(5, 50)),
    Word("INPut[n]:SLOPe[1]", "slope{n}", "POSitive NEGative"),
    Own("INPut[n]:LEVel[1]:AUTO", lambda d, n, p: d.set_automatic(n, p), lambda d, n: d.automatic(n), AUTOMATIC),
    Both("INPut[n]:LEVel[1][:ABSolute]", lambda d, n, p: d.set_level(n, p), lambda d, n, p: d.level(n, p), LEVEL),
)
_TRIGGERING: tuple[Row, ...] = (
    Count("SAMPle:COUNt", "samples", 1.0, (1, 1e6)),
    Count("TRIGger:COUNt", "triggers", 1.0, (1, 1e6)),
    Word("TRIGger:SOURce", "trigger_source", "IMMediate EXTernal BUS"),
    Word("TRIGger:SLOPe", "trigger_slope", "POSitive *NEGative"),
    Number("TRIGger:DELay", "trigger_delay", 0.0, (0, 3600), "S"),
)
_MEMORY: tuple[Row, ...] = (
    Both("R", answer=lambda d, p: d.remove_available(p)),
    Both("DATA:REMove", answer=lambda d, p: d.remove(p)),
    Ask("DATA:POINts", lambda d: f"{d.points():+d}"),
    Ask("DATA:LAST", lambda d: d.last()),
    Own("FORMat[:DATA]", lambda d, p: d.set_format(p), lambda d: d.format(), keeps=("format", "ASC")),
)
_STATISTICS = {
    "AVERage": "mean",
    "SDEViation": "sdev",
    "MINimum": "min",
    "MAXimum": "max",
    "PTPeak": "ptp",
    "ADEViation": "adev",
}
_CALCULATION: tuple[Row, ...] = (
    Switch("CALCulate[1][:STATe]", "mathematics"),
    Switch("CALCulate[1]:AVERage[:STATe]", "averaging"),
    Ask("CALCulate[1]:AVERage:ALL", lambda d: d.statistic("mean", "sdev", "min", "max")),
    Ask("CALCulate[1]:AVERage:COUNt[:CURRent]", lambda d: f"{d.number_in_statistics():+d}"),
    Do("CALCulate[1]:AVERage:CLEar[:IMMediate]", lambda d: d.clear_statistics()),
    *(Ask("CALCulate[1]:AVERage:" + word, lambda d, s=name: d.statistic(s)) for word, name in _STATISTICS.items()),
)
_SYSTEM: tuple[Row, ...] = (
    Both("SYSTem:TIMeout", lambda d, p: d.set_timeout(p), lambda d, p: d.timeout(p), keeps=("timeout", 1.0)),
    Number("SYSTem:ALEVel:FREQuency", "slowest", 50.0, (50, 1e4), "HZ"),
    Ask("STATus:OPERation[:EVENt]", lambda _d: "+0"),
    Ask("STATus:QUEStionable:CONDition", lambda d: d.questionable()),
    Ask("STATus:QUEStionable[:EVENt]", lambda d: d.questionable()),
    Count("STATus:OPERation:ENABle", "operation_enable", 0.0, (0, 65535)),
    Count("STATus:QUEStionable:ENABle", "questionable_enable", 0.0, (0, 65535)),
    Switch("DISPlay[:WINDow][:STATe]", "display", default=True),
)


class Virtual53230A(VirtualCounter):
    """A reciprocal counter: whole periods between the first edge and the first one after the gate, over their time.

    Args:
        clock: of the bench.
        digits: resolution of a gate of 1 s (data sheet).
        model: see the base.

    Sources: Keysight 53220A/53230A Programmer's Reference and User's Guide.  The guide gives readings a three-digit
    exponent; here it has two, as for every other instrument on this bench.  The time-out is 1 s in the guide and off
    in the reference, when shipped: here 1 s, and neither a reset nor a configuration changes it.  Widths of pulses,
    duty cycles and totals are missing.
    """

    identity = "Keysight Technologies,53230A,VIRTUAL,3.09-levilab"
    FUNCTIONS: ClassVar = _FUNCTIONS
    CHANNEL_ROWS: ClassVar = _INPUT
    ROWS: ClassVar = (*SHARED, *SYSTEM, *_MEASURING, *_GATE, *_TRIGGERING, *_MEMORY, *_CALCULATION, *_SYSTEM)

    def __init__(self, clock: Clock, *, digits: int = 12, **model: Any) -> None:
        self._resolution = 10.0**-digits
        super().__init__(clock, **model)

    def reset(self) -> None:
        """*RST; the time-out is in memory that keeps."""
        timeout = self.settings["timeout"]
        super().reset()
        self.settings["timeout"] = timeout

    # --- configuration ---

    def configure(self, name: str, parameters: list[str]) -> None:
        """CONFigure: gate, trigger and level as after power-on; what is expected, and how finely, sets the gate."""
        channels = channels_of(parameters, self.numbered)
        if len(channels) > self.functions[name].inputs:
            raise ScpiError(-108)
        plain = without_channels(parameters)
        if len(plain) > 2:
            raise ScpiError(-108)
        gate = self._gate_for(name, plain)
        self.choose(name, channels or (1,))
        self.settings |= {"gate_source": "TIME", "gate": gate, "mode": "AUTO"}
        self.settings |= {"samples": 1.0, "triggers": 1.0, "trigger_source": "IMM", "trigger_delay": 0.0}
        self.settings |= {f"automatic{channel}": True for channel in self._channels}

    def _gate_for(self, name: str, plain: list[str]) -> float:
        """Return the gate that resolves this [s].  Raises ScpiError."""
        expected, resolution = (
            math.nan
            if text.upper() in {"MIN", "MINIMUM", "MAX", "MAXIMUM", "DEF", "DEFAULT"}
            else number(text, low=0, high=1e12, default=0.1, unit="HZ" if name == "FREQ" else "S")
            for text in [*plain, "DEF", "DEF"][:2]
        )
        if math.isnan(expected) or math.isnan(resolution) or not resolution:
            return 0.1
        return min(max(self._resolution * expected / resolution, 1e-4), 1e3)

    # --- measuring ---

    def initiate(self) -> None:
        """INITiate: one run of as many readings as triggers and samples make."""
        gate = self.value("gate")
        # a time-out below the gate counts as twice the gate
        timeout = self.value("timeout")
        timeout = timeout if timeout >= gate else 2 * gate
        gated = self._function in {"FREQ", "PER"}
        gapless = gated and self.settings["mode"] in {"CONT", "RCON"}
        triggers = 1.0 if gapless else self.value("triggers")

        def measure(inputs: Inputs, begin: float, _: int) -> Measurement:
            deadline = begin + timeout if timeout < INFINITY else math.inf
            return self.measure(inputs, GateTime(begin, gate, deadline))

        self.begin(
            Run(
                begin=self._ready,
                inputs=self.inputs(),
                measure=measure,
                samples=self.value("samples"),
                triggers=triggers,
                dead_time=0.0 if gapless else _DEAD,
                delay=self.value("trigger_delay"),
                shortest=gate if gated else 0.0,
                patience=timeout if timeout < INFINITY else 10 * gate + DARK,
                immediate=self.settings["trigger_source"] == "IMM",
            )
        )

    def operation(self) -> str:
        """STATus:OPERation:CONDition?, bit 4: measuring; bit 5: waiting for a trigger."""
        if self.is_idle(self._ready):
            return "+0"
        return "+32" if self._run and self._run.waiting else "+16"

    def questionable(self) -> str:
        """STATus:QUEStionable?, bit 14: readings were lost."""
        return f"{16384 * self._memory.overflowed:+d}"

    def set_timeout(self, parameters: list[str]) -> None:
        """SYSTem:TIMeout: up to 2000 s, or infinite.  Raises ScpiError."""
        text = parameter(parameters)
        seconds = (
            number(text, low=0.01, high=INFINITY, default=INFINITY, unit="S")
            if text.upper() not in {"MAX", "MAXIMUM"}
            else 2000.0
        )
        if 2000.0 < seconds < INFINITY:
            raise ScpiError(-222)
        self.settings["timeout"] = seconds

    def timeout(self, parameters: list[str]) -> str:
        """SYSTem:TIMeout?: what is set, or its limits.  Raises ScpiError."""
        asked = optional_parameter(parameters)
        return self.spell(limit(asked, low=0.01, high=2000, default=INFINITY) if asked else self.value("timeout"))

    # --- inputs ---

    def _wide(self, channel: int) -> float:
        """Return the factor of all voltages in the 50 V range."""
        return 10.0 if self.value(f"range{channel}") > 5 else 1.0

    def greatest_level(self, channel: int) -> float:
        """See the base."""
        return 5.125 * self._wide(channel) * self.value(f"probe_factor{channel}")

    def trigger_input(self, channel: int) -> TriggerInput:
        """See the base.  A probe's factor is in the levels, not in the voltage at the input."""
        setting = {name: self.settings[f"{name}{channel}"] for name in ("automatic", "level", "probe_factor")}
        return TriggerInput(
            level=None if setting["automatic"] else float(setting["level"]) / float(setting["probe_factor"]),
            hysteresis=_HYSTERESIS * self._wide(channel),
            window=1 / self.value("slowest"),
            alternating=self.settings[f"coupling{channel}"] == "AC",
            falling=self.is_falling(channel),
        )

    # --- the memory ---

    def remove_available(self, parameters: list[str]) -> str:
        """R? [n]: at most n of the readings that are there, as a block, taken out of the memory."""
        text = optional_parameter(parameters)
        most = number(text, low=1, high=1e6, default=1e6) if text else math.inf
        there = self.available()
        if there == self._memory.n_fetched and self.is_idle(self._ready):
            raise ScpiError(-230)
        return self._take(int(min(most, there - self._memory.n_fetched)), as_block=True)

    def remove(self, parameters: list[str]) -> Steps[str]:
        """DATA:REMove? n[,WAIT]: n readings, taken out of the memory, waited for if they are still to come."""
        words = without_channels(parameters)
        if not words:
            raise ScpiError(-109)
        if len(words) > 2 or (len(words) == 2 and words[1].upper() != "WAIT"):
            raise ScpiError(-224)
        count = int(number(words[0], low=1, high=1e6, default=1))
        there = self.available()
        if there - self._memory.n_fetched < count:
            gone = self._run.n_taken - self._memory.size if self._run else 0
            wanted = gone + self._memory.n_fetched + count
            if len(words) == 1 or self._run is None or wanted > self._run.wanted:
                raise ScpiError(-230)
            if not (yield from self.wait_for(wanted)):
                return ""
        return self._take(count, as_block=False)

    def _take(self, count: int, *, as_block: bool) -> str:
        start = self._memory.n_fetched
        self._memory.n_fetched += count
        values, _ = self._memory.slice(start, start + count)
        if as_block and self.settings["format"] == "ASC":
            return block_text(",".join(map(self.spell, values)).encode())
        return self.spell_all(values, head="")

    def points(self) -> int:
        """DATA:POINts?: readings that are there and have not been removed."""
        return self.available() - self._memory.n_fetched

    def last(self) -> str:
        """DATA:LAST?: the latest reading."""
        there = self.available()
        return self.spell(float(self._memory.slice(there - 1, there)[0][0]) if there else NOT_A_NUMBER)

    # --- formats and statistics ---

    def spell_all(self, values: Array, *, head: str = "#0") -> str:
        """See the base: in the format that is set.  head: of a block, if it does not give its length."""
        if self.settings["format"] == "ASC":
            return super().spell_all(values)
        data = values.astype("<f8" if self.settings["byte_order"] == "SWAP" else ">f8").tobytes()
        return head + data.decode("latin-1") if head else block_text(data)

    def set_format(self, parameters: list[str]) -> None:
        """FORMat: ASCii or REAL, with a length that there is.  Raises ScpiError."""
        words = without_channels(parameters)
        if not words:
            raise ScpiError(-109)
        wanted = choice(words[0], ("ASCii", "REAL"))
        length = {"ASC": "15", "REAL": "64"}[wanted]
        if len(words) > 2 or (len(words) == 2 and words[1].upper() not in {length, "DEF", "MIN", "MAX"}):
            raise ScpiError(-224)
        self.settings["format"] = wanted

    def format(self) -> str:
        """FORMat?: the word and the length."""
        return "ASC,15" if self.settings["format"] == "ASC" else "REAL,64"

    def statistic(self, *names: str) -> str:
        """CALCulate:AVERage: these numbers of what was measured."""
        found = self.statistics()
        return ",".join(self.spell(found[name]) for name in names)

    def number_in_statistics(self) -> int:
        """Return the number of readings in the statistics."""
        return self.available() - self._counted_from

    def clear_statistics(self) -> None:
        """CALCulate:AVERage:CLEar: those that come next are counted."""
        self._counted_from = self.available()
