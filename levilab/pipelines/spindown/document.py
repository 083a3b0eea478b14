"""Spin-downs ↔ result.json."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from analysis.residuals import Correlation
from analysis.spindown.combine import Combined, CombinedLaw, Mean
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import SpinDown
from analysis.spindown.lawfit import LawFit, Parts
from analysis.spindown.selection import Statistics
from analysis.spindown.tilt import PARAMETERS, counted
from analysis.spindown.verdict import Verdict
from levilab.formats.table import FEWEST
from levilab.pipelines.document import Document, Settings, number, value_of, values_of
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.result import Part, Result, RunPart, Value
from levilab.pipelines.row import find_all
from levilab.pipelines.spindown.analysis import METHOD, SpinDownAnalysis
from levilab.pipelines.spindown.budget import budget_of_all, budget_of_run
from levilab.pipelines.spindown.laws import STRAIGHT_LINES
from levilab.pipelines.spindown.quantities import CORRELATION, QUANTITIES
from levilab.pipelines.spindown.readings import EARLIEST_S, HIGHEST_HZ, SLOWEST_HZ

if TYPE_CHECKING:
    from collections.abc import Mapping

    from levilab.pipelines.options import InputOptions
    from levilab.pipelines.sources import Source
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

    Attributes:
        solution: in the dimensionless numbers of `analysis.spindown.drag`.
    """

    n_parameters: int = Field(ge=1)
    rss: float = Field(ge=0)
    chi_square: float | None = Field(ge=0)
    misfit: float
    solution: tuple[float, ...] | None = None


class ModelPart(Part):
    """One drag law, fitted to one run or, without a start, over several.

    shared_u: by parameter, the part of its u that all runs of one top share; u_parts: by parameter, what u is made of.
    """

    name: str
    parameters: dict[str, Value]
    covariance: tuple[tuple[float | None, ...], ...] | None
    statistics: StatisticsPart
    fit: FitPart
    warnings: tuple[str, ...]
    linearised: dict[str, Value] | None = None
    scatter: dict[str, float | None] | None = None
    shared_u: dict[str, float] | None = None
    u_parts: dict[str, Parts] | None = None

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
        lines = set(law.constants) if self.name in STRAIGHT_LINES else set()
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


class SettingsPart(Settings):
    """How the readings were analyzed."""

    channel: str | None = None
    rate: float | None = Field(default=None, gt=0, alias="rate_hz")
    reading_u: float | None = Field(gt=0, alias="reading_u_hz")
    uncertainty: Literal["covariance", "profile", "bootstrap"]
    keep_outliers: bool
    tilt: Literal["auto", "none", "fitted"] = "auto"
    bootstrap: BootstrapPart | None
    clock_u: float | None = Field(default=None, gt=0)

    @classmethod
    def of(cls, options: InputOptions, **more: Any) -> Self:
        """From options."""
        assert isinstance(options, SpinDownOptions)
        drawn = BootstrapPart(samples=options.bootstrap_samples, seed=options.seed)
        return super().of(options, bootstrap=drawn if options.uncertainty == "bootstrap" else None, **more)

    def arguments(self) -> dict[str, Any]:
        """The same as options."""
        given = super().arguments()
        drawn: BootstrapPart | None = given.pop("bootstrap")
        return given | ({"bootstrap_samples": drawn.samples, "seed": drawn.seed} if drawn else {})


class SpinDownResult(Result, _WithLaws):
    """result.json of spin-downs."""

    analysis: Literal["spindown"] = "spindown"
    settings: SettingsPart
    runs: tuple[SpinDownPart, ...]


# --- writing -------------------------------------------------------------------------------------------


def _entries(analysis: SpinDownAnalysis) -> dict[str, Any]:
    combined = analysis.combined
    return {
        "values": _combined_values(combined),
        "models": _combined_models(analysis),
    } | _verdict(combined.best, combined.verdict, combined.correlation)


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


def _combined_values(combined: Combined) -> dict[str, Any]:
    """The favoured law's constants, and by how much they differ from run to run."""
    best = combined.fit(combined.best)
    scatter = {
        f"{name}_scatter": number(mean.scatter, mean.unit) | {"runs": mean.degrees_of_freedom + 1}
        for name, mean in best.constants.items()
        if mean.scatter is not None
    }
    tilt = {"moment_tilt": _mean_value(combined.tilt)} if combined.tilt else {}
    return _means(best.constants) | scatter | tilt | values_of(find_all([CORRELATION], combined))


def _combined_models(analysis: SpinDownAnalysis) -> list[dict[str, Any]]:
    """Each law over all runs; of one run that is the run's own fit, start and covariance included."""
    if len(analysis.runs) == 1:
        return [_model(fit) for fit in analysis.runs[0].fits]
    return [
        {
            "name": fit.name,
            "parameters": _means(fit.constants),
            "covariance": None,
            "scatter": {name: mean.scatter for name, mean in fit.constants.items()},
            "statistics": _some(fit.statistics, StatisticsPart),
            "fit": _some(fit.statistics, FitPart),
            "warnings": list(fit.warnings),
        }
        | ({"linearised": _means(fit.linearised)} if fit.linearised else {})
        for fit in analysis.combined.fits
    ]


def _model(fit: LawFit) -> dict[str, Any]:
    """One law fitted to one run."""
    return {
        "name": fit.name,
        "parameters": values_of(fit.parameters),
        "covariance": None if fit.covariance is None else fit.covariance.tolist(),
        "statistics": _some(fit.statistics, StatisticsPart),
        "fit": _some(fit.statistics, FitPart) | {"solution": fit.solution.tolist()},
        "shared_u": dict(fit.shared_u),
        "u_parts": {name: asdict(parts) for name, parts in fit.parts.items()},
        "warnings": list(fit.warnings),
    } | ({"linearised": values_of(fit.linearised)} if fit.linearised else {})


def _run_entries(source: Source[Readings], run: SpinDown) -> dict[str, Any]:
    frequency, duration = run.fits[0].reference
    return {
        "values": values_of(run.fit(run.best).parameters | find_all(QUANTITIES, run)),
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
        "warnings": run.warnings,
    } | _verdict(run.best, run.verdict, run.correlation)


def _means(means: Mapping[str, Mean]) -> dict[str, Any]:
    return {name: _mean_value(mean) for name, mean in means.items()}


def _mean_value(mean: Mean) -> dict[str, Any]:
    scatter = {} if mean.scatter is None else {"scatter": mean.scatter, "runs": mean.degrees_of_freedom + 1}
    return value_of(mean) | scatter


def _some(statistics: Statistics, part: type[Part]) -> dict[str, Any]:
    """Those of the statistics that stand in a part of the document."""
    return {name: getattr(statistics, name) for name in part.model_fields if hasattr(statistics, name)}


# --- reading -------------------------------------------------------------------------------------------


def _combined(result: SpinDownResult, *_: object) -> Combined:
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


def _spin_down(part: SpinDownPart, source: Source[Readings], options: SpinDownOptions) -> SpinDown:
    """One run; its curves and what they leave over from the readings.  Raises ValueError where these belie it."""
    readings = source.readings
    outliers = [one.index for one in part.outliers]
    if max(outliers, default=0) >= len(readings):
        raise ValueError(f"names an outlier that {source.data} does not hold")
    used = np.ones(len(readings), dtype=bool)
    if not options.keep_outliers:
        used[outliers] = False
    if used.sum() < FEWEST:
        raise ValueError(f"names so many outliers that {used.sum()} readings of {source.data} are left")
    time, frequency = readings.time[used], readings.frequency[used]
    u = readings.u if options.reading_u is None else np.full(len(readings), options.reading_u)
    with np.errstate(all="ignore"):
        fits = tuple(_law_fit(model, part.reference, time, frequency, part.start_time) for model in part.models)
    if not all(np.isfinite(fit.residuals).all() for fit in fits):
        raise ValueError(f"its fits leave the range of numbers at the readings of {source.data}")
    return SpinDown(
        fits=fits,
        best=part.best_model,
        verdict=_verdict_of(part),
        time=time,
        frequency=frequency,
        u=None if u is None else u[used],
        outliers=tuple(outliers),
        start_time=part.start_time,
        warnings=(),  # they are those of the source
        correlation=_correlation_of(part),
        tilt_gain=part.tilt_gain,
    )


def _law_fit(
    model: ModelPart, reference: ReferencePart, time: np.ndarray, frequency: np.ndarray, start_time: float
) -> LawFit:
    solution = np.array(model.fit.solution)
    tau, x = (time - start_time) / reference.time_s, frequency / reference.frequency_hz
    names = [name for name in (*LAWS[model.name].parameters, *PARAMETERS) if name in model.parameters]
    return LawFit(
        name=model.name,
        parameters={name: model.parameters[name].estimate for name in names},
        covariance=None if model.covariance is None else np.array(model.covariance, dtype=float),
        statistics=_statistics(model),
        residuals=reference.frequency_hz * (x - counted(LAWS[model.name], tau, solution)),
        linearised={name: value.estimate for name, value in model.linearised.items()} if model.linearised else None,
        warnings=model.warnings,
        start_time=start_time,
        solution=solution,
        reference=(reference.frequency_hz, reference.time_s),
        shared_u={name: model.shared_u[name] for name in names if name in model.shared_u} if model.shared_u else {},
        parts={name: model.u_parts[name] for name in names if name in model.u_parts} if model.u_parts else {},
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


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run, budget_of_all=budget_of_all),
    result=SpinDownResult,
    entries=_entries,
    run_entries=_run_entries,
    run=_spin_down,
    combined=_combined,
)
