"""Which run is shown: the one that is named, else the newest that is running, else the newest."""

import heapq
import os
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from levilab.errors import DataError
from levilab.runs.find import RECORD
from levilab.runs.run import LONGEST_GROUP, Run, RunRecord

#: Runs to choose from.
MOST_RUNS = 50
#: Of the newest runs, how many are looked at for one that is being recorded.
_LOOKED_AT = 5
#: Experiment, its setting "which" or "drive" if that makes it another one, and what it is called then.
_TITLES = (
    ("limit", "upper", "upper limit"),
    ("limit", "", "lower limit"),
    ("spin", "triggered", "spin-down, triggered drive"),
    ("spin", "", "spin-down"),
    ("hold", "", "held spin"),
    ("field", "", "field of the base"),
    ("trace", "", "records of the light"),
)


@dataclass(frozen=True)
class Choice:
    """A run to choose.

    Attributes:
        name: of its folder.
        status: as of the run; "unreadable" where its record cannot be read.
        title: its experiment, with the setting that makes it another one.
        group: who measured.
    """

    name: str
    status: str
    title: str = ""
    group: str = ""
    started_utc: str = ""
    note: str = ""


def run_names(root: Path) -> list[str]:
    """Return the names of the newest runs in a folder, newest first; None without a folder."""
    return heapq.nlargest(MOST_RUNS, _names(root))


def _names(root: Path) -> Iterator[str]:
    try:
        with os.scandir(root) as entries:
            for entry in entries:
                if not entry.name.startswith(".") and os.path.isfile(os.path.join(root, entry.name, RECORD)):  # noqa: PTH113, PTH118 - of ten thousand folders
                    yield entry.name
    except OSError:
        return


def choices(root: Path) -> list[Choice]:
    """Return the newest runs, newest first."""
    return [_choice(root / name) for name in run_names(root)]


def _choice(folder: Path) -> Choice:
    try:
        run = Run.load(folder)
    except DataError:
        return Choice(folder.name, "unreadable")
    record = run.record
    started, group = record.started_utc or "", record.group[:LONGEST_GROUP]
    return Choice(folder.name, run.status, _title(record), group, started, record.note[:200])


def _title(record: RunRecord) -> str:
    """Return the name of what was measured."""
    settings = record.table(record.experiment)
    how = (settings.get("which"), settings.get("drive"))
    return next(
        (title for name, one, title in _TITLES if name == record.experiment and (not one or one in how)),
        record.experiment,
    )


def running_run(root: Path, but: Collection[Path] = ()) -> Path | None:
    """Return the folder of the newest run that is running, among the newest few; None where there is none.

    Args:
        root: the folder with the runs.
        but: folders that do not count.
    """
    others = [root / name for name in run_names(root) if root / name not in but]
    return next((folder for folder in others[:_LOOKED_AT] if _choice(folder).status == "running"), None)


def newest(found: list[Choice]) -> str | None:
    """Return the name of the newest run that is running, else of the newest that can be read."""
    for wanted in ("running", None):
        for one in found:
            if one.status == wanted or (wanted is None and one.status != "unreadable"):
                return one.name
    return found[0].name if found else None
