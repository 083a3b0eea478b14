"""What limits of the spin mean, in sentences that a student understands."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.present.numbers import with_uncertainty
from levilab.stability.thesis import MEASURED_HZ, MEASURED_U_HZ

if TYPE_CHECKING:
    from collections.abc import Iterator

    from levilab.pipelines.limit.analysis import LimitAnalysis, Limits

#: The limit → why there is one.
_WHY = MappingProxyType({
    "lower": "below it the top spins too slowly to be upright, and the field turns it over",
    "upper": "above it the top is so stiff that its axis no longer follows the field, or the drive "
    "cannot take it along",
})  # fmt: skip


def meaning(analysis: LimitAnalysis) -> tuple[str, ...]:
    """Return the sentences, of each of the conditions."""
    return tuple(text for group in analysis.groups for text in _sentences(group))


def _sentences(group: Limits) -> Iterator[str]:
    found = group.statistics
    mean = found.mean
    if mean.value is None:
        return
    yield f"The {group.which} limit is {with_uncertainty(mean)}: {_WHY[group.which]}."
    if found.scatter is None or not found.scatter.value or not mean.u:
        yield "How far another top's limit lies from that one top does not say."
        return
    ratio = found.scatter.value / mean.u
    yield (
        f"One top is lost {digits(found.scatter.value)} Hz from another, so a single one may be off by that much; the "
        f"mean of {found.n} is {digits(ratio)} times as good."
    )
    if group.which == "lower":
        value, u = MEASURED_HZ, MEASURED_U_HZ
        away = abs(mean.value - value) / math.hypot(mean.u, u)
        said = "which agrees" if away < 2 else f"{digits(away)} u from it: another top, or mass"
        yield f"The thesis's ten tops have {with_uncertainty(Estimate(value, u, 'Hz'))}, {said}."
