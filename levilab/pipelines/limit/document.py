"""Limits ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from analysis.limits import Comparison, Statistics
from levilab.pipelines.document import Document, Settings, number, value_of, values_of
from levilab.pipelines.limit.analysis import METHOD, Device, LimitAnalysis, Limits, Which
from levilab.pipelines.result import Part, Result, RunPart, Value

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


class ComparisonPart(Part):
    """A mean beside theory; see `analysis.limits.Comparison`."""

    name: str
    expected: Value
    difference: Value
    p: float | None


class _WithLimits(Part):
    """What stands with each run, and with the limits of a kind together."""

    which: Which
    repetitions: int = Field(ge=1)
    trend_p: float | None
    outliers: tuple[int, ...]
    comparisons: tuple[ComparisonPart, ...]
    device: DevicePart | None
    ends: dict[Literal["fell", "lock lost", "top lost"], int]
    verdict: str


class LimitRunPart(RunPart, _WithLimits):
    """One run."""


class GroupPart(_WithLimits):
    """All limits of a kind."""

    values: dict[str, Value]
    numbers: tuple[int, ...]


class SettingsPart(Settings):
    """How the limits were analyzed."""

    reading_u: float | None = Field(gt=0, alias="reading_u_hz")


class LimitResult(Result):
    """result.json of limits."""

    analysis: Literal["limit"] = "limit"
    settings: SettingsPart
    models: tuple[Any, ...] = ()
    groups: tuple[GroupPart, ...]
    runs: tuple[LimitRunPart, ...]


# --- writing -------------------------------------------------------------------------------------------


def _entries(analysis: LimitAnalysis) -> dict[str, Any]:
    return {
        "values": _top_values(analysis.groups),
        "groups": [
            {"values": _values(group.statistics), "numbers": list(group.runs)} | _limits(group)
            for group in analysis.groups
        ],
    }


def _run_entries(_: Source[LimitReadings], run: Limits) -> dict[str, Any]:
    return {"values": _values(run.statistics)} | _limits(run)


def _top_values(groups: Sequence[Limits]) -> dict[str, Any]:
    """Of one kind of limits by their plain names, of two with the kind before them."""
    if len(groups) == 1:
        return _values(groups[0].statistics)
    return {f"{group.which}_{name}": value for group in groups for name, value in _values(group.statistics).items()}


def _values(found: Statistics) -> dict[str, Any]:
    error = found.mean.u if found.scatter else None
    named = {"mean": found.mean, "scatter": found.scatter, "trend": found.trend}
    known = {name: estimate for name, estimate in named.items() if estimate}
    return values_of(known) | {"standard_error": number(error, "Hz")}


def _limits(limits: Limits) -> dict[str, Any]:
    found, device = limits.statistics, limits.device
    return {
        "which": limits.which,
        "repetitions": found.n,
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
        "device": None
        if device is None
        else {
            "name": device.name,
            "linear_lower_hz": device.lower,
            "linear_upper_hz": device.upper,
            "resonance_hz": device.resonance,
        },
        "ends": dict(limits.ends),
        "verdict": limits.text,
    }


# --- reading -------------------------------------------------------------------------------------------


def _run(part: LimitRunPart, *_: object) -> Limits:
    return _restored(part, part.values)


def _groups(result: LimitResult, _: object, order: Sequence[int]) -> tuple[Limits, ...]:
    """All of a kind; order: the number in the result of each of our runs."""
    return tuple(
        replace(_restored(group, group.values), runs=tuple(order.index(k) for k in group.numbers))
        for group in result.groups
    )


def _restored(part: _WithLimits, values: Mapping[str, Value]) -> Limits:
    scatter, trend = values.get("scatter"), values.get("trend")
    statistics = Statistics(
        mean=values["mean"].estimate,
        scatter=scatter.estimate if scatter else None,
        n=part.repetitions,
        trend=trend.estimate if trend else None,
        trend_p=part.trend_p,
        outliers=part.outliers,
    )
    comparisons = tuple(
        Comparison(one.name, one.expected.value or 0.0, one.difference.estimate, one.p) for one in part.comparisons
    )
    said = part.device
    device = Device(said.name, said.linear_lower_hz, said.linear_upper_hz, said.resonance_hz) if said else None
    ends = {str(kind): n for kind, n in part.ends.items()}
    return Limits(part.which, statistics, comparisons, device, ends)


DOCUMENT = Document(
    method=METHOD, result=LimitResult, entries=_entries, run_entries=_run_entries, run=_run, combined=_groups
)
