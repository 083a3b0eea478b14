"""A camera that films a simulated top, from above or from beside: exposure, rolling shutter, blur, noise, codec, times.

It draws a dark base, and a lighter top with a light mark: a strip on its face for a camera above, and on its side for
one beside.  Errors of lenses are not modelled.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.animation.poses import matrices, poses_of
from levilab.formats.film import check_reader
from levilab.simulator.scene import Scene
from levilab.simulator.single import simulate

#: Radius of the rim, of the base, and of a dot on the stem; thickness of the top, and its height above the base [m].
RIM, BASE, DOT, THICK, HEIGHT = 0.015, 0.046, 0.001, 0.008, 0.07
#: Radius of the stem, which a camera beside the top sees [m].
STEM = 0.0015
#: Brightness of table, base, top, its hub and its mark.
TABLE, DARK, TOP, HUB, MARK = 190.0, 60.0, 140.0, 40.0, 235.0
#: Angle of the mark, to either side [rad].
MARK_HALF = 0.25
#: Where a camera is: unit vectors to the right and upwards in its picture, and from the top to it.
ABOVE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
BESIDE = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
#: Clock of a film's file.
CLOCK = Fraction(1, 90000)


@dataclass(frozen=True)
class Camera:
    """How a film is taken.

    Attributes:
        width, height: of a picture.
        scale: at the height of the top [m a pixel].
        exposure: [s].
        line_time: from the reading of a row to that of the next one [s].
        blur: of the lens [pixels].
        noise: standard deviation of a pixel, of 255.
        parts: of an exposure that are added up.
        away: where the middle of the base is in the picture, from its middle [pixels].
        stem: height of a light dot on the stem above the rim; 0: there is none; from beside, of the stem alone [m].
        distance: of the camera from the rim at its mean height; infinite: no perspective [m].
        pose: ABOVE or BESIDE.
    """

    width: int = 224
    height: int = 208
    scale: float = 0.5e-3
    exposure: float = 1e-3
    line_time: float = 0.0
    blur: float = 1.2
    noise: float = 2.5
    parts: int = 2
    away: tuple[float, float] = (5.3, -3.7)
    stem: float = 0.0
    distance: float = math.inf
    pose: tuple[tuple[float, float, float], ...] = ABOVE

    @property
    def middle(self) -> tuple[float, float]:
        """Where the axis of the base is at the top's mean height [pixels]."""
        return (self.width - 1) / 2 + self.away[0], (self.height - 1) / 2 + self.away[1]


@dataclass(frozen=True)
class Flight:
    """Motion of a top as a camera needs it.

    Attributes:
        times: close enough for a straight line between neighbours, shape (n,) [s].
        x, y: of the rim's centre [m].
        yaw: of the mark, seen from above [rad].
        tilt: of the body's plane, as seen from above, less the yaw, shape (n, 2, 2).
        rise: of the rim's centre above its mean height, shape (n,) [m].
        lean: x and y of the unit vector along the axis, shape (n, 2).
    """

    times: Array
    x: Array
    y: Array
    yaw: Array
    tilt: Array
    rise: Array
    lean: Array

    def pose_at(self, times: Array) -> tuple[Array, Array]:
        """Return the rim's centre, shape (n, 3) [m], and the body's axes as columns, shape (n, 3, 3), at times."""
        x, y, yaw, tilt = self.at(times)
        rise, *lean = (np.interp(times, self.times, one) for one in (self.rise, *self.lean.T))
        axis = np.stack([*lean, np.sqrt(1 - lean[0] ** 2 - lean[1] ** 2)], axis=-1)
        c, s = np.cos(yaw), np.sin(yaw)
        body = np.empty((*times.shape, 3, 3))
        body[..., :2, :2] = np.stack([c, -s, s, c], axis=-1).reshape(-1, 2, 2) @ tilt
        body[..., 2, :2] = -np.einsum("ni,nij->nj", axis[:, :2], body[..., :2, :2]) / axis[:, 2:]
        body[..., 2] = axis
        return np.stack([x, y, rise], axis=-1), body

    def at(self, times: Array) -> tuple[Array, Array, Array, Array]:
        """Return x, y, yaw and tilt at times."""
        x, y, yaw = (np.interp(times, self.times, column) for column in (self.x, self.y, self.yaw))
        rows = [np.interp(times, self.times, self.tilt[:, i, j]) for i in (0, 1) for j in (0, 1)]
        return x, y, yaw, np.stack(rows, axis=-1).reshape(*times.shape, 2, 2)


def flight_of(scene: Scene, duration: float) -> Flight:
    """Simulate a top."""
    motion = simulate(scene, duration + 0.02, tolerance=1e-6)
    poses = poses_of(motion, 0.0, duration + 0.01, round(2000 * duration))
    attitude = matrices(poses.quaternions)
    turn = attitude[:, :2, :2]
    yaw = np.unwrap(np.arctan2(turn[:, 1, 0] - turn[:, 0, 1], turn[:, 0, 0] + turn[:, 1, 1]))
    back = np.stack([np.cos(yaw), np.sin(yaw), -np.sin(yaw), np.cos(yaw)], axis=-1).reshape(-1, 2, 2)
    return Flight(
        poses.times,
        poses.positions[:, 0],
        poses.positions[:, 1],
        yaw,
        back @ turn,
        poses.positions[:, 2] - poses.positions[:, 2].mean(),
        attitude[:, :2, 2],
    )


class Pictures:
    """The pictures that a camera takes of a flight.

    Args:
        camera: that takes them.
        flight: of the top.
        seed: of the noise.
    """

    def __init__(self, camera: Camera, flight: Flight, seed: int = 1) -> None:
        self._camera, self._flight = camera, flight
        self._random = np.random.default_rng(seed)
        size = 2 * camera.width * camera.height
        self._noise = camera.noise * self._random.standard_normal(size, dtype=np.float32)
        x0, y0 = camera.middle
        rows, columns = np.ogrid[: camera.height, : camera.width]
        beside = camera.pose == BESIDE
        away = np.hypot(columns - x0, rows - y0) - BASE / camera.scale
        if beside:
            away = np.maximum(np.abs(columns - x0) - BASE / camera.scale, y0 + HEIGHT / camera.scale - rows)
        texture = (2 if beside else 10) * np.sin(columns / 17.0) * np.cos(rows / 23.0)
        self.background = TABLE + texture + (DARK - TABLE - 0.7 * texture) * _edge(-away / camera.blur)

    def take(self, time: float) -> Array:
        """Return the picture whose first row is read at a time, without noise."""
        camera = self._camera
        x0, y0 = camera.middle
        centre = np.array(camera.pose)[:2] @ self._flight.pose_at(np.array([time]))[0][0] / camera.scale
        reach = max(RIM, camera.stem) / camera.scale + 8
        left, up = round(x0 + centre[0] - reach), round(y0 - centre[1] - reach)
        size = round(2 * reach)
        columns, rows = np.arange(left, left + size), np.arange(up, up + size)
        picture = np.array(self.background)
        seen = picture[up : up + size, left : left + size]
        seen[:] = sum(self._top(columns, rows, time + by, seen) for by in self._exposed()) / camera.parts
        return picture

    def _exposed(self) -> Array:
        camera = self._camera
        return np.asarray(camera.exposure * ((np.arange(camera.parts) + 0.5) / camera.parts - 0.5))

    def _top(self, columns: Any, rows: Any, time: float, behind: Array) -> Array:
        """Return the top in front of some pixels: each looks along a line o + s d, in the axes of the body."""
        camera = self._camera
        x0, y0 = camera.middle
        right, up, back = (np.array(one) for one in camera.pose)
        centre, body = self._flight.pose_at(time + rows * camera.line_time)
        across, along = np.broadcast_arrays((columns - x0) * camera.scale, (y0 - rows)[:, None] * camera.scale)
        o = across[..., None] * right + along[..., None] * up
        d = o / camera.distance - back
        o = (o - centre[:, None]) @ body
        d = d @ body
        soft = camera.blur * camera.scale
        inside, top = (self._side if camera.pose == BESIDE else self._face)(o, d, soft)
        if camera.stem and camera.pose == BESIDE:
            inside = np.maximum(inside, np.minimum(STEM - np.abs(o[..., 0] * d[..., 1] - o[..., 1] * d[..., 0]),
                                                   camera.stem / 2 - np.abs(o[..., 2] - camera.stem / 2)))  # fmt: skip
        elif camera.stem:
            nearest = o - (0, 0, camera.stem)
            nearest = nearest - np.sum(nearest * d, axis=2, keepdims=True) / np.sum(d * d, axis=2, keepdims=True) * d
            top += (MARK - top) * _edge((DOT - np.linalg.norm(nearest, axis=2)) / soft)
        return np.asarray(behind + (top - behind) * _edge(inside / soft))

    @staticmethod
    def _face(o: Array, d: Array, soft: float) -> tuple[Array, Array]:
        """Return how far inside its rim lines meet the face of the top [m], and its brightness there."""
        place = o[..., :2] - (o[..., 2:] / d[..., 2:]) * d[..., :2]
        a, b = place[..., 0], place[..., 1]
        away = np.hypot(a, b)
        mark = _edge((a * np.sin(MARK_HALF) - np.abs(b) * np.cos(MARK_HALF)) / soft) * _edge((away - 0.35 * RIM) / soft)
        mark *= _edge((0.93 * RIM - away) / soft)
        top = TOP + (MARK - TOP) * mark
        return RIM - away, top + (HUB - top) * _edge((0.2 * RIM - away) / soft)

    @staticmethod
    def _side(o: Array, d: Array, soft: float) -> tuple[Array, Array]:
        """Return how far inside its outline lines meet the side of the top [m], and its brightness there."""
        level = np.hypot(d[..., 0], d[..., 1])
        aside = (o[..., 0] * d[..., 1] - o[..., 1] * d[..., 0]) / level
        nearest = -(o[..., 0] * d[..., 0] + o[..., 1] * d[..., 1]) / level**2  # to the axis
        half = np.sqrt(np.maximum(RIM**2 - aside**2, 0.0))  # of the chord
        slope = d[..., 2] / level
        middle = o[..., 2] + nearest * d[..., 2] + THICK / 2
        inside = np.minimum(RIM - np.abs(aside), THICK / 2 + np.abs(slope) * half - np.abs(middle))
        hit = nearest - half / level
        angle = np.arctan2(o[..., 1] + hit * d[..., 1], o[..., 0] + hit * d[..., 0])
        of_side = THICK / 2 - np.abs(middle - slope * half)
        mark = _edge((MARK_HALF - np.abs(angle)) * np.maximum(half, soft) / soft) * _edge(of_side / soft)
        return inside, TOP + (MARK - TOP) * mark

    def noisy(self, picture: Array) -> NDArray[np.uint8]:
        """Return a picture as a sensor has it."""
        first = int(self._random.integers(self._noise.size - picture.size))
        noise = self._noise[first : first + picture.size].reshape(picture.shape)
        return np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)


def _edge(distance: Any) -> Any:
    """Return a soft edge: 1 within, 0 outside."""
    near = np.clip(distance, -1, 1)
    return 0.5 + 0.25 * near * (3 - near * near)


def phone_times(duration: float) -> Array:
    """Return the times of a phone at 240 pictures in a second: 3.33 and 5 ms apart, in turn."""
    steps = np.tile([1 / 300, 1 / 200], round(120 * duration))
    return np.concatenate([[0.0], np.cumsum(steps)])[:-1]


def write_film(
    path: Path,
    pictures: Iterable[NDArray[np.uint8]],
    times: Array,
    *,
    codec: str = "libx264",
    metadata: Mapping[str, str] | None = None,
) -> Path:
    """Write pictures as a film with their times [s].  Raises NoFilm where the extra is not installed."""
    check_reader(path)
    import av
    from av.video.reformatter import VideoReformatter

    reformatter = VideoReformatter()  # one for all pictures, and one thread: others only wait for each other
    h264 = codec == "libx264"
    with av.open(str(path), "w", options={"movflags": "use_metadata_tags"}) as file:
        file.metadata.update(metadata or {})
        stream: Any = None
        for time, picture in zip(times, pictures, strict=True):
            if stream is None:
                # a camera's MJPEG; ffmpeg's own choice, 0.2 Mbit/s whatever the picture, blurs a rim by 0.2 mm
                options = {"crf": "18", "preset": "ultrafast"} if h264 else {"qmin": "3", "qmax": "3"}
                stream = file.add_stream(codec, rate=240, options=options)
                stream.height, stream.width = picture.shape
                stream.pix_fmt = "yuv420p" if h264 else "yuvj420p"
                stream.time_base = stream.codec_context.time_base = CLOCK
            gray = av.VideoFrame.from_ndarray(picture, format="gray")
            frame = reformatter.reformat(gray, format=stream.pix_fmt, threads=1)
            frame.pts, frame.time_base = round(time / CLOCK), CLOCK
            file.mux(stream.encode(frame))
        file.mux(stream.encode())
    return path


def film(path: Path, camera: Camera, flight: Flight, times: Array, *, codec: str = "libx264", seed: int = 1) -> Path:
    """Film a flight at some times [s].  Raises NoFilm where the extra is not installed."""
    shown = Pictures(camera, flight, seed)
    return write_film(path, (shown.noisy(shown.take(t)) for t in times.tolist()), times, codec=codec)
