"""How long a command takes to start, against importing the library that its command line is made of.

``python benchmarks/startup.py`` prints a table: the best and the median of interleaved runs, in time of the processor,
which other programs at work hardly change (on Windows, which does not count it for ended processes, on the wall).
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

try:
    import resource
except ImportError:
    resource = None

RUNS = 25
BASE = [sys.executable, "-c", "import typer"]
#: The help of an application of two commands that do nothing: no help of typer's is faster.
LEAST = """
import typer
app = typer.Typer()
@app.command()
def one() -> None: ...
@app.command()
def two() -> None: ...
app(["--help"])
"""
COMMANDS = (
    ["--help"],
    ["--version"],
    ["acquire", "spin", "--help"],
    ["analyze", "spindown", "--help"],
    ["runs", "sample_data"],
)
LEVILAB = [sys.executable, "-m", "levilab"]


def clock() -> float:
    """Seconds that the processor spent on the programs that this one called."""
    if resource is None:
        return time.perf_counter()
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def seconds(command: list[str]) -> float:
    start = clock()
    subprocess.run(command, check=True, capture_output=True)
    return clock() - start


def main() -> None:
    print(f"{'command':36} {'best, median [ms]':>18} {'python -c import typer':>24} {'ratios':>11}")
    named = {"two empty commands --help": [sys.executable, "-c", LEAST]}
    named |= {" ".join(["levilab", *words]): [*LEVILAB, *words] for words in COMMANDS}
    for name, command in named.items():
        seconds(command)
        pairs = [(seconds(command), seconds(BASE)) for _ in range(RUNS)]
        ours, base = zip(*pairs, strict=True)
        best, usual = (min(ours), statistics.median(ours)), (min(base), statistics.median(base))
        ratios = ", ".join(f"{a / b:.2f}" for a, b in zip(best, usual, strict=True))
        shown = [f"{1e3 * a:.0f}, {1e3 * b:.0f}" for a, b in (best, usual)]
        print(f"{name:36} {shown[0]:>18} {shown[1]:>24} {ratios:>11}")


if __name__ == "__main__":
    main()
