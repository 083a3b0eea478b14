"""Driving a top: a drive takes hold of it, raises its spin, holds it while the motion settles, and lets it go.

A sweep takes a held top from one frequency of the drive to the next; a point at which it is lost is recorded as failed,
and the sweep goes on.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self, TypeVar

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat

from analysis.locked import Slip, slip_of
from instruments.errors import InstrumentError, OutOfRange
from levilab.acquisition.counting import prepare_counter_again, spin_now
from levilab.acquisition.experiment import CounterSettings, ModelOf
from levilab.acquisition.grip import COUNTS, GRIP_GATE_S, Grip
from levilab.acquisition.session import DidNotFollow, NoLight, NotHeld, Session
from levilab.acquisition.triggering import CYCLE, Motor, spin_up
from levilab.bench.config import BenchConfig, ConfigError, Limits, SettingRefused
from levilab.bench.person import FloatTop
from levilab.present.numbers import with_sign
from levilab.present.panel import clock
from levilab.runs.events import RunEvent
from levilab.texts.text import Text

#: The drive goes up in steps; each makes a held top swing a little about it [s].
RAMP_STEP_S = 1.0
#: A ramp that takes longer from standstill to the drive's frequency is refused [s]: at 40 Hz one of 0.0019 Hz/s.  The
#: top's mass fits its place for as long as the room keeps its temperature, which is no longer than some hours.
_LONGEST_RAMP_S = 6 * 3600.0
#: Where the usual top floats [Hz]: the window of small motions of the thesis's top 7.30 cm above its base
#: (docs/physics.md; `levilab stability` computes it).  Beyond it no drive keeps a top up.
_USUAL_WINDOW_HZ = (21.65, 80.60)
#: A held top swings about the drive's frequency by what the drive can hold at most, 0.5 Hz at 0.4 mT [Hz].
HELD_WITHIN_HZ = 1.0
#: The halves of a hold differ by no more than this where the top is held [Hz], the beginning and the end of a swing of
#: a third of a turn in 10 s each, nor by this multiple of u; a lost top loses 1 Hz meanwhile.
#: Fewest counts in a half.
_DRIFTS_HZ, _DRIFTS_BY_U, _FEWEST_IN_HALF = 0.1, 3.0, 3
#: A top that was taken along nearly half a turn off the drive may turn over against it, slowly and once, and is held
#: then; with the swing that is less than this [turns].  A tape that slips is as far behind in a second hold.
_TURNED_OVER = 1.5
#: A top that the drive did not take hold of, or lost, loses 0.1 Hz/s to the air: the interval between looks on the way
#: [s], and the number of tries.
_LOOK_EVERY_S, _TRIES_TO_HOLD = 10.0, 4
#: Interval between looks for a top that a person was asked for [s].
_LOOK_FOR_TOP_S = 2.0
#: Time that a person has to spin and float the top of a spin-down without a drive, or of a sweep [s].
_BY_HAND_S = 600.0
#: Tries of a point of a sweep, and failed points in succession that end the sweep.
TRIES, MOST_FAILED = 2, 3


class DriveSettings(CounterSettings):
    """Drive up to a frequency, hold the top there, switch off.

    Attributes:
        ramp_hz_per_s: no faster than the drive can pull the top; of the 0.4 Hz/s that 0.4 mT can, drag takes up to 0.17
            and the swing about the drive most of the rest.
    """

    drive_frequency_hz: PositiveFloat = Field(default=40.0, description="drive the top up to this,")
    ramp_hz_per_s: PositiveFloat = Field(default=0.05, description="no faster than it can follow")
    drive_amplitude_vpp: PositiveFloat = 10.0
    drive_waveform: Literal["SIN", "SQU", "TRI", "NONE"] = Field(
        default="SIN", description="SIN, SQU or TRI; NONE: spun by hand"
    )
    hold_s: NonNegativeFloat = Field(default=20.0, description="hold it there, and compare its spin with the drive")
    drive: Literal["ramp", "triggered"] = Field(
        default="ramp", description="triggered: the top's own pulse starts each cycle"
    )
    drive_phase_deg: float | None = Field(
        default=None, ge=0, lt=360, description="start phase of a triggered cycle; by default found", examples=[160.0]
    )

    #: Whether a top that is spun by hand will do, and one that triggers its drive.
    by_hand: ClassVar[bool] = False
    by_trigger: ClassVar[bool] = False

    def for_bench(self, config: BenchConfig, model_of: ModelOf) -> Self:
        """See the base.  Raises ConfigError for a triggered drive where no wire leads to the generator's trigger."""
        if self.drive == "triggered" and config.generator and config.generator.trigger is None:
            raise ConfigError(
                "a triggered drive needs a wire from the tape's phototransistor to the generator's trigger input: say "
                'in the bench file which edge of its pulse starts a cycle, generator.trigger = "rising" or "falling"'
            )
        return super().for_bench(config, model_of)

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for a drive that the bench does not allow."""
        if self.drive_waveform == "NONE":
            if not self.by_hand:
                said = "{table:s}.drive_waveform = NONE: this experiment needs a drive, SIN, SQU or TRI"
                raise self.refusal(table, said, "drive_waveform")
            if self.drive == "triggered":
                said = "{table:s}.drive_waveform = NONE: a triggered drive has cycles of SIN, SQU or TRI"
                raise self.refusal(table, said, "drive_waveform", "drive")
            return
        if self.drive == "triggered":
            self._check_triggered(table, limits)
        check_drive(table, limits, self.drive_amplitude_vpp, [("drive_frequency_hz", self.drive_frequency_hz)])
        lowest, highest = _USUAL_WINDOW_HZ
        if not lowest / 2 <= self.drive_frequency_hz <= 2 * highest:  # a slip of the unit would cost the top
            said = (
                "{table:s}.drive_frequency_hz = {drive_frequency_hz:g} Hz: no top floats there; a Levitron of the"
                " usual kind does between {lowest:.2f} and {highest:.2f} Hz"
            )
            raise self.refusal(table, said, "drive_frequency_hz", lowest=lowest, highest=highest)
        slowest = self.drive_frequency_hz / _LONGEST_RAMP_S
        if self.ramp_hz_per_s < slowest:
            said = (
                "{table:s}.ramp_hz_per_s = {ramp_hz_per_s:g} would raise the top for hours to "
                "{table:s}.drive_frequency_hz = {drive_frequency_hz:g}: at least {slowest:.2g} is expected"
            )
            raise self.refusal(table, said, "ramp_hz_per_s", "drive_frequency_hz", slowest=slowest)

    def _check_triggered(self, table: str, limits: Limits) -> None:
        if not self.by_trigger:
            said = "{table:s}.drive = triggered: the drive sets the frequency here, so ramp is expected"
            raise self.refusal(table, said, "drive")
        fastest = limits.of_the_drive().beyond(frequency_hz=CYCLE * self.drive_frequency_hz)
        if fastest and fastest.is_highest:
            said = (
                "{table:s}.drive_frequency_hz = {drive_frequency_hz:g}: the cycles of a triggered drive are"
                " {cycle:g} times as fast, more than this bench allows, limits.{name:s} = {limit:g}"
            )
            names = ("drive_frequency_hz", "drive")
            raise self.refusal(table, said, *names, cycle=CYCLE, name=fastest.name, limit=fastest.limit)


def drives(settings: DriveSettings) -> tuple[str, ...]:
    """Return the generator, unless the top is spun by hand."""
    return () if settings.drive_waveform == "NONE" else ("generator",)


def check_drive(table: str, limits: Limits, amplitude_vpp: float, frequencies: Iterable[tuple[str, float]]) -> None:
    """Raise ConfigError for a drive that the bench does not allow.

    Args:
        table: of the settings in the bench file.
        limits: of the bench.
        amplitude_vpp: that is asked for [V].
        frequencies: names of its settings, with what they ask for [Hz].
    """
    drive = limits.of_the_drive()
    asked = [("drive_amplitude_vpp", amplitude_vpp, drive.beyond(amplitude_vpp=amplitude_vpp))]
    asked += [(name, frequency, drive.beyond(frequency_hz=frequency)) for name, frequency in frequencies]
    for name, wanted, found in asked:
        if found:
            raise SettingRefused(
                "{table:s}.{name:s} = {wanted:g} is {more} than this bench allows, limits.{limit_name:s} = {limit:g}",
                name,
                table=table,
                name=name,
                wanted=wanted,
                more="more" if found.is_highest else "less",
                limit_name=found.name,
                limit=found.limit,
            )


D = TypeVar("D", bound=DriveSettings)


class PointFailed(Exception):
    """Nothing can be measured at a point of a sweep, though the top is held: the sweep goes on to the next one."""


# --- up ---


def drive_until(session: Session[D], steps: Callable[[Motor | None], None]) -> None:
    """Drive the top up, go through steps while it is held, and switch the drive off.

    steps: called with the motor of a triggered drive, None of a ramp.

    If the generator fails meanwhile, all of it is done once more, from the top's new spin; but not if it fails when it
    is switched off after the steps: what they measured counts.
    """
    while True:
        try:
            steps(drive_up(session))
        except InstrumentError as error:
            reach_generator_again(session, error)
        else:
            drive_off(session)
            return


def drive_up_and_let_go(session: Session[D]) -> None:
    """Drive the top up, hold it while its motion settles, and let it go; or see that one was spun by hand."""
    if session.settings.drive_waveform == "NONE":
        have_a_top(session, "Spin the top and let it float.", len(session.rows), within_s=_BY_HAND_S)
        session.event(RunEvent.COASTS, "the top was spun by hand and spins down freely")
        return
    began = session.now()
    drive_until(session, lambda _: None)
    session.event(RunEvent.DRIVE_OFF, "drive off, the top spins down freely", driven_s=round(session.now() - began, 1))


def drive_off(session: Session[D]) -> None:
    """Switch the drive off; a generator that fails meanwhile is reached again.  Raises InstrumentError."""
    try:
        session.bench.outputs_off()
    except InstrumentError as error:
        reach_generator_again(session, error)


def reach_generator_again(session: Session[D], error: InstrumentError) -> None:
    """Reach a generator that failed again, its output off.  Raises an error of another instrument, or of a setting."""
    if error.address != session.bench.address("generator") or isinstance(error, OutOfRange):
        raise error
    session.reconnect("generator", error, session.bench.outputs_off)


def drive_up(session: Session[D], to: float | None = None) -> Motor | None:
    """Let the drive take hold of the top at its own spin, bring it to a frequency, and hold it there.

    Args:
        session: the acquisition.
        to: that frequency [Hz]; None: as the settings say.

    Returns:
        The motor of a triggered drive; None for a ramp.

    Raises:
        DidNotFollow: the drive is off.
        ExperimentFailed: no light is seen.
    """
    settings = session.settings
    target = settings.drive_frequency_hz if to is None else to
    seen = ""
    for tries in range(1, _TRIES_TO_HOLD + 1):
        spin = spin_now(session)
        if spin is None:
            raise (_did_not_follow(session, target, Text("{seen}; then it fell", seen)) if seen else _no_light(session))
        session.stop.check()  # the drive does not go on once the end was asked for
        try:
            return _bring_up(session, spin, target)
        except DidNotFollow:
            session.bench.outputs_off()
            raise
        except NotHeld as lost:
            session.bench.outputs_off()
            seen = str(lost)
            session.event(
                RunEvent.NOT_HELD,
                Text("try {tries} of {most}: the drive does not hold the top, {seen}", tries, _TRIES_TO_HOLD, seen),
            )
    raise _did_not_follow(session, target, seen)


def _bring_up(session: Session[D], spin: float, target: float) -> Motor | None:
    """Bring a top of this spin to another one, and hold it there [Hz].  Raises NotHeld, DidNotFollow."""
    settings = session.settings
    if settings.drive == "triggered":
        return spin_up(session, spin, target)
    session.bench.generator.prepare(
        waveform=settings.drive_waveform, frequency_hz=spin, amplitude_vpp=settings.drive_amplitude_vpp
    )
    session.event(RunEvent.DRIVE_ON, Text("drive on at the top's spin, {spin:.2f} Hz", spin=spin), frequency_hz=spin)
    session.bench.generator.output = True
    held = _ramp(session, _take_hold(session, spin), target)
    text = Text("the top follows the drive at {target:.2f} Hz: {held:.2f} Hz counted", target=target, held=held)
    session.event(RunEvent.LOCKED, text, frequency_hz=held)
    _hold(session, target)
    return None


def _did_not_follow(session: Session[D], target: float, seen: str) -> DidNotFollow:
    name = session.writer.record.experiment
    observed = Text("the top did not follow the drive to {target:g} Hz ({seen})", target=target, seen=seen)
    lowest, highest = _USUAL_WINDOW_HZ
    if not lowest <= target <= highest:
        return DidNotFollow(
            "{observed}; a Levitron of the usual kind floats only between {lowest:.2f} and {highest:.2f} Hz",
            "ask for a spin between these ({name}.drive_frequency_hz); levilab stability computes them for a top",
            observed=observed,
            lowest=lowest,
            highest=highest,
            name=name,
        )
    return DidNotFollow(
        observed, Text("ramp slower ({name}.ramp_hz_per_s) or drive harder ({name}.drive_amplitude_vpp)", name=name)
    )


def _no_light(session: Session[D]) -> NoLight:
    name, signal = session.writer.record.experiment, session.bench.counter.SIGNAL
    level, where = "", ""
    if signal.has_level:
        level = Text(" at {level:g} V", level=session.settings.trigger_level_v)
        where = Text(" ({name}.trigger_level_v in the bench file)", name=name)
    return NoLight(
        "the counter sees no {signal}{level}",
        "{advice}{where}?",
        signal=signal.name,
        level=level,
        advice=signal.advice,
        where=where,
    )


def _take_hold(session: Session[D], spin: float) -> float:
    """Let a drive switched on at the top's spin follow it until it holds; return its frequency then [Hz].

    Raises NotHeld.
    """
    limits = session.bench.generator.limits
    grip = Grip(spin, limits.drive_lowest_hz, limits.drive_frequency_hz)
    prepare_counter_again(session, GRIP_GATE_S)
    seen: float | None = None
    while not (grip.is_over or grip.is_lost):
        session.stop.check()
        seen = spin_now(session, GRIP_GATE_S)
        session.bench.generator.frequency = grip.follow(seen)
        session.progress(
            Text("the drive takes hold: count {count} of {counts}, {drive:.2f} Hz", grip.counts, COUNTS, grip.drive),
            grip.counts / COUNTS,
        )
    prepare_counter_again(session)
    if grip.is_lost:
        raise NotHeld(seen, grip.drive)
    return grip.drive


def _ramp(session: Session[D], start: float, target: float) -> float:
    """Move the drive in steps that the top can follow; return its spin then [Hz].  Raises NotHeld."""
    steps = max(1, round(abs(target - start) / (session.settings.ramp_hz_per_s * RAMP_STEP_S)))
    for k in range(1, steps + 1):
        session.stop.check()
        drive = start + (target - start) * k / steps
        session.bench.generator.frequency = drive
        session.progress(
            Text("drive at {drive:.2f} Hz{end}", drive, _ramp_end(session, target, (steps - k) * RAMP_STEP_S)),
            k / steps,
        )
        session.wait(RAMP_STEP_S)
        if k % round(_LOOK_EVERY_S / RAMP_STEP_S) == 0 and k < steps:
            held_spin(session, drive)
    return held_spin(session, target)


def _ramp_end(session: Session[D], target: float, left_s: float) -> str:
    """Return the end of a ramp as text; empty at the end, and on a clock that does not keep to the wall's."""
    if left_s <= 0 or not math.isfinite(session.bench.clock.speed):
        return ""
    return Text(", {target:.2f} Hz in {time}", target=target, time=clock(left_s))


def held_spin(session: Session[D], drive: float) -> float:
    """Return the spin of a top that is held by a drive [Hz].  Raises NotHeld."""
    spin = spin_now(session)
    if spin is None or abs(spin - drive) > HELD_WITHIN_HZ:
        raise NotHeld(spin, drive)
    return spin


def _hold(session: Session[D], drive: float) -> None:
    """Let the motion settle, and compare the counted spin with the drive's frequency meanwhile.  Raises NotHeld."""
    for first in (True, False):
        counts = _counts_of_hold(session, drive)
        if len(counts) < 2:
            return
        if has_drifted(counts):  # a top that is lost is taken for held until it is HELD_WITHIN_HZ behind
            raise NotHeld(counts[-1], drive)
        slip = slip_of(counts, drive)
        turns = abs(slip.difference) * len(counts) * session.settings.gate_s
        if not (first and slip.significant and turns < _TURNED_OVER):
            break
    compare_with_drive(session, slip)


def _counts_of_hold(session: Session[D], drive: float) -> list[float]:
    """Return the counts while the drive holds the top [Hz].  Raises NotHeld."""
    n = round(session.settings.hold_s / session.settings.gate_s)
    counts = []
    for k in range(n):
        session.stop.check()
        counts.append(held_spin(session, drive))
        session.progress(Text("held at {drive:.2f} Hz", drive=drive), (k + 1) / n)
    return counts


def has_drifted(counts: Sequence[float]) -> bool:
    """Return whether the second half of the counts lies off the first half, as when the top was lost meanwhile.

    A tape that slips is as far behind at first as it is at last.

    Args:
        counts: at least two, in order [Hz].
    """
    half = len(counts) // 2
    first, last = np.array(counts[:half]), np.array(counts[-half:])
    if half < _FEWEST_IN_HALF:
        return False
    u = math.hypot(float(first.std(ddof=1)), float(last.std(ddof=1))) / math.sqrt(half)
    return abs(float(last.mean() - first.mean())) > max(_DRIFTS_BY_U * u, _DRIFTS_HZ)


def compare_with_drive(session: Session[D], slip: Slip, time_s: float | None = None) -> None:
    """Record the difference of a held top's counted spin from its drive; warn of a tape that slips.

    time_s: of the last count, where that was earlier [s].
    """
    difference = with_sign(slip.difference, 3)
    text = Text(
        "held at {drive:.2f} Hz: counted {spin:.3f} Hz, {difference:n} Hz beside the drive",
        drive=slip.drive,
        spin=slip.spin,
        difference=difference,
    )
    at = {} if time_s is None else {"time_s": time_s}
    session.event(RunEvent.HELD, text, spin_frequency_hz=slip.spin, drive_frequency_hz=slip.drive, u_hz=slip.u, **at)
    if slip.significant:
        session.warn(slip_as_text(slip))


def slip_as_text(slip: Slip) -> str:
    """Return the meaning of a tape that does not turn with the drive."""
    counted = f"{slip.spin:.2f}({max(round(100 * slip.u), 1)})"
    seen = Text("the drive holds the top at {drive:.2f} Hz, but the counter sees {counted:n} Hz", slip.drive, counted)
    if slip.difference > 0:
        return Text(
            "{seen}: no tape overtakes the drive; is there a second bright mark, or is the trigger level too low?", seen
        )
    return Text(
        "{seen}: LOOSE WASHERS, the tape slips by {slip:.2f} Hz; fix the washers to the top, for"
        " the readings are of the tape and not of the top",
        seen=seen,
        slip=-slip.difference,
    )


# --- a top, and time, for a series or a sweep ---


def have_a_top(session: Session[D], text: str, number: int, *, within_s: float) -> bool:
    """See that a top floats; where none does, ask a person for one.  Returns whether that was needed.

    Args:
        session: the acquisition.
        text: what the person reads.
        number: how many tops of the run came before.
        within_s: how long it is waited for [s].

    Raises:
        ExperimentFailed: the counter still sees none.
    """
    if spin_now(session) is not None:
        return False
    session.ask(FloatTop(text, number))
    end = session.now() + within_s
    while spin_now(session) is None:
        if session.now() >= end:
            raise _no_light(session)
        session.wait(_LOOK_FOR_TOP_S)
    return True


def is_over(session: Session[D]) -> bool:
    """Return whether the time of the run is over, and record it."""
    longest = session.settings.longest_s
    if session.time_spent() <= longest:
        return False
    session.event(
        RunEvent.LONGEST,
        Text("{longest:g} s are over ({experiment:s}.longest_s)", longest, session.writer.record.experiment),
    )
    return True


# --- a sweep ---


def sweep_drive(session: Session[D], points: Sequence[float], measure: Callable[[float], None]) -> None:
    """Bring the drive with a held top from point to point of a sweep, and measure at each.

    Where the top is lost, at a point or on the way to it, the drive goes off, takes hold of the top at its own spin and
    brings it back to the last frequency that held it; where it is down, a person is asked to float it first.  After
    TRIES tries the point is recorded as failed, an event with its reason, and the sweep goes on to the next one.  A
    generator that fails is reached again and costs no try.  The drive is off at the end.

    Args:
        session: the acquisition.
        points: frequencies of the drive, in order [Hz].
        measure: measures at a frequency at which the drive now is, and keeps the reading itself.  Raises NotHeld where
            the top is lost, or not locked; PointFailed where another try at this point would not help.

    Raises:
        ExperimentFailed: no top was floated, or measure raised it.  What was measured is kept.
    """
    sweep = _Sweep(session, measure, held=session.settings.drive_frequency_hz)
    in_a_row = 0
    for k, drive in enumerate(points):
        if in_a_row == MOST_FAILED:
            left = ", ".join(f"{drive:g}" for drive in points[k:])
            text = Text(
                "{points} points one after the other failed: the sweep ends here; not tried: {left} Hz",
                points=MOST_FAILED,
                left=left,
            )
            session.event(RunEvent.ENDED, text)
            break
        reason = sweep.carry_out(drive)
        if reason is None:
            break
        in_a_row = in_a_row + 1 if reason else 0
        if reason:
            text = Text("the point of {drive:g} Hz is left out: {reason}", drive=drive, reason=reason)
            session.event(RunEvent.LEFT_OUT, text, drive_frequency_hz=drive)
    drive_off(session)


@dataclass
class _Sweep:
    """Where a sweep is.

    session, measure: as `sweep_drive` has them; held: the last frequency that held the top [Hz]; at: the drive's
    frequency [Hz], None while it is off.
    """

    session: Session[Any]
    measure: Callable[[float], None]
    held: float
    at: float | None = None

    def carry_out(self, drive: float) -> str | None:
        """Try a point until it is measured; returns why it failed, empty if it did not, None if time is over."""
        session, reason = self.session, ""
        tries = 0
        while tries < TRIES:
            if is_over(session):
                return None
            try:
                self._go_to(drive)
                self.measure(drive)
            except (NotHeld, DidNotFollow) as lost:
                self.at, tries, reason = None, tries + 1, str(lost)
                text = Text(
                    "the top was lost at the point of {drive:g} Hz, or on the way to it: {reason}", drive, reason
                )
                session.event(
                    RunEvent.LOCK_LOST,
                    Text("{lost}; try {tries} of {most}", lost=text, tries=tries, most=TRIES),
                    drive_frequency_hz=drive,
                )
                drive_off(session)
            except InstrumentError as error:
                self.at = None
                reach_generator_again(session, error)
            except PointFailed as failed:
                self.at = self.held = drive
                return str(failed)
            else:
                self.at = self.held = drive
                return ""
        return reason

    def _go_to(self, drive: float) -> None:
        """Bring the drive to a point, with a held top.  Raises NotHeld, DidNotFollow, ExperimentFailed."""
        session = self.session
        if self.at is None:
            text = "The counter sees no top: spin the top and let it float."
            have_a_top(session, text, len(session.rows), within_s=_BY_HAND_S)
            drive_up(session, self.held)
            self.at = self.held
        if not math.isclose(self.at, drive, rel_tol=1e-9):
            _ramp(session, self.at, drive)
            self.at = drive
