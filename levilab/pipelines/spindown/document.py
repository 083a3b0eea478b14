"""Spin-downs ↔ result.json."""

from __future__ import annotations

from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from analysis.residuals import Correlation
from analysis.spindown.combine import Combined, CombinedLaw, Mean, combine, tilt_demanded
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import SpinDown
from analysis.spindown.lawfit import LawFit
from analysis.spindown.selection import Statistics
from analysis.spindown.tilt import PARAMETERS, counted
from analysis.spindown.verdict import Verdict
from levilab.errors import DataError, unquoted
from levilab.files import finite
from levilab.formats.table import FEWEST
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
from levilab.pipelines.spindown.analysis import (
    NEEDS,
    SPINDOWN,
    Origin,
    SpinDownAnalysis,
    SpinDownOptions,
    about_inputs,
    fit_source,
)
from levilab.pipelines.spindown.laws import SHOWN_LAWS
from levilab.pipelines.spindown.readings import EARLIEST_S, HIGHEST_HZ, SLOWEST_HZ
from levilab.runs.run import find_run
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from analysis.uncertainty import Estimate
    from levilab.pipelines.spindown.readings import Readings


# --- what is in it -------------------------------------------------------------------------------------


class StatisticsPart(Part):
    """How well a law fits; see `analysis.spindown.selection.Statistics`."""

    n: int = Field(ge=1)
    rms_residual: float = Field(ge=0)
    reduced_chi_square: float | None = Field(ge=0)
    aicc: float | None
    bic: float | None
    weight: float | None
    durbin_watson: float | None
    runs_test_p: float | None
    difference: float | None
    n_effective: float | None = None


class CorrelationPart(Part):
    """How much the noise of neighbouring readings is alike; see `analysis.residuals.Correlation`."""

    value: float
    u: float
    p: float
    p_shape: float


class FitPart(Part):
    """What it takes to draw and to combine a fit.

    solution: in the dimensionless numbers of `analysis.spindown.drag`.
    """

    n_parameters: int = Field(ge=1)
    rss: float = Field(ge=0)
    chi_square: float | None = Field(ge=0)
    misfit: float
    solution: tuple[float, ...] | None = None


class ModelPart(Part):
    """One drag law, fitted to one run or, without a start, over several."""

    name: str
    parameters: dict[str, Value]
    covariance: tuple[tuple[float | None, ...], ...] | None
    statistics: StatisticsPart
    fit: FitPart
    warnings: tuple[str, ...]
    linearised: dict[str, Value] | None = None
    scatter: dict[str, float | None] | None = None

    @model_validator(mode="after")
    def _is_a_law(self) -> Self:
        law = LAWS.get(self.name)
        if law is None:
            raise ValueError(f"{self.name!r} is no drag law; known are {', '.join(LAWS)}")
        if not set(law.constants) <= set(self.parameters):
            raise ValueError(f"{self.name} lacks one of its constants {', '.join(law.constants)}")
        size = len(law.parameters) + (len(PARAMETERS) if set(PARAMETERS) <= set(self.parameters) else 0)
        if self.covariance is not None and [len(row) for row in self.covariance] != [size] * size:
            raise ValueError(f"{self.name}: its covariance is not {size} × {size}")
        lines = set(law.constants) if SHOWN_LAWS[self.name].straight else set()
        if set(self.linearised or ()) != lines:
            seen, expected = (", ".join(names) or "nothing" for names in (self.linearised or (), lines))
            raise ValueError(f"{self.name}: linearised has {seen}, expected {expected}")
        return self


class ExcludedPart(Part):
    """A law that the readings exclude, and why."""

    name: str
    reason: str


class StandingPart(Part):
    """The laws by what the readings say about them; see `analysis.spindown.verdict.Verdict`."""

    tied: tuple[str, ...]
    needless: tuple[str, ...]
    weak: tuple[str, ...]
    excluded: tuple[ExcludedPart, ...]

    @model_validator(mode="after")
    def _names_are_known(self) -> Self:
        for name in (*self.tied, *self.needless, *self.weak, *(one.name for one in self.excluded)):
            if name not in LAWS:
                raise ValueError(f"{name!r} is no drag law; known are {', '.join(LAWS)}")
        return self


class OutlierPart(Part):
    """A reading that does not belong to the others."""

    index: int = Field(ge=0)
    time_s: float
    spin_frequency_hz: float


class ReferencePart(Part):
    """The units of the dimensionless solutions of a run."""

    frequency_hz: float = Field(ge=SLOWEST_HZ / 2, le=2 * HIGHEST_HZ)
    time_s: float = Field(ge=1e-30, le=3 * EARLIEST_S)


class _WithLaws(Part):
    """What stands at the top of a result and with each of its runs."""

    models: tuple[ModelPart, ...]
    best_model: str
    verdict: str
    decided: bool
    standing: StandingPart
    describes: bool = True
    correlation: CorrelationPart | None = None

    @model_validator(mode="after")
    def _laws_are_there(self) -> Self:
        names = [model.name for model in self.models]
        if names != list(LAWS):
            raise ValueError(f"the models are {', '.join(names)}, expected {', '.join(LAWS)}")
        if self.best_model not in names:
            raise ValueError(f"best_model {self.best_model!r} is not among the models")
        return self


class SpinDownPart(RunPart, _WithLaws):
    """One spin-down."""

    reference: ReferencePart
    outliers: tuple[OutlierPart, ...]
    tilt_gain: float | None = None

    @property
    def start_time(self) -> float:
        """Time of the first reading [s]."""
        start = self.values["start_time"].value
        assert start is not None  # as validated
        return start

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if "start_time" not in self.values or self.values["start_time"].value is None:
            raise ValueError("a run lacks its start time")
        for model in self.models:
            tilt = len(PARAMETERS) if set(PARAMETERS) <= set(model.parameters) else 0
            if len(model.fit.solution or ()) != len(LAWS[model.name].parameters) + tilt:
                raise ValueError(f"{model.name}: its solution is missing or of another law")
            if not set(LAWS[model.name].parameters) <= set(model.parameters):
                raise ValueError(f"{model.name} lacks its start frequency")
        return self


class BootstrapPart(Part):
    """How the bootstrap drew."""

    samples: int = Field(ge=1)
    seed: int = Field(ge=0)


class SettingsPart(Part):
    """How the readings were analyzed."""

    columns: dict[str, str]
    channel: str | None = None
    rate_hz: float | None = Field(default=None, gt=0)
    reading_u_hz: float | None = Field(gt=0)
    uncertainty: Literal["covariance", "profile", "bootstrap"]
    keep_outliers: bool
    bootstrap: BootstrapPart | None

    @property
    def options(self) -> SpinDownOptions:
        """The same as options."""
        drawn: dict[str, Any] = (
            {"bootstrap_samples": self.bootstrap.samples, "seed": self.bootstrap.seed} if self.bootstrap else {}
        )
        return SpinDownOptions(
            columns=self.columns or None,
            channel=self.channel,
            rate=self.rate_hz,
            reading_u=self.reading_u_hz,
            uncertainty=self.uncertainty,
            keep_outliers=self.keep_outliers,
            **drawn,
        )


class SpinDownResult(Result, _WithLaws):
    """result.json of spin-downs."""

    analysis: Literal["spindown"] = "spindown"
    settings: SettingsPart
    runs: tuple[SpinDownPart, ...]


# --- writing -------------------------------------------------------------------------------------------


def save_result(analysis: SpinDownAnalysis, folder: Path | None = None, *, first: bool = True) -> list[Path]:
    """Write the result and the figure beside the inputs, or into a folder; returns the files.  Raises CannotWrite.

    Args:
        analysis: what was found.
        folder: in the place of that of the inputs.
        first: whether this is the first analysis of the inputs, see `levilab.pipelines.catalogue.save`.
    """
    from levilab.pipelines.spindown.figure import spindown_figure
    from levilab.present.style import as_png

    place = replace(analysis.place, folder=folder or analysis.home)
    return save_files(result_of(analysis, place), place, as_png(spindown_figure(analysis)), first=first)


def as_document(analysis: SpinDownAnalysis, folder: Path) -> dict[str, Any]:
    """The content of result.json; paths in it are relative to the folder that it is for."""
    return result_of(analysis, Place(folder)).as_dict()


def result_of(analysis: SpinDownAnalysis, place: Place) -> SpinDownResult:
    """The result for a place."""
    combined, sources = analysis.combined, analysis.sources
    document = {
        "schema": SCHEMA,
        "analysis": SPINDOWN,
        "inputs": [{"path": relative(source.data, place.folder), "sha256": source.sha256} for source in sources],
        "synthetic": any(source.synthetic for source in sources),
        "software": software_versions(),
        "settings": _settings(analysis.options),
        "values": _combined_values(analysis),
        "models": _combined_models(analysis),
        "runs": [_run(analysis, k, place.folder) for k in range(len(sources))],
        "warnings": [unquoted(text) for text in analysis.all_warnings],
    }
    said = _verdict(combined.best, combined.verdict, combined.correlation)
    return SpinDownResult.model_validate(finite(document | said))


def _settings(options: SpinDownOptions) -> dict[str, Any]:
    drawn = {"samples": options.bootstrap_samples, "seed": options.seed}
    return {
        "columns": dict(options.columns or {}),
        "channel": options.channel,
        "rate_hz": options.rate,
        "reading_u_hz": options.reading_u,
        "uncertainty": options.uncertainty,
        "keep_outliers": options.keep_outliers,
        "bootstrap": drawn if options.uncertainty == "bootstrap" else None,
    }


def _verdict(best: str, verdict: Verdict, correlation: Correlation | None) -> dict[str, Any]:
    return {
        "best_model": best,
        "verdict": verdict.text,
        "decided": verdict.decided,
        "describes": verdict.describes,
        "correlation": None if correlation is None else asdict(correlation),
        "standing": {
            "tied": list(verdict.indistinguishable),
            "needless": list(verdict.needless),
            "weak": list(verdict.weak),
            "excluded": [{"name": name, "reason": reason} for name, reason in verdict.excluded],
        },
    }


def _combined_values(analysis: SpinDownAnalysis) -> dict[str, Any]:
    """The favoured law's constants, and by how much they differ from run to run."""
    best = analysis.combined.fit(analysis.combined.best)
    scatter = {
        f"{name}_scatter": {"value": mean.scatter, "u": None, "unit": mean.unit, "runs": mean.degrees_of_freedom + 1}
        for name, mean in best.constants.items()
        if mean.scatter is not None
    }
    tilt = {"moment_tilt": _value(analysis.combined.tilt)} if analysis.combined.tilt else {}
    return _values(best.constants) | scatter | tilt | _residual_correlation(analysis.combined.correlation)


def _residual_correlation(found: Correlation | None) -> dict[str, Any]:
    return {"residual_correlation": {"value": found.value, "u": found.u, "unit": "1"}} if found else {}


def _combined_models(analysis: SpinDownAnalysis) -> list[dict[str, Any]]:
    """Each law over all runs; of one run that is the run's own fit, start and covariance included."""
    if len(analysis.runs) == 1:
        return [_model(fit) for fit in analysis.runs[0].fits]
    return [
        {
            "name": fit.name,
            "parameters": _values(fit.constants),
            "covariance": None,
            "scatter": {name: mean.scatter for name, mean in fit.constants.items()},
            "statistics": _some(fit.statistics, StatisticsPart),
            "fit": _some(fit.statistics, FitPart),
            "warnings": list(fit.warnings),
        }
        | ({"linearised": _values(fit.linearised)} if fit.linearised else {})
        for fit in analysis.combined.fits
    ]


def _model(fit: LawFit) -> dict[str, Any]:
    """One law fitted to one run."""
    return {
        "name": fit.name,
        "parameters": _values(fit.parameters),
        "covariance": None if fit.covariance is None else fit.covariance.tolist(),
        "statistics": _some(fit.statistics, StatisticsPart),
        "fit": _some(fit.statistics, FitPart) | {"solution": fit.solution.tolist()},
        "warnings": list(fit.warnings),
    } | ({"linearised": _values(fit.linearised)} if fit.linearised else {})


def _run(analysis: SpinDownAnalysis, k: int, folder: Path) -> dict[str, Any]:
    source, run = analysis.sources[k], analysis.runs[k]
    frequency, duration = run.fits[0].reference
    return {
        "path": relative(source.path, folder),
        "synthetic": source.synthetic,
        "values": {
            "start_time": {"value": run.start_time, "u": None, "unit": "s"},
            "duration": {"value": float(run.time[-1] - run.time[0]), "u": None, "unit": "s"},
        }
        | _values(run.fit(run.best).parameters)
        | _residual_correlation(run.correlation),
        "tilt_gain": run.tilt_gain,
        "models": [_model(fit) for fit in run.fits],
        "reference": {"frequency_hz": frequency, "time_s": duration},
        "outliers": [
            {
                "index": i,
                "time_s": float(source.readings.time[i]),
                "spin_frequency_hz": float(source.readings.frequency[i]),
            }
            for i in run.outliers
        ],
        "warnings": [unquoted(text) for text in (*source.warnings, *run.warnings)],
    } | _verdict(run.best, run.verdict, run.correlation)


def _values(estimates: Mapping[str, Estimate]) -> dict[str, Any]:
    return {name: _value(estimate) for name, estimate in estimates.items()}


def _value(estimate: Estimate) -> dict[str, Any]:
    value: dict[str, Any] = {"value": estimate.value, "u": estimate.u, "unit": estimate.unit}
    if estimate.interval:
        value["interval_68"] = list(estimate.interval)
    if isinstance(estimate, Mean) and estimate.scatter is not None:
        value |= {"scatter": estimate.scatter, "runs": estimate.degrees_of_freedom + 1}
    return value


def _some(statistics: Statistics, part: type[Part]) -> dict[str, Any]:
    """Those of the statistics that stand in a part of the document."""
    return {name: getattr(statistics, name) for name in part.model_fields if hasattr(statistics, name)}


# --- reading -------------------------------------------------------------------------------------------


#: Options that say nothing about runs, whose columns are known.
_OF_FILES = frozenset({"columns", "channel", "rate"})


def recall_spindowns(paths: Sequence[Path], options: SpinDownOptions) -> SpinDownAnalysis:
    """What `analyze` found at the paths, from its result.json; analyzed anew is only what has none that holds.

    A result holds as long as the readings are the same bytes, and it was made with the given options.  Options that are
    at their defaults are not given: those of the result then count, for what is analyzed anew, too.

    Raises DataError for what cannot be used, a damaged result.json included.
    """
    paths = [find_run(path) for path in paths]
    archive = Archive(paths, SpinDownResult)
    given = {f.name: getattr(options, f.name) for f in fields(SpinDownOptions) if getattr(options, f.name) != f.default}

    def reading(path: Path) -> SpinDownOptions:
        earlier = archive.earlier(path, path)
        return replace(earlier.result.settings.options, **given) if earlier else options

    found = collect(paths, NEEDS, reading)
    place = place_of(paths, found.sources)
    whole = archive.whole(found.sources)
    if all(source.run for source in found.sources):
        given = {name: value for name, value in given.items() if name not in _OF_FILES}
    if whole and _holds(whole[1].settings.options, given):
        return _restored(whole[1], whole[0], found, place)
    recalled = [_recalled(source, archive, given) for source in found.sources]
    if tilt_demanded([run for _, run, _ in recalled]):
        recalled = [
            one if one[1].has_tilt else _with_tilt(source, one[2].options)
            for source, one in zip(found.sources, recalled, strict=True)
        ]
    runs = tuple(run for _, run, _ in recalled)
    sources = tuple(source for source, _, _ in recalled)
    return SpinDownAnalysis(
        sources=sources,
        runs=runs,
        combined=combine(runs),
        options=options,
        place=place,
        warnings=(*found.warnings, *about_inputs(sources, options)),
        remarks=found.remarks,
        origins=tuple(origin for _, _, origin in recalled),
    )


def _holds(made_with: SpinDownOptions, given: Mapping[str, Any]) -> bool:
    return _settings(replace(made_with, **given)) == _settings(made_with)


def _recalled(
    source: Source[Readings], archive: Archive[SpinDownResult], given: Mapping[str, Any]
) -> tuple[Source[Readings], SpinDown, Origin]:
    """One input: what was found of it, or its fit."""
    if source.run:  # the columns of a run are known
        given = {name: value for name, value in given.items() if name not in _OF_FILES}
    earlier = archive.earlier(source.path, source.data, source.sha256)
    if earlier is None:
        options = SpinDownOptions(**given)
        return source, fit_source(source, options), Origin(options, "analyzed for this page: there was no result yet")
    made_with = earlier.result.settings.options
    if earlier.sha256 == source.sha256 and _holds(made_with, given):
        run = _spin_down(earlier.result.runs[earlier.number], source, made_with, earlier.file)
        return replace(source, warnings=()), run, _origin(earlier)
    options = replace(made_with, **given)
    why = "the readings are others than in" if earlier.sha256 != source.sha256 else "other options than those of"
    return source, fit_source(source, options), Origin(options, f"analyzed for this page: {why} {earlier.file}")


def _with_tilt(source: Source[Readings], options: SpinDownOptions) -> tuple[Source[Readings], SpinDown, Origin]:
    """One input fitted with the count's tilt, which it shows only together with the others."""
    origin = Origin(options, "analyzed for this page: the runs show a tilt of the top together, not each by itself")
    return source, fit_source(source, options, tilt=True), origin


def _origin(earlier: Earlier[SpinDownResult]) -> Origin:
    return Origin(earlier.result.settings.options, earlier.text)


def _restored(result: SpinDownResult, file: Path, found: Found[Readings], place: Place) -> SpinDownAnalysis:
    """All of it as it was found."""
    numbers = {given.sha256: k for k, given in enumerate(result.inputs)}
    options = result.settings.options
    order = [numbers[source.sha256] for source in found.sources]
    return SpinDownAnalysis(
        sources=tuple(replace(source, warnings=()) for source in found.sources),
        runs=tuple(
            _spin_down(result.runs[k], source, options, file) for k, source in zip(order, found.sources, strict=True)
        ),
        combined=_combined(result),
        options=options,
        place=place,
        warnings=tuple(dict.fromkeys((*result.warnings, *map(unquoted, found.warnings)))),
        remarks=found.remarks,
        origins=tuple(_origin(Earlier(file, result, k)) for k in order),
    )


def _combined(result: SpinDownResult) -> Combined:
    fits = tuple(
        CombinedLaw(
            name=model.name,
            constants={name: _mean(model.parameters[name]) for name in LAWS[model.name].constants},
            linearised={name: _mean(value) for name, value in model.linearised.items()} if model.linearised else None,
            statistics=_statistics(model),
            warnings=model.warnings,
        )
        for model in result.models
    )
    tilt = _mean(result.values["moment_tilt"]) if "moment_tilt" in result.values else None
    seen = _correlation_of(result)
    return Combined(fits, result.best_model, _verdict_of(result), len(result.runs), (), seen, tilt)


def _correlation_of(part: _WithLaws) -> Correlation | None:
    return None if part.correlation is None else Correlation(**part.correlation.model_dump())


def _mean(value: Value) -> Mean:
    estimate = value.estimate
    return Mean(
        estimate.value, estimate.u, estimate.unit, estimate.interval, value.scatter, value.runs - 1 if value.runs else 0
    )


def _spin_down(part: SpinDownPart, source: Source[Readings], options: SpinDownOptions, file: Path) -> SpinDown:
    """One run; its curves and what they leave over from the readings."""
    readings = source.readings
    outliers = [one.index for one in part.outliers]
    if max(outliers, default=0) >= len(readings):
        raise DataError(f"{file}: names an outlier that {source.data} does not hold: {ANEW}")
    used = np.ones(len(readings), dtype=bool)
    if not options.keep_outliers:
        used[outliers] = False
    if used.sum() < FEWEST:
        raise DataError(f"{file}: names so many outliers that {used.sum()} readings of {source.data} are left: {ANEW}")
    time, frequency = readings.time[used], readings.frequency[used]
    u = readings.u if options.reading_u is None else np.full(len(readings), options.reading_u)
    with np.errstate(all="ignore"):
        fits = tuple(_law_fit(model, part.reference, time, frequency, part.start_time) for model in part.models)
    if not all(np.isfinite(fit.residuals).all() for fit in fits):
        raise DataError(f"{file}: its fits leave the range of numbers at the readings of {source.data}: {ANEW}")
    return SpinDown(
        fits=fits,
        best=part.best_model,
        verdict=_verdict_of(part),
        time=time,
        frequency=frequency,
        u=None if u is None else u[used],
        outliers=tuple(outliers),
        start_time=part.start_time,
        warnings=part.warnings,
        correlation=_correlation_of(part),
        tilt_gain=part.tilt_gain,
    )


def _law_fit(
    model: ModelPart, reference: ReferencePart, time: np.ndarray, frequency: np.ndarray, start_time: float
) -> LawFit:
    solution = np.array(model.fit.solution)
    tau, x = (time - start_time) / reference.time_s, frequency / reference.frequency_hz
    return LawFit(
        name=model.name,
        parameters={
            name: model.parameters[name].estimate
            for name in (*LAWS[model.name].parameters, *PARAMETERS)
            if name in model.parameters
        },
        covariance=None if model.covariance is None else np.array(model.covariance, dtype=float),
        statistics=_statistics(model),
        residuals=reference.frequency_hz * (x - counted(LAWS[model.name], tau, solution)),
        linearised={name: value.estimate for name, value in model.linearised.items()} if model.linearised else None,
        warnings=model.warnings,
        start_time=start_time,
        solution=solution,
        reference=(reference.frequency_hz, reference.time_s),
    )


def _statistics(model: ModelPart) -> Statistics:
    return Statistics(**model.statistics.model_dump(), **model.fit.model_dump(exclude={"solution"}))


def _verdict_of(part: _WithLaws) -> Verdict:
    standing = part.standing
    return Verdict(
        best=part.best_model,
        decided=part.decided,
        indistinguishable=standing.tied,
        needless=standing.needless,
        weak=standing.weak,
        excluded=tuple((one.name, one.reason) for one in standing.excluded),
        text=part.verdict,
        describes=part.describes,
    )
