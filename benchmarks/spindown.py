"""Fits per second and accuracy of the spin-down analysis, against lmfit and scipy used plainly, in one run.

``python benchmarks/spindown.py`` prints two tables:

1. One run of 20 readings, all five laws and the straight lines.  The peers get the same laws as plain functions,
   numeric slopes, and the starting values that anyone would take: the first reading, and the published constants.
   "wrong" counts fits whose constant is off the best least-squares solution, found by scipy's least_squares at full
   precision from three starts, by more than a hundredth of its u.
2. A CSV of 1e6 readings, loaded and fitted with all laws.
"""

from __future__ import annotations

import resource
import statistics
import sys
import tempfile
import time
import warnings
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import lmfit
import numpy as np
from scipy.optimize import curve_fit, least_squares

from analysis.spindown.drag import LAWS, spin
from analysis.spindown.fit import fit_spin_down

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

Array: Any = np.ndarray
RUNS = 60
T = 10.0 * np.arange(20)
TAU = 2 * np.pi


def mixed(t: NDArray[np.float64], nu0: float, c1: float, c2: float) -> NDArray[np.float64]:
    e, w = np.exp(-c1 * t), TAU * nu0
    return c1 * nu0 * e / (c1 + c2 * w * (1 - e))


def power(t: NDArray[np.float64], nu0: float, c: float, n: float) -> NDArray[np.float64]:
    return ((TAU * nu0) ** (1 - n) + (n - 1) * c * t) ** (1 / (1 - n)) / TAU


#: name → (the law as one would write it down, starting values after the first reading)
PLAIN: dict[str, tuple[Callable[..., NDArray[np.float64]], list[float]]] = {
    "stokes": (lambda t, nu0, c: nu0 * np.exp(-c * t), [3.2e-3]),
    "newton": (lambda t, nu0, c: 1 / (1 / nu0 + TAU * c * t), [1.7e-5]),
    "disc": (lambda t, nu0, c: nu0 * (1 + c * np.sqrt(TAU * nu0) * t / 2) ** -2.0, [2.3e-4]),
    "mixed": (mixed, [1.6e-3, 8.6e-6]),
    "power": (power, [2.3e-4, 1.51]),
}
NAMES = {"mixed": ["nu0", "c1", "c2"], "power": ["nu0", "c", "n"]}


def ours(nu: NDArray[np.float64]) -> dict[str, float]:
    run = fit_spin_down(T, nu, 0.03)
    return {fit.name: float(fit.parameters[LAWS[fit.name].constants[-1]].value or 0) for fit in run.fits}


def with_curve_fit(nu: NDArray[np.float64]) -> dict[str, float]:
    found = {}
    for name, (law, start) in PLAIN.items():
        found[name] = float(
            curve_fit(law, T, nu, p0=[nu[0], *start], sigma=np.full(20, 0.03), absolute_sigma=True)[0][-1]
        )
    straight_lines(nu)
    return found


def with_lmfit(nu: NDArray[np.float64]) -> dict[str, float]:
    found = {}
    for name, (law, start) in PLAIN.items():
        names = NAMES.get(name, ["nu0", "c"])
        model = lmfit.Model(law, independent_vars=["t"], param_names=names)
        values = dict(zip(names, [nu[0], *start], strict=True))
        result = model.fit(nu, t=T, weights=1 / 0.03, scale_covar=False, **values)
        found[name] = float(result.params[names[-1]].value)
    straight_lines(nu)
    return found


def straight_lines(nu: NDArray[np.float64]) -> None:
    for y in (np.log(nu), 1 / nu, nu**-0.5):
        np.polyfit(T, y, 1, cov=True)


@cache
def _reference(law: str, data: bytes) -> float:
    nu = np.frombuffer(data)
    curve, start = PLAIN[law]
    tries = [
        least_squares(
            lambda p: (curve(T, *p) - nu) / 0.03,
            np.array([nu[0], *start]) * (1 + shift),
            method="lm", x_scale=np.array([nu[0], *start]), xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=5000,
        )
        for shift in (0.0, 0.03, -0.03)
    ]  # fmt: skip
    return float(min(tries, key=lambda found: found.cost).x[-1])


def reference(law: str, nu: NDArray[np.float64]) -> float:
    """Return the constant of the best least-squares solution, found another way."""
    return _reference(law, nu.tobytes())


def one_run() -> None:
    noise = np.random.default_rng(1)
    truth = spin("disc", T, 40.0, 2.34e-4)
    data = [truth + noise.normal(0, 0.03, 20) for _ in range(RUNS)]
    best = [fit_spin_down(T, nu, 0.03) for nu in data]
    peers = {"levilab": ours, "curve_fit": with_curve_fit, "lmfit, plainly": with_lmfit}
    times: dict[str, list[float]] = {name: [] for name in peers}
    wrong = dict.fromkeys(peers, 0)
    for nu, run in zip(data, best, strict=True):
        for name, fit in peers.items():
            start = time.perf_counter()
            found = fit(nu)
            times[name].append(time.perf_counter() - start)
            for law, value in found.items():
                u = run.fit(law).parameters[LAWS[law].constants[-1]].u or np.inf
                wrong[name] += not abs(value - reference(law, nu)) < 0.01 * u
    base = times["levilab"]
    print(f"\none run of 20 readings, five laws and three straight lines, {RUNS} runs\n")
    print(f"{'':16} {'median [ms]':>12} {'fits/s':>8} {'time / levilab':>15} {'wrong of ' + str(5 * RUNS):>14}")
    for name, seconds in times.items():
        median = statistics.median(seconds)
        ratio = statistics.median(a / b for a, b in zip(seconds, base, strict=True))
        print(f"{name:16} {1e3 * median:12.2f} {5 / median:8.0f} {ratio:15.2f} {wrong[name]:14}")


def a_million_readings() -> None:
    import pandas as pd

    from levilab.formats.table import read_table
    from levilab.pipelines.spindown.readings import spin_readings

    t = np.linspace(0, 190, 1_000_000)
    nu = spin("disc", t, 40.0, 2.34e-4) + np.random.default_rng(2).normal(0, 0.03, t.size)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "million.csv"
        pd.DataFrame({"time_s": t, "spin_frequency_hz": nu, "spin_frequency_u_hz": 0.03}).to_csv(path, index=False)
        stages = {"pandas.read_csv alone": lambda: pd.read_csv(path), "levilab: load and check": lambda: load(path)}

        def load(path: Path) -> Any:
            return spin_readings(read_table(path))

        readings = load(path)
        stages["levilab: fit five laws"] = lambda: fit_spin_down(readings.time, readings.frequency, readings.u)
        print(f"\n{t.size} readings, {path.stat().st_size / 1e6:.0f} MB of CSV\n")
        for name, stage in stages.items():
            seconds = []
            for _ in range(3):
                start = time.perf_counter()
                stage()
                seconds.append(time.perf_counter() - start)
            print(f"{name:26} {statistics.median(seconds):6.2f} s")
        run = fit_spin_down(readings.time, readings.frequency, readings.u)
        c = run.fit("disc").parameters["c32"]
        print(f"best law {run.best}; c32 off by {((c.value or 0) - 2.34e-4) / (c.u or 1):+.2f} u")
    if sys.platform != "win32":
        print(f"peak memory of this process {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # the plain laws overflow on their way
    one_run()
    a_million_readings()
