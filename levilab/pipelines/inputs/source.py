"""An input of an analysis: what an analysis needs, and a run or file with its readings."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar

import numpy as np

from levilab.present.clock import local
from levilab.present.numbers import list_in_words
from levilab.runs.run import READINGS, Run

#: How a data file says that nothing in it was measured.
MARK = b"# SYNTHETIC"
#: Relative: a file rounds to 1 mHz and 10 ms, but no two runs agree so far in all readings.
SAME = 5e-5


class Readings:
    """What an analysis reads from a run or a file: a dataclass of arrays of equal length.

    Attributes:
        warnings: what to know before using them.
        compared: names of the arrays by which the same readings are found again; the last has the fingerprint.
        doubtful: whether their unit is in doubt: means leave them out, and fits to them deserve no remark.
    """

    warnings: tuple[str, ...]
    doubtful: bool = False
    compared: ClassVar[tuple[str, ...]]

    def _compared(self) -> list[np.ndarray]:
        return [getattr(self, name) for name in self.compared]

    def __len__(self) -> int:
        return len(self._compared()[-1])

    @property
    def fingerprint(self) -> float:
        """A number that the same readings share but for 1e-4 of it, and few others."""
        return float(np.abs(self._compared()[-1]).max())

    def same_as(self, other: Self) -> bool:
        """Return whether these are the same readings, but for the rounding in another file."""
        if len(self) != len(other):
            return False
        pairs = [*zip(self._compared(), other._compared(), strict=True)]
        # one value each first: of thousands of runs that begin alike, each pair is compared
        return all(abs(one[-1] - theirs[-1]) <= 2 * SAME * np.abs(theirs).max() for one, theirs in pairs) and all(
            np.allclose(one, theirs, rtol=SAME, atol=SAME * float(np.abs(theirs).max())) for one, theirs in pairs
        )


R = TypeVar("R", bound=Readings)


@dataclass(frozen=True, kw_only=True)
class Needs(Generic[R]):
    """What an analysis needs of its inputs.

    Attributes:
        name: of the analysis.
        experiments: those whose runs suit it.
        read_file, read_run: to readings, which raise DoesNotSuit for what is of another kind and DataError for what
            cannot be used.
        data: the file of a run that the readings come from.
        also: whether a run of any experiment suits.
        particular: whether it reads files by columns that no other analysis reads, so that such a file is made for it.
        wanted: a phrase that names such runs, where the experiment says too little.
    """

    name: str
    experiments: frozenset[str]
    read_file: Callable[[Path, Any], R]
    read_run: Callable[[Run, Any], R]
    data: str = READINGS
    also: Callable[[Run], bool] | None = None
    particular: bool = False
    wanted: str = ""

    @property
    def runs(self) -> str:
        """The phrase that names the runs which suit."""
        return self.wanted or f"{' or '.join(sorted(self.experiments))} run"

    def take(self, run: Run) -> bool:
        """Return whether a run suits."""
        return run.record.experiment in self.experiments or bool(self.also and self.also(run))


@dataclass(frozen=True)
class Source(Generic[R]):
    """One input.

    Attributes:
        path: what was given or found.
        data: the file with the readings.
        sha256: of that file.
        run: None for a data file.
        name: for people, as short as distinguishes it from the others.
        warnings: about the input.
        kept: options out of the correction beside a data file with which it was read.
        folder: of its group in a class; empty where its place says nothing about a group.
    """

    path: Path
    data: Path
    sha256: str
    run: Run | None
    readings: R
    name: str
    warnings: tuple[str, ...] = ()
    kept: Mapping[str, Any] = field(default_factory=dict)
    folder: str = ""

    @property
    def group(self) -> str:
        """Who measured it; empty where that is not known."""
        return in_one_line((self.run and self.run.record.group) or self.folder)

    @property
    def note(self) -> str:
        """What the person at the bench wrote down; empty for a data file."""
        return in_one_line(self.run.record.note) if self.run else ""

    @cached_property
    def synthetic(self) -> bool:
        """Whether it is known to be synthetic: of a run by its record, of a file by its first line."""
        if self.run:
            return bool(self.run.record.synthetic)
        with suppress(OSError), self.data.open("rb") as file:
            return file.read(len(MARK)) == MARK
        return False

    def settings(self, name: str) -> dict[str, Any]:
        """Return a table of the run's configuration, as of its experiment; empty where none is recorded."""
        return self.run.record.table(name) if self.run else {}

    def number(self, table: str, name: str) -> float | None:
        """Return a number in a table of the run's configuration; None where none is recorded."""
        return self.run.record.number(table, name) if self.run else None

    @property
    def time_zero(self) -> datetime | None:
        """When the clock of the readings was zero, in local time; None where that is not known, or simulated."""
        return local(self.run.record.time_zero_utc) if self.run and not self.run.record.synthetic else None

    @property
    def start(self) -> datetime | None:
        """When it was measured, in local time: time zero, or else the start of the run."""
        return self.time_zero or (local(self.run.record.started_utc) if self.run else None)


def mark_of(sources: Sequence[Source[Any]]) -> str:
    """Return the mark of a table with numbers of these inputs; empty where none is synthetic."""
    made_up = [source.name for source in sources if source.synthetic]
    if not made_up:
        return ""
    return "SYNTHETIC." if len(made_up) == len(sources) else f"SYNTHETIC IN PART ({list_in_words(made_up)})."


def in_one_line(text: str) -> str:
    """Return what a person typed, without what does not print."""
    return "".join(c if c.isprintable() else " " for c in text).strip()
