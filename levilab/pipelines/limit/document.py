"""Limits → uncertainty budgets and result.json."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from analysis.budget import Budget, Component, printed_step, rest, u_of_step
from analysis.limits import Statistics
from analysis.numbers import digits
from levilab.pipelines.budget import time_base
from levilab.pipelines.document import Analysis, values_of
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.limit.analysis import LIMIT_ROW, QUANTITIES, LimitAnalysis, Limits, limits_of, together
from levilab.pipelines.limit.readings import LimitReadings, read_limit_file, read_limit_run
from levilab.pipelines.limit.report import limit_columns, limit_part, limit_tables
from levilab.pipelines.options import LimitOptions
from levilab.pipelines.result import Dump, Result
from levilab.pipelines.row import find_all, symbols_of
from levilab.texts.text import Text

#: Four times as many tops halve what scatters from one to the next.
_TO_HALVE = 4


def budget_of_run(source: Source[LimitReadings], run: Limits, options: LimitOptions) -> tuple[Budget, ...]:
    """Return the budget of the mean of one run."""
    return _budgets([source], run, options)


def budget_of_all(analysis: LimitAnalysis) -> tuple[Budget, ...]:
    """Return the budgets of the means of all conditions."""
    return tuple(
        replace(budget, group=k)
        for k, (sources, group) in enumerate(zip(analysis.averaged, analysis.groups, strict=True))
        for budget in _budgets(sources, group, analysis.options)
    )


def _budgets(sources: Sequence[Source[LimitReadings]], limits: Limits, options: LimitOptions) -> tuple[Budget, ...]:
    mean = limits.statistics.mean
    if mean.value is None or not mean.u:
        return ()
    # an upper limit lies between what was counted and what the generator was set to
    clocks = "time bases of counter and generator" if limits.which == "upper" else ""
    rows = (*_rows(sources, limits), time_base(sources[0], "counter", mean.value, options.clock_u, what=clocks))
    return (Budget("mean", mean.value, mean.u, mean.unit, rows, limits.which),)


def _rows(sources: Sequence[Source[LimitReadings]], limits: Limits) -> Iterator[Component]:
    found = limits.statistics
    whole = found.mean.u or 0.0
    if found.scatter is None:
        yield Component("reading", "the limit by itself", "B", whole, "Hz", 1.0,
                        note="of a single top: its scatter is not known", remedy="more tops")  # fmt: skip
        return
    step = min(found.step, whole)
    common = found.common
    by_tops = rest(whole, math.hypot(step, common))
    if by_tops > 0:
        root = math.sqrt(found.n)
        each = by_tops * root
        printed = printed_step([float(limit) for source in sources for limit in source.readings.limit]) or 0.0
        rounding = u_of_step(printed)
        if 0 < rounding < each and not step:
            yield Component("resolution", "last digit of the limits", "B", rounding, "Hz", 1 / root,
                            note=Text("steps of {step:g} Hz; a part of the scatter", step=printed),
                            remedy="more digits")  # fmt: skip
            each = rest(each, rounding)
        yield Component("scatter", "scatter from top to top", "A", each, "Hz", 1 / root,
                        note=_about_scatter(limits), remedy=_more(limits))  # fmt: skip
    if step > 0:
        note = "the drive goes on in steps, the same for all tops, and each limit lies somewhere within one"
        yield Component("step", "steps of the drive", "B", step, "Hz", 1.0, note=note,
                        remedy="smaller steps (limit.creep_hz_per_s, limit.interval_s)")  # fmt: skip
    if common > 0:
        note = "the tops were still getting faster; the rest of the way is estimated, for all in the same way"
        yield Component("way", "rest of the way", "B", common, "Hz", 1.0, note=note)


def _more(limits: Limits) -> str:
    found = limits.statistics
    if _differ(found):
        return Text("more runs: the {n} differ by more than their tops", n=found.runs)
    return Text("more tops: it takes {more} instead of {n} to halve it", more=_TO_HALVE * found.n, n=found.n)


def _differ(found: Statistics) -> float:
    """Return by how much runs differ beyond what their tops explain [Hz]; 0 where it is less than its u."""
    between = found.between
    return (between.value or 0.0) if between and (between.value or 0.0) > (between.u or 0.0) else 0.0


def _about_scatter(limits: Limits) -> str:
    found = limits.statistics
    scatter = (found.scatter.value or 0.0) if found.scatter else 0.0
    text = Text("standard deviation of one top from another {s:n} Hz, of {n} tops", s=digits(scatter), n=found.n)
    if beyond := _differ(found):
        said = "{tops}; {n} runs differ by {hz:n} Hz beyond that, which is in it"
        text = Text(said, text, found.runs, digits(beyond))
    return Text("{tops}; what the counter and the moment of the fall leave to each limit is part of it", tops=text)


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


def _apart(analysis: LimitAnalysis) -> str:
    both = len({run.which for run in analysis.runs}) > 1
    return "some groups measured lower limits, others upper ones; compare each kind alone" if both else ""


LIMIT = Analysis(
    name="limit",
    experiments=frozenset({"limit"}),
    read_file=read_limit_file,
    read_run=read_limit_run,
    kind=LimitAnalysis,
    options=LimitOptions,
    fit=limits_of,
    combine=together,
    budget_of_run=budget_of_run,
    budget_of_all=budget_of_all,
    finding=Limits,
    base=LimitResult,
    entries=_entries,
    run_entries=_run_entries,
    renumber=_renumber,
    tables=limit_tables,
    part=limit_part,
    columns=limit_columns,
    row=LIMIT_ROW,
    symbols=symbols_of(QUANTITIES),
    compared=("mean",),
    apart=_apart,
)
