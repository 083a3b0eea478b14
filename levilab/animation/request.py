"""What is to be animated → the file, in one of three formats."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from levilab.animation.film import Film, as_gif, as_mp4, check_encoder
from levilab.animation.page import FEWEST_A_TURN, POSES_A_TURN, as_page, columns_of, most_poses, three_for_page
from levilab.animation.poses import poses_of, turn_rate
from levilab.animation.words import span_text, speed_text
from levilab.errors import UsageError
from levilab.files import check_writable, replace_atomically, writing
from levilab.motion.summary import Summary
from levilab.simulator.compilation import announce_compilation
from levilab.simulator.scene import Scene

Progress = Callable[[float], None]


#: Speeds that a film may have, as parts of the real one.
_SLOWEST, _FASTEST = 1e-4, 10.0
#: Pictures of a film at most: 3000 of a GIF need some minutes and 0.7 GB of memory.
_MOST_PICTURES = 3000
#: Poses for each picture of a film, for its path.
_POSES_A_PICTURE = 3
#: Least poses per second of a page: the wobble is faster than the spin of a slow top.
_LEAST_RATE_HZ = 240.0
#: With fewer pictures in a turn the eye loses which way the top turns.
_PICTURES_A_TURN = 4


@dataclass(frozen=True)
class _Format:
    """A kind of file.

    Attributes:
        span_s: how much of the motion is shown unless a span is given [s].
        speed: at which, as a part of the real one.
        pictures_per_s: of a film; 0 of a page, whose pictures the browser makes.
        size: of a film [pixels].
        encode: makes the file's bytes of a film.
        check: raises what is missing.
    """

    span_s: float
    speed: float
    pictures_per_s: float = 0.0
    size: tuple[int, int] = (0, 0)
    encode: Callable[[Film, Progress], bytes] | None = None
    check: Callable[[], object] = lambda: None


FORMATS: dict[str, _Format] = {
    ".html": _Format(10.0, 0.1, check=three_for_page),
    ".gif": _Format(1.0, 0.05, 20.0, (480, 480), as_gif),
    ".mp4": _Format(1.0, 0.05, 30.0, (640, 640), as_mp4, check_encoder),
}


@dataclass(frozen=True)
class AnimationRequest:
    """What is to be animated.

    Attributes:
        path: of the file, which ends in .html, .gif or .mp4.
        start, stop: the span [s]; None: the format's usual one, from the start, or up to the fall of a top that falls.
        speed: as a part of the real one; None: the format's usual one.
    """

    path: Path
    start: float | None = None
    stop: float | None = None
    speed: float | None = None

    @property
    def format(self) -> _Format:
        """That of the file's name.  Raises UsageError."""
        try:
            return FORMATS[self.path.suffix.lower()]
        except KeyError:
            raise UsageError(
                "animate",
                "the name of an animation ends in .html (a page to turn and to scrub), .gif or .mp4",
                value=self.path,
            ) from None

    @property
    def playing_speed(self) -> float:
        """The speed that was chosen, or the format's usual one."""
        return self.format.speed if self.speed is None else self.speed


def check_request(request: AnimationRequest, scene: Scene, duration: float) -> None:
    """Check a request before anything is simulated.

    Args:
        request: the animation.
        scene: the simulated scene.
        duration: for how long [s].

    Raises:
        UsageError: a value that makes no sense.
        MissingThree, MissingEncoder: a library is missing.
    """
    chosen = request.format
    if scene.observed == "spin":
        raise UsageError(
            "animate", "the scene has no motion: observed = spin; take observed = motion", value=request.path
        )
    if not duration > 0:
        raise UsageError("duration", "an animation needs a duration above 0 s", value=duration)
    first = request.start or 0.0
    if not 0 <= first < duration:
        raise UsageError(
            "animate_from", f"a time from 0 and below the duration of {duration:g} s is expected", value=first
        )
    if request.stop is not None and not first < request.stop <= duration:
        raise UsageError(
            "animate_to",
            f"a time above {first:g} s and up to the duration of {duration:g} s is expected",
            value=request.stop,
        )
    if not _SLOWEST <= request.playing_speed <= _FASTEST:
        raise UsageError(
            "animate_speed",
            f"a number from {_SLOWEST:g} to {_FASTEST:g} is expected, as 0.05 for a twentieth of the real speed",
            value=request.playing_speed,
        )
    chosen.check()
    with writing(request.path, "choose another place with `animate`"):
        check_writable(request.path)


def _check_pictures(chosen: _Format, span: float, speed: float) -> None:
    pictures = span / speed * chosen.pictures_per_s
    if pictures > _MOST_PICTURES:
        longest = _MOST_PICTURES / chosen.pictures_per_s * speed
        raise UsageError(
            "animate_to",
            f"{span:.4g} s at speed {speed:g} are {pictures:.0f} pictures, at most {_MOST_PICTURES} are drawn: "
            f"choose a span of at most {longest:.3g} s, or a higher `animate_speed`",
        )


def animate(
    request: AnimationRequest, summary: Summary, message: Callable[[str], None], progress: Progress | None = None
) -> str:
    """Animate a span of a simulated motion; an interrupted animation leaves no file.

    Args:
        request: checked by `check_request`.
        summary: of the motion.
        message: called with what a viewer should know.
        progress: called with the share that is done.

    Returns:
        A description of the file's content.

    Raises:
        UsageError: the top was lost before the span, or the file would become too large.
        CannotWrite: the file cannot be written.
    """
    chosen = request.format
    if request.start is not None and request.start >= summary.end:
        raise UsageError("animate_from", f"the top was lost after {summary.end:.4g} s already", value=request.start)
    start, stop = _span(request, summary.end, fell=summary.motion.fell is not None)
    speed = request.playing_speed
    progress = progress or (lambda _: None)
    if chosen.encode is None:
        count = _count_for_page(summary.motion.scene, stop - start, turn_rate(summary.motion))
    else:
        _check_pictures(chosen, stop - start, speed)
        count = _POSES_A_PICTURE * max(round((stop - start) / speed * chosen.pictures_per_s), 1)
    with announce_compilation(message):
        poses = poses_of(summary.motion, start, stop, count)
    if chosen.encode is None:
        content = as_page(poses, summary, speed)
    else:
        if note := _stroboscopic(turn_rate(summary.motion), speed, chosen.pictures_per_s):
            message(note)
        content = chosen.encode(Film(poses, speed, chosen.pictures_per_s, chosen.size, _POSES_A_PICTURE), progress)
    with writing(request.path, "choose another place with `animate`"):
        request.path.parent.mkdir(parents=True, exist_ok=True)
        replace_atomically(request.path, content)
    return f"the motion {span_text(poses)}, at {speed_text(speed)}"


def _span(request: AnimationRequest, end: float, *, fell: bool = False) -> tuple[float, float]:
    """Return the first and last time to show [s]: as requested, up to this end; the last seconds of a top that fell."""
    usual = request.format.span_s
    stop = end if request.stop is None else min(request.stop, end)
    if request.start is not None:
        return request.start, stop if request.stop is not None else min(request.start + usual, end)
    if request.stop is not None or fell:
        return max(stop - usual, 0.0), stop
    return 0.0, min(usual, end)


def _count_for_page(scene: Scene, span: float, turns: float) -> int:
    """Return the number of intervals between the poses of a page: enough for each turn, within what fits.

    Args:
        scene: whose poses they are.
        span: of the animation [s].
        turns: of the fastest part in a second.

    Raises:
        UsageError: even the fewest poses do not fit.
    """
    most = most_poses(len(columns_of(scene))) - 1
    turning = max(turns, _LEAST_RATE_HZ / POSES_A_TURN)
    wanted, least = math.ceil(span * turning * POSES_A_TURN), math.ceil(span * turning * FEWEST_A_TURN)
    if least > most:
        longest = most / (turning * FEWEST_A_TURN)
        raise UsageError(
            "animate_to",
            f"{span:.4g} s at {turning:.3g} turns a second are {least} poses, a page of at most 1.5 MB holds {most}: "
            f"choose a span of at most {longest:.3g} s with `animate_from` and `animate_to`",
        )
    return max(min(wanted, most), 1)


def _stroboscopic(turns: float, speed: float, pictures_per_s: float) -> str:
    """Return a warning about a film that shows too few pictures of a turn; empty for others."""
    if turns * speed * _PICTURES_A_TURN <= pictures_per_s:
        return ""
    seen, slower = pictures_per_s / turns / speed, pictures_per_s / turns / _PICTURES_A_TURN
    digits = 10.0 ** math.floor(math.log10(slower))
    return (
        f"note: the film has {seen:.1f} pictures of each turn, so the top seems to turn slowly, to stand or to turn "
        f"backwards; with `animate_speed` = {math.floor(slower / digits) * digits:.1g} it does not"
    )
