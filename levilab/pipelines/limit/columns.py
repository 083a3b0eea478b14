"""Limits of the spin → columns, with their distance from the mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from levilab.pipelines.limit.analysis import LimitAnalysis


def limit_columns(analysis: LimitAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Of each run, a row for each top; residual_hz: limit less the mean of the run, in which outliers are, too."""
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        limit, n = source.readings.limit, len(source.readings)
        given, found = analysis.options.reading_u, run.statistics
        u = np.full(n, np.nan) if source.readings.u is None else source.readings.u
        yield {
            "top": np.arange(1, n + 1),
            "spin_frequency_hz": limit,
            "spin_frequency_u_hz": u if given is None else np.full(n, given),
            "residual_hz": limit - (np.nan if found.mean.value is None else found.mean.value),
            "outlier": np.isin(np.arange(n), found.outliers),
        }
