"""The truth of a run of the virtual bench: what its seed drew, in the names of the analyses' results."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from levilab.runs.events import RunEvent
from levilab.runs.run import Run
from levilab.simulator.laws import LAWS
from levilab.simulator.spin import DECAYS
from levilab.world.spin_world import SpinScene, random_scene


@dataclass(frozen=True)
class Truth:
    """What an analysis should find.

    Attributes:
        values: of quantities, by their names in result.json; empty where nothing is known.
        model: the law that they belong to; empty where an analysis has one model.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    model: str = ""


def truth_of(run: Run | None, analysis: str) -> Truth:
    """Return the truth of a run, empty for a real one and for what is not known.

    A locked top wobbles at the drive's frequency; one that lost its lock, or has loose washers, need not.  The motion
    splits the slow swings as it is predicted.

    The mean of limits is that of the law which the seed draws each of them from.
    """
    if run is None or not (record := run.record).synthetic or record.seed is None:
        return Truth()
    scene = record.table("scene")
    if analysis == "precession":
        lost = any(event["kind"] == RunEvent.LOCK_LOST for event in run.events())
        return Truth() if lost or _is_loose(scene) else Truth({"slope": 1.0, "intercept": 0.0})
    if analysis == "sway":
        return Truth() if _is_loose(scene) else Truth({"ratio": 1.0})
    if record.world == "spin":
        known = _OF_SPIN_WORLD.get(analysis)
        return known(random_scene(record.seed), run) if known else Truth()
    return _of_scene(scene.get("drag")) if analysis == "spindown" else Truth()


def _is_loose(scene: Mapping[str, Any]) -> bool:
    """Return whether washers turn on the top: the tape is on them, and their spin is not the drive's frequency."""
    washers = scene.get("washers")
    return isinstance(washers, dict) and bool(washers.get("inertia_kg_m2"))


def _of_scene(drag: Any) -> Truth:
    """Return the drag of a top in full motion; nothing for a law of several constants."""
    law = drag.get("law") if isinstance(drag, dict) else None
    if law not in LAWS or len(LAWS[law].names) > 1 or not isinstance(drag.get("coefficient"), float):
        return Truth()
    return Truth({LAWS[law].names[0]: drag["coefficient"]}, law)


def _drag(scene: SpinScene, _: Run) -> Truth:
    return Truth(dict(zip(LAWS[scene.drag].names, scene.constants, strict=True)), scene.drag)


def _base(scene: SpinScene, _: Run) -> Truth:
    names = {"strength": "strength_t_m", "origin": "origin_m", "thickness": "thickness_m"}
    return Truth({name: getattr(scene.base, of_base) for name, of_base in names.items()})


def _held(scene: SpinScene, run: Run) -> Truth:
    held = float(run.readings().column("spin_frequency_hz").mean())
    return Truth({"drag": held * DECAYS[scene.drag].damping(2 * math.pi * held, *scene.constants)})


def _lower_limit(_: SpinScene, run: Run) -> Truth:
    return Truth({"mean": SpinScene().fall_hz} if run.record.table("limit").get("which") == "lower" else {})


_OF_SPIN_WORLD: Mapping[str, Callable[[SpinScene, Run], Truth]] = {
    "spindown": _drag,
    "field": _base,
    "hold": _held,
    "limit": _lower_limit,
}
