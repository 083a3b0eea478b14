"""The picture of an oscilloscope's screen, as PNG or BMP."""

import io
from collections.abc import Mapping

import numpy as np
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


def picture_file(picture: Picture, form: str) -> bytes:
    """Return the screen as a file: PNG, BMP24, or BMP8 with the 216 colours of a cube of six."""
    from PIL import Image  # takes a moment to load

    image = Image.fromarray(picture)
    if form == "BMP8":
        image = image.convert("P", palette=Image.Palette.WEB, dither=Image.Dither.NONE)
    file = io.BytesIO()
    image.save(file, form[:3])
    return file.getvalue()
