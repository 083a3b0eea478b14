"""Spin frequencies ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from levilab.pipelines.document import Document, Settings, number, value_of
from levilab.pipelines.dump import Dump
from levilab.pipelines.result import Result, RunPart
from levilab.pipelines.spin.analysis import METHOD, SpinAnalysis, SpinRun
from levilab.pipelines.spin.budget import budget_of_run

if TYPE_CHECKING:
    from analysis.pulses import SpinFrequency

#: With a bend: what the frequency at another time needs for its uncertainty.
_CORRELATIONS = ("correlation_frequency_chirp", "correlation_frequency_bend", "correlation_chirp_bend")


class SpinPart(RunPart):
    """One input."""

    result: Annotated[SpinRun, Dump()]


class SettingsPart(Settings):
    """How the records were analyzed."""

    channel: str | None
    rate: float | None = Field(gt=0, alias="rate_hz")
    method: Literal["auto", "edges", "matched", "likelihood"]
    clock_u: float | None = Field(default=None, gt=0)


class SpinResult(Result):
    """result.json of spin frequencies."""

    analysis: Literal["spin"] = "spin"
    settings: SettingsPart
    runs: tuple[SpinPart, ...]


def _entries(analysis: SpinAnalysis) -> dict[str, Any]:
    return _run_entries(analysis.runs[0]) if len(analysis.runs) == 1 else {"values": {}, "method": None}


def _run_entries(run: SpinRun) -> dict[str, Any]:
    return {"values": _values(run.spin), "method": run.spin.method}


def _values(spin: SpinFrequency) -> dict[str, Any]:
    values = {"frequency": value_of(spin.frequency), "chirp": value_of(spin.chirp)}
    values |= {
        "phase": number(spin.phase.value, "1", spin.phase.u),
        "reference_time": number(spin.reference_time, "s"),
        "bound": number(spin.bound, "Hz"),
        "scatter": number(spin.scatter, "s"),
        "snr": number(spin.snr_db, "dB"),
    }
    if spin.bend:
        correlations = zip(_CORRELATIONS, spin.correlations, strict=True)
        values |= {"bend": value_of(spin.bend)} | {name: number(value, "1") for name, value in correlations}
    return values


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run),
    result=SpinResult,
    entries=_entries,
    run_entries=_run_entries,
)
