"""Tracks of swaying tops → uncertainty budgets and result.json."""

from typing import Any

from analysis.budget import Budget
from levilab.pipelines.budget import direct_row
from levilab.pipelines.document import Analysis, values_of, whole_u
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import SwayOptions
from levilab.pipelines.row import find_all, symbols_of
from levilab.pipelines.sway.analysis import QUANTITIES, SWAY_ROW, SwayAnalysis, SwayRun, analyze_source
from levilab.pipelines.sway.readings import SwayReadings, read_motion_run, read_track_file
from levilab.pipelines.sway.report import sway_columns, sway_part, sway_tables
from levilab.runs.run import STATES

#: Name of a part → its description, whether it was seen to scatter, where it comes from, what would make it smaller.
_ROWS = {
    "lines": ("frequencies of the swings", "A", "noise of the places, and scatter of the windows",
              "a longer spin-down, or a sharper picture"),
    "amplitude": ("shift at finite amplitude", "B", "computed for a top without a vertical swing",
                  "smaller swings, or another washer"),
    "mistake": ("which line is which", "B", "lines of the vertical swing lie beside the swings",
                "a longer spin-down, or smaller swings"),
    "motion": ("changes within a window", "B", "as tops in full motion scatter", "a slower spin-down"),
    "lean": ("tilt of the precession", "B", "by the size of its line, as of the centre of mass",
             "a top that precesses less, or a mark nearer to the centre of mass"),
    "base": ("sizes of the base", "B", "calliper or Hall scan", "a Hall scan"),
    "mass": ("mass of the top", "B", "scales", "better scales"),
    "inertia": ("moment of inertia I₃", "B", "parts of the top", "each part weighed and measured"),
}  # fmt: skip


def budget_of_run(_: Source[SwayReadings], run: SwayRun, __: SwayOptions) -> tuple[Budget, ...]:
    """Return the budgets of one track."""
    found = run.geometry
    each = (("geometric_magnetism", found.measured, found.parts), ("predicted", found.predicted, found.parts_predicted))
    return tuple(
        Budget(
            name,
            estimate.value or 0.0,
            estimate.u,
            "Hz",
            tuple(
                direct_row(part, what, size, "Hz", note, remedy, "A" if kind == "A" else "B")
                for part, (what, kind, note, remedy) in _ROWS.items()
                if (size := parts.get(part))
            ),
        )
        for name, estimate, parts in each
        if estimate.u
    )


def _run_entries(run: SwayRun) -> dict[str, Any]:
    found = run.geometry
    values = values_of(find_all(QUANTITIES, found))
    freedom = len(found.shares) - 1
    model = {
        "name": "geometric magnetism",
        "parameters": {"geometric_magnetism": values["geometric_magnetism"]},
        "covariance": [[(found.measured.u or 0.0) ** 2]],
        "statistics": {"n": freedom + 1, "reduced_chi_square": found.chi_square / freedom if freedom else None},
    }
    return {"values": values, "models": [model], "text": run.text}


SWAY = Analysis(
    name="sway",
    experiments=frozenset({"simulate", "sway"}),
    read_file=read_track_file,
    read_run=read_motion_run,
    data=STATES,
    particular=True,
    wanted="track of x and y over time, a sway run, or a simulated motion",
    kind=SwayAnalysis,
    options=SwayOptions,
    fit=analyze_source,
    skips=True,
    budget_of_run=budget_of_run,
    finding=SwayRun,
    run_entries=_run_entries,
    tables=sway_tables,
    part=sway_part,
    columns=sway_columns,
    row=SWAY_ROW,
    symbols=symbols_of(QUANTITIES),
    shared_u=whole_u,
    common="χ²/dof compares the windows of one run: above 1 they differ by more than their u, which is made larger. "
    "All runs have nearly the same differences, so the mean keeps the u of one group.",
)
