"""Long records are read and followed in pieces: memory holds a window of them, not the file."""

import tracemalloc
import wave

import numpy as np
import pytest

from analysis.pulses import track_of_blocks
from levilab.formats.waveforms.record import read_record

RATE = 20_000
#: Windows of 2 s in the shorter record, which is two blocks of 131072 samples, and in the longer one.
SHORT, LONG = 7, 21

TURNS = 30 * np.arange(2 * RATE) / RATE
#: Two seconds of light pulses at 30 Hz, with noise; a record repeats them.
PIECE = 0.5 * np.exp(-0.5 * ((TURNS % 1 - 0.5) / 0.0127) ** 2)
PIECE += 0.01 * np.random.default_rng(1).standard_normal(PIECE.size)


def write_npy(path, pieces):
    np.save(path, np.tile(PIECE.astype(np.float32), pieces))


def write_wav(path, pieces):
    with wave.open(str(path), "wb") as sound:
        sound.setparams((1, 2, RATE, 0, "NONE", ""))
        for _ in range(pieces):
            sound.writeframes((32767 * PIECE).astype("<i2").tobytes())


def write_csv(path, pieces):
    text = "".join(f"{value:.4f}\n" for value in PIECE)
    with path.open("w", encoding="utf-8") as file:
        file.write("V\n")
        for _ in range(pieces):
            file.write(text)


def peak(path):
    """Bytes that reading and following a record takes at most."""
    tracemalloc.start()
    try:
        record = read_record(path, rate=float(RATE))
        track = track_of_blocks(record.blocks(), float(RATE), method="edges")
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert track.time.size == record.count // (2 * RATE)
    return most


@pytest.mark.parametrize("kind", ["npy", "wav", "csv"])
def test_memory_does_not_grow_with_the_length_of_a_record(tmp_path, kind):
    write = {"npy": write_npy, "wav": write_wav, "csv": write_csv}[kind]
    write(tmp_path / f"short.{kind}", SHORT)
    write(tmp_path / f"long.{kind}", LONG)
    peak(tmp_path / f"short.{kind}")  # what is imported is not held by the record
    short, long = peak(tmp_path / f"short.{kind}"), peak(tmp_path / f"long.{kind}")
    # the track itself has some 3 kB for each window of 2 s, which are 40 000 samples of 8 bytes
    assert long < 1.2 * short
