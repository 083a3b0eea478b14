"""Rim and mark in the pictures of a film → place and spin in SI, with a scale and notes on doubts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path  # noqa: TC003
from typing import TYPE_CHECKING

import numpy as np

from analysis.errors import AnalysisError
from analysis.film.errors import NoMark, SlowMotion
from analysis.film.mark import phases_of
from analysis.film.turning import choices_of, spins_of_start, turning_of
from analysis.uncertainty import Estimate
from levilab.errors import DataError, UsageError
from levilab.formats.film import Film, open_film
from levilab.pipelines.sources import no_such_path
from levilab.pipelines.video.tracking import Followed, follow

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from analysis.film.mark import Phases
    from analysis.film.turning import Turning

    Array = NDArray[np.float64]

#: A film whose pictures were taken faster than they follow, by this factor, is in slow motion.
_SLOWER = 1.2
#: Where the edge of a round thing is depends on focus and light [pixels].
_EDGE_U = 0.3
#: Radius of the middle of the mark, in radii of the rim.
_MARK = 0.65
#: The nearest choice is the one that was meant if it is nearer than the next one by this factor.
_NEARER = 0.5
#: A slope of the spin counts from this number of standard uncertainties on.
_FALLS = 3.0


@dataclass(frozen=True)
class VideoOptions:
    """How a film is read.

    Attributes:
        start, stop: of the part with the floating top [s of the film].
        rate: true number of pictures in a second; None: by the file's times.
        near: about where the spin is [Hz].
        line_time: from the reading of a row of the sensor to that of the next one [s].
        scale: [m a pixel] at the top.
        rim: diameter of the top's rim [m].
        base: outer diameter of the base [m].
        distance: of the camera from the base's upper edge [m].
        height: of the rim above the base's upper edge [m].
    """

    start: float = 0.0
    stop: float = np.inf
    rate: float | None = None
    near: float | None = None
    line_time: float = 0.0
    scale: float | None = None
    rim: float | None = None
    base: float | None = None
    distance: float | None = None
    height: float | None = None

    def __post_init__(self) -> None:
        given = [name for name in ("scale", "rim", "base") if getattr(self, name) is not None]
        if len(given) != 1:
            seen = "none is given" if not given else f"{' and '.join(given)} are given"
            raise UsageError(
                "scale",
                f"one scale is expected, {seen}: `rim`, the diameter of the top's rim; `base`, the outer diameter of "
                "the base; or `scale`, metres in a pixel",
            )
        if (self.distance is None) != (self.height is None):
            raise UsageError("distance", "goes with `height`: the top is nearer to the camera than the base")
        if self.distance is not None and (self.base is None or not self.height or self.height >= self.distance):
            raise UsageError("distance", "goes with `base`, and is greater than `height`")
        if self.start >= self.stop:
            raise UsageError("stop", f"a time after `start` = {self.start:g} is expected", value=self.stop)


@dataclass(frozen=True, eq=False)
class Video:
    """Place and spin of a top in a film.

    Attributes:
        film: the file.
        options: how it was read.
        followed: the top in its pictures.
        phases: of the mark, one a picture.
        times: of the place, shape (n,) [s].
        turning: None: no mark turns, or the spin is in doubt.
        choices: spins in doubt, seen from above, counter-clockwise is positive [Hz].
        by_slope: whether one of them was chosen since a free top slows down.
        problem: why there is no spin; empty: there is one.
        scale: at the top [m a pixel].
    """

    film: Film
    options: VideoOptions
    followed: Followed
    phases: Phases
    times: Array
    turning: Turning | None
    choices: tuple[float, ...]
    by_slope: bool
    problem: str
    scale: Estimate

    @cached_property
    def origin(self) -> tuple[float, float]:
        """Middle of the base where it gives the scale, else the mean place [pixels]."""
        base = self.followed.base
        if self.options.base is not None and base is not None:
            return base.x, base.y
        return float(self.followed.x.mean()), float(self.followed.y.mean())

    @property
    def x(self) -> Array:
        """To the right, shape (n,) [m]."""
        return np.asarray((self.followed.x - self.origin[0]) * _known(self.scale))

    @property
    def y(self) -> Array:
        """Upwards in the picture, shape (n,) [m]."""
        return np.asarray((self.origin[1] - self.followed.y) * _known(self.scale))

    @property
    def u(self) -> Array:
        """Standard uncertainty of each place, without that of the scale, shape (n,) [m]."""
        return np.asarray(self.followed.u * _known(self.scale))

    @property
    def spin(self) -> Estimate | None:
        """Spin in the middle of the film, without its sense."""
        found = self.turning
        return Estimate(abs(found.frequency), found.u_frequency, "Hz") if found else None

    @property
    def notes(self) -> tuple[str, ...]:
        """Doubts about the numbers, and parts of the film that are left out."""
        return tuple(_notes(self))


def _known(estimate: Estimate) -> float:
    assert estimate.value is not None
    return estimate.value


def analyze_film(path: Path, options: VideoOptions, progress: Callable[[float], None] = lambda _: None) -> Video:
    """Follow the top in a film and find its spin.

    Raises:
        DataError: the file cannot be read, or shows no top that can be followed.
    """
    if not path.exists():
        raise no_such_path(path)
    film = open_film(path)
    try:
        followed = follow(film, options.start, options.stop, progress)
        return _video(film, options, followed)
    except AnalysisError as error:
        raise DataError(f"{path}: {error}") from error


def _video(film: Film, options: VideoOptions, followed: Followed) -> Video:
    if film.captured and options.rate is None and film.captured > _SLOWER * followed.rate:
        raise SlowMotion(rate=followed.rate, captured=film.captured, spin=None)
    factor = 1.0 if options.rate is None else followed.rate / options.rate
    times = factor * followed.times
    phases = phases_of(followed.profiles)
    rows = followed.y + _MARK * followed.radius * np.sin(2 * np.pi * (phases.phase + phases.angle))
    read = times + options.line_time * rows
    late = rows if options.line_time == 0 else np.zeros_like(rows)
    turning, choices, by_slope, problem = _turn(read, phases, late, options, followed.rate / factor)
    return Video(
        film, options, followed, phases, times + options.line_time * followed.y, turning, choices, by_slope, problem,
        _scale(film, options, followed),
    )  # fmt: skip


def _turn(
    times: Array, phases: Phases, rows: Array, options: VideoOptions, rate: float
) -> tuple[Turning | None, tuple[float, ...], bool, str]:
    """Return how the top turned, spins in doubt, whether the slope chose among them, and why there is none."""
    try:
        found = spins_of_start(times, phases.phase, phases.u)
    except NoMark as error:
        return None, (), False, str(error)
    choices, slow = choices_of(found, options.near)
    if not choices:
        if slow:
            raise SlowMotion(rate=rate, captured=None, spin=slow[0])
        return None, (), False, "no spin with which a top floats, or of `near`, describes its mark"
    if options.near is not None and len(choices) > 1:
        choices.sort(key=lambda f: abs(abs(f) - (options.near or 0.0)))
        off = [abs(abs(f) - options.near) for f in choices[:2]]
        choices = choices[:1] if off[0] < _NEARER * off[1] else choices
    turning = turning_of(times, phases.phase, phases.u, rows, start=choices[0])
    by_slope = len(choices) > 1 and abs(turning.chirp) > _FALLS * turning.u_chirp
    falling = [f for f in choices if f * turning.chirp < 0] if by_slope else []
    played_slowly = bool(slow) and options.rate is None
    if played_slowly or (len(choices) > 1 and len(falling) != 1):
        return None, tuple(-f for f in choices), False, ""
    if falling and falling[0] != choices[0]:
        turning = turning_of(times, phases.phase, phases.u, rows, start=falling[0])
    return turning, tuple(-f for f in choices), bool(falling), ""


def _scale(film: Film, options: VideoOptions, followed: Followed) -> Estimate:
    if options.scale is not None:
        return Estimate(options.scale, None, "m")
    if options.rim is not None:
        diameter, radius, nearer = options.rim, float(np.median(followed.radius)), 1.0
    elif followed.base is None:
        raise DataError(f"{film.path}: no round base is seen round the top: give `rim`, or `scale`")
    else:
        assert options.base is not None
        diameter, radius = options.base, followed.base.radius
        nearer = 1 - options.height / options.distance if options.height and options.distance else 1.0
    value = nearer * diameter / (2 * radius)
    return Estimate(value, value * _EDGE_U / radius, "m")


def _notes(video: Video) -> Iterator[str]:
    seen, options = video.followed, video.options
    last = f"{seen.times[-1]:.2f} s"
    if seen.ended:
        why = {"lost": "the rim is lost", "hand": "a large part of the view changes, as by a hand,"}[seen.ended]
        yield f"{why} after {last}: the rest of the film is left out"
    if seen.missed:
        yield f"no rim is seen in {seen.missed} pictures in between; they are left out"
    if options.base is not None and options.distance is None:
        yield (
            "the scale is that of the base, and the top is nearer to the camera: places are too large by height over "
            "distance; say both by `height` and `distance`, or give `rim`"
        )
    yield from _notes_on_spin(video)


def _notes_on_spin(video: Video) -> Iterator[str]:
    listed = " or ".join(f"{abs(f):.3f} Hz ({'counter-' * (f > 0)}clockwise)" for f in video.choices)
    if video.problem:
        yield f"no spin: {video.problem}"
    elif video.turning is None:
        rate = f"{video.followed.rate:.4g}"
        slow = "" if video.options.rate else "; or, if the film is in slow motion, the true `rate`"
        yield f"no spin: at {rate} pictures in a second it may be {listed}; say which by `near`{slow}"
    elif video.by_slope:
        yield f"of {listed}, which look the same, the one that slows down is taken, as a free top does"
