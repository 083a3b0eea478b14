"""What the line through a sweep means, in sentences that a student understands."""

from __future__ import annotations

from typing import TYPE_CHECKING

from analysis.numbers import digits
from levilab.pipelines.precession.analysis import slope_of
from levilab.present.numbers import plain, with_uncertainty
from levilab.simulator.published.printed import published

if TYPE_CHECKING:
    from collections.abc import Iterator

    from analysis.precession.sweep import SweepFit
    from levilab.pipelines.precession.analysis import PrecessionAnalysis

#: A difference of so many u is one.
_DIFFERS = 2.0


def meaning(analysis: PrecessionAnalysis) -> tuple[str, ...]:
    """Return the sentences, of the line through all points."""
    return tuple(_sentences(analysis.combined))


def _sentences(fit: SweepFit) -> Iterator[str]:
    line = fit.line
    slope = with_uncertainty(slope_of(fit))
    if fit.p_locked is None or not line.u_slope:
        yield f"The line rises by {slope}; how far that may be off these points do not say, so nothing is tested."
        return
    if fit.locked:
        yield (
            f"Each time the drive turns, the stem cuts the beam once: slope {slope} and intercept agree with 1 and 0, "
            f"as of a top that is locked to its drive (p = {plain(fit.p_locked, 2)})."
        )
    else:
        yield (
            f"The stem does not cut the beam once in each period of the drive: slope {slope} and intercept together "
            f"exclude 1 and 0 (p = {plain(fit.p_locked, 1)}). A top that is not locked, or a counter that misses or "
            "doubles pulses, does that; the free precession does not follow the drive at all."
        )
    theirs = published("thesis")["measured.slope"]  # printed without an uncertainty
    away = abs(line.slope - theirs.value) / line.u_slope
    if away > _DIFFERS:
        yield f"The slope of {theirs.text} that the thesis gives lies {digits(away)} u away from this one."
    else:
        yield (
            f"The slope of {theirs.text} that the thesis gives lies within {digits(away)} u: these points cannot "
            "distinguish it from a locked top's."
        )
    if fit.spin_offset is not None and fit.u_spin_offset:
        off = abs(fit.spin_offset)
        follows = off < _DIFFERS * fit.u_spin_offset
        why = (
            "the tape turns with the top." if follows else "is the tape on a washer that slips, or does the top swing?"
        )
        size = digits(1e3 * max(off, fit.u_spin_offset))
        yield f"The spin that was counted is the drive's frequency to {size} mHz: {why}"
