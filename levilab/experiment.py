"""The experiments: a table of what is measured, with what, in which steps, and which analysis suits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from levilab.errors import LevilabError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from levilab.config import SpinSettings
    from levilab.record import Session


class ExperimentFailed(LevilabError):
    """The experiment cannot go on, for a reason that lies on the bench."""


Row = dict[str, float | None]


@dataclass(frozen=True)
class Channel:
    """A column of readings.csv.  source: where it comes from, in words."""

    name: str
    unit: str
    source: str


@dataclass(frozen=True)
class Experiment:
    """A row of the table.

    about: one line; kinds: the instruments it needs; channels: what it writes;
    connect: sets the instruments up; start: brings the top to where reading begins;
    read: one reading, None if there was nothing to read;
    remaining: seconds until the end as the rows so far let expect.
    """

    name: str
    about: str
    kinds: tuple[str, ...]
    channels: tuple[Channel, ...]
    connect: Callable[[Session], None]
    start: Callable[[Session], None]
    read: Callable[[Session], Row | None]
    remaining: Callable[[Sequence[Row]], float]


# --- the spin-down -------------------------------------------------------------------------------------

#: A step of the drive must stay within what the drive can hold (0.5 Hz at 0.4 mT) [s].
_RAMP_STEP_S = 1.0
#: A locked top spins at the drive's frequency; the reading scatters by 0.03 Hz [Hz].
_LOCKED_WITHIN_HZ = 0.3
#: A free top does not speed up (5 % leave room for noise), nor lose half its spin between readings so close.
_HIGHEST_SHARE, _LOWEST_SHARE, _RECENT_INTERVALS = 1.05, 0.5, 3.0
#: Spin at which a top falls (mean of the ten published limits) [Hz], and how long that takes from 40 Hz [s].
_FALL_HZ, _USUAL_S = 21.86, 190.0


def _connect_spin(session: Session) -> None:
    settings = session.settings
    session.bench.check_limits(frequency_hz=settings.drive_frequency_hz, amplitude_vpp=settings.drive_amplitude_vpp)
    session.bench.counter.prepare(gate_s=settings.gate_s, trigger_level_v=settings.trigger_level_v)


def _drive_up_and_let_go(session: Session) -> None:
    settings = session.settings
    spin = session.bench.counter.frequency()
    if spin is None:
        raise ExperimentFailed(
            f"the counter sees no light pulses at {settings.trigger_level_v:g} V: is the top floating and lit, "
            "and the trigger level between dark and bright (spin.trigger_level_v in bench.toml)?"
        )
    session.event("drive on", f"drive on at the top's spin, {spin:.2f} Hz", frequency_hz=spin)
    session.bench.drive(waveform=settings.drive_waveform, frequency_hz=spin, amplitude_vpp=settings.drive_amplitude_vpp)
    _ramp(session, spin, settings)
    _check_lock(session, settings)
    session.bench.outputs_off()
    session.event("drive off", "drive off, the top spins down freely")


def _ramp(session: Session, start: float, settings: SpinSettings) -> None:
    """Raise the drive's frequency in steps that the top can follow."""
    target = settings.drive_frequency_hz
    step = settings.ramp_hz_per_s * _RAMP_STEP_S
    steps = max(1, round(abs(target - start) / step))
    for k in range(1, steps + 1):
        session.bench.generator.frequency = start + (target - start) * k / steps
        session.show.preparing(f"drive at {start + (target - start) * k / steps:.2f} Hz", k / steps)
        session.wait(_RAMP_STEP_S)


def _check_lock(session: Session, settings: SpinSettings) -> None:
    spin = session.bench.counter.frequency()
    if spin is None or abs(spin - settings.drive_frequency_hz) > _LOCKED_WITHIN_HZ:
        seen = "no light pulses" if spin is None else f"{spin:.2f} Hz"
        raise ExperimentFailed(
            f"the top did not follow the drive to {settings.drive_frequency_hz:g} Hz ({seen} seen): ramp slower "
            "(spin.ramp_hz_per_s) or drive harder (spin.drive_amplitude_vpp)"
        )
    session.event("locked", f"the top follows the drive at {spin:.2f} Hz", frequency_hz=spin)


def _read_spin(session: Session) -> Row | None:
    """One counter reading; its time is the middle of the exchange, which is the gate's."""
    before = session.now()
    spin = session.bench.counter.frequency()
    time = (before + session.now()) / 2
    if spin is None or not _plausible(session, time, spin):
        return None
    return {
        "time_s": time,
        "spin_frequency_hz": spin,
        "spin_frequency_u_hz": session.settings.reading_u_hz,
    }


def _plausible(session: Session, time: float, spin: float) -> bool:
    """Whether a free top can have this spin after the one before; a fallen one rattles, and makes light of any kind.

    What is not taken for a reading is kept as an event.
    """
    if not session.rows:
        return True
    last = session.rows[-1]
    share = spin / float(last["spin_frequency_hz"] or spin)
    recent = time - float(last["time_s"] or 0.0) < _RECENT_INTERVALS * session.settings.interval_s
    if share < _HIGHEST_SHARE and (share > _LOWEST_SHARE or not recent):
        return True
    text = f"{spin:.4g} Hz at {time:.1f} s does not follow from {last['spin_frequency_hz']:.4g} Hz, not taken"
    session.event("implausible", text, spin_frequency_hz=spin)
    return False


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
        channels=(
            Channel("time_s", "s", "bench clock, from the moment the drive is off"),
            Channel("spin_frequency_hz", "Hz", "frequency counter on the phototransistor, one pulse a turn"),
            Channel("spin_frequency_u_hz", "Hz", "standard uncertainty of a reading, from the configuration"),
        ),
        connect=_connect_spin,
        start=_drive_up_and_let_go,
        read=_read_spin,
        remaining=_until_the_fall,
    ),
}
