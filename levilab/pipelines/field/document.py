"""Scans of a field ↔ result.json."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from analysis.errors import AnalysisError
from analysis.field.fit import PARAMETERS, Known, Prior, Statistics, restore_scan
from analysis.field.floating import Floating, KnownTop
from analysis.field.magnet import Disc
from levilab.errors import DataError, unquoted
from levilab.files import finite
from levilab.formats.device import Device  # noqa: TC001 - pydantic reads it
from levilab.pipelines.field.analysis import (
    FIELD,
    NEEDS,
    FieldAnalysis,
    FieldRun,
    Mean,
    Origin,
    about_inputs,
    analyze_source,
)
from levilab.pipelines.field.device import FieldOptions
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
from levilab.pipelines.sources import Source, collect
from levilab.runs.run import find_run
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from analysis.uncertainty import Estimate
    from levilab.pipelines.field.readings import FieldReadings

#: The options that are of this analysis.
_OPTIONS = ("columns", "device", "height_m", "height_u_m", "free_radii")
#: Where a fit comes from that no result had.
_NONE_YET = "analyzed for this page: there was no result yet"
#: What a result has of the top, by the attributes of `KnownTop`.
_OF_TOP = ("transverse", "axial", "moment", "mass", "height")


# --- what is in it -------------------------------------------------------------------------------------


class StatisticsPart(Part):
    """How well the model fits; what does not compete has no criterion and no weight."""

    n: int = Field(ge=1)
    rms_residual: float = Field(ge=0)
    reduced_chi_square: float | None = Field(ge=0)
    aicc: None = None
    bic: None = None
    weight: None = None
    durbin_watson: float | None
    runs_test_p: float | None


class PriorPart(Part):
    """What was known before."""

    value: float
    u: float = Field(ge=0)


class FitPart(Part):
    """What it takes to draw the fit."""

    n_parameters: int = Field(ge=0)
    chi_square: float | None = Field(ge=0)
    degrees_of_freedom: int
    fitted: tuple[str, ...]
    known: dict[str, PriorPart]
    gain_u: float = Field(ge=0)


class ModelPart(Part):
    """The ring as fitted."""

    name: Literal["ring"]
    parameters: dict[str, Value]
    covariance: tuple[tuple[float, ...], ...]
    statistics: StatisticsPart
    fit: FitPart
    warnings: tuple[str, ...]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if set(self.parameters) != set(PARAMETERS) or any(one.value is None for one in self.parameters.values()):
            raise ValueError(f"the parameters {', '.join(PARAMETERS)} are expected, each with a value")
        if [len(line) for line in self.covariance] != [len(PARAMETERS)] * len(PARAMETERS):
            raise ValueError(f"the covariance is not {len(PARAMETERS)} × {len(PARAMETERS)}")
        if not {"inner_radius", "outer_radius"} <= set(self.fit.known):
            raise ValueError("the fit lacks what was known of the radii")
        return self


class TopPart(Part):
    """Of which top the windows are."""

    values: dict[str, Value]
    gravity_m_s2: float = Field(gt=0)
    magnet_radius_m: float | None = Field(gt=0)
    magnet_height_m: float | None = Field(ge=0)
    covariance: tuple[tuple[float, ...], ...] | None

    @model_validator(mode="after")
    def _has_inertias(self) -> Self:
        if not {"transverse", "axial"} <= set(self.values):
            raise ValueError("the top lacks its inertias")
        return self


class ScanPart(RunPart):
    """One scan."""

    models: tuple[ModelPart]
    top: TopPart
    floats: bool
    text: str


class SettingsPart(Part):
    """How the scans were analyzed."""

    columns: dict[str, str]
    device: Device | None
    height_m: float | None
    height_u_m: float | None
    free_radii: bool

    @property
    def options(self) -> FieldOptions:
        """The same as options."""
        return FieldOptions(
            columns=self.columns or None,
            device=self.device,
            height_m=self.height_m,
            height_u_m=self.height_u_m,
            free_radii=self.free_radii,
        )


class FieldResult(Result):
    """result.json of scans."""

    analysis: Literal["field"] = "field"
    settings: SettingsPart
    runs: tuple[ScanPart, ...]
    models: tuple[ModelPart, ...]
    text: str


# --- writing -------------------------------------------------------------------------------------------


def save_result(analysis: FieldAnalysis, folder: Path | None = None, *, first: bool = True) -> list[Path]:
    """Write the result and the figure beside the inputs, or into a folder; returns the files.  Raises CannotWrite.

    Args:
        analysis: what was found.
        folder: in the place of that of the inputs.
        first: whether this is the first analysis of the inputs, see `levilab.pipelines.catalogue.save`.
    """
    from levilab.pipelines.field.figure import field_figure
    from levilab.present.style import as_png

    place = replace(analysis.place, folder=folder or analysis.home)
    return save_files(result_of(analysis, place), place, as_png(field_figure(analysis)), first=first)


def as_document(analysis: FieldAnalysis, folder: Path) -> dict[str, Any]:
    """The content of result.json; paths in it are relative to the folder that it is for."""
    return result_of(analysis, Place(folder)).as_dict()


def result_of(analysis: FieldAnalysis, place: Place) -> FieldResult:
    """The result for a place."""
    sources = analysis.sources
    document = {
        "schema": SCHEMA,
        "analysis": FIELD,
        "inputs": [{"path": relative(source.data, place.folder), "sha256": source.sha256} for source in sources],
        "synthetic": any(source.synthetic for source in sources),
        "software": software_versions(),
        "settings": _settings(analysis.options),
        "values": _values(analysis.values),
        # of several scans there is no fit together: the scan's own stand with each
        "models": [_model(analysis.runs[0])] if len(analysis.runs) == 1 else [],
        "text": analysis.text,
        "runs": [_run(source, run, place.folder) for source, run in zip(sources, analysis.runs, strict=True)],
        "warnings": [unquoted(text) for text in analysis.all_warnings],
    }
    return FieldResult.model_validate(finite(document))


def _settings(options: FieldOptions) -> dict[str, Any]:
    return {
        "columns": dict(options.columns or {}),
        "device": options.device.model_dump(mode="json", exclude_unset=True) if options.device else None,
        "height_m": options.height_m,
        "height_u_m": options.height_u_m,
        "free_radii": options.free_radii,
    }


def _run(source: Source[FieldReadings], run: FieldRun, folder: Path) -> dict[str, Any]:
    return {
        "path": relative(source.path, folder),
        "synthetic": source.synthetic,
        "values": _values(run.values),
        "models": [_model(run)],
        "top": _top(run.top),
        "floats": run.floating is not None,
        "text": run.text,
        "warnings": [unquoted(text) for text in (*source.warnings, *run.warnings)],
    }


def _model(run: FieldRun) -> dict[str, Any]:
    scan, statistics = run.scan, run.scan.statistics
    known = {name: prior for name in PARAMETERS if (prior := scan.known.prior(name))}
    return {
        "name": "ring",
        "parameters": _values(scan.parameters),
        "covariance": scan.covariance.tolist(),
        "statistics": {
            name: getattr(statistics, name) for name in StatisticsPart.model_fields if hasattr(statistics, name)
        },
        "fit": {
            "n_parameters": statistics.n_parameters,
            "chi_square": statistics.chi_square,
            "degrees_of_freedom": statistics.degrees_of_freedom,
            "fitted": list(scan.fitted),
            "known": {name: {"value": prior.value, "u": prior.u} for name, prior in known.items()},
            "gain_u": scan.known.gain_u,
        },
        "warnings": [unquoted(text) for text in scan.warnings],
    }


def _top(top: KnownTop) -> dict[str, Any]:
    known = {name: estimate for name in _OF_TOP if (estimate := getattr(top, name)) is not None}
    return {
        "values": _values(known),
        "gravity_m_s2": top.gravity,
        "magnet_radius_m": top.magnet.radius if top.magnet else None,
        "magnet_height_m": top.magnet.height if top.magnet else None,
        "covariance": None if top.covariance is None else top.covariance.tolist(),
    }


def _values(estimates: Mapping[str, Estimate]) -> dict[str, Any]:
    return {name: _value(estimate) for name, estimate in estimates.items()}


def _value(estimate: Estimate) -> dict[str, Any]:
    value: dict[str, Any] = {"value": estimate.value, "u": estimate.u, "unit": estimate.unit}
    return value | ({"scatter": estimate.scatter, "runs": estimate.runs} if isinstance(estimate, Mean) else {})


# --- reading -------------------------------------------------------------------------------------------


def recall_scans(paths: Sequence[Path], options: FieldOptions) -> FieldAnalysis:
    """What `analyze` found at the paths, from its result.json; analyzed anew is only what has none that holds.

    A result holds as long as the readings are the same bytes, and it was made with the given options.  Options that are
    at their defaults are not given: those of the result then count, for what is analyzed anew, too.

    Raises DataError for what cannot be used, a damaged result.json included.
    """
    paths = [find_run(path) for path in paths]
    archive = Archive(paths, FieldResult)
    defaults = {one.name: one.default for one in fields(FieldOptions)}
    given = {name: value for name in _OPTIONS if (value := getattr(options, name)) != defaults[name]}

    def reading(path: Path) -> FieldOptions:
        earlier = archive.earlier(path, path)
        return replace(earlier.result.settings.options, **given) if earlier else options

    found = collect(paths, NEEDS, reading)
    recalled = [_recalled(source, archive, given) for source in found.sources]
    return FieldAnalysis(
        sources=tuple(source for source, _, _ in recalled),
        runs=tuple(run for _, run, _ in recalled),
        options=recalled[0][2].options,
        place=place_of(paths, found.sources),
        warnings=(*found.warnings, *about_inputs(found.sources, options)),
        remarks=found.remarks,
        origins=tuple(origin for _, _, origin in recalled),
    )


def _recalled(
    source: Source[FieldReadings], archive: Archive[FieldResult], given: Mapping[str, Any]
) -> tuple[Source[FieldReadings], FieldRun, Origin]:
    """One input: what was found of it, or its analysis."""
    if source.run:  # the columns of a run are known
        given = {name: value for name, value in given.items() if name != "columns"}
    earlier = archive.earlier(source.path, source.data, source.sha256)
    if earlier is None:
        options = FieldOptions(**given)
        return (
            source,
            analyze_source(source, options),
            Origin(options, _NONE_YET),
        )
    made_with = earlier.result.settings.options
    if earlier.sha256 == source.sha256 and _settings(replace(made_with, **given)) == _settings(made_with):
        return replace(source, warnings=()), _restored(earlier, source), _origin(earlier)
    options = replace(made_with, **given)
    why = "the readings are others than in" if earlier.sha256 != source.sha256 else "other options than those of"
    return source, analyze_source(source, options), Origin(options, f"analyzed for this page: {why} {earlier.file}")


def _origin(earlier: Earlier[FieldResult]) -> Origin:
    return Origin(earlier.result.settings.options, earlier.text)


def _restored(earlier: Earlier[FieldResult], source: Source[FieldReadings]) -> FieldRun:
    part, readings = earlier.result.runs[earlier.number], source.readings
    model = part.models[0]
    try:
        scan = restore_scan(
            readings.height,
            readings.flux_density,
            _known(model.fit),
            readings.u,
            0.0 if readings.height_u is None else readings.height_u,
            fitted=model.fit.fitted,
            parameters={name: model.parameters[name].estimate for name in PARAMETERS},
            covariance=np.array(model.covariance),
            statistics=_statistics(model),
            warnings=model.warnings,
        )
    except AnalysisError as error:
        raise DataError(f"{earlier.file}: does not go with {source.data}: {error}; {ANEW}") from error
    if not (np.isfinite(scan.residuals).all() and np.isfinite(scan.u).all() and (scan.u > 0).all()):
        raise DataError(f"{earlier.file}: its fit leaves the range of numbers at the readings of {source.data}: {ANEW}")
    values = {name: value.estimate for name, value in part.values.items() if name not in PARAMETERS}
    floating = Floating(values) if part.floats else None
    return FieldRun(scan, _known_top(part.top), floating, part.text, part.warnings)


def _known(fit: FitPart) -> Known:
    priors = {name: Prior(part.value, part.u) for name, part in fit.known.items() if name in PARAMETERS}
    return Known(**priors, gain_u=fit.gain_u)


def _statistics(model: ModelPart) -> Statistics:
    return Statistics(
        model.statistics.n,
        model.fit.n_parameters,
        model.statistics.rms_residual,
        model.fit.chi_square,
        model.fit.degrees_of_freedom,
        model.statistics.durbin_watson,
        model.statistics.runs_test_p,
    )


def _known_top(part: TopPart) -> KnownTop:
    known = {name: value.estimate for name, value in part.values.items() if name in _OF_TOP}
    magnet = Disc(part.magnet_radius_m, part.magnet_height_m or 0.0) if part.magnet_radius_m else None
    covariance = None if part.covariance is None else np.array(part.covariance)
    return KnownTop(
        known["transverse"], known["axial"], known.get("moment"), known.get("mass"), known.get("height"),
        part.gravity_m_s2, covariance, magnet,
    )  # fmt: skip


def moment_of(run: FieldRun) -> float:
    """The size of the moment that the windows are of [A m²]; NaN where none is known."""
    found = run.values.get("moment") or run.top.moment
    return math.nan if found is None or found.value is None else found.value
