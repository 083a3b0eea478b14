"""Sweeps ↔ result.json."""

from __future__ import annotations

from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from analysis.precession.coherence import Coherence  # noqa: TC001 - pydantic reads the types when it runs
from analysis.precession.sweep import SweepFit  # noqa: TC001 - as above
from levilab.errors import DataError, unquoted
from levilab.files import finite
from levilab.pipelines.precession.analysis import (
    NEEDS,
    PRECESSION,
    Origin,
    PointCoherence,
    PrecessionAnalysis,
    PrecessionOptions,
    PrecessionRun,
    about_inputs,
    combine,
    fit_source,
    intercept_of,
    slope_of,
    verdict,
)
from levilab.pipelines.result import (
    ANEW,
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
from levilab.pipelines.sources import Found, Source, collect
from levilab.runs.run import find_run
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from analysis.precession.line import Line
    from analysis.uncertainty import Estimate
    from levilab.pipelines.precession.readings import Readings

#: Attribute of SweepFit.power → name and unit of the value.
_POWER_VALUES = {
    "now": ("power", "1"),
    "smallest_difference": ("smallest_slope_difference", "1"),
    "points_needed": ("points_needed", "1"),
    "range_needed_hz": ("range_needed", "Hz"),
    "u_needed_hz": ("u_needed", "Hz"),
}


# --- what is in it -------------------------------------------------------------------------------------


class StatisticsPart(Part):
    """How well a line fits."""

    n: int = Field(ge=3)
    rms_residual: float = Field(ge=0)
    reduced_chi_square: float | None = Field(ge=0)
    p_fit: float | None = Field(ge=0, le=1)


class CentredPart(Part):
    """A line about the weighted mean of ν_d, where slope and height are uncorrelated."""

    centre: Value
    height: Value
    covariance: tuple[tuple[float | None, ...], ...] | None


class ModelPart(Part):
    """A line.  covariance: of slope and intercept."""

    name: Literal["weighted", "orthogonal", "robust"]
    parameters: dict[str, Value]
    covariance: tuple[tuple[float | None, ...], ...] | None
    centred: CentredPart | None
    statistics: StatisticsPart


class _WithLine(Part):
    """What stands at the top of a result and with each of its runs.  fit: all of it, as the analysis made it."""

    models: tuple[ModelPart, ...]
    verdict: str
    fit: SweepFit | None


class CoherencePart(Part):
    """How firmly the laser's pulses follow the drive at a point."""

    point: int = Field(ge=0)
    coherence: Coherence


class PrecessionPart(RunPart, _WithLine):
    """One sweep."""

    fit: SweepFit
    coherences: tuple[CoherencePart, ...]
    record_warnings: tuple[str, ...]


class SettingsPart(Part):
    """How the points were analyzed."""

    columns: dict[str, str]
    reading_u_hz: float | None = Field(gt=0)
    orthogonal: bool
    keep_outliers: bool

    @property
    def options(self) -> PrecessionOptions:
        """The same as options."""
        return PrecessionOptions(
            columns=self.columns or None,
            reading_u=self.reading_u_hz,
            keep_outliers=self.keep_outliers,
            orthogonal=self.orthogonal,
        )


class PrecessionResult(Result, _WithLine):
    """result.json of sweeps.  fit: None for one input, it is then that run's."""

    analysis: Literal["precession"] = "precession"
    settings: SettingsPart
    runs: tuple[PrecessionPart, ...]


# --- writing -------------------------------------------------------------------------------------------


def save_result(analysis: PrecessionAnalysis, folder: Path | None = None, *, first: bool = True) -> list[Path]:
    """Write the result and the figure beside the inputs, or into a folder; returns the files.  Raises CannotWrite.

    Args:
        analysis: what was found.
        folder: in the place of that of the inputs.
        first: whether this is the first analysis of the inputs, see `levilab.pipelines.catalogue.save`.
    """
    from levilab.pipelines.precession.figure import precession_figure
    from levilab.present.style import as_png

    place = replace(analysis.place, folder=folder or analysis.home)
    return save_files(result_of(analysis, place), place, as_png(precession_figure(analysis)), first=first)


def as_document(analysis: PrecessionAnalysis, folder: Path) -> dict[str, Any]:
    """The content of result.json; paths in it are relative to the folder that it is for."""
    return result_of(analysis, Place(folder)).as_dict()


def result_of(analysis: PrecessionAnalysis, place: Place) -> PrecessionResult:
    """The result for a place."""
    sources, several = analysis.sources, len(analysis.runs) > 1
    document = {
        "schema": SCHEMA,
        "analysis": PRECESSION,
        "inputs": [{"path": relative(source.data, place.folder), "sha256": source.sha256} for source in sources],
        "synthetic": any(source.synthetic for source in sources),
        "software": software_versions(),
        "settings": _settings(analysis.options),
        "runs": [_run(source, run, place.folder) for source, run in zip(sources, analysis.runs, strict=True)],
        "warnings": [unquoted(text) for text in analysis.all_warnings],
    }
    document |= _about(analysis.combined) | ({} if several else {"fit": None})
    return PrecessionResult.model_validate(finite(document))


def _settings(options: PrecessionOptions) -> dict[str, Any]:
    return {
        "columns": dict(options.columns or {}),
        "reading_u_hz": options.reading_u,
        "orthogonal": options.orthogonal,
        "keep_outliers": options.keep_outliers,
    }


def _run(source: Source[Readings], run: PrecessionRun, folder: Path) -> dict[str, Any]:
    return {
        "path": relative(source.path, folder),
        "synthetic": source.synthetic,
        "coherences": [asdict(one) for one in run.coherences],
        "record_warnings": [unquoted(text) for text in run.warnings],
        "warnings": [unquoted(text) for text in (*source.warnings, *run.fit.warnings, *run.warnings)],
    } | _about(run.fit)


def _about(fit: SweepFit) -> dict[str, Any]:
    """What a fit says, for people and programs; then all of it."""
    return {"values": _values(fit), "models": [_line(fit), _robust(fit)], "verdict": verdict(fit), "fit": asdict(fit)}


def _values(fit: SweepFit) -> dict[str, Any]:
    values = {
        "slope": _value(slope_of(fit)),
        "intercept": _value(intercept_of(fit)),
        "p_locked": {"value": fit.p_locked, "u": None, "unit": "1"},
        "robust_slope": _value(fit.robust.slope),
        "robust_intercept": _value(fit.robust.intercept),
    }
    if fit.spin_offset is not None:
        values["spin_offset"] = {"value": fit.spin_offset, "u": fit.u_spin_offset, "unit": "Hz"}
    if fit.power:
        values |= {
            name: {"value": getattr(fit.power, key), "u": None, "unit": unit}
            for key, (name, unit) in _POWER_VALUES.items()
        }
    return values


def _value(estimate: Estimate) -> dict[str, Any]:
    value: dict[str, Any] = {"value": estimate.value, "u": estimate.u, "unit": estimate.unit}
    return value | ({"interval_68": list(estimate.interval)} if estimate.interval else {})


def _line(fit: SweepFit) -> dict[str, Any]:
    line = fit.line
    return {
        "name": "orthogonal" if line.orthogonal else "weighted",
        "parameters": {"slope": _value(slope_of(fit)), "intercept": _value(intercept_of(fit))},
        "covariance": _covariance(line.u_slope, line.u_intercept, line.correlation),
        "centred": {
            "centre": {"value": line.centre, "u": None, "unit": "Hz"},
            "height": {"value": line.height, "u": line.u_height, "unit": "Hz"},
            "covariance": _covariance(line.u_slope, line.u_height, 0.0),
        },
        "statistics": _statistics(fit, fit.column("residual"), line),
    }


def _robust(fit: SweepFit) -> dict[str, Any]:
    slope, intercept = fit.robust.slope, fit.robust.intercept
    left = fit.column("precession") - float(intercept.value or 0.0) - float(slope.value or 0.0) * fit.column("drive")
    return {
        "name": "robust",
        "parameters": {"slope": _value(slope), "intercept": _value(intercept)},
        "covariance": None,
        "centred": None,
        "statistics": _statistics(fit, left, None),
    }


def _statistics(fit: SweepFit, residual: np.ndarray, line: Line | None) -> dict[str, Any]:
    """line: None for the median line, which goes through all points."""
    if line:
        residual = residual[[point.used for point in fit.points]]
    chi_square = line.chi_square if line else None
    return {
        "n": residual.size,
        "rms_residual": float(np.sqrt(np.mean(residual**2))),
        "reduced_chi_square": None if line is None or chi_square is None else chi_square / line.degrees_of_freedom,
        "p_fit": line.p_fit if line else None,
    }


def _covariance(u: float | None, v: float | None, correlation: float | None) -> list[list[float]] | None:
    if u is None or v is None or correlation is None:
        return None
    return [[u * u, correlation * u * v], [correlation * u * v, v * v]]


# --- reading -------------------------------------------------------------------------------------------


def recall_precessions(paths: Sequence[Path], options: PrecessionOptions) -> PrecessionAnalysis:
    """What `analyze` found at the paths, from its result.json; analyzed anew is only what has none that holds.

    See `levilab.pipelines.spindown.document.recall_spindowns` for when a result holds.
    Raises DataError for what cannot be used, a damaged result.json included.
    """
    paths = [find_run(path) for path in paths]
    archive = Archive(paths, PrecessionResult)
    given = {
        f.name: getattr(options, f.name) for f in fields(PrecessionOptions) if getattr(options, f.name) != f.default
    }

    def reading(path: Path) -> PrecessionOptions:
        earlier = archive.earlier(path, path)
        return replace(earlier.result.settings.options, **given) if earlier else options

    found = collect(paths, NEEDS, reading)
    place = place_of(paths, found.sources)
    if all(source.run for source in found.sources):
        given.pop("columns", None)
    whole = archive.whole(found.sources)
    if whole and _holds(whole[1].settings.options, given):
        return _restored(whole[1], whole[0], found, place)
    recalled = [_recalled(source, archive, given) for source in found.sources]
    sources, runs, origins = (tuple(part) for part in zip(*recalled, strict=True))
    return PrecessionAnalysis(
        sources=sources,
        runs=runs,
        combined=combine(runs, options),
        options=options,
        place=place,
        warnings=(*found.warnings, *about_inputs(sources, options)),
        remarks=found.remarks,
        origins=origins,
    )


def _holds(made_with: PrecessionOptions, given: Mapping[str, Any]) -> bool:
    return _settings(replace(made_with, **given)) == _settings(made_with)


def _recalled(
    source: Source[Readings], archive: Archive[PrecessionResult], given: Mapping[str, Any]
) -> tuple[Source[Readings], PrecessionRun, Origin]:
    """One input: what was found of it, or its fit."""
    if source.run:  # the columns of a run are known
        given = {name: value for name, value in given.items() if name != "columns"}
    earlier = archive.earlier(source.path, source.data, source.sha256)
    if earlier is None:
        options = PrecessionOptions(**given)
        return source, fit_source(source, options), Origin(options, "analyzed for this page: there was no result yet")
    made_with = earlier.result.settings.options
    if earlier.sha256 == source.sha256 and _holds(made_with, given):
        return source, _run_of(earlier.result.runs[earlier.number], source, earlier.file), _origin(earlier)
    options = replace(made_with, **given)
    why = "the points are others than in" if earlier.sha256 != source.sha256 else "other options than those of"
    return source, fit_source(source, options), Origin(options, f"analyzed for this page: {why} {earlier.file}")


def _origin(earlier: Earlier[PrecessionResult]) -> Origin:
    return Origin(earlier.result.settings.options, earlier.text)


def _restored(result: PrecessionResult, file: Path, found: Found[Readings], place: Place) -> PrecessionAnalysis:
    """All of it as it was found."""
    numbers = {given.sha256: k for k, given in enumerate(result.inputs)}
    order = [numbers[source.sha256] for source in found.sources]
    runs = tuple(_run_of(result.runs[k], source, file) for k, source in zip(order, found.sources, strict=True))
    if result.fit is None and len(runs) > 1:
        raise DataError(f"{file}: lacks the fit of all points together: {ANEW}")
    return PrecessionAnalysis(
        sources=found.sources,
        runs=runs,
        combined=result.fit or runs[0].fit,
        options=result.settings.options,
        place=place,
        warnings=found.warnings,
        remarks=found.remarks,
        origins=tuple(_origin(Earlier(file, result, k)) for k in order),
    )


def _run_of(part: PrecessionPart, source: Source[Readings], file: Path) -> PrecessionRun:
    """One run as it was found.  Raises DataError where it is not of these points."""
    seen = (part.fit.column("drive"), part.fit.column("precession"))
    if not all(
        len(a) == len(b) and np.allclose(a, b, rtol=1e-9, atol=0)
        for a, b in zip(seen, (source.readings.drive, source.readings.precession), strict=True)
    ):
        raise DataError(f"{file}: its points are not those of {source.data}: {ANEW}")
    coherences = tuple(PointCoherence(one.point, one.coherence) for one in part.coherences)
    return PrecessionRun(part.fit, coherences, part.record_warnings)
