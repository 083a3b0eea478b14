"""What the header of a table of samples says: whose it is, when it starts, its step, its channels.

Headers as the scopes write them (each found in public files):

    Rigol                X,CH1,Start,Increment  /  Sequence,Volt,-2.0e-03,2.0e-05;  CH1V,t0=-1.0e-03,tInc=1.0e-06
    Keysight, Rigol      x-axis,1  /  second,Volt;  X,CH1  /  Second,Volt;  Time(CH1),Volt(CH1)
    Siglent, Tektronix   Sample Interval,1e-4  …  Source,CH1  /  Second,Volt;  Model,MDO3014  …  TIME,CH1
    Tektronix TDS        Record Length,2.5e+03,,-0.02,0.04   the header beside the first 18 rows
    OWON, Hantek, others Time interval  :,100.00uS  …  index,CH1_Voltage(mV);  #CLOCK=50.0uS;  XInc:,1e-4
    sigrok, PulseView    ; Channels (2/8): D0, D1  /  ; Samplerate: 8 MHz;  nanoseconds,logic,logic
    DSView, of DSCope    ; Channels (2/2)  /  ; Sample rate: 1 MHz;   0 (Unit: mV), 1 (Unit: V)

Plain tables with titles, as PicoScope, Analog Discovery, Red Pitaya, DSLogic and Saleae write them, have no part here.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from levilab.formats.columns import NoSuchColumn, TableError, find_column, quote_names, shorten
from levilab.formats.dialect import Dialect, filled_count, find_dialect
from levilab.formats.layout import SAMPLE, Layout, lay_out
from levilab.formats.titles import (
    LONGEST_TITLE,
    QUANTITIES,
    is_unit,
    motion_sensor,
    plain_unit,
    read_title,
    unit_factor,
    without_runs_of_blanks,
)
from levilab.formats.waveforms.rows import Head

#: What is read.
WANTED = "samples beside their times, a scope's CSV, WAV, .npy, or a column of pulse times is expected"
#: Longest header [lines].
MOST_LINES = 200
#: What stands for a unit beside its symbol.
_UNIT_WORDS = dict.fromkeys(("volt", "volts", "voltage", "value", "spannung", "y"), "V") | dict.fromkeys(
    ("a", "amp", "amps", "ampere", "amperes", "current", "strom"), "A"
)
_TIMES = frozenset({"time", "second", "seconds", "s", "in s", "x", "x-axis", "t", "zeit"})
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


def read_header(head: Head, dialect: Dialect, columns: Mapping[str, str], *, needs_times: bool = True) -> Header:
    """Recognise the header of a table of samples.

    Args:
        head: the beginning of the file.
        dialect: of its lines.
        columns: `t` names the column of times where its title is not known.
        needs_times: whether a table with titles has to have such a column.

    Raises:
        NoWaveform: it is no table of samples.
        TableError: it is one, and its header is damaged.
    """
    rows = _rows(head, dialect)
    for recognise in _RECOGNISERS:
        header = recognise(head, dialect, rows)
        if header:
            return header
    return _recognise_plain(head, dialect, columns, needs_times=needs_times)


def _rows(head: Head, dialect: Dialect) -> list[list[str]]:
    lines = [line.lstrip("#") for line in head.lines[:MOST_LINES]]
    # a blank line is a row with one empty field
    return [[field.strip().strip('"').strip() for field in dialect.split(line)] or [""] for line in lines]


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
        said = "'{line:s}' begins no table of samples; {wanted}"
        raise NoWaveform(head.path, said, shorten(line.strip()), WANTED, line=at)
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
    """Return the name of a channel: 1, CH1, CH1V, and Y(CH1) or Volt(CH1), which name the column beside its times."""
    inner = re.fullmatch(r"(?:\w+\()?(CH\d+)(?:\)|V)?", title, re.IGNORECASE)
    return f"CH{title}" if title.isdecimal() else shorten(inner[1] if inner else title)


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


#: Keys that a scope's header has, one a line.
_KEYS = frozenset({"record length", "sample interval", "sample rate", "source"})


def _recognise_titled(head: Head, dialect: Dialect, rows: Sequence[Sequence[str]]) -> Header | None:
    """Recognise times below their title or their unit, "second": Keysight, Rigol, Siglent; Tektronix MDO, MSO, TBS."""
    first = _first_row(rows, 0, 0, dialect)
    above = range(len(rows)) if first is None else [first - 1]
    last = next((k for k in above if len(rows[k]) > 1 and _TITLES_OF_TIMES.fullmatch(rows[k][0])), None)
    if last is None:
        return None
    names, keys = rows[last], _keys(rows[:last])
    units: Sequence[str] = ()
    keyed = bool(keys.keys() & _KEYS)
    if first is None and keyed:
        raise TableError(head.path, "holds the header of a scope and no samples: export it again", line=len(rows))
    if not keyed and last and _are_units(names) and len(rows[last - 1]) >= filled_count(names):
        names, units = rows[last - 1], names
    elif not keyed and "(" in names[0]:  # Time(CH1),Volt(CH1)
        units = [text.partition("(")[0] for text in names]
    if first is None or not (keyed or units):
        return None
    columns = _channels(names, units, keys)
    kept, begin = _with_samples(columns, rows, first, dialect)
    siglent = any("analog:" in cell.casefold() for cells in keys.values() for cell in cells)
    siglent = siglent or ("source" in keys and "model" not in keys)
    made = "Siglent CSV" if siglent else "Tektronix CSV"
    if not keyed:
        made = "Keysight CSV" if names[0].casefold() == "x-axis" else "Rigol CSV with times"
    return Header(
        made, dialect, begin + 1, kept, time=0, time_factor=unit_factor(units[0] if units else "s", "time") or 1.0,
        step=_interval(head, keys, dialect), count=_count(keys, dialect),
    )  # fmt: skip


def _channels(names: Sequence[str], units: Sequence[str], keys: Mapping[str, Sequence[str]]) -> list[SampleColumn]:
    """Return the columns behind that of the times, by their titles, units below these, and what the header says."""
    sources = [cell for cell in keys.get("source", ()) if cell]
    given = [cell.partition(":") for cell in keys.get("vertical units", ()) if cell]
    columns = []
    for k in range(1, filled_count(names)):
        of_header, beneath = dict(enumerate(given, 1)).get(k, ("", "", "")), dict(enumerate(units)).get(k, "")
        if _is_time(beneath):
            continue
        worded = not units and _is_unit_word(names[k])
        name = dict(enumerate(sources, 1)).get(k, of_header[0] * bool(of_header[1]))
        unit, factor = _unit(beneath or (of_header[2] or of_header[0]).strip() or names[k] * worded)
        columns.append(SampleColumn(_signal((name or f"CH{k}") if worded else names[k]), unit, k, factor))
    return columns


#: What stands above times: a title, or their unit; with its channel.
_TITLES_OF_TIMES = re.compile(r"time|seconds?|(?:time|x)\(CH.+\)", re.IGNORECASE)


def _is_time(text: str) -> bool:
    return text.casefold() in _TIMES or unit_factor(text, "time") is not None


def _are_units(row: Sequence[str]) -> bool:
    """Return whether a row holds units alone, the name of the times first."""
    return row[0].casefold() in {"second", "seconds"} and all(_is_unit_word(text) for text in row[1:] if text)


def _place_beside(rows: Sequence[Sequence[str]], dialect: Dialect) -> int:
    """Return the column of the times of Tektronix TDS, whose header stands beside the first rows; else 0."""
    time = filled_count(rows[0]) - 2
    beside = rows[0][0].casefold() == "record length" and time >= 2
    return time if beside and all(_is_number(text, dialect) for text in rows[0][time : time + 2]) else 0


def _recognise_stepped(head: Head, dialect: Dialect, rows: Sequence[Sequence[str]]) -> Header | None:
    """Recognise samples below keys that give their interval, numbered, with times or alone: Rigol, OWON, Hantek."""
    place = _place_beside(rows, dialect)
    first = 0 if place else _first_row(rows, 0, 0, dialect)
    keys = _keys(rows if place else rows[:first])
    step, start = _interval(head, keys, dialect), _printed_time(_value(keys, "start", "t0"), dialect)
    rigol = {"start", "increment"} <= {text.casefold() for text in rows[0]}
    if (step is None or start is None) and rigol:
        raise TableError(head.path, "has no numbers below Start and Increment: export it again", line=2)
    if first is None or (step is None and "timebase" not in keys):
        return None
    width = filled_count(rows[first])
    fields = [row[place] for row in rows[first:] if place < len(row)] if width > 1 else []
    steps = [after - before for before, after in pairwise(dialect.value(f) for f in fields if _is_number(f, dialect))]
    above = dict(enumerate(rows[first - 1])) if first else {}
    numbered = not place and (above.get(0, "").casefold() == "index" or set(steps[:_FEW_STEPS]) == {1.0})
    nearly = bool(steps) and (step is None or abs(sum(steps) / len(steps) / step.value - 1) < _NEARLY)
    timed = bool(place) or (nearly and not numbered)
    named = dict(enumerate(rows[0])) if rigol or "tinc" in keys else above if numbered or timed else {}
    columns, begin = [], place + (numbered or timed)
    for k in range(begin, width):
        title = "" if "=" in named.get(k, "") else named.get(k, "")
        unit = above.get(k, "") if rigol else title.partition("(")[2].rstrip(")")
        name = title.partition("(")[0].removesuffix("_Voltage") or (k == begin and _value(keys, "channel", "source"))
        of_unit = _unit(unit or _value(keys, *_UNIT_KEYS))
        columns.append(SampleColumn(_signal(name or f"CH{k - begin + 1}"), of_unit[0], k, of_unit[1]))
    kept, full = _with_samples(columns, rows, first, dialect)
    made = next((made for key, made in _MAKERS.items() if key in keys), "OWON CSV" if numbered else "CSV of a scope")
    made = "Tektronix TDS CSV" if place else made + " of the screen" * (rigol and not numbered)
    return Header(
        made, dialect, (full if numbered or timed else first) + 1, kept, time=place if timed else None,
        time_factor=unit_factor(_value(keys, "horizontal units"), "time") or 1.0, sequence=0 if numbered else None,
        start=start.value if start else None, step=step, count=_count(keys, dialect),
    )  # fmt: skip


#: A key of a header → who wrote it.
_MAKERS = {"increment": "Rigol CSV", "tinc": "Rigol CSV", "timebase": "Hantek CSV", "clock": "Hantek CSV"}
#: Rows that show whether the samples are numbered.
_FEW_STEPS = 10


def says_its_step(head: Head, dialect: Dialect) -> bool:
    """Return whether a column of numbers stands below a header that gives the interval of its samples."""
    rows = _rows(head, dialect)
    return any(recognise(head, dialect, rows) for recognise in (_recognise_sigrok, _recognise_stepped))


#: Units of times as sigrok writes them above their column [s].
_SIGROK_TIMES = {"seconds": 1.0, "milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9, "picoseconds": 1e-12}


def _recognise_sigrok(head: Head, dialect: Dialect, rows: Sequence[Sequence[str]]) -> Header | None:
    """Recognise channels and rate in comments, below them perhaps a row of units, with that of a time or without."""
    first = _first_row(rows, -1, 0, dialect)
    above = [row for row in rows[:first] if row[0]]
    comments = [line.lstrip("; ") for line in head.lines[:first] if line.startswith(";")]
    titles = above[-1] if above and not above[-1][0].startswith(";") else ()
    clock = titles[0].casefold() if titles else ""
    timed = clock == "time" or clock in _SIGROK_TIMES  # of "time" the rate tells the unit
    of_sigrok = any("generated by " in text and "sigrok" in text for text in comments)
    of_sigrok &= timed or read_title(clock).column != "time_s"
    readings = any(read_title(title).column for title in titles[1:])  # of a table whose times are titled seconds
    if first is None or not (of_sigrok or (clock in _SIGROK_TIMES and not readings)):
        return None
    parts = [text.partition(":") for text in comments]
    said = {key.partition(" (")[0].casefold(): value.strip() for key, _, value in parts}
    names = said.get("channels", "").split(",")
    columns = []
    for place, k in enumerate(range(int(timed), filled_count(rows[first]))):
        title = titles[k] if k < len(titles) else ""
        of_dsview = re.fullmatch(r"(.+) \(Unit: (.+)\)", title)
        unit = of_dsview[2] if of_dsview else title.partition(" ")[0]
        name = _signal(of_dsview[1]) if of_dsview else names[place].strip() if place < len(names) else ""
        of_unit = ("logic", 1.0) if unit in {"", "logic"} else _unit(unit if _is_unit_word(unit) else "V")
        columns.append(SampleColumn(shorten(name or f"CH{place + 1}"), of_unit[0], k, of_unit[1]))
    rate = re.fullmatch(r"(\S+) ?([kMG]?)Hz", said.get("samplerate") or said.get("sample rate", ""))
    known = printed(rate[1], dialect) if rate else None
    scale = {"k": 1e3, "M": 1e6, "G": 1e9}.get(rate[2], 1.0) if rate else 1.0
    step = Printed(1 / (known.value * scale), 0.0) if known and known.value > 0 else None
    return Header(
        "sigrok CSV", dialect, first + 1, tuple(columns), time=0 if timed else None,
        time_factor=_SIGROK_TIMES.get(clock, 1.0), step=step,
    )  # fmt: skip


def _keys(rows: Sequence[Sequence[str]]) -> dict[str, Sequence[str]]:
    """Return key → cells of each line, or column: Source,CH1; Time interval :,4uS; CLOCK=50uS; X,CH1,Increment."""
    found: dict[str, Sequence[str]] = {}
    for row in reversed(rows):
        key, mark, value = re.fullmatch(r"([^:=]*)([:=]?)(.*)", row[0], re.DOTALL).groups() if row else ("", "", "")  # type: ignore[union-attr]
        if key.strip():
            cells = [cell for cell in row[1:] if cell != ":"]
            value = value.strip(" ,;")
            found[key.strip().casefold()] = ([value] if mark and value else []) + cells
        parts = (cell.partition("=") for cell in row[1:])
        found |= {key.strip().casefold(): [value.strip()] for key, mark, value in parts if mark}
    if len(rows) > 1 and {"start", "increment"} <= {text.casefold() for text in rows[0]}:
        found |= {key.casefold(): [cell] for key, cell in zip(rows[0], rows[1], strict=False) if key}
    return found


def _value(keys: Mapping[str, Sequence[str]], *names: str) -> str:
    """Return the value of the first key that there is, without the word before a colon: Analog:140000."""
    cells = next((keys[name] for name in names if name in keys), ())
    return cells[0].rpartition(":")[2].strip() if cells else ""


def _interval(head: Head, keys: Mapping[str, Sequence[str]], dialect: Dialect) -> Printed | None:
    """Return the sampling interval [s]."""
    interval = next((one for key in _INTERVALS if (one := _printed_time(_value(keys, key), dialect))), None)
    rate = printed(_value(keys, "sample rate"), dialect)
    if interval is None and rate is not None and rate.value > 0:
        interval = Printed(1 / rate.value, rate.resolution / rate.value**2)
    if interval is not None and not interval.value > 0:
        raise TableError(head.path, "its header says a sample interval of {s:g} s: export it again", interval.value)
    return interval


#: Keys of headers: of the sampling interval, of the number of samples, of their unit.
_INTERVALS = (
    "sample interval", "sampling interval", "sampling period", "time interval", "clock", "xinc", "increment", "tinc"
)  # fmt: skip
_COUNT_KEYS = ("record length", "memory length", "size", "points")
_UNIT_KEYS = ("units", "vertical units", "vertical unit", "yunits")
#: Part by which printed times may differ from the header's interval.
_NEARLY = 0.01


def _printed_time(text: str, dialect: Dialect) -> Printed | None:
    """Return a time [s] with or without its unit: 1e-3, 50.0uS."""
    number, unit = re.fullmatch(r"(.*?)\s*([a-zµμ]*)", text, re.IGNORECASE | re.DOTALL).groups()  # type: ignore[union-attr]
    factor, found = unit_factor(unit, "time") if unit else 1.0, printed(number, dialect)
    return Printed(found.value * factor, found.resolution * factor) if found and factor else None


def _count(keys: Mapping[str, Sequence[str]], dialect: Dialect) -> int | None:
    count = printed(_value(keys, *_COUNT_KEYS), dialect)
    return int(count.value) if count and 0 < count.value < 1e15 else None


_RECOGNISERS = (_recognise_sigrok, _recognise_titled, _recognise_stepped)


# --- headers of no particular maker --------------------------------------------------------------------


def _recognise_plain(head: Head, dialect: Dialect, wanted: Mapping[str, str], *, needs_times: bool) -> Header:
    """Recognise a column of times and others beside it, with titles or without."""
    layout = lay_out(list(head.lines), head.encoding, dialect, b"")
    if moving := motion_sensor(layout.header):
        title, sensor = moving
        text = "'{title:s}' is of {sensor}, which shows no turns of the top: record with the magnetometer"
        raise NoWaveform(head.path, text, shorten(title), sensor)
    titles = [read_title(text) for text in layout.header]
    readings = [title.column for title in titles if title.column in QUANTITIES and title.column not in _NO_READINGS]
    if readings:
        raise NoWaveform(head.path, "holds readings ({names:s}) and no samples", readings[0])
    width = len(layout.header) or layout.width
    if width < 2:
        raise NoWaveform(head.path, "has one column and no times beside it")
    time, stated = _time_column(head, layout, wanted, must_be=needs_times)
    names = layout.header or tuple("t" if k == time else f"CH{k + (k < (time or 0))}" for k in range(width))
    columns, certain = [], bool(layout.header)
    for k in range(width):
        if k != time and names[k] and names[k].casefold() not in _COUNTERS:
            beneath = layout.units[k] if k < len(layout.units) else ""
            given = (titles[k].unit if titles else None) or beneath
            unit, factor = _unit(given)
            certain = certain and bool(given) and unit == "V"
            columns.append(SampleColumn(_signal(_without_unit(names[k])), unit, k, factor))
    rows = [dialect.split(line) for line in head.lines[layout.first_line - 1 :][:MOST_LINES] if not dialect.skips(line)]
    kept = _with_samples(columns, rows, 0, dialect)[0] if rows else ()
    if not kept:
        raise NoWaveform(head.path, "has no samples beside its times, its columns are {names:s}", quote_names(names))
    factor = 1.0 if time is None else _time_factor(head, layout, time, stated)
    return Header("CSV", dialect, layout.first_line, kept, time=time, time_factor=factor, certain=certain)


#: Titles of columns that number the rows.
_COUNTERS = frozenset({"nr", "no", "n", "#", "index", "sample", "sequence"})
#: Quantities whose names also stand above samples.
_NO_READINGS = ("time_s", "drive_amplitude_v")


def _without_unit(title: str) -> str:
    """Return a title without its unit."""
    bare = re.sub(r" ?/? ?[\[(][^\[\]()]*[\])]$| ?/ ?\S+$| in \S+$", "", without_runs_of_blanks(title)[:LONGEST_TITLE])
    return shorten(bare.strip() or title)


def _time_column(head: Head, layout: Layout, wanted: Mapping[str, str], *, must_be: bool) -> tuple[int | None, str]:
    """Return the index of the column of times by its name, with the unit stated there, or by its title, or the first.

    Without times it is None.
    """
    name = wanted.get("t") or wanted.get("time_s")
    if name is not None:
        return find_column(head.path, layout.header or [""] * layout.width, "t", name)
    if not layout.header:
        return 0, ""
    folded = [title.casefold() for title in layout.header]
    known = [k for k, text in enumerate(layout.header) if read_title(text).column == "time_s" or folded[k] in _TIMES]
    if len(known) > 1 or (must_be and not known):
        what = "no title is known to be a time among {titles:s}: say `columns` = t=NAME, or `rate` in Hz"
        raise NoWaveform(head.path, what, quote_names(layout.header))
    return known[0] if known else None, ""


def _time_factor(head: Head, layout: Layout, time: int, stated: str) -> float:
    layout.must_have_one_unit(head.path, time)
    unit = stated or (read_title(layout.titles()[time]).unit if layout.header else "")
    factor = unit_factor(unit, "time") if unit else 1.0
    if factor is None:
        text = "'{unit:s}' is no unit of time: correct the title"
        raise TableError(head.path, text, shorten(unit or ""), line=layout.header_line or None)
    return factor
