"""Spin frequencies ↔ result.json."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from analysis.pulses import Finding, SpinFrequency
from analysis.uncertainty import Estimate
from levilab.pipelines.document import Document, Settings, values_of
from levilab.pipelines.result import Part, Result, RunPart, Value
from levilab.pipelines.row import find_all
from levilab.pipelines.spin.analysis import METHOD, Series, SpinAnalysis, SpinRun, UParts
from levilab.pipelines.spin.budget import budget_of_run
from levilab.pipelines.spin.quantities import CORRELATIONS, QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from levilab.pipelines.sources import Source
    from levilab.pipelines.spin.readings import Records

Method = Literal["edges", "matched", "likelihood"]

# --- what is in it -------------------------------------------------------------------------------------


class NotePart(Part):
    """A finding."""

    name: str
    text: str


class PhasePart(Part):
    """What the top did, and when."""

    kind: str
    start_s: float
    end_s: float


class SeriesPart(Part):
    """Frequency against time: a value for each window or record."""

    of: str
    time_s: tuple[float, ...] = Field(min_length=1)
    frequency_hz: tuple[float, ...]
    frequency_u_hz: tuple[float | None, ...]
    phases: tuple[PhasePart, ...]

    @model_validator(mode="after")
    def _columns_are_alike(self) -> Self:
        if not len(self.time_s) == len(self.frequency_hz) == len(self.frequency_u_hz):
            raise ValueError("the columns of a series have different lengths")
        return self


class SpinPart(RunPart):
    """One input."""

    method: Method
    pulses: int = Field(ge=0)
    missing: int = Field(ge=0)
    doubled: int = Field(ge=0)
    series: SeriesPart
    notes: tuple[NotePart, ...]
    u_parts: dict[str, UParts] = Field(default_factory=dict)
    code: float | None = None

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        needed = ("frequency", "chirp", "phase", "reference_time", "scatter")
        missing = [name for name in needed if name not in self.values or self.values[name].value is None]
        if missing:
            raise ValueError(f"a run lacks its {missing[0]}")
        return self


class SettingsPart(Settings):
    """How the records were analyzed."""

    channel: str | None
    rate: float | None = Field(gt=0, alias="rate_hz")
    method: Literal["auto", "edges", "matched", "likelihood"]
    clock_u: float | None = Field(default=None, gt=0)


class SpinResult(Result):
    """result.json of spin frequencies.

    Attributes:
        method: of the only input.
        models: none compete.
    """

    analysis: Literal["spin"] = "spin"
    settings: SettingsPart
    runs: tuple[SpinPart, ...]
    method: Method | None
    models: tuple[()] = ()


# --- writing -------------------------------------------------------------------------------------------


def _entries(analysis: SpinAnalysis) -> dict[str, Any]:
    one = analysis.runs[0].spin if len(analysis.runs) == 1 else None
    return {"values": values_of(find_all(QUANTITIES, one)) if one else {}, "method": one.method if one else None}


def _run_entries(_: Source[Records], run: SpinRun) -> dict[str, Any]:
    spin, series = run.spin, run.series
    return {
        "values": values_of(find_all(QUANTITIES, spin)),
        "method": spin.method,
        "pulses": int(spin.pulses),
        "missing": int(spin.missing),
        "doubled": int(spin.doubled),
        "series": {
            "of": series.of,
            "time_s": series.time.tolist(),
            "frequency_hz": series.frequency.tolist(),
            "frequency_u_hz": series.u.tolist(),
            "phases": [{"kind": kind, "start_s": start, "end_s": end} for kind, start, end in series.phases],
        },
        "notes": [{"name": note.name, "text": note.text} for note in run.notes],
        "u_parts": {name: asdict(parts) for name, parts in run.parts.items()},
        "code": run.code,
    }


# --- reading it back -----------------------------------------------------------------------------------


def _run(part: SpinPart, *_: object) -> SpinRun:
    values, notes = part.values, tuple(Finding(note.name, note.text) for note in part.notes)
    spin = SpinFrequency(
        frequency=values["frequency"].estimate,
        chirp=values["chirp"].estimate,
        phase=_estimate(values["phase"]),
        reference_time=_number(values["reference_time"]),
        method=part.method,
        bound=values["bound"].value if "bound" in values else None,
        pulses=part.pulses,
        missing=part.missing,
        doubled=part.doubled,
        scatter=_number(values["scatter"]),
        snr_db=values["snr"].value if "snr" in values else None,
        notes=notes,
        bend=values["bend"].estimate if "bend" in values else None,
        correlations=_correlations(values),
    )
    series = part.series
    columns = (series.time_s, series.frequency_hz, series.frequency_u_hz)
    time, frequency, u = (np.array(column, dtype=np.float64) for column in columns)
    phases = tuple((phase.kind, phase.start_s, phase.end_s) for phase in series.phases)
    order: tuple[str, ...] = ("frequency", "chirp")
    parts = {name: part.u_parts[name] for name in order if name in part.u_parts}
    return SpinRun(spin, Series(time, frequency, u, phases, series.of), notes, parts, part.code)


def _correlations(values: Mapping[str, Value]) -> tuple[float, float, float]:
    """Of result.json; 0 where it has none, as without a bend, and from earlier versions."""
    of_two, of_ends, of_last = ((values[name].value or 0.0) if name in values else 0.0 for name in CORRELATIONS)
    return of_two, of_ends, of_last


def _number(value: Value) -> float:
    assert value.value is not None  # as validated
    return value.value


def _estimate(value: Value) -> Estimate:
    return Estimate(value.value, value.u, "turns")


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run),
    result=SpinResult,
    entries=_entries,
    run_entries=_run_entries,
    run=_run,
)
