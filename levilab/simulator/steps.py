"""How long a step may be at most, before any error is looked at."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from levilab.simulator import top
from levilab.simulator.kernels import braking
from levilab.simulator.kernels.fields import flux_density

if TYPE_CHECKING:
    from levilab.simulator.kernels.motion import Model
    from levilab.simulator.scene import Scene
    from levilab.simulator.schemes import Scheme

Array = NDArray[np.float64]


def longest_step(scene: Scene, model: Model, start: Array, scheme: Scheme) -> float:
    """The longest step [s] for which the kernels' polynomials hold and no motion is skipped.

    An angle of 1 rad in a drift, a slowing by 0.2 in a kick, half a period of the drive.  What a tumbling top can
    add to its angular momentum is allowed for: the field's torque turns it at about √(|μ|B/I₁).
    """
    stiffness = float(np.linalg.norm(flux_density(model.field, start[None, top.R])))  # |μ|B [J]
    turning = float(np.linalg.norm(start[top.L])) * model.body.inverse_transverse
    turning += math.sqrt(stiffness * model.body.inverse_transverse)
    drift, kick = (float(np.max(np.abs(c))) for c in (scheme.drifts, scheme.kicks))
    limits = [1 / (drift * turning + 1e-300), 0.2 / (max(drift, kick) * _slowing(model.drag, start) + 1e-300)]
    if model.drive is not None:
        limits.append(0.5 / scene.drive.frequency_hz)
    return min(limits)


def _slowing(drag: Any, start: Array) -> float:
    """The greatest relative rate [1/s] at which drag or friction acts."""
    if drag is None:
        return 0.0
    spin = abs(float(start[top.CLOCK]))
    if isinstance(drag, braking.LooseFlowing):
        friction = drag.coupling * (drag.inverse_washers + drag.inverse_core)
        return max(friction, _relative(drag.washers, spin), _relative(drag.core, spin))
    return _relative(drag.law, spin)


def _relative(law: Any, spin: float) -> float:
    if isinstance(law, braking.Stokes):
        return law.c
    if isinstance(law, braking.Newton):
        return law.c * spin
    if isinstance(law, braking.LaminarDisc):
        return law.c * math.sqrt(spin)
    return float(law.c1 + law.c2 * spin)
