"""The thesis's tops as scenes, many of them at once, and the facts about its device that several chapters need."""

import math
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.arrays import Array
from analysis.stability import thesis_limit
from levilab.motion.lines import rate_for
from levilab.simulator.ensemble import Ensemble, simulate_many
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.published.printed import published
from levilab.simulator.scene import Scene, preset, with_settings
from levilab.simulator.single import simulate
from levilab.simulator.trajectory import Trajectory
from levilab.stability.thesis import STARTS

T = TypeVar("T")
Flags = NDArray[np.bool_]

THESIS = published("thesis")
#: How long a top must stay up [s], and the wanted error of place [m] and axis [rad] of those that do.
DURATION_S, TOLERANCE = 30.0, 1e-6
#: Mass of the thesis's simulations [kg], which it prints as 25.5 g: found by the chapter of the limits.
MASS_KG = 0.025285
#: The mass for which the thesis's own estimate of the least spin gives what it prints, at the measured height [kg].
ESTIMATE_KG = 0.0253
#: With drag a top counts as fallen at this height [m].
FALL_M = 0.06


def preset_at(name: str, scene: str = "undriven", *settings: str) -> Scene:
    """Return a preset from a start of the thesis, with the mass of its simulations.

    >>> preset_at("IC3").start.position_m, preset_at("IC4").top.mass_kg
    ((0.003, 0.0, 0.0725), 0.025285)
    """
    return with_settings(preset(scene), [f"top.mass_kg={MASS_KG}", *STARTS[name], *settings])


def estimate_hz() -> float:
    """Return the thesis's own estimate of the least spin [Hz], of the mass and at the height that give what it prints.

    >>> f"{estimate_hz():.3f}"
    '14.005'
    """
    found = stability_of(preset("undriven").changed({"top.mass_kg": ESTIMATE_KG}))
    return thesis_limit(found.field, found.top, THESIS["device.height"].value / 100)


def many(scene: Scene, over: Mapping[str, ArrayLike], duration: float = DURATION_S, **given: Any) -> Ensemble:
    """Simulate many tops, without estimates of their errors."""
    return simulate_many(scene, over, duration, tolerance=TOLERANCE, errors=False, **given)


def scan(low: float, high: float, step: float) -> Array:
    """Return spins from low to high [Hz], both included.

    >>> scan(21.9, 22.0, 0.05).tolist()
    [21.9, 21.95, 22.0]
    """
    return np.asarray(np.round(low + step * np.arange(round((high - low) / step) + 1), 9))


def simulate_for_lines(scene: Scene, duration: float, tolerance: float = TOLERANCE) -> Trajectory:
    """Simulate a top with samples close enough for the lines of its axis."""
    return simulate(scene, duration, tolerance=tolerance, rate=float(math.ceil(rate_for(scene))))


def known(value: T | None) -> T:
    """Return a value that is there."""
    assert value is not None
    return value
