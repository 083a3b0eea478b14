"""The limits of the spin: how slow a top is when it falls, and how fast a drive can make it spin; again and again."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field, PositiveFloat, PositiveInt

from analysis.limits import spin_at_fall
from analysis.locked import slip_of
from levilab.acquisition.counting import FreeTop, Missed, prepare_counter, spin_now
from levilab.acquisition.driving import (
    RAMP_STEP_S,
    DidNotFollow,
    DriveSettings,
    NotHeld,
    compare_with_drive,
    drive_until,
    drive_up_and_let_go,
    held_spin,
    no_light,
)
from levilab.acquisition.experiment import Experiment
from levilab.acquisition.session import ExperimentFailed
from levilab.bench.config import ConfigError
from levilab.bench.person import FloatTop
from levilab.runs.channel import Channel

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.acquisition.session import Row, Session
    from levilab.bench.config import Limits

#: A top that a person was asked for is looked for so often [s].
_LOOK_S = 2.0
#: A top that the drive does not take up is given up after so many falls.
_MOST_FALLS = 3
#: The tape of a creeping top is compared with the drive by so many counts, so far below the limit [Hz]: nearer to it
#: the top may already fall behind.
_COMPARED, _BELOW_HZ = 20, 5.0


class LimitSettings(DriveSettings):
    """Drive up and hold, then let go (lower) or creep upwards (upper) until the top is lost; again and again."""

    one_top: ClassVar[bool] = False

    which: Literal["lower", "upper"] = Field(default="lower", description="lower, or upper")
    repetitions: PositiveInt = Field(default=10, description="so many tops, one after another")
    drive_frequency_hz: PositiveFloat = Field(default=30.0, description="each is driven to this first,")
    creep_hz_per_s: PositiveFloat = Field(default=0.1, description="upper: from there so fast,")
    highest_hz: PositiveFloat = Field(default=100.0, description="and no higher than this")
    float_s: PositiveFloat = Field(default=600.0, description="so long a person has to float the top")
    interval_s: PositiveFloat = Field(default=2.0, description="looked at so often,")
    gate_s: PositiveFloat = Field(default=0.5, description="counting for so long")
    longest_s: PositiveFloat = Field(default=6 * 3600.0, description="an end if it takes longer")

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for a drive that the bench does not allow."""
        super().check(table, limits)
        if self.which == "upper" and self.highest_hz > limits.drive_frequency_hz:
            raise ConfigError(
                f"{table}.highest_hz = {self.highest_hz:g} is more than this bench allows, "
                f"limits.drive_frequency_hz = {limits.drive_frequency_hz:g}"
            )
        if self.which == "upper" and self.highest_hz <= self.drive_frequency_hz:
            raise ConfigError(
                f"{table}.highest_hz = {self.highest_hz:g}: more than {table}.drive_frequency_hz = "
                f"{self.drive_frequency_hz:g} is expected, from where the drive creeps up"
            )


def channels(settings: LimitSettings) -> tuple[Channel, ...]:
    """The same for both limits."""
    limit = "at which the free top fell" if settings.which == "lower" else "up to which the top followed the drive"
    seen = "the lowest one counted" if settings.which == "lower" else "the last one counted of the held top"
    return (
        Channel("time_s", "s", "bench clock, from the first top on, when it was lost"),
        Channel("spin_frequency_hz", "Hz", f"spin {limit}"),
        Channel("spin_frequency_u_hz", "Hz", "its standard uncertainty, from the counts and the moment"),
        Channel("spin_seen_hz", "Hz", f"frequency counter on the phototransistor, {seen}"),
        Channel("drive_frequency_hz", "Hz", "generator, the last setting at which the top was held"),
        Channel("drive_amplitude_v", "V", "generator, half of peak to peak"),
    )


def run(session: Session[LimitSettings]) -> None:
    """Lose the top, note its limit, float it again; so many times."""
    settings = session.settings
    prepare_counter(session)
    session.begin(lambda: None, resumed="going on with the next top")
    measure = _lower if settings.which == "lower" else _upper
    done = len(session.rows)
    for number in range(done, settings.repetitions):
        row = _with_a_top(session, number, measure)
        if row is None:
            return
        left = settings.repetitions - number - 1
        session.keep(row, left * session.spent() / (number + 1 - done))


def _with_a_top(
    session: Session[LimitSettings], number: int, measure: Callable[[Session[LimitSettings]], Row | None]
) -> Row | None:
    """The limit of a top; one that the drive does not take up falls after a while, and is floated again."""
    falls = 0
    while not _is_over(session):
        _have_a_top(session, number)
        try:
            return measure(session)
        except DidNotFollow as failed:
            fell = spin_now(session) is None
            falls += fell
            if falls == _MOST_FALLS:
                raise
            session.event("once more", f"{failed}; it {'fell' if fell else 'is still up'}, once more")
    return None


def _have_a_top(session: Session[LimitSettings], number: int) -> None:
    """See that a top floats; where none does, ask for one.  Raises ExperimentFailed."""
    settings = session.settings
    session.progress(f"top {number + 1} of {settings.repetitions}", number / settings.repetitions)
    if number == 0 and spin_now(session) is not None:
        return
    if number and _spins_freely(session):
        _coast_down(session)
    if spin_now(session) is None:
        session.ask(FloatTop(f"Top {number + 1} of {settings.repetitions}: spin the top and let it float.", number))
    end = session.now() + settings.float_s
    while (spin := spin_now(session)) is None and session.now() < end:
        session.wait(_LOOK_S)
    if spin is None:
        raise no_light(session)


def _spins_freely(session: Session[LimitSettings]) -> bool:
    """Whether the last top still spins, faster than the drive is to begin: one that only lost its lock."""
    spin = spin_now(session)
    return spin is not None and spin > session.settings.drive_frequency_hz


def _coast_down(session: Session[LimitSettings]) -> None:
    """Let a top that was too fast for the drive come down by itself."""
    settings = session.settings
    session.event("coasts", "the top is still up and comes down by itself")
    while (spin := spin_now(session)) is not None and spin > settings.drive_frequency_hz:
        if session.spent() > settings.longest_s:
            return
        session.progress(f"coasts down, {spin:.2f} Hz", 1.0)
        session.wait(settings.interval_s)


def _is_over(session: Session[LimitSettings]) -> bool:
    longest = session.settings.longest_s
    if session.spent() <= longest:
        return False
    session.event("longest", f"{longest:g} s are over ({session.writer.record.experiment}.longest_s)")
    return True


# --- lower ---


def _lower(session: Session[LimitSettings]) -> Row | None:
    """Drive the top up, let it go, and watch it until it falls; None where the time is over."""
    settings = session.settings
    drive_up_and_let_go(session)
    top = FreeTop(session)
    seen: list[Row] = []
    missed_since: float | None = None
    while not _is_over(session):
        asked = session.now()
        if reading := top.read():
            seen.append(reading)
            missed_since = None
            session.progress(f"free at {reading['spin_frequency_hz']:.2f} Hz", 1.0)
        else:
            # a counter that was lost saw nothing of the top, which may have been up all that time
            if top.missed[-1] is not Missed.LOST and missed_since is None:
                missed_since = asked
            if end := top.fall(asked):
                return _limit_of_fall(session, seen, asked if missed_since is None else missed_since, end)
        session.wait(settings.interval_s - (session.now() - asked))
    return None


def _limit_of_fall(session: Session[LimitSettings], seen: list[Row], missed_since: float, text: str) -> Row:
    """The reading of a fall.  missed_since: when the first count was asked for that saw no top any more [s]."""
    settings = session.settings
    if len(seen) < 3:
        raise ExperimentFailed(
            f"the top fell {len(seen)} readings after the drive went off, 3 are needed: drive it higher first "
            f"({session.writer.record.experiment}.drive_frequency_hz)"
        )
    times, spins = (np.array([row[name] for row in seen]) for name in ("time_s", "spin_frequency_hz"))
    between = (float(times[-1]) + settings.gate_s / 2, missed_since + settings.gate_s)
    limit = spin_at_fall(times, spins, settings.reading_u_hz, between)
    assert limit.value is not None
    assert limit.u is not None
    session.event(
        "fell", f"{text}; {limit.value:.2f} Hz, lowest seen {spins.min():.2f} Hz", spin_frequency_hz=limit.value
    )
    return {
        "time_s": session.now(),
        "spin_frequency_hz": limit.value,
        "spin_frequency_u_hz": limit.u,
        "spin_seen_hz": float(spins.min()),
        "drive_frequency_hz": settings.drive_frequency_hz,
        "drive_amplitude_v": settings.drive_amplitude_vpp / 2,
    }


# --- upper ---


def _upper(session: Session[LimitSettings]) -> Row | None:
    """Drive the top up, and creep on until it is lost."""
    found: list[Row] = []

    def creep(session: Session[LimitSettings]) -> None:
        if row := _creep_up(session):
            found.append(row)

    drive_until(session, creep)
    return found[0] if found else None


def _creep_up(session: Session[LimitSettings]) -> Row | None:
    """Raise the drive until the top does not follow; None where the time is over."""
    settings = session.settings
    start, drive, at = settings.drive_frequency_hz, settings.drive_frequency_hz, session.now()
    # a counter that is reached again after a while must not make the drive jump
    longest_step_s = RAMP_STEP_S + 2 * settings.gate_s
    every = max(1, round(settings.interval_s / RAMP_STEP_S))
    held = start
    seen: list[tuple[float, float]] = []
    for k in itertools.count(1):
        session.wait(RAMP_STEP_S)
        before, at = at, session.now()
        drive += settings.creep_hz_per_s * min(at - before, longest_step_s)
        if drive > settings.highest_hz:
            name = session.writer.record.experiment
            raise ExperimentFailed(
                f"the top still follows at {settings.highest_hz:g} Hz ({name}.highest_hz): allow a higher drive there "
                "and in limits.drive_frequency_hz, or weaken it"
            )
        session.bench.generator.frequency = drive
        session.progress(f"drive at {drive:.2f} Hz", (drive - start) / (settings.highest_hz - start))
        if k % every:
            continue
        try:
            seen.append((held_spin(session, drive), drive))
        except NotHeld as lost:
            session.bench.outputs_off()
            return _limit_of_loss(session, lost, (held, drive), seen)
        held = drive
        if _is_over(session):
            return None
    return None


def _limit_of_loss(
    session: Session[LimitSettings], lost: NotHeld, between: tuple[float, float], seen: list[tuple[float, float]]
) -> Row:
    """The reading of a top that no longer follows.

    between: the drive's frequencies at the last look at which it did, and at the first one at which it did not [Hz];
    seen: each count until then, with the drive's frequency [Hz].
    """
    settings, (held, drive) = session.settings, between
    top = FreeTop(session)
    is_up = lost.spin is not None or top.read() is not None or top.missed[-1] is Missed.UNSTEADY
    # a top that slips is taken for held until it is far behind; but it only slows, so its limit is above what was seen
    low = min(held, seen[-1][0]) if seen else held
    limit, u = (low + drive) / 2, (drive - low) / 12**0.5
    kind, what = ("lock lost", "the drive lost the top") if is_up else ("top lost", "the top fell")
    session.event(kind, f"{what} at {limit:.2f} Hz: {lost}", spin_frequency_hz=limit, drive_frequency_hz=drive)
    safely_held = [(spin, drive) for spin, drive in seen if drive < held - _BELOW_HZ][-_COMPARED:]
    if len(safely_held) > 1:
        spins, drives = zip(*safely_held, strict=True)
        # each step makes the top swing, and the counts see the swing at the same phase
        compare_with_drive(session, slip_of(spins, drives, least=2 * settings.creep_hz_per_s * RAMP_STEP_S))
    return {
        "time_s": session.now(),
        "spin_frequency_hz": limit,
        "spin_frequency_u_hz": u,
        "spin_seen_hz": seen[-1][0] if seen else held,
        "drive_frequency_hz": held,
        "drive_amplitude_v": settings.drive_amplitude_vpp / 2,
    }


EXPERIMENT = Experiment(
    name="limit",
    about="the lowest spin of a free top, or the highest that a drive can hold, top after top",
    instruments=("counter", "generator"),
    settings=LimitSettings,
    channels=channels,
    run=run,
)
