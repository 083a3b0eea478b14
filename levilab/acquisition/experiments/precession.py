"""The precession: sweep the drive, and count at each of its frequencies how often the stem cuts a laser beam."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator
from pydantic_core import PydanticCustomError

from instruments.errors import InstrumentError, OutOfRange
from levilab.acquisition.counting import prepare_counter, spin_now
from levilab.acquisition.driving import (
    RAMP_STEP_S,
    DriveSettings,
    NotHeld,
    check_drive,
    drive_up,
    held_spin,
    no_light,
)
from levilab.acquisition.experiment import Experiment
from levilab.acquisition.session import ExperimentFailed
from levilab.bench.person import FloatTop, Task
from levilab.runs.channel import Channel

if TYPE_CHECKING:
    from typing import Self

    from numpy.typing import NDArray

    from levilab.acquisition.session import Row, Session
    from levilab.bench.config import Limits

    Array = NDArray[np.float64]

#: Points of a sweep, at most.
_MOST_POINTS = 1000
#: While the drive creeps the top is looked at so often [s].
_LOOK_EVERY_S = 10.0
#: A locked top swings about the drive, by some tenths of a hertz: so many looks in a row have a mean this near to it
#: [Hz]; after so many looks it is not locked.
_LOOKS, _LOCKED_WITHIN_HZ, _MOST_LOOKS = 3, 0.25, 12
#: How often a point is tried, and so many points lost one after the other end the sweep.
_TRIES, _MOST_LOST = 2, 2
#: A person who floated the top has pressed Enter: after so many looks in the dark there is none.
_DARK_LOOKS = 5
#: Spreads gates evenly over a period, however many there are.
_GOLDEN = (math.sqrt(5) - 1) / 2
#: No count is better than that: the resolution of the counters over a second [Hz].
_LEAST_U_HZ = 1e-7
#: A gate so many standard deviations off the others, and by half a count at least, has miscounted.
_FAR = 5.0
#: Of an oscilloscope's record of laser and drive: samples a second, and volts of a division; the drive has ±5 V.
_RATE, _VOLTS_PER_DIVISION = 1000.0, 2.0


class PrecessionSettings(DriveSettings):
    """Drive up, then to each frequency of a sweep; wait for the lock; count the spin and the laser."""

    one_top: ClassVar[bool] = False

    drive_frequency_hz: PositiveFloat = Field(default=44.0, description="the top is driven up to this first,")
    first_hz: PositiveFloat = Field(default=44.0, description="sweep the drive from this")
    last_hz: PositiveFloat = Field(default=28.0, description="to this; the top is lost rather at the lower end,")
    step_hz: PositiveFloat = Field(default=2.0, description="in steps of this;")
    frequencies_hz: tuple[PositiveFloat, ...] | None = Field(
        default=None, description="or these, in this order", examples=[[44.0, 38.0, 33.0, 28.0]]
    )
    hold_s: NonNegativeFloat = Field(default=20.0, description="and held so long at each point of the sweep")
    interval_s: PositiveFloat = Field(default=2.0, description="look every so often whether it is locked,")
    counts: PositiveInt = Field(default=10, ge=3, description="and count spin and laser so many times")
    laser_input: Literal[1, 2] = Field(
        default=2, description="of the counter; 1: you are asked to change the cable each time"
    )
    laser_trigger_level_v: float = Field(default=0.65, description="half way between the beam free and cut")
    clocks_u: PositiveFloat = Field(
        default=2e-5, description="how well the clocks agree, relative standard uncertainty"
    )
    record_s: NonNegativeFloat = Field(
        default=0.0, le=60.0, description="a scope's record at each, for the phase, 6 or more; 0: none"
    )
    record_laser_channel: PositiveInt = Field(default=3, description="where the laser is,")
    record_drive_channel: PositiveInt = Field(default=2, description="and the generator's output")
    longest_s: PositiveFloat = Field(default=4 * 3600.0, description="an end if it takes longer")

    @property
    def sweep(self) -> tuple[float, ...]:
        """The frequencies of the drive, in order [Hz]."""
        if self.frequencies_hz is not None:
            return self.frequencies_hz
        steps = math.floor(abs(self.last_hz - self.first_hz) / self.step_hz + 1e-9)
        step = math.copysign(self.step_hz, self.last_hz - self.first_hz)
        return tuple(round(self.first_hz + k * step, 9) for k in range(steps + 1))

    @model_validator(mode="after")
    def _is_a_sweep(self) -> Self:
        steps = abs(self.last_hz - self.first_hz) / self.step_hz
        points = len(self.frequencies_hz) if self.frequencies_hz is not None else steps + 1
        if not points <= _MOST_POINTS:
            text = "a sweep of {points} points is more than {most}: take a larger step_hz"
            raise PydanticCustomError("sweep", text, {"points": f"{points:.0f}", "most": _MOST_POINTS})
        if len(set(self.sweep)) < 3:
            text = "at least three drive frequencies are needed for a line: {seen} given by {names}"
            names = "frequencies_hz" if self.frequencies_hz is not None else "first_hz, last_hz and step_hz"
            raise PydanticCustomError("sweep", text, {"seen": len(set(self.sweep)), "names": names})
        return self

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for a drive that the bench does not allow."""
        super().check(table, limits)
        names = ("first_hz", "last_hz") if self.frequencies_hz is None else ("frequencies_hz", "frequencies_hz")
        ends = (self.sweep[0], self.sweep[-1]) if self.frequencies_hz is None else (min(self.sweep), max(self.sweep))
        check_drive(table, limits, self.drive_amplitude_vpp, zip(names, ends, strict=True))


def also_needs(settings: PrecessionSettings) -> tuple[str, ...]:
    """The oscilloscope is needed for records only."""
    return ("oscilloscope",) if settings.record_s else ()


def channels(settings: PrecessionSettings) -> tuple[Channel, ...]:
    """One reading a point of the sweep."""
    over = f"{settings.counts} gates of {settings.gate_s:g} s"
    one = "that of one count in the configuration" if settings.reading_u_hz else f"scatter of {over}"
    u = f"{one} over √{settings.counts}"
    return (
        Channel("time_s", "s", "bench clock, from the beginning of the sweep, at the end of the point"),
        Channel("drive_frequency_hz", "Hz", "generator, as set"),
        Channel("drive_frequency_u_hz", "Hz", "its clock by the counter's, from the configuration"),
        Channel("spin_frequency_hz", "Hz", f"frequency counter on the phototransistor at the tape, mean of {over}"),
        Channel("spin_frequency_u_hz", "Hz", u),
        Channel("precession_frequency_hz", "Hz", f"frequency counter on the laser that the stem cuts, mean of {over}"),
        Channel("precession_frequency_u_hz", "Hz", u),
    )


# --- the sweep ---


@dataclass
class _Place:
    """Where the sweep is.  next: point; tries: of it so far; lost: points left out one after the other."""

    next: int
    tries: int = 0
    lost: int = 0


def run(session: Session[PrecessionSettings]) -> None:
    """Drive the top up and through the sweep; where it is lost, drive it up anew."""
    settings = session.settings
    if settings.laser_input == 1 and session.writer.record.seed is not None:
        raise ExperimentFailed(
            "the virtual bench has no person who could change the counter's cable (precession.laser_input = 1): take 2"
        )
    prepare_counter(session)
    session.begin(lambda: None, resumed="the top is driven up anew")
    place = _Place(_points_done(session.rows, settings.sweep))
    while place.next < len(settings.sweep) and place.lost < _MOST_LOST and not _is_over(session):
        try:
            _have_a_top(session, place)
            drive_up(session)
            _go_on(session, place)
        except NotHeld as lost:
            session.bench.outputs_off()
            _note_loss(session, place, lost)
        except InstrumentError as error:
            if error.address != session.bench.address("generator") or isinstance(error, OutOfRange):
                raise
            session.reconnect("generator", error, session.bench.outputs_off)
    session.bench.outputs_off()
    session.event("drive off", f"drive off, {len(session.rows)} of {len(settings.sweep)} points were measured")


def _points_done(rows: list[Row], sweep: tuple[float, ...]) -> int:
    """The first point after those that the readings are of, in order."""
    done = 0
    for row in rows:
        drive = row["drive_frequency_hz"]
        same = [k for k in range(done, len(sweep)) if math.isclose(sweep[k], drive, rel_tol=1e-9)]
        done = same[0] + 1 if same else done
    return done


def _go_on(session: Session[PrecessionSettings], place: _Place) -> None:
    """From where the top was driven up to, through the points that are left.  Raises NotHeld."""
    settings = session.settings
    drive = settings.drive_frequency_hz
    while place.next < len(settings.sweep) and session.spent() <= settings.longest_s:
        target = settings.sweep[place.next]
        _creep(session, place, drive, target)
        _wait_for_lock(session, target)
        row = _measure(session, target)
        if settings.record_s:
            _record(session, target)
        session.keep(row | {"time_s": session.now()}, _time_left(settings, place.next + 1))
        place.next, place.tries, place.lost, drive = place.next + 1, 0, 0, target


def _note_loss(session: Session[PrecessionSettings], place: _Place, lost: NotHeld) -> None:
    """Write down that the lock was lost at a point; after the last try the point is left out."""
    settings = session.settings
    drive = settings.sweep[place.next]
    place.tries += 1
    text = f"the lock was lost on the way to the point of {drive:g} Hz, or at it: {lost}"
    session.event("lock lost", f"{text}; try {place.tries} of {_TRIES}", drive_frequency_hz=drive)
    if place.tries < _TRIES:
        return
    place.next, place.tries, place.lost = place.next + 1, 0, place.lost + 1
    session.event("left out", f"the point of {drive:g} Hz is left out", drive_frequency_hz=drive)
    if place.lost == _MOST_LOST and place.next < len(settings.sweep):
        session.event("ended", f"{_MOST_LOST} points one after the other were lost: the sweep ends here")


def _have_a_top(session: Session[PrecessionSettings], place: _Place) -> None:
    """See that a top floats; where none does, ask for one.  Raises ExperimentFailed."""
    session.progress(f"point {place.next + 1}", place.next / len(session.settings.sweep))
    if spin_now(session) is not None:
        return
    session.ask(FloatTop("The counter sees no top: spin the top and let it float.", len(session.rows)))
    for _ in range(_DARK_LOOKS):
        if spin_now(session) is not None:
            return
    raise no_light(session)


def _is_over(session: Session[PrecessionSettings]) -> bool:
    longest = session.settings.longest_s
    if session.spent() <= longest:
        return False
    session.event("longest", f"{longest:g} s are over (precession.longest_s)")
    return True


def _time_left(settings: PrecessionSettings, done: int) -> float:
    """Until the end, if the lock holds [s]."""
    left = settings.sweep[max(done - 1, 0) :]
    way = sum(abs(b - a) for a, b in pairwise(left))
    looks = _LOOKS * max(settings.interval_s, settings.gate_s)
    each = settings.hold_s + looks + 2 * settings.counts * settings.gate_s + settings.record_s
    return way / settings.ramp_hz_per_s + each * (len(settings.sweep) - done)


# --- one point ---


def _creep(session: Session[PrecessionSettings], place: _Place, start: float, target: float) -> None:
    """Move the drive in steps that a locked top can follow.  Raises NotHeld."""
    settings = session.settings
    steps = math.ceil(abs(target - start) / (settings.ramp_hz_per_s * RAMP_STEP_S) - 1e-9)
    for k in range(1, steps + 1):
        session.stop.check()
        drive = start + (target - start) * k / steps
        session.bench.generator.frequency = drive
        share = (place.next + k / steps) / len(settings.sweep)
        session.progress(f"point {place.next + 1} of {len(settings.sweep)}: drive at {drive:.2f} Hz", min(share, 1.0))
        session.wait(RAMP_STEP_S)
        if k % round(_LOOK_EVERY_S / RAMP_STEP_S) == 0:
            held_spin(session, drive)


def _wait_for_lock(session: Session[PrecessionSettings], drive: float) -> None:
    """Hold the top, and wait until it swings about the drive's frequency.  Raises NotHeld."""
    settings = session.settings
    session.wait(settings.hold_s)
    seen: list[float] = []
    for _ in range(_MOST_LOOKS):
        asked = session.now()
        seen.append(held_spin(session, drive))
        mean = math.fsum(seen[-_LOOKS:]) / _LOOKS
        if len(seen) >= _LOOKS and abs(mean - drive) < _LOCKED_WITHIN_HZ:
            session.event("locked", f"locked at {drive:g} Hz", drive_frequency_hz=drive, spin_frequency_hz=mean)
            return
        session.wait(settings.interval_s - (session.now() - asked))
    raise NotHeld(seen[-1], drive)


def _measure(session: Session[PrecessionSettings], drive: float) -> Row:
    """Spin and precession of a locked top.  Raises NotHeld, ExperimentFailed."""
    settings = session.settings
    spins = _counted(session, drive, settings.trigger_level_v, 1)
    _still_held(session, drive, spins)
    if settings.laser_input == 1:
        session.ask(Task("Connect the laser's phototransistor to the counter's input 1, in place of the tape's."))
    laser = _counted(session, drive, settings.laser_trigger_level_v, settings.laser_input)
    if settings.laser_input == 1:
        session.ask(Task("Connect the tape's phototransistor to the counter's input 1 again."))
    _count_the_tape_again(session)
    held_spin(session, drive)  # else what the laser counted is of a top on its way down
    spin, u_spin = _mean(spins, settings)
    precession, u_precession = _mean(_checked(session, laser, drive), settings)
    return {
        "drive_frequency_hz": drive,
        "drive_frequency_u_hz": settings.clocks_u * drive,
        "spin_frequency_hz": spin,
        "spin_frequency_u_hz": u_spin,
        "precession_frequency_hz": precession,
        "precession_frequency_u_hz": u_precession,
    }


def _count_the_tape_again(session: Session[PrecessionSettings]) -> None:
    """Set the counter up for the tape; one that fails is reached again."""
    try:
        prepare_counter(session)
    except InstrumentError as error:
        session.reconnect("counter", error, lambda: prepare_counter(session))


def _counted(session: Session[PrecessionSettings], drive: float, level_v: float, channel: int) -> Array:
    """Counts at an input of the counter, shape (counts,) [Hz], NaN where there was none.

    Their gates differ by parts of a period.  A gate begins and ends with a pulse, and a late pulse is the likelier one.
    If a gate is a whole number of periods, its last pulse is one that came no earlier in its period than the first, so
    the count is too low by up to half the scatter of the gates; over gates of all lengths both ends are late alike.
    """
    settings = session.settings
    counter = session.bench.counter
    counts: list[float] = []

    def prepare(gate_s: float = settings.gate_s) -> None:
        counter.prepare(gate_s=gate_s, trigger_level_v=level_v, channel=channel)

    while len(counts) < settings.counts:
        session.stop.check()
        try:
            prepare(round(settings.gate_s + len(counts) * _GOLDEN % 1 / drive, 6))
            count = counter.frequency()
            session.bench.record_settings("counter")  # raises if they are not as they were set
        except InstrumentError as error:
            if error.address != session.bench.address("counter"):
                raise
            session.reconnect("counter", error, prepare)
        else:
            counts.append(math.nan if count is None else count)
    return np.array(counts)


def _still_held(session: Session[PrecessionSettings], drive: float, spins: Array) -> None:
    """Raise NotHeld where one of the counts is not of a held top."""
    if not np.isfinite(spins).all():
        held_spin(session, drive)  # a pulse may be missed, a top that is down stays down
        raise NotHeld(None, drive)
    worst = float(spins[np.argmax(np.abs(spins - drive))])
    if abs(worst - drive) > 1.0:
        raise NotHeld(worst, drive)


def _checked(session: Session[PrecessionSettings], laser: Array, drive: float) -> Array:
    """The counts of the laser; a likely miscount gives an event, and stays in the mean.  Raises ExperimentFailed."""
    settings = session.settings
    seen = laser[np.isfinite(laser)]
    if seen.size < 3:
        raise ExperimentFailed(
            f"the counter sees no laser pulses at {settings.laser_trigger_level_v:g} V, input {settings.laser_input}: "
            "does the stem cut the beam, and is the trigger level between free and cut "
            "(precession.laser_trigger_level_v)?"
        )
    middle = float(np.median(seen))
    usual = 1.4826 * float(np.median(np.abs(seen - middle)))
    far = np.abs(seen - middle) > max(_FAR * usual, 0.5 / settings.gate_s)
    if far.any() or seen.size < laser.size:
        values = ", ".join(f"{value:.4g}" for value in laser)
        session.event("miscounted", f"the laser's counts at {drive:g} Hz differ: {values} Hz", drive_frequency_hz=drive)
    return seen


def _mean(counts: Array, settings: PrecessionSettings) -> tuple[float, float]:
    """Mean of counts and its standard uncertainty [Hz]."""
    one = float(counts.std(ddof=1)) if settings.reading_u_hz is None else settings.reading_u_hz
    return float(counts.mean()), max(one / math.sqrt(counts.size), _LEAST_U_HZ)


def _record(session: Session[PrecessionSettings], drive: float) -> None:
    """Keep the oscilloscope's record of laser and drive; without one the point counts as well."""
    settings, scope = session.settings, session.bench.oscilloscope
    shown = {"laser": settings.record_laser_channel, "drive": settings.record_drive_channel}
    try:
        scope.prepare(
            channels=tuple(sorted(shown.values())),
            duration_s=settings.record_s,
            points=round(settings.record_s * _RATE),
            volts_per_division=_VOLTS_PER_DIVISION,
            trigger_level_v=0.0,
            trigger_source=settings.record_drive_channel,
        )
        scope.acquire(timeout_s=5.0)
        traces = {what: scope.trace(channel) for what, channel in shown.items()}
    except InstrumentError as error:
        session.event("no record", f"no record at {drive:g} Hz: {error}", drive_frequency_hz=drive)
        return
    for what, trace in traces.items():
        session.keep_trace(trace, what)


EXPERIMENT = Experiment(
    name="precession",
    about="sweep the drive, and count the spin and how often the stem cuts a laser beam",
    instruments=("counter", "generator"),
    settings=PrecessionSettings,
    channels=channels,
    run=run,
    mock_scene="precession",
    also_needs=also_needs,
)
