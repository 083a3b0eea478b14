"""Names of inputs for people: as short as distinguishes them, in the order of their groups."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from levilab.pipelines.inputs.source import R, Source
from levilab.present.numbers import short_name
from levilab.texts.text import verbatim


def with_short_names(sources: Sequence[Source[R]]) -> tuple[Source[R], ...]:
    """Give the sources names that differ: the last part of the path, or more of it."""
    names = short_paths([source.path for source in sources])
    named = [_name_for_people(source, name, sources) for source, name in zip(sources, names, strict=True)]
    names = named if len({*named}) == len(named) else names
    return tuple(replace(source, name=verbatim(name)) for source, name in zip(sources, names, strict=True))


def each_once(sources: Iterable[Source[Any]]) -> list[Source[Any]]:
    """Return the sources of several analyses, each input once; where two have one name, with names that differ."""
    once = list({source.path.resolve(): source for source in sources}.values())
    return once if len({source.name for source in once}) == len(once) else [*with_short_names(once)]


def short_paths(paths: Sequence[Path]) -> list[str]:
    """Return the last parts of the paths by which they differ."""
    for parts in range(1, 10):
        names = ["/".join(path.resolve().parts[-parts:]) for path in paths]
        if max(Counter(names).values(), default=1) == 1:
            break
    return names


#: Letters of a note in the name of a group's run; the report has all of it.
_LETTERS_OF_NOTE = 20


def _name_for_people(source: Source[R], name: str, sources: Sequence[Source[R]]) -> str:
    """Return the group of a run; if the group has several, the run's name and the beginning of its note behind it.

    A run of no group keeps its name.
    """
    if not source.group:
        return name
    if sum(other.group == source.group for other in sources) == 1:
        return source.group
    note = source.note if len(source.note) <= _LETTERS_OF_NOTE else f"{source.note[: _LETTERS_OF_NOTE - 1]}…"
    return f"{source.group}, {short_name(name)}{f' ({note})' if note else ''}"


def by_group(sources: Sequence[Source[R]]) -> Sequence[Source[R]]:
    """Return the runs of groups in the order of their names, "Group 2" before "Group 10", those of no group last."""
    return sorted(sources, key=lambda one: (not one.group, [*natural(one.group)]))


def natural(name: str) -> Iterator[tuple[float, str]]:
    """Yield the parts of a name, numbers as numbers, so that names are in a person's order."""
    for digits, letters in re.findall(r"([0-9]+)|([^0-9]+)", name):
        yield (float(digits), "") if digits else (math.inf, letters.casefold())


#: At the end of a group's name.
_NUMBER = re.compile(r"(\d{1,6})\s*$")


def seed_of_group(group: str, first: int) -> int | None:
    """Return the seed of a group by the number at the end of its name, as `levilab worksheet --seed FIRST` lists it.

    >>> seed_of_group("Group 7", 100), seed_of_group("Lions", 100)
    (106, None)
    """
    number = _NUMBER.search(group)
    return first + int(number[1]) - 1 if number and int(number[1]) else None
