"""Other people's integrators on the same motion, each with the settings from loose to tight."""

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any, TypeVar

import numpy as np

from analysis.arrays import Array
from levilab.benchmark.simulator import motion
from levilab.benchmark.simulator.taylor import heyoka_batch, heyoka_integrator

Result = TypeVar("Result")

#: The true place at the end of the undriven motion [m].
REFERENCE = np.array(motion.references()["places_m"]["undriven"][f"{motion.DURATION:g}"])
#: Time of the processor, which other programs do not add to; Windows counts it in ticks of 16 ms.
CLOCK = time.process_time if os.name == "posix" else time.perf_counter


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
    """A peer: its name, the package it needs, what makes its points, and in how many rounds (None: in all)."""

    name: str
    package: str
    points: Callable[[bool], Iterator[Point]]
    rounds: int | None = None

    @property
    def installed(self) -> bool:
        """Whether its package is there."""
        return find_spec(self.package) is not None


def best_time_and_result(work: Callable[[], Result], least: float = 0.1) -> tuple[float, Result]:
    """Return the shortest time [s] of the calls that fit into `least`, at least one, and the last one's result."""
    times: list[float] = []
    while not times or (sum(times) < least and len(times) < 200):
        begin = CLOCK()
        result = work()
        times.append(CLOCK() - begin)
    return min(times), result


def error_of(place: Array) -> float:
    """Return the largest component's error [m]."""
    return float(np.abs(np.asarray(place, dtype=np.float64) - REFERENCE).max())


def _scipy(method: str, tolerances: list[float], form: str) -> Callable[[bool], Iterator[Point]]:
    def points(quick: bool) -> Iterator[Point]:  # noqa: FBT001
        from scipy.integrate import solve_ivp

        rate, start, arguments = (
            (motion.euler_rate, motion.euler_start(), ())
            if form == "Euler"
            else (motion.vector_rate, motion.vector_start(), (motion.M, 0.0, 0.0))
        )
        # errors are judged for each of the numbers by its own size: lengths, angles, angular momenta
        size = np.array([1e-2] * 3 + [1e-2] * 3 + [1.0] * 3 + [motion.I3 * motion.SPIN] * 3)
        if form == "Euler":
            size = np.array([1e-2] * 3 + [1e-2, 1, 1] + [1e-2] * 3 + [1.0, 1e2, 1e2])
        solve: Any = solve_ivp
        rate(0.0, start, *arguments)  # compiled before it is timed
        for tolerance in tolerances[:: 2 if quick else 1]:
            limits = {"rtol": tolerance, "atol": tolerance * size}
            work = partial(solve, rate, (0, motion.DURATION), start, method, args=arguments, **limits)
            seconds, result = best_time_and_result(work)
            error = error_of(result.y[:3, -1]) if result.success else np.inf
            yield Point(f"scipy {method}", f"rtol {tolerance:g}", error, motion.DURATION / seconds)

    return points


HEYOKA_TOLERANCES = [1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8, *(10.0**-k for k in range(8, 16))]


def _heyoka_scalar(quick: bool) -> Iterator[Point]:  # noqa: FBT001
    start = motion.vector_start()
    for tolerance in HEYOKA_TOLERANCES[:: 2 if quick else 1]:
        integrator = heyoka_integrator(tolerance)

        def work(integrator: Any = integrator) -> None:
            integrator.time = 0.0
            integrator.state[:] = start
            integrator.propagate_until(motion.DURATION)

        seconds, _ = best_time_and_result(work)
        yield Point("heyoka", f"tol {tolerance:g}", error_of(integrator.state[:3]), motion.DURATION / seconds)


def _heyoka_batch(quick: bool) -> Iterator[Point]:  # noqa: FBT001
    start = motion.vector_start()
    for lanes in (4, 8):
        # neighbours of the start: lanes of one batch take the steps that each of them needs
        starts = np.repeat(start[:, None], lanes, axis=1)
        starts[0] += np.arange(lanes) * 1e-5
        for tolerance in HEYOKA_TOLERANCES[:: 2 if quick else 1]:
            integrator = heyoka_batch(tolerance, lanes)
            integrator.pars[0] = motion.MU / motion.M

            def work(integrator: Any = integrator, lanes: int = lanes, starts: Array = starts) -> None:
                integrator.set_time(np.zeros(lanes))
                integrator.state[:] = starts
                integrator.propagate_until(np.full(lanes, motion.DURATION))

            seconds, _ = best_time_and_result(work)
            speed = lanes * motion.DURATION / seconds
            yield Point("heyoka batch", f"tol {tolerance:g}, {lanes} lanes", error_of(integrator.state[:3, 0]), speed)


_LOOSE, _TIGHT = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7], [1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13]
PEERS = (
    Peer("scipy BDF in Euler angles", "scipy", _scipy("BDF", [1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10], "Euler"), rounds=1),
    Peer("scipy RK45", "scipy", _scipy("RK45", _LOOSE[1:] + _TIGHT[:4], "vector")),
    Peer("scipy DOP853", "scipy", _scipy("DOP853", _LOOSE[1:] + _TIGHT, "vector")),
    Peer("scipy LSODA", "scipy", _scipy("LSODA", _LOOSE[1:] + _TIGHT[:5], "vector")),
    Peer("scipy Radau", "scipy", _scipy("Radau", [1e-4, 1e-6, 1e-7, 1e-8], "vector"), rounds=1),
    Peer("heyoka", "heyoka", _heyoka_scalar),
    Peer("heyoka batch", "heyoka", _heyoka_batch),
)
