"""What a spin frequency and its slope mean, in sentences that a student understands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.present.numbers import with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Iterator

    from levilab.pipelines.spin.analysis import SpinAnalysis, SpinRun

#: A slope, or a scatter of records, is seen beyond this multiple of u.
_SEEN = 3.0
#: What air takes of the spin of a free top at 20 to 45 Hz, a second: 0.3 %, and twice or half of it for other tops.
_AIR = (1.5e-3, 6e-3)
#: An uncertainty within this factor of the bound can hardly be made better by another method.
_AT_BOUND = 1.5
#: Inputs that sentences are made of; of more there is a table.
_MOST = 4


def meaning(analysis: SpinAnalysis) -> tuple[str, ...]:
    """Return the sentences, of each input."""
    several = len(analysis.runs) > 1
    made = (
        (source.name, " ".join(_sentences(run)))
        for source, run in zip(analysis.sources[:_MOST], analysis.runs[:_MOST], strict=True)
    )
    return tuple(f"{name}: {text}" if several else text for name, text in made if text)


@dataclass(frozen=True)
class _Change:
    """How the spin changes.

    Attributes:
        slope: [Hz/s]; u: its standard uncertainty [Hz/s].
        lasts_s: how long it was watched [s].
    """

    slope: float
    u: float
    lasts_s: float


def _change(run: SpinRun) -> _Change | None:
    """Return the slope through all records, or of the one; None where it is not known."""
    spin, trend = run.spin, run.trend
    if trend and trend.value is not None and trend.u is not None:
        return _Change(trend.value, trend.u, float(np.ptp(run.series.time)))
    if spin.chirp.value is None or not spin.chirp.u or not spin.frequency.value:
        return None
    turns = spin.pulses + spin.missing - spin.doubled
    return _Change(spin.chirp.value, spin.chirp.u, turns / spin.frequency.value)


def _sentences(run: SpinRun) -> Iterator[str]:
    spin = run.spin
    frequency = spin.frequency
    if not frequency.value:
        return
    at = f" at {spin.reference_time:.3g} s" if len(run.series) > 1 else ""
    yield f"The top turns with {with_uncertainty(frequency)}{at}, {60 * frequency.value:.0f} times a minute."
    if run.swing and run.swing[1] > _SEEN:
        far, units = run.swing
        yield (
            f"That is one {run.series.of} of {len(run.series)}: they scatter about a line by {digits(far)} Hz, "
            f"{digits(units)} times their uncertainties, so the spin itself swings, as that of a driven top does."
        )
    yield from _about_line(run)
    if (change := _change(run)) is None:
        return
    yield from _about_change(change, frequency.value)
    if spin.bound and "frequency" in run.parts:
        ratio = run.parts["frequency"].pulses / spin.bound
        if ratio < _AT_BOUND:
            yield "With such noise no other method would find it much better."
        elif not run.line:
            yield (
                f"The uncertainty is {digits(ratio)} times the least that any method could reach with such noise: the "
                "pulses themselves scatter, or the samples lie far apart."
            )


def _about_line(run: SpinRun) -> Iterator[str]:
    """Yield the sense of rotation, and the part of the moment that turns."""
    if run.line and run.line.sense:
        # beside the top a dipole's field turns against the dipole
        way = "clockwise" if run.line.sense > 0 else "counterclockwise"
        yield f"Seen from above it turns {way}, if the phone lay beside it with its screen up."
    if run.transverse and run.transverse.value:
        text = f"The part of its moment that turns is {with_uncertainty(run.transverse)}"
        yield f"{text}: the moment leans by {with_uncertainty(run.tilt)} from the axis." if run.tilt else f"{text}."


def _about_change(change: _Change, frequency: float) -> Iterator[str]:
    """Yield what the change of a spin [Hz] means."""
    share = change.slope / frequency
    lost = with_uncertainty(Estimate(100 * abs(share), 100 * change.u / frequency, "%"))
    if abs(change.slope) < _SEEN * change.u:
        most = (abs(change.slope) + 2 * change.u) / frequency
        yield (
            f"In {digits(change.lasts_s)} s no change of its spin shows beyond the uncertainty: it loses or gains less "
            f"than {digits(100 * most)} % a second."
        )
        yield (
            "A free top loses some 0.3 % a second to the air: a longer record shows that, or one more a while later."
            if most > _AIR[0]
            else "That is less than air takes from a free top: does a drive hold it?"
        )
    elif share > 0:
        yield f"It gains {lost} of its spin a second: something drives it."
    elif _AIR[0] < -share < _AIR[1]:
        yield f"It loses {lost} of its spin a second, as a free top does in air."
    else:
        why = "more than air takes: does it touch something, or does a drive brake it?" if -share > _AIR[1] else (
            "less than air takes from a free top: does a drive hold it?"
        )  # fmt: skip
        yield f"It loses {lost} of its spin a second, {why}"
