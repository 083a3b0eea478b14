"""Films: the brightness of each picture with the time that the file gives it, through PyAV, an extra."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levilab.errors import DataError
from levilab.software import how_to_install

Picture = NDArray[np.uint8]


#: Key under which phones write at how many pictures in a second a film was taken, whatever it plays at.
_CAPTURED = "com.android.capture.fps"


@dataclass(frozen=True)
class Film:
    """Properties of a film, as its file states them.

    Attributes:
        path: the file.
        width: of a picture [pixels].
        height: [pixels].
        captured: pictures in a second when it was taken; None: not stated.
        duration: [s]; None: not stated.
        codec: its name.
    """

    path: Path
    width: int
    height: int
    captured: float | None
    duration: float | None
    codec: str


class NoFilm(DataError):
    """A file whose pictures cannot be read."""


def open_film(path: Path) -> Film:
    """Read the properties of a film.

    Raises:
        NoFilm: the extra is not installed, or the file holds no film.
    """
    with _opened(path) as (container, stream):
        return Film(
            path,
            stream.codec_context.width,
            stream.codec_context.height,
            _number(container.metadata.get(_CAPTURED)),
            container.duration / 1e6 if container.duration else None,
            stream.codec_context.name,
        )


def pictures(film: Film, start: float = 0.0, stop: float = np.inf) -> Iterator[tuple[float, Picture]]:
    """Yield the time of each picture [s] and its brightness, shape (height, width).

    A picture may share its memory with the decoder's: it is valid until the next one.

    Args:
        film: of `open_film`.
        start: of the first picture [s].
        stop: of the last one [s].

    Raises:
        NoFilm: it is damaged, or has no times.
    """
    import av

    with _opened(film.path) as (container, stream):
        stream.thread_type = "AUTO"
        if start > 0:
            container.seek(int(start / stream.time_base), stream=stream)
        before = -np.inf
        try:
            for frame in container.decode(stream):
                if frame.pts is None:
                    said = "{path:s}: its pictures have no times: take the phone's own file, not a raw stream"
                    raise NoFilm(said, film.path)
                time = float(frame.pts * stream.time_base)
                if time > stop:
                    return
                if time >= start and time > before:
                    before = time
                    yield time, _brightness(frame)
        except av.FFmpegError as error:
            said = "{path:s}: is damaged after {s:.2f} s: copy it again, or end before that by `stop`"
            raise NoFilm(said, film.path, max(before, 0)) from error


def _brightness(frame: Any) -> Picture:
    """Return the brightness of a picture: where it is stored by itself, as it is there."""
    if frame.format.name in {"yuv420p", "yuvj420p", "nv12", "gray", "yuv422p", "yuvj422p", "yuv444p"}:
        plane = frame.planes[0]
        return np.frombuffer(plane, np.uint8).reshape(plane.height, plane.line_size)[:, : plane.width]
    return np.asarray(frame.to_ndarray(format="gray"), dtype=np.uint8)


def _number(text: str | None) -> float | None:
    try:
        return None if text is None else float(text)
    except ValueError:
        return None


def check_reader(path: Path) -> None:
    """Raise NoFilm where the extra is not installed, by which a film is read and written."""
    if find_spec("av") is None:
        said = "{path:s}: films need the extra video (av, which is not installed): {how}"
        raise NoFilm(said, path, how_to_install("video"))


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, Any]]:
    """Open a file; yields its container and its first film."""
    check_reader(path)
    import av

    try:
        container: Any = av.open(str(path))
    except (av.FFmpegError, OSError) as error:
        said = "{path:s}: holds no film that can be read: give the file that the camera wrote"
        raise NoFilm(said, path) from error
    with container:
        if not container.streams.video:
            raise NoFilm("{path:s}: holds no film: a film of the top from above is expected", path)
        yield container, container.streams.video[0]
