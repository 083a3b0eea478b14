"""The motion of a top under a drive that changes, simulated as far as an instrument needs it."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.errors import LeftRange
from levilab.simulator.kernels.motion import ARM, TIME, L, N, R, V
from levilab.simulator.keys import SceneError
from levilab.simulator.model import with_attitude
from levilab.simulator.scene import Scene
from levilab.simulator.single import simulate, simulate_at_step
from levilab.simulator.start import start_of
from levilab.simulator.trajectory import Trajectory
from levilab.world.timeline import Timeline
from levilab.world.tumble import tumble

T = TypeVar("T")

#: The motion is simulated in pieces of this length [s], to this error of place [m] and axis [rad] at the end of each,
#: with this number of states per second: between two of them a tape turns evenly to 1e-4 of a turn.
PIECE_S, TOLERANCE, RATE = 1.0, 1e-7, 400.0

#: Pieces whose samples are kept, 15 kB each: of the 600 s that an oscilloscope looks back, and more.
SAMPLED = 700
#: Pieces whose states are kept, for a view.
_REMEMBERED = 4

#: In so short a time [s] no motion is to be simulated.
_AT_ONCE = 1e-9


@dataclass(frozen=True, eq=False)
class _Flying:
    """A piece of motion, from which its samples can be simulated again.

    Attributes:
        scene: with the drive.
        state: at the start, shape (18,).
        step: of the integration [s].
        slip: turns of loose washers relative to the top at the start.
        memory: of bursts that the top triggers, at the start.
    """

    scene: Scene
    state: Array
    step: float
    slip: float
    memory: Array | None

    @property
    def start(self) -> float:
        """Its time [s]."""
        return float(self.state[TIME])


@dataclass(frozen=True, eq=False)
class _Samples:
    """The motion in a piece, as instruments see it.

    Attributes:
        times: of the samples, shape (n,) [s].
        turns: of the tape at these times, shape (n,).
        slips: turns of loose washers relative to the top, shape (n,); the tape is on them, so `turns` contain these.
        stem: displacement of the stem along x [m], and its rate [m/s], shape (2, n).
        lift: height above the base of the rim's point towards x [m], shape (n,).
    """

    times: Array
    turns: Array
    slips: Array
    stem: NDArray[np.float32]
    lift: NDArray[np.float32]

    @property
    def counted(self) -> tuple[Array, float]:
        """Turns that increase, and their mean rate [Hz]; wobble and drag change it by some per cent within the piece.

        The light has no sense: a top that spins backwards shows the pulses of its mirror image.
        """
        if self.times.size < 2:
            return self.turns, 1.0
        rate = float((self.turns[-1] - self.turns[0]) / (self.times[-1] - self.times[0]))
        return self.turns * math.copysign(1.0, rate), abs(rate)


@dataclass(frozen=True, eq=False)
class _Absent:
    """No top is up from a time on.

    Attributes:
        start: the time [s].
        scene, state: of the top that fell then, shape (18,); None: there was none, or it was taken away.
    """

    start: float
    scene: Scene | None = None
    state: Array | None = None


class Flight:
    """A top from a time on; before, and after it has fallen, there is none.

    Args:
        scene: with the top; its drive is ignored, see `change`.
        start: the time [s].
        put_back_after_s: time from a fall until the top starts again as the scene says [s]; None: it stays down.
        stem_height_m: height of the laser's beam on the stem, above the centre of mass [m].

    Raises:
        SceneError: the scene has no motion.
    """

    def __init__(
        self, scene: Scene, put_back_after_s: float | None = None, *, start: float = 0.0, stem_height_m: float = 0.03
    ) -> None:
        if scene.observed != "motion":
            raise SceneError(f"observed = {scene.observed}: a scene for the bench is expected to have motion")
        # the tape's place needs the full attitude
        without_drive = {"drive.waveform": "off", "drive.off_s": None, "drive.ramp_hz_per_s": 0.0}
        self._scene = with_attitude(scene.changed(without_drive))
        self._put_back_after_s, self._stem_height = put_back_after_s, stem_height_m
        self._pieces: Timeline[_Flying | _Absent] = Timeline(-math.inf, _Absent(-math.inf))
        # what comes next: a top in this state, or none until a new one is put there; and when [s]
        self._state: Array | None = (first := self._start_state(start))
        self._first_height = float(first[R][2])
        self._known_until = self._starts = start
        self._slip = 0.0  # of the washers then [turns]
        self._memory: Array | None = None  # of bursts that the top triggers, then
        self._samples: dict[_Flying, _Samples] = {}  # of the latest pieces
        self._states: dict[_Flying, tuple[Array, Array]] = {}  # of those that a view has looked at

    def prepare(self) -> None:
        """Compile the simulator's code, or load it from the disk, for any drive that may come."""
        for waveform in ("off", "sine", "square"):
            simulate(self._scene.changed({"drive.waveform": waveform}), 1e-3, rate=None)

    @property
    def driven(self) -> bool:
        """Whether the latest drive is on."""
        return self._scene.drive.waveform != "off"

    def change(self, time: float, drive: Mapping[str, Any]) -> None:
        """Change the drive from a time on; motion already simulated beyond that time is discarded.

        Args:
            time: [s].
            drive: keys of the scene's table `drive`, and their values.
        """
        self.change_scene(time, {f"drive.{key}": value for key, value in drive.items()})

    def change_scene(self, time: float, values: Mapping[str, Any]) -> None:
        """Change the drive, the top or its surroundings from a time on, as `change` does.

        Args:
            time: [s].
            values: dotted keys of the scene, and their values.
        """
        now = self._piece_at(time)
        if isinstance(now, _Flying):
            self._pieces.cut(time)
            samples = self._samples_of(now)
            self._slip = float(np.interp(time, samples.times, samples.slips))
            (self._state, self._memory), self._known_until = _state_within(now, time), time
        else:
            self._pieces.cut(math.nextafter(time, math.inf))
            self._wait(now.start)
        changed = self._scene.changed(values)
        tables = {key.partition(".")[0] for key in values}
        alone = self._scene.model_copy(update={table: getattr(changed, table) for table in tables})
        self._scene = with_attitude(alone)  # the pieces share all that does not change

    def put_back(self, time: float) -> None:
        """Start the top again at this time, as the scene says, if it has fallen."""
        if isinstance(self._piece_at(time), _Absent):
            self._pieces.cut(math.nextafter(time, math.inf))
            self._state, self._known_until = self._put_by_hand(time), time

    def take_away(self, time: float) -> None:
        """Let no top be there from this time on, neither up nor where it fell."""
        piece = self._piece_at(time)
        if isinstance(piece, _Flying) or piece.state is not None:
            self._pieces.cut(time)
            self._fall(time)

    def forget(self, before: float) -> None:
        """Drop the pieces that ended before this time [s]."""
        self._pieces.forget(before)

    def tape(self, times: Array) -> tuple[Array, Array, Array]:
        """Return what the light of the tape depends on, shape (n,) each.

        Args:
            times: shape (n,) [s].

        Returns:
            Turns, counted upwards whatever the sense; their rate [Hz], 0 without a top; height of the rim above the
            base at that spot [m].
        """
        turns, rate, lift = np.zeros_like(times), np.zeros_like(times), np.zeros_like(times)
        for piece, part in self._flying_pieces(times):
            samples = self._samples_of(piece)
            counted, rate[part] = samples.counted
            turns[part] = np.interp(times[part], samples.times, counted)
            lift[part] = np.interp(times[part], samples.times, samples.lift)
        return turns, rate, lift

    def first_lift(self) -> float:
        """Return the mean height of the rim over the first second [m], in which a top bobs at least once."""
        piece = self._piece_at(self._starts)
        if isinstance(piece, _Flying):
            return float(self._samples_of(piece).lift.mean())
        return self._scene.start.position_m[2]

    def floats(self, time: float) -> bool:
        """Return whether a top is up at this time; `attitude` would simulate the piece once more."""
        return isinstance(self._piece_at(time), _Flying)

    def spin_of_fall(self, time: float) -> float | None:
        """Return the mean spin in a second that ended one to two seconds before the top fell [Hz].

        Later it tumbles, and its tape turns otherwise.  None: a top is up, or it fell within two seconds.
        """
        piece = self._piece_at(time)
        if not isinstance(piece, _Absent) or piece.state is None:
            return None
        return float(self.tape(np.array([piece.start - 2 * PIECE_S]))[1][0]) or None

    def passages(self, place: Callable[[float], float], start: float, stop: float) -> Array:
        """Return when the tape passes a place in its turn, increasing, shape (n,) [s].

        Args:
            place: rate of turns [Hz] → place in [0, 1).
            start: the first time [s].
            stop: the last time [s].
        """
        self.simulate_until(stop)
        found = [np.empty(0)]
        for piece, end in self._pieces.between(start, stop):
            if isinstance(piece, _Flying) and (samples := self._samples_of(piece)).times.size > 1:
                turns, rate = samples.counted
                at = place(rate)
                whole = np.arange(math.floor(turns[0]) - 1, math.ceil(turns[-1]) + 1) + at
                whole = whole[(whole >= turns[0]) & (whole < turns[-1])]
                times = np.interp(whole, turns, samples.times)
                found.append(times[(times >= start) & (times < min(stop, end))])
        return np.concatenate(found)

    def stem(self, times: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the displacement of the stem along x [m], and whether a top is up; shape (n,) each.

        A cubic interpolates between two states, from displacements and rates; it misses 5e-4 of the amplitude of a
        nutation at 42 Hz.

        Args:
            times: shape (n,) [s].
        """
        place, up = np.zeros_like(times), np.zeros(times.shape, dtype=np.bool_)
        for piece, part in self._flying_pieces(times):
            samples = self._samples_of(piece)
            place[part], up[part] = _cubic(times[part], samples.times, *samples.stem), True
        return place, up

    def attitude(self, times: Array) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
        """Return place [m], axis and arm of the top, shape (n, 3) each, and whether one is up, shape (n,).

        The states of a piece are not kept, so a piece is simulated once more, from its start and with its step, when
        the first of these is asked for: 1.5 ms for a second of motion, and nothing as long as no one looks.  Between
        two states they change evenly: an arm that turns by 27° is nowhere off by more than 0.2°.  Of a top that fell
        they say how it lies; without one they are 0.

        Args:
            times: shape (n,) [s].
        """
        place, axis, arm = (np.zeros((times.size, 3)) for _ in range(3))
        up = np.zeros(times.shape, dtype=np.bool_)
        self.simulate_until(float(times.max(initial=0.0)))
        for piece, part in self._pieces.pieces(times):
            if isinstance(piece, _Absent):
                if piece.scene is not None and piece.state is not None:
                    place[part], axis[part], arm[part] = tumble(piece.scene, piece.state, times[part] - piece.start)
                continue
            up[part] = True
            time, states = self._states_of(piece)
            for found, columns in ((place, R), (axis, N), (arm, ARM)):
                found[part] = np.stack([np.interp(times[part], time, one) for one in states[:, columns].T], axis=1)
        return place, axis, arm, up

    def _piece_at(self, time: float) -> _Flying | _Absent:
        """Simulate up to this time, and return the piece then."""
        self.simulate_until(time)
        return self._pieces.at(time)

    def _flying_pieces(self, times: Array) -> Iterator[tuple[_Flying, slice]]:
        """Simulate up to these times, and yield the pieces in which a top is up, with their places in the times."""
        self.simulate_until(float(times.max(initial=0.0)))
        for piece, part in self._pieces.pieces(times):
            if isinstance(piece, _Flying):
                yield piece, part

    def _states_of(self, piece: _Flying) -> tuple[Array, Array]:
        if piece not in self._states:
            motion = _simulate_again(piece)
            _keep(self._states, piece, (motion.time.copy(), motion.states.copy()), _REMEMBERED)
        return self._states[piece]

    def _samples_of(self, piece: _Flying) -> _Samples:
        if piece not in self._samples:
            _keep(self._samples, piece, self._sample(_simulate_again(piece), piece.slip), SAMPLED)
        return self._samples[piece]

    def _sample(self, motion: Trajectory, slip: float) -> _Samples:
        slips = slip + motion.slips
        return _Samples(
            motion.time.copy(), _turns(motion) + slips, slips, _stem(motion, self._stem_height), _lift(motion)
        )

    # --- the simulation ---

    def simulate_until(self, until: float) -> None:
        """Simulate the motion up to this time [s]."""
        while self._known_until <= until:
            if self._state is None:
                self._state = self._start_state(self._known_until)
            self._advance(self._state)

    def _start_state(self, time: float) -> Array:
        """Return the state of a top that starts at this time, shape (18,)."""
        state = start_of(self._scene)
        state[TIME] = time
        self._slip, self._memory = 0.0, None
        return state

    def _put_by_hand(self, time: float) -> Array:
        """Return the state of a top that starts now; one that cannot float is let go where the first one was."""
        try:
            return self._start_state(time)
        except SceneError:
            scene = self._scene
            self._scene = scene.changed({"start.place": "given", "start.position_m": (0.0, 0.0, self._first_height)})
            try:
                return self._start_state(time)
            finally:
                self._scene = scene

    def _advance(self, state: Array) -> None:
        begin = float(state[TIME])
        try:
            # at a step of its own: to check that of the last piece would take two runs more
            motion = simulate(self._scene, PIECE_S, tolerance=TOLERANCE, rate=RATE, start=state, memory=self._memory)
        except LeftRange:  # it has hit the base, where the field is infinite
            self._fall(begin, state)
            return
        # a bench may run for hours: of all pieces only the first state is kept
        piece = _Flying(self._scene, state, motion.accuracy.step, self._slip, self._memory)
        samples = self._sample(motion, self._slip)
        self._slip, self._memory = float(samples.slips[-1]), motion.memory
        self._pieces.append(begin, piece)
        _keep(self._samples, piece, samples, SAMPLED)
        if motion.fell is not None:
            self._fall(motion.fell.time, motion.fell.state)
        else:
            self._state, self._known_until = motion.states[-1].copy(), float(motion.time[-1])

    def _fall(self, time: float, state: Array | None = None) -> None:
        """Let no top be up from a time on.  state: of one that fell, shape (18,); None: it was taken away."""
        self._pieces.append(time, _Absent(time, None if state is None else self._scene, state))
        self._wait(time)

    def _wait(self, fallen: float) -> None:
        """Leave the top down from the time of its fall until it is put back, if ever."""
        self._state, pause = None, self._put_back_after_s
        self._known_until = math.inf if pause is None else fallen + pause


def _simulate_again(piece: _Flying) -> Trajectory:
    again: dict[str, Any] = {"step": piece.step, "start": piece.state, "memory": piece.memory}
    return simulate(piece.scene, PIECE_S, tolerance=TOLERANCE, rate=RATE, **again)


def _keep(kept: dict[_Flying, T], piece: _Flying, value: T, most: int) -> None:
    """Keep a value; of more than `most` the oldest go."""
    while len(kept) >= most:
        del kept[next(iter(kept))]
    kept[piece] = value


def _state_within(piece: _Flying, time: float) -> tuple[Array, Array | None]:
    """Return the state at a time within a piece, shape (18,), and the memory of its drive."""
    state, memory = piece.state.copy(), piece.memory
    if time - piece.start > _AT_ONCE:
        run, _ = simulate_at_step(
            piece.scene, time - piece.start, piece.step, None, errors=False, start=state, memory=memory
        )
        state, memory = run.states[-1].copy(), run.stops.memory
    state[TIME] = time
    return state, memory


def _turns(motion: Trajectory) -> Array:
    """Return the turns of the tape past a fixed spot: the rim's point towards x while the top stands on the axis."""
    arm, place = motion.states[:, ARM], motion.position
    spot = np.arctan2(-place[:, 1], motion.scene.top.magnet_radius_m - place[:, 0])
    return np.asarray(np.unwrap(np.arctan2(arm[:, 1], arm[:, 0]) - spot) / (2 * np.pi))


def _lift(motion: Trajectory) -> NDArray[np.float32]:
    """Return the height above the base of the rim's point towards x, shape (n,) [m]: it bobs and tilts with the top."""
    return np.asarray(motion.position[:, 2] - motion.scene.top.magnet_radius_m * motion.axis[:, 0], dtype=np.float32)


def _stem(motion: Trajectory, height: float) -> NDArray[np.float32]:
    """Return displacement along x and its rate of the stem's point at a height, shape (2, n) [m, m/s].

    Single precision: a displacement of 5 mm is right to 0.5 nm.
    """
    states = motion.states
    axis, momentum = states[:, N], states[:, L]
    rate = (momentum[:, 1] * axis[:, 2] - momentum[:, 2] * axis[:, 1]) / motion.scene.top.inertia_transverse_kg_m2
    moving = states[:, V][:, 0] + height * rate
    return np.asarray([states[:, R][:, 0] + height * axis[:, 0], moving], dtype=np.float32)


def _cubic(times: Array, nodes: Array, values: NDArray[np.float32], rates: NDArray[np.float32]) -> Array:
    """Interpolate values and their rates at nodes [s] by cubic Hermite polynomials, shape (n,)."""
    if nodes.size < 2:
        return np.full_like(times, values[0])
    k = np.clip(np.searchsorted(nodes, times, side="right") - 1, 0, nodes.size - 2)
    span = nodes[k + 1] - nodes[k]
    s = (times - nodes[k]) / span
    low, high, left, right = values[k], values[k + 1], rates[k] * span, rates[k + 1] * span
    return np.asarray(
        low + s * (left + s * (3 * (high - low) - 2 * left - right + s * (2 * (low - high) + left + right)))
    )
