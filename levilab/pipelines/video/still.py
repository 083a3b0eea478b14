"""A still: the first picture with the rim, the mark, the base and the path of the centre drawn over it."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from levilab.pipelines.video.analysis import Video

#: Colours of the rim, the path, the mark and the base (Okabe and Ito).
_RIM, _PATH, _MARK, _BASE = "#d55e00", "#56b4e9", "#f0e442", "#009e73"
#: Of the still, at least [pixels].
_LEAST_WIDTH = 640


def draw_still(video: Video) -> bytes:
    """Draw rim, mark, base and path over the first picture, as PNG."""
    from PIL import Image, ImageDraw

    seen = video.followed
    factor = max(-(-_LEAST_WIDTH // video.film.width), 1)
    image = Image.fromarray(np.ascontiguousarray(seen.still)).convert("RGB")
    image = image.resize((factor * image.width, factor * image.height))
    pen = ImageDraw.Draw(image)

    def at(x: float, y: float) -> tuple[float, float]:
        return factor * (x + 0.5), factor * (y + 0.5)

    def circle(x: float, y: float, radius: float, colour: str) -> None:
        (left, up), (right, down) = at(x - radius, y - radius), at(x + radius, y + radius)
        pen.ellipse((left, up, right, down), outline=colour, width=2)

    if seen.base is not None:
        circle(seen.base.x, seen.base.y, seen.base.radius, _BASE)
    circle(seen.x[0], seen.y[0], seen.radius[0], _RIM)
    if not video.problem:
        angle = 2 * np.pi * (video.phases.phase[0] + video.phases.angle)
        reach = seen.radius[0] * np.array([0.35, 1.0])
        inner, outer = (at(seen.x[0] + r * np.cos(angle), seen.y[0] + r * np.sin(angle)) for r in reach)
        pen.line((*inner, *outer), fill=_MARK, width=3)
    pen.line([at(x, y) for x, y in zip(seen.x, seen.y, strict=True)], fill=_PATH, width=2)
    buffer = io.BytesIO()
    image.save(buffer, "PNG")
    return buffer.getvalue()
