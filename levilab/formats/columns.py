"""The columns of a file that hold something we know, by their titles, their units and what the user says."""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from levilab.errors import DataError, DoesNotSuit
from levilab.formats.titles import (
    CANONICAL,
    COMPANIONS,
    UNITS,
    Title,
    dimension,
    foreign_unit,
    implied_unit,
    nearly_a_frequency,
    read_title,
    unit_factor,
    without_runs_of_blanks,
)

SHORTHANDS = {
    "t": "time_s",
    "f": "spin_frequency_hz",
    "u": "spin_frequency_u_hz",
    "z": "height_m",
    "b": "flux_density_t",
}


class TableError(DataError):
    """A table that cannot be used.  `path` is the file, `line` its 1-based line, where there is one."""

    def __init__(self, path: Path, message: str, *, line: int | None = None) -> None:
        self.path, self.line = path, line
        place = f"{shown(str(path), 200)}, line {line}" if line is not None else shown(str(path), 200)
        super().__init__(f"{place}: {message}")


class NoTable(TableError, DoesNotSuit):
    """A file that holds no table of text."""


class NoSuchColumn(TableError, DoesNotSuit):
    """A table without a quantity that is wanted."""


@dataclass(frozen=True)
class Column:
    """A column that is used: canonical `name`, 0-based `index` and `label` in the file, `factor` to SI."""

    name: str
    index: int
    label: str
    factor: float


def shown(text: str, most: int = 40) -> str:
    """`text` for a message of one line: no control characters, at most `most` characters."""
    plain = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    return plain if len(plain) <= most else plain[: most - 1] + "…"


def listed(names: Iterable[str]) -> str:
    """Names in quotation marks, with commas, the first dozen of them."""
    names = list(names)
    return ", ".join(f"'{shown(n)}'" for n in names[:12]) + (", …" if len(names) > 12 else "")


def choose_columns(
    path: Path,
    header: Sequence[str],
    units: Sequence[str],
    wanted: Mapping[str, str],
    quantities: Collection[str] = CANONICAL,
) -> tuple[tuple[Column, ...], tuple[str, ...]]:
    """The columns of a file that hold something we know, and warnings about those that nearly do.

    Args:
        path: the file, for messages.
        header: the column titles, stripped.
        units: the row of units beneath, or nothing.
        wanted: {canonical name, or t, f, u: title or 1-based number}; goes before what the titles say.  A unit may
            follow in brackets where the file gives none: ``Drehzahl [rpm]``.

        quantities: canonical names looked for.

    Raises:
        TableError: a wanted column does not exist, a quantity has two columns, or units contradict each other.
    """
    titles = [read_title(text) for text in header]
    chosen, stated = _wanted_columns(path, header, wanted)
    offered: dict[str, list[int]] = {}
    warnings = []
    for index, title in enumerate(titles):
        if title.column is None or title.column not in quantities:
            continue
        if title.column in chosen or index in chosen.values():
            continue
        if title.unit is not None and unit_factor(title.unit, dimension(title.column)) is None:
            warnings.append(_unknown_unit(path, header[index], title))
        else:
            offered.setdefault(title.column, []).append(index)
    chosen |= {name: _only_one(path, header, name, indices) for name, indices in offered.items()}
    written = {name: _written_unit(path, name, index, header, units) for name, index in chosen.items()} | stated
    columns = []
    for name, index in chosen.items():
        # An uncertainty without a unit has that of its quantity: "rpm,u" gives both in 1/min.
        unit = written[name] or written.get(COMPANIONS.get(name, ""))
        other = None if unit else foreign_unit(header[index], dimension(name))
        if other:
            raise TableError(
                path,
                f"column '{shown(header[index])}' is to be {name} and has the unit {other}, which is none of "
                f"{dimension(name)}: {how_else(header[index])}",
            )
        factor = unit_factor(unit, dimension(name)) if unit else 1
        columns.append(Column(name, index, header[index], factor or 1))
    return tuple(sorted(columns, key=lambda c: CANONICAL.index(c.name))), tuple(warnings)


def how_else(title: str) -> str:
    """What to do with a column that is not what is wanted."""
    work_out = nearly_a_frequency(title)
    return f"write {work_out} into the column, in Hz" if work_out else "say which unit it is, as NAME [Hz]"


def _wanted_columns(
    path: Path, header: Sequence[str], wanted: Mapping[str, str]
) -> tuple[dict[str, int], dict[str, str]]:
    """Index and, where the user states it, unit of each wanted column."""
    chosen: dict[str, int] = {}
    stated: dict[str, str] = {}
    for key, title in wanted.items():
        name = SHORTHANDS.get(key, key)
        if name not in CANONICAL:
            raise TableError(
                path, f"`columns` cannot set '{shown(key)}'; it sets {', '.join(SHORTHANDS)} or {', '.join(CANONICAL)}"
            )
        index = _find(header, title.strip())
        if index is None and (with_unit := re.fullmatch(r"(.+?)\s*\[([^\[\]]+)\]\s*", title)):
            index = _find(header, with_unit[1].strip())
            stated[name] = _stated_unit(path, name, with_unit[2].strip())
        if index is None:
            raise TableError(
                path,
                f"has no column '{shown(title)}'; it has {listed(header)}: correct `columns` = {key}=NAME or NUMBER",
            )
        if index in chosen.values():
            raise TableError(path, f"`columns` names column '{shown(title)}' twice; each column holds one quantity")
        chosen[name] = index
    return chosen, stated


def _stated_unit(path: Path, name: str, unit: str) -> str:
    kind = dimension(name)
    if unit_factor(unit, kind) is None:
        raise TableError(path, f"`columns`: '{shown(unit)}' is no unit of {kind}; known are {', '.join(UNITS[kind])}")
    return unit


def _find(header: Sequence[str], title: str) -> int | None:
    """Index of a title: as it stands, in any case, or without its unit; else a 1-based number."""
    folded = [text.casefold() for text in header]
    bare = [re.sub(r" ?/? ?[\[(][^\[\]()]*[\])]$", "", without_runs_of_blanks(text)) for text in folded]
    for titles, wanted in ((list(header), title), (folded, title.casefold()), (bare, title.casefold())):
        if titles.count(wanted) == 1:
            return titles.index(wanted)
    number = int(title) if re.fullmatch(r"[0-9]{1,6}", title) else 0
    return number - 1 if 1 <= number <= len(header) else None


def _only_one(path: Path, header: Sequence[str], name: str, indices: list[int]) -> int:
    """The column for a quantity: the canonical title, else the only one that could be."""
    exact = [index for index in indices if header[index] == name]
    if len(exact or indices) == 1:
        return (exact or indices)[0]
    key = next((short for short, long in SHORTHANDS.items() if long == name), name)
    numbers = " or ".join(f"{key}={index + 1}" for index in indices)
    raise TableError(
        path,
        f"columns {listed(header[i] for i in indices)} could each be {name}; say which: `columns` = {numbers}",
    )


def _written_unit(path: Path, name: str, index: int, header: Sequence[str], units: Sequence[str]) -> str | None:
    """The unit that the title or the row of units gives a column, if it is one of the quantity's."""
    title = read_title(header[index])
    kind = dimension(name)
    in_title = title.unit if title.unit and unit_factor(title.unit, kind) is not None else None
    beneath = units[index] if index < len(units) and unit_factor(units[index], kind) is not None else None
    implied = implied_unit(header[index]) is not None
    if in_title and beneath and not implied and unit_factor(in_title, kind) != unit_factor(beneath, kind):
        raise TableError(
            path,
            f"column '{shown(header[index])}' has the unit '{shown(beneath)}' in the row beneath; correct one of them",
        )
    return beneath or in_title


def _unknown_unit(path: Path, label: str, title: Title) -> str:
    kind = dimension(title.column or "")
    return (
        f"{shown(str(path), 200)}: column '{shown(label)}' is not used: '{shown(title.unit or '')}' is no unit of "
        f"{kind} known here ({', '.join(list(UNITS[kind])[:8])} …)"
    )
