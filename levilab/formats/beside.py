"""Runs that stand side by side in one table: under one time, or each with its own."""

import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from levilab.formats.titles import LONGEST_TITLE, NAMES, QUANTITIES, Title, dimension, read_title, unit_factor


@dataclass(frozen=True)
class Part:
    """One run of a table.

    Attributes:
        name: of the run; empty where the table holds one alone.
        titles: of all columns, without what names the run; empty for columns of other runs.
        own: indices of the columns of this run alone.
    """

    name: str
    titles: tuple[str, ...]
    own: frozenset[int] = frozenset()

    def has(self, index: int, header: Sequence[str]) -> bool:
        """Return whether a column is not that of another run."""
        return self.titles[index : index + 1] != ("",) or not header[index]


_RUN = (
    r"(?:run|lauf|durchlauf|messung|messreihe|versuch|data set|datensatz|mesure|essai|medida|medición|mätning|försök)"
)
#: Logger Pro, Vernier: "Data Set 1:Time(s)"; Capstone: "Time (s) Run #1", "Durchlauf 1: Zeit (s)".
_BEFORE = re.compile(r"(?P<run>[^:]{1,40}?)\s*:\s*(?P<title>\S.*)")
_BEHIND = re.compile(rf"(?P<title>.+?)[\s,;]+(?P<run>{_RUN}\s*(?:#|nr\.?|no\.?)?\s*\d+)", re.IGNORECASE)
#: A number or a letter that ends a name, before its unit: "Messung 1 [Hz]", "f_2/Hz", "Lauf B".
_NUMBERED = re.compile(
    r"(?P<stem>.*?[^\d\s_.,(#[/-])(?P<gap>[\s_#(.]*)(?P<run>\d{1,3}|(?<=[\s_])[A-H])\)?(?P<unit>\s*(?:[\[(/,].*|in\s.*)?)"
)
_UNIT = re.compile(r"\s*(?:[\[(/,].*|\s(?:in|en|i)\s.*)$")


def parts_of(header: Sequence[str], above: Sequence[str], quantities: Collection[str]) -> tuple[Part, ...]:
    """Return the runs in a table, one where its titles name no several.

    Args:
        header: the titles of the columns.
        above: the fields of the line above them, which may name runs: each until the next one.
        quantities: canonical columns; runs have at least one of them each, beside a time.

    >>> [part.name for part in parts_of(("Zeit", "Messung 1 [Hz]", "Messung 2 [Hz]"), (), ["spin_frequency_hz"])]
    ['Messung 1', 'Messung 2']
    >>> parts_of(("Data Set 1:Time(s)", "Data Set 1:f(Hz)"), (), ["spin_frequency_hz"])[0].titles
    ('Time(s)', 'f(Hz)')
    """
    if max(map(len, header), default=0) > LONGEST_TITLE:
        return (Part("", tuple(header)),)
    for split in (_by_names, _by_repetition, _by_numbers):
        keys, titles = split(header, above)
        runs = list(dict.fromkeys(key for key in keys if key))
        if runs == [] or not _readable(keys, titles, quantities):
            continue
        if len(runs) == 1:
            return (Part("", tuple(titles)),)
        parts = []
        for run in runs:
            own = frozenset(k for k, key in enumerate(keys) if key == run)
            seen = tuple(title if keys[k] in {run, ""} else "" for k, title in enumerate(titles))
            parts.append(Part(_name(run, [header[k] for k in sorted(own)]), seen, own))
        if len({part.name for part in parts}) == len(parts):
            return tuple(parts)
    return (Part("", tuple(header)),)


def _name(run: str, own: Sequence[str]) -> str:
    """Return the name of a run: of a number with one column the title of that, without its unit."""
    plain = len(run) > 3 or run in own
    text = run if plain else _UNIT.sub("", own[0]) if len(own) == 1 and run in own[0] else f"run {run}"
    return " ".join(text.replace("/", "-").split())


def _readable(keys: Sequence[str], titles: Sequence[str], quantities: Collection[str]) -> bool:
    """Return whether a quantity that is wanted, other than a time, could stand in the columns of runs."""
    wanted = [name for name in quantities if name in QUANTITIES and name != "time_s"]
    kinds = {dimension(name) for name in wanted}
    shared, of_runs = False, False
    for key, title in zip(keys, titles, strict=True):
        found = read_title(title)
        has_unit = found.column is None and any(unit_factor(found.unit or "", kind) is not None for kind in kinds)
        known = found.column in wanted or has_unit
        shared |= known and not key
        of_runs |= bool(key) and (known or found == Title(None, None))
    return of_runs and not shared


def _by_names(header: Sequence[str], _: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the run named in each title, and the title without it."""
    keys, titles = [], []
    for text in header:
        found = _BEHIND.fullmatch(text) or _BEFORE.fullmatch(text)
        known = found and (read_title(found["title"]).column or read_title(found["title"]).unit)
        keys.append(" ".join(found["run"].split()) if found and known else "")
        titles.append(found["title"] if found and known else text)
    return keys, titles


def _by_repetition(header: Sequence[str], above: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the runs of titles that repeat themselves, by the names above them or by numbers."""
    counts = Counter(title.casefold() for title in header if title)
    most = max(counts.values(), default=1)
    names, name = [], ""
    for k in range(len(header)):
        name = (above[k] if k < len(above) else "") or name
        names.append(name)
    first = header[0].casefold() if counts[header[0].casefold()] == most else ""  # each run begins with it
    seen: Counter[str] = Counter()
    numbers = []
    for title in map(str.casefold, header):
        seen[title] += 1
        repeated = most > 1 and (first or counts[title] == most)
        numbers.append(str(seen[first or title]) if repeated else "")
    keys = [number and (name or number) for name, number in zip(names, numbers, strict=True)]
    return keys if len(set(keys) - {""}) == most else numbers, list(header)  # else names that do not go with it


def _by_numbers(header: Sequence[str], _: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the number behind each name that several columns share, and the title without it."""
    found = [None if text.casefold() in NAMES and text[-1:] != "3" else _NUMBERED.fullmatch(text) for text in header]
    stems = Counter(one["stem"].casefold() for one in found if one)
    keys, titles = [], []
    for text, one in zip(header, found, strict=True):
        shared = one is not None and stems[one["stem"].casefold()] > 1
        keys.append(one["run"] if one and shared else "")
        titles.append(f"{one['stem']}{one['unit']}" if one and shared else text)
    return keys, titles
