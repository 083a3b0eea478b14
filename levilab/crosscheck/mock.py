"""Runs of mock experiments, which load the bench: trials of a report do without."""

from collections.abc import Callable
from pathlib import Path

from levilab.acquisition.loop import AcquisitionRequest, acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.crosscheck.subject import TrialFailed
from levilab.present.progress import Display
from levilab.runs.run import Run


def acquire_mock(
    experiment: str,
    seed: int,
    folder: Path,
    change: Callable[[AcquisitionRequest], AcquisitionRequest],
    *,
    counter: str | None = None,
    scope: str | None = None,
) -> Run:
    """Return a finished run of a mock experiment.

    change: puts it into a world of known numbers; counter, scope: in place of the bench's.

    Raises TrialFailed; KeyboardInterrupt where Ctrl-C ended the run: it is meant for the whole cross-check.
    """
    options = AcquisitionOptions(mock=True, counter=counter, scope=scope, out=folder, seed=seed)
    run = acquire(change(request_for(experiment, options)), Display())
    if run.status == "interrupted":
        raise KeyboardInterrupt
    if run.status != "finished":
        raise TrialFailed(f"{run.folder.name}: the run is {run.status}")
    return run
