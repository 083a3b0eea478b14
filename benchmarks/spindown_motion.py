"""Does the spin-down's analysis find the truth where a counter counts a wobbling top, and where noise is correlated?

``python benchmarks/spindown_motion.py`` analyzes

- counts of 60 tops in full motion, at random (mass, inertia, tilt of the moment, law of drag and its constants, first
  spin, start, place of the tape), with the virtual counter until they fall, without and with noise added;
- readings of a top that only spins, 500 of each kind: u stated or not, neighbours correlated by 0, 0.3 and 0.7; and
  uncorrelated ones with a tilt allowed for;
- readings that no law describes, 100 of each kind.

It prints and keeps ``benchmarks/results/spindown_motion.json``: pulls (estimate − truth)/u, and what was said wrongly.
``--seed`` draws others.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyvisa

from analysis.spindown.drag import spin
from analysis.spindown.fit import SpinDown, fit_spin_down
from analysis.spindown.verdict import CHANGED
from instruments.clock import VirtualClock
from instruments.virtual.bench.visa_library import library_for
from levilab.simulator import preset
from levilab.simulator.laws import LAWS
from levilab.world.bench import virtual_bus
from levilab.world.motion_world import MotionWorld

RESULTS = Path(__file__).parent / "results" / "spindown_motion.json"
T = 10.0 * np.arange(20)
NOISE_HZ = 0.03


def draw_top(rng: np.random.Generator) -> dict[str, Any]:
    """Keys of a scene."""
    size = rng.uniform(0.88, 1.12)
    law = str(rng.choice(["disc", "disc", "newton", "stokes", "mixed"]))
    constants = [float(c * rng.uniform(0.85, 1.15)) for c in LAWS[law].usual]
    return {
        "start.spin_hz": float(rng.uniform(37.0, 42.0)),
        "start.tilt_rad": float(rng.uniform(0.001, 0.02)),
        "top.mass_kg": float(rng.uniform(0.0241, 0.0246)),
        "top.inertia_transverse_kg_m2": 1.04e-6 * size * float(rng.uniform(0.97, 1.03)),
        "top.inertia_axial_kg_m2": 1.731314e-6 * size,
        "top.moment_tilt": [float(rng.uniform(0.012, 0.042)), 0.97],
        "drag.law": law,
        "drag.coefficient": constants if len(constants) > 1 else constants[0],
    }


def count_until_it_falls(keys: dict[str, Any], seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and spins [Hz], one each 10 s, as a program at the bench reads them."""
    clock = VirtualClock()
    bus = virtual_bus(MotionWorld(preset("spindown").changed(keys), clock, seed=seed))
    bench = pyvisa.ResourceManager(library_for(bus))
    counter: Any = bench.open_resource("TCPIP0::counter.levilab::inst0::INSTR", timeout=60_000)
    counter.write("CONF:FREQ (@1);:INP1:COUP DC;LEV:AUTO OFF;:INP1:LEV 0.6")
    counter.write("SENS:FREQ:GATE:SOUR TIME;:SENS:FREQ:GATE:TIME 1;:SYST:TIM 5")
    rows: list[tuple[float, float]] = []
    while True:
        clock.sleep(max(10.0 * len(rows) - clock.now(), 0.0))
        before = clock.now()
        reading = float(counter.query("READ?"))
        if not 10 < reading < 1e3:
            return np.array([t for t, _ in rows]), np.array([nu for _, nu in rows])
        rows.append(((before + clock.now()) / 2, reading))


def pull(run: SpinDown, law: str, name: str, truth: float) -> float:
    """Return (estimate − truth)/u."""
    found = run.fit(law).parameters[name]
    return float("nan") if found.value is None or not found.u else (found.value - truth) / found.u


def summary(rows: list[list[float]]) -> dict[str, Any]:
    """Return mean, standard deviation, tails and coverage of pulls, a column for each quantity."""
    p = np.ma.masked_invalid(rows)
    far = np.abs(p)
    shares = {"within_1": far < 1, "beyond_2": far > 2, "beyond_3": far > 3}
    return {
        "pull_mean": p.mean(axis=0).round(2).tolist(),
        "pull_sd": p.std(axis=0, ddof=1).round(2).tolist(),
    } | {name: share.mean(axis=0).round(4).tolist() for name, share in shares.items()}


def motion(counts: list[tuple[dict[str, Any], np.ndarray, np.ndarray]], noise_hz: float, seed: int) -> dict[str, Any]:
    """Return pulls of C, n and δ in full motion; of the mixed law neither C nor n is compared."""
    rng = np.random.default_rng(seed)
    pulls, u, excluded, described = [], [], 0, 0
    for keys, times, counted in counts:
        run = fit_spin_down(times, counted + rng.normal(0, noise_hz, counted.size))
        law = keys["drag.law"]
        names, exponent = LAWS[law].names, LAWS[law].exponent or float("nan")
        delta = float(np.arctan(keys["top.moment_tilt"][0] / keys["top.moment_tilt"][1]))
        c = keys["drag.coefficient"] if len(names) == 1 else float("nan")
        pulls.append([
            pull(run, law, names[0], c), pull(run, "power", "exponent", exponent), pull(run, law, "moment_tilt", delta)
        ])  # fmt: skip
        u.append([(run.fit(law).parameters[names[0]].u or c) / c, run.fit("power").parameters["exponent"].u])
        excluded, described = excluded + (law in run.verdict.excluded), described + run.verdict.describes
    return {
        "noise_hz": noise_hz, "tops": len(counts), "true_law_excluded": excluded, "described": described,
        "median_u_relative_c_n": np.nanmedian(u, axis=0).round(4).tolist(),
    } | summary(pulls)  # fmt: skip


def only_spins(rho: float, u: float | None, seed: int, runs: int, *, tilt: bool = False) -> dict[str, Any]:
    """Return pulls of the first spin, C and n of a disc, with noise whose neighbours are correlated.

    tilt: whether the fit allows for a tilt, which is not there.
    """
    rng = np.random.default_rng(seed)
    root = np.linalg.cholesky(rho ** np.abs(np.subtract.outer(np.arange(T.size), np.arange(T.size))))
    truth = spin("disc", T, 40.0, 2.34e-4)
    rows, excluded, described, chances = [], 0, 0, []
    for _ in range(runs):
        run = fit_spin_down(T, truth + NOISE_HZ * root @ rng.normal(size=T.size), u, tilt=tilt)
        wanted = (("disc", "start_frequency", 40.0), ("disc", "c32", 2.34e-4), ("power", "exponent", 1.5))
        rows.append([pull(run, *each) for each in wanted])
        excluded, described = excluded + ("disc" in run.verdict.excluded), described + run.verdict.describes
        chances.append(run.verdict.change.p if run.verdict.change else 1.0)
    sets = {
        size: float(np.mean([(np.array(part) * size < CHANGED).any() for part in _sets(chances, size)]))
        for size in (1, 10, 100, 300)
        if size <= runs
    }
    return {
        "rho": rho, "reading_u_hz": u, "runs": runs, "true_law_excluded": excluded / runs,
        "not_described": 1 - described / runs, "sets_with_a_run_named": sets,
    } | summary(rows)  # fmt: skip


def _sets(values: list[float], size: int) -> list[list[float]]:
    return [values[k : k + size] for k in range(0, len(values) - size + 1, size)]


def odd_readings(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Readings [Hz] that no law of drag describes, without noise."""
    usual = spin("disc", T, 40.0, 2.34e-4)
    k = int(rng.integers(5, 14))
    slower = spin("disc", T[k:] - T[k], float(usual[k]), 2 * 2.34e-4)  # from then on it touches something
    rising = usual.copy()
    rising[k : k + 4] = usual[k] + np.array([0.0, 0.5, 1.0, 1.5])
    rising[k + 4 :] += rising[k + 3] - usual[k + 3]
    return {
        "jump of -0.6 Hz": usual - 0.6 * (np.arange(T.size) >= k),
        "jump of +1 Hz": usual + 1.0 * (np.arange(T.size) >= k),
        "twice the drag": np.append(usual[:k], slower),
        "rising for 30 s": rising,
    }


def no_law(u: float | None, seed: int, runs: int) -> dict[str, Any]:
    """Return how often no law is said to describe each kind of odd readings."""
    rng = np.random.default_rng(seed)
    said: dict[str, int] = {}
    for _ in range(runs):
        for kind, readings in odd_readings(rng).items():
            run = fit_spin_down(T, readings + rng.normal(0, NOISE_HZ, T.size), u, tilt=False)
            said[kind] = said.get(kind, 0) + (not run.verdict.describes)
    return {"reading_u_hz": u, "runs": runs, "said": {kind: n / runs for kind, n in said.items()}}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=26071)
    parser.add_argument("--tops", type=int, default=60)
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--odd", type=int, default=100)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    drawn = [draw_top(rng) for _ in range(asked.tops)]
    counts = [(keys, *count_until_it_falls(keys, asked.seed * 1000 + k)) for k, keys in enumerate(drawn)]
    found: dict[str, Any] = {"seed": asked.seed}
    found["full_motion"] = [motion(counts, noise, asked.seed) for noise in (0.0, 0.01, 0.03)]
    found["only_spins"] = [
        only_spins(rho, u, asked.seed, asked.runs) for rho in (0.0, 0.3, 0.7) for u in (None, NOISE_HZ)
    ]
    found["tilt_allowed_for"] = [only_spins(0.0, u, asked.seed, asked.runs, tilt=True) for u in (None, NOISE_HZ)]
    found["no_law"] = [no_law(u, asked.seed, asked.odd) for u in (None, NOISE_HZ)]
    print(json.dumps(found, indent=1))
    RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
