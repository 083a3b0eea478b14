"""The kernels' own points: each scheme at fixed steps, without an error estimate; one top, and lanes."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from levilab.benchmark.simulator import motion
from levilab.benchmark.simulator.peers import Point, best_time_and_result, error_of
from levilab.simulator.ensemble import integrate_in_lanes, runs_of
from levilab.simulator.kernels.columns import LANES
from levilab.simulator.model import model_of
from levilab.simulator.problem import Problem
from levilab.simulator.scene import preset
from levilab.simulator.schemes import SCHEMES
from levilab.simulator.start import start_of
from levilab.simulator.stops import stops_between
from levilab.simulator.varied import batches

#: Steps in the 5 s.
STEPS = {
    "strang": (2000, 8000, 32000),
    "suzuki-4": (500, 1000, 2000, 4000, 8000),
    "blanes-moan-4": (350, 500, 700, 1000, 1400, 2000, 3000, 4500),
    "kahan-li-6": (500, 1000, 2000, 4000),
    "blanes-moan-6": (200, 250, 300, 350, 400, 500, 700, 1000, 1200, 1250, 1400, 2000, 2800),
    "levitron-6": (120, 160, 200, 240, 280, 320, 400, 500, 640, 800, 900, 1000, 1200, 1400, 2000),
    "kahan-li-8": (350, 500, 700, 1000, 1400, 1700, 2000, 2400),
}


def problem(name: str) -> Problem:
    """Return the scene `undriven` for a scheme."""
    scene = preset("undriven")
    return Problem(scene, model_of(scene), start_of(scene), SCHEMES[name])


def scalar(quick: bool, names: Iterable[str] = tuple(STEPS)) -> Iterator[Point]:  # noqa: FBT001
    """Yield points of one top, one core, fixed steps: the kernel alone."""
    for name in names:
        ready = problem(name)
        for count in STEPS[name][:: 2 if quick else 1]:
            stops = stops_between(0.0, motion.DURATION, motion.DURATION / count, ready.scene.drive)
            work = partial(ready.advance_to_stops, ready.start, stops, ready.escape)
            work()  # compiled before it is timed
            seconds, (states, _) = best_time_and_result(work)
            yield Point(name, f"{count} steps", error_of(states[-1, :3]), motion.DURATION / seconds)


def many(quick: bool, names: Iterable[str] = ("levitron-6", "kahan-li-8")) -> Iterator[Point]:  # noqa: FBT001
    """Yield points of four times as many tops as lanes, one core, fixed steps; the error of the first."""
    tops = 4 * LANES
    for name in names:
        ready = problem(name)
        places = ready.start[0] + np.arange(tops) * 1e-6
        (batch,) = batches(ready.scene, {"start.position_m.0": places})
        for count in STEPS[name][:: 2 if quick else 1]:
            run = partial(
                integrate_in_lanes,
                replace(batch, scheme=ready.scheme),
                runs_of(batch, motion.DURATION, np.full(tops, motion.DURATION / count)),
            )
            run()  # compiled before it is timed
            seconds, passed = best_time_and_result(run)
            error = error_of(passed.states[0, :3])
            yield Point(f"{name}, lanes", f"{count} steps", error, tops * motion.DURATION / seconds)
