"""What the codecs of phones do to the frequency of a recorded spin: synthetic records, each encoded and decoded.

``python benchmarks/sound_codecs.py`` writes benchmarks/results/sound_codecs.json.  A record is six seconds of a tape's
light pulses at a sound card, 48 kS/s, 16 bits, noise of 2 % of the pulse.  No phone was tried: the filters and the gain
control of its microphone are not in it.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import imageio_ffmpeg
import numpy as np

from analysis.pulses import spin_of_trace
from levilab.formats.waveforms.record import read_record

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from support.detector import pulses, write_wav

RESULTS = Path(__file__).parent / "results" / "sound_codecs.json"
RATE, SECONDS, RECORDS = 48_000, 6.0, 40
#: Spin in the middle of the record [Hz] and its slope [Hz/s]; the bend is that of a disc's drag.
LOWEST_HZ, HIGHEST_HZ, SLOPE_HZ_S = 25.0, 38.0, -0.1
CODECS = {
    "WAV": (".wav", ""),
    "FLAC": (".flac", ""),
    "AAC, 128 kbit/s": (".m4a", "-c:a aac -b:a 128k"),
    "AAC, 64 kbit/s": (".m4a", "-c:a aac -b:a 64k"),
    "MP3, 128 kbit/s": (".mp3", "-b:a 128k"),
    "Vorbis, quality 3": (".ogg", "-c:a libvorbis"),
    "Opus, 64 kbit/s": (".opus", "-c:a libopus -b:a 64k"),
    "Opus, 24 kbit/s": (".opus", "-c:a libopus -b:a 24k"),
    "AMR, 12.2 kbit/s": (".amr", "-ar 8000 -c:a libopencore_amrnb -b:a 12.2k"),
}


def study(folder: Path) -> dict[str, dict[str, float]]:
    """Return for each codec: root mean squares of the error [Hz], of u and of the difference to the WAV, and pulls."""
    random = np.random.default_rng(1)
    time = np.arange(round(SECONDS * RATE)) / RATE - SECONDS / 2
    rows: dict[str, list[tuple[float, float, float]]] = {name: [] for name in CODECS}
    for seed in range(RECORDS):
        middle = random.uniform(LOWEST_HZ, HIGHEST_HZ)
        bend = 1.5 * SLOPE_HZ_S**2 / middle
        turns = random.uniform() + middle * time + SLOPE_HZ_S * time**2 / 2 + bend * time**3 / 6
        source = write_wav(folder / "record.wav", 0.8 * pulses(turns, seed=seed), RATE)
        of_wav = 0.0
        for name, (suffix, options) in CODECS.items():
            made = source if suffix == ".wav" else folder / f"coded{suffix}"
            if made is not source:
                words = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-v", "error", "-i", source, *options.split(), made]
                subprocess.run(words, check=True)
            record = read_record(made)
            found = spin_of_trace(record.samples(), record.rate, start=-SECONDS / 2)
            # a codec's delay moves the times: the slope moves the frequency with them, by 0.1 Hz/s
            value = found.frequency.value - SLOPE_HZ_S * found.reference_time
            of_wav = value if made is source else of_wav
            rows[name].append((value - middle, found.frequency.u, value - of_wav))
    done = {}
    for name, found in rows.items():
        error, u, beside = np.array(found).T
        done[name] = {
            "rms_error_hz": float(np.sqrt(np.mean(error**2))),
            "rms_u_hz": float(np.sqrt(np.mean(u**2))),
            "rms_beside_wav_hz": float(np.sqrt(np.mean(beside**2))),
            "pull_sd": float(np.std(error / u)),
            "covered": float(np.mean(np.abs(error) < u)),
        }
    return done


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        done = study(Path(folder))
    for name, row in done.items():
        print(f"{name:20}", *(f"{key} {value:.3g}" for key, value in row.items()))
    text = json.dumps({"records": RECORDS, "seconds": SECONDS, "rate_hz": RATE, "codecs": done}, indent=2)
    RESULTS.write_text(text + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
