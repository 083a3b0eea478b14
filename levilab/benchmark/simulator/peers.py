"""Other people's integrators on the same motion, each with the settings from loose to tight."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from levilab.benchmark.simulator import motion

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Point:
    """One integrator at one setting.

    Attributes:
        method: its name.
        setting: in words.
        error: largest of the place's components at the end, against the reference [m].
        speed: simulated seconds per second of one core.
    """

    method: str
    setting: str
    error: float
    speed: float


@dataclass(frozen=True)
class Peer:
    """A peer: its name, the package it needs, and what makes its points."""

    name: str
    package: str
    points: Callable[[bool], Iterator[Point]]

    @property
    def installed(self) -> bool:
        """Whether its package is there."""
        return find_spec(self.package) is not None


def best_time(work: Callable[[], Any], least: float = 0.1) -> float:
    """The shortest of several times [s]: as many as fit into `least`, at least one."""
    times: list[float] = []
    while not times or (sum(times) < least and len(times) < 200):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def error_of(place: Array) -> float:
    """The largest component's error [m]."""
    return float(np.abs(np.asarray(place, dtype=np.float64) - motion.REFERENCE).max())


def _scipy(method: str, tolerances: list[float], form: str) -> Callable[[bool], Iterator[Point]]:
    def points(quick: bool) -> Iterator[Point]:  # noqa: FBT001
        from scipy.integrate import solve_ivp

        rate, start = (
            (motion.euler_rate, motion.euler_start())
            if form == "Euler"
            else (motion.vector_rate, motion.vector_start())
        )
        # errors are judged for each of the numbers by its own size: lengths, angles, angular momenta
        size = np.array([1e-2] * 3 + [1e-2] * 3 + [1.0] * 3 + [motion.I3 * motion.SPIN] * 3)
        if form == "Euler":
            size = np.array([1e-2] * 3 + [1e-2, 1, 1] + [1e-2] * 3 + [1.0, 1e2, 1e2])
        solve: Any = solve_ivp
        for tolerance in tolerances[:: 2 if quick else 1]:
            work = partial(solve, rate, (0, motion.DURATION), start, method, rtol=tolerance, atol=tolerance * size)
            result = work()
            seconds = best_time(work)
            error = error_of(result.y[:3, -1]) if result.success else np.inf
            yield Point(f"scipy {method}", f"rtol {tolerance:g}", error, motion.DURATION / seconds)

    return points


VARIABLES = ("x", "y", "z", "vx", "vy", "vz", "nx", "ny", "nz", "lx", "ly", "lz")


def heyoka_system() -> list[Any]:
    """The equations for heyoka, shared subexpressions written once."""
    import heyoka as hy

    x, y, z, vx, vy, vz, nx, ny, nz, lx, ly, lz = hy.make_vars(*VARIABLES)
    z2, r2 = z * z, x * x + y * y
    sums: list[Any] = [0.0, 0.0, 0.0, 0.0]
    for radius2, sign in ((motion.A2, 1.0), (motion.B2, -1.0)):
        u = (radius2 + z2) ** -0.5
        u2 = u * u
        c3 = sign * radius2 * motion.K * u2 * u
        c5 = c3 * u2
        c7 = c5 * u2
        terms = (c3, -3.0 * c5, 3.0 * c7 * (4.0 * z2 - radius2), -15.0 * c7 * u2 * (4.0 * z2 - 3.0 * radius2))
        sums = [a + b for a, b in zip(sums, terms, strict=True)]
    p1, half2, half3, p4z = sums[0], 0.5 * z * sums[1], 0.5 * sums[2], z * sums[3]
    q = motion.MU / motion.M
    bx, by, bz = motion.MU * half2 * x, motion.MU * half2 * y, motion.MU * (0.5 * half3 * r2 - p1)
    s = half3 * nz
    i1 = 1 / motion.I1
    return [
        (x, vx), (y, vy), (z, vz),
        (vx, q * (nx * half2 + s * x)), (vy, q * (ny * half2 + s * y)),
        (vz, q * ((nx * x + ny * y) * half3 + nz * (0.25 * p4z * r2 - 2.0 * half2)) - motion.G),
        (nx, i1 * (ly * nz - lz * ny)), (ny, i1 * (lz * nx - lx * nz)), (nz, i1 * (lx * ny - ly * nx)),
        (lx, ny * bz - nz * by), (ly, nz * bx - nx * bz), (lz, nx * by - ny * bx),
    ]  # fmt: skip


HEYOKA_TOLERANCES = [1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15]


def _heyoka_scalar(quick: bool) -> Iterator[Point]:  # noqa: FBT001
    import heyoka as hy

    start = motion.vector_start()
    for tolerance in HEYOKA_TOLERANCES[:: 2 if quick else 1]:
        integrator = hy.taylor_adaptive(heyoka_system(), start, tol=tolerance)

        def work(integrator: Any = integrator) -> None:
            integrator.time = 0.0
            integrator.state[:] = start
            integrator.propagate_until(motion.DURATION)

        seconds = best_time(work)
        yield Point("heyoka", f"tol {tolerance:g}", error_of(integrator.state[:3]), motion.DURATION / seconds)


def _heyoka_batch(quick: bool) -> Iterator[Point]:  # noqa: FBT001
    import heyoka as hy

    start = motion.vector_start()
    for lanes in (4, 8):
        # neighbours of the start: lanes of one batch take the steps that each of them needs
        starts = np.repeat(start[:, None], lanes, axis=1)
        starts[0] += np.arange(lanes) * 1e-5
        for tolerance in HEYOKA_TOLERANCES[:: 2 if quick else 1]:
            integrator = hy.taylor_adaptive_batch(heyoka_system(), starts.copy(), tol=tolerance)

            def work(integrator: Any = integrator, lanes: int = lanes, starts: Array = starts) -> None:
                integrator.set_time(np.zeros(lanes))
                integrator.state[:] = starts
                integrator.propagate_until(np.full(lanes, motion.DURATION))

            seconds = best_time(work)
            speed = lanes * motion.DURATION / seconds
            yield Point("heyoka batch", f"tol {tolerance:g}, {lanes} lanes", error_of(integrator.state[:3, 0]), speed)


_LOOSE, _TIGHT = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7], [1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13]
PEERS = (
    Peer("scipy BDF in Euler angles", "scipy", _scipy("BDF", [1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10], "Euler")),
    Peer("scipy RK45", "scipy", _scipy("RK45", _LOOSE[1:] + _TIGHT[:4], "vector")),
    Peer("scipy DOP853", "scipy", _scipy("DOP853", _LOOSE[1:] + _TIGHT, "vector")),
    Peer("scipy LSODA", "scipy", _scipy("LSODA", _LOOSE[1:] + _TIGHT[:5], "vector")),
    Peer("scipy Radau", "scipy", _scipy("Radau", [1e-4, 1e-6, 1e-7, 1e-8], "vector")),
    Peer("heyoka", "heyoka", _heyoka_scalar),
    Peer("heyoka batch", "heyoka", _heyoka_batch),
)
