"""Frequency counters: a frequency with a gate and a trigger level, whatever the model.

Facts and their sources stand with each driver, and in docs/instruments/counter.md.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from instruments.errors import BadAnswer, InstrumentError, NoAnswer, OutOfRange
from instruments.scpi import ScpiInstrument, Setting, parse_reading

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Readings that are fetched with one question: an answer of 25 kB, seconds apart at most.
_AT_ONCE = 1000

#: Readings that are waited for with one question: so long, at most [s].  VISA waits for 49 days and no longer.
_LONGEST_WAIT = 30 * 86400.0


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

    def readings(self, count: int) -> NDArray[np.float64]:
        """So many readings one after the other, shape (count,) [Hz], NaN where there was none.

        Raises OutOfRange if the memory of the counter does not hold so many.
        """

    def close(self) -> None:
        """Give the instrument back."""


class _ReciprocalCounter(ScpiInstrument):
    """What the drivers share: how long to wait for an answer, and what to do when none comes.

    most: readings that the memory holds.
    """

    MOST: ClassVar[int] = 1_000_000

    #: How long the counter may work on one reading [s]; prepare() sets it.
    _patience = 3.0
    #: Whether it says so itself when there is no signal; prepare() sets it up to do so.
    _gives_up = False

    def frequency(self) -> float | None:
        """One reading [Hz], or None; see :class:`Counter`.  Raises CommandRefused if an error was waiting."""
        answer = self._ask("READ?", self._patience)
        with self.resynchronised():
            return None if answer is None else self._parse(answer)

    def _parse(self, answer: str) -> float | None:
        return parse_reading(self.transport.address, "READ?", answer)

    def _ask(self, question: str, patience: float) -> str | None:
        """Read the error queue, then the data; None when a counter that may wait for ever never answers.

        One that was told to give up says so itself: then silence is a fault of the link, and no sign of a dark signal.
        """
        self.raise_errors(question)
        try:
            return self.transport.query(question, patience=patience)
        except NoAnswer as silence:
            try:
                self._give_up()
            except InstrumentError:
                raise silence from None
            if self._gives_up:
                raise
            return None

    def _give_up(self) -> None:
        """Stop a measurement that does not end, and let the link tell if it is dead."""
        self.transport.clear()
        self.forget_errors()  # a query cut off leaves −410 behind
        self.command("ABOR")

    def _check_count(self, count: int) -> None:
        if not 1 <= count <= self.MOST:
            raise OutOfRange(self.transport.address, "count", count, f"1 to {self.MOST}")

    def _split(self, question: str, answer: str, expected: int) -> list[float]:
        """The numbers of a list, NaN where there was no reading.  Raises BadAnswer if they are not so many."""
        words = answer.split(",")
        if len(words) != expected:
            shown = answer if len(answer) < 80 else f"{answer[:80]}…"
            raise BadAnswer(self.transport.address, question, shown, f"{expected} numbers, not {len(words)}")
        found = (parse_reading(self.transport.address, question, word or "nan") for word in words)
        return [np.nan if value is None else value for value in found]


class Keysight53230A(_ReciprocalCounter):
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
        self._gives_up = True

    def readings(self, count: int) -> NDArray[np.float64]:
        """So many readings; see :class:`Counter`.  They are fetched as they come, each with its own patience."""
        self._check_count(count)
        self.command(f"SAMP:COUN {count}")
        found: list[float] = []
        try:
            self.command("INIT")
            while len(found) < count:
                part = min(_AT_ONCE, count - len(found))
                question = f"DATA:REM? {part},WAIT"
                answer = self._ask(question, part * self._patience)
                if answer is None:
                    break
                found += self._split(question, answer, part)
        except InstrumentError:
            with contextlib.suppress(InstrumentError):  # the first error tells more
                self._give_up()
                self.command("SAMP:COUN 1")
            raise
        self.command("SAMP:COUN 1")
        return np.array(found + [np.nan] * (count - len(found)))


class PendulumCNT91(_ReciprocalCounter):
    """Pendulum CNT-90 and CNT-91, sold by Tektronix as FCA3000 and FCA3100 series.

    Sources: CNT-90 series Programmer's Handbook (4031 600 90201); PyMeasure's CNT91, QMI's Tektronix_FCA3000 and
    QCoDeS's FCA3100.  What decides whether a spin is counted right:

    - The automatic level needs a signal of 100 Hz or more (user's manual, chapter 3; changed in its menu only),
      and for frequency it widens the hysteresis to 30 % … 70 %.  So the level is fixed and the coupling DC.
    - A measurement without a signal never ends unless ``SYSTem:TOUT`` is on.  It is then answered with 9.91E37
      in the mode compatible, with an empty line in the mode native (handbook, 8-36): both mean no reading.
    - Time stamps, of the edge that opened the gate, count from some start of the counter's: only differences count.
    """

    MODELS: ClassVar[str] = r"CNT-9[01](R|XL|R/AF)?|FCA3[01](00|03|20)"
    MOST: ClassVar[int] = 750_000

    gate = Setting("ACQ:APER", float, unit="s", low=20e-9, high=1000.0)
    coupling = Setting("INP1:COUP", str, choices=("AC", "DC"))
    impedance = Setting("INP1:IMP", float, unit="ohm", low=50.0, high=1e6)
    attenuation = Setting("INP1:ATT", float, low=1.0, high=10.0)
    low_pass_filter = Setting("INP1:FILT", bool)
    trigger_level = Setting("INP1:LEV", float, unit="V", low=-5.0, high=5.0)
    automatic_level = Setting("INP1:LEV:AUTO", bool)
    slope = Setting("INP1:SLOP", str, choices=("POS", "NEG"))
    measurement_timeout = Setting("SYST:TOUT:TIME", float, unit="s", low=0.01, high=1000.0)
    gives_up = Setting("SYST:TOUT", bool)
    free_running = Setting("INIT:CONT", bool)
    time_stamps = Setting("FORM:TINF", bool)
    statistics = Setting("CALC:AVER:STAT", bool)

    def prepare(self, *, gate_s: float, trigger_level_v: float) -> None:
        """Set the counter up; see :class:`Counter`."""
        self.command("CONF:FREQ (@1)")
        self.free_running = False
        self.statistics = False
        self.command("FORM ASC")
        self.time_stamps = False
        self.gate = gate_s
        self.coupling = "DC"
        self.impedance = 1e6
        self.attenuation = 1.0
        self.low_pass_filter = False
        self.automatic_level = False
        self.trigger_level = trigger_level_v
        self.slope = "POS"
        self.command("ARM:SOUR IMM")
        self.command("TRIG:COUN 1")
        self.command("ARM:COUN 1")
        self._patience = 2 * gate_s + 1.0
        # 1000 s is the longest there is: a gate that comes near it must not be cut off
        if self._patience <= 1000.0:
            self.measurement_timeout = self._patience
        self.gives_up = self._gives_up = self._patience <= 1000.0

    def _parse(self, answer: str) -> float | None:
        return parse_reading(self.transport.address, "READ?", answer or "nan")

    def _check_count(self, count: int) -> None:
        super()._check_count(count)
        most = int(_LONGEST_WAIT / self._patience)
        if count > most:
            allowed = f"1 to {most} with this gate: they are waited for together, 30 days at most"
            raise OutOfRange(self.transport.address, "count", count, allowed)

    def readings(self, count: int) -> NDArray[np.float64]:
        """So many readings; see :class:`Counter`.  Raises OutOfRange if they could take longer than 30 days."""
        return self._block(count, columns=1)[:, 0]

    def timed_readings(self, count: int) -> NDArray[np.float64]:
        """So many readings and when their gates opened, shape (count, 2) [Hz, s]; NaN where there was none.

        Times are the counter's: only their differences mean something.  Raises OutOfRange as readings() does.
        """
        self._check_count(count)
        self.time_stamps = True
        try:
            return self._block(count, columns=2)
        finally:
            with contextlib.suppress(InstrumentError):  # an error under way tells more
                self.time_stamps = False

    def _block(self, count: int, *, columns: int) -> NDArray[np.float64]:
        """A measurement of so many readings, fetched when it is complete."""
        self._check_count(count)
        self.command(f"ARM:COUN {count}")
        found: list[float] = []
        try:
            self.command("INIT")
            complete = self._ask("*OPC?", count * self._patience)
            while complete and len(found) < count * columns:
                part = min(_AT_ONCE, count - len(found) // columns)
                question = f"FETC:ARR? {part}"
                answer = self._ask(question, self._patience)
                if answer is None:
                    break
                found += self._split(question, answer, part * columns)
        except InstrumentError:
            with contextlib.suppress(InstrumentError):  # the first error tells more
                self._give_up()
                self.command("ARM:COUN 1")
            raise
        self.command("ARM:COUN 1")
        return np.array(found + [np.nan] * (count * columns - len(found))).reshape(count, columns)
