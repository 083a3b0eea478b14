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

#: Name of a part → what it is, where it comes from, what would make it smaller.
_ROWS = {
    "gain": ("gain at the full amplitude", "scatter of the counts about their lines", "more measurements of the gain"),
    "drift": ("change of the spin meanwhile", "u of the first and of the last reading", "a longer hold"),
    "exponent": ("gain seen beside the held spin", "an exponent of the drag of 1.5(3)", "counts evenly about the spin"),
    "lean": ("pull there", "a top that leans, or is upright", "counts evenly about the spin"),
}


def budget_of_run(_: Source[HoldReadings], run: Hold, __: HoldOptions) -> tuple[Budget, ...]:
    """Return the budget of one held spin; none without a drag."""
    if run.drag is None or run.drag.value is None or run.drag.u is None:
        return ()
    rows = [direct_row(name, what, run.parts[name], "Hz/s", note, remedy, "A" if name in {"gain", "drift"} else "B")
            for name, (what, note, remedy) in _ROWS.items()]  # fmt: skip
    return (Budget("drag", run.drag.value, run.drag.u, "Hz/s", tuple(rows)),)
