"""The precession: sweep the drive, and count at each of its frequencies how often the stem cuts a laser beam."""

import math
from itertools import pairwise
from typing import Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from analysis.arrays import Array
from analysis.precession.gates import FEWEST, Gates, Rate, Swing, rates_at_point, swing_of
from instruments.drivers.counter import LIGHT
from instruments.drivers.generator import Limits as DriveLimits
from instruments.errors import InstrumentError
from levilab.acquisition.counting import gate_began, prepare_counter, prepare_counter_again
from levilab.acquisition.driving import DriveSettings, PointFailed, check_drive, held_spin, sweep_drive
from levilab.acquisition.experiment import Experiment, ModelOf
from levilab.acquisition.session import ExperimentFailed, NotHeld, Row, Session
from levilab.bench.config import BenchConfig, ConfigError, Limits
from levilab.bench.person import Task
from levilab.computer import computer
from levilab.present.numbers import pulses_too_many
from levilab.runs.channel import Channel
from levilab.runs.events import RunEvent
from levilab.runs.gates import gates_event
from levilab.simulator.scene import Scene
from levilab.texts.text import Text

#: Points of a sweep, at most.
_MOST_POINTS = 1000
#: A locked top swings about the drive, by some tenths of a hertz: the mean of these looks in a row is this near to it
#: [Hz]; after the last number of looks it is not locked.
_LOOKS, _LOCKED_WITHIN_HZ, _MOST_LOOKS = 3, 0.25, 12
#: Shortest and longest gate, in parts of `gate_s`, and longest pause before one, in periods of the drive.
_GATES, _PAUSES = (0.75, 1.25), 4.0
#: Least number of the laser's gates with a count in a reading.
_FEWEST_COUNTS = 3
#: No count is better than that: the resolution of the counters over a second [Hz].
_LEAST_U_HZ = 1e-7
#: A swing of more than this [turns] is taken off by a step of the drive's phase of this duration [s], if that is at
#: most such a part of its period.  From half a turn on a top is lost.
_CALM, _STEP_S, _SHORT = 0.12, 0.3, 0.25
#: Of an oscilloscope's record of laser and drive: samples a second, and volts of a division; the drive has ±5 V.
_RATE, _VOLTS_PER_DIVISION = 1000.0, 2.0


class PrecessionSettings(DriveSettings):
    """Drive up, then to each frequency of a sweep; wait for the lock; count the spin and the laser."""

    one_top: ClassVar[bool] = False

    drive_frequency_hz: PositiveFloat = Field(default=44.0, description="the top is driven up to this first,")
    first_hz: PositiveFloat = Field(default=44.0, description="sweep the drive from this")
    last_hz: PositiveFloat = Field(default=28.0, description="to this: a top is lost rather at the lower end")
    step_hz: PositiveFloat = Field(default=2.0, description="in steps of this")
    frequencies_hz: tuple[PositiveFloat, ...] | None = Field(
        default=None, description="or these, in this order", examples=[[44.0, 38.0, 33.0, 28.0]]
    )
    hold_s: NonNegativeFloat = Field(default=20.0, description="time for which it is held at each point of the sweep")
    interval_s: PositiveFloat = Field(default=2.0, description="time from one look at the lock to the next")
    counts: PositiveInt = Field(default=10, ge=3, description="number of counts of spin and of laser at each point")
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

    def for_bench(self, config: BenchConfig, model_of: ModelOf) -> Self:
        """See the base: a counter with one input has its cable changed.

        Raises ConfigError for a counter that cannot count the laser as well.
        """
        if config.count_with != "counter":
            raise ConfigError(
                "an oscilloscope cannot count the laser beside the spin: name a `counter`, too; the second input shows "
                "the drive, that of a sound card a pickup coil, and would be taken for the laser"
            )
        suited = super().for_bench(config, model_of)
        model = model_of("counter")
        if model is None:
            return suited
        if model.driver.SIGNAL is not LIGHT:
            raise ConfigError(
                "{model} cannot count a laser beam: the precession needs another counter, one of pulses of light",
                model=model.name,
            )
        if self.laser_input <= model.inputs:
            return suited
        if "laser_input" in self.model_fields_set:
            raise ConfigError(
                "precession.laser_input = {input}: the {model} has one input; take 1, and change the"
                " cable when you are asked to",
                input=self.laser_input,
                model=model.name,
            )
        return suited.model_copy(update={"laser_input": 1})

    def for_scene(self, scene: Scene) -> Self:
        """See the base.  Raises ConfigError where a person would have to change a cable."""
        if self.laser_input == 1:
            raise ConfigError(
                "the virtual bench has no person who could change the counter's cable (precession.laser_input = 1): "
                "take 2, and a counter with two inputs"
            )
        return self

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
            text = "a sweep of {points:.0f} points is more than {most}: take a larger step_hz"
            raise ValueError(Text(text, points=points, most=_MOST_POINTS))
        if len(set(self.sweep)) < 3:
            text = "at least three drive frequencies are needed for a line: {seen} given by {names}"
            names = "frequencies_hz" if self.frequencies_hz is not None else "first_hz, last_hz and step_hz"
            raise ValueError(Text(text, seen=len(set(self.sweep)), names=names))
        return self

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for a drive that the bench does not allow."""
        super().check(table, limits)
        names = ("first_hz", "last_hz") if self.frequencies_hz is None else ("frequencies_hz", "frequencies_hz")
        ends = (self.sweep[0], self.sweep[-1]) if self.frequencies_hz is None else (min(self.sweep), max(self.sweep))
        check_drive(table, limits, self.drive_amplitude_vpp, zip(names, ends, strict=True))


def also_needs(settings: PrecessionSettings) -> tuple[str, ...]:
    """Return the oscilloscope, if there are to be records."""
    return ("oscilloscope",) if settings.record_s else ()


def channels(settings: PrecessionSettings) -> tuple[Channel, ...]:
    """Return the channels of a reading; each point of the sweep gives one."""
    over = f"{settings.counts} gates of {settings.gate_s:g} s"
    one = "that of one count in the configuration" if settings.reading_u_hz else f"scatter of {over}"
    u = f"{one} over √{settings.counts}"
    if not settings.reading_u_hz and settings.counts >= FEWEST:
        u = f"{one}, the swing about the drive taken off"
    return (
        Channel("time_s", "s", "bench clock, from the beginning of the sweep, when the point was counted"),
        Channel("drive_frequency_hz", "Hz", "generator, as set"),
        Channel("drive_frequency_u_hz", "Hz", "its clock by the counter's, from the configuration"),
        Channel("spin_frequency_hz", "Hz", f"frequency counter on the phototransistor at the tape, mean of {over}"),
        Channel("spin_frequency_u_hz", "Hz", u),
        Channel("precession_frequency_hz", "Hz", f"frequency counter on the laser that the stem cuts, mean of {over}"),
        Channel("precession_frequency_u_hz", "Hz", u),
    )


# --- the sweep ---


def run(session: Session[PrecessionSettings]) -> None:
    """Drive the top up and through the sweep; where it is lost, drive it up again."""
    settings = session.settings
    prepare_counter(session)
    session.begin(lambda: None, resumed="the top is driven up again")
    left = settings.sweep[_points_done(session.rows, settings.sweep) :]
    sweep_drive(session, left, lambda drive: _point(session, drive))
    session.event(
        RunEvent.DRIVE_OFF,
        Text("drive off, {some} of {all} points were measured", some=len(session.rows), all=len(settings.sweep)),
    )
    if not session.rows and not session.stop.by:
        raise ExperimentFailed(
            "the top was held at no point of the sweep",
            "choose points at which it floats, by precession.first_hz and precession.last_hz, or drive with more volts",
        )


def _points_done(rows: list[Row], sweep: tuple[float, ...]) -> int:
    """Return the index of the first point after those with readings, in order."""
    done = 0
    for row in rows:
        drive = row["drive_frequency_hz"]
        same = [k for k in range(done, len(sweep)) if math.isclose(sweep[k], drive, rel_tol=1e-9)]
        done = same[0] + 1 if same else done
    return done


def _time_left(settings: PrecessionSettings, done: int) -> float:
    """Return the time that the rest of the sweep takes, if the lock holds [s]."""
    left = settings.sweep[max(done - 1, 0) :]
    way = sum(abs(b - a) for a, b in pairwise(left))
    looks = _LOOKS * max(settings.interval_s, settings.gate_s)
    each = settings.hold_s + looks + 2 * settings.counts * settings.gate_s + settings.record_s
    return way / settings.ramp_hz_per_s + each * (len(settings.sweep) - done)


# --- one point ---


def _point(session: Session[PrecessionSettings], drive: float) -> None:
    """Wait for the lock, measure, and keep the reading.  Raises NotHeld, PointFailed, ExperimentFailed."""
    settings = session.settings
    _wait_for_lock(session, drive)
    row, counts = _measure(session, drive)
    text = Text("spin and laser were counted at {drive:g} Hz", drive=drive)
    session.writer.event(session.now(), RunEvent.COUNTED, text, drive_frequency_hz=drive, **counts)
    left = _time_left(settings, _points_done([*session.rows, row], settings.sweep))
    session.keep(row | {"time_s": session.now()}, left)
    if settings.record_s:  # last: the counts are kept where the record is broken off
        _record(session, drive)


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
            session.event(
                RunEvent.LOCKED,
                Text("locked at {drive:g} Hz", drive=drive),
                drive_frequency_hz=drive,
                spin_frequency_hz=mean,
            )
            return
        session.wait(settings.interval_s - (session.now() - asked))
    raise NotHeld(seen[-1], drive)


def _measure(session: Session[PrecessionSettings], drive: float) -> tuple[Row, dict[str, Any]]:
    """Measure spin and precession of a locked top, with the gates behind them.  Raises as `_point`."""
    settings = session.settings
    spins = _count_gates(session, drive, "spin_frequency_hz", settings.trigger_level_v, 1)
    _still_held(session, drive, spins.frequency)
    _calm(session, drive, swing_of(spins))
    if settings.laser_input == 1:
        session.ask(Task("Connect the laser's phototransistor to the counter's input 1, in place of the tape's."))
    level_v, channel = settings.laser_trigger_level_v, settings.laser_input
    laser = _count_gates(session, drive, "precession_frequency_hz", level_v, channel)
    if settings.laser_input == 1:
        session.ask(Task("Connect the tape's phototransistor to the counter's input 1 again."))
    prepare_counter_again(session)
    held_spin(session, drive)  # else what the laser counted is of a top on its way down
    _check_pulses(session, laser)
    spin, precession = rates_at_point(spins, laser)
    _say_what_was_miscounted(session, laser, precession, drive)
    row = {
        "drive_frequency_hz": drive,
        "drive_frequency_u_hz": settings.clocks_u * drive,
        "spin_frequency_hz": spin.value,
        "spin_frequency_u_hz": _u(spin, settings),
        "precession_frequency_hz": precession.value,
        "precession_frequency_u_hz": _u(precession, settings),
    }
    return row, gates_event(spins, laser)


def _calm(session: Session[PrecessionSettings], drive: float, swing: Swing | None) -> None:
    """Take the swing about the drive off, which hardly anything damps and each change of the drive may enlarge.

    Where the top is farthest ahead of the drive, or behind it, it turns as fast as the drive: set forward or back by as
    much, the drive finds it at rest where it belongs.  The drive is set so by a frequency that differs for a moment.
    """
    if swing is None or swing.size < _CALM or not swing.frequency * _STEP_S < _SHORT:
        return
    step = calming_step(swing, drive, session.now(), session.bench.generator.limits)
    if step is None:
        return
    moment, frequency = step
    session.wait(moment - session.now())
    session.bench.generator.frequency = frequency
    session.wait(_STEP_S)
    session.bench.generator.frequency = drive
    session.event(
        RunEvent.CALMED,
        Text("the top swung {size:.2f} turns about the drive: the drive was moved by this angle", size=swing.size),
    )


def calming_step(swing: Swing, drive: float, now: float, limits: DriveLimits) -> tuple[float, float] | None:
    """Return when to begin a step of the drive's frequency [s], and the frequency during it [Hz].

    Forward where the top is farthest ahead, else back where it is farthest behind, whichever comes first and is within
    the limits of the drive; None where neither is.
    """
    half = 0.5 / swing.frequency
    first = math.ceil((now + _STEP_S - swing.crest) / half)
    for number in (first, first + 1):
        ahead = swing.size if number % 2 == 0 else -swing.size
        frequency = drive + ahead / _STEP_S
        if limits.drive_lowest_hz <= frequency <= limits.drive_frequency_hz:
            return swing.crest + number * half - _STEP_S / 2, frequency
    return None


def _count_gates(session: Session[PrecessionSettings], drive: float, what: str, level_v: float, channel: int) -> Gates:
    """Return the gates of an input of the counter.

    A gate begins and ends with a pulse.  Pulses come early and late where a nutation goes on beside the wobble in step,
    at the beats of the two, and a late pulse is the likelier one to begin or end a gate.  Both ends are late alike, and
    no beat meets one gate as it meets the next, where gates begin and end at times that have nothing to do with pulses:
    so their lengths and the pauses between them are drawn.  Numbers that are spread more evenly than by chance make the
    mean better and its uncertainty unknown.
    """
    settings = session.settings
    counter = session.bench.counter
    found: list[tuple[float, float, float]] = []
    seed = session.writer.record.seed  # of a virtual run, which is the same each time
    seed = int(computer().token(), 16) if seed is None else seed
    random = np.random.default_rng((seed, round(1e6 * drive), channel))

    def prepare(gate_s: float = settings.gate_s) -> None:
        counter.prepare(gate_s=gate_s, trigger_level_v=level_v, channel=channel)

    while len(found) < settings.counts:
        session.stop.check()
        length, pause = random.random(2).tolist()
        gate_s = round(settings.gate_s * (_GATES[0] + (_GATES[1] - _GATES[0]) * length), 6)
        try:
            prepare(gate_s)
            session.wait(pause * _PAUSES / drive)
            count = counter.frequency()
            session.bench.record_settings("counter")  # raises if they are not as they were set
        except InstrumentError as error:
            if error.address != session.bench.address("counter"):
                raise
            session.reconnect("counter", error, prepare)
        else:
            session.saw(what, count)
            found.append(_gate(session.now(), float(counter.last_set.get("gate_s", gate_s)), count))  # as it was set
    begin, end, frequency = np.array(found).T
    return Gates(begin, end, frequency)


def _gate(end: float, gate_s: float, count: float | None) -> tuple[float, float, float]:
    """Begin, end [s] and frequency [Hz] of a gate that ended now, NaN where it had no count."""
    if count is None:
        return end - gate_s, end, math.nan
    return gate_began(end, gate_s, count), end, count


def _still_held(session: Session[PrecessionSettings], drive: float, spins: Array) -> None:
    """Raise NotHeld where one of the counts is not of a held top."""
    if not np.isfinite(spins).all():
        held_spin(session, drive)  # a pulse may be missed, a top that is down stays down
        raise NotHeld(None, drive)
    worst = float(spins[np.argmax(np.abs(spins - drive))])
    if abs(worst - drive) > 1.0:
        raise NotHeld(worst, drive)


def _check_pulses(session: Session[PrecessionSettings], laser: Gates) -> None:
    """Raise where the laser is hardly ever cut: ExperimentFailed before the first reading, later PointFailed.

    At first the set-up is at fault, and all that follows would be as dark; a beam that was cut before is missed by a
    stem that now stands more upright or farther off, and maybe not at the next frequency.
    """
    settings, counted = session.settings, int(np.isfinite(laser.frequency).sum())
    if counted >= _FEWEST_COUNTS:
        return
    where = Text("at {level:g} V, input {input}", level=settings.laser_trigger_level_v, input=settings.laser_input)
    if session.rows:
        raise PointFailed(
            Text(
                "the laser was counted in {counted} of {all} gates {where}, {fewest} are needed: "
                "move the beam until the stem cuts it once a turn of its wobble again, while the sweep "
                "goes on",
                counted=counted,
                all=len(laser),
                where=where,
                fewest=_FEWEST_COUNTS,
            )
        )
    raise ExperimentFailed(
        "the counter sees no laser pulses {where}: does the stem cut the beam, and is the trigger"
        " level between free and cut (precession.laser_trigger_level_v)?",
        where=where,
    )


def _say_what_was_miscounted(session: Session[PrecessionSettings], laser: Gates, found: Rate, drive: float) -> None:
    """Note an event where gates of the laser were left out, or had no count."""
    said = [Text("gate {number} has {pulses}", gate + 1, pulses_too_many(pulses)) for gate, pulses in found.wrong]
    if found.missing:
        said.append(Text("{missing} of {all} gates have no count", missing=found.missing, all=len(laser)))
    if said:
        text = Text("the laser's gates at {drive:g} Hz: {wrong}; left out", drive=drive, wrong=tuple(said))
        session.event(RunEvent.MISCOUNTED, text, drive_frequency_hz=drive)


def _u(rate: Rate, settings: PrecessionSettings) -> float:
    """Return the standard uncertainty of a rate [Hz]; one from the configuration is that of one count."""
    if settings.reading_u_hz is not None:
        return settings.reading_u_hz / math.sqrt(settings.counts)
    return max(rate.u, _LEAST_U_HZ)


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
        now = session.now()
        for what, channel in shown.items():
            session.keep_trace(channel, what, now)
    except InstrumentError as error:
        session.event(
            RunEvent.NO_RECORD,
            Text("no record at {drive:g} Hz: {why}", drive=drive, why=error),
            drive_frequency_hz=drive,
        )


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
