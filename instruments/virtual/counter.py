"""A virtual 53230A: counts what crosses its trigger level in the light it is shown."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from instruments.scpi import NOT_A_NUMBER
from instruments.virtual.device import Clock, VirtualInstrument, answers, does
from instruments.virtual.scpi import Command, nr3

#: The voltage at the input: (start [s], step [s], n) → shape (n,) [V].
Signal = Callable[[float, float, int], NDArray[np.float64]]

#: Samples per second with which the model looks at the light.  A pulse of 3 % of a turn at 60 Hz lasts
#: 0.5 ms: ten samples; the crossing is interpolated between two of them.
_RATE = 20_000.0
#: Schmitt trigger of the input [V] (53230A data sheet: 20 mV, 40 mV typical).
_HYSTERESIS = 0.04


class Virtual53230A(VirtualInstrument):
    """A reciprocal counter: whole periods between the first edge and the first one after the gate, over their time.

    signal: the voltage at input 1.
    """

    identity = "Keysight Technologies,53230A,VIRTUAL,3.09-levilab"

    def __init__(self, clock: Clock, *, signal: Signal) -> None:
        self._signal = signal
        super().__init__(clock)

    def table(self) -> tuple[Command, ...]:
        """Its commands; source: Keysight 53220A/53230A Programmer's Reference."""
        return (
            Command("CONFigure[:SCALar][:VOLTage]:FREQuency", set=lambda _: self._configure()),
            self.word("[SENSe[1]:]FREQuency:GATE:SOURce", "gate_source", ("TIME", "EXTernal"), "TIME"),
            self.numeric("[SENSe[1]:]FREQuency:GATE:TIME", "gate", low=1e-4, high=1e3, default=0.1, unit="S"),
            self.word("INPut[1]:COUPling", "coupling", ("AC", "DC"), "AC"),
            self.numeric("INPut[1]:IMPedance", "impedance", low=50, high=1e6, default=1e6, unit="OHM"),
            self.numeric("INPut[1]:PROBe", "probe_factor", low=1, high=10, default=1),
            self.numeric("INPut[1]:RANGe", "range", low=5, high=50, default=5, unit="V"),
            self.switch("INPut[1]:LEVel[1]:AUTO", "automatic_level", default=True),
            self.numeric("INPut[1]:LEVel[1][:ABSolute]", "level", low=-5.125, high=5.125, default=0, unit="V"),
            self.word("INPut[1]:SLOPe[1]", "slope", ("POSitive", "NEGative"), "POS"),
            self.numeric("SYSTem:TIMeout", "timeout", low=0.01, high=9.9e37, default=1.0, unit="S"),
            Command("ABORt", set=does(self.abandon)),
            Command("READ", get=answers(self._read)),
        )

    def _configure(self) -> None:
        """CONFigure:FREQuency: gate and trigger as after power-on."""
        self.settings |= {"gate_source": "TIME", "gate": 0.1}

    def _read(self) -> str:
        """READ?: opens the gate; the answer comes when it has closed, or when the time-out is over."""
        start = self._ready  # when what was asked before has been answered
        gate = float(self.settings["gate"])
        # programmer's reference: a time-out below the gate counts as twice the gate
        timeout = float(self.settings["timeout"])
        timeout = timeout if timeout >= gate else 2 * gate
        edges = self._edges(start, min(timeout, 10 * gate + 2.0))
        close = np.searchsorted(edges, edges[0] + gate) if edges.size else 0
        if not edges.size or close >= edges.size:
            self.busy_until(start + timeout)
            return nr3(NOT_A_NUMBER)
        self.busy_until(float(edges[close]))
        return nr3(close / float(edges[close] - edges[0]))

    def _edges(self, start: float, duration: float) -> NDArray[np.float64]:
        """Times at which the input crosses the trigger level in the direction of the slope [s]."""
        step = 1 / _RATE
        voltage = self._signal(start, step, int(duration * _RATE) + 1)
        if self.settings["coupling"] == "AC":
            voltage = voltage - voltage.mean()
        level = float(self.settings["level"])
        if self.settings["automatic_level"]:
            level = self._automatic_level(voltage)
        sign = 1.0 if self.settings["slope"] == "POS" else -1.0
        return start + step * crossings(sign * voltage, sign * level, _HYSTERESIS)

    @staticmethod
    def _automatic_level(voltage: NDArray[np.float64]) -> float:
        """Half way between the extremes of the last 20 ms: right for 50 Hz and more, chance below.

        A pulse of a slower signal may fall outside that window; the level then stands in the dark noise.
        """
        window = voltage[: int(0.02 * _RATE)]
        return float(window.max() + window.min()) / 2


def crossings(voltage: NDArray[np.float64], level: float, hysteresis: float) -> NDArray[np.float64]:
    """Where a sampled voltage rises through a level, in samples, interpolated.

    A crossing counts when the voltage was below level − hysteresis since the last one (a Schmitt trigger).

    >>> crossings(np.array([0.0, 1.0, 0.0, 4.0]), 0.5, 0.1)
    array([0.5  , 2.125])
    """
    above, armed = voltage >= level, voltage < level - hysteresis
    # +1 where the trigger fires, -1 where it is armed again, 0 where it keeps its state
    state = np.where(above, 1, np.where(armed, -1, 0))
    decided = np.flatnonzero(state)
    turns = decided[1:][np.diff(state[decided]) > 0]
    before, after = voltage[turns - 1], voltage[turns]
    return np.asarray(turns - 1 + (level - before) / (after - before), dtype=np.float64)
