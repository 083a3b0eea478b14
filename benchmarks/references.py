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
from levilab.benchmark.simulator.motion import MOTIONS, Motion
from levilab.benchmark.simulator.taylor import heyoka_start, heyoka_system, propagate

Q = np.longdouble
WHERE = Path(room.__file__).parent / "references.json"


def end(motion: Motion, duration: float, tolerance: float) -> Any:
    """The place at the end [m], 80-bit."""
    start = heyoka_start(motion).astype(Q)
    integrator = hy.taylor_adaptive(heyoka_system(motion), start, tol=Q(tolerance), fp_type=Q, compact_mode=True)
    return propagate(integrator, motion, start, duration)


def main() -> None:
    """Write references.json."""
    places: dict[str, dict[str, list[float]]] = {}
    for name, motion in MOTIONS.items():
        for duration in (5.0, 60.0):
            true, other = (end(motion, duration, tolerance) for tolerance in (1e-18, 1e-16))
            print(f"{name}, {duration:g} s: {true}, apart by {np.abs(true - other).max():.1e} m")
            places.setdefault(name, {})[f"{duration:g}"] = [float(v) for v in true]
    WHERE.write_text(json.dumps({"places_m": places}, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
