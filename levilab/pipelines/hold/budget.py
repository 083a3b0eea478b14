"""What the uncertainty of the drag at a held spin is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING

from analysis.budget import Budget
from levilab.pipelines.budget import direct_row

if TYPE_CHECKING:
    from analysis.held import Hold
    from levilab.pipelines.hold.readings import HoldReadings
    from levilab.pipelines.options import HoldOptions
    from levilab.pipelines.sources import Source


def budget_of_run(_: Source[HoldReadings], run: Hold, __: HoldOptions) -> tuple[Budget, ...]:
    """Return the budget of one held spin; none without a drag."""
    if run.drag is None or run.drag.value is None or run.drag.u is None:
        return ()
    parts, unit = run.parts, "Hz/s"
    rows = (
        direct_row("gain", "gain at the full amplitude", parts["gain"], unit, "scatter of the counts about their lines",
                   "more measurements of the gain", "A"),
        direct_row("drift", "change of the spin from the first to the last reading", parts["drift"], unit,
                   "u of these readings", "a longer hold", "A"),
        direct_row("exponent", "gain seen beside the held spin", parts["exponent"], unit,
                   "an exponent of the drag of 1.5(3)", "counts evenly about the held spin"),
    )  # fmt: skip
    return (Budget("drag", run.drag.value, run.drag.u, unit, rows),)
