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
from functools import cache, partial
from pathlib import Path
from typing import Any

import heyoka as hy
import magpylib
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import expit

from levilab.benchmark.simulator.motion import A2, B2, I1, I3, MU, G, K
from levilab.benchmark.simulator.taylor import VARIABLES, heyoka_system
from levilab.crosscheck.calibration import by_ranks
from levilab.crosscheck.command import print_studies
from levilab.crosscheck.figure import calibration_figure
from levilab.crosscheck.stored import as_json
from levilab.crosscheck.study import study_world
from levilab.crosscheck.subject import Pull, Subject, pull_of
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


# motion: a top above the thesis's base by heyoka, with a moment that is tilted, a nutation, and the drag of a disc

MASS_KG, ALONG, FIRST_HZ, LAST_HZ = 0.0244, 0.97, 34.0, 24.0
INTERVAL_S, GATE_S, STEPS = 4.0, 2.0, 200
#: The last reading is before the top leans by this; the field is that near the axis.
LEAN_RAD = 0.1


@cache
def integrator() -> Any:
    """Return the integrator; parameters: the moment's part across the axis, the constant of the drag."""
    body = ex, ey, ez = hy.make_vars("ex", "ey", "ez")
    n, momentum = hy.make_vars(*VARIABLES)[6:9], hy.make_vars(*VARIABLES)[9:]
    across, constant = hy.par[0], hy.par[1]
    moment = tuple(ALONG * a + across * e for a, e in zip(n, body, strict=True))
    spin = sum(a * p for a, p in zip(n, momentum, strict=True)) / I3
    equations = dict(heyoka_system(MU / MASS_KG, moment))
    for axis, p in zip(n, momentum, strict=True):
        equations[p] = equations[p] - constant * I3 * spin**1.5 * axis
    wx, wy, wz = (p / I1 + (1 - I3 / I1) * spin * a for p, a in zip(momentum, n, strict=True))
    turning = [(ex, wy * ez - wz * ey), (ey, wz * ex - wx * ez), (ez, wx * ey - wy * ex)]
    system = [(hy.make_vars(name), equations[hy.make_vars(name)]) for name in VARIABLES] + turning
    return hy.taylor_adaptive(system, np.ones(15), tol=1e-10, fast_math=True)


def floating() -> tuple[float, float]:
    """Return the height at which an upright top rests [m], and the field there [T]."""
    rings = ((A2, 1.0), (B2, -1.0))
    field_at = lambda z: K * sum(sign * a2 / (a2 + z * z) ** 1.5 for a2, sign in rings)  # noqa: E731
    slope_at = lambda z: K * sum(-3 * sign * a2 * z / (a2 + z * z) ** 2.5 for a2, sign in rings)  # noqa: E731
    z = float(brentq(lambda z: abs(slope_at(z) * MU) * ALONG - MASS_KG * G, 0.070, 0.080))
    return z, abs(field_at(z))


def motion(seed: int, folder: Path, lean: float) -> list[Pull]:
    """Try the counts of a top that spins down, with tilt and nutation as makers of magnets and the eye allow them."""
    by = np.random.default_rng((seed, 3))
    tilt, constant = by.rayleigh(math.sqrt(0.000915 / 2)), by.uniform(2.0e-4, 2.7e-4)
    jitter = 10 ** by.uniform(-3, -2)
    nutation = by.normal(0, 0.0115 / math.sqrt(2), 2)
    top = integrator()
    top.time = 0.0
    top.pars[:] = math.tan(tilt) * ALONG, constant
    top.state[:] = start_of(tilt, nutation)
    duration = 2 * ((2 * math.pi * LAST_HZ) ** -0.5 - (2 * math.pi * FIRST_HZ) ** -0.5) / constant
    grid = np.arange(math.floor(duration) * STEPS + 1) / STEPS
    states = top.propagate_grid(grid)[-1]
    turns = np.unwrap(np.arctan2(states[:, 13], states[:, 12])) / (2 * math.pi)
    leaning = np.hypot(states[:, 6], states[:, 7]) > lean
    end = grid[np.argmax(leaning)] if leaning.any() else grid[-1]
    first = np.arange(0, end - GATE_S, INTERVAL_S)
    counted = (np.interp(first + GATE_S, grid, turns) - np.interp(first, grid, turns)) / GATE_S
    counted += jitter * by.standard_normal(len(counted))
    file = write_columns(folder, "time [s],frequency [Hz]", first + GATE_S / 2, counted)
    found = analyze("spindown", file).runs[0]
    return [
        pull_of("disc c32", found.fit("disc").parameters["c32"], constant),
        pull_of("exponent", found.fit("power").parameters["exponent"], 1.5),
    ]


def start_of(tilt: float, nutation: Any) -> list[float]:
    """Return a top that turns evenly about the vertical, with a nutation added: (r, v, n, L, e)."""
    z, field_t = floating()
    rate = 2 * math.pi * FIRST_HZ
    x = (I3 - I1) * rate**2 / (abs(MU) * ALONG * field_t)
    lean = math.tan(tilt) / (x - 1)
    axis = np.array([math.sin(lean), 0.0, math.cos(lean)])
    momentum = I1 * rate * np.array([0, 0, 1.0]) + (I3 - I1) * rate * axis[2] * axis
    axis[:2] += nutation
    axis[2] = math.sqrt(1 - axis[0] ** 2 - axis[1] ** 2)
    body = np.array([1.0, 0.0, 0.0]) - axis[0] * axis
    return [0.0, 0.0, z, 0.0, 0.0, 0.0, *axis, *momentum, *(body / np.linalg.norm(body))]


def subjects(lean: float) -> tuple[Subject, ...]:
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
    options.add_argument("--lean", type=float, default=LEAN_RAD, help="the last reading is before this lean [rad]")
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
