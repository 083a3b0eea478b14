"""How a line of a table is written: separator, decimal mark, comments, missed readings.

The dialect is found by trying each row of a table on the file's lines and counting what comes out as numbers.
"""

import contextlib
import csv
import hashlib
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from itertools import takewhile
from typing import Literal

from levilab.formats.titles import UNITS, is_unit, known_titles

COMMENTS = ("#", "%", "//")
COMMENTS_UNLESS_SEMICOLON = (*COMMENTS, ";", "'")
#: What stands for a missed reading beside an empty field, in small letters.
MISSING = frozenset((
    "", "-", "--", "---", "n/a", "na", "n.a.", "nan", "#n/a", "#nv", "#num!", "#wert!", "#value!", "null", "none"
))  # fmt: skip
#: Mark of a formula without its value, in the place of a number.
UNVALUED = "=?"
#: What PicoScope writes, with its sign, for a sample beyond the range of its input.
OFF_RANGE = "\N{INFINITY}"
#: A number with marks between its thousands: 2.394,0 and 2,394.0, of which 2.394 alone could be either; 2 394, 2'394.
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?P<mark>[.,'’ ])\d{3}(?:(?P=mark)\d{3})*(?P<decimals>[.,]\d+)?")
#: A power of ten as people write it.
_POWER = re.compile(r"\s?[×*·x]\s?10\s?(?:\^\s?|(?=[+-]|[⁺⁻⁰¹²³⁴-⁹]))([+-]?\d+|[⁺⁻]?[⁰¹²³⁴-⁹]+)")
_HALF = r"(?:\s?([AaPp])\.?\s?[Mm]\.?)?"
#: What a stopwatch or a clock shows: minutes and seconds, hours before them; of half a day hours and minutes, too.
CLOCK = re.compile(rf"(?:(\d{{1,3}}):)?(\d{{1,3}}):(\d\d(?:[.,]\d+)?){_HALF}")
#: Units of a time that was passed, in English and German.
MINUTES, SECONDS = r"min(?:ute[ns]?)?", r"s(?:e[ck](?:onds?|unden?)?)?"
#: A time that was passed with its units: 14h05m12s, 1 min 2,5 s, 1'02".
_SPELT = re.compile(
    rf"(?:(\d+)\s?h(?:rs?)?\s?)?(?:(\d+)\s?(?:{MINUTES}|m|['′])\s?)?(?:(\d+(?:[.,]\d+)?)\s?(?:{SECONDS}|[\"″]|''))?"
)
#: Date and time: ISO 8601, or day, month and year with points or slashes.
_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d([.,]\d+)?)?(Z|[+-]\d\d:?\d\d)?")
_DATE = re.compile(r"(\d\d?)([./])(\d\d?)\2(\d{4}|\d\d),?[T ]+(\d\d?:\d\d)(:\d\d(?:[.,]\d+)?)?" + _HALF)
#: A date with the name of its month, of which three letters suffice, as 23. November 2026 or Nov 23, 2026.
_NAMED = re.compile(
    r"(?:(\d\d?)\.?[ -]([a-zä]{3})[a-z]*\.?[ -]|([a-zä]{3})[a-z]*\.? (\d\d?),? )(\d{4})(?=\D)", re.IGNORECASE
)
_MONTHS = {
    "jan": 1, "feb": 2, "mar": 3, "mär": 3, "mrz": 3, "apr": 4, "may": 5, "mai": 5, "jun": 6, "jul": 7, "aug": 8,
    "sep": 9, "oct": 10, "okt": 10, "nov": 11, "dec": 12, "dez": 12,
}  # fmt: skip
#: What phyphox writes for a cell that a spreadsheet would take for a formula: '-1.5.
GUARDED = re.compile(r"'[=+@-]")
#: A number and the unit behind it.
_NUMBER = r"[+-]?[\d.,]+(?:[eE][+-]?\d+)?"
_WITH_UNIT = re.compile(rf"(?P<number>{_NUMBER})\s*(?P<unit>[^\d\s.,+/±-].*)")
#: A number and its uncertainty: 40.00 ± 0.03 Hz, 40.00 Hz ± 0.1 %, or 40.00(3) Hz, whose digits count from the last on.
_MARK = r"\s*(?:±|\+/-|\+-)\s*"
_WITH_U = re.compile(
    rf"\(?(?P<value>{_NUMBER})\s?(?P<first>[^\d\s.,+/±-][^±]{{,30}}?)?{_MARK}"
    rf"(?P<u>{_NUMBER}(?:\s?%)?)\)?\s*(?P<unit>[^\d\s.,+/%-].*)?"
)
_CONCISE = re.compile(
    r"(?P<value>[+-]?\d+(?:[.,](?P<decimals>\d+))?)\((?P<digits>\d+(?:[.,]\d+)?)\)\s*(?P<unit>[^\d\s.,+/-].*)?"
)
#: Blanks around ±, and those between a number and its unit.
_AROUND_MARK = re.compile(_MARK)
_BEFORE_PERCENT = re.compile(rf"(±{_NUMBER})\s+(?=%)")
_BEFORE_UNIT = re.compile(
    rf"(?<![^\s±])({_NUMBER})\s+"
    rf"(?=(?:{'|'.join(re.escape(name) for units in UNITS.values() for name in units)})(?:[\s±]|$))"
)
#: A row of units in brackets alone.
_IN_BRACKETS = re.compile(r"\s*(?:\[[^\[\]]*\]\s*|\([^()]*\)\s*)+")
Kind = Literal["number", "clock", "missing", "text"]


@dataclass(frozen=True)
class Dialect:
    """Separator of the fields (None: any blanks), decimal mark of the numbers, and whether 1/2/2026 is in January."""

    separator: str | None
    decimal: str
    month_first: bool = False

    @property
    def comments(self) -> tuple[str, ...]:
        """What a comment begins with; a semicolon that separates begins an empty field instead."""
        return COMMENTS if self.separator == ";" else COMMENTS_UNLESS_SEMICOLON

    def skips(self, line: str) -> bool:
        """Return whether a line is blank or a comment; tabs that separate are empty fields, not blanks."""
        plain = line.strip(" \n") if self.separator == "\t" else line.strip()
        return not plain or (plain.lstrip().startswith(self.comments) and not GUARDED.match(plain))

    def split(self, line: str) -> list[str]:
        """Return the fields of a line, stripped, without quotation marks and without what guards = + - @ in phyphox."""
        fields = self._split(line)
        return [field[1:] if GUARDED.match(field) else field for field in fields] if "'" in line else fields

    def _split(self, line: str) -> list[str]:
        if self.separator is None:
            return _split_at_blanks(line)
        if '"' not in line:
            return [field.strip() for field in line.split(self.separator)]
        try:
            fields = next(csv.reader([line.strip(" \n")], delimiter=self.separator, skipinitialspace=True))
        except (csv.Error, StopIteration):  # a field beyond 128 KiB, or nothing but blanks
            fields = line.split(self.separator)
        return [field.strip() for field in fields]

    def number(self, text: str) -> float:
        """Return the number in a field; infinite where it says so or overflows.

        Raises:
            ValueError: the field is no number, or has the other decimal mark.
        """
        with contextlib.suppress(ValueError):
            return self._plain_number(text)
        text = re.sub(r"[^\S\t]", " ", text).replace("\N{MINUS SIGN}", "-").replace(OFF_RANGE, "inf")
        text = _POWER.sub(lambda m: "e" + unicodedata.normalize("NFKC", m[1]).replace("\N{MINUS SIGN}", "-"), text)
        if found := _THOUSANDS.fullmatch(text):
            mark, decimals = found["mark"], found["decimals"] or ""
            if decimals[:1] == self.decimal != mark or (not decimals and mark not in ".,"):
                text = text.replace(mark, "")
        return self._plain_number(text)

    def _plain_number(self, text: str) -> float:
        if "_" in text or (self.decimal == "," and "." in text):
            raise ValueError(text)
        return float(text.replace(",", ".") if self.decimal == "," else text)

    def kind(self, text: str) -> Kind:
        """Return whether a field holds a number, a time of a clock, a missed reading, or text."""
        if text.casefold() in MISSING or text == UNVALUED:
            return "missing"
        try:
            self.value(text)
        except ValueError:
            return "clock" if CLOCK.fullmatch(text) or _SPELT.fullmatch(text) or is_dated(text) else "text"
        return "number"

    def value(self, text: str) -> float:
        """Return the number in a field that may have its uncertainty and its unit behind it.  Raises ValueError."""
        with contextlib.suppress(ValueError):  # of most fields; the patterns take ten times longer
            return self._plain_number(text)
        return self.number(_without_unit((value_and_u(text) or (text,))[0]))


def value_and_u(text: str) -> tuple[str, str] | None:
    """Return a number and its uncertainty, each with its unit; one unit is that of both, but % is of the number.

    >>> value_and_u("40,00 ± 0,03 Hz"), value_and_u("40.00(3)"), value_and_u("40.00 Hz ± 0.1 %")
    (('40,00Hz', '0,03Hz'), ('40.00', '0.03'), ('40.00Hz', '0.1 %'))

    None where there are not both.
    """
    if found := _WITH_U.fullmatch(text):
        unit, first, u = found["unit"] or "", found["first"] or "", found["u"]
        return f"{found['value']}{first or unit}", u if u.endswith("%") else f"{u}{unit or first}"
    if found := _CONCISE.fullmatch(text):
        unit, decimals = found["unit"] or "", len(found["decimals"] or "")
        padded = found["digits"].zfill(decimals + 1)
        decimals = decimals if padded.isdigit() else 0  # 40.00(0.03)
        u = f"{padded[:-decimals]}{found['value'][-decimals - 1]}{padded[-decimals:]}" if decimals else padded
        return f"{found['value']}{unit}", f"{u}{unit}"
    return None


def unit_behind(text: str) -> str:
    """Return the unit behind a number, which may be %; empty where there is none.

    >>> unit_behind("38,01 Hz"), unit_behind("0.1 %"), unit_behind("38 apples")
    ('Hz', '%', '')
    """
    found = _WITH_UNIT.fullmatch((value_and_u(text) or (text,))[0])
    return found["unit"] if found and (is_unit(found["unit"]) or found["unit"] == "%") else ""


def _without_unit(text: str) -> str:
    found = _WITH_UNIT.fullmatch(text)
    return found["number"] if found and is_unit(found["unit"]) else text


def is_dated(text: str) -> bool:
    """Return whether a field is a date with its time."""
    return bool(_ISO.fullmatch(text) or _dated(text))


def _dated(text: str) -> re.Match[str] | None:
    """Return the parts of a date with points, slashes or the name of its month, English or German, and its time."""
    found = _NAMED.match(text)
    month = _MONTHS.get((found[2] or found[3]).casefold()) if found else None
    if found and month:
        text = f"{found[1] or found[4]}.{month}.{found[5]}{text[found.end() :]}"
    return _DATE.fullmatch(text)


def _year(text: str) -> int:
    return int(text) + 2000 * (len(text) == 2)


def slashed_date(text: str) -> tuple[int, int, int] | None:
    """Return the numbers of a date whose slashes leave the order of day and month open.

    >>> slashed_date("12/31/2025 10:00 PM")
    (12, 31, 2025)
    """
    found = _dated(text)
    return (int(found[1]), int(found[3]), _year(found[4])) if found and found[2] == "/" else None


def clock_time(text: str, *, month_first: bool = False) -> float:
    r"""Return the seconds that a clock, a stopwatch or a date stands for; a date's count from 1970.

    >>> clock_time("0:10"), clock_time("14:05:12.5"), clock_time("2:05 PM")
    (10.0, 50712.5, 50700.0)
    >>> clock_time("1 min 2,5 s"), clock_time("1'02\"")
    (62.5, 62.0)
    >>> clock_time("24.11.2026 9:05:12,5") - clock_time("2026-11-23 09:05:12")
    86400.5
    >>> clock_time("24. November 2026 9:05") == clock_time("Nov 24, 2026 9:05:00 AM") == clock_time("24-Nov-2026 09:05")
    True

    Raises:
        ValueError: it is none of the three.
    """
    if found := CLOCK.fullmatch(text):
        parts = [float(part.replace(",", ".")) for part in found.groups()[:3] if part]
        half = found[4]
        hours, minutes, seconds = [*parts, 0.0] if half and len(parts) == 2 else [*[0.0] * (3 - len(parts)), *parts]
        if seconds < 60 and (minutes < 60 or not (found[1] or half)) and (not half or hours <= 12):
            hours = hours % 12 + 12 * (half in {"P", "p"}) if half else hours
            return 3600 * hours + 60 * minutes + seconds
    if text and (found := _SPELT.fullmatch(text)):
        hours, minutes, seconds = (float((part or "0").replace(",", ".")) for part in found.groups())
        return 3600 * hours + 60 * minutes + seconds
    if found := _dated(text):
        first, _, second, year, minute, rest, half = found.groups()
        month, day = (first, second) if month_first and found[2] == "/" else (second, first)
        start = datetime(_year(year), int(month), int(day), tzinfo=UTC).timestamp()
        return start + clock_time(f"{minute}{rest or ('' if half else ':00')}{half + 'm' if half else ''}")
    if _ISO.fullmatch(text):
        moment = datetime.fromisoformat(text)
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    raise ValueError(text)


# Of two that do equally well the first is taken. Comma with decimal comma needs quoted fields.
SEPARATORS = ("\t", ";", ",", "|", None)
DIALECTS = tuple(Dialect(separator, decimal) for separator in SEPARATORS for decimal in (".", ","))


@dataclass(frozen=True)
class Line:
    """A line that is neither blank nor a comment: its 1-based number, its fields, and what each of them is."""

    number: int
    fields: tuple[str, ...]
    kinds: tuple[Kind, ...]

    @cached_property
    def filled_count(self) -> int:
        """Number of fields without the empty ones at the end."""
        return filled_count(self.fields)

    @property
    def is_row(self) -> bool:
        """Whether it could be a row of readings: two numbers, of which one may be missed."""
        return "number" in self.kinds and len(self.kinds) - self.kinds.count("text") > 1

    @property
    def is_text(self) -> bool:
        """Whether it could be a header: several fields, text and no number."""
        return len(self.kinds) > 1 and "text" in self.kinds and "number" not in self.kinds


def filled_count(fields: Sequence[str]) -> int:
    """Return the number of fields without the empty ones at the end."""
    return next((i for i in range(len(fields), 0, -1) if fields[i - 1]), 0)


def most_common(counts: Iterable[int]) -> int:
    """Return the most frequent of some counts, 0 of none."""
    found = Counter(counts).most_common(1)
    return found[0][0] if found else 0


def content_lines(lines: Sequence[str], dialect: Dialect, first: int = 1) -> Iterator[Line]:
    """Yield the lines that are neither blank nor comments; `first` is the number of the first line."""
    for number, line in enumerate(lines, first):
        if not dialect.skips(line):
            fields = tuple(dialect.split(line))
            yield Line(number, fields, tuple(map(dialect.kind, fields)))


def find_dialect(lines: Sequence[str], first: Sequence[str] = ()) -> Dialect | None:
    """Return the dialect in which the most lines are rows of equal width; None if nothing looks like a table.

    Rows without text count first: "1,5 2,5" is three fields with commas, one of them text, but two numbers
    with blanks. Where there are no rows, known titles decide, so that a mere header is seen as one.

    Args:
        lines: those that are rows, if there are any.
        first: the first ones of the file, where titles stand above all rows.
    """
    if found := _dialect_of_rows(lines):
        return found

    def titles(dialect: Dialect) -> int:
        candidates = (*_above_rows(first, dialect), *content_lines(lines, dialect))
        return max((known_titles(line.fields) for line in candidates if line.is_text), default=0)

    best = max(DIALECTS, key=titles)
    return best if titles(best) else None


#: Digest of some lines → the dialect of their rows.  Each analysis reads all files of a folder, in the same order, to
#: see which of them suit it.  Where there are too many, the newest entry goes: the next pass finds the older ones.
_DIALECTS_OF_ROWS: dict[bytes, Dialect | None] = {}
_MOST_DIALECTS = 1 << 14  # in 1.4 MB


def _dialect_of_rows(lines: Sequence[str]) -> Dialect | None:
    """Return the dialect in which the most lines are rows; None where none is a row in any."""
    text = "\0".join(lines).encode("utf-8", errors="surrogatepass")
    digest = hashlib.blake2b(text, digest_size=16).digest()
    with contextlib.suppress(KeyError):
        return _DIALECTS_OF_ROWS[digest]
    scores = {d: _score(content_lines(lines, d), SEPARATORS.index(d.separator)) for d in DIALECTS}
    best = max(DIALECTS, key=scores.__getitem__)
    found = best if scores[best][1] else None
    if len(_DIALECTS_OF_ROWS) >= _MOST_DIALECTS:
        _DIALECTS_OF_ROWS.popitem()
    _DIALECTS_OF_ROWS[digest] = found
    return found


def _above_rows(lines: Sequence[str], dialect: Dialect) -> Iterator[Line]:
    return takewhile(lambda line: not line.is_row, content_lines(lines, dialect))


def _score(lines: Iterable[Line], rank: int) -> tuple[int, int, int, int]:
    """Return rows of equal width without text, such rows at all, the separator's rank, numbers in those rows."""
    rows = [line for line in lines if line.is_row]
    width = most_common(line.filled_count for line in rows)
    alike = [line for line in rows if line.filled_count == width]
    clean = sum(not {"text", "clock"} & set(line.kinds) for line in alike)
    return clean, len(alike), -rank, sum(line.kinds.count("number") for line in alike)


def _split_at_blanks(line: str) -> list[str]:
    if '"' in line:
        return [field.strip('"') for field in re.findall(r'"[^"]*"|\S+', line)]
    if any(mark in line for mark in "[(/") and not _IN_BRACKETS.fullmatch(line):
        # "f [Hz]" and "f / Hz" are one title each
        line = re.sub(r"(?<!\s)\s+(?=[\[(/])|(?<=/)\s+", "", line)
    if "±" in line or "+" in line:
        line = _BEFORE_PERCENT.sub(r"\1", _AROUND_MARK.sub("±", line))
    if line.upper() != line.lower():  # 0 s   40.00 Hz
        line = _BEFORE_UNIT.sub(r"\1", line)
    return line.split()
