"""Runs of mock experiments, which load the bench: trials of a report do without."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from levilab.acquisition.loop import acquire_one_of_many
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.acquisition.table import settings_of, with_settings
from levilab.crosscheck.subject import TrialFailed
from levilab.runs.run import Run
from levilab.simulator.scene import Scene
from levilab.world.bench import virtual_wiring
from levilab.world.spin_world import World


def acquire_mock(
    experiment: str,
    seed: int,
    folder: Path,
    world: World | None = None,
    settings: Mapping[str, Any] = MappingProxyType({}),
    *,
    scene: Scene | None = None,
    counter: str | None = None,
    scope: str | None = None,
) -> Run:
    """Return a finished run of a mock experiment.

    Args:
        experiment: its name.
        seed: of the mock.
        folder: of the run.
        world: of known numbers; None: that of the seed.
        settings: of the experiment, where they are not the usual ones.
        scene: of the world, for the record.
        counter: in place of the bench's.
        scope: in place of the bench's.

    Raises TrialFailed; KeyboardInterrupt where a signal asked for the end.
    """
    request = request_for(
        experiment, AcquisitionOptions(mock=True, counter=counter, scope=scope, out=folder, seed=seed)
    )
    chosen = settings_of(request.config, experiment).model_copy(update=dict(settings))
    request = replace(request, config=with_settings(request.config, experiment, chosen))
    if scene is not None:
        request = replace(request, scene=scene.as_table(), world=None)
    if world is not None:
        limits, named = request.config.limits, request.named
        request = replace(request, wiring=lambda: virtual_wiring(world, limits, named))
    run = acquire_one_of_many(request)
    if run.status != "finished":
        raise TrialFailed(f"{run.folder.name}: the run is {run.status}")
    return run
