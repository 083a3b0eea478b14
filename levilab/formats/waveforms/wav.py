"""WAV recordings, as a sound card or a logger writes them."""

import struct
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.formats.columns import TableError
from levilab.formats.waveforms.waveform import BLOCK, Signal, Waveform, check_count

#: Samples of integers → (value of silence, full scale).
_SCALES = {"u1": (128.0, 128.0), "i2": (0.0, 32768.0), "i4": (0.0, 2147483648.0)}
UNIT = "full scale"
_UNREADABLE, _ADVICE = "is no WAV recording that can be read: {advice}", "export it again as PCM or float WAV"


def read_wav(path: Path) -> Waveform:
    """Read a WAV recording; its samples are in parts of full scale, as the file does not know volts.

    Raises:
        TableError: it is damaged, or of a kind that is not read.
        OSError: it cannot be read.
    """
    if _bits(path) == 24:  # three bytes are no type of numpy's
        return _read_three_bytes(path)
    from scipy.io import wavfile

    try:
        with warnings.catch_warnings(action="ignore"):  # chunks that are not samples
            rate, data = wavfile.read(path, mmap=True)
    except (ValueError, struct.error, EOFError, TypeError, ArithmeticError, UnboundLocalError) as error:
        whole, there = _riff_size(path), path.stat().st_size
        if there < whole < _NO_SIZE:
            what = "is cut off: it holds {there} of {whole} bytes; copy it again, or open it in Audacity and save it"
            raise TableError(path, what, there, whole) from error
        raise TableError(path, _UNREADABLE, _ADVICE) from error
    return _waveform(path, rate, data)


#: What a program writes that does not know the size yet, and could not come back to it, as ffmpeg into a pipe.
_NO_SIZE = 8 + 0xFFFFFFFF


def _riff_size(path: Path) -> int:
    """Return the size of a file by its header; big-endian files, which are rare, have none here."""
    with path.open("rb") as stream:
        head = stream.read(8)
    return 8 + int.from_bytes(head[4:], "little") if head.startswith(b"RIFF") else 0


def _waveform(path: Path, rate: int, data: NDArray[Any]) -> Waveform:
    kind = data.dtype.str[1:]
    if kind not in {*_SCALES, "f4", "f8"}:
        raise TableError(path, "has samples of the kind {kind:s}: {advice}", str(data.dtype), _ADVICE)
    if rate <= 0:
        raise TableError(path, "says a rate of {rate} Hz: {advice}", rate, _ADVICE)
    check_count(path, len(data))
    zero, full = _SCALES.get(kind, (0.0, 1.0))
    columns = data.reshape(len(data), -1)

    def read(signal: int) -> Iterator[Array]:
        for k in range(0, len(columns), BLOCK):
            block = (columns[k : k + BLOCK, signal].astype(np.float64) - zero) / full
            if not bool(np.isfinite(block).all()):
                what = "has samples that are no numbers from sample {k} on: cut them off, or {advice}"
                raise TableError(path, what, k, _ADVICE)
            yield block

    return Waveform(path, "WAV", 0.0, 1 / rate, len(data), signals_of(columns.shape[1]), read)


def signals_of(channels: int) -> tuple[Signal, ...]:
    """Return the channels of a sound, by their number."""
    names = {1: ("mono",), 2: ("left", "right")}.get(channels, tuple(f"CH{k + 1}" for k in range(channels)))
    return tuple(Signal(name, UNIT) for name in names)


def _bits(path: Path) -> int:
    """Return the bits of a sample, 0 where they are not found; the format is the first chunk of nearly all files."""
    with path.open("rb") as stream:
        head = stream.read(4096)
    place = head.find(b"fmt ")
    if place < 0 or len(head) < place + 24:
        return 0
    return int(struct.unpack_from("<H", head, place + 22)[0])


def _read_three_bytes(path: Path) -> Waveform:
    channels = rate = start = 0
    with path.open("rb") as stream:
        stream.seek(12)
        while not start and len(chunk := stream.read(8)) == 8:
            name, size = struct.unpack("<4sI", chunk)
            if name == b"data":
                start = stream.tell()
            elif name == b"fmt ":
                _, channels, rate = struct.unpack("<HHI", stream.read(8))
                size -= 8
            stream.seek(size + size % 2, 1)
    if not (start and channels and rate):
        raise TableError(path, _UNREADABLE, _ADVICE)
    count = min(size, path.stat().st_size - start) // (3 * channels)
    check_count(path, count)
    data = np.memmap(path, np.uint8, "r", start, (count, channels, 3))

    def read(signal: int) -> Iterator[Array]:
        for k in range(0, count, BLOCK):
            three = data[k : k + BLOCK, signal].astype(np.int32)
            value = three[:, 0] | three[:, 1] << 8 | three[:, 2] << 16
            yield (value - ((value & 0x800000) << 1)) / 8388608.0

    return Waveform(path, "WAV", 0.0, 1 / rate, count, signals_of(channels), read)
