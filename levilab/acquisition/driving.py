"""Driving a top: a drive takes hold of it, raises its spin, holds it while the motion settles, and lets it go."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeVar

from pydantic import Field, NonNegativeFloat, PositiveFloat

from analysis.locked import Slip, slip_of
from instruments.errors import InstrumentError, OutOfRange
from levilab.acquisition.counting import spin_now
from levilab.acquisition.experiment import CounterSettings
from levilab.acquisition.session import ExperimentFailed
from levilab.bench.config import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.acquisition.session import Session
    from levilab.bench.config import Limits

#: The drive goes up in steps; each makes a held top swing a little about it [s].
RAMP_STEP_S = 1.0
#: A ramp that takes longer from standstill to the drive's frequency is refused [s]: at 40 Hz one of 0.0019 Hz/s.  The
#: top's mass fits its place for as long as the room keeps its temperature, which is no longer than some hours.
_LONGEST_RAMP_S = 6 * 3600.0
#: A held top swings about the drive's frequency by what the drive can hold at most, 0.5 Hz at 0.4 mT [Hz].
_HELD_WITHIN_HZ = 1.0
#: Whether the drive takes hold depends on how the top happens to point when it comes on, and one time in four it does
#: not.  So the top is looked at so often on the way [s] (one that is not held loses 0.1 Hz/s to the air), and tried
#: again with the drive so many turns later: a reading ends with a pulse, so without that it would point as before.
_LOOK_EVERY_S, _TURNS_LATER = 10.0, (0.0, 0.5, 0.25, 0.75)


class DriveSettings(CounterSettings):
    """Drive up to a frequency, hold the top there, switch off.

    ramp_hz_per_s: no faster than the drive can pull the top; of the 0.4 Hz/s that 0.4 mT can, drag takes up to 0.17 and
    the swing about the drive most of the rest.
    """

    drive_frequency_hz: PositiveFloat = Field(default=40.0, description="drive the top up to this,")
    ramp_hz_per_s: PositiveFloat = Field(default=0.05, description="no faster than it can follow")
    drive_amplitude_vpp: PositiveFloat = 10.0
    drive_waveform: Literal["SIN", "SQU", "TRI"] = Field(default="SIN", description="SIN, SQU or TRI")
    hold_s: NonNegativeFloat = Field(default=20.0, description="hold it there, and compare its spin with the drive")

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for a drive that the bench does not allow."""
        for name in ("drive_amplitude_vpp", "drive_frequency_hz"):
            wanted, limit = getattr(self, name), getattr(limits, name)
            if wanted > limit:
                raise ConfigError(
                    f"{table}.{name} = {wanted:g} is more than this bench allows, limits.{name} = {limit:g}"
                )
        if self.drive_frequency_hz < limits.drive_lowest_hz:
            raise ConfigError(
                f"{table}.drive_frequency_hz = {self.drive_frequency_hz:g} is less than this bench allows, "
                f"limits.drive_lowest_hz = {limits.drive_lowest_hz:g}"
            )
        slowest = self.drive_frequency_hz / _LONGEST_RAMP_S
        if self.ramp_hz_per_s < slowest:
            raise ConfigError(
                f"{table}.ramp_hz_per_s = {self.ramp_hz_per_s:g} would raise the top for hours to "
                f"{table}.drive_frequency_hz = {self.drive_frequency_hz:g}: at least {slowest:.2g} is expected"
            )


D = TypeVar("D", bound=DriveSettings)


class DidNotFollow(ExperimentFailed):
    """The drive did not bring the top to where it should."""


class NotHeld(Exception):
    """The top does not spin with the drive; what is seen instead.  spin [Hz]: None where no light pulses are seen."""

    def __init__(self, spin: float | None, drive: float) -> None:
        self.spin = spin
        seen = "no light pulses" if spin is None else f"a spin of {spin:.2f} Hz"
        super().__init__(f"{seen} under a drive of {drive:.2f} Hz")


def drive_until(session: Session[D], steps: Callable[[Session[D]], None]) -> None:
    """Drive the top up, go through steps while it is held, and switch the drive off.

    If the generator fails meanwhile, all of it is done once more, from the top's new spin.
    """
    while True:
        try:
            drive_up(session)
            steps(session)
            session.bench.outputs_off()
        except InstrumentError as error:
            if error.address != session.bench.address("generator") or isinstance(error, OutOfRange):
                raise
            session.reconnect("generator", error, session.bench.outputs_off)
        else:
            return


def drive_up_and_let_go(session: Session[D]) -> None:
    """Drive the top up, hold it while its motion settles, and let it go."""
    drive_until(session, lambda _: None)
    session.event("drive off", "drive off, the top spins down freely")


def drive_up(session: Session[D]) -> None:
    """Let the drive take hold of the top, raise it, and hold it.  Raises DidNotFollow; ExperimentFailed in the dark."""
    settings = session.settings
    seen = ""
    for tries, later in enumerate(_TURNS_LATER, 1):
        spin = _free_spin(session, seen)
        session.wait(later / spin)
        session.stop.check()  # the drive does not go on once the end was asked for
        session.bench.generator.prepare(
            waveform=settings.drive_waveform, frequency_hz=spin, amplitude_vpp=settings.drive_amplitude_vpp
        )
        session.event("drive on", f"drive on at the top's spin, {spin:.2f} Hz", frequency_hz=spin)
        session.bench.generator.output = True
        try:
            held = _ramp(session, spin)
            session.event("locked", f"the top follows the drive at {held:.2f} Hz", frequency_hz=held)
            _hold(session)
        except NotHeld as lost:
            session.bench.outputs_off()
            seen = str(lost)
            session.event("not held", f"try {tries} of {len(_TURNS_LATER)}: the drive does not hold the top, {seen}")
        else:
            return
    raise _did_not_follow(session, seen)


def _did_not_follow(session: Session[D], seen: str) -> DidNotFollow:
    name = session.writer.record.experiment
    return DidNotFollow(
        f"the top did not follow the drive to {session.settings.drive_frequency_hz:g} Hz ({seen}): ramp slower "
        f"({name}.ramp_hz_per_s) or drive harder ({name}.drive_amplitude_vpp)"
    )


def _free_spin(session: Session[D], before: str) -> float:
    """The spin before the drive is on.  before: what the last try ended with.  Raises ExperimentFailed in the dark."""
    spin = spin_now(session)
    if spin is None and before:
        raise _did_not_follow(session, f"{before}; then it fell")
    if spin is None:
        raise no_light(session)
    return spin


def no_light(session: Session[D]) -> ExperimentFailed:
    """What to look at where the counter counts nothing."""
    name = session.writer.record.experiment
    return ExperimentFailed(
        f"the counter sees no light pulses at {session.settings.trigger_level_v:g} V: is the top floating and "
        f"lit, and the trigger level between dark and bright ({name}.trigger_level_v in the bench file)?"
    )


def _ramp(session: Session[D], start: float) -> float:
    """Raise the drive's frequency in steps that the top can follow; its spin then.  Raises NotHeld."""
    settings = session.settings
    target = settings.drive_frequency_hz
    steps = max(1, round(abs(target - start) / (settings.ramp_hz_per_s * RAMP_STEP_S)))
    for k in range(1, steps + 1):
        drive = start + (target - start) * k / steps
        session.bench.generator.frequency = drive
        session.progress(f"drive at {drive:.2f} Hz", k / steps)
        session.wait(RAMP_STEP_S)
        if k % round(_LOOK_EVERY_S / RAMP_STEP_S) == 0 and k < steps:
            held_spin(session, drive)
    return held_spin(session, target)


def held_spin(session: Session[D], drive: float) -> float:
    """The spin of a top that is held by a drive [Hz].  Raises NotHeld."""
    spin = spin_now(session)
    if spin is None or abs(spin - drive) > _HELD_WITHIN_HZ:
        raise NotHeld(spin, drive)
    return spin


def _hold(session: Session[D]) -> None:
    """Let the motion settle, and compare the counted spin with the drive's frequency meanwhile.  Raises NotHeld."""
    settings = session.settings
    drive, n = settings.drive_frequency_hz, round(settings.hold_s / settings.gate_s)
    counts = []
    for k in range(n):
        counts.append(held_spin(session, drive))
        session.progress(f"held at {drive:.2f} Hz", (k + 1) / n)
    if n > 1:
        compare_with_drive(session, slip_of(counts, drive))


def compare_with_drive(session: Session[D], slip: Slip) -> None:
    """Write down how the counted spin of a held top compares with its drive; a tape that slips is warned of."""
    text = f"held at {slip.drive:.2f} Hz: counted {slip.spin:.3f} Hz, {slip.difference:+.3f} Hz beside the drive"
    session.event("held", text, spin_frequency_hz=slip.spin, drive_frequency_hz=slip.drive, u_hz=slip.u)
    if slip.warning:
        session.warn(slip.warning)
