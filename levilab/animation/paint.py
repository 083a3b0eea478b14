"""Pictures of the top without a browser and without a graphics card: flat facets, from the back to the front.

No facet is sorted.  The parts of a top are convex and stand one after another along its axis, so that each hides those
that lie farther from the camera along the axis, and a convex part hides itself where its facets face away (back-face
culling).  The base is a ring: its far half is drawn, then what stands in its hole, then its near half.

Every part is a solid of revolution, so its facets need not turn with it: only the marks do, and light does not flicker.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array

if TYPE_CHECKING:
    from collections.abc import Sequence

    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont, ImageFont

Places = NDArray[np.intp]
Colour = tuple[int, int, int]

#: Facets around a part of the top, and around the base.
_AROUND, _AROUND_BASE = 48, 120
#: Pictures are drawn larger by this factor and made smaller, which smooths their edges.
_FINER = 2
#: Field of view [rad], and where the camera stands: above the horizon, and around [rad].
_VIEW_RAD, _ELEVATION, _AZIMUTH = math.radians(26), 0.33, -1.25
#: Towards the lights, how bright they are, and the light from everywhere.
_LIGHTS = ((np.array([-0.35, -0.46, 0.82]), 0.55), (np.array([0.57, 0.71, 0.42]), 0.12))
_EVERYWHERE = 0.50
#: As parts of the base's reach: how far a mark lies outside of its part; how far the drive's arrow is above the base,
#: its length, its thickness; and how much wider a shadow is by height.
_OUT, _ARROW, _SOFTER = 0.0022, (0.073, 0.44, 0.022), 0.22


@dataclass(frozen=True)
class Pose:
    """What a picture shows.

    Attributes:
        position: of the centre of mass [m], shape (3,).
        matrix: that takes the top's frame to the base's, shape (3, 3).
        slip: how far washers have turned on the top [rad].
        drive: the drive's field as a part of its amplitude.
        sense: of the spin, 1, −1 or 0.
        trail: the path of the end of the axis up to now, shape (n, 3) [m].
    """

    position: Array
    matrix: Array
    slip: float = 0.0
    drive: float = 0.0
    sense: int = 1
    trail: Array | None = None


@dataclass(frozen=True)
class _Camera:
    """A point that sees, and how it projects.

    Attributes:
        place: [m], shape (3,).
        frame: its rows point right, up and backwards, shape (3, 3).
        scale: pixels for an angle whose tangent is 1.
        middle: of the picture, pixels.
    """

    place: Array
    frame: Array
    scale: float
    middle: tuple[float, float]

    def project(self, points: Array) -> Array:
        """Return pixels (x to the right, y down), shape (…, 2), of points, shape (…, 3) [m]."""
        seen = (points - self.place) @ self.frame.T
        depth = np.minimum(seen[..., 2:], -1e-6)
        flat: Array = self.scale * seen[..., :2] / -depth * np.array([1.0, -1.0]) + np.array(self.middle)
        return flat

    def size_at(self, point: Array) -> float:
        """Return the pixels in a metre at a point."""
        return float(self.scale / -((point - self.place) @ self.frame[2]))


@dataclass(frozen=True)
class _Surface:
    """Facets of one colour.

    Attributes:
        corners: shape (n, 4, 3) [m].
        normals: shape (n, 3).
        colour: without light.
    """

    corners: Array
    normals: Array
    colour: Colour


@dataclass(frozen=True)
class _Solid:
    """A part with its marks, between two heights on the axis [m]."""

    surface: _Surface
    low: float
    high: float
    marks: tuple[tuple[_Surface, str], ...]
    name: str


class Painter:
    """Draws pictures of one scene's top.

    Args:
        parts: as `parts_of` describes the scene.
        size: width and height of a picture [pixels].
        theme: "light" or "dark".
    """

    def __init__(self, parts: dict[str, Any], size: tuple[int, int], theme: str = "light") -> None:
        self.parts, self.size = parts, size
        self.colours: dict[str, Colour] = {key: _rgb(text) for key, text in parts["colours"][theme].items()}
        self._reach: float = parts["view"]["reach"]
        self._camera = _camera(parts, size)
        self._solids = self._make_solids()
        self._outline = np.array([point for part in parts["parts"] for point in part["outline"]])
        self._lowest, self._widest = float(self._outline[:, 1].min()), float(self._outline[:, 0].max())

    def picture(self, pose: Pose) -> Image:
        """Draw the top over its base, without words."""
        from PIL import ImageDraw

        image = self._ground.copy()
        self._draw_shadow(image, pose)
        far, near, box = self._ring
        image.paste(far, box, far)
        pen = ImageDraw.Draw(image)
        self._draw_plumb(pen, pose)
        inside = pose.position[2] + self._lowest < self.parts["base"]["top"]
        if inside:
            self._draw_top(pen, pose)
        image.paste(near, box, near)
        if not inside:
            self._draw_drive(pen, pose)
            self._draw_top(pen, pose)
        return image.reduce(_FINER)

    def where(self, point: Sequence[float]) -> tuple[float, float]:
        """Return the place of a point [m] in the picture [pixels]."""
        x, y = self._camera.project(np.array(point, dtype=np.float64)) / _FINER
        return float(x), float(y)

    def above_ground(self, positions: Array, axes: Array) -> Array:
        """Return places at which no part of the top is below the ground: a simulated fall knows no ground.

        Args:
            positions: of the centre of mass, shape (n, 3) [m].
            axes: of the top, shape (n, 3).
        """
        across = np.hypot(axes[:, 0], axes[:, 1])
        r, z = self._outline.T
        lowest = (axes[:, 2, None] * z - across[:, None] * r).min(axis=1)
        raised = positions.copy()
        raised[:, 2] = np.maximum(positions[:, 2], self.parts["base"]["bottom"] - lowest)
        return raised

    # --- what stays ---

    @cached_property
    def _ground(self) -> Image:
        from PIL import Image, ImageDraw

        image = Image.new("RGB", (_FINER * self.size[0], _FINER * self.size[1]), self.colours["background"])
        base = self.parts["base"]
        circle = _circle(2.1 * base["outer"], base["bottom"], _AROUND_BASE)
        ImageDraw.Draw(image).polygon(_flatten(self._camera.project(circle)), fill=self.colours["ground"])
        return image

    @cached_property
    def _ring(self) -> tuple[Image, Image, tuple[int, int]]:
        """The far and the near half of the base, with their place in the picture."""
        from PIL import Image, ImageDraw

        base = self.parts["base"]
        i, o, low, high, e = base["inner"], base["outer"], base["bottom"], base["top"], base["edge"]
        outline = [[i, low], [i, high - e], [i + e, high], [o - e, high], [o, high - e], [o, low]][::-1]
        corners, normals = _revolve(outline, _AROUND_BASE)
        towards = self._camera.place[:2] / np.linalg.norm(self._camera.place[:2])
        is_near = corners.mean(axis=1)[:, :2] @ towards > 0
        halves = []
        for half in (~is_near, is_near):
            layer = Image.new("RGBA", (_FINER * self.size[0], _FINER * self.size[1]))
            # inner wall, then the upper face, then the outer wall: none of them reaches over a later one
            surface = _Surface(corners[half], normals[half], self.colours["base"])
            away = np.linalg.norm(surface.corners.mean(axis=1) - self._camera.place, axis=1)
            self._draw_facets(ImageDraw.Draw(layer), surface, np.argsort(-away, kind="stable"))
            halves.append(layer)
        boxes = [half.getbbox() for half in halves]
        left, upper = (min(box[k] for box in boxes if box) for k in (0, 1))
        right, lower = (max(box[k] for box in boxes if box) for k in (2, 3))
        box = (left, upper, right, lower)
        return halves[0].crop(box), halves[1].crop(box), (left, upper)

    # --- what moves ---

    def _draw_shadow(self, image: Image, pose: Pose) -> None:
        """Draw the shadow of light from straight above: softer, the higher the top."""
        x, y, z = pose.position
        bottom = self.parts["base"]["bottom"]
        radius = self._widest * (1.2 + _SOFTER / self._reach * max(z - bottom, 0.0))
        edge = self._camera.project(_circle(radius, bottom, 48) + np.array([x, y, 0.0]))
        low, high = np.floor(edge.min(axis=0)).astype(int), np.ceil(edge.max(axis=0)).astype(int)
        width, height = (int(n) for n in np.maximum(high - low, 1))
        mask = self._spot.resize((width, height))
        image.paste(self.colours["shadow"], (int(low[0]), int(low[1])), mask)

    @cached_property
    def _spot(self) -> Image:
        from PIL import Image

        across = np.linspace(-1, 1, 128)
        inside = np.clip((1 - np.hypot(across[:, None], across)) / 0.55, 0, 1)
        darkness = 0.45 if sum(self.colours["background"]) > 384 else 0.75
        return Image.fromarray(np.uint8(255 * darkness * inside**2 * (3 - 2 * inside)))

    def _draw_plumb(self, pen: ImageDraw, pose: Pose) -> None:
        x, y, z = pose.position
        ends = self._camera.project(np.array([[x, y, self.parts["base"]["bottom"]], [x, y, z + self._lowest]]))
        pen.line(_flatten(ends), fill=self.colours["faint"], width=_FINER)

    def _draw_drive(self, pen: ImageDraw, pose: Pose) -> None:
        direction = self.parts["drive"]
        if direction is None or abs(pose.drive) < 0.02:
            return
        above, length, thick = (share * self._reach for share in _ARROW)
        start = np.array([0.0, 0.0, self.parts["base"]["top"] + above])
        tip = start + length * pose.drive * np.array(direction)
        self._draw_arrow(pen, np.array([start, tip]), self.colours["drive"], thick)

    def _draw_arrow(self, pen: ImageDraw, points: Array, colour: Colour, thick: float) -> None:
        """Draw a line along points [m] with a head at its end."""
        flat = self._camera.project(points)
        width = max(round(thick * self._camera.size_at(points[-1])), _FINER)
        pen.line(_flatten(flat), fill=colour, width=width, joint="curve")
        along = flat[-1] - flat[-2]
        length = float(np.hypot(*along)) or 1.0
        along = along / length
        across = np.array([-along[1], along[0]])
        head = [flat[-1] + 3.6 * width * along, flat[-1] + 1.8 * width * across, flat[-1] - 1.8 * width * across]
        pen.polygon(_flatten(np.array(head)), fill=colour)

    def _draw_top(self, pen: ImageDraw, pose: Pose) -> None:
        axis = pose.matrix[:, 2]
        camera = float((self._camera.place - pose.position) @ axis)  # the camera's height along the axis
        lean = _lean(axis)
        if pose.trail is not None and len(pose.trail) > 1:
            self._draw_trail(pen, pose.trail)
        up, down = self.parts["axis"]["up"], self.parts["axis"]["down"]
        first, last = self._solids[0].low, self._solids[-1].high
        pieces: list[tuple[float, float, _Solid | None]] = [
            (-down, first, None), *((solid.low, solid.high, solid) for solid in self._solids), (last, up, None),
        ]  # fmt: skip
        pieces.sort(key=lambda piece: -max(piece[0] - camera, camera - piece[1], 0.0))
        for low, high, solid in pieces:
            if solid is None:
                self._draw_axis(pen, pose, low, high)
            else:
                self._draw_solid(pen, pose, solid, lean)

    def _draw_trail(self, pen: ImageDraw, trail: Array) -> None:
        """Draw the trail, fading towards its beginning."""
        flat = self._camera.project(trail)
        old, new = np.array(self.colours["background"]), np.array(self.colours["path"])
        pieces = 12
        ends = np.linspace(0, len(flat) - 1, pieces + 1).astype(int)
        for k in range(pieces):
            share = 0.15 + 0.85 * (k + 1) / pieces
            if ends[k + 1] > ends[k]:
                colour = _colour(old + share * (new - old))
                pen.line(_flatten(flat[ends[k] : ends[k + 1] + 1]), fill=colour, width=2 * _FINER - 1, joint="curve")

    def _draw_axis(self, pen: ImageDraw, pose: Pose, low: float, high: float) -> None:
        axis = pose.matrix[:, 2]
        ends = self._camera.project(np.array([pose.position + low * axis, pose.position + high * axis]))
        pen.line(_flatten(ends), fill=self.colours["axis"], width=2 * _FINER - 1)
        if high == self.parts["axis"]["up"]:
            radius = 2.3 * _FINER
            (x, y), colour = ends[1], self.colours["path"]
            pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=colour)

    def _draw_solid(self, pen: ImageDraw, pose: Pose, solid: _Solid, lean: Array) -> None:
        is_stem = solid.name == "stem" and pose.sense != 0
        if is_stem:
            self._draw_spin(pen, pose, lean, front=False)
        surface = _Surface(
            solid.surface.corners @ lean.T + pose.position, solid.surface.normals @ lean.T, solid.surface.colour
        )
        self._draw_facets(pen, surface)
        for mark, turns in solid.marks:
            turn = pose.matrix @ _about_z(pose.slip) if turns == "washers" else pose.matrix
            self._draw_facets(pen, _Surface(mark.corners @ turn.T + pose.position, mark.normals @ turn.T, mark.colour))
        if is_stem:
            self._draw_spin(pen, pose, lean, front=True)

    def _draw_spin(self, pen: ImageDraw, pose: Pose, lean: Array, *, front: bool) -> None:
        """Draw three quarters of a circle around the stem; the piece before the stem comes after it."""
        radius, height = self.parts["spin"]["radius"], self.parts["spin"]["height"]
        angles = pose.sense * np.linspace(0.0, 0.72 * 2 * np.pi, 49)
        circle = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(49, height)], axis=1)
        points = circle @ lean.T + pose.position
        middle = pose.position + height * lean[:, 2]
        is_front = (points - middle) @ (self._camera.place - middle) > 0
        colour, thick = self.colours["spin"], 0.1 * radius
        for first, last in _runs(is_front == front):
            piece = points[first : min(last + 1, 49)]
            if last == 49:
                self._draw_arrow(pen, piece, colour, thick)
            elif len(piece) > 1:
                width = max(round(thick * self._camera.size_at(middle)), _FINER)
                pen.line(_flatten(self._camera.project(piece)), fill=colour, width=width, joint="curve")

    # --- facets ---

    def _draw_facets(self, pen: ImageDraw, surface: _Surface, order: Places | None = None) -> None:
        towards = self._camera.place - surface.corners.mean(axis=1)
        facing = np.einsum("ij,ij->i", towards, surface.normals) > 0
        if order is not None:
            facing = order[facing[order]]
        corners = self._camera.project(surface.corners[facing])
        for polygon, colour in zip(
            corners.reshape(len(corners), 8).tolist(), self._lit(surface.normals[facing], surface.colour), strict=True
        ):
            pen.polygon(polygon, fill=tuple(colour))

    def _lit(self, normals: Array, colour: Colour) -> list[list[int]]:
        """Return the colour under the lights, for facets with these normals, shape (n, 3)."""
        bright = np.full(len(normals), _EVERYWHERE) + 0.10 * normals[:, 2]
        for direction, strength in _LIGHTS:
            bright += strength * np.clip(normals @ direction / np.linalg.norm(direction), 0, 1)
        found: list[list[int]] = np.clip(np.outer(bright, colour), 0, 255).astype(int).tolist()
        return found

    def _make_solids(self) -> list[_Solid]:
        solids = []
        for part in self.parts["parts"]:
            outline = part["outline"]
            corners, normals = _revolve(outline, _AROUND)
            marks = [
                (_Surface(*_patch(mark, _OUT * self._reach), colour=self.colours[mark["colour"]]), mark["turns"])
                for mark in self.parts["marks"]
                if mark["part"] == part["name"]
            ]
            heights = [z for _, z in outline]
            surface = _Surface(corners, normals, self.colours[part["colour"]])
            solids.append(_Solid(surface, min(heights), max(heights), tuple(marks), part["name"]))
        return solids


# --- shapes ---


def _revolve(
    outline: Sequence[Sequence[float]], around: int, start: float = 0.0, width: float = 2 * math.pi
) -> tuple[Array, Array]:
    """Return the facets that an outline (radius, height) sweeps about z: corners (n, 4, 3), normals (n, 3)."""
    angles = start + width * np.arange(around + 1) / around
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    middle = start + width * (np.arange(around) + 0.5) / around
    facing = np.stack([np.cos(middle), np.sin(middle)], axis=1)
    corners, normals = [], []
    for (r0, z0), (r1, z1) in pairwise(outline):
        low = np.column_stack([r0 * ring, np.full(around + 1, z0)])
        high = np.column_stack([r1 * ring, np.full(around + 1, z1)])
        corners.append(np.stack([low[:-1], low[1:], high[1:], high[:-1]], axis=1))
        length = math.hypot(r1 - r0, z1 - z0) or 1.0
        across, along = (z1 - z0) / length, (r0 - r1) / length
        normals.append(np.column_stack([across * facing, np.full(around, along)]))
    return np.concatenate(corners), np.concatenate(normals)


def _patch(mark: dict[str, Any], out: float) -> tuple[Array, Array]:
    """Return the facets of a mark, a little outside of its part."""
    outline = np.array(mark["outline"])
    steps = np.diff(outline, axis=0)
    outwards = np.stack([steps[:, 1], -steps[:, 0]], axis=1) / np.linalg.norm(steps, axis=1)[:, None]
    moved = outline + out * np.vstack([outwards[:1], outwards[:-1] + outwards[1:], outwards[-1:]])
    return _revolve(moved.tolist(), 6, mark["azimuth"] - mark["width"] / 2, mark["width"])


def _circle(radius: float, height: float, around: int) -> Array:
    angles = 2 * np.pi * np.arange(around) / around
    return np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(around, height)], axis=1)


def _lean(axis: Array) -> Array:
    """Return the shortest turn that takes z to an axis, shape (3, 3): it leans and does not twist."""
    x, y, z = axis
    if z < -0.999999:
        return np.diag([1.0, -1.0, -1.0])
    k = 1 / (1 + z)
    return np.array([[1 - k * x * x, -k * x * y, x], [-k * x * y, 1 - k * y * y, y], [-x, -y, z]])


def _about_z(angle: float) -> Array:
    sine, cosine = math.sin(angle), math.cos(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]


def _camera(parts: dict[str, Any], size: tuple[int, int]) -> _Camera:
    """Place the camera as `placeCamera` of top.js does."""
    reach, top, bottom = parts["view"]["reach"], parts["view"]["top"], parts["base"]["bottom"]
    aspect, half = size[0] / size[1], math.tan(_VIEW_RAD / 2)
    target = np.array([0.0, 0.0, 0.48 * top + 0.52 * bottom])
    distance = max((0.62 * (top - bottom) + 0.16 * reach) / half, 1.1 * reach / (half * aspect) + reach)
    flat = math.cos(_ELEVATION)
    backwards = np.array([flat * math.cos(_AZIMUTH), flat * math.sin(_AZIMUTH), math.sin(_ELEVATION)])
    right = np.array([-math.sin(_AZIMUTH), math.cos(_AZIMUTH), 0.0])
    frame = np.array([right, np.cross(backwards, right), backwards])
    scale = _FINER * size[1] / 2 / half
    return _Camera(target + distance * backwards, frame, scale, (_FINER * size[0] / 2, _FINER * size[1] / 2))


# --- colours and letters ---


def _rgb(text: str) -> Colour:
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


def _colour(values: Array) -> Colour:
    red, green, blue = (int(value) for value in values)
    return red, green, blue


def _flatten(points: Array) -> list[float]:
    flat: list[float] = points.ravel().tolist()
    return flat


def font(size: float) -> FreeTypeFont | ImageFont:
    """Return DejaVu Sans, which comes with matplotlib and has the letters of all European languages and of physics."""
    from PIL import ImageFont

    found = find_spec("matplotlib")
    for place in (found.submodule_search_locations or ()) if found else ():
        path = Path(place, "mpl-data/fonts/ttf/DejaVuSans.ttf")
        if path.is_file():
            return ImageFont.truetype(str(path), size)
    return ImageFont.load_default(size)
