"""The spin-down: drive the top up, switch the drive off, and count its spin until it falls."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING, Literal

from pydantic import Field, PositiveFloat

from instruments.errors import InstrumentError, OutOfRange
from levilab.acquisition.experiment import CounterSettings, Experiment
from levilab.acquisition.session import ExperimentFailed
from levilab.bench.config import ConfigError
from levilab.runs.channel import Channel

if TYPE_CHECKING:
    from levilab.acquisition.session import Row, Session
    from levilab.bench.config import Limits

#: The drive goes up in steps; each makes a held top swing a little about it [s].
_RAMP_STEP_S = 1.0
#: A ramp that takes longer from standstill to the drive's frequency is refused [s]: at 40 Hz one of 0.0019 Hz/s.  The
#: top's mass fits its place for as long as the room keeps its temperature, which is no longer than some hours.
_LONGEST_RAMP_S = 6 * 3600.0
#: A held top swings about the drive's frequency by what the drive can hold at most, 0.5 Hz at 0.4 mT [Hz].
_HELD_WITHIN_HZ = 1.0
#: Whether the drive takes hold depends on how the top happens to point when it comes on, and one time in four it does
#: not.  So the top is looked at so often on the way [s] (one that is not held loses 0.1 Hz/s to the air), and tried
#: again with the drive so many turns later: a reading ends with a pulse, so without that it would point as before.
_LOOK_EVERY_S, _TURNS_LATER = 10.0, (0.0, 0.5, 0.25, 0.75)
#: A free top does not speed up (5 % leave room for noise), nor lose more than half its spin in 100 s (air: 30 %).
_HIGHEST_SHARE, _HALVING_S = 1.05, 100.0
#: Two counts of one spin, seconds apart, agree this well (drag takes 0.3 %/s, noise is 0.1 %).
_SAME_SHARE = 0.03
#: A fallen top rattles: after so many times without a credible count it is taken for fallen.
_MOST_MISSED = 3
#: Spin at which a top falls (mean of the ten published limits) [Hz], and the usual drag of a laminar disc (mean of the
#: four published runs) [(rad/s)^−½/s]: for the time left while there is one reading.
_FALL_HZ, _USUAL_DRAG = 21.86, 2.34e-4


class SpinSettings(CounterSettings):
    """Drive up to a frequency, switch off, read until the top falls.

    ramp_hz_per_s: no faster than the drive can pull the top; of the 0.4 Hz/s that 0.4 mT can, drag takes up to 0.17 and
    the swing about the drive most of the rest.
    """

    drive_frequency_hz: PositiveFloat = Field(default=40.0, description="drive the top up to this,")
    ramp_hz_per_s: PositiveFloat = Field(default=0.05, description="no faster than it can follow")
    drive_amplitude_vpp: PositiveFloat = 10.0
    drive_waveform: Literal["SIN", "SQU", "TRI"] = Field(default="SIN", description="SIN, SQU or TRI")

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


class Missed(StrEnum):
    """Why there is no reading."""

    DARK = "no light pulses"
    LOST = "the instrument did not answer as it should"
    UNSTEADY = "no two counts that agree with each other or with the last reading"


def channels(settings: SpinSettings) -> tuple[Channel, ...]:
    """Without reading_u_hz the column of uncertainties is left out."""
    columns = (
        Channel("time_s", "s", "bench clock, from the moment the drive is off"),
        Channel("spin_frequency_hz", "Hz", "frequency counter on the phototransistor, one pulse a turn"),
        Channel("spin_frequency_u_hz", "Hz", "standard uncertainty of a reading, from the configuration"),
    )
    return columns if settings.reading_u_hz else columns[:2]


def run(session: Session[SpinSettings]) -> None:
    """Drive the top up, let it go, and read its spin until it falls."""
    settings = session.settings
    _prepare_counter(session)
    session.begin(lambda: _drive_up_and_let_go(session))
    missed: list[Missed] = []
    for _ in session.readings_every(settings.interval_s, settings.longest_s):
        reading = _read(session)
        if isinstance(reading, Missed):
            missed.append(reading)
            if end := _fall(session, missed):
                session.event("fell", end)
                return
        else:
            missed.clear()
            first = session.rows[0] if session.rows else reading
            session.keep(reading, time_left(first, reading))


def _prepare_counter(session: Session[SpinSettings]) -> None:
    settings = session.settings
    session.bench.counter.prepare(gate_s=settings.gate_s, trigger_level_v=settings.trigger_level_v)
    session.bench.record_settings("counter")


# --- up to where reading begins ---


def _drive_up_and_let_go(session: Session[SpinSettings]) -> None:
    """Drive the top up; if the generator fails on the way, from its new spin once more."""
    while True:
        try:
            _drive_up(session)
            session.bench.outputs_off()
        except InstrumentError as error:
            if error.address != session.bench.address("generator") or isinstance(error, OutOfRange):
                raise
            session.reconnect("generator", error, session.bench.outputs_off)
        else:
            session.event("drive off", "drive off, the top spins down freely")
            return


def _drive_up(session: Session[SpinSettings]) -> None:
    """Let the drive take hold of the top, and raise it.  Raises ExperimentFailed."""
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
        except _NotHeld as lost:
            session.bench.outputs_off()
            seen = str(lost)
            session.event("not held", f"try {tries} of {len(_TURNS_LATER)}: the drive does not hold the top, {seen}")
        else:
            session.event("locked", f"the top follows the drive at {held:.2f} Hz", frequency_hz=held)
            return
    raise _did_not_follow(settings, seen)


def _did_not_follow(settings: SpinSettings, seen: str) -> ExperimentFailed:
    return ExperimentFailed(
        f"the top did not follow the drive to {settings.drive_frequency_hz:g} Hz ({seen}): ramp slower "
        "(spin.ramp_hz_per_s) or drive harder (spin.drive_amplitude_vpp)"
    )


def _free_spin(session: Session[SpinSettings], before: str) -> float:
    """The spin before the drive is on.  before: what the last try ended with.  Raises ExperimentFailed in the dark."""
    spin = _spin_now(session)
    if spin is None and before:
        raise _did_not_follow(session.settings, f"{before}; then it fell")
    if spin is None:
        raise ExperimentFailed(
            f"the counter sees no light pulses at {session.settings.trigger_level_v:g} V: is the top floating and "
            "lit, and the trigger level between dark and bright (spin.trigger_level_v in the bench file)?"
        )
    return spin


class _NotHeld(Exception):
    """The top does not spin with the drive; what is seen instead."""


def _ramp(session: Session[SpinSettings], start: float) -> float:
    """Raise the drive's frequency in steps that the top can follow; its spin then.  Raises _NotHeld."""
    settings = session.settings
    target = settings.drive_frequency_hz
    steps = max(1, round(abs(target - start) / (settings.ramp_hz_per_s * _RAMP_STEP_S)))
    for k in range(1, steps + 1):
        drive = start + (target - start) * k / steps
        session.bench.generator.frequency = drive
        session.progress(f"drive at {drive:.2f} Hz", k / steps)
        session.wait(_RAMP_STEP_S)
        if k % round(_LOOK_EVERY_S / _RAMP_STEP_S) == 0 and k < steps:
            _held_spin(session, drive)
    return _held_spin(session, target)


def _held_spin(session: Session[SpinSettings], drive: float) -> float:
    """The spin of a top that is held by a drive [Hz].  Raises _NotHeld."""
    spin = _spin_now(session)
    if spin is None or abs(spin - drive) > _HELD_WITHIN_HZ:
        seen = "no light pulses" if spin is None else f"a spin of {spin:.2f} Hz"
        raise _NotHeld(f"{seen} under a drive of {drive:.2f} Hz")
    return spin


def _spin_now(session: Session[SpinSettings]) -> float | None:
    """What the counter counts before there are readings; one that fails is reached again, a few times."""
    while True:
        try:
            spin = session.bench.counter.frequency()
            session.check_settings("counter")
        except InstrumentError as error:
            session.reconnect("counter", error, lambda: _prepare_counter(session))
        else:
            return spin


# --- readings ---


def _read(session: Session[SpinSettings]) -> Row | Missed:
    """A reading; a count that is missing or does not follow from the last reading is asked for once more.

    Two counts that agree are a reading, even if it does not follow: then the one before was the miscount.  A counter
    that fails, or whose settings another program changed, costs this reading and is set up anew.
    """
    try:
        return _read_or_ask_again(session)
    except InstrumentError as error:
        session.reconnect("counter", error, lambda: _prepare_counter(session))
        return Missed.LOST


def _read_or_ask_again(session: Session[SpinSettings]) -> Row | Missed:
    first = _count(session)
    if first and _follows(session, first):
        return first
    what = "no reading" if first is None else f"{first['spin_frequency_hz']:.4g} Hz does not follow"
    session.event("asked again", f"{what}, asking once more", **_spin_of(first))
    second = _count(session)
    if second and (_follows(session, second) or (first and _is_same_spin(first, second))):
        return second
    if second:
        session.event("not taken", f"{second['spin_frequency_hz']:.4g} Hz is not credible either", **_spin_of(second))
    return Missed.UNSTEADY if first or second else Missed.DARK


def _spin_of(row: Row | None) -> Row:
    return {"spin_frequency_hz": row["spin_frequency_hz"]} if row else {}


def _count(session: Session[SpinSettings]) -> Row | None:
    """What the counter counts; its time is the middle of the exchange, which is the gate's."""
    before = session.now()
    spin = session.bench.counter.frequency()
    if spin is None:
        return None
    row = {"time_s": (before + session.now()) / 2, "spin_frequency_hz": spin}
    session.check_settings("counter")
    u = session.settings.reading_u_hz
    return row | ({"spin_frequency_u_hz": u} if u else {})


def is_plausible(last: Row, reading: Row) -> bool:
    """Whether a free top can have the spin of a reading after the last one."""
    share = reading["spin_frequency_hz"] / last["spin_frequency_hz"]
    gap = reading["time_s"] - last["time_s"]
    lowest: float = 0.5 ** (1 + gap / _HALVING_S)
    return lowest < share < _HIGHEST_SHARE


def _follows(session: Session[SpinSettings], reading: Row) -> bool:
    """Whether a reading is the first, or plausible after the last one."""
    return not session.rows or is_plausible(session.rows[-1], reading)


def _is_same_spin(first: Row, second: Row) -> bool:
    """Whether two counts in succession are of one spin."""
    return abs(second["spin_frequency_hz"] / first["spin_frequency_hz"] - 1) < _SAME_SHARE


def _fall(session: Session[SpinSettings], missed: list[Missed]) -> str:
    """What was seen of the fall, empty while the top is up.  missed: why there was no reading since the last one.

    A dark counter, asked twice, means that the top fell; single odd counts do not.
    """
    last = session.rows[-1]["time_s"] if session.rows else 0.0
    if missed[-1] is Missed.DARK:
        return f"no light pulses any more: the top fell between {last:.1f} s and {session.asked:.1f} s"
    seen = [why for why in missed if why is not Missed.LOST]
    if len(seen) >= _MOST_MISSED:
        return f"no steady pulses at {len(seen)} times in a row: the top fell after {last:.1f} s"
    return ""


def time_left(first: Row, last: Row) -> float:
    """Until the usual spin of the fall [s]: under the drag of a laminar disc ω^(−1/2) grows evenly.

    Its growth is that between two readings, or while they are one that of the usual drag.
    """
    start, now, fall = (
        (2 * math.pi * spin) ** -0.5 for spin in (first["spin_frequency_hz"], last["spin_frequency_hz"], _FALL_HZ)
    )
    lapse = last["time_s"] - first["time_s"]
    growth = (now - start) / lapse if lapse > 0 and now > start else _USUAL_DRAG / 2
    left: float = (fall - now) / growth
    return max(0.0, left)


EXPERIMENT = Experiment(
    name="spin",
    about="drive the top up, switch the drive off, and count its spin until it falls",
    instruments=("counter", "generator"),
    settings=SpinSettings,
    channels=channels,
    run=run,
)
