"""The motions that calls integrate: as scenes, in numbers for the peers, and as equations for heyoka.

heyoka is taken at its best.  A moment that leans is a vector of its own, three more equations; the body's x axis in
its place, of length 1 instead of 0.03, shortens the steps, and is up to a fifth slower at the same error.  A sine is a
pair of linear equations, as fast as a cosine of the time.  A square wave is integrated from kink to kink, its field a
parameter: stopping at events takes 1.4 to 1.7 times as long.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.benchmark.simulator import motion as given
from levilab.benchmark.simulator.motion import DRIVE_HZ, DRIVE_T, I1, I3, MU, SPIN, Array, M, references
from levilab.benchmark.simulator.taylor import VARIABLES, heyoka_system

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True)
class Motion:
    """One motion: as a scene for the simulator, and in numbers for its peers.

    Attributes:
        name: of the motion.
        preset: the scene of that name …
        changes: … with these values of its dotted keys.
        mass: [kg].
        spin: ω₃ at the start [rad/s].
        across, along: parts of the moment across and along the axis.
        drive: waveform of the field along y that swings as a cosine or its sign; "off", "sine" or "square".

    All of them stay up for 60 s, between 7.04 and 7.48 cm and within 4 mm of the axis, and none is chaotic: neighbours
    are by then at most 250 times as far apart as at the start.  So errors mean something.
    """

    name: str
    preset: str
    changes: tuple[tuple[str, Any], ...] = ()
    mass: float = 0.02445
    spin: float = SPIN
    across: float = 0.03
    along: float = 0.97
    drive: str = "off"

    def field_at(self, t: float) -> float:
        """Return the drive's field along y at a time that is no kink [T]."""
        value = math.cos(2 * math.pi * DRIVE_HZ * t)
        return {"off": 0.0, "sine": DRIVE_T * value, "square": math.copysign(DRIVE_T, value)}[self.drive]

    def pieces(self, duration: float) -> list[tuple[float, float, float]]:
        """Return the smooth pieces of a drive, of which a square wave has many: begin and end [s], steady field [T]."""
        if self.drive != "square":
            return [(0.0, duration, 0.0)]
        inside = np.arange(1, math.ceil(2 * DRIVE_HZ * duration + 0.5)) / (2 * DRIVE_HZ) - 0.25 / DRIVE_HZ
        ends = [0.0, *inside[inside < duration].tolist(), duration]
        return [(a, b, self.field_at((a + b) / 2)) for a, b in itertools.pairwise(ends)]


MOTIONS = {
    motion.name: motion
    for motion in (
        Motion("undriven", "undriven", mass=M, across=0.0, along=1.0),
        Motion("tilted", "tilted"),
        Motion("sine", "driven", spin=2 * math.pi * 30.03, drive="sine"),
        Motion("square", "driven", (("drive.waveform", "square"),), spin=2 * math.pi * 30.03, drive="square"),
    )
}
UNDRIVEN = MOTIONS["undriven"]


def reference(motion: Motion, duration: float) -> Array:
    """Return the true place at the end, shape (3,) [m]."""
    return np.array(references()["places_m"][motion.name][f"{duration:g}"])


def vector_start(motion: Motion = UNDRIVEN) -> Array:
    """(r, v, n, L), and the moment's direction if it is not n, at the start."""
    state = given.vector_start(motion.spin)
    moment = motion.along * state[6:9] + motion.across * np.array([1.0, 0.0, 0.0])
    return np.concatenate([state, moment]) if motion.across else state


def system_of(motion: Motion, *, each_pull: bool = False) -> list[Any]:
    """Return the equations of a motion for heyoka.

    heyoka's first parameter is a square wave's field; or, if `each_pull` is set, μ/m of a top.
    """
    import heyoka as hy

    nx, ny, nz, lx, ly, lz = hy.make_vars(*VARIABLES)[6:]
    moment, turning = _moment((nx, ny, nz), (lx, ly, lz), motion)
    drive, swinging = _drive(motion)
    return [*heyoka_system(hy.par[0] if each_pull else MU / motion.mass, moment, drive), *turning, *swinging]


def _moment(n: tuple[Any, ...], momentum: tuple[Any, ...], motion: Motion) -> tuple[tuple[Any, ...], list[Any]]:
    """Return the moment's direction, and its equations: ṁ = ω×m with ω = L/I₁ + (1/I₃ − 1/I₁)(L·n) n."""
    import heyoka as hy

    if not motion.across:
        return n, []
    m = mx, my, mz = tuple(hy.make_vars("mx", "my", "mz"))
    pairs = list(zip(n, momentum, strict=True))
    twist = (1 / I3 - 1 / I1) * sum(one * other for one, other in pairs)
    wx, wy, wz = (1 / I1 * other + twist * one for one, other in pairs)
    return m, [(mx, wy * mz - wz * my), (my, wz * mx - wx * mz), (mz, wx * my - wy * mx)]


def _drive(motion: Motion) -> tuple[Any, list[Any]]:
    """Return the field of the drive [T], and its equations: of a sine and the cosine beside it."""
    import heyoka as hy

    if motion.drive == "sine":
        cosine, sine = hy.make_vars("cosine", "sine")
        rate = 2 * math.pi * DRIVE_HZ
        return cosine, [(cosine, -rate * sine), (sine, rate * cosine)]
    return (hy.par[0] if motion.drive == "square" else 0.0), []


def heyoka_start(motion: Motion) -> Array:
    """Return the numbers that heyoka starts from."""
    start = vector_start(motion)
    return np.append(start, [DRIVE_T, 0.0]) if motion.drive == "sine" else start


@cache
def _integrator(motion: Motion, tolerance: float) -> Any:
    """Return an integrator of one top, built once: that takes up to a second."""
    import heyoka as hy

    return hy.taylor_adaptive(system_of(motion), heyoka_start(motion), tol=tolerance, fast_math=True)


def propagate(integrator: Any, motion: Motion, start: Array, duration: float) -> Array:
    """Integrate from a start, in the integrator's own kind of numbers; returns the place at the end [m]."""
    integrator.time, integrator.state[:] = start.dtype.type(0), start
    square, parameters = motion.drive == "square", integrator.pars
    for _, end, field in motion.pieces(duration):
        if square:
            parameters[0] = field
        integrator.propagate_until(start.dtype.type(end))
    return np.array(integrator.state[:3])


def caller(motion: Motion, tolerance: float) -> Callable[[float], Array]:
    """Build the integrator once; the function takes a duration [s] and returns the place at the end, shape (3,) [m]."""
    integrator, start = _integrator(motion, tolerance), heyoka_start(motion)
    return lambda duration: propagate(integrator, motion, start, duration)
