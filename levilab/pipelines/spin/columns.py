"""Spin frequencies against time → columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import numpy as np

    from levilab.pipelines.spin.analysis import SpinAnalysis


def spin_columns(analysis: SpinAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Of each input: a row for each window of a long record, or for each of several records."""
    for run in analysis.runs:
        yield {
            "time_s": run.series.time,
            "spin_frequency_hz": run.series.frequency,
            "spin_frequency_u_hz": run.series.u,
        }
