"""What Lake Shore's gaussmeters have in common."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from instruments.drivers.scpi import ScpiInstrument, Setting
from instruments.errors import BadAnswer, CommandRefused, OutOfRange

if TYPE_CHECKING:
    from collections.abc import Mapping


#: One of each unit in tesla.  A Hall probe sees B; oersted and A/m are B/μ₀ in air.
_UNITS_T = {"GAUSS": 1e-4, "TESLA": 1.0, "OERSTED": 1e-4, "A/M": 4e-7 * math.pi}
#: No probe of the family measures more.
_STRONGEST_T = 35.1
#: TYPE? less 40, or less 50 with a cable that the user has programmed.
_PROBES = ("HSE", "HST", "UHS")


@dataclass(eq=False)
class Coded(Setting[str]):
    """A setting that is a word of the choices here and its number on the wire.  first: the first word's number."""

    first: int = 1

    def _parse(self, address: str, question: str, answer: str) -> str:
        try:
            index = int(answer) - self.first
        except ValueError:
            index = -1
        if not 0 <= index < len(self.choices):
            last = self.first + len(self.choices) - 1
            raise BadAnswer(address, question, answer, f"a number from {self.first} to {last}")
        return self.choices[index]

    def _spell(self, value: str) -> str:
        return str(self.choices.index(str(value).upper()) + self.first)


class LakeShoreGaussmeter(ScpiInstrument):
    """What the Lake Shore gaussmeters 425, 455 and 475 have in common.

    They have no error queue, and ignore what they do not understand.  So each setting is asked back in the same
    message, ``UNIT 2;UNIT?``: one exchange, for they want to be left alone between two.
    """

    #: What SerialTransport must be told; pause: between two exchanges [s].
    #: Greatest flux density of each range [T], by probe, lowest first.
    RANGES_T: ClassVar[Mapping[str, tuple[float, ...]]]
    #: RDGMODE for steady fields.
    _STEADY: ClassVar[str]
    #: So many readings are tried while the unit changes.
    _MOST_UNITS = 3
    #: The unit as it was asked for last.
    _unit: str | None = None

    unit = Coded("UNIT", str, choices=tuple(_UNITS_T))
    automatic_range = Coded("AUTO", str, choices=("OFF", "ON"), first=0)
    mode = Setting("RDGMODE", str)

    def forget_errors(self) -> None:
        """There is no error queue."""

    def raise_errors(self, after: str) -> None:
        """There is no error queue."""

    def command(self, message: str) -> None:
        """Set something and ask it back.  Raises CommandRefused when it is not so afterwards."""
        header, _, wanted = message.partition(" ")
        answer = self.transport.query(f"{message};{header}?")
        if _numbers(answer) != _numbers(wanted):
            self.transport.clear()  # it may have been the answer to something else
            raise CommandRefused(self.transport.address, message, (f"{header}? answers {answer!r} afterwards",))

    def settings(self) -> dict[str, bool | float | str]:
        """Unit, mode, range and probe as they stand in the instrument."""
        probe = self.probe()
        return super().settings() | {"probe": probe, "range_t": self._range_t(probe)}

    def probe(self) -> str:
        """HSE, HST or UHS: high sensitivity, high stability, ultra-high sensitivity.  Raises BadAnswer."""
        answer = self._ask("TYPE?")
        with self.resynchronised():
            if answer // 10 not in {4, 5} or answer % 10 >= len(_PROBES):
                raise BadAnswer(self.transport.address, "TYPE?", str(answer), "a probe: is one plugged in?")
        return _PROBES[answer % 10]

    def _range_t(self, probe: str) -> float:
        """The greatest flux density of the range in use [T]."""
        ranges = self.RANGES_T[probe]
        number = self._ask("RANGE?")
        with self.resynchronised():
            if not 1 <= number <= len(ranges):
                raise BadAnswer(self.transport.address, "RANGE?", str(number), f"1 to {len(ranges)}")
        return ranges[number - 1]

    def prepare(self, *, range_t: float | None) -> None:
        """Steady fields in tesla; the smallest range that holds range_t; see :class:`Magnetometer`."""
        self.unit = self._unit = "TESLA"
        self.mode = self._STEADY
        if range_t is None:
            self.automatic_range = "ON"
            return
        ranges = self.RANGES_T[self.probe()]
        fitting = [number for number, full in enumerate(ranges, start=1) if 0 < range_t <= full * (1 + 1e-9)]
        if not fitting:
            raise OutOfRange(self.transport.address, "range_t", range_t, f"more than 0, up to {ranges[-1]:g} T")
        self.automatic_range = "OFF"
        self.command(f"RANGE {fitting[0]}")

    def flux_density(self) -> float | None:
        """One reading [T]; see :class:`Magnetometer`.

        The unit is asked after each: somebody may have changed it at the front panel, or a reset.  Then it is not
        known which one the reading was in, and another is taken.  Raises BadAnswer without a probe.
        """
        for _ in range(self._MOST_UNITS):
            unit = self._unit or self.unit
            answer = self.transport.query("RDGFIELD?")
            self._unit = self.unit
            if self._unit == unit:
                return self._checked(answer, _UNITS_T[unit])
        raise BadAnswer(self.transport.address, "UNIT?", str(self._unit), "a unit that stays what it is")

    def _checked(self, answer: str, per_unit: float) -> float | None:
        """A reading, given the answer and the unit [T]."""
        status = self._ask("OPST?")
        if status & (_NO_PROBE | _INVALID_PROBE) or answer == "NO PROBE":
            expected = "a flux density: is the probe plugged in (with the instrument off)?"
            raise BadAnswer(self.transport.address, "RDGFIELD?", answer, expected)
        if status & _OVERLOAD or answer == "OL":
            return None
        with self.resynchronised():
            field_t = _number(self.transport.address, answer) * per_unit
            if abs(field_t) > _STRONGEST_T:
                raise BadAnswer(self.transport.address, "RDGFIELD?", answer, f"at most {_STRONGEST_T:g} T")
        return field_t

    def zero(self) -> None:
        """Zero the probe; see :class:`Magnetometer`.  Raises NoAnswer if that takes too long."""
        raise NotImplementedError

    def _ask(self, question: str) -> int:
        answer = self.transport.query(question)
        with self.resynchronised():
            if not re.fullmatch("[0-9]{1,9}", answer):
                raise BadAnswer(self.transport.address, question, answer, "a whole number")
        return int(answer)


def _number(address: str, answer: str) -> float:
    """The number in an answer to RDGFIELD?.  Raises BadAnswer."""
    if not re.fullmatch(r"[+-]?\d+\.?\d*(E[+-]?\d{1,2})?", answer, re.ASCII):
        raise BadAnswer(address, "RDGFIELD?", answer, "a number, as +123.456E-04")
    return float(answer)


def _numbers(text: str) -> list[float] | None:
    """The numbers of a list with commas; None if it is none."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        return None


#: Bits of the answer to OPST?.
_NO_PROBE, _OVERLOAD, _INVALID_PROBE, ZERO_DONE = 1, 2, 16, 128
