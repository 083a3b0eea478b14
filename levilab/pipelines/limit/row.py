"""Limits of one run as a row of a table."""

from __future__ import annotations

from levilab.pipelines.row import entry, estimate, value

LIMIT_ROW = (
    entry("which", "text", "lower or upper", "result.which"),
    entry("repetitions", "count", "limits that were measured", "result.statistics.n"),
    *estimate("mean", "Hz", "mean limit"),
    *estimate("scatter", "Hz", "standard deviation of one limit"),
    value("standard_error", "Hz", "of the mean, where it rests on the scatter"),
    *estimate("trend", "Hz", "change from one limit to the next"),
    entry("trend_p", "number", "probability of such a trend by chance", "result.statistics.trend_p"),
    entry("outliers", "count", "limits far from the others", "result.statistics.outliers"),
    *(
        entry(f"linear_{name}_hz", "number", f"{name} edge of the linear window of the top",
              f"result.device.linear_{name}_hz")
        for name in ("lower", "upper")
    ),
    entry("verdict", "text", "what the limits say"),
)  # fmt: skip
