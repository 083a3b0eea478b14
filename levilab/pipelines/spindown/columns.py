"""Spin-downs → their readings as columns, with what the best law leaves over."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from levilab.pipelines.spindown.analysis import SpinDownAnalysis


def spindown_columns(analysis: SpinDownAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Of each run; residual_hz: reading less the best law of all runs, NaN for an outlier that was left out."""
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        readings, n = source.readings, len(source.readings)
        used = np.isin(readings.time, run.time)
        residual = np.full(n, np.nan)
        residual[used] = run.fit(analysis.combined.best).residuals
        given = analysis.options.reading_u
        own = np.full(n, np.nan) if readings.u is None else readings.u
        yield {
            "time_s": readings.time,
            "spin_frequency_hz": readings.frequency,
            "spin_frequency_u_hz": own if given is None else np.full(n, given),
            "residual_hz": residual,
            "used": used,
        }
