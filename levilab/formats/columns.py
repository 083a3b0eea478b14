"""The columns of a file that hold something we know, by their titles, their units and what the user says."""

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from levilab.errors import DataError, DoesNotSuit
from levilab.formats.kinds import Kind
from levilab.formats.titles import (
    CANONICAL,
    COMPANIONS,
    COMPONENTS,
    FOREIGN,
    LISTED,
    NAMES,
    QUANTITIES,
    TOTAL,
    UNITS,
    Title,
    as_a_period,
    companion,
    dimension,
    foreign_unit,
    implied_unit,
    is_total,
    is_unit,
    nearly_a_frequency,
    plain_name,
    plain_unit,
    read_title,
    unit_factor,
    without_runs_of_blanks,
)
from levilab.texts.note import of_file
from levilab.texts.text import Text, either, verbatim

SHORTHANDS = {
    "t": "time_s",
    "f": "spin_frequency_hz",
    "u": "spin_frequency_u_hz",
    "x": "x_m",
    "y": "y_m",
    "z": "height_m",
    "b": "flux_density_t",
    **{f"b{axis}": f"flux_density_{axis}_t" for axis in ("x", "y", "z", "abs")},
}


def key_of(name: str) -> str | None:
    """Return the key of a quantity in the option `columns`, by any of its names; None for an unknown one.

    >>> key_of("f"), key_of("time_s"), key_of("Frequency"), key_of("colour")
    ('f', 'time_s', 'f', None)
    """
    if name in SHORTHANDS or name in CANONICAL:
        return name
    column = NAMES.get(plain_name(name))
    return next((short for short, long in SHORTHANDS.items() if long == column), column)


class TableError(DataError):
    """A table that cannot be used.  path: of the file; line: its 1-based line, or None; message: all but these.

    The message may be a template, whose values follow it in their order.
    """

    def __init__(self, path: Path, message: str, *in_order: Any, line: int | None = None) -> None:
        self.path, self.line, self.message = path, line, Text(message, *in_order) if in_order else message
        at = "{path:s}: {message}" if line is None else "{path:s}, line {line}: {message}"
        super().__init__(at, path=shorten(str(path), 200), line=line, message=self.message)


class NoTable(TableError, DoesNotSuit):
    """A file that holds no table of text.  `kind`: of file, where its first bytes show it."""

    def __init__(
        self, path: Path, message: str, *in_order: Any, line: int | None = None, kind: "Kind | None" = None
    ) -> None:
        self.kind = kind
        super().__init__(path, message, *in_order, line=line)


class NoSuchColumn(TableError, DoesNotSuit):
    """A table without a quantity that is wanted.  `doubt` is the question whose answer would give it, else None."""

    def __init__(
        self, path: Path, message: str, *in_order: Any, line: int | None = None, doubt: "Doubt | None" = None
    ) -> None:
        self.doubt = doubt
        super().__init__(path, message, *in_order, line=line)


class Ambiguous(TableError):
    """A table with several columns for one quantity.  `doubt` says which."""

    def __init__(self, path: Path, message: str, doubt: "Doubt") -> None:
        self.doubt = doubt
        super().__init__(path, message)


class DoubtfulRows(TableError):
    """A table with rows that are no readings, which `skip_doubtful` leaves out."""


@dataclass(frozen=True)
class Column:
    """A column that is used.

    Attributes:
        name: canonical.
        index: in the file, from 0 on.
        label: in the file.
        factor: to SI.
        inverse: the file has the inverse of the quantity, a period [s] after the factor, or that one's uncertainty.
        unit: of the numbers in the file, as it was understood.
        written: whether the file or the user says that unit.
        behind: whether it is what stands behind a ± in its fields.
    """

    name: str
    index: int
    label: str
    factor: float
    inverse: bool = False
    unit: str = ""
    written: bool = False
    behind: bool = False

    @property
    def is_total(self) -> bool:
        """Whether it counts turns since the start."""
        return self.unit == TOTAL and self.name in QUANTITIES


@dataclass(frozen=True)
class Choice:
    """One answer to a question about a table.

    Attributes:
        text: for people: "rad/s (38 to 22 Hz)".
        columns: what to add to `columns` for it: {"f": "2 [rad/s]"}.
    """

    text: str
    columns: Mapping[str, str]


@dataclass(frozen=True)
class Doubt:
    """A question about a table.

    Attributes:
        kind: "unit" (of a column), "column" (which one holds a quantity), "titles" (the table has none that is known),
            "rows" (some are no readings; the answer is `skip_doubtful`).
        text: for people, with the values that were seen.
        column: 0-based index of the column that it is about; None where it is about several.
        choices: the answers, the likeliest first.
        open: whether more than the first answer is likely.
    """

    kind: Literal["unit", "column", "titles", "rows"]
    text: str
    column: int | None
    choices: tuple[Choice, ...]
    open: bool = False

    @property
    def answer(self) -> str:
        """The first answer, as it is typed: "t=1,f=2 [rpm]"; with UNIT where more than one is likely."""
        names = {key: to for choice in self.choices[:1] for key, to in choice.columns.items()}
        if self.open and self.column is not None:
            place = f"{self.column + 1} ["
            names = {key: f"{place}UNIT]" if to.startswith(place) else to for key, to in names.items()}
        return ",".join(f"{key}={to}" for key, to in names.items())


def shorten(text: str, most: int = 40) -> str:
    """Return `text` for a message of one line: no control characters, at most `most` characters."""
    plain = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    return plain if len(plain) <= most else plain[: most - 1] + "…"


def quote_names(names: Iterable[str]) -> str:
    """Return names in quotation marks, with commas, the first dozen of them."""
    names = list(names)
    return ", ".join(f"'{shorten(n)}'" for n in names[:12]) + (", …" if len(names) > 12 else "")


def choose_columns(
    path: Path,
    header: Sequence[str],
    wanted: Mapping[str, str],
    quantities: Collection[str] = CANONICAL,
    *,
    meant: Sequence[str] | None = None,
) -> tuple[tuple[Column, ...], tuple[str, ...]]:
    """Return the columns of a file with known quantities, and warnings about similar ones.

    Args:
        path: the file, for messages.
        header: the column titles, stripped.
        wanted: {canonical name, or t, f, u: title or 1-based number}; goes before what the titles say.  A unit may
            follow in brackets where the file gives none: ``Drehzahl [rpm]``.
        quantities: canonical names looked for.
        meant: the titles with their units, without what names a run; empty for columns that do not count.

    Returns:
        The columns, in the order of the canonical names, and the warnings.

    Raises:
        TableError: a wanted column does not exist, or a quantity has two columns.
    """
    meant = header if meant is None else meant
    titles = _with_periods(meant)
    chosen, stated = _wanted_columns(path, header, wanted)
    offered, warnings = _offered_columns(path, header, titles, chosen, stated, quantities=quantities)
    offered |= _by_units(titles, {*chosen, *offered}, set(chosen.values()), quantities)
    chosen |= {name: _only_one(path, header, name, indices) for name, indices in offered.items()}
    written = {name: _written_unit(name, meant[index]) for name, index in chosen.items()} | stated
    columns = []
    for name, index in chosen.items():
        quantity = COMPANIONS.get(name, name)
        period = titles[chosen.get(quantity, index)]
        if period.inverse and quantity not in stated and not written[name]:
            # an uncertainty without a unit has that of its period
            of_turn = (titles[index] if _is_of_a_period(titles[index], titles) else period).unit
            factor = (unit_factor(of_turn or "s", "time") or 1) / period.turns
            sure = of_turn is not None
            columns.append(Column(name, index, header[index], factor, inverse=True, unit=of_turn or "s", written=sure))
            continue
        # An uncertainty without a unit has that of its quantity: "rpm,u" gives both in 1/min.
        unit = written[name] or written.get(quantity)
        if written.get(quantity) == TOTAL:
            columns.append(_of_count(path, name, index, header[index], unit))
            continue
        unit = None if unit == TOTAL else unit
        if unit == "%" or (unit and dimension(name) == "frequency" and unit_factor(unit, "frequency") is None):
            factor = 0.01 if unit == "%" else (unit_factor(unit, "time") or 1) / period.turns
            columns.append(Column(name, index, header[index], factor, inverse=unit != "%", unit=unit, written=True))
            continue
        if titles[index].counts_radians(unit) or period.counts_radians(unit):
            warnings += [_angular(path, header[index])] * (name == quantity)
            unit = "rad/s"
        factor = _factor(path, name, header[index], unit)
        if titles[index].unit and not unit:
            warnings.append(_taken_in_si(path, name, header[index], titles[index].unit))
        says_unit = not implied_unit(meant[index]) or is_unit(meant[index])  # rpm does, omega does not
        sure = bool(unit) and (name in stated or says_unit)
        columns.append(Column(name, index, header[index], factor, unit=unit or _SI[dimension(name)], written=sure))
    columns, notes = _without_counts(path, columns, {SHORTHANDS.get(key, key) for key in wanted})
    return tuple(sorted(columns, key=lambda c: CANONICAL.index(c.name))), (*warnings, *notes)


def _of_count(path: Path, name: str, index: int, label: str, unit: str | None) -> Column:
    """Return the column of turns since the start, or of their u.  Raises TableError for a u in another unit."""
    if unit != TOTAL:
        said = "column '{title:s}' is in {unit:s} beside turns since the start: give u of the count, in turns"
        raise TableError(path, said, shorten(label), unit)
    return Column(name, index, label, 1.0, unit=TOTAL, written=True)


def _without_counts(path: Path, columns: list[Column], wanted: Collection[str]) -> tuple[list[Column], list[str]]:
    """Return the columns without turns since the start that stand beside others than times, and notes on them.

    Raises TableError for those that are wanted.
    """
    notes: list[str] = []
    for total in [column for column in columns if column.is_total]:
        own = {total.name, companion(total.name)}
        if {column.name for column in columns} - own == {"time_s"}:
            continue
        what = total_beside_others(total.label)
        if total.name in wanted:
            raise TableError(path, what)
        notes.append(of_file("turns", Text("{name:s}: not used: {text}", name=shorten(str(path), 200), text=what)))
        columns = [column for column in columns if column.name not in own]
    return columns, notes


def total_beside_others(label: str) -> Text:
    """Return why turns since the start are taken with times alone, and what to do."""
    said = (
        "column '{title:s}' counts turns since the start, which give a spin between two rows, and none for what else "
        "stands in a row: give the spin of each row, in Hz"
    )
    return Text(said, title=shorten(label))


#: Units that a number has where nothing says another one.
_SI = {kind: next(iter(units)) for kind, units in UNITS.items()}


#: Dimensions whose only column needs no known name; a voltage may be anything.
_SAY_THE_QUANTITY = ("time", "frequency", "length", "flux density")


def _by_units(
    titles: Sequence[Title], known: Collection[str], taken: Collection[int], quantities: Collection[str]
) -> dict[str, list[int]]:
    """Return the column that is a quantity by its unit: no other column has such a unit, and no other quantity.

    A component alone is that of a Hall probe.
    """
    kinds = Counter(dimension(name) for name in quantities if name in QUANTITIES)
    offered: dict[str, list[int]] = {}
    for name in (name for name in quantities if name in QUANTITIES and name not in known):
        kind = dimension(name)
        found = [
            k
            for k, title in enumerate(titles)
            if title.column in {None, *COMPONENTS}
            and k not in taken
            and unit_factor(title.unit or "", kind) is not None
        ]
        if len(found) == 1 and kinds[kind] == 1 and kind in _SAY_THE_QUANTITY:
            offered[name] = found
    return offered


def _factor(path: Path, name: str, label: str, unit: str | None) -> float:
    """Return the factor to SI of a column.

    Raises:
        TableError: no unit of its dimension is known, and its title has one of another dimension.
    """
    other = None if unit else foreign_unit(label, dimension(name))
    if other:
        what = "column '{title:s}' is to be {name:s} and has the unit {unit:s}, which is none of {kind}: {do}"
        raise TableError(path, what, shorten(label), name, other, dimension(name), how_else(label, name))
    return (unit_factor(unit, dimension(name)) if unit else None) or 1


def _offered_columns(
    path: Path, header: Sequence[str], titles: Sequence[Title], chosen: Mapping[str, int], stated: Mapping[str, str],
    *, quantities: Collection[str],
) -> tuple[dict[str, list[int]], list[str]]:  # fmt: skip
    """Return the indices of the columns that could be each quantity not chosen yet, and warnings.

    Turns since the start are a spin where there is no other; an uncertainty may be in turns beside them.
    """
    offered: dict[str, list[int]] = {}
    warnings = []
    totals = {name for name, unit in stated.items() if unit == TOTAL}
    totals |= {name for name, index in chosen.items() if _counts_turns(titles[index])}
    for index, title in sorted(
        enumerate(titles), key=lambda one: _counts_turns(one[1]) + (one[1].column in COMPANIONS)
    ):
        if title.column is None or title.column not in quantities:
            continue
        if title.column in chosen or index in chosen.values():
            continue
        known = title.inverse or title.unit is None or _is_unit_of(title.unit, title.column)
        if _counts_turns(title):
            known = COMPANIONS.get(title.column, title.column) in totals or title.column not in {*offered, *COMPANIONS}
            totals |= {title.column} if known else set()
        if not known and title.column == "time_s" and plain_unit(title.unit or "") in FOREIGN:
            continue  # T/°C is a temperature
        if not known and not _is_of_a_period(title, titles):
            warnings.append(_unknown_unit(path, header[index], title))
        else:
            offered.setdefault(title.column, []).append(index)
    return offered, warnings


def _counts_turns(title: Title) -> bool:
    """Return whether a title says turns since the start, or an uncertainty in them."""
    frequency = title.column is not None and dimension(title.column) == "frequency"
    return frequency and title.unit is not None and is_total(title.unit)


def _is_unit_of(unit: str, name: str) -> bool:
    """Return whether a unit is one of a canonical column; an uncertainty may be in % of its quantity."""
    return unit_factor(unit, dimension(name)) is not None or (unit == "%" and name in COMPANIONS)


def _with_periods(header: Sequence[str]) -> list[Title]:
    """Return the titles' meanings, with T for a period beside a time; periods do not count beside a frequency."""
    titles, periods = [read_title(text) for text in header], [as_a_period(text) for text in header]
    if sum(title.column == "time_s" or period is not None for title, period in zip(titles, periods, strict=True)) > 1:
        titles = [period or title for title, period in zip(titles, periods, strict=True)]
    if any(title.inverse for title in titles):
        titles = [_of_the_period(text, title) for text, title in zip(header, titles, strict=True)]
    if any(title.column == "spin_frequency_hz" and not title.inverse for title in titles):
        titles = [Title(None, title.unit) if title.inverse else title for title in titles]
    found = {title.column for title in titles}
    other = next((name for name in ("flux_density_t", "precession_frequency_hz") if name in found), None)
    if other and "spin_frequency_hz" not in found:
        for k, title in enumerate(titles):
            if title.column == companion("spin_frequency_hz"):
                name = "height_m" if unit_factor(title.unit or "", "length") else other
                titles[k] = Title(companion(name), title.unit)
    return titles


def _of_the_period(text: str, title: Title) -> Title:
    """Return the title of u_T as that of the period's uncertainty, where T is a period."""
    if title.column == companion("time_s") and re.search(r"T(?![A-Za-z])", text):
        return Title(companion("spin_frequency_hz"), title.unit)
    return title


def _is_of_a_period(title: Title, titles: Sequence[Title]) -> bool:
    """Return whether a title is that of the uncertainty of a period, in a unit of time."""
    times = title.unit is not None and unit_factor(title.unit, "time") is not None
    return times and title.column == companion("spin_frequency_hz") and any(one.inverse for one in titles)


def how_else(title: str, name: str) -> str:
    """Return advice for a column that is not the quantity of this canonical name."""
    kind = dimension(name)
    own = Text("say which unit it is, as NAME [{unit:s}]", next(iter(UNITS[kind])))
    if kind != "frequency":
        return own
    unit = read_title(title).unit
    if unit and unit_factor(unit, "time"):
        return Text("correct it, or if these are the times of a turn call the column period [{unit:s}]", shorten(unit))
    return nearly_a_frequency(title) or own


def _wanted_columns(
    path: Path, header: Sequence[str], wanted: Mapping[str, str]
) -> tuple[dict[str, int], dict[str, str]]:
    """Return the index and, where the user states it, the unit of each wanted column."""
    chosen: dict[str, int] = {}
    stated: dict[str, str] = {}
    for key, title in wanted.items():
        name = SHORTHANDS.get(key, key)
        if name not in CANONICAL:
            what = "`columns` cannot set '{key:s}'; it sets {short:s} or {long:s}"
            raise TableError(path, what, shorten(key), ", ".join(SHORTHANDS), ", ".join(LISTED))
        index, unit = find_column(path, header, key, title)
        stated |= {name: unit} if unit else {}
        if index in chosen.values():
            what = "`columns` names column '{title:s}' twice; each column holds one quantity"
            raise TableError(path, what, shorten(title))
        chosen[name] = index
    return chosen, stated


def find_column(path: Path, header: Sequence[str], key: str, title: str) -> tuple[int, str]:
    """Return the index of a column that the user names, and the unit that follows in brackets, empty without one.

    Raises TableError: there is no such column, or no such unit.
    """
    index, unit = _find(header, title.strip()), ""
    if index is None and (with_unit := re.fullmatch(r"(.+?)\s*\[([^\[\]]+)\]\s*", title)):
        index = _find(header, with_unit[1].strip())
        unit = _stated_unit(path, SHORTHANDS.get(key, key), with_unit[2].strip())
    if index is None:
        what = "has no column '{title:s}'; it has {header:s}: correct `columns` = {key:s}=NAME or NUMBER"
        raise TableError(path, what, shorten(title), quote_names(header), key)
    return index, unit


def _units_once(kind: str) -> list[str]:
    """Return the first name of each unit of a dimension.

    >>> _units_once("frequency")
    ['Hz', 'kHz', 'MHz', 'mHz', 'μHz', 'rpm', 'rad/s', '°/s', 'krpm']
    """
    names: dict[float, str] = {}
    for name, factor in UNITS[kind].items():
        names.setdefault(factor, name)
    return [*names.values()]


def _stated_unit(path: Path, name: str, unit: str) -> str:
    kind = dimension(name)
    turns = kind == "frequency" and name in QUANTITIES
    if turns and is_total(unit):
        return TOTAL
    if not (_is_unit_of(unit, name) or (turns and unit_factor(unit, "time"))):
        said = (
            ", s and ms of a turn, turns in 10 s, with two marks a turn 1/2s and 1/2min, turns since the start as turns"
        )
        of_turns = said if turns else ""
        what = "`columns`: '{unit:s}' is no unit of {kind}; known are {known:s}{of_turns}"
        raise TableError(path, what, shorten(unit), kind, ", ".join(_units_once(kind)), of_turns)
    return unit


def _find(header: Sequence[str], title: str) -> int | None:
    """Return the index of a title: as it stands, in any case, or without its unit; else a 1-based number."""
    folded = [text.casefold() for text in header]
    bare = [re.sub(r" ?/? ?[\[(][^\[\]()]*[\])]$", "", without_runs_of_blanks(text)) for text in folded]
    for titles, wanted in ((list(header), title), (folded, title.casefold()), (bare, title.casefold())):
        if titles.count(wanted) == 1:
            return titles.index(wanted)
    number = int(title) if re.fullmatch(r"[0-9]{1,6}", title) else 0
    return number - 1 if 1 <= number <= len(header) else None


def _only_one(path: Path, header: Sequence[str], name: str, indices: list[int]) -> int:
    """Return the column for a quantity: the canonical title, else the only one that could be."""
    exact = [index for index in indices if header[index] == name]
    if len(exact or indices) == 1:
        return (exact or indices)[0]
    key = next((short for short, long in SHORTHANDS.items() if long == name), name)
    period = "; if T is the time of a turn say its unit, as T [ms]" if any(header[i] == "T" for i in indices) else ""
    text = Text("columns {names:s} could each be {name:s}", quote_names(header[i] for i in indices), name)
    choices = tuple(Choice(verbatim(shorten(header[index])), {key: str(index + 1)}) for index in indices)
    doubt = Doubt("column", Text("{text}: which?", text), None, choices)
    numbers = either(f"{key}={index + 1}" for index in indices)
    raise Ambiguous(path, Text("{text}; say which: `columns` = {numbers}{period}", text, numbers, period), doubt)


def _written_unit(name: str, meant: str) -> str | None:
    """Return the unit that a title gives a column, if it is one of the quantity's."""
    unit = read_title(meant).unit or ""
    if dimension(name) == "frequency" and is_total(unit):
        return TOTAL
    return unit if _is_unit_of(unit, name) else None


def _angular(path: Path, label: str) -> str:
    said = (
        "{path:s}: column '{label:s}' is an angular frequency, read in rad/s; "
        "if it counts turns, say so with its column, as f=NAME [Hz]"
    )
    return of_file("angular", Text(said, shorten(str(path), 200), shorten(label)))


def _taken_in_si(path: Path, name: str, label: str, unit: str | None) -> str:
    said = "{path:s}: column '{label:s}' is taken in {si:s}: '{unit:s}' is no unit of {kind} known here"
    kind = dimension(name)
    return of_file("unknown unit", Text(said, shorten(str(path), 200), shorten(label), _SI[kind], unit, kind))


def _unknown_unit(path: Path, label: str, title: Title) -> str:
    kind = dimension(title.column or "")
    said = "{path:s}: column '{label:s}' is not used: '{unit:s}' is no unit of {kind} known here ({known:s} …)"
    values = shorten(str(path), 200), shorten(label), shorten(title.unit or ""), kind, ", ".join(_units_once(kind)[:8])
    return of_file("unknown unit", Text(said, *values))
