"""How long a command takes to start, against importing the library that its command line is made of.

``python benchmarks/startup.py`` prints a table: medians over interleaved runs, and the ratio pair by pair.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

RUNS = 15
BASE = [sys.executable, "-c", "import typer"]
COMMANDS = (
    ["--help"],
    ["--version"],
    ["acquire", "spin", "--help"],
    ["analyze", "spindown", "--help"],
    ["runs", "sample_data"],
)
LEVILAB = [sys.executable, "-m", "levilab"]


def seconds(command: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - start


def main() -> None:
    print(f"{'command':36} {'median [ms]':>12} {'python -c import typer [ms]':>28} {'ratio':>7}")
    for words in COMMANDS:
        seconds([*LEVILAB, *words])
        pairs = [(seconds([*LEVILAB, *words]), seconds(BASE)) for _ in range(RUNS)]
        ours, base = (1e3 * statistics.median(column) for column in zip(*pairs, strict=True))
        ratio = statistics.median(a / b for a, b in pairs)
        print(f"{'levilab ' + ' '.join(words):36} {ours:12.0f} {base:28.0f} {ratio:7.2f}")


if __name__ == "__main__":
    main()
