"""Scans of a field → uncertainty budgets and result.json."""

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from analysis.budget import Budget, Component
from analysis.field.fit import UNITS, FieldScan, UPart, parts_of
from analysis.uncertainty import Estimate
from levilab.pipelines.document import Analysis, statistics_of, value_of, values_of, whole_u
from levilab.pipelines.field.analysis import FieldAnalysis, FieldRun, Mean, analyze_source
from levilab.pipelines.field.readings import FieldReadings, read_scan_file, read_scan_run
from levilab.pipelines.field.report import field_columns, field_part, field_tables
from levilab.pipelines.field.words import FIELD_ROW, QUANTITIES, remark
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import FieldOptions
from levilab.pipelines.row import symbols_of
from levilab.texts.text import Text

EXPERIMENT = "field"
#: The parameters that have a budget.
SHOWN = ("strength", "origin", "thickness", "background")
#: Name of a part → its description, and what would make it smaller.
_WORDS = {
    "readings": ("readings of the probe", "more readings at each height"),
    "heights": ("setting of the heights", "a stand that sets heights better, or more heights"),
    "excess": ("scatter beyond the stated u", "the probe on the axis, and the radii measured again"),
    "gain": ("calibration of the probe: its scale", "a calibrated probe, or a reference magnet"),
    "origin": ("height of the base on the scale", "the zero of the heights measured again"),
    "thickness": ("thickness by the calliper", "a better calliper"),
    "background": ("zero of the probe and the earth's field", "the probe zeroed in its chamber, and the base away"),
    "inner_radius": ("inner radius by the calliper", "a better calliper"),
    "outer_radius": ("outer radius by the calliper", "a better calliper"),
}  # fmt: skip
#: Those that were seen to scatter.
_TYPE_A = frozenset({"readings", "excess"})


def budget_of_run(source: Source[FieldReadings], run: FieldRun, _: FieldOptions) -> tuple[Budget, ...]:
    """Return the budgets of the parameters of one scan."""
    scan, parts = run.scan, parts_of(run.scan)
    return tuple(
        Budget(
            name, found.value, found.u, found.unit,
            (*(_row(source, scan, found.unit, part) for part in parts[name]), *_not_in_u(scan, name)),
        )
        for name in SHOWN
        if name in parts and (found := scan.parameters[name]).value is not None and found.u
    )  # fmt: skip


def _row(source: Source[FieldReadings], scan: FieldScan, unit: str, part: UPart) -> Component:
    """Return a part as a row: by the input's own u where it has one."""
    what, remedy = _WORDS[part.name]
    kind: Literal["A", "B"] = "A" if part.name in _TYPE_A else "B"
    u, unit_u, note = _input(source, scan, part)
    if u is None:
        return Component(part.name, what, kind, abs(part.size), unit, 1.0, note=note, remedy=remedy)
    return Component(part.name, what, kind, u, unit_u, part.size / u, note=note, remedy=remedy)


def _input(source: Source[FieldReadings], scan: FieldScan, part: UPart) -> tuple[float | None, str, str]:
    """Return an input's standard uncertainty, its unit and its origin; None where that says too little."""
    if part.name == "gain":
        return scan.known.gain_u, "1", "relative, common to all readings"
    prior = scan.known.prior(part.name)
    if prior is not None:
        return prior.u, UNITS[part.name], "before the scan, common to all readings"
    readings = source.readings
    if {"heights": readings.height_u, "readings": readings.u}.get(part.name, part) is None:
        return None, "", "their scatter about the fit"
    if part.name == "heights" and readings.height_u is not None:
        return (
            float(np.sqrt(np.mean(readings.height_u**2))),
            "m",
            "each height by itself, by the slope of the field there",
        )
    if part.name == "readings" and readings.u is not None:
        number = source.number(EXPERIMENT, "readings")
        text = Text("mean of {n:g} readings; the last digit is in it", n=number) if number else "each reading by itself"
        return float(np.sqrt(np.mean(readings.u**2))), "T", text
    return None, "", ""


def _not_in_u(scan: FieldScan, name: str) -> tuple[Component, ...]:
    if name != "strength":
        return ()
    strength = scan.parameters["strength"].value or 0.0
    note = "the scan is of that temperature; ferrite loses 0.2 % a kelvin"
    return (
        Component("temperature", "temperature of the base", "B", None, "K", 2e-3 * abs(strength), included=False,
                  note=note, remedy="a thermometer at the base"),
    )  # fmt: skip


# --- several scans -------------------------------------------------------------------------------------


def budget_of_all(analysis: FieldAnalysis) -> tuple[Budget, ...]:
    """Return the budgets of the means over several scans: what is common to them is no smaller than in one."""
    of_runs = [{budget.quantity: budget for budget in origin.budget or ()} for origin in analysis.origins]
    return tuple(
        _of_mean(analysis, name, [one[name] for one in of_runs])
        for name in SHOWN
        if all(name in one for one in of_runs)
    )


def _of_mean(analysis: FieldAnalysis, name: str, budgets: Sequence[Budget]) -> Budget:
    """Return u of a mean: that of one scan, and s/√N."""
    mean, n = analysis.means[name], len(budgets)
    u = mean.u or 0.0
    sizes = np.array([one.u for one in budgets])
    remedy = Text("more scans: it takes {more} instead of {n} to halve it", more=4 * n, n=n)
    note = Text("standard deviation of one scan from another, {n} scans", n=n)
    rows = [Component("runs", "scatter between the scans", "A", mean.scatter, mean.unit, 1 / math.sqrt(n),
                      note=note, remedy=remedy)] * (mean.scatter > 0)  # fmt: skip
    for part in dict.fromkeys(row.name for one in budgets for row in one.included):
        found = [row for one in budgets for row in one.included if row.name == part]
        size = float(np.linalg.norm([row.contribution or 0.0 for row in found]) / np.linalg.norm(sizes) * sizes.mean())
        first = found[0]
        same = len({row.u for row in found}) == 1 and first.u
        size_u, unit, by = (first.u, first.unit, size / first.u) if same and first.u else (size, mean.unit, 1.0)
        rows.append(Component(part, first.source, first.kind, size_u, unit, by, note=first.note, remedy=first.remedy))
    return Budget(name, mean.value or 0.0, u, mean.unit, (*rows, *budgets[0].left_out))


def _entries(analysis: FieldAnalysis) -> dict[str, Any]:
    return {
        "values": {name: _value(estimate) for name, estimate in analysis.values.items()},
        # of several scans there is no fit together: the scan's own stand with each
        "models": [_model(analysis.runs[0])] if len(analysis.runs) == 1 else [],
    }


def _value(estimate: Estimate) -> dict[str, Any]:
    scatter = {"scatter": estimate.scatter, "runs": estimate.runs} if isinstance(estimate, Mean) else {}
    return value_of(estimate) | scatter


def _run_entries(run: FieldRun) -> dict[str, Any]:
    return {"values": values_of(run.values), "models": [_model(run)], "text": run.text}


def _model(run: FieldRun) -> dict[str, Any]:
    return {
        "name": "ring",
        "parameters": values_of(run.scan.parameters),
        "covariance": run.scan.covariance.tolist(),
        "statistics": statistics_of(run.scan.statistics),
        "warnings": [remark(each) for each in run.scan.remarks],
    }


FIELD = Analysis(
    name="field",
    experiments=frozenset({"field"}),
    read_file=read_scan_file,
    read_run=read_scan_run,
    particular=True,
    kind=FieldAnalysis,
    options=FieldOptions,
    fit=analyze_source,
    mixed="a mean over both says nothing about a real base",
    budget_of_run=budget_of_run,
    budget_of_all=budget_of_all,
    finding=FieldRun,
    entries=_entries,
    run_entries=_run_entries,
    tables=field_tables,
    part=field_part,
    columns=field_columns,
    row=FIELD_ROW,
    symbols=symbols_of(QUANTITIES.values()),
    curve=lambda analysis, number, _: analysis.runs[number].scan.model,
    curve_u=lambda analysis, number, _: analysis.runs[number].scan.u_model,
    compared=("strength", "origin", "thickness"),
    shared_u=whole_u,
    common="Calliper and data sheet are the same for all scans, so the mean keeps the u of one group.",
)
