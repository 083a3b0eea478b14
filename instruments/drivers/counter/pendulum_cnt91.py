"""The driver of Pendulum's CNT-91, which Tektronix sells as FCA3000 and FCA3100."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.drivers.counter.reciprocal import (
    IMPEDANCES,
    IMPEDANCES_OHM,
    LONGEST_WAIT_S,
    READINGS_AT_ONCE,
    ReciprocalCounter,
)
from instruments.drivers.setting import Setting
from instruments.errors import OutOfRange
from instruments.ieee488 import Form


class PendulumCNT91(ReciprocalCounter):
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
    #: Handbook, 8-36, and PyMeasure's test of its CNT91: two digits of exponent, and as many of the number as the
    #: resolution gives.
    NUMBER: ClassVar[Form] = Form(r"[+-]\d\.\d{1,15}E[+-]\d{2}", "+2.5000000000000E+01")
    MOST: ClassVar[int] = 750_000
    EMPTY_IS_NONE = True

    _IMPEDANCE: ClassVar[Form] = Form(rf"{NUMBER.pattern}|\+?({IMPEDANCES})", "1000000")

    gate = Setting("ACQ:APER", float, unit="s", low=20e-9, high=1000.0)
    coupling = Setting("INP1:COUP", str, choices=("AC", "DC"))
    impedance = Setting("INP1:IMP", float, unit="ohm", values=IMPEDANCES_OHM, form=_IMPEDANCE)
    attenuation = Setting("INP1:ATT", float, values=(1.0, 10.0), form=Form(r"\+?(10?|1\.0+E\+0[01])", "10"))
    low_pass_filter = Setting("INP1:FILT", bool)
    #: Resolution: data sheet, without attenuation, which multiplies the level by 10.
    trigger_level = Setting("INP1:LEV", float, unit="V", low=-5.0, high=5.0, resolution=3e-3, span=(-50.0, 50.0))
    automatic_level = Setting("INP1:LEV:AUTO", bool)
    slope = Setting("INP1:SLOP", str, choices=("POSitive", "NEGative"))
    measurement_timeout = Setting("SYST:TOUT:TIME", float, unit="s", low=0.01, high=1000.0)
    gives_up = Setting("SYST:TOUT", bool)
    free_running = Setting("INIT:CONT", bool)
    time_stamps = Setting("FORM:TINF", bool)
    statistics = Setting("CALC:AVER:STAT", bool)

    def prepare(self, *, gate_s: float, trigger_level_v: float, channel: int = 1) -> None:
        """Set the counter up; see :class:`Counter`."""
        self._choose(channel)
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
        self._unsent_end = ()

    def _check_count(self, count: int) -> None:
        super()._check_count(count)
        most = int(LONGEST_WAIT_S / self._patience)
        if count > most:
            allowed = f"1 to {most} with this gate: they are waited for together, 30 days at most"
            raise OutOfRange(self.transport.address, "count", count, allowed)

    def readings(self, count: int) -> NDArray[np.float64]:
        """Take readings; see :class:`Counter`.  Raises OutOfRange if they could take longer than 30 days."""
        return self._block(count, columns=1)[:, 0]

    def timed_readings(self, count: int) -> NDArray[np.float64]:
        """Take readings with the times at which their gates opened, shape (count, 2) [Hz, s]; NaN where there was none.

        Times are the counter's: only their differences mean something.  Raises OutOfRange as readings() does.
        """
        return self._block(count, columns=2)

    def _block(self, count: int, *, columns: int) -> NDArray[np.float64]:
        """Measure this many readings, and fetch them when the measurement is complete."""
        self._check_count(count)
        found: list[float] = []
        begin, end = (("FORM:TINF ON",), ("FORM:TINF OFF",)) if columns == 2 else ((), ())
        with self._series(*begin, f"ARM:COUN {count}", "INIT", end=("ARM:COUN 1", *end)):
            complete = self._ask("*OPC?", count * self._patience)
            if complete not in {"1", None}:
                self.reject("*OPC?", complete, "1")
            while complete and len(found) < count * columns:
                part = min(READINGS_AT_ONCE, count - len(found) // columns)
                question = f"FETC:ARR? {part}"
                answer = self._ask(question, self._patience)
                if answer is None:
                    break
                found += self._split(question, answer, part * columns)
        return np.array(found + [np.nan] * (count * columns - len(found))).reshape(count, columns)
