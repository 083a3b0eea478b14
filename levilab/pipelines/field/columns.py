"""Scans of a field → their readings as columns, with what the fitted ring leaves over."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import numpy as np

    from levilab.pipelines.field.analysis import FieldAnalysis


def field_columns(analysis: FieldAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Of each scan, by rising height; flux_density_u_t: with what the height's uncertainty makes of it."""
    for run in analysis.runs:
        scan = run.scan
        yield {
            "height_m": scan.height,
            "flux_density_t": scan.flux_density,
            "flux_density_u_t": scan.u,
            "residual_t": scan.residuals,
        }
