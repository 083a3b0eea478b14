"""Many tops at once: calls before their kernel, corners, samples, observables of sweeps and windows; processor time.

    python benchmarks/ensemble.py

Contenders take turns; the best round of each counts.  Registers of four doubles are tried with
NUMBA_CPU_NAME=haswell, NUMBA_CPU_FEATURES=+avx2,+fma,+avx,+bmi2 and an XDG_CACHE_HOME of its own.
"""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.simulator import grid, preset, simulate, simulate_many
from levilab.simulator.ensemble import integrate_in_lanes, runs_of
from levilab.simulator.equilibrium import stability_of, windows_over
from levilab.simulator.kernels.motion import R
from levilab.simulator.model import model_of
from levilab.simulator.problem import Problem, integrate, scheme_for
from levilab.simulator.start import start_of
from levilab.simulator.stops import stops_between
from levilab.simulator.varied import batches, broadcast, scene_at
from levilab.sweeps.observables import observe
from levilab.sweeps.plan import Axis, Plan
from levilab.sweeps.run import with_step

if TYPE_CHECKING:
    from collections.abc import Callable

ROUNDS = 7
UNDRIVEN, DRIVEN, MOTOR = preset("undriven"), preset("driven"), preset("motor")
ALONE = {"sine": MOTOR.changed({"drive.waveform": "sine"}), "triggered": MOTOR}
THOUSAND = {"start.spin_hz": np.linspace(25, 40, 1000)}
LOCKS = grid({"drive.frequency_hz": np.linspace(28, 32, 16), "drive.amplitude_t": np.linspace(1e-4, 5e-4, 16)})
MASSES = np.linspace(0.0245, 0.0256, 61)


def best(contenders: dict[str, Callable[[], Any]]) -> dict[str, float]:
    """Return the shortest processor time of each [s]."""
    for work in contenders.values():
        work()
    found = dict.fromkeys(contenders, np.inf)
    for _ in range(ROUNDS):
        for name, work in contenders.items():
            begin = time.process_time()
            work()
            found[name] = min(found[name], time.process_time() - begin)
    return found


def lanes(scene: Any, over: Any, duration: float, step: float, **more: Any) -> Callable[[], Any]:
    """Return a call of `simulate_many` with a fixed step, on one core, without errors."""
    return lambda: simulate_many(scene, over, duration, step=step, errors=False, cores=1, **more)


def one_by_one(scene: Any, over: Any, duration: float, step: float) -> Callable[[], Any]:
    """Return the same tops, each alone from corner to corner."""
    values = broadcast(over)
    scenes = [scene_at(scene, values, i) for i in range(next(iter(values.values())).size)]
    problems = []
    for one in scenes:
        start = start_of(one)
        model = model_of(one, start[R])
        problems.append(Problem(one, model, start, scheme_for(None, model)))
    return lambda: [integrate(one, stops_between(0.0, duration, step, one.scene.drive)) for one in problems]


def observables(names: str) -> Callable[[], Any]:
    """Return a call that observes 128 driven tops for 10 s, on one core, with the step of a sweep."""
    axis = Axis("drive.frequency_hz", np.linspace(29, 31, 128))
    plan = with_step(Plan(DRIVEN, (axis,), tuple(names.split(",")), 10.0), lambda _: None)
    return lambda: observe(plan, {axis.key: axis.values})


def kernel() -> float:
    """Return the nanoseconds of one stage, a drift and a kick, of one top in lanes."""
    (batch,) = batches(UNDRIVEN, {"start.position_m.0": 1e-3 + np.arange(64) * 1e-6})
    runs = runs_of(batch, 5.0, np.full(64, 5 / 1400))
    seconds = best({"it": lambda: integrate_in_lanes(batch, runs)})["it"]
    return seconds / (64 * 1400 * batch.scheme.stages) * 1e9


def main() -> None:
    """Print a line for each."""
    square = DRIVEN.changed({"drive.waveform": "square"})
    found = best(
        {
            "1000 tops before the kernel": lambda: batches(UNDRIVEN, THOUSAND),
            "1000 tops, one step": lanes(UNDRIVEN, THOUSAND, 1e-3, 1e-3),
            "1000 scenes, validated one by one": lambda: [scene_at(UNDRIVEN, THOUSAND, i) for i in range(1000)],
            "256 tops, square, 5 s, lanes": lanes(square, LOCKS, 5.0, 2e-3),
            "256 tops, square, 5 s, one by one": one_by_one(square, LOCKS, 5.0, 2e-3),
            "256 tops, sine, 5 s, lanes": lanes(DRIVEN, LOCKS, 5.0, 2e-3),
            "256 tops, 5 s, steps of 3.3 ms": lanes(
                UNDRIVEN, {"start.spin_hz": np.linspace(25, 40, 256)}, 5.0, 0.01 / 3
            ),
            "the same, place at 100 Hz": lanes(
                UNDRIVEN, {"start.spin_hz": np.linspace(25, 40, 256)}, 5.0, 0.01 / 3, rate=100.0, columns=R
            ),
            "the same, all of the state at 100 Hz": lanes(
                UNDRIVEN, {"start.spin_hz": np.linspace(25, 40, 256)}, 5.0, 0.01 / 3, rate=100.0
            ),
            **{
                f"128 driven tops, 10 s, {names}": observables(names)
                for names in ("survived", "position_error_m", "height_spread_m", "locked", "lines")
            },
            **{
                f"one top, 20 s, {name}, {key} {value:g}": partial(simulate, scene, 20.0, rate=None, **{key: value})
                for key, value in (("tolerance", 1e-7), ("tolerance", 1e-9), ("tolerance", 1e-11), ("step", 1e-3))
                for name, scene in ALONE.items()
            },
            "windows of 61 masses": lambda: windows_over(UNDRIVEN, MASSES),
            "the same, one by one": lambda: [stability_of(UNDRIVEN.changed({"top.mass_kg": m})) for m in MASSES],
        }
    )
    for name, seconds in found.items():
        print(f"{name:42} {1000 * seconds:9.2f} ms")
    print(f"a stage of one top in lanes {kernel():.2f} ns")


if __name__ == "__main__":
    main()
