"""A virtual CNT-91: back-to-back frequencies with time stamps, from the light it is shown."""

import math
import struct
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import ClassVar

from instruments.ieee488 import INFINITY
from instruments.virtual.core.parameters import block_text, number
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
from instruments.virtual.counter.measurements import GateTime, Inputs, Measurement, Wanted, first_edge
from instruments.virtual.counter.run import Run

#: From the end of a measurement to the beginning of the next, but for back-to-back ones [s] (handbook, 8-72: 4 µs
#: and more; the calibration of the interpolators is 400 µs, estimated).
_DEAD, _CALIBRATION = 8e-6, 4e-4
#: Settings that a measurement under way does not feel.
_HARMLESS = {"format", "byte_order", "stamps", "most", "display", "average_type"}
_BACK_TO_BACK = {"FREQ:BTB", "PER:BTB"}
#: Schmitt trigger at a fixed level [V] (CNT-90 series data sheet: sensitivity 15 mV r.m.s.); ten times that behind
#: the attenuator.
_HYSTERESIS = 0.04
#: Automatic level: the signal must repeat this often [Hz] (user manual of the series, 3: 100 Hz unless changed in its
#: menu), and for frequency the trigger fires at 70 % and is armed at 30 % of peak to peak (handbook, 8-49).
_SLOWEST, _UPPER, _LOWER = 100.0, 0.7, 0.3
#: Most readings that one FETCh:ARRay? brings (handbook, 8-39).
_MOST = 10_000.0


def number_text(value: float) -> str:
    """Return a number as this instrument prints it: fourteen digits.

    >>> number_text(2e-8), number_text(9.91e37)
    ('+2.0000000000000E-08', '+9.9100000000000E+37')
    """
    return f"{value:+.13E}"


_FUNCTIONS = {
    "FREQ": Function("FREQuency"),
    "FREQ:BTB": Function("FREQuency:BTBack", kind="FREQ"),
    "PER": Function("PERiod[:AVERage]"),
    "PER:BTB": Function("PERiod:BTBack", kind="SPER"),
    "PER:SING": Function("PERiod:SINGle", kind="SPER"),
    "TINT": Function("TINTerval", inputs=2),
}
#: Behind CONFigure and MEASure: header, function, and whether an array of results is meant.
_WAYS = tuple(
    (prefix + function.header, name, array)
    for name, function in _FUNCTIONS.items()
    for prefix, array in (("[:SCALar][:VOLTage]:", False), (":ARRay[:VOLTage]:", True))
)

_MEASURING: tuple[Row, ...] = (
    *(Both("CONFigure" + way, lambda d, p, f=name, a=array: d.configure(f, p, array=a)) for way, name, array in _WAYS),
    *(
        Both("MEASure" + way, answer=lambda d, p, f=name, a=array: d.measure_once(f, p, array=a))
        for way, name, array in _WAYS
    ),
    Switch("INITiate:CONTinuous", "continuous"),
    Number("[SENSe[1]:]ACQuisition:APERture", "gate", 0.01, (2e-8, 1e3), "S"),
    Word("[SENSe[1]:]ROSCillator:SOURce", "reference", "INTernal EXTernal *AUTO"),
    Switch("[SENSe[1]:]FREQuency:REGRession", "regression"),
)
_FETCHING: tuple[Row, ...] = (
    Ask("FETCh[:SCALar]", lambda d: d.fetch(1)),
    Both("FETCh:ARRay", answer=lambda d, p: d.fetch_array(p)),
    Ask("READ[:SCALar]", lambda d: d.read()),
    Both("READ:ARRay", answer=lambda d, p: d.read_array(p)),
    Ask("CALCulate:DATA", lambda d: d.fetch(-1)),
)
_INPUT: tuple[Row, ...] = (
    *INPUT,
    Number("INPut[n]:ATTenuation", "attenuation{n}", 1.0, (1, 10), spell="{:+.0f}".format, values=(1, 10)),
    Switch("INPut[n]:FILTer:DIGital", "digital_filter{n}"),
    Number("INPut[n]:FILTer:DIGital:FREQuency", "cutoff{n}", 1e5, (1, 5e7), "HZ"),
    Word("INPut[n]:SLOPe", "slope{n}", "POSitive NEGative"),
    Own("INPut[n]:LEVel:AUTO", lambda d, n, p: d.set_automatic(n, p), lambda d, n: d.automatic(n), AUTOMATIC),
    Both("INPut[n]:LEVel", lambda d, n, p: d.set_level(n, p), lambda d, n, p: d.level(n, p), LEVEL),
)
_ARMING: tuple[Row, ...] = (
    Count("ARM[:SEQuence[1]][:STARt][:LAYer[1]]:COUNt", "armings", 1.0, (1, 2**31 - 1), endless=True),
    Word("ARM[:SEQuence[1]][:STARt][:LAYer[1]]:SOURce", "arming", "IMMediate BUS EXT1 EXT2 EXT4"),
    Word("ARM[:SEQuence[1]][:STARt][:LAYer[1]]:SLOPe", "arming_slope", "POSitive NEGative"),
    Number("ARM[:SEQuence[1]][:STARt][:LAYer[1]]:DELay", "arming_delay", 0.0, (0, 2), "S"),
    Word("ARM[:SEQuence[1]][:STARt]:LAYer2:SOURce", "bus_arming", "IMMediate BUS"),
    Do("ARM[:SEQuence[1]][:STARt]:LAYer2[:IMMediate]", lambda d: d.arm()),
    Word("ARM:STOP:SOURce", "stop_arming", "IMMediate BUS EXT1 EXT2 EXT4 TIMer"),
    Count("TRIGger[:STARt]:COUNt", "triggers", 1.0, (1, 2**31 - 1), endless=True),
    Word("TRIGger[:STARt]:SOURce", "trigger_source", "IMMediate TIMer"),
    Number("TRIGger[:STARt]:TIMer", "trigger_timer", 0.02, (2e-6, 500), "S"),
)
_FORMAT: tuple[Row, ...] = (
    Word("FORMat[:DATA]", "format", "ASCii REAL PACKed"),
    Switch("FORMat:TINFormation", "stamps"),
    Count("FORMat:SMAX", "most", _MOST, (4, _MOST)),
)
_CALCULATION: tuple[Row, ...] = (
    Switch("CALCulate:STATe", "mathematics"),
    Switch("CALCulate:AVERage[:STATe]", "averaging"),
    Count("CALCulate:AVERage:COUNt", "averaged", 100.0, (2, 2e9)),
    Ask("CALCulate:AVERage:COUNt:CURRent", lambda d: str(d.available())),
    Word("CALCulate:AVERage:TYPE", "average_type", "MEAN SDEViation MINimum MAXimum ADEViation MINMax"),
    Ask("CALCulate:AVERage:ALL", lambda d: d.all_statistics()),
)
_SYSTEM: tuple[Row, ...] = (
    Switch("SYSTem:TOUT[:STATe]", "timeout_on"),
    Number("SYSTem:TOUT:TIME", "timeout", 0.1, (0.01, 1000), "S"),
    Switch("SYSTem:SDETect", "signal_detection"),
    Switch("SYSTem:TALKonly", "talk_only"),
    Ask("STATus:OPERation[:EVENt]"),
    Ask("STATus:QUEStionable:CONDition"),
    Ask("STATus:QUEStionable[:EVENt]"),
    Switch("DISPlay:ENABle", "display", default=True),
    Switch("CALibration:INTerpolator:AUTO", "calibrating", default=True),
)


@dataclass
class _Pacing:
    """Back to back: a time stamp at the first edge after each tick of the aperture, none lost, no dead time."""

    aperture: float
    _origin: float = math.nan
    _ticks: int = field(default=0)

    def gate(self, opened: float, begins: bool) -> float:  # noqa: FBT001
        """Return the length of this measurement's gate, to end at its tick [s]."""
        if begins or math.isnan(self._origin):
            self._origin, self._ticks = opened, 0
        self._ticks = max(self._ticks + 1, math.ceil((opened - self._origin) / self.aperture))
        return max(self._origin + self._ticks * self.aperture - opened, 0.0)


class VirtualCNT91(VirtualCounter):
    """Pendulum CNT-91, sold as Tektronix FCA3100 as well.

    What has no result is answered with 9.91E37, as in the GPIB mode compatible (handbook, 8-36).  The inputs 1 and 2
    are called A and B on the front.  Widths of pulses and duty cycles are missing.

    Sources: Programmer's Handbook of the CNT-90 series, 4031 600 90201 (pages as cited); PyMeasure's CNT91, QMI's
    Tektronix_FCA3000 and QCoDeS's FCA3100 for what programs send.  What follows no source: the order of the limits
    of a statistic, and that CONFigure:ARRay sets the trigger count.
    """

    identity = "PENDULUM, CNT-91, VIRTUAL, V1.28 levilab"
    no_error = '0,"No error"'
    FUNCTIONS: ClassVar = _FUNCTIONS
    CHANNEL_ROWS: ClassVar = _INPUT
    ROWS: ClassVar = (*SHARED, *SYSTEM, *_MEASURING, *_FETCHING, *_ARMING, *_FORMAT, *_CALCULATION, *_SYSTEM)

    def abandon(self) -> None:
        """ABORt, and device clear; a free-running counter begins again."""
        super().abandon()
        if self.settings["continuous"]:
            self.initiate(endless=True)

    def on_change(self, name: str) -> None:
        """Let a free-running counter begin again with the new setting."""
        if name == "continuous" and not self.settings[name]:
            self._stop()
        elif self.settings.get("continuous") and name not in _HARMLESS:
            self._stop()
            self.initiate(endless=True)

    def reset(self) -> None:
        """*RST: it no longer runs freely."""
        self.settings["continuous"] = False
        super().reset()

    # --- configuration ---

    def configure(self, name: str, parameters: list[str], *, array: bool = False) -> None:
        """CONFigure: function, channels, one result or an array; the counter no longer runs freely."""
        channels, plain = channels_of(parameters, self.numbered), without_channels(parameters)
        if len(channels) > self.functions[name].inputs:
            raise ScpiError(-108)
        size = 1.0
        if array:
            if not plain:
                raise ScpiError(-109)
            size = float(round(number(plain[0], low=1, high=3.5e6, default=1)))
        for text in plain[array:]:  # expected value and resolution: this counter needs neither
            if text.upper() not in {"MIN", "MAX", "DEF"}:
                number(text, low=0, high=1e12, default=0)
        self.choose(name, channels or (1,))
        self.settings |= {"continuous": False, "armings": 1.0, "triggers": size}
        self.settings |= {"arming": "IMM", "bus_arming": "IMM", "trigger_source": "IMM"}

    def configuration(self) -> str:
        """CONFigure?: as of every counter, and whether an array is measured."""
        plain = super().configuration()
        return f'"ARR:{plain[1:]}' if self.value("triggers") > 1 else plain

    def function(self) -> str:
        """Answer FUNCtion? with the function that is set, and its channels."""
        return f'"{self._function} {",".join(map(str, self._channels))}"'

    # --- measuring ---

    def measure_once(self, name: str, parameters: list[str], *, array: bool = False) -> Steps[str]:
        """MEASure?: CONFigure, INITiate and FETCh?."""
        self.configure(name, parameters, array=array)
        self.initiate()
        return (yield from self.fetch(int(self._result_count()) if array else 1))

    def initiate(self, *, endless: bool = False) -> None:
        """INITiate."""
        gapless = self._function in _BACK_TO_BACK
        aperture, arming = self.value("gate"), str(self.settings["arming"])
        timeout = self.value("timeout") if self.settings["timeout_on"] else math.inf
        pacing = _Pacing(aperture)

        def measure(inputs: Inputs, begin: float, number: int) -> Measurement:
            deadline = begin + timeout
            if number == 0 and arming in {"EXT1", "EXT2"}:
                begin = yield from self._arming_time(inputs, int(arming[-1]), begin)
                deadline = begin + timeout
            gate = aperture
            if gapless:
                opened = yield from first_edge(inputs.finder(self._channels[0], begin), begin, deadline)
                gate = pacing.gate(opened.time, number == 0) if opened else aperture
            return (yield from self.measure(inputs, GateTime(begin, gate, deadline)))

        dead = 0.0 if gapless else _DEAD + _CALIBRATION * bool(self.settings["calibrating"])
        self.begin(
            Run(
                begin=self._ready,
                inputs=self.inputs(),
                measure=measure,
                samples=math.inf if endless else self._result_count(),
                dead_time=dead,
                delay=self.value("arming_delay"),
                shortest=aperture if self.kind in {"FREQ", "PER"} else 0.0,
                patience=timeout if timeout < math.inf else 10 * aperture + DARK,
                immediate=arming not in {"BUS", "EXT4"} and self.settings["bus_arming"] == "IMM",
            )
        )

    @staticmethod
    def _arming_time(inputs: Inputs, channel: int, begin: float) -> Generator[Wanted, None, float]:
        """Return the time of the arming input's edge [s]."""
        edge = yield from first_edge(inputs.finder(channel, begin), begin, math.inf)
        return edge.time if edge else begin

    def operation(self) -> str:
        """STATus:OPERation:CONDition?, bit 4: measuring."""
        return "0" if self.is_idle(self._ready) else "16"

    # --- how numbers are printed ---

    def spell(self, value: float) -> str:
        """See the base."""
        return number_text(value)

    def spell_whole(self, value: float) -> str:
        """Return the number without a plus sign, and infinity as a number."""
        return number_text(value) if value >= INFINITY else str(round(value))

    # --- inputs ---

    def greatest_level(self, channel: int) -> float:
        """See the base."""
        return 5.0 * self.value(f"attenuation{channel}")

    def trigger_input(self, channel: int) -> TriggerInput:
        """See the base.  Back to back, and for times, an automatic level is one level with a narrow hysteresis."""
        wide = self._function in {"FREQ", "PER"}
        return TriggerInput(
            level=None if self.settings[f"automatic{channel}"] else self.value(f"level{channel}"),
            hysteresis=_HYSTERESIS * self.value(f"attenuation{channel}"),
            window=1 / _SLOWEST,
            upper=_UPPER if wide else 0.5,
            lower=_LOWER if wide else 0.5,
            alternating=self.settings[f"coupling{channel}"] == "AC",
            falling=self.is_falling(channel),
        )

    # --- series ---

    def _result_count(self) -> float:
        """Return the number of results of one INITiate."""
        if self.settings["averaging"]:
            return self.value("averaged")
        return self.value("armings") * self.value("triggers")

    def read(self) -> Steps[str]:
        """READ? is ABORt, INITiate and FETCh?."""
        self._restart()
        return (yield from self.fetch(1))

    def read_array(self, parameters: list[str]) -> Steps[str]:
        """Execute READ:ARRay? n, which is READ? with n results.  Raises ScpiError."""
        count = self._size(parameters)
        if count > self._result_count():
            raise ScpiError(-221)
        self._restart()
        most = count if math.isfinite(count) else min(self._result_count(), self.value("most"))
        return (yield from self.fetch(int(most)))

    def _restart(self) -> None:
        self._stop()
        self.settings["continuous"] = False
        self.initiate()

    def _size(self, parameters: list[str]) -> float:
        words = without_channels(parameters)
        if len(words) != 1:
            raise ScpiError(-108 if words else -109)
        if words[0].upper() in {"MAX", "MAXIMUM"}:
            return math.inf
        return float(round(number(words[0], low=-_MOST, high=_MOST, default=1)))

    def fetch_array(self, parameters: list[str]) -> Steps[str]:
        """Execute FETCh:ARRay? n, or MAX for all there are.  Raises ScpiError."""
        count = self._size(parameters)
        if not count:
            raise ScpiError(-222)
        if math.isfinite(count):
            return (yield from self.fetch(int(count)))
        there = self.available()
        fresh = there - self._memory.n_fetched
        if not fresh and not self.is_idle(self._ready):
            raise ScpiError(-230)
        if not fresh:  # all were fetched: it begins again with the first one
            self._memory.n_fetched, fresh = 0, there
        return (yield from self.fetch(int(min(fresh, self.value("most"))), size_known=False))

    def fetch(self, count: int = 1, *, size_known: bool = True) -> Steps[str]:
        """Fetch results from where the last fetch ended; a negative number: the last ones, the place is kept."""
        if self._run is None and not self._memory.size:
            raise ScpiError(-230)
        if self.settings["averaging"]:
            return (yield from self._fetch_statistic())
        if count < 0:
            there = self.available()
            if there < -count and not (yield from self._wait_until(-count)):
                return ""
            there = self.available()
            return self._spell(*self._memory.slice(there + count, there))
        if self._memory.n_fetched >= self._memory.size and self.is_idle(self._ready):
            self._memory.n_fetched = 0
        start = self._memory.n_fetched
        if not (yield from self._wait_until(start + count)):
            return ""
        self._memory.n_fetched = start + count
        return self._spell(*self._memory.slice(start, start + count), size_known=size_known)

    def _wait_until(self, held: int) -> Steps[bool]:
        """Wait until the memory holds this number of readings.  Raises ScpiError if it never will."""
        gone = self._run.n_taken - self._memory.size if self._run else 0
        if held > self._memory.size and (self._run is None or gone + held > self._run.wanted):
            raise ScpiError(-230)
        return (yield from self.wait_for(gone + held))

    def _fetch_statistic(self) -> Steps[str]:
        """Fetch the statistics' result in place of readings, where statistics are on."""
        if not (yield from self.wait_for()):
            return ""
        name = {"MEAN": "mean", "SDEV": "sdev", "MIN": "min", "MAX": "max", "ADEV": "adev", "MINM": "min"}
        return number_text(self.statistics()[name[str(self.settings["average_type"])]])

    def all_statistics(self) -> Steps[str]:
        """Return mean, standard deviation, least, greatest, peak to peak."""
        yield from self.wait_for()
        found = self.statistics()
        return ",".join(number_text(found[name]) for name in ("mean", "sdev", "min", "max", "ptp"))

    # --- formats ---

    def _spell(self, values: Array, stamps: Array, *, size_known: bool = True) -> str:
        """Return results in the format that is set (handbook, 8-36 and 8-39).

        REAL is a block of eight bytes for each number, PACKed one block for all, time stamps in it as whole
        picoseconds; and if the size was not asked for, its length has six digits.
        """
        kind, order = self.settings["format"], "<" if self.settings["byte_order"] == "SWAP" else ">"
        pairs = [(float(value), float(stamp)) for value, stamp in zip(values, stamps, strict=True)]
        stamped = bool(self.settings["stamps"])
        numbers = [number for pair in pairs for number in pair[: 1 + stamped]]
        if kind == "ASC":
            return ",".join(map(number_text, numbers))
        if kind == "REAL":
            return ",".join(block_text(struct.pack(order + "d", value)) for value in numbers)
        data = b"".join(
            struct.pack(order + "d", value) + (struct.pack(order + "q", round(stamp * 1e12)) if stamped else b"")
            for value, stamp in pairs
        )
        return block_text(data) if size_known else f"#6{len(data):06d}" + data.decode("latin-1")
