"""What a Hall scan means, in sentences that a student understands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.field.ring import on_axis
from analysis.numbers import digits
from levilab.pipelines.field.quantities import QUANTITIES
from levilab.present.numbers import plain, with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Iterator

    from levilab.pipelines.field.analysis import FieldAnalysis

#: Where the thesis's top floats [m].
_HEIGHT_M = 0.073


def meaning(analysis: FieldAnalysis) -> tuple[str, ...]:
    """Return the sentences; of several scans those of the first, and how far they agree."""
    return tuple(_sentences(analysis))


def _sentences(analysis: FieldAnalysis) -> Iterator[str]:
    scan = analysis.runs[0].scan
    strength = analysis.values["strength"]
    if not strength.value or not strength.u:
        return
    b, slope = (float(each[0]) for each in on_axis(scan.ring, np.array([_HEIGHT_M]))[:2])
    yield (
        f"The base is as strong as ρ = {with_uncertainty(QUANTITIES['strength'].show(strength))}, known to "
        f"{digits(100 * strength.u / abs(strength.value))} %; {1e2 * _HEIGHT_M:g} cm up that is "
        f"{plain(abs(1e3 * b))} mT, and {plain(abs(10 * slope))} mT less for each centimetre higher."
    )
    yield "What the base holds up is in proportion to its strength: 1 % stronger, and the top weighs 1 % more."
    reduced = scan.statistics.reduced_chi_square
    if reduced is None:
        yield "No uncertainty of the readings is given, so whether a ring describes the field is not tested."
    elif reduced < 1.5:
        yield f"A uniform ring describes the readings to their uncertainties (χ²/dof = {digits(reduced)})."
    else:
        yield (
            f"A uniform ring leaves more than the uncertainties explain (χ²/dof = {digits(reduced)}): the magnet is "
            "not uniform, or the probe was off the axis, or a size is wrong."
        )
