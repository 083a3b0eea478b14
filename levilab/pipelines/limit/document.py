"""Limits ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from levilab.pipelines.document import Document, Settings, values_of
from levilab.pipelines.dump import Dump
from levilab.pipelines.limit.analysis import METHOD, LimitAnalysis, Limits
from levilab.pipelines.limit.budget import budget_of_all, budget_of_run
from levilab.pipelines.limit.quantities import QUANTITIES
from levilab.pipelines.result import Result, RunPart
from levilab.pipelines.row import find_all

if TYPE_CHECKING:
    from collections.abc import Sequence

    from analysis.limits import Statistics


class LimitPart(RunPart):
    """One run."""

    result: Annotated[Limits, Dump()]


class SettingsPart(Settings):
    """How the limits were analyzed."""

    reading_u: float | None = Field(gt=0, alias="reading_u_hz")
    clock_u: float | None = Field(default=None, gt=0)
    near: float | None = Field(default=None, gt=0, alias="near_hz")


class LimitResult(Result):
    """result.json of limits.

    combined: a group for each of the conditions, called `groups` in the file.
    """

    analysis: Literal["limit"] = "limit"
    settings: SettingsPart
    runs: tuple[LimitPart, ...]
    combined: Annotated[tuple[Limits, ...], Dump()] = Field(alias="groups")

    @model_validator(mode="after")
    def _groups_are_there(self) -> Self:
        if any(one.group is not None and one.group >= len(self.combined) for one in self.budget):
            raise ValueError(f"a budget is of none of the {len(self.combined)} groups")
        if any(k >= len(self.runs) for group in self.combined for k in group.runs):
            raise ValueError(f"a group has a run that is none of the {len(self.runs)}")
        return self


def _entries(analysis: LimitAnalysis) -> dict[str, Any]:
    """Return the values of the groups; of several their names begin with the kind and the number of the group."""
    return {
        "values": {
            f"{analysis.prefix(group)}{name}": value | {"group": k}
            for k, group in enumerate(analysis.groups)
            for name, value in _values(group.statistics).items()
        }
    }


def _run_entries(run: Limits) -> dict[str, Any]:
    return {"values": _values(run.statistics), "verdict": run.text}


def _values(found: Statistics) -> dict[str, Any]:
    return values_of(find_all(QUANTITIES, found))


def _renumber(groups: tuple[Limits, ...], order: Sequence[int]) -> tuple[Limits, ...]:
    return tuple(replace(group, runs=tuple(order.index(k) for k in group.runs)) for group in groups)


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run, budget_of_all=budget_of_all),
    result=LimitResult,
    entries=_entries,
    run_entries=_run_entries,
    renumber=_renumber,
)
