"""The world that the virtual bench measures: one clock, one top, and the light it makes.

Here the world is the spin alone: closed form between events, exact at any time asked, nothing integrated.
What the instruments need of a world is the little protocol `World`; `motion_world` has the whole motion.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from instruments.virtual.generator.voltage import fundamental
from levilab.simulator.spin import DECAYS
from levilab.world.base import Base, Stand, drawn_base
from levilab.world.coil import Coil
from levilab.world.light import Laser, Tape
from levilab.world.timeline import Timeline

if TYPE_CHECKING:
    from instruments.clock import Clock
    from instruments.virtual.counter.edges import Thresholds
    from instruments.virtual.generator.channel import Output

Array = NDArray[np.float64]

#: History that is kept [s]: the counters look 12 000 s ahead and leave 2500 s out, the scopes look 600 s
#: back.
KEPT_S = 15_000.0

#: When the turn number is looked at to find pulses [s], and how far beyond the times that are asked for: noise and the
#: jitter may move a pulse across their ends.
_LOOK_S, _AROUND_S = 0.01, 0.02


class World(Protocol):
    """What the virtual instruments see and do.

    Attributes:
        clock: the bench's.
    """

    clock: Clock

    def catch_up(self) -> None:
        """Simulate up to the present time, and drop history older than KEPT_S."""

    def light(self, start: float, step: float, n: int) -> Array:
        """The phototransistor's voltage at start + step·k, shape (n,) [V]."""

    def crossings(self, start: float, stop: float, triggers: Thresholds) -> Array | None:
        """When a trigger fires in the light from start to stop [s], shape (m,); None: only the light itself can say."""

    def laser(self, start: float, step: float, n: int) -> Array:
        """The voltage of the phototransistor behind the stem at start + step·k, shape (n,) [V]."""

    def drive(self, time: float, output: Output) -> None:
        """From this time on the coil's field is this: a generator's output, amplitude and offset in T."""

    def float_top(self, number: int) -> None:
        """Spin the top by hand and let it float, if it is down.

        Args:
            number: how many tops came before.
        """

    def coil_field(self, start: float, step: float, n: int) -> Array:
        """The coil's field at start + step·k, shape (n,) [T]."""

    def flux_density(self, time: float) -> float:
        """What a magnetometer's probe sees, along the base's axis [T]."""

    def place_probe(self, height_m: float | None) -> None:
        """Put the magnetometer's probe on the axis, so high above the base, or (None) into its zero-gauss chamber."""


@dataclass(frozen=True)
class SpinScene:
    """A top that only spins.  Defaults: the thesis's device and what its spin-downs showed.

    Attributes:
        start_hz: the spin at time 0, given by hand.
        drag: a name in DECAYS.
        constants: of the drag (SI).
        fall_hz: spin at which the top falls.
        later_falls_hz: the same of tops that are floated later, by their number from 1 on, and again from the first of
            them; none: as the first top.
        lock_torque: the greatest angular acceleration per tesla of drive [rad s⁻² T⁻¹], the dipole's transverse part
            over I₃, half of it because half of a field along one line turns with the top.
        tape: what the phototransistor sees.
        laser: the beam beside the stem.
        jitter: scatter of a pulse's place, in turns, 1σ (0.0212 makes 0.03 Hz of a reading over 1 s).
        base: the magnet below it.
        stand: where the probe is at first, about where a top floats.
        put_back_after_s: so long after a fall the top is put back [s]; None: it is not.
        seed: of noise and jitter.
    """

    start_hz: float = 30.0
    drag: str = "disc"
    constants: tuple[float, ...] = (2.34e-4,)
    fall_hz: float = 21.86
    later_falls_hz: tuple[float, ...] = ()
    lock_torque: float = 0.03 * 0.714 / 2 / 1.731314e-6
    tape: Tape = field(default_factory=Tape)
    laser: Laser = field(default_factory=Laser)
    jitter: float = 0.03 / math.sqrt(2)
    base: Base = field(default_factory=Base)
    stand: Stand = field(default_factory=Stand)
    put_back_after_s: float | None = None
    seed: int = 0

    def fall_of(self, number: int) -> float:
        """The spin at which a top falls [Hz].

        Args:
            number: how many tops came before.
        """
        later = self.later_falls_hz
        return later[(number - 1) % len(later)] if number and later else self.fall_hz


#: Tops of one series whose falls are drawn.
_SERIES = 100


def drawn(seed: int, scene: SpinScene | None = None) -> SpinScene:
    """The scene of one run: constants and fall scattered as between the thesis's runs, by the seed.

    The four published constants scatter by 2 %, the ten published lower limits by 0.25 Hz, whether they are of several
    runs or of one; the base is `drawn_base`'s, and a probe is put in its place to 0.2 mm.
    """
    scene = scene or SpinScene()
    scatter = np.random.default_rng(seed).standard_normal(1 + _SERIES)
    return replace(
        scene,
        constants=tuple(c * (1 + 0.02 * float(scatter[0])) for c in scene.constants),
        fall_hz=scene.fall_hz + 0.25 * float(scatter[1]),
        later_falls_hz=tuple((scene.fall_hz + 0.25 * scatter[2:]).tolist()),
        base=drawn_base(seed),
        stand=replace(scene.stand, scatter_m=2e-4, seed=seed),
        seed=seed,
    )


class Phase(enum.Enum):
    """What a top does: it coasts by the law of drag, is pulled to the drive's frequency, is locked to it, or fell."""

    COASTING = enum.auto()
    PULLED = enum.auto()
    LOCKED = enum.auto()
    FALLEN = enum.auto()


@dataclass(frozen=True)
class _Stretch:
    """A piece of the top's life in one phase.

    start [s]; spin [rad/s] and angle [rad] at its start; acceleration: constant, of a top that is pulled [rad/s²];
    number: of the top.
    """

    start: float
    spin: float
    angle: float
    phase: Phase
    acceleration: float = 0.0
    number: int = 0


class SpinWorld:
    """A spinning top, its drive and its light, as functions of time.

    The drive's hold is idealised: within the capture range of a pendulum, |ω − ω_d| < 2√α, the top is
    pulled straight to the drive's frequency with the acceleration α that drag leaves over, and then stays;
    there is no hunting about it.
    """

    def __init__(self, scene: SpinScene, clock: Clock) -> None:
        self.scene, self.clock = scene, clock
        self._decay = DECAYS[scene.drag]
        self._jitter = np.random.default_rng((scene.seed, 1)).standard_normal(1 << 16) * scene.jitter
        self._coil, self._stand, self._probe_t = Coil(), scene.stand, scene.stand.sees(scene.base)
        self._drive_spin, self._hold = 0.0, 0.0  # [rad/s], [rad/s²]
        self._told = 0.0  # the last time that a change was told for [s]
        first = _Stretch(0.0, 2 * math.pi * scene.start_hz, 0.0, Phase.COASTING)
        self._stretches = Timeline(0.0, first)
        self._stretches.cut(0.0)
        self._plan_future(first)

    # --- the drive ---

    def drive(self, time: float, output: Output) -> None:
        """From this time on the coil's field is this; see :class:`World`.

        Only the first harmonic holds the top: an offset has no torque that turns with it.
        """
        self._forget()
        self._coil.change(time, output)
        hold = fundamental(output) * self.scene.lock_torque
        if hold == self._hold == 0 and time >= self._told:
            return  # nothing that the top could feel
        self._put_back_until(time)
        now = self._state(time)
        fallen = now.phase is Phase.FALLEN
        # what would have come without this change; a fall at this moment stays
        self._stretches.cut(math.nextafter(time, math.inf) if fallen else time)
        self._told, self._drive_spin, self._hold = time, 2 * math.pi * output.frequency, hold
        if not fallen:
            self._plan_future(now)

    def float_top(self, number: int) -> None:
        """Spin the top by hand; see :class:`World`."""
        time = self.clock.now()
        self._put_back_until(time)
        now = self._stretches.at(time)
        if now.phase is Phase.FALLEN:
            self._stretches.cut(math.nextafter(time, math.inf))
            spin = 2 * math.pi * self.scene.start_hz
            self._plan_future(_Stretch(time, spin, now.angle, Phase.COASTING, number=number))

    def catch_up(self) -> None:
        """Nothing takes long here; see :class:`World`."""
        self._forget()

    def _forget(self) -> None:
        horizon = self.clock.now() - KEPT_S
        self._coil.history.forget(horizon)
        self._stretches.forget(horizon)

    def _put_back_until(self, time: float) -> None:
        """Lay down the life of every top that follows on one that falls."""
        while self.scene.put_back_after_s is not None and self._stretches.last.phase is Phase.FALLEN:
            fallen = self._stretches.last
            begin = fallen.start + self.scene.put_back_after_s
            if begin > time:
                return
            self._forget()
            spin = 2 * math.pi * self.scene.start_hz
            self._plan_future(_Stretch(begin, spin, fallen.angle, Phase.COASTING, number=fallen.number + 1))

    def _state(self, time: float) -> _Stretch:
        """The stretch that would begin now, before a phase is chosen for it."""
        here = self._stretches.at(time)
        spin, angle = self._motion(here, np.array([time]))
        return replace(here, start=time, spin=float(spin[0]), angle=float(angle[0]), acceleration=0.0)

    def _plan_future(self, now: _Stretch) -> None:
        """Lay down the future from this state on, as it is without a further change."""
        fall, hold, drive_spin = 2 * math.pi * self.scene.fall_of(now.number), self._hold, self._drive_spin
        if now.spin <= fall:
            self._append(replace(now, phase=Phase.FALLEN, spin=0.0))
            return
        # deceleration by drag at this spin: its change over a time that is short against 1/C ~ 300 s
        drag = (now.spin - float(self._decay.after(now.spin, 1e-3, *self.scene.constants))) / 1e-3
        captured = hold > drag and abs(now.spin - drive_spin) < 2 * math.sqrt(hold) and drive_spin > fall
        if captured:
            self._lock(now, drive_spin, hold, drag)
        else:
            self._append(replace(now, phase=Phase.COASTING))
            lasts = float(self._decay.elapsed(now.spin, fall, *self.scene.constants))
            angle = now.angle + float(self._decay.turned(now.spin, fall, *self.scene.constants))
            self._append(_Stretch(now.start + lasts, 0.0, angle, Phase.FALLEN, number=now.number))

    def _lock(self, now: _Stretch, drive_spin: float, hold: float, drag: float) -> None:
        missing = drive_spin - now.spin
        acceleration = hold - drag if missing > 0 else -(hold + drag)
        lasts = missing / acceleration
        angle = now.angle + (now.spin + drive_spin) / 2 * lasts
        if lasts > 0:
            self._append(replace(now, phase=Phase.PULLED, acceleration=acceleration))
        self._append(_Stretch(now.start + lasts, drive_spin, angle, Phase.LOCKED, number=now.number))

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
        self._put_back_until(float(times.max(initial=0.0)))
        spin, angle = np.empty_like(times), np.empty_like(times)
        for stretch, part in self._stretches.pieces(times):
            spin[part], angle[part] = self._motion(stretch, times[part])
        return spin, angle

    # --- what is seen ---

    def light(self, start: float, step: float, n: int) -> Array:
        """The phototransistor's voltage; see :class:`World`."""
        times = start + step * np.arange(n, dtype=np.float64)
        return self._clean(times) + self.scene.tape.noise_at(times, self.scene.seed)

    def _clean(self, times: Array) -> Array:
        spin, angle = self.motion(times)
        turns = angle / (2 * math.pi)
        return self.scene.tape.clean(turns - self._late(np.floor(turns)), spin / (2 * math.pi), times)

    def _late(self, turn: Array) -> Array:
        """How late the pulse of each turn comes [turns]."""
        return np.asarray(self._jitter[turn.astype(np.int64) % self._jitter.size])

    def crossings(self, start: float, stop: float, triggers: Thresholds) -> Array | None:
        """See :class:`World`: the motion is asked when the turn number has the place at which the trigger fires.

        That needs a look each 10 ms, some for each pulse, and no trace.
        """
        times = np.arange(start - _AROUND_S, stop + _AROUND_S + _LOOK_S, _LOOK_S)
        spin, angle = self.motion(times)
        turns, rate = angle / (2 * math.pi), float(spin.max()) / (2 * math.pi)
        offset = self.scene.tape.offset(triggers, rate)
        if offset is None:
            return None
        whole = np.arange(math.floor(turns[0]) - 1.0, math.ceil(turns[-1]) + 1.0)
        place = whole + 0.5 + self._late(whole) + offset
        found = np.interp(place, turns, times)[(place > turns[0]) & (place < turns[-1])]
        found = self.scene.tape.crossing(found, self._clean, triggers.fire, self.scene.seed)
        spin, _ = self.motion(found)
        return np.asarray(found[(found >= start) & (found < stop) & (spin > 0)])

    def laser(self, start: float, step: float, n: int) -> Array:
        """The voltage of the laser's phototransistor; see :class:`World`.

        A top that only spins has its stem at rest on the axis: the beam is steady, and nothing is to be counted.
        """
        return self.scene.laser.steady(start + step * np.arange(n, dtype=np.float64), self.scene.seed)

    def coil_field(self, start: float, step: float, n: int) -> Array:
        """The coil's field; see :class:`World`."""
        return self._coil.field(start + step * np.arange(n, dtype=np.float64))

    def flux_density(self, time: float) -> float:
        """The base's field; the coil's lies across the axis, and the probe does not see it."""
        return self._probe_t

    def place_probe(self, height_m: float | None) -> None:
        """Put the probe there; see :class:`World`."""
        self._stand = self._stand.at(height_m)
        self._probe_t = self._stand.sees(self.scene.base)
