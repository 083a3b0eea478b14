"""What Lake Shore's gaussmeters have in common."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from instruments.drivers.scpi import ScpiInstrument
from instruments.drivers.setting import Setting
from instruments.errors import BadAnswer, CommandRefused, OutOfRange
from instruments.ieee488 import Form

#: One of each unit in tesla.  A Hall probe sees B; oersted and A/m are B/μ₀ in air.
_UNITS_T = {"GAUSS": 1e-4, "TESLA": 1.0, "OERSTED": 1e-4, "A/M": 4e-7 * math.pi}
#: No probe of the family measures more.
_STRONGEST_T = 35.1
#: TYPE? less 40, or less 50 with a cable that the user has programmed.
_PROBES = ("HSE", "HST", "UHS")

#: How they print numbers: a field as nnn.nnn with sign and exponent (manual of the 425, pages 56 and 57), a status as
#: three digits, other numbers as one or two (public drivers of the 455 and 475).
_FIELD = Form(r"[+-]\d{3}\.\d{3}E[+-]\d{2}", "+123.456E-04")
_STATUS = Form(r"\d{3}", "004")
_DIGITS = Form(r"\d{1,2}", "2")
_LIST = Form(r"\+?\d{1,2}(,\+?\d{1,2})*", "1,2,1,1,1")
#: What the message of a reading asks, and the form of its answer; OL: beyond the range.
_READING = "UNIT?;RDGFIELD?;UNIT?;OPST?"
_BEYOND_RANGE, _WITHOUT_PROBE = "OL", "NO PROBE"


@dataclass(eq=False)
class Coded(Setting[str]):
    """A setting that is a word of the choices here and its number on the wire.  first: the first word's number."""

    first: int = 1

    def word(self, answer: str) -> str:
        """Return the word that a number on the wire stands for.  Raises ValueError."""
        index = int(_DIGITS.number(answer)) - self.first
        if not 0 <= index < len(self.choices):
            raise ValueError(answer)
        return self.choices[index]

    def _parse(self, answer: str, form: Form) -> str:
        return self.word(answer)

    def _describe_expected(self, form: Form) -> str:
        return f"a number from {self.first} to {self.first + len(self.choices) - 1}"

    def _spell(self, value: str) -> str:
        return str(self.choices.index(str(value).upper()) + self.first)


@dataclass(eq=False)
class ListedNumbers(Setting[str]):
    """Whole numbers with commas between them.  They may come with a leading zero, and are given without."""

    def _parse(self, answer: str, form: Form) -> str:
        if not form.matches(answer):
            raise ValueError(answer)
        return ",".join(str(int(number)) for number in answer.split(","))


_UNIT = Coded("UNIT", str, choices=tuple(_UNITS_T))


class LakeShoreGaussmeter(ScpiInstrument):
    """What the Lake Shore gaussmeters 425, 455 and 475 have in common.

    They have no error queue, and ignore commands that they do not understand.  So each setting is asked back in
    the same message, ``UNIT 2;UNIT?``: one exchange, as they need a pause between two.
    """

    #: Greatest flux density of each range [T], by probe, lowest first.
    RANGES_T: ClassVar[Mapping[str, tuple[float, ...]]]
    #: RDGMODE for steady fields.
    _STEADY: ClassVar[str]
    #: Most readings that are tried while the unit changes.
    _MOST_UNITS = 3

    unit = _UNIT
    automatic_range = Coded("AUTO", str, choices=("OFF", "ON"), first=0)
    mode: Setting[str]

    def forget_errors(self) -> None:
        """Do nothing: there is no error queue."""

    def raise_errors(self, after: str) -> None:
        """Do nothing: there is no error queue."""

    def command(self, message: str) -> None:
        """Set something and ask it back.  Raises CommandRefused when it is not so afterwards."""
        header, _, wanted = message.partition(" ")
        answer = self.transport.query(f"{message};{header}?")
        if _whole_numbers(answer) != _whole_numbers(wanted):
            self.transport.clear()  # it may have been the answer to something else
            raise CommandRefused(self.transport.address, message, (f"{header}? answers {answer!r} afterwards",))

    def settings(self) -> dict[str, bool | float | str]:
        """Return the instrument's unit, mode, range and probe."""
        probe = self.probe()
        return super().settings() | {"probe": probe, "range_t": self._range_t(probe)}

    def probe(self) -> str:
        """Return HSE, HST or UHS: high sensitivity, high stability, ultra-high sensitivity.  Raises BadAnswer."""
        answer = self.transport.query("TYPE?")
        if not re.fullmatch(r"[45][012]", answer, re.ASCII):
            self.reject("TYPE?", answer, "40 to 42, or 50 to 52: is a probe plugged in?")
        return _PROBES[int(answer[1])]

    def _range_t(self, probe: str) -> float:
        """Return the greatest flux density of the range in use [T]."""
        ranges = self.RANGES_T[probe]
        answer = self.transport.query("RANGE?")
        if not _DIGITS.matches(answer) or not 1 <= int(answer) <= len(ranges):
            self.reject("RANGE?", answer, f"a number from 1 to {len(ranges)}")
        return ranges[int(answer) - 1]

    def prepare(self, *, range_t: float | None) -> None:
        """Measure steady fields in tesla, in the smallest range that holds range_t; see :class:`Magnetometer`."""
        self.unit = "TESLA"
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
        """Return one reading [T]; see :class:`Magnetometer`.

        One message asks for the unit, the field, the unit again and the status: so the answer cannot be the one to
        another question.  The unit may be changed at the front panel between the two: then it is not known which one
        the reading is in, and another is taken.  Raises BadAnswer, also without a probe.
        """
        for _ in range(self._MOST_UNITS):
            answer = self.transport.query(_READING)
            with self.clearing_on_bad_answer():
                before, field, after, status = self._parts(answer)
                if before == after:
                    return self._field_t(answer, field, _UNITS_T[before], status)
        raise BadAnswer(self.transport.address, _READING, answer, "a unit that does not change")

    def _parts(self, answer: str) -> tuple[str, str, str, int]:
        """Return unit, field, unit and status of an answer.  Raises BadAnswer."""
        try:
            before, field, after, status = answer.split(";")
            return _UNIT.word(before), field, _UNIT.word(after), int(_STATUS.number(status))
        except ValueError:
            expected = f"unit, field, unit and status, as 2;{_FIELD.example};2;{_STATUS.example}"
            raise BadAnswer(self.transport.address, _READING, answer, expected) from None

    def _field_t(self, answer: str, field: str, per_unit: float, status: int) -> float | None:
        """Return the field in an answer, given one of its unit [T] and the status.  Raises BadAnswer."""
        if status & (_NO_PROBE | _INVALID_PROBE) or field == _WITHOUT_PROBE:
            advice = "is the probe plugged in (with the instrument off)?"
            raise BadAnswer(self.transport.address, _READING, answer, "a flux density", advice)
        if field == _BEYOND_RANGE:
            return None
        expected = f"a number between the units, as {_FIELD.example}, of at most {_STRONGEST_T:g} T"
        try:
            field_t = _FIELD.number(field) * per_unit
        except ValueError:
            field_t = math.inf
        if abs(field_t) > _STRONGEST_T:
            raise BadAnswer(self.transport.address, _READING, answer, expected)
        return None if status & _OVERLOAD else field_t

    def _status(self) -> int:
        """Return the bits of OPST?."""
        answer = self.transport.query("OPST?")
        if not _STATUS.matches(answer):
            self.reject("OPST?", answer, f"three digits, as {_STATUS.example}")
        return int(answer)

    def zero(self) -> None:
        """Zero the probe; see :class:`Magnetometer`.  Raises NoAnswer if that takes too long."""
        raise NotImplementedError


def _whole_numbers(text: str) -> list[int] | None:
    """Return the numbers of a list with commas; None for any other text."""
    return [int(part) for part in text.split(",")] if _LIST.matches(text) else None


#: Bits of the answer to OPST?.
_NO_PROBE, _OVERLOAD, _INVALID_PROBE, ZERO_DONE = 1, 2, 16, 128
