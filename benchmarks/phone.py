"""How well the spin is known from a phone's magnetometer (docs/phone.md), and how fast a long record is analyzed.

    python benchmarks/phone.py            # 1000 records a row, three CPU minutes; writes results/phone.json

Records of 10 s at 100 Hz, times that jitter by 0.3 ms, three axes with offset, drift, mains of 50 Hz, three slow swings
and precession; spins from 22 to 45 Hz, which lose 0.2 to 0.4 % a second by a law whose power is 1 to 2.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
import timeit
from pathlib import Path

import numpy as np

import levilab
from analysis.errors import AnalysisError
from analysis.rotation import spin_of_field
from levilab.pipelines.options import SpinOptions
from levilab.pipelines.spin.magnetometer import read_field_record
from phone_records import frequency_bounds, synthetic_field, synthetic_flight

RESULTS = Path(__file__).parent / "results" / "phone.json"
SEED = 20261124


def scatter(snr_db: float, records: int) -> dict[str, float]:
    """Return errors over the bounds and over u, of frequencies and slopes.

    The bounds are those of the truth, with the drag's law known and unknown.
    """
    random = np.random.default_rng((SEED, round(100 + snr_db)))
    rows, folded = [], 0
    for _ in range(records):
        frequency = random.uniform(22, 45)
        chirp = -random.uniform(2e-3, 4e-3) * frequency
        made = synthetic_field(random, frequency=frequency, chirp=chirp, snr_db=snr_db, bend=random.uniform(1, 2))
        try:
            found = spin_of_field(*made)
        except AnalysisError:
            continue
        if abs(found.frequency - frequency) > 1:
            folded += 1
            continue
        error, slope = found.frequency - frequency, found.chirp - chirp
        bounds = np.array(frequency_bounds(made[0], frequency, chirp, snr_db))
        rows.append((*error / bounds, error / found.u_frequency, slope / found.u_chirp, found.u_frequency))
    by_known, by_bound, pull, slope_pull, u = np.array(rows).T
    return {
        "snr_db": snr_db,
        "records": records,
        "refused": records - len(rows) - folded,
        "folded": folded,
        "rmse_over_bound": float(np.sqrt(np.mean(by_bound**2))),
        "rmse_over_bound_of_known_law": float(np.sqrt(np.mean(by_known**2))),
        "covered": float(np.mean(np.abs(pull) < 1)),
        "slopes_covered": float(np.mean(np.abs(slope_pull) < 1)),
        "bias_over_u": float(np.mean(pull)),
        "u_mhz": 1e3 * float(np.median(u)),
    }


def hour() -> dict[str, float]:
    """Return the processor time of `levilab.analyze` of a file with an hour at 100 Hz, and of its reading alone [s].

    Each is the least of five, since other programs only make it longer.
    """
    times, field, _ = synthetic_flight(np.random.default_rng(SEED), duration=3600.0, loss=1.5e-4)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hour.csv"
        titles = ",".join(["Time (s)", *(f"Magnetic Field {axis} (µT)" for axis in "xyz")])
        rows = np.column_stack([times, 1e6 * field])
        np.savetxt(path, rows, fmt="%.9E", delimiter=",", header=titles, comments="", encoding="utf-8")
        calls = {
            "analyze_s": lambda: levilab.analyze(path, "spin"),
            "reading_s": lambda: read_field_record(path, SpinOptions()),
        }
        return {name: min(timeit.repeat(call, timer=time.process_time, number=1)) for name, call in calls.items()}


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=1000)
    records = parser.parse_args().records
    found = {"scatter": [scatter(snr, records) for snr in (-4.0, 0.0, 6.0, 12.0, 20.0)], "hour": hour()}
    RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
