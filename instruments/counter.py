"""Frequency counters: a frequency with a gate and a trigger level, whatever the model.

Facts and their sources stand with each driver.
"""

from __future__ import annotations

from typing import ClassVar, Protocol

from instruments.errors import NoAnswer
from instruments.scpi import ScpiInstrument, Setting, parse_reading


class Counter(Protocol):
    """What every counter offers."""

    def identity(self) -> str:
        """Maker, model, serial number, firmware."""

    def settings(self) -> dict[str, bool | float | str]:
        """Its settings as they stand."""

    def prepare(self, *, gate_s: float, trigger_level_v: float) -> None:
        """Measure frequency at input 1, rising edges, over a gate [s], at a fixed trigger level [V]."""

    def frequency(self) -> float | None:
        """One reading [Hz]; None when no signal crossed the trigger level.  Takes the gate time and more."""

    def close(self) -> None:
        """Give the instrument back."""


class Keysight53230A(ScpiInstrument):
    """Keysight 53220A / 53230A universal counter (and their Agilent ancestors).

    Source: Keysight 53220A/53230A Programmer's Reference.  Two points decide whether a spin is counted right:

    - Automatic level needs a signal of about 50 Hz or more; a top spins at 20 to 60 Hz.  So the level is
      fixed and the coupling DC.
    - A measurement that never completes ends after ``SYSTem:TIMeout`` with 9.91E37, but instruments leave
      the factory with that time-out off or at 1 s.  A time-out below the gate counts as twice the gate.
    """

    MODELS: ClassVar[str] = r"532[23]0A"

    gate = Setting("SENS:FREQ:GATE:TIME", float, unit="s", low=100e-6, high=1000.0)
    coupling = Setting("INP1:COUP", str, choices=("AC", "DC"))
    impedance = Setting("INP1:IMP", float, unit="ohm", low=50.0, high=1e6)
    probe_factor = Setting("INP1:PROB", float, low=1.0, high=10.0)
    input_range = Setting("INP1:RANG", float, unit="V", low=5.0, high=50.0)
    trigger_level = Setting("INP1:LEV1", float, unit="V", low=-5.125, high=5.125)
    automatic_level = Setting("INP1:LEV:AUTO", bool)
    slope = Setting("INP1:SLOP1", str, choices=("POS", "NEG"))
    measurement_timeout = Setting("SYST:TIM", float, unit="s", low=0.01, high=2000.0)

    def prepare(self, *, gate_s: float, trigger_level_v: float) -> None:
        """Set the counter up; see :class:`Counter`.

        CONFigure comes first, it resets the gate and the trigger.
        """
        self.command("CONF:FREQ (@1)")
        self.command("SENS:FREQ:GATE:SOUR TIME")
        self.gate = gate_s
        self.coupling = "DC"
        self.impedance = 1e6
        self.probe_factor = 1.0
        self.input_range = 5.0
        self.automatic_level = False
        self.trigger_level = trigger_level_v
        self.slope = "POS"
        # Without a signal the answer, "no reading", comes after this time (2000 s is the longest there is).
        self._patience = min(2 * gate_s + 1.0, 2000.0)
        self.measurement_timeout = self._patience

    #: How long the counter may work on one answer [s].
    _patience = 3.0

    def frequency(self) -> float | None:
        """One reading [Hz], or None; see :class:`Counter`."""
        try:
            answer = self.transport.query("READ?", patience=self._patience)
        except NoAnswer:
            # the front-panel time-out may be off: stop waiting, and let the link tell if it is dead
            self.transport.clear()
            self.forget_errors()  # a query cut off leaves −410 behind
            self.command("ABOR")
            return None
        return parse_reading(self.transport.address, "READ?", answer)
