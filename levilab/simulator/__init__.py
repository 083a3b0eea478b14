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

_HOME = {
    "Ensemble": "ensemble",
    "grid": "ensemble",
    "simulate_many": "ensemble",
    "step_share_of": "ensemble",
    "Scene": "scene",
    "SceneError": "scene",
    "preset": "scene",
    "presets": "scene",
    "read_scene": "scene",
    "with_settings": "scene",
    "simulate": "single",
    "Accuracy": "trajectory",
    "Event": "trajectory",
    "Trajectory": "trajectory",
}

__all__ = [
    "Accuracy", "Ensemble", "Event", "Scene", "SceneError", "SimulationError", "Trajectory",
    "grid", "preset", "presets", "read_scene", "simulate", "simulate_many", "step_share_of", "with_settings",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
