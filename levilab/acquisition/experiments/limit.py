"""The limits of the spin: how slow a top is when it falls, and how fast a drive can make it spin; again and again."""

import itertools
import math
from collections.abc import Callable
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, PositiveFloat, PositiveInt

from analysis.arrays import Array
from analysis.limits import FEWEST_ON_PARABOLA, spin_at_fall, spin_at_loss
from analysis.locked import Cause, cause_of_loss, lag_before_loss, slip_of
from levilab.acquisition.counting import AnotherTop, Missed, free_top, prepare_counter, spin_now
from levilab.acquisition.driving import (
    HELD_WITHIN_HZ,
    RAMP_STEP_S,
    DriveSettings,
    check_drive,
    compare_with_drive,
    drive_until,
    drive_up_and_let_go,
    drives,
    have_a_top,
    held_spin,
    is_over,
)
from levilab.acquisition.experiment import Experiment
from levilab.acquisition.session import DidNotFollow, ExperimentFailed, NotHeld, Row, Session
from levilab.acquisition.triggering import CYCLE, Motor
from levilab.bench.config import Limits
from levilab.present.numbers import with_uncertainty
from levilab.runs.channel import Channel
from levilab.runs.events import RunEvent
from levilab.texts.text import Text

#: A top that the drive does not take up is given up after this many falls.
_MOST_FALLS = 3
#: Fewest counts that a line to the moment of a loss is drawn through.
_FEWEST = 3
#: Counts rise where the slope of a line is above 0 by more of its u; least u of a count that states none [Hz].
_CLEAR, _LEAST_U_HZ = 3.0, 0.03
#: A count below the drive by more standard deviations of the counts is that of a top that slips (2 % of all others).
_NO_SLIP = 2.0
#: Number of counts that compare the tape of a creeping top with the drive, and their distance below the limit [Hz]:
#: nearer to it the top may already fall behind.
_COMPARED, _BELOW_HZ = 20, 5.0


class LimitSettings(DriveSettings):
    """Drive up and hold, then let go (lower) or on upwards (upper) until the top is lost; again and again."""

    one_top: ClassVar[bool] = False
    by_hand: ClassVar[bool] = True
    by_trigger: ClassVar[bool] = True

    which: Literal["lower", "upper"] = Field(default="lower", description="lower, or upper")
    repetitions: PositiveInt = Field(default=10, description="number of tops, one after another")
    drive_frequency_hz: PositiveFloat = Field(default=30.0, description="each is driven to this first,")
    creep_hz_per_s: PositiveFloat = Field(default=0.1, description="upper: rate of the drive from there on")
    highest_hz: PositiveFloat = Field(default=100.0, description="upper: the highest frequency of the drive")
    float_s: PositiveFloat = Field(default=600.0, description="time that a person has to float the top")
    interval_s: PositiveFloat = Field(default=2.0, description="time from one look to the next")
    gate_s: PositiveFloat = Field(default=0.5, description="length of a count")
    longest_s: PositiveFloat = Field(default=6 * 3600.0, description="an end if it takes longer")

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for a drive that the bench does not allow."""
        super().check(table, limits)
        if self.which == "upper" and self.drive_waveform == "NONE":
            said = "{table:s}.drive_waveform = NONE: the upper limit needs a drive, SIN, SQU or TRI"
            raise self.refusal(table, said, "drive_waveform", "which")
        if self.which == "upper":
            check_drive(table, limits, self.drive_amplitude_vpp, [("highest_hz", self.highest_hz)])
        if self.which == "upper" and self.highest_hz <= self.drive_frequency_hz:
            said = (
                "{table:s}.highest_hz = {highest_hz:g}: more than {table:s}.drive_frequency_hz = "
                "{drive_frequency_hz:g} is expected, from where the drive creeps up"
            )
            raise self.refusal(table, said, "highest_hz", "drive_frequency_hz")


def channels(settings: LimitSettings) -> tuple[Channel, ...]:
    """Return the same for both limits, without those of the drive where there is none."""
    limit = "at which the free top fell" if settings.which == "lower" else "up to which the top followed the drive"
    seen = "the lowest one counted" if settings.which == "lower" else "the last one counted of the held top"
    columns = (
        Channel("time_s", "s", "bench clock, from the first top on, when it was lost"),
        Channel("spin_frequency_hz", "Hz", f"spin {limit}"),
        Channel("spin_frequency_u_hz", "Hz", "its standard uncertainty, from the counts and the moment"),
        Channel("spin_seen_hz", "Hz", f"frequency counter on the phototransistor, {seen}"),
        Channel("drive_frequency_hz", "Hz", "generator, the last setting at which the top was held"),
        Channel("drive_amplitude_v", "V", "generator, half of peak to peak"),
    )
    return columns if drives(settings) else columns[:-2]


def run(session: Session[LimitSettings]) -> None:
    """Lose the top, note its limit, float it again; repeat."""
    settings = session.settings
    prepare_counter(session)
    session.begin(lambda: None, resumed="going on with the next top")
    measure = _lower if settings.which == "lower" else _upper
    before = len(session.rows)

    def keep(row: Row) -> None:
        """Keep the limit of a top as soon as it is known."""
        done = len(session.rows) + 1
        session.keep(row, (settings.repetitions - done) * session.time_spent() / (done - before))

    while len(session.rows) < settings.repetitions and not is_over(session):
        if not _with_a_top(session, measure, keep):
            return


def _with_a_top(
    session: Session[LimitSettings],
    measure: Callable[[Session[LimitSettings], Callable[[Row], None]], bool],
    keep: Callable[[Row], None],
) -> bool:
    """Measure the limit of a top; one that the drive does not take up falls after a while, and is floated again.

    Returns False where the time is over.  Raises DidNotFollow after the last of several falls: all limits are kept,
    and the run can be resumed.
    """
    falls, fell = 0, True
    while not is_over(session):
        asked = _have_the_next_top(session)
        falls += asked and not fell  # it fell just after it was seen up
        try:
            return measure(session, keep)
        except (DidNotFollow, AnotherTop) as failed:
            fell = spin_now(session) is None
            falls += fell
            if falls >= _MOST_FALLS:
                raise
            session.event(
                RunEvent.ONCE_MORE,
                Text("{failed}; it {does}, once more", failed=failed, does="fell" if fell else "is still up"),
            )
    return False


def _have_the_next_top(session: Session[LimitSettings]) -> bool:
    """See that the next top floats; where none does, ask for one, and return True.  Raises ExperimentFailed."""
    settings, number = session.settings, len(session.rows)
    session.progress(Text("top {number} of {all}", number + 1, settings.repetitions), number / settings.repetitions)
    spin = spin_now(session) if number else None
    if spin is not None and spin > settings.drive_frequency_hz:  # the last one only lost its lock
        _coast_down(session)
    text = Text("Top {number} of {all}: spin the top and let it float.", number=number + 1, all=settings.repetitions)
    return have_a_top(session, text, number, within_s=settings.float_s)


def _coast_down(session: Session[LimitSettings]) -> None:
    """Let a top that was too fast for the drive come down by itself."""
    settings = session.settings
    session.event(RunEvent.COASTS, "the top is still up and comes down by itself")
    while (spin := spin_now(session)) is not None and spin > settings.drive_frequency_hz:
        if session.time_spent() > settings.longest_s:
            return
        session.progress(Text("coasts down, {spin:.2f} Hz", spin=spin), 1.0)
        session.wait(settings.interval_s)


# --- lower ---


def _lower(session: Session[LimitSettings], keep: Callable[[Row], None]) -> bool:
    """Drive the top up, let it go, watch it until it falls, and keep its limit; False where the time is over."""
    settings = session.settings
    drive_up_and_let_go(session)
    top = free_top(session)
    seen: list[Row] = []
    while not is_over(session):
        asked = session.now()
        if reading := top.read():
            seen.append(reading)
            session.progress(Text("free at {spin:.2f} Hz", spin=reading["spin_frequency_hz"]), 1.0)
        elif end := top.fall():
            keep(_limit_of_fall(session, seen, top.missed_by, end))
            return True
        session.wait(settings.interval_s - (session.now() - asked))
    return False


def _limit_of_fall(session: Session[LimitSettings], seen: list[Row], missed_by: float, text: str) -> Row:
    """Return the reading of a fall.  missed_by: when the first count would have ended that saw no top any more [s]."""
    settings = session.settings
    if len(seen) < _FEWEST:
        raise ExperimentFailed(
            "the top fell {count} readings after the drive went off, {fewest} are needed: drive it "
            "higher first ({experiment:s}.drive_frequency_hz)",
            count=len(seen),
            fewest=_FEWEST,
            experiment=session.writer.record.experiment,
        )
    times, spins = (np.array([row[name] for row in seen]) for name in ("time_s", "spin_frequency_hz"))
    u = [row["spin_frequency_u_hz"] for row in seen if "spin_frequency_u_hz" in row]
    stated = float(np.sqrt(np.mean(np.square(u)))) if u else None
    if _rises(times, spins, stated):  # a phone's samples may show the spin's image at their rate, which rises
        said = "the counts rise from {first:.2f} Hz to {last:.2f} Hz up to the fall: a top that coasts gains no spin"
        raise DidNotFollow(Text(said, first=spins[0], last=spins[-1]))
    between = (float(times[-1]) + settings.gate_s / 2, missed_by)
    limit = spin_at_fall(times, spins, stated, between)
    assert limit.value is not None
    assert limit.u is not None
    lowest = float(spins.min())
    said = "a line through the last counts gives {limit:n}; the lowest count is {lowest:.2f} Hz"
    words = Text(said, limit=with_uncertainty(limit), lowest=lowest)
    if lowest < limit.value:  # not the bound that it seems to be
        words = Text("{line}, below the line by its scatter", line=words)
    session.event(RunEvent.FELL, Text("{text}; {words}", text=text, words=words), spin_frequency_hz=limit.value)
    row: Row = {
        "time_s": session.now(),
        "spin_frequency_hz": limit.value,
        "spin_frequency_u_hz": limit.u,
        "spin_seen_hz": lowest,
    }
    if not drives(settings):
        return row
    return row | {
        "drive_frequency_hz": settings.drive_frequency_hz,
        "drive_amplitude_v": settings.drive_amplitude_vpp / 2,
    }


def _rises(times: Array, spins: Array, u: float | None) -> bool:
    """Return whether the slope of a line through counts of this u [Hz] is above 0 by more than their scatter allows."""
    off = times - times.mean()
    slope = float(off @ spins / (off @ off))
    scatter = u or max(_LEAST_U_HZ, float(np.std(spins - slope * off, ddof=2)))
    return slope > _CLEAR * scatter / float(np.sqrt(off @ off))


# --- upper ---


def _upper(session: Session[LimitSettings], keep: Callable[[Row], None]) -> bool:
    """Drive the top up, and on until it is lost, and keep its limit; False where the time is over."""
    before = len(session.rows)

    def go_on(motor: Motor | None) -> None:
        if motor is None:
            _creep_up(session, keep)
        else:
            _climb(session, motor, keep)

    drive_until(session, go_on)
    return len(session.rows) > before


def _creep_up(session: Session[LimitSettings], keep: Callable[[Row], None]) -> None:
    """Raise the drive until the top does not follow, or time is over; the limit is kept before the drive goes off."""
    settings = session.settings
    start, drive, at = settings.drive_frequency_hz, settings.drive_frequency_hz, session.now()
    # A step lasts as long as a count, so the drive goes up evenly whether the top is looked at or not: uneven steps
    # make it swing about the drive, until it is lost early.  A counter that is reached again must not make it jump.
    every, longest_step_s = max(1, round(settings.interval_s / settings.gate_s)), 2 * settings.gate_s
    held = start
    seen: list[tuple[float, float, float]] = []  # end [s], spin, drive [Hz] of counts that were looked at
    counts: list[tuple[float, float, float]] = []  # end [s], spin, drive [Hz] of each step: their sum is the phase
    for k in itertools.count(1):
        spin = spin_now(session) if k % every else None
        if spin is None or abs(spin - drive) > HELD_WITHIN_HZ:
            try:
                spin = held_spin(session, drive)
            except NotHeld as lost:
                if not counts:  # no spin at which it was held to begin with
                    raise DidNotFollow(
                        "{lost}, as the creep began", "float it again, or drive harder", lost=lost
                    ) from lost
                limit = _limit_of_loss(settings, (held, drive), counts)
                keep({"time_s": session.now()} | limit)
                if lost.spin is not None:
                    counts.append((session.now(), lost.spin, drive))
                _say_how_it_was_lost(session, lost, limit, seen, counts)
                return
            seen.append((session.now(), spin, drive))
            if is_over(session):
                return
        counts.append((session.now(), spin, drive))
        held = drive
        before, at = at, session.now()
        drive += settings.creep_hz_per_s * min(at - before, longest_step_s)
        if drive > settings.highest_hz:
            name = session.writer.record.experiment
            raise ExperimentFailed(
                "the top still follows at {highest_hz:g} Hz ({name}.highest_hz): allow a higher drive "
                "there and in limits.drive_frequency_hz, or weaken it",
                highest_hz=settings.highest_hz,
                name=name,
            )
        session.bench.generator.frequency = drive
        session.progress(Text("drive at {drive:.2f} Hz", drive=drive), (drive - start) / (settings.highest_hz - start))


def _climb(session: Session[LimitSettings], motor: Motor, keep: Callable[[Row], None]) -> None:
    """Let a top that triggers its drive get faster until it is lost or gets no faster, and keep that spin.

    A limit is the spin of a parabola through the last counts, in the middle of the time in which it was lost.
    """
    settings = session.settings
    climb = motor.climb(
        min(settings.highest_hz, session.bench.generator.limits.drive_frequency_hz / CYCLE) - HELD_WITHIN_HZ
    )
    spin, lost = climb.levels_off_at, climb.lost
    if spin is None:
        if climb.spins.size < FEWEST_ON_PARABOLA:
            raise DidNotFollow(
                "the top was lost {size} counts after the way up began", "float it again", size=climb.spins.size
            )
        between = (float(climb.times[-1]) + settings.gate_s / 2, climb.first_missed)
        spin = spin_at_loss(climb.times, climb.spins, between)
    assert spin.value is not None
    assert spin.u is not None
    amplitude, seen = settings.drive_amplitude_vpp / 2, float(climb.spins[-1])
    keep(
        {"time_s": session.now(), "spin_frequency_hz": spin.value, "spin_frequency_u_hz": spin.u, "spin_seen_hz": seen}
        | {"drive_frequency_hz": CYCLE * seen, "drive_amplitude_v": amplitude}
    )
    if lost is None:
        kind, what, cause = RunEvent.LEVELS_OFF, "the top gets no faster", Cause.PULLS_NO_FURTHER
    else:
        kind, what = _end_of(session, lost)
        cause = cause_of_loss(0.0, fell=kind is RunEvent.TOP_LOST)  # no lag where the top itself triggers the drive
    how = Text(": {lost}", lost=lost) if lost else ""
    text = Text("{what} at {spin:n}{how}; {cause}", what=what, spin=with_uncertainty(spin), how=how, cause=cause)
    session.event(
        kind, text,
        spin_frequency_hz=spin.value, top=len(session.rows), cause=cause,
    )  # fmt: skip


def _end_of(session: Session[LimitSettings], lost: NotHeld) -> tuple[RunEvent, str]:
    """Return whether a lost top is down, as an event and as text."""
    top = free_top(session)
    is_up = lost.spin is not None or top.read() is not None or top.missed[-1] is Missed.UNSTEADY
    return (RunEvent.LOCK_LOST, "the drive lost the top") if is_up else (RunEvent.TOP_LOST, "the top fell")


def _limit_of_loss(
    settings: LimitSettings, between: tuple[float, float], counts: list[tuple[float, float, float]]
) -> Row:
    """Return the reading of a top that no longer follows, without its time.

    between: the drive's frequencies at the last count at which it did, and at the first one at which it did not [Hz];
    counts: end [s], spin and drive [Hz] of each step, up to that last count.
    """
    (held, drive), seen = between, counts[-1][1]
    # a top that slips is taken for held until it is far behind; but it only slows, so its limit is above the counts.
    # They scatter by their noise and by the swing about the drive: by less than that below the drive is no slip.
    beside = np.array([spin - step for _, spin, step in counts])
    scatter = 1.4826 * float(np.median(np.abs(beside - np.median(beside))))  # a standard deviation, by the median
    low = min(held, seen + _NO_SLIP * scatter)
    return {
        "spin_frequency_hz": (low + drive) / 2,
        "spin_frequency_u_hz": (drive - low) / 12**0.5,
        "spin_seen_hz": seen,
        "drive_frequency_hz": held,
        "drive_amplitude_v": settings.drive_amplitude_vpp / 2,
    }


def _say_how_it_was_lost(
    session: Session[LimitSettings],
    lost: NotHeld,
    limit: Row,
    seen: list[tuple[float, float, float]],
    counts: list[tuple[float, float, float]],
) -> None:
    """Record whether its tape slipped, whether the top is still up, and why it was lost; once the limit is kept."""
    kind, what = _end_of(session, lost)
    spin, held = limit["spin_frequency_hz"], limit["drive_frequency_hz"]
    safely_held = [one for one in seen if one[2] < held - _BELOW_HZ][-_COMPARED:]
    if len(safely_held) > 1:
        ends, spins, drives = zip(*safely_held, strict=True)
        # each step makes the top swing, and the counts see the swing at the same phase
        step = session.settings.creep_hz_per_s * RAMP_STEP_S
        compare_with_drive(session, slip_of(spins, drives, least=2 * step), time_s=ends[-1])
    lag = lag_before_loss(*zip(*counts, strict=True)) if counts else math.nan
    cause = cause_of_loss(lag, fell=kind is RunEvent.TOP_LOST)
    known = {} if math.isnan(lag) else {"lag_turns": lag}
    behind = Text(", the lag behind the drive grew by {lag:.2f} turns in the end", lag=lag) if known else ""
    text = Text("{what} at {spin:.2f} Hz: {lost}; {cause}{behind}", what, spin, lost, cause, behind)
    session.event(
        kind, text,
        spin_frequency_hz=spin, drive_frequency_hz=lost.drive, top=len(session.rows), cause=cause, **known,
    )  # fmt: skip


EXPERIMENT = Experiment(
    name="limit",
    about="the lowest spin of a free top, or the highest that a drive can hold, top after top",
    instruments=("counter",),
    also_needs=drives,
    settings=LimitSettings,
    channels=channels,
    run=run,
)
