"""A spin held for as long as one likes: the amplitude of a triggered drive follows the counts, and shows the drag."""

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, PositiveFloat

from analysis.held import hold_of
from instruments.errors import InstrumentError
from levilab.acquisition.counting import prepare_counter
from levilab.acquisition.driving import DriveSettings, drive_off, drive_up, reach_generator_again
from levilab.acquisition.experiment import Experiment
from levilab.acquisition.session import NotHeld, Row, Session
from levilab.acquisition.triggering import Motor
from levilab.bench.config import Limits
from levilab.formats.table import FEWEST
from levilab.present.numbers import with_uncertainty
from levilab.runs.channel import Channel
from levilab.runs.events import RunEvent
from levilab.texts.text import Text

#: A top further from its spin [Hz] is not held: the wobble of a full motion leaves 0.1 Hz after the loop has settled,
#: and a top whose pulses no longer come loses 1 Hz in some 6 s.
_HELD_WITHIN_HZ = 1.0


class HoldSettings(DriveSettings):
    """Drive to a spin by a triggered drive, and hold it there."""

    one_top: ClassVar[bool] = True
    by_trigger: ClassVar[bool] = True

    drive_frequency_hz: PositiveFloat = Field(default=45.0, description="hold this spin")
    drive: Literal["ramp", "triggered"] = Field(default="triggered", description="no other drive has a loop")
    hold_s: float = Field(default=30.0, ge=0, description="let the loop settle before the first reading")
    longest_s: PositiveFloat = Field(default=600.0, description="how long it is held")

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for a drive that the bench does not allow."""
        if self.drive != "triggered":
            said = "{table:s}.drive = {drive}: triggered is expected, no other drive has a loop"
            raise self.refusal(table, said, "drive")
        super().check(table, limits)


def channels(_: HoldSettings) -> tuple[Channel, ...]:
    """Return the spin and the amplitude that held it."""
    return (
        Channel("time_s", "s", "bench clock, middle of the reading, from the moment the loop had settled"),
        Channel("spin_frequency_hz", "Hz", "frequency counter on the phototransistor, mean of the counts of a reading"),
        Channel("spin_frequency_u_hz", "Hz", "its standard uncertainty, from the scatter of these counts"),
        Channel("drive_amplitude_v", "V", "generator, half of peak to peak, mean of a reading"),
    )


def run(session: Session[HoldSettings]) -> None:
    """Bring the top to the spin, hold it there, and keep a reading of spin and amplitude at each interval."""
    prepare_counter(session)
    motors: list[Motor] = []

    def drive() -> None:
        while True:
            try:
                motors.append(_motor(session))
            except (NotHeld, InstrumentError) as lost:
                _let_go(session, lost)
            else:
                return

    session.begin(drive, resumed="the drive was brought back to the spin", reading_s=session.settings.interval_s)
    if not motors:  # a real top that has gone on without a drive
        drive()
    while session.now() < session.settings.longest_s:
        session.last_request_time = session.now()
        try:
            session.keep(_reading(session, motors[-1]), max(0.0, session.settings.longest_s - session.now()))
        except (NotHeld, InstrumentError) as lost:
            _let_go(session, lost)
            drive()
    with suppress(NotHeld, InstrumentError):  # the readings and the first gain are there
        motors[-1].measure_gain(session.settings.drive_frequency_hz)
    drive_off(session)
    _report_drag(session, motors)


def _let_go(session: Session[HoldSettings], lost: NotHeld | InstrumentError) -> None:
    """Switch the drive off after a loss.  Raises an error of another instrument."""
    if isinstance(lost, InstrumentError):
        reach_generator_again(session, lost)
    else:
        session.event(RunEvent.NOT_HELD, Text("the top was lost: {lost}", lost=lost))
        drive_off(session)


def _motor(session: Session[HoldSettings]) -> Motor:
    motor = drive_up(session)
    assert motor is not None, "a triggered drive is the only one"
    motor.measure_gain(session.settings.drive_frequency_hz)
    motor.hold(session.settings.drive_frequency_hz, session.settings.hold_s)
    return motor


def _reading(session: Session[HoldSettings], motor: Motor) -> Row:
    """Hold the top for an interval.  Returns the means of its counts.  Raises NotHeld."""
    settings, begin, first = session.settings, session.now(), len(motor.counts)
    motor.hold(settings.drive_frequency_hz, settings.interval_s)
    counts, shares = np.array(motor.counts[first:]), np.array(motor.shares[first:])
    if counts.size < 2:
        raise NotHeld(None, settings.drive_frequency_hz)
    if abs(counts.mean() - settings.drive_frequency_hz) > _HELD_WITHIN_HZ:
        raise NotHeld(float(counts.mean()), settings.drive_frequency_hz)
    return {
        "time_s": (begin + session.now()) / 2,
        "spin_frequency_hz": float(counts.mean()),
        "spin_frequency_u_hz": float(counts.std(ddof=1)) / math.sqrt(counts.size),
        "drive_amplitude_v": float(shares.mean()) * settings.drive_amplitude_vpp / 2,
    }


def _report_drag(session: Session[HoldSettings], motors: Sequence[Motor]) -> None:
    """Record the scatter of the held spin, and the drag that the amplitude balanced, as `levilab analyze hold` does."""
    rows = session.rows
    if len(rows) < FEWEST:
        text = Text(
            "{count} readings show neither a scatter nor a drag, {fewest} are needed: hold the spin longer",
            count=len(rows),
            fewest=FEWEST,
        )
        session.event(
            RunEvent.ENDED,
            Text("{why} ({experiment:s}.longest_s)", why=text, experiment=session.writer.record.experiment),
        )
        return
    time, spin, u, volts = (np.array([row[one.name] for row in rows]) for one in channels(session.settings))
    gains = [(np.array(times), np.array(spins)) for motor in motors for times, spins in motor.gains]
    found = hold_of(time, spin, u, volts / (session.settings.drive_amplitude_vpp / 2), gains)
    drag = found.drag
    data = {"drag_hz_per_s": drag.value, "drag_u_hz_per_s": drag.u} if drag else {}
    size = with_uncertainty(drag) if drag else "of unknown size, as no gain was measured: drive harder"
    text = Text(
        "held at {spin:.3f} Hz, s.d. of a reading {scatter:.3f} Hz; {share:.1f} % of the "
        "amplitude balanced the drag, {size:n}",
        spin=found.spin.value,
        scatter=found.scatter.value,
        share=100 * found.share,
        size=size,
    )
    more = {"spin_frequency_hz": found.spin.value, "scatter_hz": found.scatter.value}
    session.event(RunEvent.HELD, text, **more, **data)


EXPERIMENT = Experiment(
    name="hold",
    about="hold a spin by a drive that the top triggers; measure the drag by its amplitude",
    instruments=("counter", "generator"),
    settings=HoldSettings,
    channels=channels,
    run=run,
)
