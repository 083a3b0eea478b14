"""Spin frequencies ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field

from levilab.pipelines.document import Document, Settings, values_of
from levilab.pipelines.dump import Dump
from levilab.pipelines.options import Method  # noqa: TC001 - pydantic reads the type when it runs
from levilab.pipelines.result import Result, RunPart
from levilab.pipelines.row import find_all
from levilab.pipelines.spin.analysis import METHOD, SpinAnalysis, SpinRun
from levilab.pipelines.spin.budget import budget_of_run
from levilab.pipelines.spin.quantities import OF_A_RUN, QUANTITIES


class SpinPart(RunPart):
    """One input."""

    result: Annotated[SpinRun, Dump()]


class SettingsPart(Settings):
    """How the records were analyzed."""

    channel: str | None
    rate: float | None = Field(gt=0, alias="rate_hz")
    method: Method
    clock_u: float | None = Field(default=None, gt=0)
    near: float | None = Field(default=None, gt=0, alias="near_hz")
    drive: float | None = Field(default=None, gt=0, alias="drive_hz")
    distance_m: float | None = Field(default=None, gt=0)
    distance_u_m: float | None = Field(default=None, gt=0)
    below_m: float | None = None
    moment_a_m2: float | None = Field(default=None, gt=0)


class SpinResult(Result):
    """result.json of spin frequencies."""

    analysis: Literal["spin"] = "spin"
    settings: SettingsPart
    runs: tuple[SpinPart, ...]


def _entries(analysis: SpinAnalysis) -> dict[str, Any]:
    return _run_entries(analysis.runs[0]) if len(analysis.runs) == 1 else {"values": {}, "method": None}


def _run_entries(run: SpinRun) -> dict[str, Any]:
    found = find_all(QUANTITIES, run.spin) | find_all(OF_A_RUN, run)
    return {"values": values_of(found), "method": run.spin.method}


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run),
    result=SpinResult,
    entries=_entries,
    run_entries=_run_entries,
)
