"""How long a step may be, and how large the error of a result is."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.simulator.field import flux_density
from levilab.simulator.kernels import braking
from levilab.simulator.kernels.motion import CLOCK, L, Model, R
from levilab.simulator.laws import LAWS
from levilab.simulator.numbers import largest, length, smallest, sqrt
from levilab.simulator.scene import Scene
from levilab.simulator.schemes import Scheme
from levilab.simulator.spin import DECAYS

#: A drift turns the axis by so much at most [rad], for which the kernels' polynomials are made.
LONGEST_TURN = 2.0


def turning_rate(model: Model, start: Array) -> Any:
    """Return about how fast the axis turns about the angular momentum at most [rad/s]; of each top, if there are many.

    A tumbling top turns faster than its angular momentum at the start says: the field's torque adds about √(|μ|B/I₁).
    """
    stiffness = length(flux_density(model.field, start[..., R]).T)  # |μ|B [J]
    inverse = model.body.inverse_transverse
    return length(start[..., L].T) * inverse + sqrt(stiffness * inverse)


def rounding_error(scheme: Scheme, steps: Any, ends: Array) -> Array:
    """Return the error by rounding: a random walk of half a unit, twice a stage.

    Args:
        scheme: of the steps.
        steps: how many were taken, a number or shape (…).
        ends: last states, shape (…, 18).

    Returns:
        Of place [m] and axis, shape (2, …).
    """
    floor = 2.2e-16 * np.sqrt(2.0 * steps * scheme.stages)
    return np.array([floor * np.linalg.norm(ends[..., R], axis=-1), floor * np.ones(ends.shape[:-1])])


def longest_step(scene: Scene, model: Model, start: Array, scheme: Scheme) -> Any:
    """Return the longest step [s] for which the kernels' polynomials hold and no motion is skipped.

    It is that of each top, if there are many.  Three limits: a drift turns the axis by 2 rad, a kick slows the spin by
    a fifth, a step takes half a period of the drive.  A drive that goes up takes the top along: all are shorter by the
    ratio of its frequencies.
    """
    turning = turning_rate(model, start)
    drift, kick = (float(np.max(np.abs(c))) for c in (scheme.drifts, scheme.kicks))
    limits = [
        LONGEST_TURN / (drift * turning + 1e-300),
        0.2 / (max(drift, kick) * _strongest_damping(model.drag, start) + 1e-300),
    ]
    if model.drive is not None:
        limits.append(0.5 / scene.drive.frequency_hz)
    return smallest(*limits) / (scene.drive.highest_hz / scene.drive.frequency_hz)


def _strongest_damping(drag: Any, start: Array) -> Any:
    """Return the greatest relative rate |ω̇/ω| [1/s] that drag or the washers' friction has at the start."""
    if drag is None:
        return 0.0
    spin = abs(start[..., CLOCK])
    if isinstance(drag, braking.WasherDragFlow):
        friction = drag.coupling * (drag.inverse_washers + drag.inverse_core)
        return largest(friction, _damping_rate(drag.washers, spin), _damping_rate(drag.core, spin))
    return _damping_rate(drag.law, spin)


def has_kink(drag: Any) -> bool:
    """Return whether the drag's law has |ω| in it: a step across ω = 0, where it is not smooth, loses its order."""
    if isinstance(drag, braking.WasherDragFlow):
        return not (_is_linear(drag.washers) and _is_linear(drag.core))
    return isinstance(drag, braking.DragFlow) and not _is_linear(drag.law)


def _is_linear(law: Any) -> bool:
    return LAWS[_name_of(law)].is_linear(law)


def _name_of(law: Any) -> str:
    return next(name for name, (kind, *_) in braking.LAWS.items() if kind is type(law))


def comes_near_zero(spins: Array) -> NDArray[np.bool_]:
    """Return whether spins at successive moments pass zero, or may have passed it in between.

    Args:
        spins: shape (moments, …) [rad/s].
    """
    changes = np.abs(np.diff(spins, axis=0)).max(axis=0)
    return np.asarray(np.abs(spins).min(axis=0) <= 2 * changes)


def _damping_rate(law: Any, spin: Any) -> Any:
    """Return |ω̇/ω| of a drag law at a spin [1/s]."""
    return DECAYS[_name_of(law)].damping(spin, *law)


#: An estimate is to bound the true error; with this factor it is about six times as large.
SAFETY_FACTOR = 6.0

#: With one ring, layer and angle more, the error of a magnet's nodes falls at least by 2 to this power, if there are
#: nodes enough (`levilab.simulator.disc`); no estimate counts on more.
NODES_ORDER = 6


def estimate(fine: Array, twice: Array, coarse: Array, order: int | None, longer: Any = 4.0) -> Any:
    """Estimate the error of results at step h from those at 2h and 4h, or another length above 2h.

    From 4h to 2h to h the differences shrink by a factor q; the error at h is the sum of those that would follow, about
    q times the last difference.  A scheme that reaches its order p has q = 2^−p.  If rounding or chaos rules, the
    differences do not shrink, and the estimate is as large as the last one.  From s·h to 2h to h they shrink by
    (2^p − 1)/(s^p − 2^p) in the former case, and not at all in the latter.

    The error of a magnet's nodes is estimated alike, from results with fewer and still fewer nodes.

    Args:
        fine: results at step h, shape (…, 3).
        twice: at 2h, shape (…, 3).
        coarse: at s·h, shape (…, 3).
        order: of the scheme; None if the motion has passed a point where the equations are not smooth.  Each step
            length then makes an error of low order that depends on where in a step the point lies.  Two differences
            that happen to be small prove nothing, so both are added up.
        longer: s, above 2, a number or shape (…).

    Returns:
        The error, shape (…), in the results' unit.
    """
    last = np.linalg.norm(fine - twice, axis=-1)
    before = np.linalg.norm(twice - coarse, axis=-1)
    if order is None:
        return SAFETY_FACTOR * (last + before)
    with np.errstate(invalid="ignore", divide="ignore"):
        least = (2.0**order - 1) / (longer**order - 2.0**order)
        shrink = np.clip(np.nan_to_num(last / before, nan=1.0, posinf=1.0), least, 1.0)
    return SAFETY_FACTOR * last * shrink ** (np.log(2.0**-order) / np.log(least))
