"""How long a minute of sound at 48 kS/s takes from the file to the spin in each window, against one FFT of all of it.

``python benchmarks/minute_of_sound.py`` writes benchmarks/results/minute_of_sound.json: processor time [s], the best of
interleaved rounds in one warm process, of `levilab.analyze` as it is called, of reading and analyzing alone, and of
scipy.io.wavfile.read with one numpy FFT.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.io import wavfile

from levilab.pipelines.options import SpinOptions
from levilab.pipelines.spin.document import SPIN
from levilab.pipelines.spin.readings import read_spin_file, track_of_record

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from support.detector import coasting_turns, pulses, write_wav

if TYPE_CHECKING:
    from collections.abc import Callable

RESULTS = Path(__file__).parent / "results" / "minute_of_sound.json"
RATE, SECONDS, ROUNDS = 48_000, 60, 7


def spent(task: Callable[[], object]) -> float:
    """Return the time of the processor that a task takes [s]."""
    start = time.process_time()
    task()
    return time.process_time() - start


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = write_wav(Path(folder) / "minute.wav", pulses(coasting_turns(np.arange(SECONDS * RATE) / RATE)), RATE)

        def read_and_track() -> object:
            record = read_spin_file(path, SpinOptions()).waveforms[0]
            return track_of_record(record, None, 2.0, "auto")

        tasks = {
            "as called": lambda: SPIN.analyze([path]),
            "read and analyzed": read_and_track,
            "wavfile.read and one FFT": lambda: np.abs(np.fft.rfft(wavfile.read(path)[1])),
        }
        rounds = [{name: spent(task) for name, task in tasks.items()} for _ in range(ROUNDS)]
    best = {name: min(one[name] for one in rounds) for name in tasks}
    best["ratio"] = best["as called"] / best["wavfile.read and one FFT"]
    print(best)
    RESULTS.write_text(json.dumps(best, indent=2) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
