"""The driver of Keysight's multimeters as counters: 34401A, and 34460A, 34461A, 34465A, 34470A (Truevolt)."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.drivers.counter.reciprocal import ReciprocalCounter
from instruments.drivers.setting import Setting
from instruments.errors import OutOfRange
from instruments.ieee488 import Form

#: Its gates [s]; the longest that may be asked for, as experiments vary theirs by a quarter; readings in one answer.
GATES, _LONGEST, _AT_ONCE = (0.01, 0.1, 1.0), 2.0, 100
#: It waits this long for a period of a slow signal, and settles as long before a reading [s] (34980A, 34401A manuals).
_SLOW, _SETTLING = 1.0, 1.0
#: Ranges of the input, a.c. [V].
_RANGES = (0.1, 1.0, 10.0, 100.0, 750.0)


class Keysight34461A(ReciprocalCounter):
    """Keysight (Agilent, HP) 34401A / 34460A / 34461A / 34465A / 34470A multimeter as a counter.

    Sources: Agilent Truevolt Series Operating and Service Guide, pages 168 and 198; 34401A User's Guide; PyMeasure's
    HP34401A and its suite for a real one.

    - The input is a.c. coupled: it counts where the signal crosses its own mean.  So there is no trigger level; the one
      that :meth:`prepare` gets, about half of the pulses' height, chooses the range of the input.
    - There are three gates: the one nearest by ratio is taken, see :attr:`gate`.
    - Signals from 3 Hz on need the slow filter: after a reset it is the one from 20 Hz on.
    - Without a signal it answers 0.
    - A 34401A has another header for the filter.  On its serial line it takes no command before ``SYSTem:REMote``, on
      GPIB that command is an error; 9600 baud and two stop bits, parity and data bits as its menu says.
    """

    MODELS: ClassVar[str] = r"344(01|6[015]|70)A"
    NUMBER: ClassVar[Form] = Form(r"[+-]\d\.\d{8}E[+-]\d{2}", "+1.00000000E-01")

    gate = Setting("FREQ:APER", float, unit="s", values=GATES)
    slowest = Setting("FREQ:RANG:LOW", float, unit="Hz", values=(3.0, 20.0, 200.0))
    voltage_range = Setting("FREQ:VOLT:RANG", float, unit="V", values=_RANGES)
    automatic_range = Setting("FREQ:VOLT:RANG:AUTO", bool)

    @property
    def channels(self) -> tuple[int, ...]:
        """See the base: one input."""
        return (1,)

    def header_in_use(self, header: str) -> str:
        """See the base."""
        return "DET:BAND" if header == "FREQ:RANG:LOW" and "34401A" in self._fields else header

    def prepare(self, *, gate_s: float, trigger_level_v: float, channel: int = 1) -> None:
        """Set the multimeter up; see :class:`Counter`.  Raises OutOfRange for a level beyond its ranges."""
        address = self.transport.address
        if not GATES[0] <= gate_s <= _LONGEST:
            raise OutOfRange(address, "gate", gate_s, f"{GATES[0]:g} to {_LONGEST:g} s: it has 0.01, 0.1 and 1 s")
        if channel not in self.channels:
            raise OutOfRange(address, "channel", channel, "1")
        wide = next((limit for limit in _RANGES if limit >= abs(trigger_level_v)), None)
        if wide is None:
            raise OutOfRange(address, "trigger_level", trigger_level_v, f"up to {_RANGES[-1]:g} V")
        if "::" not in address or address.upper().startswith("ASRL"):
            self.transport.write("SYST:REM")
        if not self._fields:
            self.identity()
        self._unsent_end = ()
        self.command("CONF:FREQ")  # trigger and range as after a reset, then what this signal needs
        self.gate = gate = min(GATES, key=lambda gate: max(gate / gate_s, gate_s / gate))
        self.slowest = 3.0
        self.voltage_range = wide
        self._patience = gate + _SLOW + _SETTLING + 1.0
        self._gives_up = True

    def _reading(self, question: str, answer: str) -> float | None:
        """See the base: 0 is no signal."""
        return super()._reading(question, answer) or None

    def readings(self, count: int) -> NDArray[np.float64]:
        """Take readings; see :class:`Counter`."""
        self._check_count(count)
        found: list[float] = []
        while len(found) < count:
            part = min(_AT_ONCE, count - len(found))
            with self._series(f"SAMP:COUN {part}", end=("SAMP:COUN 1",)):
                answer = self._ask("READ?", part * self._patience)
                found += self._split("READ?", answer, part) if answer is not None else [np.nan] * part
        return np.array(found)

    def _give_up(self) -> None:
        """See the base: a device clear ends a measurement, a 34401A has no ABORt."""
        self.transport.clear()
        self.forget_errors()
