"""A run folder as it grows: its record, readings and events, read beside the process that writes them."""

import itertools
import json
import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levilab.errors import DataError
from levilab.files import stamp
from levilab.formats.table import NO_READING
from levilab.live.envelope import Envelope
from levilab.live.tail import Tail
from levilab.runs.find import RECORD
from levilab.runs.run import EVENTS, READINGS, Run, RunRecord
from levilab.texts.text import text_from, text_of

#: Events that are kept: of more, the first and the last ones matter, and the file has all.
MOST_EVENTS = 400
#: Longest text of an event that is shown.
_MOST_CHARACTERS = 600
#: Interval between checks that the writing process is alive, each of which takes its lock for a moment [s].
_ALIVE_EVERY_S = 2.0
#: Longest time of one look [s], so that frames do not wait; a long file takes several [s].
LOOK_S = 0.025


class Followed:
    """A run folder, read as it grows.

    Attributes:
        folder: where it is.
        record: what run.json says; None while it cannot be read.
        status: as of `levilab.runs.run.Run`; "missing" while there is no record.
        problem: why the record cannot be read, empty where it can.
        columns: names in the head of readings.csv.
        readings: all so far.
        events: the latest, each with its number among all of them as ``n``.
        event_count: of all.
        version: grows when readings are there that were not before, or none any more.
        behind: whether the last look ended before the end of the files.
    """

    def __init__(self, folder: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self.folder, self.clock = folder, clock
        self.record: RunRecord | None = None
        self.status, self.problem = "missing", ""
        self.columns: tuple[str, ...] = ()
        self.readings = Envelope(0)
        self.events: deque[dict[str, Any]] = deque(maxlen=MOST_EVENTS)
        self.event_count, self.version, self.behind = 0, 0, False
        self._rows, self._lines = Tail(folder / READINGS), Tail(folder / EVENTS)
        self._generations = (0, 0)
        self._seen: tuple[int, int, int] | None = None
        self._alive_again = -1.0

    def look(self) -> None:
        """Read the new lines of the run's files."""
        end = self.clock() + LOOK_S
        self._read_record()
        self.behind = self._read_all(self._rows, self._take_rows, end) | self._read_all(
            self._lines, self._take_events, end
        )

    def _read_all(self, tail: Tail, take: Callable[[list[bytes]], None], end: float) -> bool:
        """Return whether more is left when the time is over."""
        while lines := tail.lines():
            take(lines)
            if self.clock() > end:
                return True
        return False

    # --- run.json ---

    def _read_record(self) -> None:
        seen, now = stamp(self.folder / RECORD), self.clock()
        if seen is None:
            self.status, self.problem = "missing", f"{self.folder}: there is no run.json"
            self._seen = None
            return
        if seen == self._seen and (self.status != "running" or now < self._alive_again):
            return
        self._seen, self._alive_again = seen, now + _ALIVE_EVERY_S
        try:
            run = Run.load(self.folder)
        except DataError as error:
            self.problem = text_of(error)
            return
        self.record, self.status, self.problem = run.record, run.status, ""

    @property
    def continued_in(self) -> Path | None:
        """The folder in which this run went on, where this one was damaged under way."""
        return Run(self.folder, self.record, "running").continued_in if self.record else None

    # --- readings.csv ---

    def _take_rows(self, lines: list[bytes]) -> None:
        if self._rows.generation != self._generations[0]:
            self._generations = (self._rows.generation, self._generations[1])
            self.columns, self.readings = (), Envelope(0)
            self.version += 1
        if not self.columns:
            self.columns = tuple(name.strip() for name in lines[0].decode("utf-8", "replace").split(","))
            self.readings = Envelope(len(self.columns))
            lines = lines[1:]
        rows = numbers(lines, len(self.columns))
        if len(rows):
            self.readings.add(rows)
            self.version += 1

    # --- events.jsonl ---

    def _take_events(self, lines: list[bytes]) -> None:
        if self._lines.generation != self._generations[1]:
            self._generations = (self._generations[0], self._lines.generation)
            self.events.clear()
            self.event_count = 0
        for line in lines:
            if line.strip():
                self.event_count += 1
                self.events.append(_event(line, self.event_count))

    def texts_after(self, number: int) -> list[dict[str, Any]]:
        """Return the events after one, of those that are kept."""
        first = self.events[0]["n"] if self.events else 1
        return list(itertools.islice(self.events, max(0, number + 1 - first), None))


def numbers(lines: list[bytes], columns: int) -> NDArray[np.float64]:
    """Return the values of lines of readings.csv, shape (n, columns); an empty field is NaN, a damaged line none.

    >>> numbers([b"1,2.5", b"2,", b"3,x", b"4,5,6", b""], 2).tolist()
    [[1.0, 2.5], [2.0, nan]]
    """
    try:
        if all(line.count(b",") == columns - 1 for line in lines):
            flat = [*map(float, b",".join(lines).split(b","))]
            return _mask_missing(np.array(flat, dtype=np.float64).reshape(-1, columns))
    except ValueError:  # an empty field, or a damaged line
        pass
    rows = []
    for line in lines:
        fields = line.split(b",")
        try:
            row = [float(field) if field.strip() else np.nan for field in fields]
        except ValueError:
            continue
        if len(row) == columns and fields != [b""]:
            rows.append(row)
    return _mask_missing(np.array(rows, dtype=np.float64).reshape(-1, columns))


def _mask_missing(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Replace by NaN the numbers with which instruments say "no value"; drop rows without a first value."""
    rows[~(np.abs(rows) < NO_READING)] = np.nan
    return rows[~np.isnan(rows[:, 0])] if rows.shape[1] else rows


def _event(line: bytes, number: int) -> dict[str, Any]:
    """Return an event as the page shows it; what is damaged is shown as a damaged line."""
    try:
        event = json.loads(line)
        time_s, kind, text = event["time_s"], str(event["kind"]), str(event["text"])
        time_s = float(time_s) if time_s is not None else None
        utc, top = str(event.get("utc", "")), event.get("top")
        text, release = text_from(event.get("says"), text), _release_in(event)
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        time_s, kind, text, utc, top, release = None, "damaged", "a line of events.jsonl is damaged", "", None, {}
    if time_s is not None and not np.isfinite(time_s):
        time_s = None
    shown = {
        "time_s": time_s,
        "utc": utc[:40],
        "kind": kind[:60],
        "text": text if len(text) <= _MOST_CHARACTERS else text[:_MOST_CHARACTERS],
    }
    return {"n": number, **shown, "top": top if isinstance(top, int) else None, **release}


def _release_in(event: Mapping[str, Any]) -> dict[str, float]:
    """Return the numbers of an event that the running fit needs (`release_of`).  Raises OverflowError."""
    numbers = {name: event.get(name) for name in ("frequency_hz", "driven_s")}
    known = {name: float(value) for name, value in numbers.items() if isinstance(value, int | float)}
    return {name: value for name, value in known.items() if math.isfinite(value)}
