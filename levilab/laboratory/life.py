"""One process of a laboratory: what it has shown, and what it has left behind."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from levilab.acquisition.session import Row


@dataclass(frozen=True)
class Compared:
    """A reading beside the truth.

    Attributes:
        row: the reading.
        truth: [Hz].
        u: of the reading [Hz].
    """

    row: Row
    truth: float
    u: float


@dataclass
class Life:
    """What one process of a laboratory has shown and left behind.

    Attributes:
        number: from 0 on.
        ended: finished, interrupted, failed, killed, refused (before anything was begun) or broken (by a defect).
        status: its exit status; None: it was killed, or is broken.
        text: its last message.
        error: that ended it.
        folder: of its run.
        shown, events, messages: rows, texts of events, and all texts that were shown.
        zero: time on the bench of time_s = 0 [s].
        first: index of the first of the rows that this process has read.
        left: the status of its run, as others read it then; empty where there is none.
        output_on: whether the drive was on when it had ended.
        truth: what the world says of the rows that it has read.
    """

    number: int
    ended: str = "broken"
    status: int | None = None
    text: str = ""
    error: BaseException | None = None
    folder: Path | None = None
    shown: list[Row] = field(default_factory=list)
    events: list[str] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)
    zero: float | None = None
    first: int = 0
    left: str = ""
    output_on: bool = False
    truth: list[Compared] = field(default_factory=list)
