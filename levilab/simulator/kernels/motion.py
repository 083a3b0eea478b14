"""The two exact flows that the motion is put together from, and the numbers they need.

The kinetic energy alone moves the top freely: the *drift*.  The field, gravity and the drive change its
momenta at a fixed place and attitude: the *kick*.  Both are exact, whatever the step:

    drift   r ← r + d v;  n (and the attitude) turns about L by the angle |L| d/I₁
    kick    v ← v + k F/m,  L ← L + k T     with F = ∇(M·B) + m g,  T = M×B

What a scene does not have is no code in its kernels: a model is a tuple of small tuples, one type for each
kind, and the functions are chosen by type when a kernel is compiled (numba's `overload`).
Source: Simon, Heflinger & Ridgway, Am. J. Phys. 65, 286 (1997); Landau & Lifshitz, Mechanics, § 33, 36.
"""

from typing import Any, NamedTuple

from levilab.simulator.kernels.braking import clock_after, momentum_after
from levilab.simulator.kernels.compiled import by_type, part
from levilab.simulator.kernels.loads import pushed_and_torque, velocity_after_gravity
from levilab.simulator.kernels.vectors import Vector, dot, plus, rotate, rotation


class State(NamedTuple):
    """All that any scene moves; what a scene does not need stays as it is and costs nothing.

    r [m], v [m/s]: place and velocity; n: the top's axis; L [kg m²/s]: angular momentum; arm: the body's
    x axis (tilted dipole, magnetised disc); clock [rad/s]: the spin that drag alone prescribes (aligned
    dipole); loose [kg m²/s]: axial angular momentum of loose washers; t [s].
    """

    r: Vector
    v: Vector
    n: Vector
    L: Vector
    arm: Vector
    clock: float
    loose: float
    t: float


#: Numbers in a State, in the order of its fields.
STATE_SIZE = 18


class Body(NamedTuple):
    """A rigid symmetric top: 1/m [1/kg], 1/I₁, I₃ [kg m²]; gravity: Upright or Leaning, as the base sees it."""

    inverse_mass: float
    inverse_transverse: float
    axial: float
    gravity: Any


class Rigid(NamedTuple):
    """Everything turns as one.  twist: 1/I₃ − 1/I₁ [1/(kg m²)]."""

    twist: float


class Loose(NamedTuple):
    """Washers that slide on the body: its own turn goes with the core's spin alone.  inverse_core: 1/I_core."""

    inverse_core: float


class Model(NamedTuple):
    """A scene as its kernels see it: one tuple for each thing modelled, None for what is not.

    field: of the base, times the moment [J].
    """

    field: Any
    body: Body
    magnet: Any
    turning: Any
    drag: Any
    drive: Any


# --- drift ---


def _no_turn(turning: Any, along: Any, loose: Any, inverse_i1: Any) -> Any:
    return 0.0


def _rigid_turn(turning: Any, along: Any, loose: Any, inverse_i1: Any) -> Any:
    return turning.twist * along


def _loose_turn(turning: Any, along: Any, loose: Any, inverse_i1: Any) -> Any:
    return (along - loose) * turning.inverse_core - along * inverse_i1


#: How fast the body turns about its axis, beside its turn about L [rad/s]: (turning, L·n, washers' part of it, 1/I₁).
own_turn = by_type({type(None): _no_turn, Rigid: _rigid_turn, Loose: _loose_turn})


def _no_twist(turning: Any, n: Any, arm: Any, along: Any, loose: Any, inverse_i1: Any, d: Any) -> Any:
    return arm


def _twist(turning: Any, n: Any, arm: Any, along: Any, loose: Any, inverse_i1: Any, d: Any) -> Any:
    angle = own_turn(turning, along, loose, inverse_i1) * d
    sinc, cosc = rotation(angle * angle)
    return rotate(arm, n, angle * sinc, angle * angle * cosc)


#: The arm after its turn about the axis itself: (turning, axis, arm, L·n, washers' part of it, 1/I₁, d).
arm_about_axis = by_type({type(None): _no_twist, Rigid: _twist, Loose: _twist})


def _no_arm(turning: Any, arm: Any, axis: Any, sine: Any, cosine: Any) -> Any:
    return arm


def _turn_arm(turning: Any, arm: Any, axis: Any, sine: Any, cosine: Any) -> Any:
    return rotate(arm, axis, sine, cosine)


#: The arm after its turn about the angular momentum: (turning, arm, L, sine, cosine).
arm_about_momentum = by_type({type(None): _no_arm, Rigid: _turn_arm, Loose: _turn_arm})


@part
def drift(model: Model, s: State, d: float) -> State:
    """Free motion for the time d [s], exact."""
    body = model.body
    k = d * body.inverse_transverse
    turn = (k * s.L[0], k * s.L[1], k * s.L[2])
    sinc, cosc = rotation(dot(turn, turn))
    arm = arm_about_axis(model.turning, s.n, s.arm, dot(s.L, s.n), s.loose, body.inverse_transverse, d)
    return State(
        plus(s.r, d, s.v),
        s.v,
        rotate(s.n, turn, sinc, cosc),
        s.L,
        arm_about_momentum(model.turning, arm, turn, sinc, cosc),
        clock_after(model.drag, s.clock, d),
        s.loose,
        s.t + d,
    )


# --- kick ---


@part
def kick(model: Model, s: State, k: float, level: float, slope: float) -> State:
    """Apply forces and torques for the time k [s] at a fixed place and attitude, exactly.

    level, slope: of the drive, whose field is (level + slope·t) × amplitude × its carrier.
    """
    body = model.body
    v = velocity_after_gravity(body.gravity, s.v, k)  # what is known first is added first
    v, torque = pushed_and_torque(
        model.magnet, model.field, model.drive, s, (s.t, level, slope), v, k * body.inverse_mass
    )
    momentum, loose = momentum_after(model.drag, body, s, torque, k)
    return State(s.r, v, s.n, momentum, s.arm, s.clock, loose, s.t)


#: Columns of a state: place, velocity, axis, angular momentum, arm, clock, loose washers, time.
R, V, N, L, ARM = (slice(3 * i, 3 * i + 3) for i in range(5))
CLOCK, LOOSE, TIME = 15, 16, 17
