"""A map of spin and mass whose values cost nothing, for tests of its store."""

import numpy as np

from levilab.simulator.scene import preset
from levilab.sweeps.plan import Axis, Plan


def plan():
    axes = (Axis("start.spin_hz", np.linspace(18, 26, 40)), Axis("top.mass_kg", np.linspace(0.0250, 0.0254, 15)))
    return Plan(preset("undriven"), axes, ("survived", "lifetime_s"), duration_s=0.2)


def cheap_values(task):
    """Values that differ at every point."""
    spin, mass = np.broadcast_arrays(task.values["start.spin_hz"], task.values["top.mass_kg"])
    return {"survived": spin > 20, "lifetime_s": spin + mass}


def expected():
    """The lifetimes of all points."""
    spin, mass = (axis.values for axis in plan().axes)
    return spin[:, None] + mass


def bits(store):
    return {name: values.tobytes() for name, values in store.load().values.items()}
