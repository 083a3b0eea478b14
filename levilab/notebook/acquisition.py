"""Experiments from scripts and notebooks, and the runs of earlier ones."""

import json
from collections.abc import Mapping
from contextlib import suppress
from numbers import Integral
from os import PathLike
from pathlib import Path
from typing import Any

from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.acquisition.session import ExperimentFailed
from levilab.acquisition.table import EXPERIMENTS
from levilab.bench.person import Task
from levilab.errors import DataError, UsageError, list_known
from levilab.notebook.result import AnalysisResult
from levilab.notebook.run import RecordedRun
from levilab.pipelines.recall import recall_suiting
from levilab.pipelines.result import RESULT, NoResult
from levilab.present.progress import Display
from levilab.runs.find import RECORD, find_run, no_such_path
from levilab.runs.run import Run
from levilab.simulator.keys import plain


def acquire_run(experiment: str, options: AcquisitionOptions) -> RecordedRun:
    """Run an experiment without a word on the terminal; see `levilab.acquire`."""
    if experiment not in EXPERIMENTS:
        raise UsageError("experiment", list_known(experiment, EXPERIMENTS), value=experiment)
    seed: object = options.seed
    if seed is not None and not (isinstance(seed, Integral) and int(seed) >= 0):
        raise UsageError("seed", "a whole number of 0 or more is expected", value=seed)
    return RecordedRun.of(acquire(request_for(experiment, options), Display()))


def as_path(place: str | PathLike[str] | Run | None) -> Path | None:
    """Return a file or a run folder as a path."""
    if place is None:
        return None
    return place.folder if isinstance(place, Run) else Path(place)


def assignments(settings: Mapping[str, Any]) -> tuple[str, ...]:
    """Return settings as one would type them, KEY=VALUE."""
    return tuple(f"{key}={_type_value(value)}" for key, value in settings.items())


def _type_value(value: Any) -> str:
    """Return a value as one would type it behind KEY=."""
    value = plain(value)
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)


def ask_with_input(task: Task) -> str:
    """Ask the person at the bench where Python asks.  Raises ExperimentFailed where that cannot be answered."""
    try:
        return input(f"{task.prompt}  [Enter] ")
    except EOFError:
        raise ExperimentFailed(
            f"{task.text!r} cannot be answered: standard input is closed; give `person`, a function that answers"
        ) from None


def load_any(path: str | PathLike[str]) -> RecordedRun | AnalysisResult:
    """Load the run in a run folder, or of a name in runs/; or the result in a file, or alone in a folder.

    Raises DataError.
    """
    folder = find_run(Path(path))
    if not folder.exists():
        if folder.name == RESULT and (saved := _saved_in(folder.parent)):
            raise DataError(f"{folder}: there is no such file; of results the folder has {', '.join(saved)}")
        raise no_such_path(folder)
    if folder.name == RECORD and folder.is_file():
        folder = folder.parent
    if folder.is_file():
        with suppress(NoResult):
            if folder.suffix == ".json":
                return AnalysisResult(*recall_suiting([folder], {})[0])
        raise DataError(f"{folder}: is a file; a run folder is expected, a data file goes to levilab.analyze as it is")
    if folder.is_dir() and not (folder / RECORD).exists():
        saved = _saved_in(folder)
        if len(saved) == 1:
            return load_any(folder / saved[0])
        advice = f"name one of {', '.join(saved)}" if saved else "name one of the runs in it, which levilab.runs lists"
        raise DataError(f"{folder}: holds no {RECORD}, so it is no run folder: {advice}")
    return RecordedRun.load(folder)


def _saved_in(folder: Path) -> list[str]:
    """Return the names of the results that `save` has written into a folder, those of arrays included."""
    return sorted(path.name for path in folder.glob("*result*.json"))
