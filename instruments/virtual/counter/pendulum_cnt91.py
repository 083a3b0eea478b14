"""A virtual CNT-91: back-to-back frequencies with time stamps, from the light it is shown."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import number, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.counter.counter import DARK, Function
from instruments.virtual.counter.measurements import Looks, Measurement, Span, Wish, first_edge
from instruments.virtual.counter.parameters import channels_of, without_channels
from instruments.virtual.counter.pendulum_cnt91_readings import ReadingsCNT91
from instruments.virtual.counter.run import Run

if TYPE_CHECKING:
    from collections.abc import Generator

    from instruments.virtual.core.steps import Steps

#: From the end of a measurement to the beginning of the next, but for back-to-back ones [s] (handbook, 8-72: 4 µs
#: and more; the calibration of the interpolators is 400 µs, estimated).
_DEAD, _CALIBRATION = 8e-6, 4e-4
#: Settings that a measurement under way does not feel.
_HARMLESS = {"format", "byte_order", "stamps", "most", "display", "average_type"}
_BACK_TO_BACK = {"FREQ:BTB", "PER:BTB"}


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


class VirtualCNT91(ReadingsCNT91):
    """Pendulum CNT-91, sold as Tektronix FCA3100 as well.

    signal, second: the voltages at the inputs A and B; native: what has no result is answered with an empty line or
    a binary not-a-number, and not with 9.91E37 (the GPIB modes native and compatible, handbook, 8-36).

    Sources: Programmer's Handbook of the CNT-90 series, 4031 600 90201 (pages as cited); PyMeasure's CNT91, QMI's
    Tektronix_FCA3000 and QCoDeS's FCA3100 for what programs send.  What follows no source: the order of the limits
    of a statistic, and that CONFigure:ARRay sets the trigger count.
    """

    identity = "PENDULUM, CNT-91, VIRTUAL, V1.28 levilab"
    no_error = '0,"No error"'
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
