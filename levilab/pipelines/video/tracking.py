"""A film → where the rim or the side is in each picture, and the light along the bands of the top."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.film.circles import Circle, coarse, find_base, find_top
from analysis.film.dot import find_dot
from analysis.film.errors import CameraMoved, HandInView
from analysis.film.rim import Rim, fit_rim
from analysis.film.side import Side, find_side, fit_side
from analysis.film.view import compare_views
from levilab.errors import DataError
from levilab.formats.film import Film, Picture, pictures

#: The top is looked for in the beginning of the film, in pictures at least so far apart [s].
_FIRST_S, _APART_S = 0.6, 1 / 90
#: Width of the pictures in which it is looked for [pixels].
_COARSE = 320
#: The view is compared with the first one each interval [s].
_LOOK_S = 0.1
#: Share of the background that a hand covers.
_HAND = 0.04
#: Shift of the background that is allowed [pixels], and in its standard uncertainties.
_SHIFT, _SHIFT_U = 0.5, 6.0
#: Beyond this number of radii is background, and there is at least such a share of it.
_AROUND, _LEAST_BACKGROUND = 1.8, 0.05
#: A rim has the same radius, but for its height, to this part.
_SAME_RADIUS = 0.15
#: Part of a change of the width of the side that is believed from one picture to the next.
_SLOWLY = 0.05
#: Its edge has the same contrast, but for light and focus, at least to this part.
_SAME_CONTRAST = 0.4
#: A top that is not seen for longer is lost [s].
_LOST_S = 0.25
#: Least length of a track [s].
_LEAST_S = 0.4
#: Uncertainty of a place by a codec that leaves parts of a picture as they were in the one before [pixels]: 0.027 to
#: 0.038 in ten films of H.264 at a quality of 18, of the blurs and noises that the cross-check draws.  Then the factor
#: for codecs whose pictures stand alone: their errors are alike within blocks of 8 × 8 pixels, and the fit of the rim
#: takes them for independent (1.3 to 1.8 for quantisers from 1 to 24).
CODEC_U, ALONE, ALONE_FACTOR = 0.033, frozenset({"mjpeg"}), 1.5


@dataclass(frozen=True, eq=False)
class Followed:
    """A top in the pictures of its film.

    Attributes:
        times: of the pictures with a rim, by the file, shape (n,) [s].
        x: of the centre, from the left, shape (n,) [pixels].
        y: from above, shape (n,) [pixels].
        u: standard uncertainties of both, shape (n, 2) [pixels].
        radius: of the rim, shape (n,) [pixels].
        profiles: shape (n, bands, rays).
        dots: x + iy of the dot on the stem, NaN where it is not seen; zeros: not looked for, shape (n,) [pixels].
        turn: of the side, clockwise in the picture; zeros: seen from above, shape (n,) [rad].
        base: the circle of the base; None: not seen.
        rate: pictures in a second, by their times.
        missed: pictures in between in which no rim was seen.
        ended: why it ends before the film does: "lost", "hand"; empty: it does not.
    """

    times: Array
    x: Array
    y: Array
    u: Array
    radius: Array
    profiles: Array
    dots: NDArray[np.complex128]
    turn: Array
    base: Circle | None
    rate: float
    missed: int
    ended: str


def follow(
    film: Film, start: float, stop: float, progress: Callable[[float], None], *, with_dot: bool, beside: bool
) -> Followed:
    """Follow the top through a film.

    Args:
        film: of `open_film`.
        start: where it floats from [s].
        stop: until when [s].
        progress: called with the share that is done.
        with_dot: a dot on the stem is followed, too.
        beside: the camera is beside the top.

    Raises:
        NoFilm: it cannot be read.
        DataError: too short a time is left.
        AnalysisError: no top, a hand, a moving camera.
    """
    first, still, factor = _beginning(film, start, stop)
    top = find_side(first) if beside else find_top(first)
    background = np.median(first, axis=0)
    base = None if isinstance(top, Side) else _fit_base(still, background, top, factor)
    watch = _Watch(background, top, factor)
    if watch.share_of_background < _LEAST_BACKGROUND:
        fills = "{path:s}: the top fills the picture: film it from farther away, with the base round it"
        raise DataError(fills, path=film.path)
    track = _Track(top.scaled(factor), with_dot=with_dot)
    span = min(stop, film.duration or np.inf) - start
    for time, picture in pictures(film, start, stop):
        rim = track.add(time, picture)
        if rim is None and time - track.last > _LOST_S:
            track.ended = "lost"
            break
        if watch.sees_hand(time, picture):
            track.forget_after(watch.clean)
            track.ended = "hand"
            break
        if 0 < span < np.inf:
            progress(min((time - start) / span, 1.0))
    return _followed(film, track, watch, base)


def _beginning(film: Film, start: float, stop: float) -> tuple[Array, Picture, int]:
    """Return small pictures of the beginning, the first picture, and the factor between their sizes."""
    factor = max(round(film.width / _COARSE), 1) if film.width > 1.5 * _COARSE else 1
    found: list[Array] = []
    still: Picture | None = None
    for time, picture in pictures(film, start, stop):
        if still is None:
            still, begin, before = picture.copy(), time, -np.inf
        if time - begin > _FIRST_S:
            break
        if time - before >= _APART_S:
            found.append(coarse(picture, factor))
            before = time
    if still is None or len(found) < 3:
        raise DataError(
            "{path:s}: holds {n} pictures from {start:g} s on: a second of film is needed at least",
            path=film.path,
            n=len(found),
            start=start,
        )
    return np.stack(found), still, factor


def _fit_base(still: Picture, background: Array, top: Circle, factor: int) -> Circle | None:
    base = find_base(background, top)
    fitted = fit_rim(still, base.scaled(factor), width=0.4) if base else None
    return fitted.circle if fitted else None


class _Watch:
    """Compares the view with that of the beginning."""

    def __init__(self, background: Array, top: Circle | Side, factor: int) -> None:
        self._before, self._factor = background, factor
        self._outside = Circle(top.x, top.y, top.radius).distance(background.shape) > _AROUND * top.radius
        self.share_of_background = float(self._outside.mean())
        self.clean = -np.inf
        self.share = 0.0

    def sees_hand(self, time: float, picture: Picture) -> bool:
        """Compare the view where it is due, and return whether something covers it.  Raises CameraMoved."""
        if time < self.clean + _LOOK_S:
            return False
        view = compare_views(self._before, coarse(picture, self._factor), self._outside)
        if view.covered > _HAND:
            self.share = view.covered
            return True
        shift, u = view.shift * self._factor, view.u * self._factor
        if shift > max(_SHIFT, _SHIFT_U * u):
            raise CameraMoved(time=time, shift=shift, allowed=max(_SHIFT, _SHIFT_U * u))
        self.clean = time
        return False


class _Track:
    """The rim, or the side, from picture to picture."""

    def __init__(self, top: Circle | Side, *, with_dot: bool) -> None:
        self._with_dot = with_dot
        self._radius, self._contrast = top.radius, 0.0
        self._now, self._speed = top, (0.0, 0.0)
        self.last = np.nan
        self.times: list[float] = []
        self.rims: list[Rim] = []
        self.dots: list[complex] = []
        self.turns: list[float] = []
        self.ended = ""
        self.missed: list[float] = []

    def add(self, time: float, picture: Picture) -> Rim | None:
        """Find rim or side in the next picture, where it should be by its speed."""
        step = 0.0 if np.isnan(self.last) else time - self.last
        self.last = time if np.isnan(self.last) else self.last
        expected = replace(self._now, x=self._now.x + step * self._speed[0], y=self._now.y + step * self._speed[1])
        seen = self._same(_fit(picture, expected)) or self._same(_fit(picture, self._now, width=3.0, rounds=6))
        if seen is None:
            self.missed.append(time)
            return None
        rim, top = seen
        if step > 0:
            self._speed = (top.x - self._now.x) / step, (top.y - self._now.y) / step
        if not self.times:
            self._radius, self._contrast = rim.circle.radius, rim.contrast
        if isinstance(top, Side):  # it hardly changes, but where the mark hides an end of it
            top = replace(top, radius=self._now.radius + _SLOWLY * (top.radius - self._now.radius))
        self._now, self.last = top, time
        self.times.append(time)
        self.rims.append(rim)
        dot = find_dot(picture, rim.circle) if self._with_dot else 0.0
        self.dots.append(complex(np.nan) if dot is None else dot)
        self.turns.append(top.turn if isinstance(top, Side) else 0.0)
        return rim

    def _same(self, seen: tuple[Rim, Circle | Side] | None) -> tuple[Rim, Circle | Side] | None:
        limit = _SAME_RADIUS if self.times else 2 * _SAME_RADIUS
        if seen is None or abs(seen[1].radius / self._radius - 1) >= limit:
            return None
        return seen if seen[0].contrast > _SAME_CONTRAST * self._contrast else None

    def forget_after(self, time: float) -> None:
        """Leave out the pictures after a time."""
        count = int(np.searchsorted(self.times, time, side="right"))
        del self.times[count:], self.rims[count:], self.dots[count:], self.turns[count:]


def _fit(picture: Picture, start: Circle | Side, **how: Any) -> tuple[Rim, Circle | Side] | None:
    if isinstance(start, Side):
        return fit_side(picture, start, **how)
    rim = fit_rim(picture, start, **how)
    return (rim, rim.circle) if rim else None


def _followed(film: Film, track: _Track, watch: _Watch, base: Circle | None) -> Followed:
    span = track.times[-1] - track.times[0] if track.times else 0.0
    if span < _LEAST_S:
        if track.ended == "hand":
            raise HandInView(times=(max(watch.clean, 0.0), track.last), share=watch.share)
        raise DataError(
            "{path:s}: the top is seen for {span:.2f} s, {least:g} s are needed: name a part where it floats by "
            "`start` and `stop`",
            path=film.path,
            span=span,
            least=_LEAST_S,
        )
    times = np.array(track.times)
    missed = sum(time < times[-1] for time in track.missed)
    u_of_fit = np.array([rim.u for rim in track.rims])
    x, y, radius = np.array([(rim.circle.x, rim.circle.y, rim.circle.radius) for rim in track.rims]).T
    return Followed(
        times,
        x,
        y,
        radius=radius,
        u=ALONE_FACTOR * u_of_fit if film.codec in ALONE else np.hypot(u_of_fit, CODEC_U),
        profiles=np.stack([rim.profiles for rim in track.rims]),
        dots=np.array(track.dots, dtype=np.complex128),
        turn=np.array(track.turns),
        base=base,
        rate=(times.size - 1 + missed) / span,
        missed=missed,
        ended=track.ended,
    )
