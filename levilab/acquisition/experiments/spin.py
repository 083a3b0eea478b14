"""The spin-down: drive the top up, switch the drive off, and count its spin until it falls."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from analysis.spindown.fall import times_of_fall
from levilab.acquisition.counting import FreeTop, prepare_counter
from levilab.acquisition.driving import DriveSettings, drive_up_and_let_go
from levilab.acquisition.experiment import Experiment
from levilab.runs.channel import Channel

if TYPE_CHECKING:
    from levilab.acquisition.session import Row, Session

#: The usual drag of a laminar disc (mean of the four published runs) [(rad/s)^−½/s]: for the time left while there is
#: one reading.
_USUAL_DRAG = 2.34e-4


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
            least, most = time_left(first, reading, settings.longest_s)
            session.keep(reading, most, least)
        elif end := top.fall(asked):
            session.event("fell", end)
            return


def time_left(first: Row, last: Row, longest_s: float) -> tuple[float, float]:
    """Until the spins between which a top falls, and no longer than the run goes on, at least and at most [s].

    Under the drag of a laminar disc ω^(−1/2) grows evenly.  Its growth is that between two readings, or while they are
    one that of the usual drag.

    Args:
        first: the first reading.
        last: the last one.
        longest_s: time at which the run ends if the top is still up [s].
    """
    start, now = ((2 * math.pi * row["spin_frequency_hz"]) ** -0.5 for row in (first, last))
    time = last["time_s"]
    lapse = time - first["time_s"]
    growth = (now - start) / lapse if lapse > 0 and now > start else _USUAL_DRAG / 2
    ends = times_of_fall(lambda times: (now + growth * (times - time)) ** -2 / (2 * math.pi), time, longest_s)
    least, most = (max(0.0, min(end, longest_s) - time) for end in ends)
    return least, most


EXPERIMENT = Experiment(
    name="spin",
    about="drive the top up, switch the drive off, and count its spin until it falls",
    instruments=("counter", "generator"),
    settings=SpinSettings,
    channels=channels,
    run=run,
)
