"""Does the spin-down's analysis find the truth where a counter counts a wobbling top, and where noise is correlated?

``python benchmarks/spindown_motion.py`` analyzes

- counts of 60 tops in full motion, at random (mass, inertia, tilt of the moment, law of drag and its constants, first
  spin, start, place of the tape), with the virtual counter until they fall, without and with noise added;
- 48 runs of the bench for practice, driven from 30 to 33 Hz, and 60 of `levilab crosscheck motion`, driven to 40 Hz;
- readings whose tilt, nutation, noise and correlation are drawn from the analysis's own priors, 500 of each kind: were
  the mean pull of these not 0, the analysis would be wrong, and not only its priors;
- readings of a top that only spins, 500 of each kind: u stated or not, neighbours correlated by 0, 0.3 and 0.7; and
  uncorrelated ones with a tilt allowed for;
- the counts in full motion, and uncorrelated readings of a top that only spins, as ``--correlation none`` does;
- readings that no law describes, 100 of each kind.

It prints and keeps ``benchmarks/results/spindown_motion.json``: pulls (estimate − truth)/u, and what was said wrongly.
``--seed`` draws others, but for the driven tops.  `of_priors` is the part of a mean pull that a normal prior makes of
tops that differ from its mean: Σ (∂estimate/∂mean of the prior) (mean − truth)/u over A, a, κ, β and the nutation.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvisa
from scipy.optimize import least_squares
from scipy.stats import kstest, norm

from analysis.spindown import drag
from analysis.spindown.drag import spin
from analysis.spindown.fit import CountModel, SpinDown, fit_spin_down
from analysis.spindown.posterior import RHO, STATED_FREEDOM
from analysis.spindown.readings import check_readings
from analysis.spindown.selection import weigh
from analysis.spindown.tilt import THESIS_TOP, CountedLaw, count_of
from analysis.spindown.verdict import CHANGED, EXCLUDED
from instruments.clock import VirtualClock
from instruments.virtual.bench.visa_library import library_for
from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.subjects.motion import draw_scene
from levilab.live.practice.seeds import keys_of_seed
from levilab.pipelines.spindown.readings import release_of
from levilab.simulator import preset
from levilab.simulator.field import flux_density, flux_gradient
from levilab.simulator.kernels.motion import R
from levilab.simulator.laws import LAWS
from levilab.simulator.model import base_field
from levilab.simulator.start import start_of
from levilab.world.bench import scene_world, virtual_bus
from levilab.world.motion_world import MotionWorld

if TYPE_CHECKING:
    from analysis.spindown.tilt import Release
    from levilab.simulator.scene import Scene

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


def summary(rows: list[list[float]], *quantities: str) -> dict[str, Any]:
    """Return mean, standard deviation, tails and coverage of pulls, a column for each quantity."""
    p = np.ma.masked_invalid(rows)
    far = np.abs(p)
    shares = {"within_1": far < 1, "beyond_2": far > 2, "beyond_3": far > 3}
    return {
        "quantities": quantities,
        "pull_mean": p.mean(axis=0).round(2).tolist(),
        "pull_sd": p.std(axis=0, ddof=1).round(2).tolist(),
    } | {name: share.mean(axis=0).round(4).tolist() for name, share in shares.items()}


def motion(
    counts: list[tuple[dict[str, Any], np.ndarray, np.ndarray]], noise_hz: float, seed: int, *, correlated: bool = True
) -> dict[str, Any]:
    """Return pulls of C, n and δ in full motion, and what u(C) is made of; of the mixed law neither C nor n counts.

    correlated: whether the fit allows for noise whose neighbours are correlated.
    """
    rng = np.random.default_rng(seed)
    pulls, u, shares, excluded, described = [], [], [], 0, 0
    for keys, times, counted in counts:
        run = fit_spin_down(times, counted + rng.normal(0, noise_hz, counted.size), correlated=correlated)
        law = keys["drag.law"]
        names, exponent = LAWS[law].names, LAWS[law].exponent or float("nan")
        delta = float(np.arctan(keys["top.moment_tilt"][0] / keys["top.moment_tilt"][1]))
        c = keys["drag.coefficient"] if len(names) == 1 else float("nan")
        pulls.append([
            pull(run, law, names[0], c), pull(run, "power", "exponent", exponent), pull(run, law, "moment_tilt", delta)
        ])  # fmt: skip
        u.append([(run.fit(law).parameters[names[0]].u or c) / c, run.fit("power").parameters["exponent"].u])
        parts = run.fit(law).parts[names[0]]
        shares.append(np.square([parts.scatter, parts.correlation, parts.tilt]))
        excluded, described = excluded + (law in run.verdict.excluded), described + run.verdict.describes
    return {
        "noise_hz": noise_hz, "tops": len(counts), "true_law_excluded": excluded / len(counts),
        "described": described,
        "median_u_relative_c_n": np.nanmedian(u, axis=0).round(4).tolist(),
        "of_u_squared_scatter_correlation_tilt": [
            round(float(np.median(part)), 2) for part in (np.array(shares) / np.sum(shares, axis=1)[:, None]).T
        ],
    } | summary(pulls, "C", "n", "δ")  # fmt: skip


#: A run of the bench for practice, `levilab.live.practice.experiments`.
PRACTICE = {
    "drive_waveform": "SQU", "ramp_hz_per_s": 0.1, "drive_frequency_hz": 33.0, "hold_s": 10.0, "interval_s": 2.0,
    "reading_u_hz": 0.012,
}  # fmt: skip


def driven(scenes: dict[int, Scene], settings: dict[str, Any], last: int | None = None) -> dict[str, Any]:
    """Return pulls of C and n of tops that a drive has raised, by seed, as `levilab acquire spin` does it.

    last: end of the readings that are analyzed; None: all are.
    """
    pulls, explained = [], []
    for seed, scene in scenes.items():
        time, counted, release = _acquire(scene, seed, settings)
        found = fit_spin_down(time[:last], counted[:last], settings["reading_u_hz"], release=release)
        pulls.append([
            pull(found, "disc", "c32", scene.drag.constants[0]), pull(found, "power", "exponent", 1.5)
        ])  # fmt: skip
        explained.append([of_priors(found, name, scene) for name in ("disc", "power")])
    return {"tops": len(pulls), "of_priors": np.mean(explained, axis=0).round(2).tolist()} | summary(pulls, "C", "n")


def _acquire(scene: Scene, seed: int, settings: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, Release | None]:
    """Return times [s] and counts [Hz] of a run with the top of a scene, and how that was released."""
    world = scene_world(scene, VirtualClock, lambda _: None, seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        run = acquire_mock("spin", seed, Path(folder), world, settings)
        readings = run.readings()
        return readings.column("time_s"), readings.column("spin_frequency_hz"), release_of(run.events())


def of_priors(found: SpinDown, name: str, scene: Scene) -> float:
    """Return the part of the pull of a law's last constant that the priors make, see above.

    What the top nutates is fitted to its counts, with all else as it is in its scene.
    """
    law, readings = drag.LAWS[name], check_readings(found.time, found.frequency, found.u)
    best = found.model.fit(law, readings)
    counted, after = best.counted, best.posterior
    assert counted is not None
    assert after is not None
    across, along = scene.top.moment_tilt
    one, three = scene.top.inertia_transverse_kg_m2, scene.top.inertia_axial_kg_m2
    flux, slope, bend = _on_axis(scene)
    kappa, beta, s = 1 - one / three, slope**2 / (flux * bend), (across / along) ** 2
    resonance = math.sqrt(abs(scene.moment) * along * flux / (three - one)) / (2 * math.pi * readings.reference_hz)
    disc = drag.LAWS["disc"].dimensionless(
        [found.frequency[0], scene.drag.constants[0]], readings.reference_hz, readings.duration
    )
    top = replace(counted.top, kappa=kappa, beta=beta)
    fitted = least_squares(
        lambda q: readings.x - count_of(
            drag.LAWS["disc"], readings.tau, np.array([q[0], disc[1], s, resonance, q[1]]), top
        ),
        [disc[0], 1e-3], x_scale=1e-3,
    )  # fmt: skip
    gap = (counted.last / resonance) ** 2 - 1
    alone = counted.shape(np.array([s / gap**2, math.log(gap), 0.0, kappa, beta, 1.0]))[2]
    truth = np.array([s / gap**2, math.log(gap), 0.0, kappa, beta, fitted.x[1] / alone])
    expected, u = counted.expected
    p = len(law.parameters)
    own = np.sqrt(after.covariance[p - 1, p - 1])
    return float(after.covariance[p - 1, p:] / u**2 @ (expected - truth) / own)


def _on_axis(scene: Scene) -> tuple[float, float, float]:
    """Return B, |B′| and B″ where the top floats [T, T/m, T/m²]."""
    place, field, step = np.asarray(start_of(scene)[R], dtype=float), base_field(scene), np.array([0, 0, 1e-5])
    slopes = [float(flux_gradient(field, place + sign * step)[2, 2]) for sign in (-1, 1)]
    return abs(float(flux_density(field, place)[2])), abs(sum(slopes)) / 2, abs(slopes[1] - slopes[0]) / 2e-5


def over_the_priors(u: float | None, seed: int, runs: int) -> dict[str, Any]:
    """Return pulls of C and n of a disc where all that the analysis has a prior for is drawn from that."""
    rng = np.random.default_rng(seed)
    law, unit, pulls = drag.LAWS["disc"], 30.0, []
    apart = np.abs(np.subtract.outer(np.arange(T.size), np.arange(T.size)))
    for _ in range(runs):
        first, constant, away = rng.uniform(36, 42), 2.34e-4 * rng.uniform(0.85, 1.15), rng.normal(size=6)
        counted = spin("disc", T, first, constant)
        for _ in range(8):  # the prior knows the last reading, which depends on what is drawn
            top = CountedLaw(law, first / unit, counted[-1] / unit, unit)
            expected, deviation = top.expected
            q = [*law.dimensionless([first, constant], unit, T[-1]), *(expected + deviation * away)]
            counted = unit * top.spin(T / T[-1], np.array(q))
        size = NOISE_HZ if u is None else u * np.sqrt(STATED_FREEDOM / rng.chisquare(STATED_FREEDOM))
        noise = np.linalg.cholesky(rng.choice(RHO) ** apart) @ rng.normal(size=T.size)
        run = fit_spin_down(T, counted + size * noise, u, laws=["disc", "power"], keep_outliers=True)
        pulls.append([pull(run, "disc", "c32", constant), pull(run, "power", "exponent", 1.5)])
    ranks = norm.cdf(np.array(pulls))
    chances = [round(float(kstest(column, "uniform").pvalue), 3) for column in ranks.T]
    return {"reading_u_hz": u, "runs": runs, "ranks_uniform_p": chances} | summary(pulls, "C", "n")


def only_spins(
    rho: float,
    u: float | None,
    seed: int,
    runs: int,
    *,
    tilt: bool = False,
    time: np.ndarray = T,
    correlated: bool = True,
) -> dict[str, Any]:
    """Return pulls of the first spin, C and n of a disc, with noise whose neighbours are correlated.

    tilt: whether the fit allows for a tilt, which is not there; correlated: whether it allows for such noise.
    """
    rng = np.random.default_rng(seed)
    root = np.linalg.cholesky(rho ** np.abs(np.subtract.outer(np.arange(time.size), np.arange(time.size))))
    truth = spin("disc", time, 40.0, 2.34e-4)
    rows, excluded, described, chances = [], 0, 0, []
    for _ in range(runs):
        run = fit_spin_down(
            time, truth + NOISE_HZ * root @ rng.normal(size=time.size), u, tilt=tilt, correlated=correlated
        )
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
        "rho": rho, "reading_u_hz": u, "readings": time.size, "last_hz": round(float(truth[-1]), 1),
        "runs": runs, "true_law_excluded": excluded / runs,
        "not_described": 1 - described / runs, "sets_with_a_run_named": sets,
    } | summary(rows, "ν₀", "C", "n")  # fmt: skip


def excluded_at(rho: float, seed: int, runs: int, *, known: bool) -> float:
    """Return how often the disc's law is excluded, of a disc with correlated noise whose ρ is known or not."""
    rng, model, count = np.random.default_rng(seed), CountModel(tilt=False, top=THESIS_TOP, release=None), 0
    root = np.linalg.cholesky(rho ** np.abs(np.subtract.outer(np.arange(T.size), np.arange(T.size))))
    truth = spin("disc", T, 40.0, 2.34e-4)
    for _ in range(runs):
        readings = check_readings(T, truth + NOISE_HZ * root @ rng.normal(size=T.size), None)
        fits = {
            name: model.fit(drag.LAWS[name], readings, np.array([rho]) if known else RHO).statistics
            for name in ("disc", "mixed", "power")
        }
        count += (weigh(fits)[0]["disc"].difference or 0.0) > EXCLUDED
    return count / runs


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
    found["full_motion_known_white"] = [
        motion(counts, noise, asked.seed, correlated=False) for noise in (0.0, 0.01, 0.03)
    ]
    found["only_spins_known_white"] = [
        only_spins(0.0, u, asked.seed, asked.runs, correlated=False) for u in (None, NOISE_HZ)
    ]
    found["only_spins"] = [
        only_spins(rho, u, asked.seed, asked.runs) for rho in (0.0, 0.3, 0.7) for u in (None, NOISE_HZ)
    ]
    found["tilt_allowed_for"] = [
        only_spins(0.0, u, asked.seed, asked.runs, tilt=True, time=time)
        for time in (T, np.linspace(0, T[-1], 100), T[:12])
        for u in (None, NOISE_HZ)
    ]
    found["over_the_priors"] = [over_the_priors(u, asked.seed, asked.runs) for u in (None, NOISE_HZ)]
    usual = preset("practice")
    practice = {seed: usual.changed(keys_of_seed(usual, seed)) for seed in (*range(100, 124), *range(200, 224))}
    found["driven_to_33_hz"] = driven(practice, PRACTICE)
    found["driven_to_33_hz_without_the_last_reading"] = driven(practice, PRACTICE, -1)
    found["driven_to_40_hz"] = driven({k: draw_scene(k) for k in range(30_000, 30_060)}, {"reading_u_hz": None})
    found["excluded_at_rho_0.7"] = {
        name: excluded_at(0.7, asked.seed, 4 * asked.runs, known=known)
        for name, known in (("known", True), ("not known", False))
    }
    found["excluded_over_the_prior_of_rho"] = float(
        np.mean([excluded_at(rho, asked.seed + k, asked.runs // 2, known=False) for k, rho in enumerate(RHO)])
    )
    found["no_law"] = [no_law(u, asked.seed, asked.odd) for u in (None, NOISE_HZ)]
    print(json.dumps(found, indent=1))
    RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
