"""The spin-down: drive the top up, switch the drive off, and count its spin until it falls."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from levilab.acquisition.counting import FreeTop, prepare_counter
from levilab.acquisition.driving import DriveSettings, drive_up_and_let_go
from levilab.acquisition.experiment import Experiment
from levilab.runs.channel import Channel

if TYPE_CHECKING:
    from levilab.acquisition.session import Row, Session

#: Spin at which a top falls (mean of the ten published limits) [Hz], and the usual drag of a laminar disc (mean of the
#: four published runs) [(rad/s)^−½/s]: for the time left while there is one reading.
_FALL_HZ, _USUAL_DRAG = 21.86, 2.34e-4


class SpinSettings(DriveSettings):
    """Drive up to a frequency, switch off, read until the top falls."""


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
    prepare_counter(session)
    session.begin(lambda: drive_up_and_let_go(session))
    top = FreeTop(session, session.rows[-3:])
    for asked in session.readings_every(settings.interval_s, settings.longest_s):
        reading = top.read()
        if reading:
            first = session.rows[0] if session.rows else reading
            session.keep(reading, time_left(first, reading))
        elif end := top.fall(asked):
            session.event("fell", end)
            return


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
