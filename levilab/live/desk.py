"""The bench for practice as the server holds it: commands go to it, and its events are kept for the pages."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from levilab.animation.parts import parts_of
from levilab.computer import utc_now
from levilab.errors import LevilabError
from levilab.live.practice.commands import PracticeEvent, command_of
from levilab.live.practice.experiments import PRACTICE
from levilab.live.practice.tasks import TASKS
from levilab.live.practice.what_if import WHAT_IF
from levilab.runs.run import read_record
from levilab.simulator.scene import read_scene, scene_of

if TYPE_CHECKING:
    from levilab.live.practice.bench import PracticeBench
    from levilab.telemetry.address import Address

#: What is kept of what the bench says.
_MOST_SAID = 100
#: Answers of the bench that are kept for the requests that wait for them.
_MOST_ANSWERS = 64
_LONGEST_TEXT = 600


def _data_of(row: Any) -> dict[str, Any]:
    """Return what a row of a table has, less its functions."""
    return {key: value for key, value in vars(row).items() if not callable(value)}


@dataclass
class Desk:
    """A bench for practice, and its events.

    Attributes:
        bench: which the command starts and ends.
        count: number of its events.
        said: the latest events.
        scene: of its top, None until it is ready.
        folders: of the runs that it has recorded, or records, in order.
        answers: number of a command → whether it was carried out or refused, of the latest commands.
    """

    bench: PracticeBench
    count: int = 0
    said: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=_MOST_SAID))
    scene: dict[str, Any] | None = None
    folders: list[Path] = field(default_factory=list)
    answers: dict[int, PracticeEvent] = field(default_factory=dict)
    _records: bool = field(default=False, init=False)  # between "recording" and "recorded"

    @property
    def about(self) -> dict[str, Any]:
        """The first data of the page."""
        rows = [
            {"name": name, "title": row.title, "asks": row.asks, "length_s": row.length_s}
            for name, row in PRACTICE.items()
        ]
        what_if = {name: _data_of(row) for name, row in WHAT_IF.items()}
        tasks = [_data_of(row) | {"name": name} for name, row in TASKS.items()]
        return {"experiments": rows, "what_if": what_if, "tasks": tasks} | {
            "runs": [folder.name for folder in self.folders]
        }

    @property
    def folder(self) -> Path | None:
        """Of the run that it recorded last, or records; None before."""
        return self.folders[-1] if self.folders else None

    @property
    def is_recording(self) -> bool:
        """Whether it records a run."""
        return self._records

    def address(self) -> Address | None:
        """Return the address at which the bench publishes; None until it is ready."""
        return self.bench.address

    def step(self) -> None:
        """Read the new events of the bench."""
        for event in self.bench.events():
            self.count += 1
            if event.scene:
                self.scene = event.scene
            if event.kind == "recording" and event.folder:
                self.folders.append(Path(event.folder))
            if event.kind in {"done", "refused"} and event.number is not None:
                self.answers[event.number] = event
                self.answers.pop(event.number - _MOST_ANSWERS, None)
            text = event.text if len(event.text) <= _LONGEST_TEXT else event.text[:_LONGEST_TEXT]
            self._records = event.kind == "recording" or (self._records and event.kind != "recorded")
            about = {"n": self.count, "kind": event.kind, "text": text, "status": event.status, "utc": utc_now()}
            self.said.append(about | {"of_run": self._records and event.kind == "message"})

    def events_after(self, number: object) -> list[dict[str, Any]]:
        """Return the events after the one of this number."""
        after = number if type(number) is int and number <= self.count else 0
        return [one for one in self.said if one["n"] > after]

    def carry_out(self, wanted: dict[str, Any]) -> int:
        """Send a command.  Returns its number.  Raises CommandRefused, BenchGone."""
        return self.bench.command(command_of(wanted))


def scene_of_run(folder: Path) -> dict[str, Any] | None:
    """Return the scene in a run's record; None where there is none."""
    try:
        return read_record(folder).table("scene") or None
    except LevilabError:
        return None


def parts_for(scene: dict[str, Any] | None) -> dict[str, Any]:
    """Return the parts to draw of a scene; without one, of the scene for practice."""
    try:
        known = scene_of(scene) if scene else read_scene("practice")
    except LevilabError:
        known = read_scene("practice")
    return parts_of(known)
