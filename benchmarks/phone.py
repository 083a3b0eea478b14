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
from pathlib import Path

import numpy as np

from analysis.errors import AnalysisError
from analysis.rotation import spin_of_field, track_of_field
from analysis.rotation.synthetic import synthetic_field, synthetic_flight
from levilab.pipelines.options import SpinOptions
from levilab.pipelines.spin.magnetometer import read_field_record

RESULTS = Path(__file__).parent / "results" / "phone.json"
SEED = 20261124


def scatter(snr_db: float, records: int) -> dict[str, float]:
    """Return errors over the bound and over u, of frequencies and slopes."""
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
        rows.append((error / found.bound, error / found.u_frequency, slope / found.u_chirp, found.u_frequency))
    by_bound, pull, slope_pull, u = np.array(rows).T
    return {
        "snr_db": snr_db,
        "records": records,
        "refused": records - len(rows) - folded,
        "folded": folded,
        "rmse_over_bound": float(np.sqrt(np.mean(by_bound**2))),
        "covered": float(np.mean(np.abs(pull) < 1)),
        "slopes_covered": float(np.mean(np.abs(slope_pull) < 1)),
        "bias_over_u": float(np.mean(pull)),
        "u_mhz": 1e3 * float(np.median(u)),
    }


def hour() -> dict[str, float]:
    """Return how long an hour at 100 Hz takes, reading and analysis apart [s]."""
    times, field, _ = synthetic_flight(np.random.default_rng(SEED), duration=3600.0, loss=1.5e-4)
    track_of_field(times[:2000], field[:2000])
    start = time.process_time()
    track = track_of_field(times, field)
    analyzed = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hour.csv"
        titles = ",".join(["Time (s)", *(f"Magnetic Field {axis} (µT)" for axis in "xyz")])
        rows = np.column_stack([times, 1e6 * field])
        np.savetxt(path, rows, fmt="%.9E", delimiter=",", header=titles, comments="", encoding="utf-8")
        begin = time.process_time()
        read_field_record(path, SpinOptions())
        read = time.process_time()
    return {"windows": len(track.time), "analysis_s": analyzed - start, "reading_s": read - begin}


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
