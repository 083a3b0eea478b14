"""The contenders: each integrator as its users call it, with its own step control."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from as_called.motions import UNDRIVEN, Motion, caller, vector_start
from levilab.benchmark.simulator.motion import DRIVE_T, I3, Array, vector_rate
from levilab.simulator.scene import Scene, preset
from levilab.simulator.single import simulate

if TYPE_CHECKING:
    from collections.abc import Callable

    #: Integrates for a duration [s] and returns the place at the end, shape (3,) or (n, 3) [m].
    Call = Callable[[float], Array]


@dataclass(frozen=True)
class Contender:
    """An integrator.

    Attributes:
        name: of the method.
        package: that it needs.
        tolerances: from loose to tight, in its own sense.
        prepare: from a motion, or an ensemble, and a tolerance to what is timed; what it does itself is not.
        variant: of it, added to its settings.
        rounds: in how many rounds it takes part, None for all: a slow one in one.
    """

    name: str
    package: str
    tolerances: tuple[float, ...]
    prepare: Callable[[Any, float], Call]
    variant: str = ""
    rounds: int | None = None

    @property
    def installed(self) -> bool:
        """Whether its package is there."""
        return find_spec(self.package) is not None

    def call_for(self, subject: Any, tolerance: float) -> Call:
        """Return the call that is timed."""
        return self.prepare(subject, tolerance)


@cache
def scene_of(motion: Motion) -> Scene:
    """Return the motion as a scene of the simulator."""
    return preset(motion.preset).changed(dict(motion.changes))


def _simulate(motion: Motion, tolerance: float) -> Call:
    scene = scene_of(motion)
    return lambda duration: simulate(scene, duration, tolerance=tolerance, rate=None).position[-1]


#: Numbers whose errors are judged by their own size: places and velocities, directions, angular momenta.
_SIZES = np.repeat([1e-2, 1e-2, 1.0, I3 * UNDRIVEN.spin, 1.0], 3)


def _dop853(motion: Motion, tolerance: float) -> Call:
    from scipy.integrate import solve_ivp

    solve: Any = solve_ivp
    swing = DRIVE_T if motion.drive == "sine" else 0.0

    def call(duration: float) -> Array:
        state = vector_start(motion)
        limits = {"rtol": tolerance, "atol": tolerance * _SIZES[: state.size]}
        for begin, end, field in motion.pieces(duration):
            state = solve(vector_rate, (begin, end), state, "DOP853", args=(motion.mass, field, swing), **limits).y[
                :, -1
            ]
        return state[:3]

    return call


#: heyoka's time does not hold the building of its integrator, which it compiles: users use it again.  That of
#: `simulate` holds everything but the first call's compiling.
CONTENDERS = (
    Contender("simulate", "levilab", (1e-4, 3e-5, 1e-5, 1e-6, 1e-7, 3e-8, 1e-8, 1e-9, 1e-10, 3e-11, 1e-11), _simulate),
    Contender("heyoka", "heyoka", tuple(10.0**-k for k in range(3, 13)), caller),
    Contender("scipy DOP853", "scipy", (1e-6, 1e-8, 1e-10, 1e-12), _dop853, rounds=1),
)
