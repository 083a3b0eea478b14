"""One output of a virtual function generator: its settings, their limits, its triggers, and its signal.

Sources: Agilent/Keysight 33500 Series Operating and Service Guide (limits, couplings); Agilent 33220A User's Guide;
the state after ``*RST`` as a public driver of the family lists it.  The real instrument does not refuse a number
beyond its limits: it takes the limit and queues error −222, "value clipped to upper limit" (seen by the device tests
of a public driver).  When a setting makes another one impossible, it changes the other one and queues error −221.
"""

from __future__ import annotations

import math
from collections.abc import Callable, MutableMapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from instruments.virtual.core.parameters import limit, number
from instruments.virtual.core.parser import ScpiError, Value
from instruments.virtual.generator.arbitrary import exponential_rise

#: The generator's own resistance [Ω], its greatest voltage without a load [V], and SCPI's infinity.
SOURCE_OHM, OPEN_V, INFINITE = 50.0, 10.0, 9.9e37
#: The sources of triggers that need nothing from outside.
_BY_ITSELF = {"IMM", "TIM", "INT"}
_ARBITRARY = {"ARB", "USER"}
_WORDS = {"MIN", "MINIMUM", "MAX", "MAXIMUM", "DEF", "DEFAULT"}


def quantity_of(text: str, units: tuple[str, ...]) -> tuple[float, str]:
    """Read a number of any size and the unit, one of these, that it has.  Raises ScpiError.

    >>> quantity_of("2 mVrms", ("", "VPP", "VRMS"))
    (0.002, 'VRMS')
    """
    for unit in units:
        try:
            return number(text, low=-math.inf, high=math.inf, default=0, unit=unit), unit
        except ScpiError as error:
            if error.number != -131 or unit == units[-1]:
                raise
    raise ScpiError(-131)


@dataclass(frozen=True)
class Waveform:
    """A waveform that a family can make.

    Attributes:
        word: as the manual prints it.
        top: its highest frequency [Hz].
        bottom: its lowest frequency [Hz].
        crest: peak to peak over r.m.s.
        bursts: whether it can come in bursts.
        sweeps: whether its frequency can be swept.
    """

    word: str
    top: float
    bottom: float = 1e-6
    crest: float = 2.0
    bursts: bool = True
    sweeps: bool = True

    @cached_property
    def short(self) -> str:
        """The word in an answer."""
        return "".join(c for c in self.word if not c.islower())


@dataclass(frozen=True)
class Family:
    """What the models of a family have in common, beside their rows.

    Attributes:
        waveforms: that it can make.
        square: the limits of the duty cycle of a square wave [%] at a frequency [Hz].
        least_vpp: smallest amplitude into 50 Ω [V].
        shortest_pulse: width of it [s].
        shortest_edge: of a pulse [s].
        longest_burst: period of bursts, at most [s].
        burst_rest: the pause between two bursts, at least [s].
        first_arb: name of the arbitrary waveform after ``*RST``, where it has such waveforms.
        edge_part: an edge is no longer than this part of the shorter half of a pulse.
        latency: from an edge at the trigger input to the start of a burst [s]; the data sheets' order.
        trigger_jitter: its scatter, 1σ [s].
    """

    waveforms: tuple[Waveform, ...]
    square: Callable[[float], tuple[float, float]]
    least_vpp: float
    shortest_pulse: float
    shortest_edge: float
    longest_burst: float
    burst_rest: float
    first_arb: str = ""
    edge_part: float = 0.625
    latency: float = 500e-9
    trigger_jitter: float = 6e-9

    def waveform(self, short: str) -> Waveform:
        """Return the waveform with this short name."""
        return next(waveform for waveform in self.waveforms if waveform.short == short)


@dataclass(frozen=True)
class Burst:
    """A burst of cycles at each trigger.

    Attributes:
        cycles: how many; inf for no end.
        period: between immediate triggers [s], None for other triggers.
    """

    cycles: float
    period: float | None


@dataclass(frozen=True)
class Triggered:
    """The bursts that edges at the trigger input start, where the output waits for these.

    An edge that comes before a burst has ended is ignored.

    Attributes:
        amplitude: of a burst, half of peak to peak [V].
        cycles: of a burst; inf for no end.
        rising: whether rising edges start it, or falling ones.
        delay: from an edge to the start of a burst, with the latency [s].
        jitter: scatter of the delay, 1σ [s].
    """

    amplitude: float
    cycles: float
    rising: bool
    delay: float
    jitter: float


@dataclass(frozen=True)
class Output:
    """The signal at the open terminals from a time on.

    The load is a coil that takes almost no current: where ``OUTPut:LOAD`` is 50 Ω, the voltage is twice that on the
    display, as on the bench.

    Attributes:
        waveform: in its short form.
        frequency: of the waveform [Hz].
        amplitude: half of peak to peak [V]; 0 when the output is off, or waits for a trigger.
        offset: mean voltage [V].
        phase: at the start [°]; of bursts, at the start of each.
        duty: part of a period in which a SQU or PULS is high.
        symmetry: part of a period in which a RAMP rises.
        inverted: by OUTPut:POLarity.
        burst: None where the waveform runs on.
        samples: of an arbitrary waveform, −1 to 1, shape (n,).
        triggered: the bursts that an edge at the trigger input would start, of this waveform, frequency and phase.
    """

    waveform: str
    frequency: float
    amplitude: float
    offset: float
    phase: float = 0.0
    duty: float = 0.5
    symmetry: float = 1.0
    inverted: bool = False
    burst: Burst | None = None
    samples: NDArray[np.float64] | None = field(default=None, compare=False, repr=False)
    triggered: Triggered | None = None

    def times(self, factor: float) -> Output:
        """Return the output in another unit, of a quantity that is `factor` per volt."""
        bursts = self.triggered and replace(self.triggered, amplitude=factor * self.triggered.amplitude)
        return replace(self, amplitude=factor * self.amplitude, offset=factor * self.offset, triggered=bursts)


class Channel:
    """One output.

    Args:
        family: of the instrument.
        settings: of the whole instrument; those of this channel have a prefix to their names.
        index: the number of the channel.
        report: puts an entry into the error queue.
        now: returns the time [s].
    """

    def __init__(
        self,
        family: Family,
        settings: MutableMapping[str, Value],
        *,
        index: int,
        report: Callable[[ScpiError], None],
        now: Callable[[], float],
    ) -> None:
        self.family, self.index = family, index
        self._settings, self._report = settings, report
        self.prefix = f"{index}:"
        self.empty()
        self._now = now
        #: Begin and end of the last triggered burst or sweep [s].
        self.under_way = (-math.inf, -math.inf)

    def __getitem__(self, name: str) -> Value:
        return self._settings[self.prefix + name]

    def __setitem__(self, name: str, value: Value) -> None:
        self._settings[self.prefix + name] = value

    def number(self, name: str) -> float:
        """Return a setting that is a number."""
        return float(self[name])

    def conflict(self, text: str) -> None:
        """Queue error −221: another setting had to change; the command goes on."""
        self._report(ScpiError(-221, text))

    def clip(self, value: float, low: float, high: float) -> float:
        """Return the number or the limit that it is beyond, which goes into the error queue.

        A limit as it is printed, with its last digit rounded, is no more than itself.
        """
        if low <= value <= high:
            return value
        bound = high if value > high else low
        if not math.isclose(value, bound, rel_tol=1e-12):
            self._report(ScpiError(-222, f"value clipped to {'upper' if value > high else 'lower'} limit"))
        return bound

    def read(self, text: str, low: float, high: float, default: float, unit: str = "") -> float:
        """Return a numeric parameter, at most at its limits.  Raises ScpiError."""
        if text[:1].isalpha():
            if text.upper() in {"INF", "INFINITY"} or text.upper() not in _WORDS:
                raise ScpiError(-104, text[:20])
            return limit(text, low=low, high=high, default=default)
        return self.clip(quantity_of(text, (unit,))[0], low, high)

    # --- frequency ---

    @property
    def waveform(self) -> Waveform:
        """The waveform that is selected."""
        return self.family.waveform(str(self["waveform"]))

    @property
    def points(self) -> int:
        """Samples of the arbitrary waveform that is selected."""
        return int(self.samples.size)

    def empty(self) -> None:
        """Hold no arbitrary waveform but the one that is there after ``*RST``."""
        #: By name, −1 to 1, shape (n,) each.
        self.held = {self.family.first_arb: exponential_rise()}

    @property
    def samples(self) -> NDArray[np.float64]:
        """The arbitrary waveform that is selected, −1 to 1, shape (n,)."""
        return self.held[str(self["arb"])]

    @property
    def frequency(self) -> float:
        """Of the waveform that is selected [Hz]; the 33500's arbitrary waveforms have that of their samples."""
        return self.number("arb_rate") / self.points if self["waveform"] == "ARB" else self.number("frequency")

    def set_frequency(self, value: float) -> None:
        """Set the frequency of the selected waveform [Hz]."""
        if self["waveform"] == "ARB":
            self["arb_rate"] = value * self.points
        else:
            self["frequency"] = value

    def frequency_limits(self) -> tuple[float, float]:
        """Return the limits of the frequency of the selected waveform [Hz]."""
        top = self.waveform.top
        return self.waveform.bottom, top / self.points if self["waveform"] == "ARB" else top

    def period(self) -> float:
        """Return the period, of all waveforms but samples [s]."""
        return 1 / self.number("frequency")

    def set_period(self, value: float) -> None:
        """Set the period, of all waveforms but samples [s]."""
        self["frequency"] = 1 / value

    def square_duties(self) -> tuple[float, float]:
        """Return the limits of the duty cycle of a square wave [%]."""
        return self.family.square(self.number("frequency"))

    # --- voltages, as they are displayed: at the load that OUTPut:LOAD names ---

    @property
    def load_factor(self) -> float:
        """Of the open-circuit voltage at the load."""
        load = self.number("load")
        return 1.0 if load >= INFINITE else load / (load + SOURCE_OHM)

    @property
    def top(self) -> float:
        """The highest voltage that there can be [V]; the lowest is its negative."""
        return OPEN_V * self.load_factor

    def amplitude_limits(self) -> tuple[float, float]:
        """Return the limits of the peak-to-peak voltage [V]."""
        return 2 * self.family.least_vpp * self.load_factor, 2 * self.top

    def offset_limits(self) -> tuple[float, float]:
        """Return the limits of the offset at the present amplitude [V]; a DC voltage has no amplitude."""
        half = 0.0 if self["waveform"] == "DC" else self.number("amplitude_vpp") / 2
        reach = max(0.0, self.top - half)
        return -reach, reach

    def from_vpp(self, vpp: float, unit: str) -> float:
        """Return a peak-to-peak voltage [V] in this unit."""
        if unit == "VPP":
            return vpp
        rms = vpp / self._crest()
        return rms if unit == "VRMS" else 10 * math.log10(rms**2 / self.number("load") / 1e-3)

    def to_vpp(self, value: float, unit: str) -> float:
        """Return a number in this unit as a peak-to-peak voltage [V]."""
        if unit == "VPP":
            return value
        rms = value if unit == "VRMS" else math.sqrt(10 ** (min(value, 300.0) / 10) * 1e-3 * self.number("load"))
        return rms * self._crest()

    def _crest(self) -> float:
        if self["waveform"] not in _ARBITRARY:
            return self.waveform.crest
        return 2.0 / max(float(np.sqrt(np.mean(self.samples**2))), 1e-3)

    def high(self) -> float:
        """Return the high level [V]."""
        return round(self.number("offset") + self.number("amplitude_vpp") / 2, 12)

    def low(self) -> float:
        """Return the low level [V]."""
        return round(self.number("offset") - self.number("amplitude_vpp") / 2, 12)

    def high_limits(self) -> tuple[float, float]:
        """Return the limits of the high level [V]."""
        return self._step() - self.top, self.top

    def low_limits(self) -> tuple[float, float]:
        """Return the limits of the low level [V]."""
        return -self.top, self.top - self._step()

    def set_high(self, high: float) -> None:
        """Set the high level [V]; the low one stays, or gives way by the smallest step."""
        low, step = self.low(), self._step()
        if high - low < step * (1 - 1e-9):
            low = high - step
            self.conflict("low level changed due to high level")
        self._set_levels(low, high)

    def set_low(self, low: float) -> None:
        """Set the low level [V]; the high one stays, or gives way by the smallest step."""
        high, step = self.high(), self._step()
        if high - low < step * (1 - 1e-9):
            high = low + step
            self.conflict("high level changed due to low level")
        self._set_levels(low, high)

    def _step(self) -> float:
        return max(1e-3, self.amplitude_limits()[0])

    def _set_levels(self, low: float, high: float) -> None:
        self["amplitude_vpp"], self["offset"] = round(high - low, 12), round((high + low) / 2, 12)

    def set_load(self, load: float) -> None:
        """OUTPut:LOAD: what stands at the terminals stays, what is displayed changes."""
        before = self.load_factor
        self["load"] = load
        for name in ("amplitude_vpp", "offset"):
            self[name] = float(f"{self.number(name) * self.load_factor / before:.12g}")
        if load >= INFINITE and self["voltage_unit"] == "DBM":
            self["voltage_unit"] = "VPP"
            self.conflict("amplitude units changed to Vpp due to high-Z load")

    # --- pulses ---

    def pulse_limits(self) -> tuple[float, float]:
        """Return the limits of the width of a pulse at the present period [s]."""
        least = max(self.family.shortest_pulse, self.family.shortest_edge / self.family.edge_part)
        return least, 1 / self.number("frequency") - least

    def set_width(self, width: float) -> None:
        """Set the width of pulses [s], and with it their duty cycle."""
        self["pulse_width"], self["pulse_duty"] = width, 100 * width * self.number("frequency")

    def pulse_duties(self) -> tuple[float, float]:
        """Return the limits of the duty cycle of pulses at the present period [%]."""
        low, high = self.pulse_limits()
        return 100 * low * self.number("frequency"), 100 * high * self.number("frequency")

    def set_pulse_duty(self, duty: float) -> None:
        """Set the duty cycle of pulses [%], and with it their width."""
        self["pulse_duty"], self["pulse_width"] = duty, duty / 100 / self.number("frequency")

    # --- triggers ---

    def burst_periods(self) -> tuple[float, float]:
        """Return the limits of the time between bursts that start by themselves [s]."""
        return 1e-6, self.family.longest_burst

    @property
    def repeats(self) -> bool:
        """Whether bursts start by themselves."""
        return bool(self["burst"]) and self["burst_mode"] == "TRIG" and self["trigger_source"] in _BY_ITSELF

    @property
    def waits(self) -> bool:
        """Whether it needs a trigger to put something out."""
        armed = (self["burst"] and self["burst_mode"] == "TRIG") or self["sweep"]
        return bool(armed) and self["trigger_source"] not in _BY_ITSELF

    @property
    def cycles(self) -> float:
        """Of a burst; inf for no end."""
        cycles = self.number("burst_cycles")
        return math.inf if cycles >= INFINITE else cycles

    def trigger(self) -> None:
        """Take a trigger that comes now."""
        start = self._now() + self.number("trigger_delay")
        lasts = self.cycles / self.frequency if self["burst"] else self.number("sweep_time")
        self.under_way = (start, start + lasts)

    def stop(self) -> None:
        """ABORt: what is under way ends."""
        self.under_way = (-math.inf, -math.inf)

    # --- the terminals ---

    def signal(self, time: float) -> Output:
        """Return the voltage at the open terminals at this time [s]."""
        on = bool(self["output"])
        start, end = self.under_way
        silent = bool(self["burst"]) and (self._is_gated or (self.waits and not start <= time < end))
        short, inverted = str(self["waveform"]), self["polarity"] == "INV"
        volt = 1 / self.load_factor
        swing = 0.0 if silent or not on or short == "DC" else self.number("amplitude_vpp") / 2 * volt
        return Output(
            waveform=short,
            frequency=self.number("prbs_rate") if short == "PRBS" else self.frequency,
            amplitude=swing,
            offset=self.number("offset") * volt if on else 0.0,
            phase=self.number("burst_phase" if self["burst"] else "phase"),
            duty={"SQU": self.number("duty"), "PULS": self.number("pulse_duty")}.get(short, 50.0) / 100,
            symmetry=self.number("symmetry") / 100 if short == "RAMP" else 1.0,
            inverted=inverted,
            burst=self._burst(),
            samples=self.samples if short in _ARBITRARY else None,
            triggered=self._triggered() if on and silent else None,
        )

    def _triggered(self) -> Triggered | None:
        """Return the bursts that wait for an edge at the trigger input.

        A gate stops at the end of a cycle (33500 guide, page 177), so the tape's pulse, which is shorter than one,
        leads to a whole cycle; the count of cycles and the trigger's source do not matter then.
        """
        gated = self._is_gated
        if not gated and (not self.waits or self["trigger_source"] != "EXT"):
            return None
        return Triggered(
            amplitude=self.number("amplitude_vpp") / 2 / self.load_factor,
            cycles=1.0 if gated else self.cycles,
            rising=gated or self["trigger_slope"] == "POS",
            delay=self.family.latency + (0.0 if gated else self.number("trigger_delay")),
            jitter=self.family.trigger_jitter,
        )

    @property
    def _is_gated(self) -> bool:
        """Whether a gate is closed without a pulse; an inverted one counts as open: pulses of a tape are short."""
        return self["burst_mode"] == "GAT" and self["gate_polarity"] == "NORM"

    def _burst(self) -> Burst | None:
        if not self["burst"]:
            return None
        period = self.number("burst_period") if self.repeats else None
        return Burst(math.inf if self["burst_mode"] == "GAT" else self.cycles, period)
