"""The true ends of the motions that `levilab benchmark simulator` compares, in extended precision.

heyoka's Taylor method on 80-bit numbers with a tolerance of 1e-18, and once more with 1e-16: how far both lie apart is
printed.  Needs heyoka, and a processor and compiler with such numbers (x86, not Windows).

    pip install 'levilab[peers]'
    python benchmarks/references.py
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import heyoka as hy
import numpy as np

import levilab.benchmark.simulator as room
from as_called import many
from as_called.motions import MOTIONS, UNDRIVEN, Motion, heyoka_start, propagate, system_of
from levilab.benchmark.simulator.motion import MU

Q = np.longdouble
WHERE = Path(room.__file__).parent / "references.json"


def integrator_of(motion: Motion, tolerance: float) -> Any:
    """Return an integrator of one top, on 80-bit numbers."""
    start = heyoka_start(motion).astype(Q)
    system = system_of(motion, each_pull=motion.drive == "off")
    return hy.taylor_adaptive(system, start, tol=Q(tolerance), fp_type=Q, compact_mode=True)


def end(integrator: Any, motion: Motion, duration: float) -> Any:
    """Return the place at the end [m], 80-bit."""
    if motion.drive == "off":
        integrator.pars[0] = Q(MU / motion.mass)
    return propagate(integrator, motion, heyoka_start(motion).astype(Q), duration)


def main() -> None:
    """Write references.json."""
    fine, coarse = {}, {}
    for tolerance, found in ((1e-18, fine), (1e-16, coarse)):
        for name, motion in MOTIONS.items():
            integrator = integrator_of(motion, tolerance)
            found[name] = {f"{duration:g}": end(integrator, motion, duration) for duration in (5.0, 60.0)}
        integrator = integrator_of(UNDRIVEN, tolerance)
        tops = many.tops()
        found["ensemble"] = {str(i): end(integrator, tops[i], many.DURATION) for i in many.COMPARED}
    for name, ends in fine.items():
        apart = max(float(np.abs(place - coarse[name][key]).max()) for key, place in ends.items())
        print(f"{name}: the ends lie apart by at most {apart:.1e} m")
    as_lists = {name: {key: [float(v) for v in place] for key, place in ends.items()} for name, ends in fine.items()}
    ensemble = list(as_lists.pop("ensemble").values())
    text = json.dumps({"places_m": as_lists, "ensemble_m": ensemble}, indent=1)
    WHERE.write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
