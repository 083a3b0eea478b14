"""Sweeps → their points as columns, with what the line leaves over."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from levilab.pipelines.precession.analysis import PrecessionAnalysis

#: Name of the column → attribute of a point.
_COLUMNS = {
    "drive_frequency_hz": "drive",
    "drive_frequency_u_hz": "u_drive",
    "precession_frequency_hz": "precession",
    "precession_frequency_u_hz": "u",
    "spin_frequency_hz": "spin",
    "spin_frequency_u_hz": "u_spin",
    "residual_hz": "residual",
}


def precession_columns(analysis: PrecessionAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Of each sweep; residual_hz: point less the sweep's own line, also of points that the line leaves out."""
    for run in analysis.runs:
        used = np.array([point.used for point in run.fit.points])
        yield {name: run.fit.column(attribute) for name, attribute in _COLUMNS.items()} | {"used": used}
