"""Nyström compositions whose error is small on the Levitron's motion: `levitron-6` was found so.

    python benchmarks/compositions.py --stages 10 --minutes 20

A symmetric composition of s kicks has s + 1 free coefficients, the conditions of order 6 take 8 of them.  Solutions of
the conditions are drawn, and the best is improved by an evolution strategy that steps along the conditions.  What is
improved is the mean logarithm of the error of the place after 5 s, of tops unlike the one that the benchmark takes:
other starts, masses and spins, at steps for errors between 1e-6 and 1e-9 cm.  Printed are the stages per second of
simulated time that an error needs, for tops that were not looked at before.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace

import numpy as np

from levilab.simulator import preset
from levilab.simulator.kernels.motion import R
from levilab.simulator.model import model_of
from levilab.simulator.problem import Problem, integrate_to_end
from levilab.simulator.schemes import SCHEMES, Scheme
from levilab.simulator.start import start_of
from levilab.simulator.stops import stops_between
from order_conditions import residuals

DURATION = 5.0  # [s]
#: Stages per second of simulated time, where a good composition of order 6 has errors of 1e-6 to 1e-9 cm.
RATES = (600.0, 1100.0, 2000.0)
#: Sum of the sizes of all coefficients: those of long ways to and fro lose digits and bring no speed.
LARGEST = 12.0


def halves(stages: int) -> tuple[int, int]:
    """Drifts and kicks that are free: the others follow by symmetry."""
    return (stages + 2) // 2, (stages + 1) // 2


def composition(free: np.ndarray, stages: int) -> Scheme:
    """Return the whole of it from its first halves."""
    drifts, kicks = np.split(free, [halves(stages)[0]])
    whole = [np.concatenate([half, half[::-1][full % 2 :]]) for half, full in ((drifts, stages + 1), (kicks, stages))]
    return Scheme(f"{stages} stages", 6, tuple(whole[0].tolist()), tuple(whole[1].tolist()), any_split=False)


def missed(free: np.ndarray, stages: int) -> np.ndarray:
    """Return the conditions of order 5; by symmetry order 6 comes with them."""
    scheme = composition(free, stages)
    return residuals(np.array(scheme.drifts), np.array(scheme.kicks), 5)


def solved(free: np.ndarray, stages: int) -> np.ndarray | None:
    """Return the nearest solution of the conditions, by Gauss and Newton; None where they do not lead to one."""
    for _ in range(30):
        now = missed(free, stages)
        if np.abs(now).max() < 1e-15:
            return free
        slopes = np.array(
            [(missed(free + d, stages) - missed(free - d, stages)) / 2e-7 for d in 1e-7 * np.eye(free.size)]
        )
        step = np.linalg.lstsq(slopes.T, -now, rcond=1e-9)[0]
        length = np.linalg.norm(step)
        free = free + step * min(1.0, 0.3 / max(length, 1e-300))
        if np.abs(free).max() > 3 or length < 1e-15:
            break
    return free if np.abs(missed(free, stages)).max() < 1e-13 else None


@dataclass(frozen=True)
class Case:
    """A top, and where it is after the time."""

    problem: Problem
    end: np.ndarray

    def error(self, scheme: Scheme, rate: float) -> float:
        """Of the place at a number of stages a second [m]."""
        steps = max(1, round(DURATION * rate / scheme.stages))
        end = after(replace(self.problem, scheme=scheme), steps)
        return float(np.linalg.norm(end[R] - self.end[R]))


def after(problem: Problem, steps: int) -> np.ndarray:
    """Return the state after the time."""
    return integrate_to_end(problem, stops_between(0.0, DURATION, DURATION / steps, problem.scene.drive))


def cases(count: int, seed: int) -> list[Case]:
    """Tops that stay up: starts, masses, tilts and spins drawn."""
    draw, found = np.random.default_rng(seed), []
    while len(found) < count:
        scene = preset("undriven").changed(
            {
                "top.mass_kg": draw.uniform(0.02505, 0.0254),
                "start.position_m": [*draw.uniform(-0.0015, 0.0015, 2).tolist(), 0.0725 + draw.uniform(-0.001, 0.001)],
                "start.velocity_m_s": draw.uniform(-0.003, 0.003, 3).tolist(),
                "start.tilt_rad": draw.uniform(0.003, 0.04),
                "start.spin_hz": draw.uniform(23, 45),
                "start.precession": str(draw.choice(["thesis", "none"])),
            }
        )
        problem = Problem(scene, model_of(scene), start_of(scene), SCHEMES["blanes-moan-6"])
        end = after(problem, 6000)
        if np.hypot(*end[:2]) < 0.008 and abs(end[2] - 0.0725) < 0.004:
            found.append(Case(problem, end))
    return found


def mean_error(scheme: Scheme, tops: list[Case], rate: float) -> float:
    """Mean logarithm to the base 10 of the error [m]."""
    errors = np.array([case.error(scheme, rate) for case in tops])
    return float(np.mean(np.log10(np.clip(np.nan_to_num(errors, nan=1e3), 1e-15, 1e3))))


def score(free: np.ndarray, stages: int, tops: list[Case]) -> float:
    """Return what is to be small."""
    return float(np.mean([mean_error(composition(free, stages), tops, rate) for rate in RATES]))


def needed(scheme: Scheme, tops: list[Case], error: float) -> float:
    """Stages a second for a mean error [m]."""
    rates = np.geomspace(400, 9000, 40)
    means = np.array([mean_error(scheme, tops, rate) for rate in rates])
    return float(np.exp(np.interp(-np.log10(error), np.maximum.accumulate(-means), np.log(rates))))


def best_of(stages: int, seconds: float, tops: list[Case], draw: np.random.Generator) -> tuple[float, np.ndarray]:
    """Draw solutions for a part of the time, then improve the best until it no longer gets better."""
    end = time.perf_counter() + seconds
    drifts, kicks = halves(stages)
    pool = []
    while not pool or time.perf_counter() < end - 0.7 * seconds:
        around = np.concatenate([np.full(drifts, 1 / (stages + 1)), np.full(kicks, 1 / stages)])
        if (free := solved(around + draw.normal(0, 0.15, around.size), stages)) is not None:
            pool.append((score(free, stages, tops), free))
    best, free = min(pool, key=lambda one: one[0])
    size, shape, failed = 0.03, np.eye(drifts + kicks), 0
    while failed < 120 and time.perf_counter() < end:
        other = solved(free + size * draw.multivariate_normal(np.zeros(free.size), shape), stages)
        value = score(other, stages, tops) if other is not None and np.abs(other).sum() < LARGEST / 2 else np.inf
        if other is not None and value < best:
            way = (other - free) / np.linalg.norm(other - free)
            shape = 0.9 * shape + 0.1 * free.size * np.outer(way, way)
            best, free, size, failed = value, other, 1.5 * size, 0
        else:
            size, failed = max(0.94 * size, 1e-6), failed + 1
    return best, free


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stages", type=int, default=10)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--compare", action="store_true", help="only compare the two of the table, kind by kind")
    options = parser.parse_args()
    if options.compare:
        compare()
        return
    tops, unseen, draw = cases(14, 1), cases(16, 2), np.random.default_rng(options.seed)
    report(SCHEMES["blanes-moan-6"], unseen)
    end, best = time.perf_counter() + 60 * options.minutes, np.inf
    while time.perf_counter() < end:
        value, free = best_of(options.stages, 20 * options.minutes, tops, draw)
        if value < best:
            best = value
            scheme = composition(free, options.stages)
            report(scheme, unseen)
            print("   drifts", [f"{a:.17g}" for a in scheme.drifts[: halves(options.stages)[0]]])
            print("   kicks ", [f"{b:.17g}" for b in scheme.kicks[: halves(options.stages)[1]]], flush=True)


#: Scenes in which the two are compared, with what is changed in them.
KINDS = {
    "undriven": {},
    "tilted": {},
    "driven": {},
    "driven, triangle": {"drive.waveform": "triangle"},
    "driven, square": {"drive.waveform": "square"},
}


def compare() -> None:
    """How many times smaller the error of `levitron-6` is at the same stages a second."""
    rates = (600.0, 1100.0, 2000.0, 4000.0)
    print("error of blanes-moan-6 over that of levitron-6 at stages/s", *(f"{rate:6.0f}" for rate in rates))
    for kind, changes in KINDS.items():
        scene = preset(kind.partition(",")[0]).changed(changes)
        problem = Problem(scene, model_of(scene), start_of(scene), SCHEMES["blanes-moan-6"])
        one = Case(problem, after(replace(problem, scheme=SCHEMES["kahan-li-8"]), 9000))
        both = [[one.error(SCHEMES[name], rate) for rate in rates] for name in ("blanes-moan-6", "levitron-6")]
        print(f"{kind:58}", *(f"{old / new:6.2g}" for old, new in zip(*both, strict=True)))


def report(scheme: Scheme, unseen: list[Case]) -> None:
    rates = {error: needed(scheme, unseen, error) for error in (1e-8, 1e-11)}
    size = sum(map(abs, scheme.drifts + scheme.kicks))
    print(
        f"{scheme.name:14} stages/s for 1e-6 cm {rates[1e-8]:6.0f}, 1e-9 cm {rates[1e-11]:6.0f}, size {size:.1f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
