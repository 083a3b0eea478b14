"""An acquisition under way: what the steps of an experiment act on."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from instruments.errors import InstrumentError
from levilab.errors import LevilabError

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.bench.bench import Bench
    from levilab.bench.config import ExperimentSettings
    from levilab.interruption import Stop
    from levilab.present.progress import Show
    from levilab.runs.writer import RunWriter


#: So long is slept at a stretch before looking whether somebody asked for the end [s].
_NAP_S = 0.2
#: Pauses [s] before the tries to reach an instrument again, half a minute in all.
REOPENING_S = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0)
#: An instrument that is lost so many times in a row, with no reading in between, is broken.
MOST_LOSSES = 5


@dataclass
class Session:
    """An acquisition under way: what the steps of an experiment act on.

    zero: bench time of time_s = 0 [s], None before it is reached;
    replaying: while a virtual top is brought to where a resumed run left it; that is no event of the run;
    asked: when the last reading was asked for [s];
    rows: the readings so far; missed: why there was none at the last times asked, empty after a reading;
    losses: how often an instrument was lost since the last reading.
    """

    bench: Bench
    settings: ExperimentSettings
    writer: RunWriter
    show: Show
    stop: Stop
    zero: float | None = None
    replaying: bool = False
    asked: float = 0.0
    rows: list[Row] = field(default_factory=list)
    missed: list[Missed] = field(default_factory=list)
    losses: int = 0

    def now(self) -> float:
        """Seconds since time zero."""
        return self.bench.clock.now() - (self.zero or 0.0)

    def wait(self, duration: float) -> None:
        """Let bench time pass [s].  Raises Interrupted if somebody asks for the end."""
        end = self.bench.clock.now() + duration
        while True:
            self.stop.check()
            left = end - self.bench.clock.now()
            if left <= 0:
                return
            self.bench.clock.sleep(min(left, _NAP_S))

    def event(self, kind: str, text: str, **data: Any) -> None:
        """Write down and show what happened."""
        if self.replaying:
            return
        self.writer.event(None if self.zero is None else self.now(), kind, text, **data)
        self.show.message(text)

    def find_again(self, kind: str, error: InstrumentError, set_up: Callable[[Session], None]) -> None:
        """An instrument failed in the middle of a run: reach it again and set it up anew, or give up.

        Raises the error that began it after the last of the tries in REOPENING_S, or where it is lost again and again.
        """
        self.losses += 1
        self.event("instrument lost", f"{kind}: {error}")
        if self.losses > MOST_LOSSES:
            raise error
        for tries, pause in enumerate(REOPENING_S, 1):
            self.wait(pause)
            try:
                self.bench.reopen(kind)
                set_up(self)
            except InstrumentError as again:
                self.event("not reached", f"{kind}, try {tries} of {len(REOPENING_S)}: {again}")
            else:
                self.event("found again", f"{kind} answers again and is set up as before")
                return
        raise error

    def keep(self, row: Row, remaining: float) -> None:
        """Write a reading down, then show it: what was shown is on the disk.

        Raises ExperimentFailed if its time does not come after the last one's.
        """
        if self.rows and not float(row["time_s"] or 0.0) > float(self.rows[-1]["time_s"] or 0.0):
            raise ExperimentFailed(f"the clock went back: {row['time_s']} s after {self.rows[-1]['time_s']} s")
        self.writer.reading(row)
        self.rows.append(row)
        self.missed.clear()
        self.losses = 0
        self.show.reading(_in_words(row), float(row["time_s"] or 0.0), remaining)


def _in_words(row: Row) -> str:
    return f"{row['time_s']:8.2f} s  {row['spin_frequency_hz']:9.4f} Hz"


class ExperimentFailed(LevilabError):
    """The experiment cannot go on, for a reason that lies on the bench."""


Row = dict[str, float | None]


class Missed(StrEnum):
    """Why there is no reading."""

    DARK = "no light pulses"
    LOST = "the instrument did not answer as it should"
    UNSTEADY = "no two counts that agree with each other or with the last reading"
