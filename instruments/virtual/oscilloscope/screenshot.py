"""The picture of an oscilloscope's screen, as PNG or BMP."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    Picture = NDArray[np.uint8]

WIDTH, HEIGHT = 800, 480
_GRID = (60, 60, 60)
_COLOURS = {1: (255, 255, 0), 2: (0, 255, 255), 3: (255, 0, 255), 4: (64, 128, 255)}


def draw(traces: Mapping[int, NDArray[np.float64]], *, columns: int) -> Picture:
    """Return the screen, shape (HEIGHT, WIDTH, 3).

    traces: by channel, one height per column of the screen from 0, the lower edge, to 1; columns: of the grid.
    """
    screen = np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)
    screen[:, np.linspace(0, WIDTH - 1, columns + 1).astype(int)] = _GRID
    screen[np.linspace(0, HEIGHT - 1, 9).astype(int)] = _GRID
    for channel, heights in traces.items():
        row = ((1 - np.clip(heights, 0, 1)) * (HEIGHT - 1)).astype(int)
        before = np.concatenate((row[:1], row[:-1]))
        for column, (low, high) in enumerate(zip(np.minimum(row, before), np.maximum(row, before), strict=True)):
            screen[low : high + 1, column] = _COLOURS.get(channel, (255, 255, 255))
    return screen


def grey(picture: Picture) -> Picture:
    """Return the same screen without colours."""
    return np.repeat(picture.max(axis=2, keepdims=True), 3, axis=2)


def png(picture: Picture) -> bytes:
    """Return a PNG file (ISO/IEC 15948): eight bits per colour."""
    height, width, _ = picture.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # each row begins with its filter, 0: none
    rows[:, 1:] = picture.reshape(height, -1)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in (
            (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
            (b"IDAT", zlib.compress(rows.tobytes())),
            (b"IEND", b""),
        )
    )


def bmp24(picture: Picture) -> bytes:
    """Return a BMP file with 24 bits per pixel; rows from below, blue first."""
    height, width, _ = picture.shape
    pixels = picture[::-1, :, ::-1].tobytes()  # 800 pixels of 3 bytes need no padding
    return _bmp_head(width, height, 24, 54, len(pixels)) + pixels


def bmp8(picture: Picture) -> bytes:
    """Return a BMP file with 8 bits per pixel and the 216 colours of a cube of six."""
    height, width, _ = picture.shape
    levels = np.arange(216)
    palette = np.zeros((256, 4), np.uint8)
    for place, weight in enumerate((1, 6, 36)):  # blue, green, red
        palette[:216, place] = levels // weight % 6 * 51
    index = (picture[::-1].astype(int) + 25) // 51 @ np.array([36, 6, 1])
    pixels: bytes = index.astype(np.uint8).tobytes()
    return _bmp_head(width, height, 8, 54 + 1024, len(pixels)) + palette.tobytes() + pixels


def _bmp_head(width: int, height: int, bits: int, offset: int, size: int) -> bytes:
    return struct.pack("<2sIHHI", b"BM", offset + size, 0, 0, offset) + struct.pack(
        "<IiiHHIIiiII", 40, width, height, 1, bits, 0, size, 0, 0, 0, 0
    )
