"""What an acquisition costs with a view, with none, and without telemetry at all (docs/live.md).

    python benchmarks/telemetry.py            # about two CPU minutes; writes results/telemetry.json

Each line is an acquisition on the virtual bench, whose clock jumps, so that nothing but work takes time; a real bench
waits for its instruments nearly all the time.  The three ways take turns, and of each the least processor time of this
process is kept: the machine may be busy.  The view is a process of its own, which asks 20 times a second.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from levilab.acquisition.loop import acquire
from levilab.acquisition.onlooker import publishing
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.present.progress import Display

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

RESULTS = Path(__file__).parent / "results"
#: Name → experiment, scene and settings: readings every 1.2 s until the top falls.
RUNS = {
    "a top that only spins": ("spin", None, ("spin.interval_s=1.2", "spin.hold_s=0", "spin.drive_frequency_hz=31")),
    "a top in full motion": (
        "spin",
        "practice",
        ("spin.interval_s=1.2", "spin.hold_s=0", "spin.drive_frequency_hz=30.5", "spin.longest_s=60"),
    ),
}
VIEW = """
import sys, time
from pathlib import Path
from levilab.telemetry.address import read_address
from levilab.telemetry.subscriber import Subscriber

count, views = 0, {}
while not Path(sys.argv[1], "over").exists():
    for folder in Path(sys.argv[1]).glob("*-spin-*"):
        if folder not in views and (address := read_address(folder)):
            views[folder] = Subscriber(address)
    count += sum(len(view.receive()) for view in views.values())
    time.sleep(0.02)
print(count)
"""


@contextlib.contextmanager
def no_telemetry(*_: Any) -> Iterator[Callable[[], None]]:
    yield lambda: None


def own_calls(experiment: str, scene: str | None, settings: tuple[str, ...]) -> float:
    """Processor time of all that telemetry does in an acquisition without a view [s], as a share of the whole.

    The calls are counted, and as many made at the end and timed: on a busy machine two acquisitions differ by more.
    """
    spent = 0.0

    @contextlib.contextmanager
    def counted(*about: Any) -> Iterator[Callable[[], None]]:
        nonlocal spent
        calls = 0
        begin = time.process_time()
        with publishing(*about) as look:
            spent += time.process_time() - begin

            def call() -> None:
                nonlocal calls
                calls += 1
                look()

            yield call
            begin = time.process_time()
            for _ in range(calls):
                look()
        spent += time.process_time() - begin

    with tempfile.TemporaryDirectory() as folder:
        whole, _ = cost(Path(folder), experiment, scene, settings, counted)
    return spent / (whole - spent)


def cost(out: Path, experiment: str, scene: str | None, settings: tuple[str, ...], watch: Any) -> tuple[float, int]:
    """Processor time of this process [s] and readings of one acquisition."""
    options = AcquisitionOptions(mock=True, out=out, seed=1, scene=scene, settings=settings)
    begin = time.process_time()
    run = acquire(request_for(experiment, options), Display(), watch)
    return time.process_time() - begin, run.count()


def measure(repeats: int) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, (experiment, scene, settings) in RUNS.items():
        costs: dict[str, list[float]] = {"no telemetry": [], "no view": [], "a view": []}
        readings = messages = 0
        for k in range(repeats + 1):
            ways = [*costs]
            for way in ways[k % 3 :] + ways[: k % 3]:  # none of them always comes after the same one
                with tempfile.TemporaryDirectory() as folder:
                    out, view = Path(folder), None
                    if way == "a view":
                        command = [sys.executable, "-c", VIEW, folder]
                        view = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
                    spent, readings = cost(
                        out, experiment, scene, settings, no_telemetry if way == "no telemetry" else publishing
                    )
                    (out / "over").touch()
                    if view is not None:
                        messages = int(view.communicate()[0])
                    if k:  # the first compiles and imports
                        costs[way].append(spent)
        least = {way: min(values) for way, values in costs.items()}
        found[name] = {
            "own_calls_without_a_view": round(min(own_calls(experiment, scene, settings) for _ in range(5)), 5),
            "readings": readings,
            "messages": messages,
            "cpu_s": {way: round(value, 4) for way, value in least.items()},
            "readings_per_cpu_s": {way: round(readings / value, 1) for way, value in least.items()},
            "ratio": {way: round(value / least["no telemetry"], 4) for way, value in least.items()},
        }
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--out", type=Path, default=RESULTS / "telemetry.json")
    given = parser.parse_args()
    found = measure(given.repeats)
    given.out.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    for name, row in found.items():
        print(f"{name}: {row['readings']} readings, {row['messages']} messages to the view")
        print(f"  its own calls without a view: {100 * row['own_calls_without_a_view']:.2f} % of the acquisition")
        for way, ratio in row["ratio"].items():
            print(f"  {way:14} {row['readings_per_cpu_s'][way]:8.1f} readings per CPU second, {ratio:.3f} of the time")


if __name__ == "__main__":
    main()
