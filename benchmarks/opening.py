"""How long a file takes to open: a million rows of CSV against pandas, and a spreadsheet of 10 MB.

``python benchmarks/opening.py`` prints both and writes benchmarks/results/opening.json.  The ratio is that of the
fastest of several turns in one process, in turn with pandas.read_csv of the same file.
"""

import json
import os
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from levilab.formats import texts
from levilab.formats.table import read_table
from levilab.formats.understanding import SPIN
from levilab.software import software_versions

sys.path.insert(0, str(Path(__file__).parents[1] / "sample_data"))
import student_files

HERE = Path(__file__).parent
ROWS, TURNS = 1_000_000, 9
SHEET_ROWS = 480_000  # make 10 MB


def seconds(action: Callable[[], object]) -> float:
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def text_against_pandas(folder: Path) -> dict[str, float]:
    path = folder / "million.csv"
    t = np.linspace(0, 190, ROWS)
    f = 38 - 0.08 * t + np.random.default_rng(2).normal(0, 0.03, ROWS)
    pd.DataFrame({"time_s": t.round(5), "spin_frequency_hz": f.round(5)}).to_csv(path, index=False)
    turns = [(seconds(lambda: pd.read_csv(path)), seconds(lambda: read_table(path))) for _ in range(TURNS)]
    pandas, ours = (min(times) for times in zip(*turns, strict=True))
    return {"megabytes": path.stat().st_size / 1e6, "pandas_s": pandas, "levilab_s": ours, "ratio": ours / pandas}


def spreadsheet(folder: Path) -> dict[str, float]:
    """Take the time of the first opening: later ones find the sheets as text."""
    path = folder / "large.xlsx"
    f = np.random.default_rng(3).uniform(20, 38, SHEET_ROWS)
    rows = [("t [s]", "f [Hz]"), *((0.1 * k, float(x)) for k, x in enumerate(f))]
    student_files.xlsx(path, {"Tabelle1": student_files.block(rows)})
    with zipfile.ZipFile(path) as file:
        unpacked = sum(member.file_size for member in file.infolist())
    times = []
    for _ in range(3):
        texts._texts.cache_clear()
        times.append(seconds(lambda: read_table(path, quantities=SPIN)))
    return {"megabytes": path.stat().st_size / 1e6, "unpacked_megabytes": unpacked / 1e6, "levilab_s": min(times)}


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        result = {
            "csv": text_against_pandas(Path(folder)),
            "xlsx": spreadsheet(Path(folder)),
            "cores": os.cpu_count(),
            "software": software_versions(),
        }
    text = json.dumps(result, indent=1, sort_keys=True)
    print(text)
    (HERE / "results" / "opening.json").write_text(text + "\n", encoding="utf-8", newline="\n")
