"""A number as a source prints it, and the sources."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any


@dataclass(frozen=True)
class Printed:
    """A number as printed.

    Attributes:
        text: as printed, with all its digits.
        unit: as printed; empty for a pure number.
        place: table, equation or figure of the source.
        source: author and title, or journal.
        recomputed: the source shows it without digits, or not at all; it was computed apart from levilab.
    """

    text: str
    unit: str
    place: str
    source: str
    recomputed: bool = False

    @property
    def value(self) -> float:
        """The number."""
        return float(self.text)

    @property
    def rounding(self) -> float:
        """Half a unit of the last digit.

        >>> Printed("22.06", "Hz", "", "").rounding, Printed("1.760e-5", "1/rad", "", "").rounding
        (0.005, 5e-09)
        """
        digits, _, power = self.text.lower().partition("e")
        return float(f"5e{int(power or 0) - len(digits.partition('.')[2]) - 1}")


@cache
def published(source: str) -> Mapping[str, Printed]:
    """Return the numbers of a source by their dotted names; those of a list end in .0, .1 and so on.

    >>> published("thesis")["limits.lower.IC1"].text, published("thesis")["measured.limits.0"].value
    ('22.06', 21.7)
    """
    file = resources.files("levilab.simulator.published") / f"{source}.toml"
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    return dict(_numbers(table, "", str(table.pop("source"))))


def several(source: str, name: str) -> tuple[Printed, ...]:
    """Return the numbers of a list.

    >>> [one.value for one in several("thesis", "spindown.c1")]
    [0.003199, 0.003134, 0.003133, 0.003261]
    """
    found = published(source)
    return tuple(found[f"{name}.{k}"] for k in range(sum(key.startswith(f"{name}.") for key in found)))


def _numbers(table: Mapping[str, Any], prefix: str, source: str) -> Iterator[tuple[str, Printed]]:
    for key, entry in table.items():
        name = f"{prefix}{key}"
        if isinstance(entry, list):
            yield from _numbers({str(k): one for k, one in enumerate(entry)}, f"{name}.", source)
        elif "printed" in entry:
            yield name, Printed(entry["printed"], entry["unit"], entry["place"], source, entry.get("recomputed", False))
        else:
            yield from _numbers(entry, f"{name}.", source)
