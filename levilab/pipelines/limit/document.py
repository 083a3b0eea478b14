"""Limits ↔ result.json."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, Self

from pydantic import Field, model_validator

from analysis.limits import Comparison, Statistics
from levilab.pipelines.document import Document, Settings, number, value_of, values_of
from levilab.pipelines.limit.analysis import (
    METHOD,
    Conditions,
    Device,
    LimitAnalysis,
    Limits,
    Which,
    synthetic_runs,
    synthetic_source,
    tell_apart,
)
from levilab.pipelines.limit.budget import budget_of_all, budget_of_run
from levilab.pipelines.limit.quantities import QUANTITIES
from levilab.pipelines.result import Part, Result, RunPart, Value
from levilab.pipelines.row import find_all

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from levilab.pipelines.limit.readings import LimitReadings
    from levilab.pipelines.sources import Source


# --- what is in it -------------------------------------------------------------------------------------


class DevicePart(Part):
    """What theory says of the top; see `levilab.pipelines.limit.analysis.Device`."""

    name: str
    linear_lower_hz: float = Field(gt=0)
    linear_upper_hz: float = Field(gt=0)
    resonance_hz: float | None


class ConditionsPart(Part):
    """Under which the limits were measured; see `levilab.pipelines.limit.analysis.Conditions`.

    synthetic: not in results of earlier versions; the inputs say it then.
    """

    which: Which
    top: str
    waveform: str | None
    amplitude_vpp: float | None
    creep_hz_per_s: float | None
    step_hz: float | None
    synthetic: bool | None = None


class ComparisonPart(Part):
    """A mean beside theory; see `analysis.limits.Comparison`."""

    name: str
    expected: Value
    difference: Value
    p: float | None


class _WithLimits(Part):
    """What stands with each run, and with the limits of the same conditions together.

    freedom: degrees of freedom of the standard error, null where it rests on no scatter.
    """

    which: Which
    conditions: ConditionsPart
    repetitions: int = Field(ge=1)
    freedom: float | None
    trend_p: float | None
    outliers: tuple[int, ...]
    comparisons: tuple[ComparisonPart, ...]
    device: DevicePart
    ends: dict[Literal["fell", "lock lost", "top lost"], int]
    verdict: str


class LimitRunPart(RunPart, _WithLimits):
    """One run."""


class GroupPart(_WithLimits):
    """All limits of the same conditions."""

    values: dict[str, Value]
    numbers: tuple[int, ...]


class SettingsPart(Settings):
    """How the limits were analyzed."""

    reading_u: float | None = Field(gt=0, alias="reading_u_hz")
    clock_u: float | None = Field(default=None, gt=0)


class LimitResult(Result):
    """result.json of limits."""

    analysis: Literal["limit"] = "limit"
    settings: SettingsPart
    models: tuple[Any, ...] = ()
    groups: tuple[GroupPart, ...]
    runs: tuple[LimitRunPart, ...]

    @model_validator(mode="after")
    def _budgets_name_their_groups(self) -> Self:
        """Earlier results do not say it: each group whose mean has an uncertainty has one budget, in their order."""
        if any(one.group is not None and one.group >= len(self.groups) for one in self.budget):
            raise ValueError(f"a budget is of none of the {len(self.groups)} groups")
        if len(self.groups) == 1 or all(one.group is not None for one in self.budget):
            return self
        groups = [k for k, group in enumerate(self.groups) if (mean := group.values.get("mean")) and mean.u]
        if len(groups) != len(self.budget):
            raise ValueError(f"{len(self.budget)} budgets but {len(groups)} groups with an uncertainty")
        budget = tuple(one.model_copy(update={"group": k}) for one, k in zip(self.budget, groups, strict=True))
        return self.model_copy(update={"budget": budget})


# --- writing -------------------------------------------------------------------------------------------


def _entries(analysis: LimitAnalysis) -> dict[str, Any]:
    return {
        "values": _top_values(analysis),
        "groups": [
            {"values": _values(group.statistics), "numbers": list(group.runs)} | _limits(group)
            for group in analysis.groups
        ],
    }


def _run_entries(_: Source[LimitReadings], run: Limits) -> dict[str, Any]:
    return {"values": _values(run.statistics)} | _limits(run)


def _top_values(analysis: LimitAnalysis) -> dict[str, Any]:
    """Of one group by their plain names, else with the kind before them, and its number where it has several."""
    return {
        f"{analysis.prefix(group)}{name}": value | {"group": k}
        for k, group in enumerate(analysis.groups)
        for name, value in _values(group.statistics).items()
    }


def _values(found: Statistics) -> dict[str, Any]:
    return values_of(find_all(QUANTITIES, found))


def _limits(limits: Limits) -> dict[str, Any]:
    found, device = limits.statistics, limits.device
    return {
        "which": limits.which,
        "conditions": vars(limits.conditions),
        "repetitions": found.n,
        "freedom": found.freedom,
        "trend_p": found.trend_p,
        "outliers": list(found.outliers),
        "comparisons": [
            {
                "name": one.name,
                "expected": number(one.expected, "Hz"),
                "difference": value_of(one.difference),
                "p": one.p,
            }
            for one in limits.comparisons
        ],
        "device": {
            "name": device.name,
            "linear_lower_hz": device.lower,
            "linear_upper_hz": device.upper,
            "resonance_hz": device.resonance,
        },
        "ends": dict(limits.ends),
        "verdict": limits.text,
    }


# --- reading -------------------------------------------------------------------------------------------


def _run(part: LimitRunPart, source: Source[LimitReadings], _: object) -> Limits:
    return _restored(part, part.values, synthetic=synthetic_source(source))


def _groups(result: LimitResult, runs: Sequence[Limits], order: Sequence[int]) -> tuple[Limits, ...]:
    """Those of the same conditions; order: the number in the result of each of our runs."""

    def restored(group: GroupPart) -> Limits:
        numbers = tuple(order.index(k) for k in group.numbers)
        synthetic = synthetic_runs(runs[k] for k in numbers)
        return replace(_restored(group, group.values, synthetic=synthetic, runs=len(numbers)), runs=numbers)

    return tell_apart(restored(group) for group in result.groups)


def _restored(part: _WithLimits, values: Mapping[str, Value], *, synthetic: bool | None, runs: int = 1) -> Limits:
    """Limits as they were found; synthetic: as the inputs say, for a result that does not."""
    known = {name: value.estimate for name, value in values.items()}
    step = known["step_error"].value if "step_error" in known else None
    statistics = Statistics(
        mean=known["mean"],
        scatter=known.get("scatter"),
        n=part.repetitions,
        trend=known.get("trend"),
        trend_p=part.trend_p,
        outliers=part.outliers,
        step=step or 0.0,
        freedom=math.inf if part.freedom is None else part.freedom,
        runs=runs,
        between=known.get("between_runs"),
    )
    comparisons = tuple(
        Comparison(one.name, one.expected.value or 0.0, one.difference.estimate, one.p) for one in part.comparisons
    )
    said = part.device
    device = Device(said.name, said.linear_lower_hz, said.linear_upper_hz, said.resonance_hz)
    ends = {str(kind): n for kind, n in part.ends.items()}
    conditions = Conditions(**vars(part.conditions))
    if conditions.synthetic is None:
        conditions = replace(conditions, synthetic=synthetic)
    return Limits(part.which, conditions, statistics, comparisons, device, ends)


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run, budget_of_all=budget_of_all),
    result=LimitResult,
    entries=_entries,
    run_entries=_run_entries,
    run=_run,
    combined=_groups,
)
