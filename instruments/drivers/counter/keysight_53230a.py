"""The driver of Keysight's 53210A, 53220A and 53230A."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.drivers.counter.reciprocal import IMPEDANCES, IMPEDANCES_OHM, READINGS_AT_ONCE, ReciprocalCounter
from instruments.drivers.setting import Setting
from instruments.ieee488 import INFINITY, Form


class Keysight53230A(ReciprocalCounter):
    """Keysight 53210A / 53220A / 53230A counter (and their Agilent ancestors).

    Sources: Keysight 53220A/53230A Programmer's Reference; User's Guide of the 53210A, which has input 1 alone.  Two
    points decide whether a spin is counted right:

    - Automatic level needs a signal of about 50 Hz or more; a top spins at 20 to 60 Hz.  So the level is
      fixed and the coupling DC.
    - A measurement that never completes ends after ``SYSTem:TIMeout`` with 9.91E37, but instruments leave
      the factory with that time-out off or at 1 s.  A time-out below the gate counts as twice the gate.
    """

    MODELS: ClassVar[str] = r"532[123]0A"
    #: Programmer's Reference, FORMat:DATA: fifteen digits, three of exponent.  Public drivers quote sixteen and two.
    #: Both have 22 characters: an answer that lost one is neither.
    NUMBER: ClassVar[Form] = Form(r"[+-]\d\.(\d{14}E[+-]\d{3}|\d{15}E[+-]\d{2})", "+1.00000000000000E-001")

    #: How the settings of few values are printed is not confirmed: as numbers, or short.
    _IMPEDANCE: ClassVar[Form] = Form(rf"{NUMBER.pattern}|\+?({IMPEDANCES})", "1000000")
    _PROBE: ClassVar[Form] = Form(NUMBER.pattern + r"|\+?(10?|1\.0{1,9}E\+0[01])", "10")
    _RANGE: ClassVar[Form] = Form(NUMBER.pattern + r"|\+?(50?|5\.0{1,9}E\+0[01])", "50")

    #: A 53230A has gates from 1 µs on, which other programs may set.
    gate = Setting("SENS:FREQ:GATE:TIME", float, unit="s", low=100e-6, high=1000.0, span=(1e-6, 1000.0))
    coupling = Setting("INP1:COUP", str, choices=("AC", "DC"))
    impedance = Setting("INP1:IMP", float, unit="ohm", values=IMPEDANCES_OHM, form=_IMPEDANCE)
    probe_factor = Setting("INP1:PROB", float, values=(1.0, 10.0), form=_PROBE)
    input_range = Setting("INP1:RANG", float, unit="V", values=(5.0, 50.0), form=_RANGE)
    #: Resolution: data sheet, for the range of 5 V; the range of 50 V and a probe of 10:1 multiply the level by 100.
    trigger_level = Setting(
        "INP1:LEV1", float, unit="V", low=-5.125, high=5.125, resolution=2.5e-3, span=(-512.5, 512.5)
    )
    automatic_level = Setting("INP1:LEV:AUTO", bool)
    slope = Setting("INP1:SLOP1", str, choices=("POSitive", "NEGative"))
    measurement_timeout = Setting("SYST:TIM", float, unit="s", low=0.01, high=2000.0, span=(0.01, INFINITY))

    @property
    def channels(self) -> tuple[int, ...]:
        """See the base; a 53210A is known once it has given its identity."""
        return (1,) if "53210A" in self._fields else (1, 2)

    def prepare(self, *, gate_s: float, trigger_level_v: float, channel: int = 1) -> None:
        """Set the counter up; see :class:`Counter`.

        CONFigure comes first, it resets the gate and the trigger.
        """
        self._choose(channel)
        self._unsent_end = ()
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
        self.command("FORM ASC,15")  # another program may have left fewer digits, or binary numbers
        self._gives_up = True

    def readings(self, count: int) -> NDArray[np.float64]:
        """Take readings; see :class:`Counter`.  They are fetched as they come, each with its own patience."""
        self._check_count(count)
        found: list[float] = []
        with self._series(f"SAMP:COUN {count}", "INIT", end=("SAMP:COUN 1",)):
            while len(found) < count:
                part = min(READINGS_AT_ONCE, count - len(found))
                question = f"DATA:REM? {part},WAIT"
                answer = self._ask(question, part * self._patience)
                if answer is None:
                    break
                found += self._split(question, answer, part)
        return np.array(found + [np.nan] * (count - len(found)))
