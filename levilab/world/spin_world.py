"""The world that the virtual bench measures: one clock, one top, and the light that it reflects.

`World` lists what the instruments need of a world.  `SpinWorld` has the spin alone, in closed form between events: it
is exact at any time, and nothing is integrated.  `motion_world` has the whole motion.
"""

import enum
import math
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from instruments.clock import Clock
from instruments.virtual.counter.edges import Thresholds
from instruments.virtual.generator.channel import Output
from instruments.virtual.generator.voltage import fundamental
from levilab.simulator.laws import LAWS
from levilab.simulator.parts import Top
from levilab.simulator.published.printed import published
from levilab.simulator.spin import DECAYS
from levilab.telemetry.messages import Poses
from levilab.world.base import Base, Stand, random_base
from levilab.world.bursts import TriggerWire, mean_pull
from levilab.world.coil import Coil
from levilab.world.light import Laser, Tape
from levilab.world.magnetic_field import MOMENT_A_M2, MOMENT_TILT, field_beside, moment_of
from levilab.world.pose import FLOATS_M, poses_of
from levilab.world.timeline import Timeline

#: Step in which a top that triggers its drive is computed [s]; its pull and drag change in it by a per cent.
BURST_STEP_S = 0.5

#: How long history is kept [s]: counters look 12 000 s ahead and skip 2500 s, oscilloscopes look 600 s back.
KEPT_S = 15_000.0

#: To find pulses the turn number is computed in such steps [s], and so far beyond both ends of the wanted times: noise
#: and jitter may move a pulse across an end.
_SCAN_STEP_S, _MARGIN_S = 0.01, 0.02


class World(Protocol):
    """What the virtual instruments see and do.

    Attributes:
        clock: the bench's.
        seed: of what is drawn by chance.
    """

    clock: Clock
    seed: int

    def catch_up(self) -> None:
        """Simulate up to the present time, and drop history older than KEPT_S."""

    def light(self, start: float, step: float, n: int) -> Array:
        """Return the phototransistor's voltage at start + step·k, shape (n,) [V]."""

    def crossings(self, start: float, stop: float, triggers: Thresholds) -> Array | None:
        """Return when a trigger fires from start to stop, shape (m,) [s]; None where only a trace can show it."""

    def laser(self, start: float, step: float, n: int) -> Array:
        """Return the voltage of the phototransistor behind the stem at start + step·k, shape (n,) [V]."""

    def drive(self, time: float, output: Output) -> None:
        """Set the coil's field from a time on.

        Args:
            time: [s].
            output: the generator's, with amplitude and offset in T.
        """

    def float_top(self, number: int) -> None:
        """Spin the top by hand and let it float, if it has fallen.

        Args:
            number: of tops before it.
        """

    def take_top(self) -> None:
        """Take the top away by hand, from the air or from where it lies: none is up until the next one is put there."""

    def coil_field(self, start: float, step: float, n: int) -> Array:
        """Return the coil's field at start + step·k, shape (n,) [T]."""

    def flux_density(self, time: float) -> float:
        """Return the flux density at the magnetometer's probe, along the base's axis [T]."""

    def place_probe(self, height_m: float | None) -> None:
        """Put the magnetometer's probe on the axis, at a height above the base [m]; None: into its chamber."""

    def magnetic_field(self, times: Array, place: Array) -> Array:
        """Return the field beside the bench, of base and top, along the bench's axes.

        Args:
            times: shape (n,) [s].
            place: of the sensor, shape (3,) [m above the middle of the base].

        Returns:
            Shape (n, 3) [T].
        """

    def poses(self, start: float, step: float, n: int) -> Poses:
        """Return the top's place and attitude at start + step·k, for a view."""


@dataclass(frozen=True)
class SpinScene:
    """A top that only spins.  The defaults are the thesis's device and the results of its spin-downs.

    Attributes:
        start_hz: the spin at time 0, as a hand gives it.
        drag: a name in DECAYS.
        constants: of the drag law (SI).
        fall_hz: the spin at which the first top falls.
        later_falls_hz: those at which tops 1, 2, … fall, repeated from its first when all are used; empty: all fall at
            fall_hz.
        edges_hz: those at which tops 0, 1, … leave the window upwards, repeated when all are used; empty: none does.
        lock_torque: the greatest angular acceleration per tesla of drive [rad s⁻² T⁻¹]: the moment's transverse part
            over I₃, halved because only half of a field along one line turns with the top.
        tape: what the phototransistor sees.
        laser: the beam beside the stem.
        trigger: the wire from the phototransistor to the generator's trigger input; None: there is none.
        moment_turns: angle of the moment's transverse part from the coil's axis when the tape is opposite to the lens,
            [turns].
        jitter: scatter of a pulse's place, 1σ [turns]; 0.0212 scatters a reading over 1 s by 0.03 Hz.
        base: the magnet below it.
        stand: where the probe is at first, about where a top floats.
        put_back_after_s: time from a fall until the top floats again [s]; None: it stays down.
        seed: of noise and jitter.
    """

    start_hz: float = 30.0
    drag: str = "disc"
    constants: tuple[float, ...] = LAWS["disc"].usual
    fall_hz: float = published("thesis")["measured.mean"].value
    later_falls_hz: tuple[float, ...] = ()
    edges_hz: tuple[float, ...] = ()
    lock_torque: float = MOMENT_TILT[0] * abs(MOMENT_A_M2) / 2 / Top().inertia_axial_kg_m2
    tape: Tape = field(default_factory=Tape)
    laser: Laser = field(default_factory=Laser)
    trigger: TriggerWire | None = field(default_factory=TriggerWire)
    moment_turns: float = 0.0
    jitter: float = 0.03 / math.sqrt(2)
    base: Base = field(default_factory=Base)
    stand: Stand = field(default_factory=Stand)
    put_back_after_s: float | None = None
    seed: int = 0

    def fall_of(self, number: int) -> float:
        """Return the spin at which a top falls [Hz].

        Args:
            number: of tops before it.
        """
        later = self.later_falls_hz
        return later[(number - 1) % len(later)] if number and later else self.fall_hz

    def edge_of(self, number: int) -> float:
        """Return the spin at which a top leaves the window upwards, infinite where it does not [Hz]; see `fall_of`."""
        return self.edges_hz[number % len(self.edges_hz)] if self.edges_hz else math.inf


#: Number of later tops with different spins at which they fall; then these repeat.
_SERIES = 100


def random_scene(seed: int, scene: SpinScene | None = None) -> SpinScene:
    """Return the scene of one run: the constants and the falls scatter as between the thesis's runs.

    The four published constants scatter by 2 %; the ten published lower limits scatter by 0.25 Hz, here alike
    within a run and between runs.  The base is `random_base`'s, the probe is placed to 0.2 mm, and the tape anywhere.

    Args:
        seed: of the random numbers.
        scene: what is common to all runs; by default the thesis's.
    """
    scene = scene or SpinScene()
    scatter = np.random.default_rng(seed).standard_normal(1 + _SERIES)
    return replace(
        scene,
        constants=tuple(c * (1 + 0.02 * float(scatter[0])) for c in scene.constants),
        fall_hz=scene.fall_hz + 0.25 * float(scatter[1]),
        later_falls_hz=tuple((scene.fall_hz + 0.25 * scatter[2:]).tolist()),
        base=random_base(seed),
        stand=replace(scene.stand, scatter_m=2e-4, seed=seed),
        moment_turns=float(np.random.default_rng((seed, 3)).uniform()),
        seed=seed,
    )


class Phase(enum.Enum):
    """What a top does.

    It coasts under drag alone, is pulled to the drive's frequency, is locked to it, is turned by bursts that it
    triggers itself, or lies fallen.
    """

    COASTING = enum.auto()
    TRIGGERING = enum.auto()
    PULLED = enum.auto()
    LOCKED = enum.auto()
    FALLEN = enum.auto()


@dataclass(frozen=True)
class _Stretch:
    """A stretch of time in which a top stays in one phase.

    Attributes:
        start: [s].
        spin: at the start [rad/s].
        angle: at the start [rad].
        phase: of the top.
        acceleration: of a top that is pulled or triggers its drive, constant [rad/s²].
        number: of tops before this one.
    """

    start: float
    spin: float
    angle: float
    phase: Phase
    acceleration: float = 0.0
    number: int = 0


class SpinWorld:
    """A spinning top, its drive and its light, as functions of time.

    The lock is idealised.  Within the capture range of a pendulum, |ω − ω_d| < 2√α with α the greatest acceleration by
    the drive, the top is pulled to the drive's frequency at a constant rate, α less drag or with it, and then stays
    there: it does not swing about the drive.  Bursts that the top triggers turn it by their mean torque over a turn,
    in steps of BURST_STEP_S with the acceleration in their middle; see `mean_pull`.
    """

    def __init__(self, scene: SpinScene, clock: Clock) -> None:
        self.scene, self.clock, self.seed = scene, clock, scene.seed
        self._decay = DECAYS[scene.drag]
        self._jitter = np.random.default_rng((scene.seed, 1)).standard_normal(1 << 16) * scene.jitter
        self._coil = Coil(self._trigger_edges if scene.trigger else None)
        self._stand, self._probe_t = scene.stand, scene.stand.flux_density(scene.base)
        self._bursts: Output | None = None  # that the top triggers
        self._drive_spin, self._hold = 0.0, 0.0  # [rad/s], [rad/s²]
        self._last_change = 0.0  # the time of the last change of the drive [s]
        first = _Stretch(0.0, 2 * math.pi * scene.start_hz, 0.0, Phase.COASTING)
        self._stretches = Timeline(0.0, first)
        self._stretches.cut(0.0)
        self._plan_future(first)

    # --- the drive ---

    def drive(self, time: float, output: Output) -> None:
        """Set the coil's field from a time on; see :class:`World`.

        Only the first harmonic holds the top: an offset has no torque that turns with it.
        """
        self._drop_history()
        self._coil.change(time, output)
        hold = fundamental(output) * self.scene.lock_torque
        bursts = output if output.triggered and self.scene.trigger else None
        if hold == self._hold == 0 and bursts == self._bursts and time >= self._last_change:
            return  # the top notices no difference
        self._plan_until(time)
        now = self._stretch_at(time)
        fallen = now.phase is Phase.FALLEN
        # drop the future as it was before this change; a fall at this moment stays
        self._stretches.cut(math.nextafter(time, math.inf) if fallen else time)
        self._last_change, self._drive_spin, self._hold = time, 2 * math.pi * output.frequency, hold
        self._bursts = bursts
        if not fallen:
            self._plan_future(now)

    def float_top(self, number: int) -> None:
        """Spin the top by hand; see :class:`World`."""
        time = self.clock.now()
        self._plan_until(time)
        now = self._stretches.at(time)
        if now.phase is Phase.FALLEN:
            self._stretches.cut(math.nextafter(time, math.inf))
            spin = 2 * math.pi * self.scene.start_hz
            self._plan_future(_Stretch(time, spin, now.angle, Phase.COASTING, number=number))

    def take_top(self) -> None:
        """Take the top out of the air; see :class:`World`."""
        time = self.clock.now()
        self._plan_until(time)
        now = self._stretch_at(time)
        if now.phase is not Phase.FALLEN:
            self._stretches.cut(time)
            self._append(replace(now, phase=Phase.FALLEN, spin=0.0))

    def fall_at(self, time: float) -> float:
        """Return the spin at which the top of this time falls, or fell [Hz]."""
        return self.scene.fall_of(self._stretches.at(time).number)

    def catch_up(self) -> None:
        """Drop old history; a closed form needs no simulation.  See :class:`World`."""
        self._drop_history()

    def _drop_history(self) -> None:
        horizon = self.clock.now() - KEPT_S
        self._coil.history.forget(horizon)
        self._stretches.forget(horizon)

    def _plan_until(self, time: float) -> None:
        """Plan, up to this time, the stretches that have no end in sight: of triggered bursts, and of later tops."""
        while True:
            while (last := self._stretches.last).phase is Phase.TRIGGERING and last.start + BURST_STEP_S <= time:
                spin = last.spin + last.acceleration * BURST_STEP_S
                angle = last.angle + (last.spin + spin) / 2 * BURST_STEP_S
                self._plan_future(replace(last, start=last.start + BURST_STEP_S, spin=spin, angle=angle))
            before = len(self._stretches)
            self._put_back_until(time)
            if len(self._stretches) == before:
                return

    def _put_back_until(self, time: float) -> None:
        """Plan, up to this time, the stretches of each top that is put back after a fall."""
        while self.scene.put_back_after_s is not None and self._stretches.last.phase is Phase.FALLEN:
            fallen = self._stretches.last
            begin = fallen.start + self.scene.put_back_after_s
            if begin > time:
                return
            self._drop_history()
            spin = 2 * math.pi * self.scene.start_hz
            self._plan_future(_Stretch(begin, spin, fallen.angle, Phase.COASTING, number=fallen.number + 1))

    def _stretch_at(self, time: float) -> _Stretch:
        """Return the state at this time as a stretch that begins there; its phase is still the former one."""
        here = self._stretches.at(time)
        spin, angle = self._motion(here, np.array([time]))
        return replace(here, start=time, spin=float(spin[0]), angle=float(angle[0]), acceleration=0.0)

    def _plan_future(self, now: _Stretch) -> None:
        """Append the stretches that follow from this state, as long as nothing changes."""
        fall, hold, drive_spin = 2 * math.pi * self.scene.fall_of(now.number), self._hold, self._drive_spin
        edge = 2 * math.pi * self.scene.edge_of(now.number)
        if not fall < now.spin < edge:
            self._append(replace(now, phase=Phase.FALLEN, spin=0.0))
            return
        if self._bursts is not None:
            self._trigger(now, fall, edge)
            return
        # deceleration by drag: the change of spin over 1 ms, which is short against 1/C ~ 300 s
        drag = (now.spin - float(self._decay.after(now.spin, 1e-3, *self.scene.constants))) / 1e-3
        captured = hold > drag and abs(now.spin - drive_spin) < 2 * math.sqrt(hold) and drive_spin > fall
        if captured:
            self._lock(now, drive_spin, hold, drag, edge)
        else:
            self._append(replace(now, phase=Phase.COASTING))
            lasts = float(self._decay.elapsed(now.spin, fall, *self.scene.constants))
            angle = now.angle + float(self._decay.turned(now.spin, fall, *self.scene.constants))
            self._append(_Stretch(now.start + lasts, 0.0, angle, Phase.FALLEN, number=now.number))

    def _lock(self, now: _Stretch, drive_spin: float, hold: float, drag: float, edge: float) -> None:
        end = min(drive_spin, edge)
        missing = end - now.spin
        acceleration = hold - drag if missing > 0 else -(hold + drag)
        lasts = missing / acceleration
        angle = now.angle + (now.spin + end) / 2 * lasts
        if lasts > 0:
            self._append(replace(now, phase=Phase.PULLED, acceleration=acceleration))
        spin, phase = (drive_spin, Phase.LOCKED) if drive_spin < edge else (0.0, Phase.FALLEN)
        self._append(_Stretch(now.start + lasts, spin, angle, phase, number=now.number))

    def _trigger(self, now: _Stretch, fall: float, edge: float) -> None:
        """Append a step of a top that triggers its drive, and its fall where it ends so."""
        half = now.spin + self._triggered_acceleration(now.spin) * BURST_STEP_S / 2
        acceleration = self._triggered_acceleration(half)
        self._append(replace(now, phase=Phase.TRIGGERING, acceleration=acceleration))
        if not fall < (end := now.spin + acceleration * BURST_STEP_S) < edge:
            lost = fall if end <= fall else edge
            lasts = (lost - now.spin) / acceleration
            angle = now.angle + (now.spin + lost) / 2 * lasts
            self._append(_Stretch(now.start + lasts, 0.0, angle, Phase.FALLEN, number=now.number))

    def _triggered_acceleration(self, spin: float) -> float:
        """Return the mean angular acceleration of a top that triggers its drive [rad/s²]."""
        wire, output, rate = self.scene.trigger, self._bursts, spin / (2 * math.pi)
        drag = spin * float(self._decay.damping(spin, *self.scene.constants))
        if wire is None or output is None or output.triggered is None:
            return -drag
        edge = self.scene.tape.offset(wire.thresholds(rising=output.triggered.rising), rate)
        if edge is None:  # the comparator sees no pulses, or chatters
            return -drag
        place = self.scene.moment_turns + edge
        pull = mean_pull(output, rate, place, jitter=self.scene.jitter, lost=wire.lost)
        return self.scene.lock_torque * pull - drag

    def _trigger_edges(self, start: float, stop: float, rising: bool) -> Array:  # noqa: FBT001 - as Coil calls it
        """Return the edges at the generator's trigger input."""
        wire = self.scene.trigger
        edges = self.crossings(start, stop, wire.thresholds(rising=rising)) if wire else None
        return np.empty(0) if edges is None else edges

    def _append(self, stretch: _Stretch) -> None:
        self._stretches.append(stretch.start, stretch)

    # --- the motion ---

    def _motion(self, stretch: _Stretch, times: Array) -> tuple[Array, Array]:
        """Spin [rad/s] and angle [rad] at times within one stretch."""
        t = times - stretch.start
        if stretch.phase is Phase.COASTING:
            spin = self._decay.after(stretch.spin, t, *self.scene.constants)
            return spin, stretch.angle + self._decay.turned(stretch.spin, spin, *self.scene.constants)
        spin = stretch.spin + stretch.acceleration * t
        return spin, stretch.angle + (stretch.spin + spin) / 2 * t

    def motion(self, times: Array) -> tuple[Array, Array]:
        """Spin [rad/s], 0 once fallen, and angle turned [rad] at the given times, shape (n,) each."""
        self._plan_until(float(times.max(initial=0.0)))
        spin, angle = np.empty_like(times), np.empty_like(times)
        for stretch, part in self._stretches.pieces(times):
            spin[part], angle[part] = self._motion(stretch, times[part])
        return spin, angle

    # --- what the instruments measure ---

    def light(self, start: float, step: float, n: int) -> Array:
        """Return the phototransistor's voltage; see :class:`World`."""
        times = start + step * np.arange(n, dtype=np.float64)
        return self._mean_voltage(times) + self.scene.tape.noise_at(times, self.scene.seed)

    def _mean_voltage(self, times: Array) -> Array:
        spin, angle = self.motion(times)
        turns = angle / (2 * math.pi)
        return self.scene.tape.mean_voltage(turns - self._delay_of_turn(np.floor(turns)), spin / (2 * math.pi), times)

    def _delay_of_turn(self, turn: Array) -> Array:
        """Return how late the pulse of each turn comes [turns]."""
        return np.asarray(self._jitter[turn.astype(np.int64) % self._jitter.size])

    def crossings(self, start: float, stop: float, triggers: Thresholds) -> Array | None:
        """Return when a trigger fires; see :class:`World`.

        Each turn has one place at which the trigger fires.  The times at which the turn number reaches these places are
        interpolated in steps of 10 ms, and then refined: no trace is needed.
        """
        times = np.arange(start - _MARGIN_S, stop + _MARGIN_S + _SCAN_STEP_S, _SCAN_STEP_S)
        spin, angle = self.motion(times)
        turns, rate = angle / (2 * math.pi), float(spin.max()) / (2 * math.pi)
        offset = self.scene.tape.offset(triggers, rate)
        if offset is None:
            return None
        whole = np.arange(math.floor(turns[0]) - 1.0, math.ceil(turns[-1]) + 1.0)
        place = whole + 0.5 + self._delay_of_turn(whole) + offset
        found = np.interp(place, turns, times)[(place > turns[0]) & (place < turns[-1])]
        found = self.scene.tape.crossing_times(found, self._mean_voltage, triggers.fire, self.scene.seed)
        spin, _ = self.motion(found)
        return np.asarray(found[(found >= start) & (found < stop) & (spin > 0)])

    def laser(self, start: float, step: float, n: int) -> Array:
        """Return the voltage of the laser's phototransistor; see :class:`World`.

        A top that only spins has its stem at rest on the axis: the beam is steady, and a counter counts nothing.
        """
        return self.scene.laser.voltage_at_rest(start + step * np.arange(n, dtype=np.float64), self.scene.seed)

    def coil_field(self, start: float, step: float, n: int) -> Array:
        """Return the coil's field; see :class:`World`."""
        return self._coil.field(start + step * np.arange(n, dtype=np.float64))

    def flux_density(self, time: float) -> float:
        """Return the base's field along the axis; the coil's lies across it, so the probe does not measure that."""
        return self._probe_t

    def poses(self, start: float, step: float, n: int) -> Poses:
        """Return a top upright and at rest, which turns; see :class:`World`."""
        upright, arm, up = self._upright(start + step * np.arange(n, dtype=np.float64))
        upright = np.where(up[:, None], upright, 0.0)  # how it fell is not known
        return poses_of(FLOATS_M * upright, upright, arm, up, start=start, step=step)

    def magnetic_field(self, times: Array, place: Array) -> Array:
        """Return the field of base and top; the moment's transverse part points to the tape.  See :class:`World`."""
        upright, arm, up = self._upright(times)
        moment = moment_of(upright, arm, MOMENT_A_M2, MOMENT_TILT)
        return field_beside(place, self.scene.base, FLOATS_M * upright, moment, up)

    def _upright(self, times: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return axis and arm of the top, shape (n, 3) each, and whether it is up, shape (n,)."""
        spin, angle = self.motion(times)
        zero = np.zeros_like(times)
        arm = np.stack([np.cos(angle), np.sin(angle), zero], axis=1)
        return np.stack([zero, zero, zero + 1], axis=1), arm, spin > 0

    def place_probe(self, height_m: float | None) -> None:
        """Put the probe at a height; see :class:`World`."""
        self._stand = self._stand.at(height_m)
        self._probe_t = self._stand.flux_density(self.scene.base)
