"""Spin frequencies ↔ result.json."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from analysis.pulses import Finding, SpinFrequency
from analysis.uncertainty import Estimate
from levilab.errors import unquoted
from levilab.files import finite
from levilab.pipelines.result import (
    SCHEMA,
    Archive,
    Earlier,
    Part,
    Place,
    Result,
    RunPart,
    Value,
    place_of,
    relative,
)
from levilab.pipelines.result import save as save_files
from levilab.pipelines.sources import Source, collect
from levilab.pipelines.spin.analysis import (
    NEEDS,
    SPIN,
    Origin,
    Series,
    SpinAnalysis,
    SpinOptions,
    SpinRun,
    about_inputs,
    of_each,
    spin_of_source,
)
from levilab.runs.run import find_run
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

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


#: Values that a run has, and their units.
_VALUES = {
    "frequency": "Hz", "chirp": "Hz/s", "phase": "1", "reference_time": "s", "bound": "Hz", "scatter": "s", "snr": "dB",
}  # fmt: skip


class SpinPart(RunPart):
    """One input."""

    method: Method
    pulses: int = Field(ge=0)
    missing: int = Field(ge=0)
    doubled: int = Field(ge=0)
    series: SeriesPart
    notes: tuple[NotePart, ...]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        needed = ("frequency", "chirp", "phase", "reference_time", "scatter")
        missing = [name for name in needed if name not in self.values or self.values[name].value is None]
        if missing:
            raise ValueError(f"a run lacks its {missing[0]}")
        return self


class SettingsPart(Part):
    """How the records were analyzed."""

    columns: dict[str, str]
    channel: str | None
    rate_hz: float | None = Field(gt=0)
    method: Literal["auto", "edges", "matched", "likelihood"]

    @property
    def options(self) -> SpinOptions:
        """The same as options."""
        return SpinOptions(columns=self.columns or None, channel=self.channel, rate=self.rate_hz, method=self.method)


class SpinResult(Result):
    """result.json of spin frequencies.  method: of the only input; models: none compete."""

    analysis: Literal["spin"] = "spin"
    settings: SettingsPart
    runs: tuple[SpinPart, ...]
    method: Method | None
    models: tuple[()] = ()


# --- writing -------------------------------------------------------------------------------------------


def save_result(analysis: SpinAnalysis, folder: Path | None = None, *, first: bool = True) -> list[Path]:
    """Write the result and the figure beside the inputs, or into a folder; returns the files.  Raises CannotWrite.

    Args:
        analysis: what was found.
        folder: in the place of that of the inputs.
        first: whether this is the first analysis of the inputs, see `levilab.pipelines.catalogue.save`.
    """
    from levilab.pipelines.spin.figure import spin_figure
    from levilab.present.style import as_png

    place = replace(analysis.place, folder=folder or analysis.home)
    return save_files(result_of(analysis, place), place, as_png(spin_figure(analysis)), first=first)


def as_document(analysis: SpinAnalysis, folder: Path) -> dict[str, Any]:
    """The content of result.json; paths in it are relative to the folder that it is for."""
    return result_of(analysis, Place(folder)).as_dict()


def result_of(analysis: SpinAnalysis, place: Place) -> SpinResult:
    """The result for a place."""
    sources, runs = analysis.sources, analysis.runs
    one = runs[0] if len(runs) == 1 else None
    document = {
        "schema": SCHEMA,
        "analysis": SPIN,
        "inputs": [{"path": relative(source.data, place.folder), "sha256": source.sha256} for source in sources],
        "synthetic": any(source.synthetic for source in sources),
        "software": software_versions(),
        "settings": _settings(analysis.options),
        "values": _values(one.spin) if one else {},
        "method": one.spin.method if one else None,
        "models": [],
        "runs": [_run(source, run, place.folder) for source, run in zip(sources, runs, strict=True)],
        "warnings": [unquoted(text) for text in analysis.all_warnings],
    }
    return SpinResult.model_validate(finite(document))


def _settings(options: SpinOptions) -> dict[str, Any]:
    return {
        "columns": dict(options.columns or {}),
        "channel": options.channel,
        "rate_hz": options.rate,
        "method": options.method,
    }


def _values(spin: SpinFrequency) -> dict[str, Any]:
    plain = {"reference_time": spin.reference_time, "bound": spin.bound, "scatter": spin.scatter, "snr": spin.snr_db}
    estimates = {"frequency": spin.frequency, "chirp": spin.chirp, "phase": spin.phase}
    values = {name: {"value": one.value, "u": one.u, "unit": _VALUES[name]} for name, one in estimates.items()}
    return values | {name: {"value": value, "u": None, "unit": _VALUES[name]} for name, value in plain.items()}


def _run(source: Source[Records], run: SpinRun, folder: Path) -> dict[str, Any]:
    spin, series = run.spin, run.series
    return {
        "path": relative(source.path, folder),
        "synthetic": source.synthetic,
        "values": _values(spin),
        "method": spin.method,
        "models": [],
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
        "warnings": [unquoted(text) for text in source.warnings],
    }


# --- reading it back -----------------------------------------------------------------------------------


def recall_spins(paths: Sequence[Path], options: SpinOptions) -> SpinAnalysis:
    """What `analyze` found at the paths, from its result.json; analyzed anew is only what has none that holds.

    As of `levilab.pipelines.spindown.document.recall_spindowns`: the same bytes, and the given options.

    Raises DataError for what cannot be used, a damaged result.json included.
    """
    paths = [find_run(path) for path in paths]
    archive = Archive(paths, SpinResult)
    given = {f.name: getattr(options, f.name) for f in fields(SpinOptions) if getattr(options, f.name) != f.default}

    def reading(path: Path) -> SpinOptions:
        earlier = archive.earlier(path, path)
        return replace(earlier.result.settings.options, **given) if earlier else options

    found = collect(paths, NEEDS, reading)
    recalled, warnings = of_each(found.sources, lambda source: _recalled(source, archive, given))
    sources = tuple(source for source, _, _ in recalled)
    return SpinAnalysis(
        sources=sources,
        runs=tuple(run for _, run, _ in recalled),
        options=options,
        place=place_of(paths, sources),
        warnings=(*found.warnings, *warnings, *about_inputs(sources, options)),
        remarks=found.remarks,
        origins=tuple(origin for _, _, origin in recalled),
    )


def _recalled(
    source: Source[Records], archive: Archive[SpinResult], given: Mapping[str, Any]
) -> tuple[Source[Records], SpinRun, Origin]:
    """One input: what was found of it, or its analysis."""
    earlier = archive.earlier(source.path, source.data, source.sha256)
    if earlier is None:
        options = SpinOptions(**given)
        origin = Origin(options, "analyzed for this page: there was no result yet")
        return source, spin_of_source(source, options), origin
    made_with = earlier.result.settings.options
    options = replace(made_with, **given)
    if earlier.sha256 == source.sha256 and _settings(options) == _settings(made_with):
        return source, _restored(earlier), _origin(earlier)
    why = "the record is another than in" if earlier.sha256 != source.sha256 else "other options than those of"
    origin = Origin(options, f"analyzed for this page: {why} {earlier.file}")
    return source, spin_of_source(source, options), origin


def _origin(earlier: Earlier[SpinResult]) -> Origin:
    return Origin(earlier.result.settings.options, earlier.text)


def _restored(earlier: Earlier[SpinResult]) -> SpinRun:
    part = earlier.result.runs[earlier.number]
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
    )
    series = part.series
    columns = (
        np.array(column, dtype=np.float64) for column in (series.time_s, series.frequency_hz, series.frequency_u_hz)
    )
    told = tuple((phase.kind, phase.start_s, phase.end_s) for phase in series.phases)
    time, frequency, u = (np.array(column, dtype=np.float64) for column in columns)
    return SpinRun(spin, Series(time, frequency, u, told, series.of), notes)


def _number(value: Value) -> float:
    assert value.value is not None  # as validated
    return value.value


def _estimate(value: Value) -> Estimate:
    return Estimate(value.value, value.u, "turns")
