"""What a second thread of linear algebra brings: `python benchmarks/threads.py`.

Eigenvalues of symmetric matrices, the steepest use of threads in the analyses, in a process of its own for each number
of threads: the best of five of each in turn, on the clock and in time of the processor.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

ROUNDS = 5
ROWS = (50, 100, 200, 400, 800)
THREADS = (1, 2)


def measure(rows: int) -> tuple[float, float]:
    """Time of `eigvalsh` on the clock and of the processor, the best of several [s]."""
    import numpy as np

    matrix = np.random.default_rng(1).standard_normal((rows, rows))
    matrix = matrix @ matrix.T
    np.linalg.eigvalsh(matrix)
    repeats = max(3, 4000 // rows)
    started = time.perf_counter(), time.process_time()
    for _ in range(repeats):
        np.linalg.eigvalsh(matrix)
    return (time.perf_counter() - started[0]) / repeats, (time.process_time() - started[1]) / repeats


def main() -> None:
    """Print a row for each size of matrices."""
    if len(sys.argv) > 1:
        print(json.dumps(measure(int(sys.argv[1]))))
        return
    print("| rows | " + " | ".join(f"{n} thread{'s' * (n > 1)}: clock | processor" for n in THREADS) + " |")
    for rows in ROWS:
        best = {n: [float("inf")] * 2 for n in THREADS}
        for _ in range(ROUNDS):
            for n in THREADS:
                environment = os.environ | {"OPENBLAS_NUM_THREADS": str(n)}
                words = [sys.executable, __file__, str(rows)]
                done = subprocess.run(words, env=environment, check=True, capture_output=True)
                best[n] = [min(*pair) for pair in zip(best[n], json.loads(done.stdout), strict=True)]
        print(f"| {rows} | " + " | ".join(f"{1e3 * seconds:.3g} ms" for n in THREADS for seconds in best[n]) + " |")


if __name__ == "__main__":
    main()
