"""How long ten seconds of film take, 1920 × 1080 at 240 pictures in a second, from the file to spin and places.

``python benchmarks/film.py`` films a simulated top, which takes some minutes, and writes benchmarks/results/film.json:
time by the clock and of the processor [s] of `levilab.analyze` as it is called, and of decoding alone.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import av

import levilab
from levilab.animation.camera import Camera, film, flight_of, phone_times
from levilab.simulator.scene import preset

if TYPE_CHECKING:
    from collections.abc import Callable

RESULTS = Path(__file__).parent / "results" / "film.json"
SECONDS = 10.0
#: The base fills most of the height, as in a film of a phone above it.
CAMERA = Camera(width=1920, height=1080, scale=0.1e-3, line_time=10e-6, noise=4.0)
#: A top that stays up.
SCENE = {"top.mass_kg": 0.0253, "start.spin_hz": 32.0, "start.position_m": [0.0005, 0.0, 0.073]}


def decode(path: Path) -> None:
    """Decode all pictures, in as many threads as the analysis has."""
    with av.open(str(path)) as file:
        file.streams.video[0].thread_type = "AUTO"
        for _ in file.decode(video=0):
            pass


def spent(task: Callable[[], object]) -> dict[str, float]:
    """Return what a task takes."""
    clock, processor = time.perf_counter(), time.process_time()
    task()
    return {"clock_s": time.perf_counter() - clock, "processor_s": time.process_time() - processor}


def main(seconds: float = SECONDS) -> None:
    with tempfile.TemporaryDirectory() as folder:
        flight = flight_of(preset("undriven").changed(SCENE), seconds)
        path = film(Path(folder) / "top.mp4", CAMERA, flight, phone_times(seconds))
        found = {
            "film_s": seconds,
            "film_mb": path.stat().st_size / 1e6,
            "analyze": spent(lambda: levilab.analyze(path, base_m=0.092)),
            "decode": spent(lambda: decode(path)),
        }
    print(json.dumps(found, indent=2))
    if seconds == SECONDS:
        RESULTS.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
