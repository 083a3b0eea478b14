"""Calibration with light, field and motion that others make: heyoka, magpylib and scipy, without our simulator.

Tops, bases and tapes are drawn from the distributions that stand in each function.  The analyses read files, and the
ranks of the true values are judged as `levilab crosscheck --calibrate` does.  Writes
benchmarks/results/calibration_by_others.json and docs/crosscheck/calibration_by_others.png.

    pip install 'levilab[peers]'
    python benchmarks/calibration_by_others.py            # 200 trials of each: 3 min
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import heyoka as hy
import magpylib
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import expit

from analysis.spindown.tilt import SHARE, SHARE_U, THESIS_TOP, TILT2
from levilab.benchmark.simulator.motion import A2, B2, MU, G, K
from levilab.benchmark.simulator.taylor import VARIABLES, heyoka_system
from levilab.crosscheck.calibration import by_ranks
from levilab.crosscheck.command import print_studies
from levilab.crosscheck.figure import calibration_figure
from levilab.crosscheck.stored import as_json
from levilab.crosscheck.study import study_world
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.formats.device import Device
from levilab.pipelines.catalogue import ANALYSES
from levilab.present.progress import ShareBar
from levilab.present.style import save_png

ROOT = Path(__file__).parents[1]
RESULT = ROOT / "benchmarks/results/calibration_by_others.json"
FIGURE = ROOT / "docs/crosscheck/calibration_by_others.png"


def analyze(name: str, file: Path, **options: Any) -> Any:
    """Return what an analysis finds in a file."""
    analysis = ANALYSES[name]
    return analysis.analyze([file], analysis.options_from(options))


def write_columns(folder: Path, titles: str, *columns: Any) -> Path:
    """Write a file as a user has it."""
    file = folder / "measured.csv"
    np.savetxt(file, np.column_stack(columns), delimiter=",", header=titles, comments="", fmt="%.10g")
    return file


# light: the spin by scipy's integrator, the pulses by a logistic function


def light(seed: int, folder: Path) -> list[Pull]:
    """Try a record of the phototransistor, of a top that slows down by the disc's law."""
    by = np.random.default_rng((seed, 1))
    start, drag, seconds = by.uniform(24, 45), by.uniform(1.6e-4, 3.0e-4), by.uniform(1, 4)
    width, edge, noise = by.uniform(0.02, 0.05), by.uniform(0.002, 0.006), 10 ** by.uniform(-2.5, -1)
    times = np.arange(round(seconds * 20_000)) / 20_000
    found = solve_ivp(
        lambda _, y: (y[1], -drag * y[1] ** 1.5), (0, seconds), (by.uniform(0, 6), 2 * math.pi * start),
        dense_output=True, rtol=1e-11, atol=1e-11,
    )  # fmt: skip
    turn = (found.sol(times)[0] / (2 * math.pi) + 0.5) % 1 - 0.5
    volts = 0.3 + expit((width / 2 - np.abs(turn)) / edge) + noise * by.standard_normal(len(times))
    file = write_columns(folder, "time [s],voltage [V]", times, volts)
    spin = analyze("spin", file).runs[0].spin
    rate = float(found.sol(spin.reference_time)[1])
    return [
        pull_of("frequency", spin.frequency, rate / (2 * math.pi)),
        pull_of("chirp", spin.chirp, -drag * rate**1.5 / (2 * math.pi)),
    ]


# field: the ring by magpylib

GAIN_U, ZERO_U_T, HEIGHT_U_M, READING_U_T = 1.2e-3, 5e-5, 2e-4, 2e-6


def field(seed: int, folder: Path) -> list[Pull]:
    """Try a scan of a ring that is drawn, by a probe whose scale, zero and heights err as they are stated."""
    by = np.random.default_rng((seed, 2))
    strength, origin = by.normal(1.40e-3, 3e-5), by.normal(0, 1e-3)
    inner, outer, thick = by.normal((0.030, 0.055, 0.015), (1e-4, 1e-4, 2e-4))
    height = np.arange(0.030, 0.1101, 0.005)
    places = np.column_stack([0 * height, 0 * height, height + by.normal(0, HEIGHT_U_M, len(height))])
    magnetization = 4 * math.pi * strength / thick
    flux = sum(
        magpylib.magnet.Cylinder(
            polarization=(0, 0, sign * magnetization), dimension=(2 * radius, thick), position=(0, 0, origin)
        ).getB(places)[:, 2]
        for radius, sign in ((outer, 1), (inner, -1))
    )
    zero = by.normal(0, ZERO_U_T)
    flux = flux * (1 + by.normal(0, GAIN_U)) + zero + by.normal(0, READING_U_T, len(height))
    own = np.full(len(height), READING_U_T)
    file = write_columns(
        folder, "height_m,height_u_m,flux_density_t,flux_density_u_t", height, 0 * height + HEIGHT_U_M, flux, own
    )
    device = Device.model_validate({
        "base": {"inner_radius_m": 0.030, "outer_radius_m": 0.055, "thickness_m": 0.015, "origin_m": 0.0},
        "magnetometer": {"gain_u": GAIN_U, "background_u_t": ZERO_U_T},
    })  # fmt: skip
    values = analyze("field", file, device=device).values
    return [pull_of("strength", values["strength"], strength), pull_of("origin", values["origin"], origin)]


# motion: a top above the thesis's base by heyoka, with a moment that is tilted, a nutation, and the drag of a disc.
# The top is drawn from the priors of analysis.spindown.tilt, and half of the tops are read until they fall.

ALONG, RESONANCE_U = 0.97, 0.04
#: β where a tilted top floats above this base.
BETAS = (2.2, 4.6)
#: First readings; the others end anywhere up to so far above the fall, with no fewer readings.
FIRST_HZ, ABOVE_HZ, FEWEST = (34.0, 42.0), 15.0, 8
INTERVAL_S, GATE_S, STEPS = 10.0, 2.0, 200
#: A top that leans more [rad], is farther from the axis, or lower [m], has fallen.
FALLEN_RAD, FALLEN_M, FALLEN_HEIGHT_M = 0.4, 0.01, 0.062


@cache
def integrator() -> Any:
    """Return the integrator; parameters: the moment's part across the axis, the drag's constant, μ/m, I₁ and I₃."""
    body = hy.make_vars("ex", "ey", "ez")
    n, momentum = hy.make_vars(*VARIABLES)[6:9], hy.make_vars(*VARIABLES)[9:]
    across, constant, pull, i1, i3 = (hy.par[k] for k in range(5))
    moment = tuple(ALONG * a + across * e for a, e in zip(n, body, strict=True))
    spin = sum(a * p for a, p in zip(n, momentum, strict=True)) / i3
    equations = dict(heyoka_system(pull, moment))
    for axis, p in zip(n, momentum, strict=True):
        equations[p] = equations[p] - constant * i3 * spin**1.5 * axis
    turning = [p / i1 + (1 - i3 / i1) * spin * a for p, a in zip(momentum, n, strict=True)]
    equations |= {**across_of(n, turning), **across_of(body, turning)}
    names = [*hy.make_vars(*VARIABLES), *body]
    return hy.taylor_adaptive([(name, equations[name]) for name in names], np.ones(15), tol=1e-10, fast_math=True)


def across_of(vector: Any, turning: Any) -> dict[Any, Any]:
    """Return the rates of a vector that turns with the body: ω × vector."""
    (x, y, z), (wx, wy, wz) = vector, turning
    return {x: wy * z - wz * y, y: wz * x - wx * z, z: wx * y - wy * x}


def on_axis(z: float) -> Any:
    """Return B, B' and B″ on the axis of the base, to their common sign."""
    rings = ((A2, 1.0), (B2, -1.0))
    return sum(
        sign * a2 * K * np.array([1, -3 * z / (u := a2 + z * z), (15 * z * z / u - 3) / u]) * u**-1.5
        for a2, sign in rings
    )


@dataclass(frozen=True)
class Drawn:
    """A top and its base, drawn as the analysis expects them."""

    height: float
    mass: float
    i1: float
    i3: float
    pull: float  # P = |μ|B
    tilt: float
    nutation: Any  # angle [rad] along x and y
    first_hz: float


def draw_top(by: np.random.Generator) -> Drawn:
    """Draw tilt and nutation; β, which says where it floats; ν_r and κ, which say its moments of inertia."""
    top = THESIS_TOP
    tilt = math.atan(math.sqrt(by.exponential(TILT2)))
    share, turn = max(by.normal(SHARE, SHARE_U), 0.0), np.exp(1j * by.uniform(0, 2 * math.pi))
    beta = float(np.clip(by.normal(top.beta, top.beta_u), *BETAS))
    height = float(brentq(lambda z: (f := on_axis(z))[1] ** 2 / (f[0] * f[2]) - beta, 0.0705, 0.0755))
    flux, slope, _ = np.abs(on_axis(height))
    pull, rate = abs(MU) * ALONG * flux, 2 * math.pi * top.resonance_hz * by.normal(1, RESONANCE_U)
    kappa = by.normal(top.kappa, top.kappa_u)
    i3 = pull / (kappa * rate**2)
    mass, first = abs(MU) * ALONG * slope / G, by.uniform(*FIRST_HZ)
    # set free upright, spinning about its axis: nutation and precession make up for the lean and its rate
    root = math.sqrt(1 - 4 * kappa * (1 - kappa) * (rate / (2 * math.pi * first)) ** 2)
    lean = math.tan(tilt) / ((2 * math.pi * first / rate) ** 2 - 1)
    angle = math.sqrt(share) * lean * (1 - 2 * kappa + root) / (2 * root) * turn
    return Drawn(height, mass, (1 - kappa) * i3, i3, pull, tilt, (angle.real, angle.imag), first)


def start_of(top: Drawn) -> list[float]:
    """Return a top that turns evenly about the vertical, with a free nutation added: (r, v, n, L, e)."""
    rate = 2 * math.pi * top.first_hz
    lean = math.tan(top.tilt) / ((top.i3 - top.i1) * rate**2 / top.pull - 1)
    axis = np.array([math.sin(lean), 0.0, math.cos(lean)])
    momentum = top.i1 * rate * np.array([0, 0, 1.0]) + (top.i3 - top.i1) * rate * axis[2] * axis
    # a nutation alone has I₁ times the precession's rate across the vertical: with less, a precession is in it
    half = top.i3 * rate / (2 * top.i1)
    momentum[:2] += top.i1 * (half - math.sqrt(half**2 - top.pull / top.i1)) * np.array(top.nutation)
    axis[:2] += top.nutation
    axis[2] = math.sqrt(1 - axis[0] ** 2 - axis[1] ** 2)
    body = np.array([1.0, 0.0, 0.0]) - axis[0] * axis
    return [0.0, 0.0, top.height, 0.0, 0.0, 0.0, *axis, *momentum, *(body / np.linalg.norm(body))]


def count_until_it_falls(top: Drawn, constant: float, lean: float) -> Any:
    """Return the counts of gates, until the top has fallen or leans by so much [rad]."""
    solver = integrator()
    solver.time, solver.state[:] = 0.0, start_of(top)
    solver.pars[:] = math.tan(top.tilt) * ALONG, constant, MU / top.mass, top.i1, top.i3
    counted: list[float] = []
    while True:
        begin = INTERVAL_S * len(counted)
        solver.propagate_until(begin)
        states = solver.propagate_grid(begin + np.arange(round(GATE_S * STEPS) + 1) / STEPS)[-1]
        away, leaning = np.hypot(*states[:, :2].T).max(), np.hypot(*states[:, 6:8].T).max()
        if not (leaning < lean and away < FALLEN_M and states[:, 2].min() > FALLEN_HEIGHT_M):
            return np.array(counted)
        turns = np.unwrap(np.arctan2(states[:, 13], states[:, 12])) / (2 * math.pi)
        counted.append(float(turns[-1] - turns[0]) / GATE_S)


def motion(seed: int, folder: Path, lean: float | None) -> list[Pull]:
    """Try the counts of a drawn top that spins down."""
    by = np.random.default_rng((seed, 3))
    top, constant, jitter = draw_top(by), by.uniform(2.0e-4, 2.7e-4), 10 ** by.uniform(-3, -2)
    counted = count_until_it_falls(top, constant, lean or FALLEN_RAD)
    if len(counted) < FEWEST:
        raise TrialFailed("the top falls too soon")
    n = 0
    while n < FEWEST:
        above = 0.0 if lean or by.random() < 0.5 else by.uniform(0, ABOVE_HZ)
        n = int(np.sum(counted >= counted[-1] + above))
    times = GATE_S / 2 + INTERVAL_S * np.arange(n)
    file = write_columns(folder, "time [s],frequency [Hz]", times, counted[:n] + jitter * by.standard_normal(n))
    found = analyze("spindown", file).runs[0]
    return [
        pull_of("disc c32", found.fit("disc").parameters["c32"], constant),
        pull_of("exponent", found.fit("power").parameters["exponent"], 1.5),
    ]


def subjects(lean: float | None) -> tuple[Subject, ...]:
    """Return what is calibrated."""
    return (
        Subject("light by scipy", "the spin of a record", light),
        Subject("field by magpylib", "the base of a scan", field),
        Subject("motion by heyoka", "the drag of a spin-down in full motion", partial(motion, lean=lean)),
    )


def main() -> None:
    """Make the trials, print the table, and write numbers and figure."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--trials", type=int, default=200)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--only", choices=("light", "field", "motion"))
    options.add_argument("--lean", type=float, help="tops are read until they lean by this [rad], not as is drawn")
    given = options.parse_args()
    studies = [
        study_world(subject, given.trials, given.seed, ShareBar(subject.name))
        for subject in subjects(given.lean)
        if subject.name.startswith(given.only or "")
    ]
    print_studies(studies, by_ranks)
    if given.only is None:
        RESULT.write_text(as_json(studies) + "\n", encoding="utf-8")
        FIGURE.parent.mkdir(exist_ok=True)
        save_png(calibration_figure(studies), FIGURE)


if __name__ == "__main__":
    main()
