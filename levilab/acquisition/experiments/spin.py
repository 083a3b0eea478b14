"""The experiments: a table of what is measured, with what, in which steps, and how one knows that it is over."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

from instruments.errors import InstrumentError, OutOfRange, SettingsLost
from levilab.acquisition.session import ExperimentFailed, Missed, Row

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from levilab.acquisition.session import Session
    from levilab.bench.config import BenchConfig, ExperimentSettings, SpinSettings


@dataclass(frozen=True)
class Channel:
    """A column of readings.csv.  source: where it comes from, in words."""

    name: str
    unit: str
    source: str


@dataclass(frozen=True)
class Experiment:
    """A row of the table.

    about: one line; kinds: the instruments it needs; settings: its part of the configuration;
    channels: what it writes, given its settings; connect: sets the instruments up;
    start: brings the top to where reading begins; read: one reading, or why there is none;
    over: after readings were missed, kind and text of the event that ends the run, or None to go on;
    remaining: seconds until the end as the rows so far let expect.
    """

    name: str
    about: str
    kinds: tuple[str, ...]
    settings: Callable[[BenchConfig], ExperimentSettings]
    channels: Callable[[ExperimentSettings], tuple[Channel, ...]]
    connect: Callable[[Session], None]
    start: Callable[[Session], None]
    read: Callable[[Session], Row | Missed]
    over: Callable[[Session], tuple[str, str] | None]
    remaining: Callable[[Sequence[Row]], float]


# --- the spin-down -------------------------------------------------------------------------------------

#: The drive goes up in steps; each makes a held top swing a little about it [s].
_RAMP_STEP_S = 1.0
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
#: Spin at which a top falls (mean of the ten published limits) [Hz], and how long that takes from 40 Hz [s].
_FALL_HZ, _USUAL_S = 21.86, 190.0


def _spin_settings(config: BenchConfig) -> SpinSettings:
    return config.spin


def _settings(session: Session) -> SpinSettings:
    return cast("SpinSettings", session.settings)


def _spin_channels(settings: ExperimentSettings) -> tuple[Channel, ...]:
    """There is no column for an uncertainty that nobody knows."""
    channels = (
        Channel("time_s", "s", "bench clock, from the moment the drive is off"),
        Channel("spin_frequency_hz", "Hz", "frequency counter on the phototransistor, one pulse a turn"),
        Channel("spin_frequency_u_hz", "Hz", "standard uncertainty of a reading, from the configuration"),
    )
    return channels if cast("SpinSettings", settings).reading_u_hz else channels[:2]


def _connect_spin(session: Session) -> None:
    settings = _settings(session)
    session.bench.counter.prepare(gate_s=settings.gate_s, trigger_level_v=settings.trigger_level_v)
    session.bench.remember("counter")


def _drive_up_and_let_go(session: Session) -> None:
    """Drive the top up; if the generator fails on the way, from its new spin once more."""
    while True:
        try:
            _drive_up(session)
            session.bench.outputs_off()
        except InstrumentError as error:
            if error.address != session.bench.address("generator") or isinstance(error, OutOfRange):
                raise
            session.find_again("generator", error, lambda session: session.bench.outputs_off())
        else:
            session.event("drive off", "drive off, the top spins down freely")
            return


def _drive_up(session: Session) -> None:
    """Let the drive take hold of the top, and raise it.  Raises ExperimentFailed."""
    settings = _settings(session)
    seen = ""
    for tries, later in enumerate(_TURNS_LATER, 1):
        spin = _free_spin(session, seen)
        session.stop.check()  # nobody who asked for the end wants the drive on
        session.bench.check_limits(frequency_hz=spin, amplitude_vpp=settings.drive_amplitude_vpp)
        session.wait(later / spin)
        session.event("drive on", f"drive on at the top's spin, {spin:.2f} Hz", frequency_hz=spin)
        session.bench.drive(
            waveform=settings.drive_waveform, frequency_hz=spin, amplitude_vpp=settings.drive_amplitude_vpp
        )
        try:
            held = _ramp(session, spin, settings)
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


def _free_spin(session: Session, before: str) -> float:
    """The spin before the drive is on.  before: what the last try ended with.  Raises ExperimentFailed in the dark."""
    spin = _spin_now(session)
    if spin is None and before:
        raise _did_not_follow(_settings(session), f"{before}; then it fell")
    if spin is None:
        raise ExperimentFailed(
            f"the counter sees no light pulses at {_settings(session).trigger_level_v:g} V: is the top floating and "
            "lit, and the trigger level between dark and bright (spin.trigger_level_v in the bench file)?"
        )
    return spin


class _NotHeld(Exception):
    """The top does not spin with the drive; what is seen instead."""


def _ramp(session: Session, start: float, settings: SpinSettings) -> float:
    """Raise the drive's frequency in steps that the top can follow; its spin then.  Raises _NotHeld."""
    target = settings.drive_frequency_hz
    steps = max(1, round(abs(target - start) / (settings.ramp_hz_per_s * _RAMP_STEP_S)))
    for k in range(1, steps + 1):
        drive = start + (target - start) * k / steps
        session.bench.drive_at(drive)
        session.show.preparing(f"drive at {drive:.2f} Hz", k / steps)
        session.wait(_RAMP_STEP_S)
        if k % round(_LOOK_EVERY_S / _RAMP_STEP_S) == 0 and k < steps:
            _held_spin(session, drive)
    return _held_spin(session, target)


def _held_spin(session: Session, drive: float) -> float:
    """The spin of a top that is held by a drive [Hz].  Raises _NotHeld."""
    spin = _spin_now(session)
    if spin is None or abs(spin - drive) > _HELD_WITHIN_HZ:
        seen = "no light pulses" if spin is None else f"a spin of {spin:.2f} Hz"
        raise _NotHeld(f"{seen} under a drive of {drive:.2f} Hz")
    return spin


def _spin_now(session: Session) -> float | None:
    """What the counter counts before there are readings; one that fails is reached again, a few times."""
    while True:
        try:
            spin = session.bench.counter.frequency()
            _check_settings(session)
        except InstrumentError as error:
            session.find_again("counter", error, _connect_spin)
        else:
            return spin


def _read_spin(session: Session) -> Row | Missed:
    """A reading; a count that is missing or does not follow from the last reading is asked for once more.

    Two counts that agree are a reading, even if it does not follow: then the one before was the miscount.  A counter
    that fails, or that somebody has set otherwise, costs this reading and is set up anew.
    """
    try:
        return _read_or_ask_again(session)
    except InstrumentError as error:
        session.find_again("counter", error, _connect_spin)
        return Missed.LOST


def _read_or_ask_again(session: Session) -> Row | Missed:
    first = _count(session)
    if first and _follows(session, first):
        return first
    what = "no reading" if first is None else f"{first['spin_frequency_hz']:.4g} Hz does not follow"
    session.event("asked again", f"{what}, asking once more", **_spin_of(first))
    second = _count(session)
    if second and (_follows(session, second) or _agree(first, second)):
        return second
    if second:
        session.event("not taken", f"{second['spin_frequency_hz']:.4g} Hz is not credible either", **_spin_of(second))
    return Missed.UNSTEADY if first or second else Missed.DARK


def _spin_of(row: Row | None) -> dict[str, float | None]:
    return {"spin_frequency_hz": row["spin_frequency_hz"]} if row else {}


def _count(session: Session) -> Row | None:
    """What the counter counts; its time is the middle of the exchange, which is the gate's."""
    before = session.now()
    spin = session.bench.counter.frequency()
    if spin is None:
        return None
    row: Row = {"time_s": (before + session.now()) / 2, "spin_frequency_hz": spin}
    _check_settings(session)
    return row | {"spin_frequency_u_hz": _settings(session).reading_u_hz}


def _check_settings(session: Session) -> None:
    """Raise SettingsLost where a reading was taken with other settings than the counter was given."""
    if forgotten := session.bench.forgotten("counter"):
        raise SettingsLost(session.bench.address("counter"), forgotten)


def _follows(session: Session, row: Row) -> bool:
    """Whether a free top can have this spin after the last reading."""
    if not session.rows:
        return True
    last = session.rows[-1]
    share = float(row["spin_frequency_hz"] or 0.0) / float(last["spin_frequency_hz"] or 1.0)
    gap = float(row["time_s"] or 0.0) - float(last["time_s"] or 0.0)
    lowest: float = 0.5 ** (1 + gap / _HALVING_S)
    return lowest < share < _HIGHEST_SHARE


def _agree(first: Row | None, second: Row) -> bool:
    """Whether two counts in succession are of one spin."""
    if first is None:
        return False
    share: float = float(second["spin_frequency_hz"] or 0.0) / float(first["spin_frequency_hz"] or 1.0)
    return abs(share - 1) < _SAME_SHARE


def _fallen(session: Session) -> tuple[str, str] | None:
    """A dark counter, asked twice, means that the top fell; single odd counts do not."""
    last = float(session.rows[-1]["time_s"] or 0.0) if session.rows else 0.0
    if session.missed[-1] is Missed.DARK:
        return "fell", f"no light pulses any more: the top fell between {last:.1f} s and {session.asked:.1f} s"
    seen = [why for why in session.missed if why is not Missed.LOST]
    if len(seen) >= _MOST_MISSED:
        return "fell", f"no steady pulses at {len(seen)} times in a row: the top fell after {last:.1f} s"
    return None


def _until_the_fall(rows: Sequence[Row]) -> float:
    """ν^(−1/2) grows evenly under the drag of a laminar disc: carried on to the usual spin of the fall."""
    if len(rows) < 2:
        return _USUAL_S
    (t0, y0), (t1, y1) = (
        (float(row["time_s"] or 0), float(row["spin_frequency_hz"] or 1) ** -0.5) for row in (rows[0], rows[-1])
    )
    slope = (y1 - y0) / (t1 - t0)
    return max(0.0, (_FALL_HZ**-0.5 - y1) / slope) if slope > 0 else _USUAL_S


EXPERIMENTS = {
    "spin": Experiment(
        name="spin",
        about="drive the top up, switch the drive off, and count its spin until it falls",
        kinds=("counter", "generator"),
        settings=_spin_settings,
        channels=_spin_channels,
        connect=_connect_spin,
        start=_drive_up_and_let_go,
        read=_read_spin,
        over=_fallen,
        remaining=_until_the_fall,
    ),
}
