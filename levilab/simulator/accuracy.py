"""How long a step may be at most, and how good a result is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from levilab.simulator.field import flux_density
from levilab.simulator.kernels import braking
from levilab.simulator.kernels.motion import CLOCK, L, R

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
    stiffness = float(np.linalg.norm(flux_density(model.field, start[None, R])))  # |μ|B [J]
    turning = float(np.linalg.norm(start[L])) * model.body.inverse_transverse
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
    spin = abs(float(start[CLOCK]))
    if isinstance(drag, braking.WasherDragFlow):
        friction = drag.coupling * (drag.inverse_washers + drag.inverse_core)
        return max(friction, _relative(drag.washers, spin), _relative(drag.core, spin))
    return _relative(drag.law, spin)


def has_kink(drag: Any) -> bool:
    """Whether drag flows by a law with |ω| in it, which at ω = 0 is not smooth: a step across it loses its order."""
    if isinstance(drag, braking.WasherDragFlow):
        return any(_law_has_kink(law) for law in (drag.washers, drag.core))
    return isinstance(drag, braking.DragFlow) and _law_has_kink(drag.law)


def _law_has_kink(law: Any) -> bool:
    if isinstance(law, braking.Mixed):
        return law.c2 != 0
    return not isinstance(law, braking.Stokes) and law.c != 0


def comes_near_zero(spins: Array) -> NDArray[np.bool_]:
    """Whether spins [rad/s] at successive moments, shape (moments, …), pass zero, or may have passed it in between."""
    changes = np.abs(np.diff(spins, axis=0)).max(axis=0)
    return np.asarray(np.abs(spins).min(axis=0) <= 2 * changes)


def _relative(law: Any, spin: float) -> float:
    if isinstance(law, braking.Stokes):
        return law.c
    if isinstance(law, braking.Newton):
        return law.c * spin
    if isinstance(law, braking.LaminarDisc):
        return law.c * math.sqrt(spin)
    return float(law.c1 + law.c2 * spin)


#: Estimated errors are about so many times the true ones: they are to bound them.
CAUTION = 6.0

#: With one ring, layer and angle more the error of a magnet's nodes falls at least by 2 to this power, where they are
#: enough (`levilab.simulator.disc`): no estimate counts on more than that.
NODES_ORDER = 6


def estimate(fine: Array, twice: Array, four: Array, order: int | None) -> Any:
    """Estimated error of results at step h, from those at 2h and 4h; arrays of shape (…, 3), result (…).

    Or of a magnet's nodes, from results with fewer and still fewer of them.  order None: the motion has passed a point
    where the equations are not smooth.  Each step length then makes an error of low order that depends on where in a
    step the point lies: two differences that happen to be small say nothing, and both are added up.

    From one doubling to the next the differences shrink by a factor q, and what is left of them is their sum,
    about q times the last one.  Where the order p is seen q is 2^−p; where rounding or chaos rules they do not
    shrink, and the estimate is as large as the difference.
    """
    last = np.linalg.norm(fine - twice, axis=-1)
    before = np.linalg.norm(twice - four, axis=-1)
    if order is None:
        return CAUTION * (last + before)
    with np.errstate(invalid="ignore", divide="ignore"):
        shrink = np.clip(np.nan_to_num(last / before, nan=1.0, posinf=1.0), 2.0**-order, 1.0)
    return CAUTION * last * shrink
