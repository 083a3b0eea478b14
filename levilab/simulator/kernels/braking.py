"""Drag inside the kernels: how the spin is slowed, in the way that keeps the order of the integrator.

With an aligned dipole no field can change the spin ω₃ = L·n/I₃, so drag alone prescribes it: ω₃(t) is a *clock*
that advances with the drift, exactly, and the torque I₃ ω̇₃ n of the kick depends on place and time alone, as
Nyström compositions demand.  With a tilted dipole the field changes the spin as well: drag is then a third flow,
exact too, in the middle of the kick, and only compositions for any split keep their order (`any_split`).
"""

import math
from typing import Any, NamedTuple

from levilab.simulator.kernels.compiled import by_type, part
from levilab.simulator.kernels.vectors import dot, plus

# --- the laws ---


class Stokes(NamedTuple):
    """ω̇ = −c ω.  c [1/s]."""

    c: float


class Newton(NamedTuple):
    """ω̇ = −c |ω| ω.  c [1/rad]."""

    c: float


class LaminarDisc(NamedTuple):
    """ω̇ = −c √|ω| ω.  c [(rad/s)^-½/s]."""

    c: float


class Mixed(NamedTuple):
    """ω̇ = −c1 ω − c2 |ω| ω.  c1 [1/s], c2 [1/rad]."""

    c1: float
    c2: float


#: Taylor coefficients of exp(−x) and of (1 − exp(−x))/x.
_DECAY: tuple[float, ...] = tuple((-1) ** k / math.factorial(k) for k in range(12))
_MEAN_DECAY: tuple[float, ...] = tuple((-1) ** k / math.factorial(k + 1) for k in range(12))


@part
def _polynomial_12(c: tuple[float, ...], x: float) -> float:
    """Evaluate a polynomial of twelve terms, in pairs that do not wait for each other."""
    x2 = x * x
    x4 = x2 * x2
    low = c[0] + x * c[1] + x2 * (c[2] + x * c[3])
    middle = c[4] + x * c[5] + x2 * (c[6] + x * c[7])
    return low + x4 * (middle + x4 * (c[8] + x * c[9] + x2 * (c[10] + x * c[11])))


@part
def decay(x: float) -> float:
    """exp(−x) for |x| ≤ 0.2, which the step is chosen for; error below rounding; no call, so that lanes stay lanes."""
    return _polynomial_12(_DECAY, x)


@part
def mean_decay(x: float) -> float:
    """(1 − exp(−x))/x for |x| ≤ 0.2, with no 0/0."""
    return _polynomial_12(_MEAN_DECAY, x)


def _spin_after_stokes(law: Any, spin: Any, d: Any) -> Any:
    return spin * decay(law.c * d)


def _spin_after_newton(law: Any, spin: Any, d: Any) -> Any:
    return spin / (1 + law.c * abs(spin) * d)


def _spin_after_disc(law: Any, spin: Any, d: Any) -> Any:
    root = 1 + 0.5 * law.c * math.sqrt(abs(spin)) * d
    return spin / (root * root)


def _spin_after_mixed(law: Any, spin: Any, d: Any) -> Any:
    # Bernoulli's equation; mean_decay(c1 d) d is the part of the time that counts for the quadratic term
    x = law.c1 * d
    return spin * decay(x) / (1 + law.c2 * abs(spin) * d * mean_decay(x))


def _stokes_rate(law: Any, spin: Any) -> Any:
    return -law.c * spin


def _newton_rate(law: Any, spin: Any) -> Any:
    return -law.c * abs(spin) * spin


def _disc_rate(law: Any, spin: Any) -> Any:
    return -law.c * math.sqrt(abs(spin)) * spin


def _mixed_rate(law: Any, spin: Any) -> Any:
    return -(law.c1 + law.c2 * abs(spin)) * spin


#: Law → its constants; the spin [rad/s] after drag alone has acted for the time d [s], of either sign: (law, spin, d);
#: dω/dt [rad/s²] at this spin: (law, spin).
LAWS = {
    "stokes": (Stokes, _spin_after_stokes, _stokes_rate),
    "newton": (Newton, _spin_after_newton, _newton_rate),
    "disc": (LaminarDisc, _spin_after_disc, _disc_rate),
    "mixed": (Mixed, _spin_after_mixed, _mixed_rate),
}
spin_after = by_type({law: after for law, after, _ in LAWS.values()})
spin_rate = by_type({law: rate for law, _, rate in LAWS.values()})


# --- how a law acts in a model ---


class PrescribedDrag(NamedTuple):
    """Drag on a top whose spin nothing else changes."""

    law: Any


class DragFlow(NamedTuple):
    """Drag on a top whose spin the field changes, too."""

    law: Any


class WasherDragFlow(NamedTuple):
    """Drag and friction of loose washers: the washers' and the core's law, 1/I of either, and the coupling.

    washers, core: laws; inverse_washers, inverse_core [1/(kg m²)]; coupling [N m s]: torque per slip.
    """

    washers: Any
    core: Any
    inverse_washers: float
    inverse_core: float
    coupling: float


def _constant_clock(drag: Any, clock: Any, d: Any) -> Any:
    return clock


def _slowing_clock(drag: Any, clock: Any, d: Any) -> Any:
    return spin_after(drag.law, clock, d)


def _free(drag: Any, body: Any, s: Any, torque: Any, k: Any) -> Any:
    return plus(s.L, k, torque), s.loose


def _prescribed(drag: Any, body: Any, s: Any, torque: Any, k: Any) -> Any:
    brake = body.axial * spin_rate(drag.law, s.clock)
    return plus(plus(s.L, k, torque), k * brake, s.n), s.loose


def _flowing(drag: Any, body: Any, s: Any, torque: Any, k: Any) -> Any:
    half = plus(s.L, k / 2, torque)
    spin = dot(half, s.n) / body.axial
    change = body.axial * (spin_after(drag.law, spin, k) - spin)
    return plus(plus(half, change, s.n), k / 2, torque), s.loose


@part
def _washers_after_friction(drag: Any, total: Any, loose: Any, k: Any) -> Any:
    """Return the washers' momentum after friction on the core alone has acted: the slip decays, the total stays."""
    # slip Δ = ω_w − ω_c; J_w = (total/I_c + Δ)/(1/I_w + 1/I_c)
    both = drag.inverse_washers + drag.inverse_core
    slip = loose * drag.inverse_washers - (total - loose) * drag.inverse_core
    return (total * drag.inverse_core + slip * decay(drag.coupling * both * k)) / both


def _flowing_with_washers(drag: Any, body: Any, s: Any, torque: Any, k: Any) -> Any:
    half = plus(s.L, k / 2, torque)
    total = dot(half, s.n)
    washers = _washers_after_friction(drag, total, s.loose, k / 2)
    core = spin_after(drag.core, (total - washers) * drag.inverse_core, k) / drag.inverse_core
    washers = spin_after(drag.washers, washers * drag.inverse_washers, k) / drag.inverse_washers
    after = core + washers
    washers = _washers_after_friction(drag, after, washers, k / 2)
    return plus(plus(half, after - total, s.n), k / 2, torque), washers


#: The clock after a drift of d [s]: (drag, clock, d).
clock_after = by_type(
    {
        type(None): _constant_clock,
        PrescribedDrag: _slowing_clock,
        DragFlow: _constant_clock,
        WasherDragFlow: _constant_clock,
    }
)

#: Angular momentum, and the washers' part of it, after torque and drag have acted for the time k [s]:
#: (drag, body, state, torque, k).
momentum_after = by_type(
    {type(None): _free, PrescribedDrag: _prescribed, DragFlow: _flowing, WasherDragFlow: _flowing_with_washers}
)
