"""Limits ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, model_validator

from levilab.pipelines.document import Document, result_model, values_of
from levilab.pipelines.dump import Dump
from levilab.pipelines.limit.analysis import METHOD, LimitAnalysis, Limits
from levilab.pipelines.limit.budget import budget_of_all, budget_of_run
from levilab.pipelines.limit.quantities import QUANTITIES
from levilab.pipelines.result import Result
from levilab.pipelines.row import find_all

if TYPE_CHECKING:
    from collections.abc import Sequence

    from analysis.limits import Statistics


class LimitResult(Result):
    """result.json of limits.

    combined: a group for each of the conditions, called `groups` in the file.
    """

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
    result=result_model(METHOD, Limits, base=LimitResult),
    entries=_entries,
    run_entries=_run_entries,
    renumber=_renumber,
)
