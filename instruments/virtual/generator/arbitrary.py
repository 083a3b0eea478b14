"""The arbitrary waveforms of a virtual generator: as they are sent to it, and the one that is there after ``*RST``.

Source: Keysight 33500 Series Operating and Service Guide, DATA subsystem.
"""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from instruments.virtual.core.parameters import block_content
from instruments.virtual.core.parser import ScpiError

Samples = NDArray[np.float64]


#: Samples of the waveform after *RST: 40 kSa/s make 160 Hz of it.  A waveform that is sent has this many at least.
_FIRST_POINTS, _FEWEST = 250, 8
_NAME = re.compile(r"[A-Z0-9_.\-:\\/]{1,255}")


class DeviceError(ScpiError):
    """An error that only generators have, by its number and its text."""

    def __init__(self, number: int, text: str) -> None:
        self.number, self.entry = number, f'{number:+d},"{text}"'
        Exception.__init__(self, self.entry)


def exponential_rise() -> Samples:
    """Return the waveform that is there after ``*RST``, from −1 to 1, shape (250,)."""
    y = 1 - np.exp(-5 * np.linspace(0.0, 1.0, _FIRST_POINTS))
    return np.asarray(2 * y / y[-1] - 1)


def plain_name(text: str) -> str:
    """Return a waveform's name as the instrument keeps it: no quotes, capitals.  Raises ScpiError.

    >>> plain_name('"test"')
    'TEST'
    """
    name = text.strip("\"'").upper()
    if not _NAME.fullmatch(name):
        raise ScpiError(-224, text[:20])
    return name


def samples(data: Sequence[str], *, full_scale: float, block: str, most: int) -> Samples:
    """Return the values of a waveform as they were sent, −1 to 1, shape (n,).

    data: numbers as text, or one definite-length block; full_scale: the number that stands for 1; block: NumPy's
    name of the type of a block's numbers; most: how many there may be.  Raises ScpiError.
    """
    if not data:
        raise ScpiError(-109)
    if data[0].startswith("#"):
        values = _from_block(data[0], block)
    else:
        try:
            values = np.array(data, dtype=np.float64)
        except ValueError:
            raise ScpiError(-104) from None
    values = values / full_scale
    if values.size < _FEWEST or not np.all(np.abs(values) <= 1 + 1e-6):
        raise ScpiError(-222)
    if values.size > most:
        raise DeviceError(781, "Not enough memory to store new arb waveform; use DATA:DELETE")
    return values


def _from_block(text: str, kind: str) -> Samples:
    data = block_content(text, -102)
    if len(data) % np.dtype(kind).itemsize:
        raise DeviceError(800, "Block length must be even")
    return np.frombuffer(data, dtype=kind).astype(np.float64)
