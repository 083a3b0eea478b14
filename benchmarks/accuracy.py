"""Errors that `simulate` estimates against the true ones and the tolerance, in random scenes that stay up.

    python benchmarks/accuracy.py --out benchmarks/results

Of each kind of scene starts, masses, spins, durations (5 to 60 s) and tolerances (1e-5 to 1e-10) are drawn.
The true error is taken against `kahan-li-8` at steps of 0.8 ms, good to some 1e-12 rad after 60 s.  Kept for
each kind: the share of the scenes whose error lies between 0.03 times the tolerance and the tolerance, of those whose
estimates of place and axis bound the true errors, and of those where the first run of the whole motion was the result.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.simulator import preset, simulate
from levilab.simulator.kernels.motion import N, R

if TYPE_CHECKING:
    from levilab.simulator.scene import Scene

KINDS = ("undriven", "drag", "tilted", "driven by a sine", "driven by a square wave")
DURATIONS, TOLERANCES = (5.0, 60.0), (1e-10, 1e-5)
REFERENCE_STEP = 8e-4
#: Errors below this are those of the reference, too [m, rad].
FLOOR = 2e-12


@dataclass(frozen=True)
class Trial:
    """One scene: its duration and tolerance, the true errors of place [m] and axis [rad], and the estimates."""

    kind: str
    scene: Scene
    duration: float
    tolerance: float
    place: float = np.nan
    axis: float = np.nan
    place_estimate: float = np.nan
    axis_estimate: float = np.nan
    tries: int = 0

    @property
    def share(self) -> float:
        """The larger error as a part of the tolerance."""
        return max(self.place, self.axis) / self.tolerance

    @property
    def is_sharp(self) -> bool:
        """Whether the error lies between 0.03 and 1 times the tolerance."""
        return 0.03 <= self.share <= 1

    @property
    def is_honest(self) -> bool:
        """Whether both estimates bound the true errors."""
        return self.place <= self.place_estimate + FLOOR and self.axis <= self.axis_estimate + FLOOR


def draw_scene(kind: str, draw: np.random.Generator) -> Scene:
    """Return a random scene: a top that starts near to where it floats, and may fall nevertheless."""

    def within(low: float, high: float) -> float:
        return float(draw.uniform(low, high))

    changes: dict[str, Any] = {
        "start.position_m": [within(-1.5e-3, 1.5e-3), within(-1.5e-3, 1.5e-3), within(0.0715, 0.0735)],
        "start.velocity_m_s": [within(-3e-3, 3e-3) for _ in range(3)],
        "start.tilt_rad": within(0.003, 0.04),
        "start.precession": str(draw.choice(["thesis", "none"])),
        "start.spin_hz": within(24, 45),
    }
    if kind in ("undriven", "drag"):
        changes["top.mass_kg"] = within(0.02505, 0.0254)
        if kind == "drag":
            changes |= {"drag.law": str(draw.choice(["stokes", "newton", "disc"])), "start.spin_hz": within(32, 45)}
        return preset("undriven").changed(changes)
    changes["top.mass_kg"] = within(0.0243, 0.0246)
    if kind == "tilted":
        return preset("tilted").changed(changes)
    frequency = within(26, 40)
    changes |= {
        "drive.waveform": kind.rsplit(maxsplit=1)[-1] if kind.endswith("sine") else "square",
        "drive.frequency_hz": frequency,
        "drive.amplitude_t": within(2e-4, 6e-4),
        "drive.phase_rad": within(0, 2 * np.pi),
        "start.spin_hz": frequency + within(-0.1, 0.1),
    }
    return preset("driven").changed(changes)


def trial(kind: str, draw: np.random.Generator) -> Trial | None:
    """Return a random scene with its errors; None if the top falls."""
    scene = draw_scene(kind, draw)
    duration, tolerance = (float(np.exp(draw.uniform(*np.log(r)))) for r in (DURATIONS, TOLERANCES))
    motion = simulate(scene, duration, tolerance=tolerance, rate=None)
    if motion.fell is not None:
        return None
    exact = exact_end(scene, duration)
    if exact is None:
        return None
    accuracy, end = motion.accuracy, motion.states[-1]
    return replace(
        Trial(kind, scene, duration, tolerance),
        place=float(np.linalg.norm(end[R] - exact[R])),
        axis=float(np.linalg.norm(end[N] - exact[N])),
        place_estimate=accuracy.position,
        axis_estimate=accuracy.axis,
        tries=accuracy.tries,
    )


def trials(kind: str, count: int, seed: list[int]) -> list[Trial]:
    """Return random scenes that stay up."""
    draw = np.random.default_rng(seed)
    one_after_the_other = (trial(kind, draw) for _ in itertools.count())
    return list(itertools.islice((one for one in one_after_the_other if one is not None), count))


def exact_end(scene: Scene, duration: float) -> np.ndarray | None:
    """Return the state at the end, shape (18,), by another scheme at far smaller steps; None if the top falls."""
    from levilab.simulator.model import model_of
    from levilab.simulator.problem import Problem, integrate
    from levilab.simulator.schemes import SCHEMES
    from levilab.simulator.start import start_of
    from levilab.simulator.stops import stops_between

    start = start_of(scene)
    problem = Problem(scene, model_of(scene, start[R]), start, SCHEMES["kahan-li-8"])
    states, fell, *_ = integrate(problem, stops_between(0.0, duration, REFERENCE_STEP, scene.drive))
    return states[-1] if fell is None else None


def shares(trials: list[Trial]) -> dict[str, float | int]:
    """Return the shares of a kind of scene."""
    return {
        "scenes": len(trials),
        "within_0.03_and_1": float(np.mean([t.is_sharp for t in trials])),
        "honest": float(np.mean([t.is_honest for t in trials])),
        "first_run": float(np.mean([t.tries == 1 for t in trials])),
        "median_share_of_tolerance": float(np.median([t.share for t in trials])),
        "estimate_over_error_median": float(np.median([t.axis_estimate / max(t.axis, FLOOR) for t in trials])),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=100, help="of each kind and seed")
    parser.add_argument("--seeds", type=int, nargs="+", default=[2, 3])
    parser.add_argument("--out", type=Path, help="folder of accuracy.json")
    parser.add_argument("--list", action="store_true", help="print the scenes whose estimate is too small")
    options = parser.parse_args()
    document: dict[str, Any] = {"schema": "levilab-benchmark-accuracy/1", "seeds": options.seeds, "kinds": {}}
    document["measured_utc"] = datetime.now(UTC).isoformat(timespec="seconds")
    begin, everything = time.process_time(), list[Trial]()
    print(f"{'':24} scenes  0.03 to 1  honest  first run  median share  estimate/error")
    for number, kind in enumerate(KINDS):
        found = [one for seed in options.seeds for one in trials(kind, options.scenes, [seed, number])]
        everything += found
        document["kinds"][kind] = print_shares(kind, found)
        if options.list:
            for t in found:
                if not t.is_honest or t.tries > 1:
                    errors = (
                        f"place {t.place:.1e} of {t.place_estimate:.1e}, axis {t.axis:.1e} of {t.axis_estimate:.1e}"
                    )
                    print(f"   {t.duration:.1f} s to {t.tolerance:.1e}: {errors}, {t.tries} tries")
    document["kinds"]["all"] = print_shares("all", everything)
    print(f"{time.process_time() - begin:.0f} s of the processor")
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "accuracy.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def print_shares(kind: str, trials: list[Trial]) -> dict[str, float | int]:
    """Print and return the shares of a kind of scene."""
    found = shares(trials)
    n, sharp, honest, first, median, ratio = found.values()
    print(f"{kind:24} {n:6d} {sharp:10.3f} {honest:7.3f} {first:10.3f} {median:13.2f} {ratio:15.1f}", flush=True)
    return found


if __name__ == "__main__":
    main()
