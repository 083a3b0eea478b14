"""The simulator: the Levitron's motion, as much of it as a scene needs.

    from levilab.simulator import preset, simulate, simulate_many

    motion = simulate(preset("undriven"), 5.0)
    motion.position, motion.axis, motion.spin_hz, motion.accuracy

Names are loaded when they are first used: the compiler behind `simulate` takes a moment.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from levilab.errors import SimulationError

if TYPE_CHECKING:
    from levilab.simulator.ensemble import Ensemble, grid, simulate_many, step_share_of
    from levilab.simulator.scene import Scene, SceneError, preset, presets, read_scene, with_settings
    from levilab.simulator.single import simulate
    from levilab.simulator.trajectory import Accuracy, Event, Trajectory

#: The modules of the names, those that are quicker to load first.
_MODULES = ("scene", "trajectory", "single", "ensemble")

__all__ = [
    "Accuracy", "Ensemble", "Event", "Scene", "SceneError", "SimulationError", "Trajectory",
    "grid", "preset", "presets", "read_scene", "simulate", "simulate_many", "step_share_of", "with_settings",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    for module in map(import_module, (f"{__name__}.{part}" for part in _MODULES if name in __all__)):
        if hasattr(module, name):
            return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
