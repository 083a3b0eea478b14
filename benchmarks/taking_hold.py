"""How often the drive takes hold of a top that points anywhere (docs/decisions/0022-telemetry.md).

    python benchmarks/taking_hold.py            # 100 spin-downs, some CPU minutes; writes results/taking_hold.json

The top of the scene `practice` is left alone for a time that is drawn from 1 to 60 s, so that it spins at 24 to 30 Hz
and points anywhere; then a spin-down is acquired with the settings of `levilab live --mock`, up to its first readings.
The virtual clock jumps, so that nothing depends on the machine.
"""

from __future__ import annotations

import argparse
import json
import random
import tempfile
from collections import Counter
from pathlib import Path

from instruments.clock import VirtualClock
from levilab.acquisition.driving import DidNotFollow
from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_at
from levilab.bench.config import Limits
from levilab.live.desk import EXPERIMENTS
from levilab.present.progress import Display
from levilab.runs.run import Run
from levilab.simulator.scene import read_scene
from levilab.world.bench import scene_world, virtual_wiring

RESULTS = Path(__file__).parent / "results"


def tries_of_a_run(seed: int, alone_s: float, out: Path) -> int | None:
    """Return how many tries the drive lost the top in; None where it lost it in all of them.

    Args:
        seed: of the light's noise.
        alone_s: how long the top spins freely before [s].
        out: an empty folder.
    """
    clock, scene = VirtualClock(), read_scene("practice")
    world = scene_world(scene, lambda: clock, lambda _: None)
    clock.sleep(alone_s)
    options = AcquisitionOptions(mock=True, out=out, seed=seed, settings=(*EXPERIMENTS["spin"], "spin.longest_s=4"))
    try:
        acquire(request_at(virtual_wiring(world, Limits()), scene, "spin", options), Display())
    except DidNotFollow:
        return None
    (folder,) = out.iterdir()
    return sum(event["kind"] == "not held" for event in Run.load(folder).events())


def main() -> None:
    """Acquire the runs and print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    runs: int = parser.parse_args().runs
    times = random.Random(1)
    lost: Counter[int | None] = Counter()
    for seed in range(runs):
        with tempfile.TemporaryDirectory() as out:
            lost[tries_of_a_run(seed, times.uniform(1.0, 60.0), Path(out))] += 1
        print(f"\r{seed + 1} of {runs}", end="", flush=True)
    failed = lost.pop(None, 0)
    by_tries = {str(tries): count for tries, count in sorted(lost.items(), key=str)}
    found = {"runs": runs, "failed": failed, "runs_by_tries_lost": by_tries}
    (RESULTS / "taking_hold.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(f"\n{json.dumps(found)}")


if __name__ == "__main__":
    main()
