"""NumPy arrays of samples, whose rate is given beside them, or of pulse times."""

from collections.abc import Iterator
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.formats.columns import TableError
from levilab.formats.waveforms.header import NoRate
from levilab.formats.waveforms.waveform import BLOCK, PulseTimes, Signal, Waveform, check_count, check_step
from levilab.texts.note import of_file
from levilab.texts.text import Text

#: An array with more columns than this lies on its side.
MOST_CHANNELS = 64


def read_npy(path: Path, rate: float | None) -> Waveform | PulseTimes:
    """Read samples [V], shape (n,), (n, channels) or (channels, n); without a rate pulse times [s], shape (n,).

    Raises:
        NoRate: it holds no pulse times, and no rate is given.
        TableError: it is damaged.
        OSError: it cannot be read.
    """
    data = _load(path)
    if rate is None:
        return _pulse_times(path, data)
    columns = data.reshape(len(data), -1)
    columns = columns.T if columns.shape[1] > MOST_CHANNELS else columns
    check_count(path, len(columns))
    check_step(path, 1 / rate)

    def read(signal: int) -> Iterator[Array]:
        for k in range(0, len(columns), BLOCK):
            block = columns[k : k + BLOCK, signal].astype(np.float64)
            if not bool(np.isfinite(block).all()):
                raise TableError(path, "has samples that are no numbers from sample {k} on: cut them off", k)
            yield block

    signals = tuple(Signal(f"CH{k + 1}") for k in range(columns.shape[1]))
    text = Text("{name:s}: holds whole numbers, which are taken as V: voltages are in units of a code", path.name)
    counts = (of_file("codes", text),) if data.dtype.kind != "f" else ()
    return Waveform(path, "NumPy array", 0.0, 1 / rate, len(columns), signals, read, counts)


#: What numpy raises for headers of nonsense, which it reads as Python.
_BROKEN = (
    ValueError, EOFError, TypeError, SyntaxError, MemoryError, OverflowError, KeyError, AttributeError, TokenError,
    RecursionError,
)  # fmt: skip


def _load(path: Path) -> NDArray[Any]:
    """Return the array as it lies in the file, which stays there."""
    try:
        data: NDArray[Any] = np.load(path, mmap_mode="r", allow_pickle=False)
    except _BROKEN as error:
        raise TableError(path, "is no NumPy array that can be read: save it again") from error
    if data.dtype.kind not in "iuf" or data.dtype.itemsize > 8:
        what = "holds {kind:s}, plain numbers are expected: save them with numpy.save"
        raise TableError(path, what, str(data.dtype))
    if data.ndim not in {1, 2} or 0 in data.shape or (data.ndim == 2 and min(data.shape) > MOST_CHANNELS):
        what = "has the shape {shape:s}, (samples,) or (samples, channels) is expected: reshape it"
        raise TableError(path, what, str(data.shape))
    return data


def _pulse_times(path: Path, data: NDArray[Any]) -> PulseTimes:
    times = np.array(data, dtype=np.float64)
    if data.ndim != 1 or not bool(np.isfinite(times).all()) or not bool((np.diff(times) > 0).all()):
        raise NoRate(path, "does not say its sampling rate: say `rate` in Hz (pulse times would increase throughout)")
    return PulseTimes(path, "NumPy array of pulse times", times)
