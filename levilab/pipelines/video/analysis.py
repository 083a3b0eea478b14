"""Rim or side, and mark, in the pictures of a film → place and spin in SI, with a scale and notes on doubts."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.errors import AnalysisError
from analysis.film.circles import Circle
from analysis.film.errors import NoMark, SlowMotion
from analysis.film.mark import Phases, phases_of, without_pull
from analysis.film.turning import Turning, choices_of, spins_of_start, turning_of
from analysis.limits import spin_at_fall
from analysis.sway import swings_of
from analysis.uncertainty import Estimate
from levilab.errors import DataError, DoesNotSuit, UsageError
from levilab.formats.film import Film, NoFilm, check_reader, open_film
from levilab.formats.kinds import AUDIO, kind_of_bytes
from levilab.formats.table import file_errors
from levilab.pipelines.analyzed import EachAlone
from levilab.pipelines.inputs.source import Readings, Source
from levilab.pipelines.options import InputOptions, VideoOptions
from levilab.pipelines.row import Quantity, columns_of
from levilab.pipelines.video.leaning import Leaning, Rising, leaning_of, rising_of
from levilab.pipelines.video.tracking import Followed, follow
from levilab.present.numbers import enumeration, with_uncertainty
from levilab.present.progress import ShareBar
from levilab.runs.run import Run
from levilab.texts.text import Sentences, Text, text_of

#: Of `levilab.pipelines.video.analysis.Video`.
QUANTITIES = (
    Quantity("frequency", "Hz", "spin in the middle of the film", "spin", of="spin", optional=True),
    Quantity("chirp", "Hz/s", "its slope", "slope of the spin", optional=True),
    Quantity("reference_time", "s", "time of the spin", "middle of the film", of="turning.middle", has_u=False,
             optional=True),
    Quantity("precession", "Hz", "precession in the middle of the film", optional=True),
    Quantity("stem_precession", "Hz", "precession by the lean: a dot on the stem, or the side", of="leaning.middle",
             optional=True),
    Quantity("tilt", "rad", "amplitude of the precession", "tilt", of="leaning.tilt", optional=True),
    Quantity("vertical_swing", "Hz", "swing up and down", of="rising.swing", optional=True),
    Quantity("vertical_amplitude", "m", "amplitude of the swing up and down", of="rising.amplitude", optional=True,
             fine=True),
    Quantity("fall_time", "s", "when the top fell", "fall", of="fall", optional=True),
    Quantity("spin_at_fall", "Hz", "spin at which it fell", optional=True),
    Quantity("scale", "m", "length of a pixel at the top", "a pixel", fine=True),
    Quantity("pictures", "1", "pictures with a rim", of=lambda found: float(found.time.size), has_u=False),
)  # fmt: skip

VIDEO_ROW = tuple(columns_of(QUANTITIES))


#: First bytes by which the same film is found again.
_HEAD = 4096
#: Steps of the time that differ by less are even [ms].
_EVEN_MS = 0.2
#: Readings of the spin from which it is continued to a fall.
_FEWEST = 3
#: A film whose pictures were taken faster than they follow, by this factor, is in slow motion.
_SLOWER = 1.2
#: Where the edge of a round thing is depends on focus and light [pixels].
_EDGE_U = 0.3
#: Radius of the middle of the mark, in radii of the rim.
_MARK = 0.65
# A camera beside the top.  The numbers are of its film in tests/levilab/pipelines/video/test_analysis.py; that the
# constants suit other marks is a guess.
#: The mark is in front within this angle [turns]: u of the spin is 0.36 mHz; with 0.08 it is 0.41, with 0.2 0.57 mHz.
_FRONT = 0.15
#: The mark is seen where its pattern describes this share of what it describes at best: u of the spin is the same with
#: 0.9, and four times as large with 0.5.
_SHOWS_MARK = 0.8
#: The mark hides an end of the side that is nearer than this [turns]: in ten films of the cross-check 99 % of the
#: places are within 75 µm, none beyond 3.3 u; with 0.13 within 89 µm, to 7.3 u; 0.18 leaves 31 % fewer, and 75 µm.
_END = 0.15
#: A mark that turns more slowly would be seen in front in all pictures [Hz].
_STANDS = 1.0
#: The nearest choice is the one that was meant if it is nearer than the next one by this factor.
_NEARER = 0.5
#: A spin that describes the whole film worse, by this factor of u, is none.
_WORSE = 10.0
#: A slope of the spin counts from this number of standard uncertainties on.
_FALLS = 3.0
#: A top that is farther out than this many times its usual distance from its mean place, and stays so, falls.
_LEAVES = 2.0
#: Share of the pictures in which it is nearer than the usual distance.
_USUAL = 0.95


@dataclass(frozen=True, eq=False)
class FilmReadings(Readings):
    """A film.

    Attributes:
        film: properties that the file states.
        head: first bytes and size of the file, by which the same film is found again.
        warnings: about the file.
    """

    film: Film
    head: Array
    warnings: tuple[str, ...] = ()

    compared: ClassVar[tuple[str, ...]] = ("head",)


def _head_of(path: Path) -> bytes:
    """Return the first bytes of a film.  Raises DoesNotSuit for another file, and without the extra."""
    with file_errors(path), path.open("rb") as stream:
        head = stream.read(_HEAD)
    if kind_of_bytes(head, path.suffix) is not AUDIO:
        raise DoesNotSuit("{path:s}: holds no film that can be read: give the file that the camera wrote", path)
    try:
        check_reader(path)
    except NoFilm as error:
        raise DoesNotSuit(text_of(error)) from error
    return head


def read_film(path: Path, options: VideoOptions) -> FilmReadings:
    """Return the head of a film.  Raises DoesNotSuit for other files, and where no scale is given; UsageError."""
    head = _head_of(path)
    given = [name for name in ("scale", "rim", "base") if getattr(options, f"{name}_m") is not None]
    wanted = Text(
        "`rim`, the diameter of the top's rim; `base`, the outer diameter of the base; or `scale`, metres in a pixel"
    )
    if not given:
        raise DoesNotSuit("{path:s}: one scale is expected, none is given: {wanted}", path=path, wanted=wanted)
    if len(given) > 1:
        several = "one scale is expected, {given} are given: {wanted}"
        raise UsageError("scale", Text(several, given=enumeration(given), wanted=wanted))
    camera, height = options.camera_m, options.height_m
    if (camera is None) != (height is None):
        raise UsageError("camera", "goes with `height`: the top is nearer to the camera than the base")
    if options.beside and (base := [name for name in ("base", "camera", "stem") if getattr(options, f"{name}_m")]):
        raise UsageError(base[0], "goes with a camera above the top: for one beside it give `rim` or `scale`")
    if camera is not None and (options.scale_m is not None or not 0 < (height or 0) < camera):
        raise UsageError("camera", "goes with `base` or `rim`, and is greater than `height`")
    if options.stop_s is not None and (options.start_s or 0.0) >= options.stop_s:
        after = Text("a time after `start` = {start:g} is expected", start=options.start_s)
        raise UsageError("stop", after, value=options.stop_s)
    return FilmReadings(open_film(path), np.array([*head, path.stat().st_size], dtype=np.float64))


@dataclass(frozen=True, eq=False)
class Video:
    """Place and spin of a top in a film.

    Attributes:
        beside: the camera is beside the top; else above.
        start: of the first picture, by the file [s].
        time: of the place, shape (n,) [s].
        x: to the right, from `origin`, shape (n,) [m].
        y: upwards in the picture, which is the height from beside, shape (n,) [m].
        u: standard uncertainties of x and y, without that of the scale, shape (n, 2) [m].
        scale: at the top [m a pixel].
        origin: middle of the base where it gives the scale, else the mean place [pixels].
        radius: of the rim [pixels].
        base: its circle; None: not seen.
        mark: angle of the mark in the first picture; None: none turns.
        turning: None: no mark turns, or the spin is in doubt.
        choices: spins that describe the mark, seen from above, counter-clockwise is positive [Hz].
        precession: in the middle of the film, by the place; None: it does not stand out [Hz].
        leaning: by a dot on the stem; None: not seen.
        rising: by the size of the rim; None: the distance of the camera is not known.
        fall: when the top fell; None: it floats to the end [s].
        spin_at_fall: None: not known [Hz].
        warnings: doubts about the numbers, and parts of the film that are left out.
    """

    beside: bool
    start: float
    time: Array
    x: Array
    y: Array
    u: Array
    scale: Estimate
    origin: tuple[float, float]
    radius: float
    base: Circle | None
    mark: float | None
    turning: Turning | None
    choices: tuple[float, ...]
    precession: Estimate | None
    leaning: Leaning | None
    rising: Rising | None
    fall: Estimate | None
    spin_at_fall: Estimate | None
    warnings: tuple[str, ...]

    @property
    def spin(self) -> Estimate | None:
        """Spin in the middle of the film, without its sense."""
        found = self.turning
        return Estimate(abs(found.frequency), found.u_frequency, "Hz") if found else None

    @property
    def chirp(self) -> Estimate | None:
        """Its slope."""
        found = self.turning
        return Estimate(found.chirp * np.sign(found.frequency), found.u_chirp, "Hz/s") if found else None

    @property
    def pictures(self) -> str:
        """Number and times of the pictures, as text."""
        steps = np.diff(self.time) * 1e3
        even = np.ptp(steps) < _EVEN_MS
        return Text(
            "{n} pictures in {time:.2f} s, {step:.2f} ms apart"
            if even
            else "{n} pictures in {time:.2f} s, {least:.2f} to {most:.2f} ms apart",
            n=self.time.size,
            time=float(np.ptp(self.time)),
            step=float(np.median(steps)),
            least=float(steps.min()),
            most=float(steps.max()),
        )

    @property
    def text(self) -> str:
        """Place, spin, precession and fall, in a few sentences."""
        return Sentences(*self._sentences())

    def _sentences(self) -> Iterator[str]:
        wide, high = (float(1e3 * np.ptp(one)) for one in (self.x, self.y))
        yield Text(
            "{pictures}: x stays within {wide:.2f} mm and {axis} within {high:.2f} mm, u of a place is {u:.3f} mm.",
            pictures=self.pictures,
            wide=wide,
            axis="z" if self.beside else "y",
            high=high,
            u=float(1e3 * np.median(self.u)),
        )
        if self.spin and self.turning:
            sense = "clockwise" if self.turning.frequency > 0 else "counter-clockwise"
            said = "The spin is {spin:n} in the middle of the film, {sense} seen from above."
            yield Text(said, spin=with_uncertainty(self.spin), sense=sense)
        if self.precession:
            yield Text("The precession is {precession:n}.", precession=with_uncertainty(self.precession))
        if self.leaning and self.leaning.middle and self.leaning.tilt:
            said = "The precession by the lean is {precession:n}, with a tilt of {tilt:n}."
            middle, tilt = self.leaning.middle, self.leaning.tilt
            yield Text(said, precession=with_uncertainty(middle), tilt=with_uncertainty(tilt))
        if self.rising and self.rising.swing:
            yield Text("The top swings up and down at {swing:n}.", swing=with_uncertainty(self.rising.swing))
        if self.fall:
            spin = self.spin_at_fall
            at = Text(", at a spin of {spin:n}", spin=with_uncertainty(spin)) if spin else ""
            yield Text("The top falls at {fall:n} of the film{at}.", fall=with_uncertainty(self.fall), at=at)


class VideoAnalysis(EachAlone[FilmReadings, Video, VideoOptions]):
    """Films, each by itself."""


def analyze_source(source: Source[FilmReadings], options: VideoOptions) -> Video:
    """Follow the top in a film and find its spin.  Raises AnalysisError: no top that can be followed; DataError."""
    film = source.readings.film
    bar = ShareBar("following the top", line_every=30.0)
    try:
        start, stop = options.start_s or 0.0, np.inf if options.stop_s is None else options.stop_s
        followed = follow(film, start, stop, bar, with_dot=bool(options.stem_m), beside=options.beside)
        return _video(film, options, followed)
    finally:
        bar.close()


def no_run(run: Run, _: InputOptions) -> FilmReadings:
    """Raise DoesNotSuit: a run holds no film."""
    raise DoesNotSuit("{path:s}: is a run, a film is expected", path=run.folder)


def _video(film: Film, options: VideoOptions, followed: Followed) -> Video:
    if film.captured and options.rate is None and film.captured > _SLOWER * followed.rate:
        raise SlowMotion(rate=followed.rate, captured=film.captured, spin=None)
    factor = 1.0 if options.rate is None else followed.rate / options.rate
    line_time = options.line_time_s or 0.0
    times, rate = factor * followed.times, followed.rate / factor
    phases = phases_of(followed.profiles)
    angles = 2 * np.pi * (phases.phase + phases.angle)
    if options.beside:  # the mark is seen in front, and its row stays
        front = np.abs((phases.phase + phases.angle + 0.5) % 1 - 0.5) < _FRONT
        marked = (phases.share > _SHOWS_MARK * np.quantile(phases.share, 0.95)) & front
        rows = followed.y
    else:
        marked = np.ones(times.size, dtype=bool)
        places = without_pull(followed.x + 1j * followed.y, phases.phase)
        followed = replace(followed, x=places.real, y=places.imag)
        rows = followed.y + _MARK * followed.radius * np.sin(angles)
    late = np.zeros_like(rows) if line_time else rows
    seen = times + line_time * rows
    scale, base = _scale(film, options, followed), followed.base
    assert scale.value is not None
    size = scale.value
    aside = options.beside * size * (followed.x - followed.x.mean())
    turning, choices, problem = _turn(
        seen[marked], _part(phases, marked), late[marked], aside[marked], options=options, rate=rate
    )
    if options.beside and turning is not None:
        clear = _mark_is_off_the_ends(seen, phases, marked, turning)
        followed, times = _of_pictures(followed, clear), times[clear]
        turning = replace(turning, smooth=np.interp(times, seen[marked], turning.smooth))
    centred = options.base_m is not None and base is not None
    left, up = (base.x, base.y) if centred and base else (float(followed.x.mean()), float(followed.y.mean()))
    times, x, y = times + line_time * followed.y, size * (followed.x - left), size * (up - followed.y)
    away = _distance(options)
    leaning, rising = None, None
    if options.beside:
        leaning, rising = leaning_of(times, np.sin(followed.turn)), rising_of(times, y)
    elif options.stem_m:
        leaning = leaning_of(times, _lean(film, options, followed, phases, size))
    if away:
        rising = rising_of(times, away * (1 - followed.radius.mean() / followed.radius))
    fall, at_fall = _fall(times, x, y, turning, 1 / rate) if followed.ended == "lost" else (None, None)
    return Video(
        options.beside, float(followed.times[0]), times, x, y, size * followed.u, scale, (left, up),
        float(np.median(followed.radius)), base, float(angles[0]) if choices and not options.beside else None, turning,
        choices, None if options.beside else _precession(times, x + 1j * y), leaning, rising, fall, at_fall,
        (*_notes(options, followed, leaning), *_notes_on_spin(turning, choices, problem, rate, options)),
    )  # fmt: skip


def _part(phases: Phases, chosen: NDArray[np.bool_]) -> Phases:
    return replace(phases, phase=phases.phase[chosen], u=phases.u[chosen], share=phases.share[chosen])


def _of_pictures(followed: Followed, chosen: NDArray[np.bool_]) -> Followed:
    """Return the top in some of the pictures."""
    count = followed.times.size
    columns = {name: value for name, value in vars(followed).items() if np.shape(value)[:1] == (count,)}
    return replace(followed, **{name: value[chosen] for name, value in columns.items()})


def _mark_is_off_the_ends(
    times: Array, phases: Phases, marked: NDArray[np.bool_], turning: Turning
) -> NDArray[np.bool_]:
    """Return in which pictures the mark does not hide an end of the side, which shifts the place by a pixel."""
    speed = np.interp(times, times[marked], turning.smooth)
    turns = np.concatenate([[0.0], np.cumsum(np.diff(times) * (speed[1:] + speed[:-1]) / 2)])
    start = np.exp(2j * np.pi * (phases.phase + phases.angle - turns)[marked]).mean()
    angle = turns + np.angle(start) / (2 * np.pi)
    return np.asarray(np.abs(angle % 0.5 - 0.25) > _END)


def _distance(options: VideoOptions) -> float | None:
    """Return the distance of the camera from the rim [m]; None: not known."""
    return options.camera_m - options.height_m if options.camera_m and options.height_m else None


def _lean(film: Film, options: VideoOptions, followed: Followed, phases: Phases, size: float) -> NDArray[np.complex128]:
    """Return how far the dot is from the middle of the rim, over its height, y upwards, shape (n,)."""
    middle, stem, away = complex(film.width - 1, film.height - 1) / 2, options.stem_m or 1.0, _distance(options)
    nearer = 1 - stem / away if away else 1.0  # the dot is nearer to the camera than the rim
    dots = middle + nearer * (followed.dots - middle)
    offset = dots - followed.x - 1j * followed.y
    seen = np.isfinite(offset)
    offset[seen] = without_pull(offset[seen], phases.phase[seen]) if seen.sum() > _FEWEST else offset[seen]
    return np.asarray(offset.conj() * size / stem)


def _fall(times: Array, x: Array, y: Array, turning: Turning | None, step: float) -> tuple[Estimate, Estimate | None]:
    """Return when a top that is lost fell, and its spin then: it left its place, and was not seen any more."""
    out = np.hypot(x - np.median(x), y - np.median(y))
    left = float(times[out <= _LEAVES * np.quantile(out, _USUAL)][-1])
    lost = float(times[-1]) + step
    fall = Estimate((left + lost) / 2, (lost - left) / np.sqrt(12), "s")
    if turning is None or turning.time.size < _FEWEST:
        return fall, None
    return fall, spin_at_fall(turning.time, np.abs(turning.spin), None, (left, lost))


def _precession(times: Array, places: NDArray[np.complex128]) -> Estimate | None:
    """Return the precession in the window in the middle of the film in which it stands out."""
    try:
        windows = [one for one in swings_of(times, places) if one.frequency.size > 2]
    except AnalysisError:
        return None
    if not windows:
        return None
    one = windows[len(windows) // 2]
    return Estimate(abs(float(one.frequency[2])), float(one.u[2]), "Hz")


def _turn(
    times: Array, phases: Phases, rows: Array, aside: Array, *, options: VideoOptions, rate: float
) -> tuple[Turning | None, tuple[float, ...], str]:
    """Return how the top turned, the spins that describe its mark, and why there is none of these."""
    try:
        found = spins_of_start(times, phases.phase, phases.u)
    except NoMark as error:
        return None, (), text_of(error)
    if options.beside:
        found = [(f, chi) for f, chi in found if abs(f) > _STANDS]
    choices, slow = choices_of(found, options.near)
    if not choices:
        if slow:
            raise SlowMotion(rate=rate, captured=None, spin=slow[0])
        return None, (), "no spin with which a top floats, or of `near`, describes its mark"
    if options.near is not None and len(choices) > 1:
        choices.sort(key=lambda f: abs(abs(f) - (options.near or 0.0)))
        off = [abs(abs(f) - options.near) for f in choices[:2]]
        choices = choices[:1] if off[0] < _NEARER * off[1] else choices
    turnings = {f: turning_of(times, phases.phase, phases.u, rows, aside, start=f) for f in choices}
    best = min(one.u_frequency for one in turnings.values())
    choices = [
        f for f in choices if turnings[f].u_frequency < _WORSE * best
    ]  # the whole film tells more than its middle
    turning = turnings[choices[0]]
    by_slope = len(choices) > 1 and abs(turning.chirp) > _FALLS * turning.u_chirp
    falling = [f for f in choices if f * turning.chirp < 0] if by_slope else []
    seen_from_above = tuple(-f for f in choices)
    played_slowly = bool(slow) and options.rate is None
    if played_slowly or (len(choices) > 1 and len(falling) != 1):
        return None, seen_from_above, ""
    if falling and falling[0] != choices[0]:
        turning = turnings[falling[0]]
    return turning, seen_from_above, ""


def _scale(film: Film, options: VideoOptions, followed: Followed) -> Estimate:
    if options.scale_m is not None:
        return Estimate(options.scale_m, None, "m")
    if options.rim_m is not None:
        diameter, radius, nearer = options.rim_m, float(np.median(followed.radius)), 1.0
    elif followed.base is None:
        raise DataError("{path:s}: no round base is seen round the top: give `rim`, or `scale`", path=film.path)
    else:
        assert options.base_m is not None
        diameter, radius = options.base_m, followed.base.radius
        nearer = 1 - options.height_m / options.camera_m if options.height_m and options.camera_m else 1.0
    value = nearer * diameter / (2 * radius)
    return Estimate(value, value * _EDGE_U / radius, "m")


def _notes(options: VideoOptions, seen: Followed, leaning: Leaning | None) -> Iterator[Text]:
    if seen.ended:
        why = {"lost": "the rim is lost", "hand": "a large part of the view changes, as by a hand,"}[seen.ended]
        yield Text("{why} after {time:.2f} s: the rest of the film is left out", why=why, time=float(seen.times[-1]))
    if seen.missed:
        yield Text("no rim is seen in {n} pictures in between; they are left out", n=seen.missed)
    if options.stem_m is not None and leaning is None:
        yield Text(
            "no dot is seen on the stem: a light one is expected near the middle of the rim, with dark round it, and "
            "the mark beyond a third of the radius"
        )
    if options.base_m is not None and options.camera_m is None:
        yield Text(
            "the scale is that of the base, and the top is nearer to the camera: places are too large by height over "
            "distance; say both by `height` and `camera`, or give `rim`"
        )


def _notes_on_spin(
    turning: Turning | None, choices: tuple[float, ...], problem: str, rate: float, options: VideoOptions
) -> Iterator[Text]:
    way = ("clockwise", "counter-clockwise")
    listed = tuple(Text("{hz:.3f} Hz ({way})", hz=abs(f), way=way[f > 0]) for f in choices)
    if problem:
        yield Text("no spin: {problem}", problem=problem)
    elif turning is None:
        slow = "" if options.rate else Text("; or, if the film is in slow motion, the true `rate`")
        said = "no spin: at {rate:.4g} pictures in a second it may be one of {listed}; say which by `near`{slow}"
        yield Text(said, rate=rate, listed=listed, slow=slow)
    elif len(choices) > 1:  # the slope chose
        taken = "of {listed}, which look the same, the one that slows down is taken, as a free top does"
        yield Text(taken, listed=listed)
