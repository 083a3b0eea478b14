"""What the header of a table of samples says: whose it is, when it starts, its step, its channels.

Headers as the scopes write them (each found in public files):

    Rigol DS1000Z, DS2000, DS4000   X,CH1,CH2,Start,Increment,  /  Sequence,Volt,Volt,-2.0e-03,2.0e-05
    the same, of the screen         CH1,CH2,Start,Increment,    /  Volt,Volt,-6.0e-02,1.0e-04
    Rigol DS1000E                   X,CH1,CH2,                  /  Second,Volt,Volt,
    Keysight DSOX                   x-axis,1,2                  /  second,Volt,Volt
    Siglent SDS                     Record Length,Analog:14000  …  Source,CH1  /  Second,Volt
    Tektronix MDO, MSO, TBS         Model,MDO3014               …  TIME,CH1
    Tektronix TDS                   Record Length,2.5e+03,,-0.02,0.04   the header beside the first 18 rows
    OWON HDS                        Time interval  :,100.00uS  …  index,CH1_Voltage(mV)
    Hantek DSO                      #CLOCK=50.0uS  /  #SIZE=4000, below them the samples alone
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from levilab.formats.columns import NoSuchColumn, TableError, quote_names, shorten
from levilab.formats.dialect import Dialect, filled_count, find_dialect
from levilab.formats.layout import SAMPLE, Layout, lay_out
from levilab.formats.titles import (
    LONGEST_TITLE,
    QUANTITIES,
    is_unit,
    plain_unit,
    read_title,
    unit_factor,
    without_runs_of_blanks,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from levilab.formats.waveforms.head import Head

#: What is read.
WANTED = "samples beside their times, a scope's CSV, WAV, .npy, or a column of pulse times is expected"
#: Longest header [lines].
MOST_LINES = 200
#: What stands for a unit beside its symbol.
_UNIT_WORDS = dict.fromkeys(("volt", "volts", "voltage", "value", "spannung", "y"), "V") | dict.fromkeys(
    ("a", "amp", "amps", "ampere", "amperes", "current", "strom"), "A"
)
_TIMES = frozenset({"time", "second", "seconds", "s", "x", "x-axis", "t", "zeit"})
#: Where a table might as well be one of readings, a coarser step than this makes it one [s]: no top of 20 to 60 turns
#: a second can be sampled so slowly.
LONGEST_DOUBTFUL_STEP_S = 0.02


class NoWaveform(NoSuchColumn):
    """A table that holds no samples."""


class NoRate(NoWaveform):
    """Samples whose rate is not known."""


@dataclass(frozen=True)
class Printed:
    """A number as it stands in a text.

    Attributes:
        resolution: one unit of its last digit.
    """

    value: float
    resolution: float


@dataclass(frozen=True)
class SampleColumn:
    """A channel.

    Attributes:
        index: of its column.
        factor: to its unit.
    """

    name: str
    unit: str
    index: int
    factor: float = 1.0


@dataclass(frozen=True)
class Header:
    """What stands above or beside the samples.

    Attributes:
        format: name of the program or instrument that wrote it.
        dialect: of the lines.
        first_line: 1-based line of the first row.
        columns: the channels.
        time: index of the column of printed times, if there is one; time_factor: its unit [s].
        sequence: index of the column that numbers the samples, if there is one.
        start, step: time of sample 0 and sampling interval [s], where the header gives them.
        count: samples that the header announces.
        certain: whether it can only be samples.
    """

    format: str
    dialect: Dialect
    first_line: int
    columns: tuple[SampleColumn, ...]
    time: int | None = None
    time_factor: float = 1.0
    sequence: int | None = None
    start: float | None = None
    step: Printed | None = None
    count: int | None = None
    certain: bool = True

    @property
    def used(self) -> tuple[int, ...]:
        """Indices of the columns that are read: of the times or the numbers, then of the channels."""
        clock = self.time if self.time is not None else self.sequence
        return (*(() if clock is None else (clock,)), *(column.index for column in self.columns))


def read_header(head: Head, dialect: Dialect, columns: Mapping[str, str]) -> Header:
    """Recognise the header of a table of samples.

    Args:
        head: the beginning of the file.
        dialect: of its lines.
        columns: `t` names the column of times where its title is not known.

    Raises:
        NoWaveform: it is no table of samples.
        TableError: it is one, and its header is damaged.
    """
    lines = [line.lstrip("#") for line in head.lines[:MOST_LINES]]
    rows = [[field.strip().strip('"').strip() for field in dialect.split(line)] for line in lines]
    for recognise in (_recognise_rigol, _recognise_beside, _recognise_keyed, _recognise_titled, _recognise_stepped):
        header = recognise(head, dialect, rows)
        if header:
            return header
    return _recognise_plain(head, dialect, columns)


def printed(text: str, dialect: Dialect) -> Printed | None:
    """Return a number and its last printed digit; None for any other text.

    >>> printed("-250.0000E-03", Dialect(",", "."))
    Printed(value=-0.25, resolution=1e-07)
    """
    try:
        value = dialect.number(text)
    except ValueError:
        return None
    mantissa, _, exponent = text.casefold().partition("e")
    decimals = len(mantissa.strip().partition(dialect.decimal)[2])
    power = int(exponent) if re.fullmatch(r"[+-]?\d{1,4}\s*", exponent) else 0
    return Printed(value, float(f"1e{max(min(power - decimals, 300), -300)}"))


# --- how its lines are written -------------------------------------------------------------------------


def dialect_of(head: Head) -> Dialect:
    """Find the dialect as for any table; here one number a line is a table, too."""
    sample = head.lines[-SAMPLE:]
    found = find_dialect(sample)
    texts = [line.strip() for line in sample if line.strip()]
    one_comma = [re.fullmatch(r"[+-]?\d+,(\d+)", text) for text in texts]
    with_comma = [match for match in one_comma if match]
    if len(with_comma) > 0.9 * len(texts) and any(match[1].startswith("0") and match[1] != "0" for match in with_comma):
        return Dialect(None, ",")  # "0,0334" alone on a line is a number, no pair of them
    if found is not None:
        return found
    if sum(bool(re.fullmatch(r"[+-]?\d*[.,]?\d+([eE][+-]?\d+)?[,;]?", text)) for text in texts) < 0.5 * len(texts):
        at, line = next((n, line) for n, line in enumerate(head.lines, 1) if line.strip())
        raise NoWaveform(head.path, f"'{shorten(line.strip())}' begins no table of samples; {WANTED}", line=at)
    return Dialect(None, "," if any(match for match in one_comma) else ".")


def _unit(text: str) -> tuple[str, float]:
    """Return the unit of a channel and the factor to it: V for all kinds of volts, else what stands there."""
    plain = plain_unit(text)
    if not plain or plain.casefold() in _UNIT_WORDS:
        return _UNIT_WORDS.get(plain.casefold(), "V"), 1.0
    factor = unit_factor(plain, "voltage")
    return ("V", factor) if factor is not None else (shorten(plain, 12), 1.0)


def _is_unit_word(text: str) -> bool:
    return text.casefold() in _UNIT_WORDS or is_unit(text)


def _signal(title: str) -> str:
    """Return the name of a channel: 1, CH1, and Y(CH1) or Volt(CH1), which name the column beside its times."""
    inner = re.fullmatch(r"(\w+)\((CH\w+)\)", title, re.IGNORECASE)
    return f"CH{title}" if title.isdecimal() else shorten(inner[2] if inner else title)


def _is_number(text: str, dialect: Dialect) -> bool:
    return dialect.kind(text) == "number"


def _first_row(rows: Sequence[Sequence[str]], after: int, index: int, dialect: Dialect) -> int | None:
    """Return the index of the first row below `after` with a number at `index`."""
    return next(
        (k for k in range(after + 1, len(rows)) if index < len(rows[k]) and _is_number(rows[k][index], dialect)), None
    )


def _with_samples(
    columns: Sequence[SampleColumn], rows: Sequence[Sequence[str]], first: int, dialect: Dialect
) -> tuple[tuple[SampleColumn, ...], int]:
    """Return the channels that were on, which have a sample in any row read, and the first row with all of them.

    Two channels of one name, as the segments of a memory have, are numbered.
    """
    seen = rows[first:]
    kept = [c for c in columns if any(c.index < len(row) and _is_number(row[c.index], dialect) for row in seen)]
    begin = first
    while any(not (c.index < len(rows[begin]) and _is_number(rows[begin][c.index], dialect)) for c in kept):
        begin += 1
        if begin == len(rows):  # channels that were never on together: those of the first row, as it stands
            kept, begin = [c for c in kept if _is_number(dict(enumerate(rows[first])).get(c.index, ""), dialect)], first
    names = [c.name for c in kept]
    numbers = [names[:k].count(name) for k, name in enumerate(names)]
    return tuple(
        replace(c, name=f"{c.name} ({number + 1})") if number else c for c, number in zip(kept, numbers, strict=True)
    ), begin


# --- one vendor's header each --------------------------------------------------------------------------


def _recognise_rigol(head: Head, dialect: Dialect, rows: Sequence[Sequence[str]]) -> Header | None:
    """Recognise start and increment in the second row, below their titles; the samples numbered or not."""
    title = [text.casefold() for text in rows[0]] if len(rows) > 1 else []
    if "start" not in title or "increment" not in title:
        return None
    start, step = (
        printed(rows[1][title.index(key)], dialect) if title.index(key) < len(rows[1]) else None
        for key in ("start", "increment")
    )
    if start is None or step is None:
        raise TableError(head.path, "has no numbers below Start and Increment: export it again", line=2)
    numbered = title[0] in {"x", "sequence"}
    channels = range(int(numbered), min(title.index("start"), title.index("increment")))
    first = _first_row(rows, 1, 0, dialect)
    if first is None or not channels:
        raise TableError(head.path, "holds a header of Rigol's and no samples: export it again", line=len(rows))
    columns = [SampleColumn(_signal(rows[0][k]), *_from_unit(rows[1], k)) for k in channels]
    kept, begin = _with_samples(columns, rows, first, dialect)
    return Header(
        "Rigol CSV" if numbered else "Rigol CSV of the screen",
        dialect,
        (begin if numbered else first) + 1,
        kept,
        sequence=0 if numbered else None,
        start=start.value,
        step=step,
    )


def _from_unit(units: Sequence[str], index: int) -> tuple[str, int, float]:
    unit, factor = _unit(units[index] if index < len(units) else "")
    return unit, index, factor


def _recognise_titled(_: Head, dialect: Dialect, rows: Sequence[Sequence[str]]) -> Header | None:
    """Recognise names above a row of units, "second" first, as Keysight, Rigol and UltraScope write; no increment."""
    k = next((k for k, row in enumerate(rows) if k and _are_units(row) and len(rows[k - 1]) >= filled_count(row)), None)
    names = rows[k - 1] if k else rows[0]
    if k is None and not re.fullmatch(r"(time|x)\(.+\)", names[0], re.IGNORECASE):
        return None
    units = rows[k] if k else [text.partition("(")[0] for text in names]
    first, factor = _first_row(rows, k or 0, 0, dialect), unit_factor(units[0], "time")
    if first is None or filled_count(names) < 2:
        return None
    channels = [i for i in range(1, filled_count(names)) if not _is_time(units[i] if i < len(units) else "")]
    columns = [SampleColumn(_signal(names[i]), *_from_unit(units, i)) for i in channels]
    kept, begin = _with_samples(columns, rows, first, dialect)
    made = "Keysight CSV" if names[0].casefold() == "x-axis" else "Rigol CSV with times"
    return Header(made, dialect, begin + 1, kept, time=0, time_factor=factor or 1.0)


def _is_time(text: str) -> bool:
    return text.casefold() in _TIMES or unit_factor(text, "time") is not None


def _are_units(row: Sequence[str]) -> bool:
    """Return whether a row holds units alone, the name of the times first."""
    return row[0].casefold() in {"second", "seconds"} and all(_is_unit_word(text) for text in row[1:] if text)


def _recognise_beside(head: Head, dialect: Dialect, rows: Sequence[Sequence[str]]) -> Header | None:
    """Recognise Tektronix TDS: the header stands beside the first rows, time and samples in the last columns."""
    if len(rows) < 2 or rows[0][0].casefold() != "record length" or len(rows[0]) < 5:
        return None
    time = filled_count(rows[0]) - 2
    if time < 2 or not all(_is_number(text, dialect) for text in rows[0][time : time + 2]):
        return None
    keys = _keys(rows)
    unit, factor = _unit(_value(keys, "vertical units"))
    return Header(
        "Tektronix TDS CSV",
        dialect,
        1,
        (SampleColumn(shorten(_value(keys, "source") or "CH1"), unit, time + 1, factor),),
        time=time,
        time_factor=unit_factor(_value(keys, "horizontal units"), "time") or 1.0,
        step=_interval(head, keys, dialect),
        count=_count(keys, dialect),
    )


#: Keys that a scope's header has, one a line.
_KEYS = frozenset({"record length", "sample interval", "sample rate", "source"})


def _recognise_keyed(head: Head, dialect: Dialect, rows: Sequence[Sequence[str]]) -> Header | None:
    """Recognise a key and its value a line, then the titles, time first: Siglent; Tektronix MDO, MSO, TBS."""
    titles = next((k for k, row in enumerate(rows) if len(row) > 1 and row[0].casefold() in {"time", "second"}), None)
    if titles is None:
        return None
    keys = _keys(rows[:titles])
    if not keys.keys() & _KEYS:
        return None
    first = _first_row(rows, titles, 0, dialect)
    if first is None:
        raise TableError(head.path, "holds the header of a scope and no samples: export it again", line=len(rows))
    names = [cell for cell in keys.get("source", ()) if cell]
    units = [cell.partition(":") for cell in keys.get("vertical units", ()) if cell]
    columns = []
    for k in range(1, filled_count(rows[titles])):
        title, given = rows[titles][k], units[k - 1] if k <= len(units) else ("", "", "")
        worded = _is_unit_word(title)
        name = names[k - 1] if k <= len(names) else (given[0] if given[1] else "")
        unit, factor = _unit((given[2] or given[0]).strip() if given[0] else title if worded else "")
        columns.append(SampleColumn(_signal(title if not worded else name or f"CH{k}"), unit, k, factor))
    kept, begin = _with_samples(columns, rows, first, dialect)
    siglent = any("analog:" in cell.casefold() for cells in keys.values() for cell in cells) or "source" in keys
    return Header(
        "Siglent CSV" if siglent else "Tektronix CSV",
        dialect,
        begin + 1,
        kept,
        time=0,
        step=_interval(head, keys, dialect),
        count=_count(keys, dialect),
    )


def _recognise_stepped(head: Head, dialect: Dialect, rows: Sequence[Sequence[str]]) -> Header | None:
    """Recognise samples without times, numbered or not, below keys that give their interval: OWON, Hantek."""
    first = _first_row(rows, 0, 0, dialect)
    keys = _keys(rows[:first]) if first is not None else {}
    step = _interval(head, keys, dialect)
    if first is None or step is None:
        return None
    titles = rows[first - 1]
    numbered = titles[0].casefold() == "index"
    columns = []
    for k in range(int(numbered), filled_count(rows[first])):
        title = titles[k] if numbered and k < len(titles) else ""
        unit, factor = _unit(title.partition("(")[2].rstrip(")") or _value(keys, "units"))
        name = title.partition("(")[0].removesuffix("_Voltage") or (not k and _value(keys, "channel")) or f"CH{k + 1}"
        columns.append(SampleColumn(shorten(name), unit, k, factor))
    kept, begin = _with_samples(columns, rows, first, dialect)
    made = "OWON CSV" if numbered else "Hantek CSV"
    return Header(
        made, dialect, (begin if numbered else first) + 1, kept, sequence=0 if numbered else None, step=step,
        count=_count(keys, dialect),
    )  # fmt: skip


def _keys(rows: Sequence[Sequence[str]]) -> dict[str, Sequence[str]]:
    """Return key → cells of each line: Source,CH1; Time interval :,4uS; CLOCK=50uS."""
    found: dict[str, Sequence[str]] = {}
    for row in reversed(rows):
        key, mark, value = re.fullmatch(r"([^:=]*)([:=]?)(.*)", row[0], re.DOTALL).groups() if row else ("", "", "")  # type: ignore[union-attr]
        if key.strip():
            found[key.strip().casefold()] = ([value.strip()] if mark and value.strip() else []) + list(row[1:])
    return found


def _value(keys: Mapping[str, Sequence[str]], key: str) -> str:
    """Return the value of a key, without the word before a colon: Analog:140000."""
    cells = keys.get(key, ())
    return cells[0].rpartition(":")[2].strip() if cells else ""


def _interval(head: Head, keys: Mapping[str, Sequence[str]], dialect: Dialect) -> Printed | None:
    """Return the sampling interval [s]."""
    interval = next((one for key in _INTERVALS if (one := _printed_time(_value(keys, key), dialect))), None)
    rate = printed(_value(keys, "sample rate"), dialect)
    if interval is None and rate is not None and rate.value > 0:
        interval = Printed(1 / rate.value, rate.resolution / rate.value**2)
    if interval is not None and not interval.value > 0:
        raise TableError(head.path, f"its header says a sample interval of {interval.value:g} s: export it again")
    return interval


_INTERVALS = ("sample interval", "time interval", "clock")


def _printed_time(text: str, dialect: Dialect) -> Printed | None:
    """Return a time [s] with or without its unit: 1e-3, 50.0uS."""
    number, unit = re.fullmatch(r"(.*?)\s*([a-zµμ]*)", text, re.IGNORECASE | re.DOTALL).groups()  # type: ignore[union-attr]
    factor, found = unit_factor(unit, "time") if unit else 1.0, printed(number, dialect)
    return Printed(found.value * factor, found.resolution * factor) if found and factor else None


def _count(keys: Mapping[str, Sequence[str]], dialect: Dialect) -> int | None:
    count = printed(_value(keys, "record length") or _value(keys, "size"), dialect)
    return int(count.value) if count and 0 < count.value < 1e15 else None


# --- headers of no particular maker --------------------------------------------------------------------


def _recognise_plain(head: Head, dialect: Dialect, wanted: Mapping[str, str]) -> Header:
    """Recognise a column of times and others beside it, with titles or without."""
    layout = lay_out(list(head.lines), head.encoding, dialect, b"")
    titles = [read_title(text) for text in layout.header]
    readings = [title.column for title in titles if title.column in QUANTITIES and title.column not in _NO_READINGS]
    if readings:
        raise NoWaveform(head.path, f"holds readings ({readings[0]}) and no samples")
    width = len(layout.header) or layout.width
    if width < 2:
        raise NoWaveform(head.path, "has one column and no times beside it")
    time = _time_column(head, layout, wanted)
    names = layout.header or tuple("t" if k == time else f"CH{k if k > time else k + 1}" for k in range(width))
    columns, certain = [], bool(layout.header)
    for k in range(width):
        if k != time and names[k]:
            beneath = layout.units[k] if k < len(layout.units) else ""
            given = (titles[k].unit if titles else None) or beneath
            unit, factor = _unit(given)
            certain = certain and bool(given) and unit == "V"
            columns.append(SampleColumn(_without_unit(names[k]), unit, k, factor))
    rows = [dialect.split(line) for line in head.lines[layout.first_line - 1 :][:MOST_LINES] if not dialect.skips(line)]
    kept = _with_samples(columns, rows, 0, dialect)[0] if rows else ()
    if not kept:
        raise NoWaveform(head.path, f"has no samples beside its times, its columns are {quote_names(names)}")
    return Header(
        "CSV",
        dialect,
        layout.first_line,
        kept,
        time=time,
        time_factor=_time_factor(head, layout, time),
        certain=certain,
    )


#: Quantities whose names also stand above samples.
_NO_READINGS = ("time_s", "drive_amplitude_v")


def _without_unit(title: str) -> str:
    """Return a title without its unit."""
    bare = re.sub(r" ?/? ?[\[(][^\[\]()]*[\])]$| ?/ ?\S+$", "", without_runs_of_blanks(title)[:LONGEST_TITLE])
    return shorten(bare.strip() or title)


def _time_column(head: Head, layout: Layout, wanted: Mapping[str, str]) -> int:
    """Return the index of the column of times: by name, by its title, else the first where there are no titles."""
    name = wanted.get("t") or wanted.get("time_s")
    folded = [title.casefold() for title in layout.header]
    if name is not None:
        if name.casefold() in folded:
            return folded.index(name.casefold())
        if name.isdecimal() and 1 <= int(name) <= layout.width:
            return int(name) - 1
        raise TableError(
            head.path, f"has no column '{shorten(name)}'; it has {quote_names(layout.header)}: correct `columns`"
        )
    if not layout.header:
        return 0
    known = [k for k, text in enumerate(layout.header) if read_title(text).column == "time_s" or folded[k] in _TIMES]
    if len(known) != 1:
        raise NoWaveform(
            head.path, f"no title is known to be a time among {quote_names(layout.header)}: say `columns` = t=NAME"
        )
    return known[0]


def _time_factor(head: Head, layout: Layout, time: int) -> float:
    given = read_title(layout.header[time]).unit if layout.header else None
    beneath = layout.units[time] if time < len(layout.units) else None
    unit = given or beneath
    factor = unit_factor(unit, "time") if unit else 1.0
    if factor is None:
        raise TableError(
            head.path,
            f"'{shorten(unit or '')}' is no unit of time: correct the title",
            line=layout.header_line or None,
        )
    return factor
