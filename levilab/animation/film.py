"""Poses → pictures with their numbers, one after another, as a GIF or an MP4."""

from __future__ import annotations

import contextlib
import io
import math
import tempfile
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from levilab.animation.paint import Colour, Painter, Pose, font
from levilab.animation.parts import COLOURS, parts_of
from levilab.animation.poses import Poses, height_for_camera, matrices
from levilab.animation.words import readout, span_text, speed_text
from levilab.errors import LevilabError
from levilab.software import how_to_install

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont, ImageFont

    BaseFont = FreeTypeFont | ImageFont
    Progress = Callable[[float], None]


class MissingEncoder(LevilabError):
    """ffmpeg is not there."""


@dataclass(frozen=True)
class Film:
    """How a film is drawn.

    Attributes:
        poses: some for each picture.
        every: how many for each, so that the path is smooth where the top is fast.
        speed: of the film, as a part of the real one; None for a single picture.
        pictures_per_s: of the film.
        size: width and height [pixels].
        trail_s: as much of the path is drawn [s of the motion].
        theme: "light" or "dark".
    """

    poses: Poses
    speed: float | None
    pictures_per_s: float
    size: tuple[int, int]
    every: int = 1
    trail_s: float = 0.5
    theme: str = "light"

    @property
    def pictures(self) -> range:
        """The poses of its pictures; the last one is that of the end."""
        last = len(self.poses.times) - 1
        return range(last % self.every, last + 1, self.every)


#: Colours of a GIF, beside those of the scene's parts as they are without light.
_COLOURS = 96


def as_gif(film: Film, progress: Progress) -> bytes:
    """Encode a film as a GIF that begins again at its end; all its pictures share one table of colours."""
    from PIL.Image import Dither

    shown, draw = film.pictures, _artist(film)
    samples = [draw(shown[k * (len(shown) - 1) // 3]) for k in range(4)]
    table = table_of_colours(samples, film.theme)

    def pictures() -> Iterator[Image]:
        for done, k in enumerate(shown, 1):
            yield draw(k).quantize(palette=table, dither=Dither.NONE)
            progress(done / len(shown))

    buffer, frames = io.BytesIO(), pictures()
    next(frames).save(
        buffer, "GIF", save_all=True, append_images=frames, duration=round(1000 / film.pictures_per_s), loop=0,
        disposal=1, optimize=False,
    )  # fmt: skip
    return buffer.getvalue()


def table_of_colours(samples: list[Image], theme: str) -> Image:
    """Return an image whose palette has the colours of some pictures and of all small parts."""
    from PIL import Image

    width, height = samples[0].size
    sheet = Image.new("RGB", (width * len(samples), height))
    for k, sample in enumerate(samples):
        sheet.paste(sample, (k * width, 0))
    found = sheet.quantize(_COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE).getpalette() or []
    of_parts = [value for text in COLOURS[theme].values() for value in bytes.fromhex(text[1:])]
    table = Image.new("P", (1, 1))
    table.putpalette(found[: 3 * _COLOURS] + of_parts)
    return table


def check_encoder() -> None:
    """Raise MissingEncoder where no MP4 can be encoded."""
    if find_spec("imageio_ffmpeg") is None:
        raise MissingEncoder(
            "an animation as .mp4 needs the extra video (imageio-ffmpeg, which is not installed): "
            f"{how_to_install('video')}, or name a file that ends in .gif or .html"
        )


#: The same bytes each time: one thread, no dates, no version of the encoder.
_SAME_BYTES = (
    "-threads", "1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1", "-movflags", "+faststart",
)  # fmt: skip


def as_mp4(film: Film, progress: Progress) -> bytes:
    """Encode a film as an MP4 (H.264).  Raises MissingEncoder."""
    check_encoder()
    import imageio_ffmpeg

    shown, draw = film.pictures, _artist(film)
    with tempfile.TemporaryDirectory(prefix="levilab-") as folder:
        path = Path(folder, "film.mp4")
        encoder = imageio_ffmpeg.write_frames(
            str(path), film.size, fps=film.pictures_per_s, codec="libx264", quality=None, macro_block_size=16,
            ffmpeg_log_level="error", output_params=["-crf", "20", "-preset", "medium", *_SAME_BYTES],
        )  # fmt: skip
        with contextlib.closing(encoder):
            encoder.send(None)
            for done, k in enumerate(shown, 1):
                encoder.send(np.asarray(draw(k)).tobytes())
                progress(done / len(shown))
        return path.read_bytes()


def still(film: Film, k: int, *, with_words: bool = True) -> Image:
    """Draw the k-th picture of a film."""
    return _artist(film, with_words=with_words)(k)


def _artist(film: Film, *, with_words: bool = True) -> Callable[[int], Image]:
    poses, parts = film.poses, parts_of(film.poses.scene, height_for_camera(film.poses))
    painter = Painter(parts, film.size, film.theme)
    turns = matrices(poses.quaternions)
    positions = painter.above_ground(poses.positions, poses.axes)
    ends = positions + parts["axis"]["up"] * poses.axes
    before = max(round(film.trail_s / (poses.times[1] - poses.times[0])), 1) if len(poses.times) > 1 else 1
    words = _Words(film, painter)

    def draw(k: int) -> Image:
        sense = int(np.sign(round(float(poses.spins[k]), 3)))
        trail = ends[max(0, k - before) : k + 1]
        pose = Pose(positions[k], turns[k], float(poses.slips[k]), float(poses.drive[k]), sense, trail)
        picture = painter.picture(pose)
        if with_words:
            words.write(picture, k)
        return picture

    return draw


class _Words:
    """What is written on a film, and the path of the centre seen from above.

    Args:
        film: on which it is written.
        painter: whose colours are used.
    """

    def __init__(self, film: Film, painter: Painter) -> None:
        self._film, self._colours = film, painter.colours
        self._unit = min(film.size)
        self._small, self._large = font(self._unit / 36), font(self._unit / 26)
        self._line = self._unit / 25
        speed = film.speed
        self._about = ("simulated",) if speed is None else (
            f"simulated, {speed_text(speed)}", span_text(film.poses)
        )  # fmt: skip
        self._inset = _Inset(film)
        self._veil: Image | None = None

    def write(self, picture: Image, k: int) -> None:
        """Write the numbers of the k-th pose, and draw the path up to then."""
        from PIL import ImageDraw

        pen = ImageDraw.Draw(picture)
        edge, line = self._line, self._line
        text, faint = self._colours["text"], self._colours["faint"]
        name = self._film.poses.scene.name or "scene"
        while len(name) > 4 and pen.textlength(name, self._large) > 0.56 * picture.width:
            name = f"{name[:-2]}…"
        rows = readout(self._film.poses, k)
        first = 0.8 * edge + (2.1 + 1.1 * len(self._about)) * line  # of the numbers
        about = [(0.8 * edge + (1.5 + 1.1 * row) * line, said) for row, said in enumerate(self._about)]
        if self._veil is None:
            widths = [(0.8 * edge, pen.textlength(name, self._large))]
            widths += [(y, pen.textlength(said, self._small)) for y, said in about]
            widths += [(first + 1.2 * row * line, 0.29 * self._unit) for row in range(len(rows))]
            self._veil = self._veil_behind(picture.size, widths)
        picture.paste(self._colours["background"], (0, 0), self._veil)
        pen.text((edge, 0.8 * edge), name, text, self._large)
        for y, said in about:
            pen.text((edge, y), said, faint, self._small)
        for row, (label, value) in enumerate(rows):
            y = first + 1.2 * row * line
            pen.text((edge, y), label, faint, self._small)
            pen.text((edge + 0.29 * self._unit, y), value, text, self._small, anchor="ra")
        self._inset.draw(pen, k, self._colours, self._small)

    def _veil_behind(self, size: tuple[int, int], rows: list[tuple[float, float]]) -> Image:
        """Return the veil over a path behind lines of text, of these heights and widths, and the inset's frame."""
        from PIL import Image, ImageDraw

        veil, edge, line = Image.new("L", size), self._line, self._line
        pen = ImageDraw.Draw(veil)
        for y, width in rows:
            pen.rectangle((edge - line / 3, y - line / 4, edge + width + line / 3, y + line), fill=255)
        pen.rectangle(self._inset.frame, fill=255)
        return veil


class _Inset:
    """The path of the centre of mass from above, in a corner, with its scale."""

    def __init__(self, film: Film) -> None:
        unit = min(film.size)
        self._size = 0.24 * unit
        self._left, self._top = film.size[0] - self._size - unit / 25, 0.075 * unit
        flat = film.poses.positions[:, :2]
        self._middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
        span = max(float(np.ptp(flat, axis=0).max()), 1e-6)
        self._pixels_per_m = 0.86 * self._size / span
        self._bar = nice_length(0.45 * span)
        centre = np.array([self._left + self._size / 2, self._top + self._size / 2])
        self._path = (flat - self._middle) * np.array([1, -1]) * self._pixels_per_m + centre

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """Left, upper, right and lower edge with what is written above and below [pixels]."""
        size = self._size
        return self._left - size / 20, self._top - size / 5, self._left + 1.05 * size, self._top + 1.3 * size

    def draw(self, pen: ImageDraw, k: int, colours: dict[str, Colour], small: BaseFont) -> None:
        left, top, size = self._left, self._top, self._size
        pen.rectangle((left, top, left + size, top + size), outline=colours["faint"])
        pen.line(self._path[: k + 1].ravel().tolist() or [0, 0], fill=colours["path"], width=1)
        x, y = self._path[k]
        pen.ellipse((x - 3, y - 3, x + 3, y + 3), fill=colours["mark"])
        length = self._bar * self._pixels_per_m
        y = top + size + size / 11
        pen.line((left + size - length, y, left + size, y), fill=colours["text"], width=2)
        pen.text((left + size, y + 3), millimetres(self._bar), colours["faint"], small, anchor="ra")
        pen.text((left, top - size / 20), "from above", colours["faint"], small, anchor="ls")


def nice_length(length: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is at most a length.

    >>> [nice_length(x) for x in (0.0037, 0.00051, 0.1)]
    [0.002, 0.0005, 0.1]
    """
    power = math.floor(math.log10(length) + 1e-9)
    step = max(step for step in (1, 2, 5) if step * 10.0**power <= length * (1 + 1e-9))
    return float(f"{step}e{power}")


def millimetres(length: float) -> str:
    """Return a length [m] as text, in mm.

    >>> millimetres(0.002), millimetres(5e-5)
    ('2 mm', '0.05 mm')
    """
    return f"{1000 * length:g} mm"
