"""A virtual 34461A, or another multimeter of its family: counts where the light it is shown crosses its mean.

Sources: Agilent Truevolt Series Operating and Service Guide, pages 168 (CONFigure, MEASure) and 198 (aperture, filter,
range); Agilent 34401A User's Guide; HTML help of the 34980A (time-outs of the filters: 1 s, 0.1 s, 0.01 s);
PyMeasure's suite for a real 34401A.  Assumed: it fires 6 % of the range above the mean and arms 1 % below.

It has frequency and period and no other function; it takes commands in local mode, and with any settings of a serial
line.
"""

from typing import ClassVar

from instruments.ieee488 import INFINITY, NOT_A_NUMBER
from instruments.virtual.core.parameters import number, parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Both, Do, Number, Own, Row, Switch, Text, Word
from instruments.virtual.counter.counter import SHARED, Count, Function, VirtualCounter
from instruments.virtual.counter.edges import RATE, TriggerInput
from instruments.virtual.counter.measurements import GateTime, Inputs, Measurement, Reading
from instruments.virtual.counter.run import Run

#: Ranges of the input [V], and which part of it the r.m.s. may be at most.
_RANGES, _OVERLOAD = (0.1, 1.0, 10.0, 100.0, 750.0), 1.2
#: Where it fires above the mean of the signal, and how far below that it arms, in parts of the range: noise of 1 % of
#: it in the dark is no signal, and pulses of 3 % of a turn are one.
_FIRES, _HYSTERESIS = 0.06, 0.07
#: Filter, by the slowest signal that it is for [Hz] → how long an edge is waited for [s].
_FILTERS = {3.0: 1.0, 20.0: 0.1, 200.0: 0.01}
#: Resolution in parts of the range → gate [s]; the finest first.
_GATES = ((1e-6, 1.0), (1e-5, 0.1), (1e-4, 0.01))
#: The automatic delay of the trigger [s]; time from a reading to the next one [s] (estimated).
_SETTLING, _DEAD = 1.0, 2e-3


def _range_for(value: float) -> float:
    """Return the range for a voltage [V]."""
    return next((limit for limit in _RANGES if limit >= value * (1 - 1e-9)), _RANGES[-1])


def _filter_for(value: float) -> float:
    """Return the filter for a signal from this frequency on [Hz]."""
    return max(limit for limit in _FILTERS if limit <= value)


def _of_both(function: str, *, alias: bool) -> tuple[Row, ...]:
    """Return the rows of a function; frequency and period share their settings."""
    head = f"[SENSe[1]:]{function}:"
    return (
        Number(f"{head}APERture", "gate", 0.1, (0.01, 1.0), "S", values=tuple(g for _, g in _GATES), alias=alias),
        Number(f"{head}RANGe:LOWer", "slowest", 20.0, (3.0, 200.0), "HZ", rounded=_filter_for, alias=True),
        Number(f"{head}VOLTage:RANGe[:UPPer]", "range", 10.0, (0.1, 750.0), "V", rounded=_range_for, alias=alias),
        Own(
            f"{head}VOLTage:RANGe:AUTO",
            lambda d, p: d.set_automatic_range(p),
            lambda d: f"{d.settings['automatic_range']:d}",
            keeps=None if alias else ("automatic_range", True),
        ),
    )


_FUNCTIONS = {"FREQ": Function("FREQuency"), "PER": Function("PERiod")}
_ROWS: tuple[Row, ...] = (
    *(
        row
        for name, header in (("FREQ", "[:SCALar]:FREQuency"), ("PER", "[:SCALar]:PERiod"))
        for row in (
            Both(f"CONFigure{header}", lambda d, p, f=name: d.configure(f, p)),
            Both(f"MEASure{header}", answer=lambda d, p, f=name: d.measure_once(f, p)),
        )
    ),
    *SHARED,
    *_of_both("FREQuency", alias=False),
    *_of_both("PERiod", alias=True),
    Number("[SENSe[1]:]DETector:BANDwidth", "slowest", 20.0, (3.0, 200.0), "HZ", rounded=_filter_for, alias=True),
    Ask("READ", lambda d: d.read()),
    Ask("FETCh", lambda d: d.fetch()),
    Count("SAMPle:COUNt", "samples", 1.0, (1, 5e4)),
    Count("TRIGger:COUNt", "triggers", 1.0, (1, 5e4), endless=True),
    Word("TRIGger:SOURce", "trigger_source", "IMMediate EXTernal BUS"),
    Number("TRIGger:DELay", "trigger_delay", 0.0, (0, 3600), "S"),
    Switch("TRIGger:DELay:AUTO", "automatic_delay", default=True),
    Ask("DATA:POINts", lambda d: d.spell_whole(d.available())),
    Switch("DISPlay[:WINDow][:STATe]", "display", default=True),
    Text("DISPlay[:WINDow]:TEXT[:DATA]", "text", longest=12),
    Do("DISPlay[:WINDow]:TEXT:CLEar", lambda d: d.settings.update(text="")),
    Switch("SYSTem:BEEPer:STATe", "beeper", default=True),
    Ask("ROUTe:TERMinals", lambda _d: "FRON"),
)


class Virtual34461A(VirtualCounter):
    """A 34461A.  Args: see the base."""

    identity = "Keysight Technologies,34461A,VIRTUAL,A.03.03-levilab"
    numbered = (1,)
    FUNCTIONS: ClassVar = _FUNCTIONS
    ROWS: ClassVar = _ROWS
    DEFAULTS: ClassVar = {"slowest": 20.0}

    def spell(self, value: float) -> str:
        """Return a number with nine digits: +1.00000000E-01."""
        return f"{0.0 if value == NOT_A_NUMBER else value:+.8E}"

    def on_number_change(self, name: str, before: float) -> None:
        """Turn an automatism off where a program sets its number."""
        for number_, automatic in (("range", "automatic_range"), ("trigger_delay", "automatic_delay")):
            if name == number_:
                self.settings[automatic] = False

    def reset(self) -> None:
        """*RST: the automatisms are on again."""
        super().reset()
        self.settings |= {"automatic_range": True, "automatic_delay": True}

    # --- configuration ---

    def configure(self, name: str, parameters: list[str]) -> None:
        """CONFigure: all as after a reset; the resolution, which is a part of the range, sets the gate."""
        if len(parameters) > 2:
            raise ScpiError(-108)
        top = 300e3 if name == "FREQ" else 1 / 3
        unit = "HZ" if name == "FREQ" else "S"
        sent = [text for text in parameters if text.upper() not in {"MIN", "MAX", "DEF"}]
        numbers = [number(text, low=1e-12, high=top, default=1.0, unit=unit) for text in sent]
        part = numbers[1] / numbers[0] if len(numbers) == 2 else _GATES[1][0]
        self.choose(name, (1,))
        gate = next((gate for finest, gate in reversed(_GATES) if part >= finest * (1 - 1e-9)), 1.0)
        self.settings |= {"gate": gate, "slowest": 20.0, "automatic_range": True, "automatic_delay": True}
        self.settings |= {"samples": 1.0, "triggers": 1.0, "trigger_source": "IMM"}

    def configuration(self) -> str:
        """CONFigure?: function, range, resolution."""
        part = next(part for part, gate in _GATES if gate == self.value("gate"))
        low = self.value("slowest") if self._function == "FREQ" else 1 / self.value("slowest")
        return f'"{self._function} {low:+.8E},{part * low:+.8E}"'

    def set_automatic_range(self, parameters: list[str]) -> None:
        """RANGe:AUTO: ON, OFF, or ONCE, which finds the range and then keeps it.  Raises ScpiError."""
        text = parameter(parameters)
        once = text.upper() == "ONCE"
        if once or not (on := self.read_boolean(text)):
            self.settings |= {"range": self._range(), "automatic_range": False}
        else:
            self.settings["automatic_range"] = on

    # --- the input ---

    def _rms(self) -> float:
        """Return the r.m.s. of the signal, a.c., now [V]."""
        volts = self._signals[1](min(self._ready, self.clock.now() + 1.0), 1 / RATE, int(RATE / 3))
        return float(volts.std())

    def _range(self) -> float:
        """Return the range in use [V]."""
        return _range_for(self._rms() / _OVERLOAD) if self.settings["automatic_range"] else self.value("range")

    def trigger_input(self, channel: int) -> TriggerInput:
        """See the base: near the zero crossing of what the coupling lets through."""
        wide = self._range()
        return TriggerInput(_FIRES * wide, _HYSTERESIS * wide, window=1.0, alternating=True)

    # --- measuring ---

    def initiate(self) -> None:
        """INITiate: one run of as many readings as triggers and samples make."""
        gate, patience = self.value("gate"), _FILTERS[self.value("slowest")]
        overload = self._rms() > _OVERLOAD * self._range()

        def measure(inputs: Inputs, begin: float, _: int) -> Measurement:
            reading = yield from self.measure(inputs, GateTime(begin, gate, begin + gate + patience))
            return Reading(INFINITY, reading.stamp, reading.done) if overload else reading

        self.begin(
            Run(
                begin=self._ready,
                inputs=self.inputs(),
                measure=measure,
                samples=self.value("samples"),
                triggers=self.value("triggers"),
                dead_time=_DEAD,
                delay=_SETTLING if self.settings["automatic_delay"] else self.value("trigger_delay"),
                shortest=gate,
                patience=gate + patience,
                immediate=self.settings["trigger_source"] == "IMM",
            )
        )
