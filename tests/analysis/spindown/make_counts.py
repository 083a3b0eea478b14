"""Makes counts.json: what the virtual counter counts of tops in full motion, until they fall.

``python tests/analysis/spindown/make_counts.py``: six tops of ``benchmarks/spindown_motion.py``, of seeds that neither
the analysis nor its study was made with.
"""

import json
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[2] / "benchmarks"))

from spindown_motion import count_until_it_falls, draw_top  # noqa: E402

if __name__ == "__main__":
    rows = []
    for seed in range(700, 706):
        keys = draw_top(np.random.default_rng(seed))
        time, spin = count_until_it_falls(keys, seed)
        rows.append(
            {
                "law": keys["drag.law"],
                "constant": keys["drag.coefficient"],
                "delta_rad": float(np.arctan(keys["top.moment_tilt"][0] / keys["top.moment_tilt"][1])),
                "time_s": time.round(4).tolist(),
                "spin_frequency_hz": spin.round(6).tolist(),
            }
        )
    (HERE / "counts.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
