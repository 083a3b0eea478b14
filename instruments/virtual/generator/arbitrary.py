"""The arbitrary waveforms that a virtual generator holds: built in, and sent to it.

Source: Keysight 33500 Series Operating and Service Guide, DATA subsystem; Agilent 33220A User's Guide, chapter 4.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from instruments.virtual.core.parameters import block_content
from instruments.virtual.core.parser import ScpiError

Samples = NDArray[np.float64]


#: Samples of a built-in waveform: 40 kSa/s after *RST make 160 Hz of it.
_BUILT_IN_POINTS = 250
_NAME = re.compile(r"[A-Z0-9_.\-:\\/]{1,255}")


class DeviceError(ScpiError):
    """An error that only generators have, by its number and its text."""

    def __init__(self, number: int, text: str) -> None:
        self.number, self.entry = number, f'{number:+d},"{text}"'
        Exception.__init__(self, self.entry)


def built_in_waveforms() -> dict[str, Samples]:
    """Return the waveforms in the instrument's own memory, each from −1 to 1, shape (250,)."""
    x = np.linspace(0.0, 1.0, _BUILT_IN_POINTS)
    centred = 12 * (x - 0.5)
    lorentz = 1 / (1 + centred**2)
    beat = (
        np.exp(-(((x - 0.4) / 0.01) ** 2))
        + 0.15 * np.exp(-(((x - 0.3) / 0.03) ** 2))
        + 0.3 * np.exp(-(((x - 0.65) / 0.05) ** 2))
    )
    shapes = {
        "EXP_RISE": 1 - np.exp(-5 * x),
        "EXP_FALL": np.exp(-5 * x),
        "NEG_RAMP": -x,
        "SINC": np.sinc(2 * centred),
        "CARDIAC": beat,
        "GAUSSIAN": np.exp(-(centred**2) / 2),
        "HAVERSINE": (1 - np.cos(2 * np.pi * x)) / 2,
        "LORENTZ": lorentz,
        "D_LORENTZ": np.gradient(lorentz),
    }
    return {name: 2 * (y - y.min()) / np.ptp(y) - 1 for name, y in shapes.items()}


def plain_name(text: str) -> str:
    """Return a waveform's name as the instrument keeps it: no quotes, capitals.  Raises ScpiError.

    >>> plain_name('"test"')
    'TEST'
    """
    name = text.strip("\"'").upper()
    if not _NAME.fullmatch(name):
        raise ScpiError(-224, text[:20])
    return name


def samples(data: Sequence[str], *, full_scale: float, block: str, least: int, most: int) -> Samples:
    """Return the values of a waveform as they were sent, −1 to 1, shape (n,).

    data: numbers as text, or one definite-length block; full_scale: the number that stands for 1; block: NumPy's
    name of the type of a block's numbers; least, most: how many there may be.  Raises ScpiError.
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
    if values.size < least or not np.all(np.abs(values) <= 1 + 1e-6):
        raise ScpiError(-222)
    if values.size > most:
        raise DeviceError(781, "Not enough memory to store new arb waveform; use DATA:DELETE")
    return values


def _from_block(text: str, kind: str) -> Samples:
    data = block_content(text, -102)
    if len(data) % np.dtype(kind).itemsize:
        raise DeviceError(800, "Block length must be even")
    return np.frombuffer(data, dtype=kind).astype(np.float64)


@dataclass
class Memory:
    """The memory for waveforms.

    Attributes:
        room: the number of samples that the memory holds.
        held: the waveforms, by name.
    """

    room: int
    held: dict[str, Samples] = field(default_factory=dict)

    @property
    def free(self) -> int:
        """How many more samples the memory can hold."""
        return self.room - sum(values.size for values in self.held.values())


def attribute(values: Samples, which: str) -> float:
    """Return the property of a waveform that ``DATA:ATTRibute`` answers: AVERage, CFACtor, POINts or PTPeak.

    >>> attribute(np.array([-1.0, 1.0]), "CFAC")
    1.0
    """
    rms = float(np.sqrt(np.mean(values**2)))
    return {
        "AVER": float(values.mean()),
        "CFAC": float(np.abs(values).max()) / rms if rms else 0.0,
        "POIN": float(values.size),
        "PTP": float(np.ptp(values)) / 2,
    }[which]
