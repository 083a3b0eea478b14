"""The motion of a top as far as an instrument looks, under a drive that changes; put back when it has fallen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from levilab.errors import LeftRange
from levilab.simulator.kernels.motion import ARM, TIME, L, N, R, V
from levilab.simulator.keys import SceneError
from levilab.simulator.single import simulate
from levilab.simulator.start import start_of
from levilab.world.timeline import Timeline

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from levilab.simulator.scene import Scene
    from levilab.simulator.trajectory import Trajectory

Array = NDArray[np.float64]

#: The motion is worked out so much at a time [s], to this error of place [m] and axis [rad] at the end of each piece,
#: with so many states a second: between two of them a tape turns evenly to 1e-4 of a turn.
PIECE_S, TOLERANCE, RATE = 1.0, 1e-7, 400.0

#: Nothing moves in so short a time [s].
_AT_ONCE = 1e-9

#: A tape is seen at every turn, so the attitude is needed; an aligned moment has it with this transverse part, which is
#: less than the rounding of the other.
_NEGLIGIBLE_TILT = 1e-17


@dataclass(frozen=True)
class _Flying:
    """A piece of a top's life.

    scene: with the drive; state: where it begins, shape (18,); step: of the integration [s]; times [s], turns of the
    tape and, as part of them, turns of the washers that it is on beside the top then, shape (n,) each; stem:
    displacement of the stem along x [m] and its rate [m/s] then, shape (2, n); lift: height of the rim towards x above
    the base [m] then, shape (n,).
    """

    scene: Scene
    state: Array
    step: float
    times: Array
    turns: Array
    slips: Array
    stem: NDArray[np.float32]
    lift: NDArray[np.float32]

    @property
    def start(self) -> float:
        """When it begins [s]."""
        return float(self.state[TIME])


@dataclass(frozen=True)
class _Absent:
    """No top is up from this time on [s]."""

    start: float


class Flight:
    """A top from time 0 on; before, and after it has fallen, there is none.

    Args:
        scene: its drive is left out, `change` brings drives.
        put_back_after_s: so long after a fall the top is put back to where the scene starts [s]; None: it is not.
        stem_height_m: of the place on the stem that is looked at, above the centre of mass [m].

    Raises:
        SceneError: the scene has no motion.
    """

    def __init__(self, scene: Scene, put_back_after_s: float | None = None, *, stem_height_m: float = 0.03) -> None:
        if scene.observed != "motion":
            raise SceneError(f"observed = {scene.observed}: a scene for the bench is expected to have motion")
        transverse, axial = scene.top.moment_tilt
        self._scene = scene.changed(
            {"drive.waveform": "off", "drive.off_s": None, "top.moment_tilt": [transverse or _NEGLIGIBLE_TILT, axial]}
        )
        self._put_back_after_s, self._stem_height = put_back_after_s, stem_height_m
        self._pieces: Timeline[_Flying | _Absent] = Timeline(-math.inf, _Absent(-math.inf))
        self._step: float | None = None
        # what comes next: a top in this state, or none until a new one is put there; and when [s]
        self._state: Array | None = self._begin(0.0)
        self._known = 0.0
        self._slip = 0.0  # of the washers then [turns]

    def prepare(self) -> None:
        """Have the simulator's code compiled, or brought from the disk, for whatever drive may come."""
        for waveform in ("off", "sine", "square"):
            simulate(self._scene.changed({"drive.waveform": waveform}), 1e-3, rate=None)

    @property
    def driven(self) -> bool:
        """Whether there is a drive at last."""
        return self._scene.drive.waveform != "off"

    def change(self, time: float, drive: Mapping[str, Any]) -> None:
        """From this time on the drive is this: keys of the scene's table; what was seen of later times is gone."""
        self.look(time)
        self._step = None  # what another drive needs
        now = self._pieces.at(time)
        if isinstance(now, _Flying):
            self._pieces.cut(time)
            self._slip = float(np.interp(time, now.times, now.slips))
            self._state, self._known = _later(now, time), time
        else:
            self._pieces.cut(math.nextafter(time, math.inf))
            self._wait(now.start)
        self._scene = self._scene.changed({f"drive.{key}": value for key, value in drive.items()})

    def put_back(self, time: float) -> None:
        """At this time the top is put back to where the scene starts, if it is down."""
        self.look(time)
        if isinstance(self._pieces.at(time), _Absent):
            self._pieces.cut(math.nextafter(time, math.inf))
            self._state, self._step, self._known = self._begin(time), None, time

    def forget(self, before: float) -> None:
        """Drop what ended before this time [s]."""
        self._pieces.forget(before)

    def turns(self, times: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Turns of the tape past a fixed spot on the rim, and whether there is a top; shape (n,) each, as the times.

        Whole turns are not counted on from one piece to the next.
        """
        self.look(float(times.max(initial=0.0)))
        turns, up = np.zeros_like(times), np.zeros(times.shape, dtype=np.bool_)
        for piece, part in self._pieces.pieces(times):
            if isinstance(piece, _Flying):
                turns[part], up[part] = np.interp(times[part], piece.times, piece.turns), True
        return turns, up

    def tape(self, times: Array) -> tuple[Array, Array, Array]:
        """What is to be known of the light, shape (n,) each, as the times.

        Turns as above; their rate [Hz], 0 without a top; height of the rim above the base where the fixed spot is [m].
        """
        self.look(float(times.max(initial=0.0)))
        turns, rate, lift = np.zeros_like(times), np.zeros_like(times), np.zeros_like(times)
        for piece, part in self._pieces.pieces(times):
            if isinstance(piece, _Flying):
                turns[part], rate[part] = np.interp(times[part], piece.times, piece.turns), _rate(piece)
                lift[part] = np.interp(times[part], piece.times, piece.lift)
        return turns, rate, lift

    def first_lift(self) -> float:
        """The mean of this height over the first second without a drive, in which a top bobs once or more [m]."""
        self.look(0.0)
        piece = self._pieces.at(0.0)
        return float(piece.lift.mean()) if isinstance(piece, _Flying) else self._scene.start.position_m[2]

    def passages(self, place: Callable[[float], float], start: float, stop: float) -> Array:
        """When the tape's turn has a place in [0, 1) between two times [s], increasing, shape (n,) [s].

        Args:
            place: given the rate of turns [Hz].
            start: the first time [s].
            stop: the second one [s].
        """
        self.look(stop)
        found = [np.empty(0)]
        for piece, end in self._pieces.between(start, stop):
            if isinstance(piece, _Flying) and piece.times.size > 1:
                turns, at = piece.turns, place(_rate(piece))
                whole = np.arange(math.floor(turns[0]) - 1, math.ceil(turns[-1]) + 1) + at
                whole = whole[(whole >= turns[0]) & (whole < turns[-1])]
                times = np.interp(whole, turns, piece.times)
                found.append(times[(times >= start) & (times < min(stop, end))])
        return np.concatenate(found)

    def stem(self, times: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Displacement of the stem along x [m], and whether there is a top; shape (n,) each, as the times.

        Between two states a cubic goes through both displacements with their rates: of the nutation, 42 Hz, it misses
        5e-4 of the amplitude.
        """
        self.look(float(times.max(initial=0.0)))
        place, up = np.zeros_like(times), np.zeros(times.shape, dtype=np.bool_)
        for piece, part in self._pieces.pieces(times):
            if isinstance(piece, _Flying):
                place[part], up[part] = _cubic(times[part], piece.times, *piece.stem), True
        return place, up

    # --- as far as an instrument looks ---

    def look(self, until: float) -> None:
        """Work the motion out up to this time [s]."""
        while self._known <= until:
            if self._state is None:
                self._state, self._step = self._begin(self._known), None
            self._advance(self._state)

    def _begin(self, time: float) -> Array:
        """The state of a top that is put there at this time, shape (18,)."""
        state = start_of(self._scene)
        state[TIME] = time
        self._slip = 0.0
        return state

    def _advance(self, state: Array) -> None:
        """The next piece of the life of a top in this state."""
        begin = float(state[TIME])
        try:
            motion = self._motion(state)
        except LeftRange:  # it has hit the base, where the field is infinite
            self._fall(begin)
            return
        # of the states only the first is kept: a bench may run for hours
        slips = self._slip + _slips(motion)
        self._slip = float(slips[-1])
        seen = (motion.time.copy(), _turns(motion) + slips, slips, _stem(motion, self._stem_height), _lift(motion))
        self._pieces.append(begin, _Flying(self._scene, state, motion.accuracy.step, *seen))
        if motion.fell is not None:
            self._fall(motion.fell.time)
        else:
            self._state, self._known = motion.states[-1].copy(), float(motion.time[-1])

    def _motion(self, state: Array) -> Trajectory:
        """A piece with the step of the last one, if that is good enough."""
        options: dict[str, Any] = {"tolerance": TOLERANCE, "rate": RATE, "start": state}
        if self._step is not None:
            motion = simulate(self._scene, PIECE_S, step=self._step, **options)
            if motion.accuracy.reached:
                return motion
        motion = simulate(self._scene, PIECE_S, **options)
        self._step = motion.accuracy.step
        return motion

    def _fall(self, time: float) -> None:
        self._pieces.append(time, _Absent(time))
        self._wait(time)

    def _wait(self, fallen: float) -> None:
        """Nothing happens until the top is put back."""
        self._state, self._known = None, math.inf if self._put_back_after_s is None else fallen + self._put_back_after_s


def _later(piece: _Flying, time: float) -> Array:
    """The state within a piece at this time, shape (18,)."""
    state = piece.state.copy()
    if time - piece.start > _AT_ONCE:
        motion = simulate(piece.scene, time - piece.start, step=piece.step, rate=None, start=state)
        state = motion.states[-1].copy()
    state[TIME] = time
    return state


def _slips(motion: Trajectory) -> Array:
    """Turns of the washers beside the top since the first sample, shape (n,): slower, so negative; 0 if none are loose.

    The trapezium rule: a slip changes in seconds, and the samples are 2.5 ms apart.
    """
    if motion.scene.washers.inertia_kg_m2 == 0:
        return np.zeros(motion.time.size)
    rate = motion.washer_spin_hz - motion.spin_hz
    steps = np.diff(motion.time) * (rate[1:] + rate[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(steps)])


def _turns(motion: Trajectory) -> Array:
    """Turns of the tape past a spot that lies on the rim in the direction of x while the top stands on the axis."""
    arm, place = motion.states[:, ARM], motion.position
    spot = np.arctan2(-place[:, 1], motion.scene.top.magnet_radius_m - place[:, 0])
    return np.asarray(np.unwrap(np.arctan2(arm[:, 1], arm[:, 0]) - spot) / (2 * np.pi))


def _rate(piece: _Flying) -> float:
    """The mean rate of turns in a piece [Hz], which wobble and drag change by some per cent of it."""
    if piece.times.size < 2:
        return 1.0
    return float((piece.turns[-1] - piece.turns[0]) / (piece.times[-1] - piece.times[0]))


def _lift(motion: Trajectory) -> NDArray[np.float32]:
    """Height of the rim towards x above the base, shape (n,) [m]: it bobs with the top and is tilted with it."""
    return np.asarray(motion.position[:, 2] - motion.scene.top.magnet_radius_m * motion.axis[:, 0], dtype=np.float32)


def _stem(motion: Trajectory, height: float) -> NDArray[np.float32]:
    """Displacement of the stem along x and its rate at a height above the centre of mass, shape (2, n) [m, m/s].

    Single precision: a displacement of 5 mm is right to 0.5 nm.
    """
    states = motion.states
    axis = states[:, N]
    rate = (
        states[:, L][:, 1] * axis[:, 2] - states[:, L][:, 2] * axis[:, 1]
    ) / motion.scene.top.inertia_transverse_kg_m2
    moving = states[:, V][:, 0] + height * rate
    return np.asarray([states[:, R][:, 0] + height * axis[:, 0], moving], dtype=np.float32)


def _cubic(times: Array, nodes: Array, values: NDArray[np.float32], rates: NDArray[np.float32]) -> Array:
    """The cubic Hermite interpolation of values [u] and their rates [u/s] at nodes [s], shape (n,)."""
    if nodes.size < 2:
        return np.full_like(times, values[0])
    k = np.clip(np.searchsorted(nodes, times, side="right") - 1, 0, nodes.size - 2)
    span = nodes[k + 1] - nodes[k]
    s = (times - nodes[k]) / span
    low, high, left, right = values[k], values[k + 1], rates[k] * span, rates[k + 1] * span
    return np.asarray(
        low + s * (left + s * (3 * (high - low) - 2 * left - right + s * (2 * (low - high) + left + right)))
    )
