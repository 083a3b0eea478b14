"""The spin-down: drive the top up, switch the drive off, and count its spin until it falls."""

import math
from typing import ClassVar

from analysis.spindown.fall import FALLS_BETWEEN_HZ
from levilab.acquisition.counting import free_top, prepare_counter
from levilab.acquisition.driving import DriveSettings, drive_up_and_let_go, drives
from levilab.acquisition.experiment import Experiment
from levilab.acquisition.session import Row, Session
from levilab.runs.channel import Channel
from levilab.runs.events import RunEvent
from levilab.texts.text import Text

#: The usual deceleration at a spin, the mean of the four published runs, whichever law: 2.34e-4 (rad/s)^−½/s of a disc
#: is 3.2e-3 1/s of Stokes [Hz/s, Hz].
_USUAL_HZ_PER_S, _USUAL_HZ = 0.0964, 30.0
#: The standard uncertainty of a reading over 1 s, where the configuration gives none [Hz].
_USUAL_U_HZ = 0.03
#: Of the spin: a larger uncertainty counts as this.
_MOST_U = 0.1
#: Readings that differ by this multiple of their u show the rate of the fall.
_CLEAR = 8.0
#: Air takes a thousandth of a free top's spin a second at least (0.3 %/s is usual) [1/s]; half of it, after this
#: time [s], is much more than the noise of a reading.
_LEAST_LOSS_PER_S, _SEEN_TO_FALL_S = 1e-3, 60.0
#: The drag of every law is between these powers of the spin.
_POWERS = (1.0, 2.0)


class SpinSettings(DriveSettings):
    """Drive up to a frequency, switch off, read until the top falls."""

    by_hand: ClassVar[bool] = True
    by_trigger: ClassVar[bool] = True


def channels(settings: SpinSettings) -> tuple[Channel, ...]:
    """Return the channels; without reading_u_hz there is no column of uncertainties."""
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
    top = free_top(session, session.rows[-3:])
    said = False
    for _ in session.readings_every(settings.interval_s, settings.longest_s):
        reading = top.read()
        if reading:
            rows = session.rows or [reading]
            session.keep(reading, time_left(rows[0], rows[len(rows) // 2], reading, settings.longest_s))
            if not said and keeps_its_spin(rows[0], reading):
                said = True
                session.event(RunEvent.DOES_NOT_FALL, _why_it_keeps_its_spin(session, rows[0], reading))
        elif end := top.fall():
            session.event(RunEvent.FELL, end)
            return


def keeps_its_spin(first: Row, last: Row) -> bool:
    """Return whether a top has lost much less of its spin than air takes from a free one, after a while."""
    lapse = last["time_s"] - first["time_s"]
    return lapse >= _SEEN_TO_FALL_S and last["spin_frequency_hz"] > first["spin_frequency_hz"] * math.exp(
        -_LEAST_LOSS_PER_S / 2 * lapse
    )


def _why_it_keeps_its_spin(session: Session[SpinSettings], first: Row, last: Row) -> str:
    """Return a description of a top that keeps its spin, with a likely reason."""
    seen = Text(
        "the spin does not fall: {first:.2f} Hz, and {last:.2f} Hz {later:.0f} s later",
        first=first["spin_frequency_hz"],
        last=last["spin_frequency_hz"],
        later=last["time_s"] - first["time_s"],
    )
    if session.writer.record.table("scene").get("drag", {}).get("law") == "none":
        return Text(
            "{seen}: the scene has no drag (drag.law); take one with drag, such as spindown, or end the run", seen=seen
        )
    return Text("{seen}: is the drive still on, or does something else drive the top?", seen=seen)


def time_left(first: Row, middle: Row, last: Row, longest_s: float) -> tuple[float, float]:
    """Return the least and the greatest time until the fall, at most the time left of the run [s].

    Drag slows the spin by dν/dt ∝ −νᵖ, with p from 1 (Stokes) to 2 (Newton).  The first and the last reading show the
    rate, the one in the middle shows p.  Until readings differ by much more than their noise, the rate is the usual one
    and p may be any of these powers.  The range allows for about two standard uncertainties of the readings and of p.
    It takes some microseconds, a fit takes milliseconds.

    Args:
        first: the first reading.
        middle: one about half way in time, where there are three.
        last: the last reading.
        longest_s: time at which the run ends if the top is still up [s].
    """
    start, now = first["spin_frequency_hz"], last["spin_frequency_hz"]
    time, lapse = last["time_s"], last["time_s"] - first["time_s"]
    u = min(last.get("spin_frequency_u_hz", _USUAL_U_HZ), _MOST_U * now)
    seen = lapse > 0 and start - now > _CLEAR * u
    powers = _powers(first, middle, last, u) if seen else _POWERS
    ends = []
    # √2 u off in both readings, so that both move the end to one side, is about two standard uncertainties of the end
    for power, falls_hz, sign in zip(powers, FALLS_BETWEEN_HZ, (1, -1), strict=True):
        off = sign * math.sqrt(2) * u
        usual = _USUAL_HZ_PER_S * _USUAL_HZ**-power
        per_second = _power_integral(start + off, now - off, power) / lapse if seen else usual
        ends.append(time + _power_integral(now - off, falls_hz, power) / per_second)
    least, most = (max(0.0, min(end, longest_s) - time) for end in ends)
    return least, most


def _powers(first: Row, middle: Row, last: Row, u: float) -> tuple[float, float]:
    """Return the range of powers of the spin in the drag, from three readings of standard uncertainty u [Hz].

    The part of ∫ dν/νᵖ that is passed in the middle is that of the time, and goes nearly evenly with p from 1 to 2.
    """
    start, half, now = (row["spin_frequency_hz"] for row in (first, middle, last))
    if not (start - half > _CLEAR * u and half - now > _CLEAR * u):
        return _POWERS
    of_time = (middle["time_s"] - first["time_s"]) / (last["time_s"] - first["time_s"])
    least, most = (_power_integral(start, half, power) / _power_integral(start, now, power) for power in _POWERS)
    power = 1 + (of_time - least) / (most - least)
    # the middle reading counts once, the two others by parts whose sum is 1: √1.5 u in all, at half time
    u_power = math.sqrt(1.5) * u * half**-1.5 / _power_integral(start, now, 1.5) / abs(most - least)
    low, high = (min(max(end, _POWERS[0]), _POWERS[1]) for end in (power - 2 * u_power, power + 2 * u_power))
    return low, high


def _power_integral(start: float, end: float, power: float) -> float:
    """∫ dν/νᵖ from one spin down to another, which time increases evenly."""
    return math.log(start / end) if power == 1 else (end ** (1 - power) - start ** (1 - power)) / (power - 1)


EXPERIMENT = Experiment(
    name="spin",
    about="drive the top up, switch the drive off, and count its spin until it falls",
    instruments=("counter",),
    also_needs=drives,
    settings=SpinSettings,
    channels=channels,
    run=run,
)
