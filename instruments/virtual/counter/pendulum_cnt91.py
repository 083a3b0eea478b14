"""A virtual CNT-91: back-to-back frequencies with time stamps, from the light it is shown."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from instruments.ieee488 import INFINITY, NOT_A_NUMBER
from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import at_most_one, block_text, choice, limit, none, number, one
from instruments.virtual.core.parser import Command, Row, ScpiError
from instruments.virtual.core.rows import Number
from instruments.virtual.counter.counter import DARK, Function, VirtualCounter, darkness
from instruments.virtual.counter.edges import Input
from instruments.virtual.counter.measurements import Looks, Measurement, Span, Wish, first_edge
from instruments.virtual.counter.parameters import channels_of, without_channels
from instruments.virtual.counter.run import Run

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from instruments.clock import Clock
    from instruments.virtual.core.steps import Steps
    from instruments.virtual.counter.edges import Array, Signal

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
_MOST = 10_000


def number_text(value: float) -> str:
    """A number as this instrument prints it: fourteen digits.

    >>> number_text(2e-8), number_text(9.91e37)
    ('+2.0000000000000E-08', '+9.9100000000000E+37')
    """
    return f"{value:+.13E}"


_CHANNEL: tuple[Row, ...] = (
    Number("INPut[n]:IMPedance", "impedance{n}", 1e6, (50, 1e6), "OHM", spell=number_text, values=(50, 1e6)),
    Number("INPut[n]:ATTenuation", "attenuation{n}", 1.0, (1, 10), spell="{:+.0f}".format, values=(1, 10)),
)


@dataclass
class _Pacing:
    """Back to back: a time stamp at the first edge after each tick of the aperture, none lost, no dead time."""

    aperture: float
    _origin: float = math.nan
    _ticks: int = field(default=0)

    def gate(self, opened: float, begins: bool) -> float:  # noqa: FBT001
        """How long this measurement's gate is, to end at its tick [s]."""
        if begins or math.isnan(self._origin):
            self._origin, self._ticks = opened, 0
        self._ticks = max(self._ticks + 1, math.ceil((opened - self._origin) / self.aperture))
        return max(self._origin + self._ticks * self.aperture - opened, 0.0)


class VirtualCNT91(VirtualCounter):
    """Pendulum CNT-91, sold as Tektronix FCA3100 as well.

    signal, second: the voltages at the inputs A and B; native: what has no result is answered with an empty line or
    a binary not-a-number, and not with 9.91E37 (the GPIB modes native and compatible, handbook, 8-36).

    Sources: Programmer's Handbook of the CNT-90 series, 4031 600 90201 (pages as cited); PyMeasure's CNT91, QMI's
    Tektronix_FCA3000 and QCoDeS's FCA3100 for what programs send.  What follows no source: the order of the limits
    of a statistic, and that CONFigure:ARRay sets the trigger count.
    """

    identity = "PENDULUM, CNT-91, VIRTUAL, V1.28 levilab"
    no_error = '0,"No error"'
    numbered = (1, 2)
    CHANNEL_ROWS: ClassVar = _CHANNEL
    functions: ClassVar = {
        "FREQ": Function("FREQuency"),
        "FREQ:BTB": Function("FREQuency:BTBack", kind="FREQ"),
        "PER": Function("PERiod[:AVERage]"),
        "PER:BTB": Function("PERiod:BTBack", kind="SPER"),
        "PER:SING": Function("PERiod:SINGle", kind="SPER"),
        "TINT": Function("TINTerval", inputs=2),
        "PWID": Function("PWIDth"),
        "NWID": Function("NWIDth"),
        "PDUT": Function("PDUTycycle"),
        "NDUT": Function("NDUTycycle"),
    }

    def __init__(
        self,
        clock: Clock,
        *,
        signal: Signal,
        second: Signal = darkness,
        identity: str | None = None,
        native: bool = False,
    ) -> None:
        self._native = native
        super().__init__(clock, signal=signal, second=second, identity=identity)

    def table(self) -> tuple[Command, ...]:
        """Its commands; sources: see the class."""
        return (
            *self._measuring(),
            *self._fetching(),
            *self._input(1, "[1]"),
            *self._input(2, "2"),
            *self._arming(),
            *self._formatting(),
            *self._calculation(),
            *self._system(),
        )

    def abandon(self) -> None:
        """ABORt, and device clear; a free-running counter begins anew."""
        super().abandon()
        if self.settings["continuous"]:
            self._initiate(endless=True)

    def changed(self, name: str) -> None:
        """A free-running counter begins anew with the new setting."""
        if name == "continuous" and not self.settings[name]:
            self._stop()
        elif self.settings.get("continuous") and name not in _HARMLESS:
            self._stop()
            self._initiate(endless=True)

    def reset(self) -> None:
        """*RST: it no longer runs freely."""
        self.settings["continuous"] = False
        super().reset()

    # --- configuration ---

    def _measuring(self) -> tuple[Command, ...]:
        rows: list[Command] = []
        for name, function in self.functions.items():
            for header, several in (("[:SCALar][:VOLTage]:", False), (":ARRay[:VOLTage]:", True)):
                rows += self._ways(name, header + function.header, several=several)
        return (
            *rows,
            Command("CONFigure", get=answers(self._configuration)),
            Command("[SENSe[1]:]FUNCtion[:ON]", self._set_function, answers(lambda: f'"{self._named()}"')),
            Command("INITiate[:IMMediate]", set=does(self._initiate)),
            self.toggle("INITiate:CONTinuous", "continuous"),
            Command("ABORt", set=does(self.abandon)),
            self._number("[SENSe[1]:]ACQuisition:APERture", "gate", low=2e-8, high=1e3, default=0.01, unit="S"),
            self.word("[SENSe[1]:]ROSCillator:SOURce", "reference", ("INTernal", "EXTernal", "AUTO"), "AUTO"),
            self.toggle("[SENSe[1]:]FREQuency:REGRession", "regression"),
        )

    def _ways(self, name: str, header: str, *, several: bool) -> list[Command]:
        """CONFigure and MEASure of one function, for one result or for several."""

        def configure(parameters: list[str]) -> None:
            self._configure(name, parameters, several=several)

        def measure(parameters: list[str]) -> Steps[str]:
            self._configure(name, parameters, several=several)
            self._initiate()
            return (yield from self._fetch(int(self._wanted()) if several else 1))

        return [Command("CONFigure" + header, configure), Command("MEASure" + header, get=measure)]

    def _configure(self, name: str, parameters: list[str], *, several: bool) -> None:
        """CONFigure: function, channels, one result or an array; the counter no longer runs freely."""
        channels, plain = channels_of(parameters), without_channels(parameters)
        if len(channels) > self.functions[name].inputs:
            raise ScpiError(-108)
        size = 1.0
        if several:
            if not plain:
                raise ScpiError(-109)
            size = float(round(number(plain[0], low=1, high=3.5e6, default=1)))
        for text in plain[several:]:  # expected value and resolution: this counter needs neither
            if text.upper() not in {"MIN", "MAX", "DEF"}:
                number(text, low=0, high=1e12, default=0)
        self.choose(name, channels or (1,))
        self.settings |= {"continuous": False, "armings": 1.0, "triggers": size}
        self.settings |= {"arming": "IMM", "bus_arming": "IMM", "trigger_source": "IMM"}

    def _named(self) -> str:
        return f"{self._function} {','.join(map(str, self._channels))}"

    def _configuration(self) -> str:
        where = ",".join(f"(@{channel})" for channel in self._channels)
        array = "ARR:" if self._value("triggers") > 1 else ""
        return f'"{array}{self._function} {where}"'

    def _set_function(self, parameters: list[str]) -> None:
        self.choose_as_told(one(parameters).strip("\"'").replace(",", " ").replace("@", "").split())

    # --- measuring ---

    def _initiate(self, *, endless: bool = False) -> None:
        """INITiate."""
        gapless = self._function in _BACK_TO_BACK
        aperture, arming = self._value("gate"), str(self.settings["arming"])
        timeout = self._value("timeout") if self.settings["timeout_on"] else math.inf
        pacing = _Pacing(aperture)

        def measure(looks: Looks, begin: float, number: int) -> Measurement:
            deadline = begin + timeout
            if number == 0 and arming in {"EXT1", "EXT2"}:
                begin = yield from self._armed(looks, int(arming[-1]), begin)
                deadline = begin + timeout
            gate = aperture
            if gapless:
                opened = yield from first_edge(looks.finder(self._channels[0], begin), begin, deadline)
                gate = pacing.gate(opened.time, number == 0) if opened else aperture
            return (yield from self.measure(looks, Span(begin, gate, deadline)))

        dead = 0.0 if gapless else _DEAD + _CALIBRATION * bool(self.settings["calibrating"])
        self.begin(
            Run(
                begin=self._ready,
                looks=self.looks(),
                measure=measure,
                samples=math.inf if endless else self._wanted(),
                dead=dead,
                delay=self._value("arming_delay"),
                least=aperture if self.kind in {"FREQ", "PER"} else 0.0,
                quiet=timeout if timeout < math.inf else 10 * aperture + DARK,
                immediate=arming not in {"BUS", "EXT4"} and self.settings["bus_arming"] == "IMM",
            )
        )

    @staticmethod
    def _armed(looks: Looks, channel: int, begin: float) -> Generator[Wish, None, float]:
        """When the arming input has its edge."""
        edge = yield from first_edge(looks.finder(channel, begin), begin, math.inf)
        return edge.time if edge else begin

    # --- settings ---

    def _input(self, channel: int, suffix: str) -> tuple[Command, ...]:
        head, name = f"INPut{suffix}:", str(channel)
        return (
            self.word(head + "COUPling", "coupling" + name, ("AC", "DC"), "AC"),
            self.toggle(head + "FILTer[:LPASs][:STATe]", "filter" + name),
            self.toggle(head + "FILTer:DIGital", "digital_filter" + name),
            self._number(head + "FILTer:DIGital:FREQuency", "cutoff" + name, low=1, high=5e7, default=1e5, unit="HZ"),
            self.word(head + "SLOPe", "slope" + name, ("POSitive", "NEGative"), "POS"),
            self.automatic(head + "LEVel:AUTO", channel),
            self.level(head + "LEVel", channel, lambda: 5.0 * self._attenuation(channel), number_text),
            self._number(head + "LEVel:RELative", "relative" + name, low=0, high=100, default=70),
        )

    def _arming(self) -> tuple[Command, ...]:
        start = "ARM[:SEQuence[1]][:STARt][:LAYer[1]]:"
        sources = ("IMMediate", "BUS", "EXT1", "EXT2", "EXT4")
        return (
            self._count(start + "COUNt", "armings"),
            self.word(start + "SOURce", "arming", sources, "IMM"),
            self.word(start + "SLOPe", "arming_slope", ("POSitive", "NEGative"), "POS"),
            self._number(start + "DELay", "arming_delay", low=0, high=2, default=0, unit="S"),
            self.word("ARM[:SEQuence[1]][:STARt]:LAYer2:SOURce", "bus_arming", ("IMMediate", "BUS"), "IMM"),
            Command("ARM[:SEQuence[1]][:STARt]:LAYer2[:IMMediate]", set=does(self.trigger)),
            self.word("ARM:STOP:SOURce", "stop_arming", (*sources, "TIMer"), "IMM"),
            self._count("TRIGger[:STARt]:COUNt", "triggers"),
            self.word("TRIGger[:STARt]:SOURce", "trigger_source", ("IMMediate", "TIMer"), "IMM"),
            self._number("TRIGger[:STARt]:TIMer", "trigger_timer", low=2e-6, high=500, default=0.02, unit="S"),
        )

    def _system(self) -> tuple[Command, ...]:
        return (
            self.toggle("SYSTem:TOUT[:STATe]", "timeout_on"),
            self._number("SYSTem:TOUT:TIME", "timeout", low=0.01, high=1000, default=0.1, unit="S"),
            self.toggle("SYSTem:SDETect", "signal_detection"),
            self.toggle("SYSTem:TALKonly", "talk_only"),
            Command("SYSTem:PRESet", set=does(self.reset)),
            Command("STATus:OPERation:CONDition", get=answers(lambda: str(0 if self.idle(self._ready) else 16))),
            Command("STATus:OPERation[:EVENt]", get=answers(lambda: "0")),
            Command("STATus:QUEStionable[:EVENt]", get=answers(lambda: "0")),
            Command("STATus:QUEStionable:CONDition", get=answers(lambda: "0")),
            Command("STATus:PRESet", set=none),
            self.toggle("DISPlay:ENABle", "display", default=True),
            self.toggle("CALibration:INTerpolator:AUTO", "calibrating", default=True),
            Command("AUTO", set=self._auto_set),
            Command("*OPT", get=answers(lambda: "0")),
        )

    def _number(self, pattern: str, name: str, *, low: float, high: float, default: float, unit: str = "") -> Command:
        """A row for a number, printed as this instrument does."""
        self._defaults[name] = default

        def ask(parameters: list[str]) -> str:
            asked = at_most_one(parameters)
            return number_text(limit(asked, low=low, high=high, default=default) if asked else self._value(name))

        read: Callable[[str], float] = lambda text: number(text, low=low, high=high, default=default, unit=unit)  # noqa: E731
        return Command(pattern, self._setter(name, read), ask)

    def _count(self, pattern: str, name: str) -> Command:
        """A row for a count that may be endless."""
        row = self.integer(pattern, name, low=1, high=2**31 - 1, default=1)
        plain = row.set

        def set_(parameters: list[str]) -> None:
            if [word.upper() for word in parameters] in (["INF"], ["INFINITY"]):
                self.settings[name] = INFINITY
                self.changed(name)
            elif plain:
                plain(parameters)

        return Command(pattern, set_, row.get)

    @staticmethod
    def spell_integer(value: float) -> str:
        """No plus sign, and infinity as a number."""
        return number_text(value) if value >= INFINITY else str(round(value))

    def _value(self, name: str) -> float:
        return float(self.settings[name])

    # --- inputs ---

    def _auto_set(self, parameters: list[str]) -> None:
        """AUTO ONCE, the AUTOSET key: levels are found by the counter."""
        choice(one(parameters), ("ONCE", "PRESet"))
        self.settings |= {"automatic1": True, "automatic2": True}

    def _attenuation(self, channel: int) -> float:
        return self._value(f"attenuation{channel}")

    def entry(self, channel: int, *, falling: bool) -> Input:
        """See the base.  Back to back, and for times, an automatic level is one level with a narrow hysteresis."""
        wide = self._function in {"FREQ", "PER"}
        return Input(
            level=None if self.settings[f"automatic{channel}"] else self._value(f"level{channel}"),
            hysteresis=_HYSTERESIS * self._attenuation(channel),
            window=1 / _SLOWEST,
            upper=_UPPER if wide else 0.5,
            lower=_LOWER if wide else 0.5,
            alternating=self.settings[f"coupling{channel}"] == "AC",
            falling=falling,
        )

    # --- results ---

    def _fetching(self) -> tuple[Command, ...]:
        return (
            Command("FETCh[:SCALar]", get=answers(lambda: self._fetch(1))),
            Command("FETCh:ARRay", get=self._fetch_array),
            Command("READ[:SCALar]", get=answers(self._read)),
            Command("READ:ARRay", get=self._read_array),
            Command("CALCulate:DATA", get=answers(lambda: self._fetch(-1))),
        )

    def _formatting(self) -> tuple[Command, ...]:
        return (
            self.word("FORMat[:DATA]", "format", ("ASCii", "REAL", "PACKed"), "ASC"),
            self.word("FORMat:BORDer", "byte_order", ("NORMal", "SWAPped"), "NORM"),
            self.toggle("FORMat:TINFormation", "stamps"),
            self.integer("FORMat:SMAX", "most", low=4, high=_MOST, default=_MOST),
        )

    def _calculation(self) -> tuple[Command, ...]:
        head = "CALCulate:AVERage:"
        words = ("MEAN", "SDEViation", "MINimum", "MAXimum", "ADEViation")
        return (
            self.toggle("CALCulate:STATe", "mathematics"),
            self.toggle("CALCulate:AVERage[:STATe]", "averaging"),
            self.integer(head + "COUNt", "averaged", low=2, high=2e9, default=100),
            Command(head + "COUNt:CURRent", get=answers(lambda: str(self.there()))),
            self.word(head + "TYPE", "average_type", (*words, "MINMax"), "MEAN"),
            Command(head + "ALL", get=answers(self._all_statistics)),
        )

    # --- series ---

    def _wanted(self) -> float:
        """Results of one INITiate."""
        if self.settings["averaging"]:
            return self._value("averaged")
        return self._value("armings") * self._value("triggers")

    def _read(self) -> Steps[str]:
        """READ? is ABORt, INITiate and FETCh?."""
        self._restart()
        return (yield from self._fetch(1))

    def _read_array(self, parameters: list[str]) -> Steps[str]:
        count = self._size(parameters)
        if count > self._wanted():
            raise ScpiError(-221)
        self._restart()
        most = count if math.isfinite(count) else min(self._wanted(), self._value("most"))
        return (yield from self._fetch(int(most)))

    def _restart(self) -> None:
        self._stop()
        self.settings["continuous"] = False
        self._initiate()

    def _size(self, parameters: list[str]) -> float:
        words = without_channels(parameters)
        if len(words) != 1:
            raise ScpiError(-108 if words else -109)
        if words[0].upper() in {"MAX", "MAXIMUM"}:
            return math.inf
        return float(round(number(words[0], low=-_MOST, high=_MOST, default=1)))

    def _fetch_array(self, parameters: list[str]) -> Steps[str]:
        count = self._size(parameters)
        if not count:
            raise ScpiError(-222)
        if math.isfinite(count):
            return (yield from self._fetch(int(count)))
        there = self.there()
        fresh = there - self._memory.fetched
        if not fresh and not self.idle(self._ready):
            raise ScpiError(-230)
        if not fresh:  # all were fetched: it begins again with the first one
            self._memory.fetched, fresh = 0, there
        return (yield from self._fetch(int(min(fresh, self._value("most"))), size_known=False))

    def _fetch(self, count: int, *, size_known: bool = True) -> Steps[str]:
        """So many results, from where the last fetch ended; a negative number: the last ones, the place is kept."""
        if self._run is None and not self._memory.held:
            raise ScpiError(-230)
        if self.settings["averaging"]:
            return (yield from self._fetch_statistic())
        if count < 0:
            there = self.there()
            if there < -count and not (yield from self._wait_until(-count)):
                return ""
            there = self.there()
            return self._spell(*self._memory.part(there + count, there))
        if self._memory.fetched >= self._memory.held and self.idle(self._ready):
            self._memory.fetched = 0
        start = self._memory.fetched
        if not (yield from self._wait_until(start + count)):
            return ""
        self._memory.fetched = start + count
        return self._spell(*self._memory.part(start, start + count), size_known=size_known)

    def _wait_until(self, held: int) -> Steps[bool]:
        """Wait until the memory holds so many.  Raises ScpiError if it never will."""
        gone = self._run.taken - self._memory.held if self._run else 0
        if held > self._memory.held and (self._run is None or gone + held > self._run.wanted):
            raise ScpiError(-230)
        return (yield from self.wait_for(gone + held))

    def _fetch_statistic(self) -> Steps[str]:
        """With statistics on, what is fetched is their result."""
        if not (yield from self.wait_for()):
            return ""
        name = {"MEAN": "mean", "SDEV": "sdev", "MIN": "min", "MAX": "max", "ADEV": "adev", "MINM": "min"}
        return number_text(self.statistics()[name[str(self.settings["average_type"])]])

    def _all_statistics(self) -> Steps[str]:
        """Mean, standard deviation, least, greatest, peak to peak."""
        yield from self.wait_for()
        found = self.statistics()
        return ",".join(number_text(found[name]) for name in ("mean", "sdev", "min", "max", "ptp"))

    # --- formats ---

    def _spell(self, values: Array, stamps: Array, *, size_known: bool = True) -> str:
        """Results in the format that is set (handbook, 8-36 and 8-39).

        REAL is a block of eight bytes for each number, PACKed one block for all, time stamps in it as whole
        picoseconds; and if the size was not told, its length has six digits.
        """
        kind, order = self.settings["format"], "<" if self.settings["byte_order"] == "SWAP" else ">"
        pairs = [(float(value), float(stamp)) for value, stamp in zip(values, stamps, strict=True)]
        stamped = bool(self.settings["stamps"])
        numbers = [number for pair in pairs for number in pair[: 1 + stamped]]
        if kind == "ASC":
            return ",".join(self._missing(value) for value in numbers)
        missing = math.nan if self._native else NOT_A_NUMBER
        if kind == "REAL":
            reals = (missing if value == NOT_A_NUMBER else value for value in numbers)
            return ",".join(block_text(struct.pack(order + "d", value)) for value in reals)
        data = b"".join(
            struct.pack(order + "d", missing if value == NOT_A_NUMBER else value)
            + (struct.pack(order + "q", round(stamp * 1e12)) if stamped else b"")
            for value, stamp in pairs
        )
        return block_text(data) if size_known else f"#6{len(data):06d}" + data.decode("latin-1")

    def _missing(self, value: float) -> str:
        return "" if self._native and value == NOT_A_NUMBER else number_text(value)
