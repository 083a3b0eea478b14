"""The quantities of the limits of one run, and the limits as columns."""

from __future__ import annotations

from levilab.pipelines.row import Quantity, columns_of, entry

#: Of `analysis.limits.Statistics`.
QUANTITIES = (
    Quantity("mean", "Hz", "mean limit", optional=True),
    Quantity("scatter", "Hz", "standard deviation of one limit", optional=True),
    Quantity("trend", "Hz", "change from one limit to the next", optional=True),
    Quantity("between_runs", "Hz", "standard deviation between runs", of="between", optional=True, column=False),
    Quantity("standard_error", "Hz", "standard error of the mean, where it rests on the scatter",
             of=lambda found: found.mean.u if found.scatter else None, has_u=False),
    Quantity("step_error", "Hz", "uncertainty from the steps of the drive",
             of=lambda found: found.step or None, has_u=False, optional=True, column=False),
)  # fmt: skip

LIMIT_ROW = (
    entry("which", "text", "lower or upper", "result.which"),
    entry("repetitions", "count", "limits that were measured", "result.statistics.n"),
    *columns_of(QUANTITIES),
    entry("trend_p", "number", "probability of such a trend by chance", "result.statistics.trend_p"),
    entry("outliers", "count", "limits far from the others", "result.statistics.outliers"),
    *(
        entry(f"linear_{edge}_hz", "number", f"{edge} edge of the linear window of the top",
              f"result.device.linear_{edge}_hz")
        for edge in ("lower", "upper")
    ),
    entry("verdict", "text", "what the limits say"),
)  # fmt: skip
