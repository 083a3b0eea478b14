"""Limits ↔ result.json."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from analysis.limits import Comparison, Statistics
from levilab.errors import unquoted
from levilab.files import finite
from levilab.pipelines.limit.analysis import (
    LIMIT,
    NEEDS,
    Conditions,
    Device,
    LimitAnalysis,
    LimitOptions,
    Limits,
    Which,
    about_inputs,
    limits_of,
    together,
)
from levilab.pipelines.result import SCHEMA, Archive, Earlier, Part, Place, Result, RunPart, Value, place_of, relative
from levilab.pipelines.result import save as save_files
from levilab.pipelines.sources import collect
from levilab.runs.run import find_run
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from analysis.uncertainty import Estimate
    from levilab.pipelines.limit.readings import LimitReadings
    from levilab.pipelines.sources import Source


# --- what is in it -------------------------------------------------------------------------------------


class DevicePart(Part):
    """What theory says of the top; see `levilab.pipelines.limit.analysis.Device`."""

    name: str
    linear_lower_hz: float = Field(gt=0)
    linear_upper_hz: float = Field(gt=0)
    resonance_hz: float | None


class ConditionsPart(Part):
    """Under which the limits were measured; see `levilab.pipelines.limit.analysis.Conditions`."""

    which: Which
    top: str
    waveform: str | None
    amplitude_vpp: float | None
    creep_hz_per_s: float | None
    step_hz: float | None


class ComparisonPart(Part):
    """A mean beside theory; see `analysis.limits.Comparison`."""

    name: str
    expected: Value
    difference: Value
    p: float | None


class _WithLimits(Part):
    """What stands with each run, and with the limits of the same conditions together.

    freedom: degrees of freedom of the standard error, null where it rests on no scatter.
    """

    which: Which
    conditions: ConditionsPart
    repetitions: int = Field(ge=1)
    freedom: float | None
    trend_p: float | None
    outliers: tuple[int, ...]
    comparisons: tuple[ComparisonPart, ...]
    device: DevicePart
    ends: dict[Literal["fell", "lock lost", "top lost"], int]
    verdict: str


class LimitRunPart(RunPart, _WithLimits):
    """One run."""


class GroupPart(_WithLimits):
    """All limits of the same conditions."""

    values: dict[str, Value]
    numbers: tuple[int, ...]


class SettingsPart(Part):
    """How the limits were analyzed."""

    columns: dict[str, str]
    reading_u_hz: float | None = Field(gt=0)


class LimitResult(Result):
    """result.json of limits."""

    analysis: Literal["limit"] = "limit"
    settings: SettingsPart
    models: tuple[Any, ...] = ()
    groups: tuple[GroupPart, ...]
    runs: tuple[LimitRunPart, ...]


# --- writing -------------------------------------------------------------------------------------------


def save_limits(analysis: LimitAnalysis, folder: Path | None = None, *, first: bool = True) -> list[Path]:
    """Write the result and the figure beside the inputs, or into a folder; returns the files.  Raises CannotWrite.

    Args:
        analysis: what was found.
        folder: in the place of that of the inputs.
        first: whether this is the first analysis of the inputs, see `levilab.pipelines.catalogue.save`.
    """
    from levilab.pipelines.limit.figure import limit_figure
    from levilab.present.style import as_png

    place = replace(analysis.place, folder=folder or analysis.home)
    return save_files(limit_result(analysis, place), place, as_png(limit_figure(analysis)), first=first)


def limit_document(analysis: LimitAnalysis, folder: Path) -> dict[str, Any]:
    """The content of result.json; paths in it are relative to the folder that it is for."""
    return limit_result(analysis, Place(folder)).as_dict()


def limit_result(analysis: LimitAnalysis, place: Place) -> LimitResult:
    """The result for a place."""
    sources = analysis.sources
    document = {
        "schema": SCHEMA,
        "analysis": LIMIT,
        "inputs": [{"path": relative(source.data, place.folder), "sha256": source.sha256} for source in sources],
        "synthetic": any(source.synthetic for source in sources),
        "software": software_versions(),
        "settings": _settings(analysis.options),
        "values": _top_values(analysis),
        "models": [],
        "groups": [
            {"values": _values(group.statistics), "numbers": list(group.runs)} | _limits(group)
            for group in analysis.groups
        ],
        "runs": [
            {
                "path": relative(source.path, place.folder),
                "synthetic": source.synthetic,
                "values": _values(run.statistics),
                "warnings": [unquoted(text) for text in source.warnings],
            }
            | _limits(run)
            for source, run in zip(sources, analysis.runs, strict=True)
        ],
        "warnings": [unquoted(text) for text in analysis.all_warnings],
    }
    return LimitResult.model_validate(finite(document))


def _settings(options: LimitOptions) -> dict[str, Any]:
    return {"columns": dict(options.columns or {}), "reading_u_hz": options.reading_u}


def _top_values(analysis: LimitAnalysis) -> dict[str, Any]:
    """Of one group by their plain names, else with the kind before them, and its number where it has several."""
    if len(analysis.groups) == 1:
        return _values(analysis.groups[0].statistics)
    values: dict[str, Any] = {}
    for group in analysis.groups:
        number = analysis.number(group)
        prefix = group.which if number is None else f"{group.which}_{number}"
        values |= {f"{prefix}_{name}": value for name, value in _values(group.statistics).items()}
    return values


def _values(found: Statistics) -> dict[str, Any]:
    error = found.mean.u if found.scatter else None
    values = {"mean": _value(found.mean), "standard_error": _plain(error)}
    for name in ("scatter", "trend", "between"):
        if estimate := getattr(found, name):
            values[_NAMES.get(name, name)] = _value(estimate)
    if found.step:
        values["step_error"] = _plain(found.step)
    return values


#: Names of what would not be understood by itself.
_NAMES = {"between": "between_runs"}


def _plain(value: float | None) -> dict[str, Any]:
    """A frequency without an uncertainty of its own."""
    return {"value": value, "u": None, "unit": "Hz"}


def _value(estimate: Estimate) -> dict[str, Any]:
    return {"value": estimate.value, "u": estimate.u, "unit": estimate.unit}


def _limits(limits: Limits) -> dict[str, Any]:
    found, device = limits.statistics, limits.device
    return {
        "which": limits.which,
        "conditions": vars(limits.conditions),
        "repetitions": found.n,
        "freedom": found.freedom,
        "trend_p": found.trend_p,
        "outliers": list(found.outliers),
        "comparisons": [
            {
                "name": one.name,
                "expected": _plain(one.expected),
                "difference": _value(one.difference),
                "p": one.p,
            }
            for one in limits.comparisons
        ],
        "device": {
            "name": device.name,
            "linear_lower_hz": device.lower,
            "linear_upper_hz": device.upper,
            "resonance_hz": device.resonance,
        },
        "ends": dict(limits.ends),
        "verdict": limits.text,
    }


# --- reading -------------------------------------------------------------------------------------------


def recall_limits(paths: Sequence[Path], options: LimitOptions) -> LimitAnalysis:
    """What `analyze` found at the paths, from its result.json; analyzed anew where there is none that holds.

    A result holds as long as the limits are the same bytes, it is of just these inputs, and it was made with the given
    options; one that is at its default is not given.  Raises DataError for what cannot be used, a damaged result.json
    included.
    """
    paths = [find_run(path) for path in paths]
    archive = Archive(paths, LimitResult)

    def reading(path: Path) -> LimitOptions:
        earlier = archive.earlier(path, path)
        if options.columns or earlier is None:
            return options
        return replace(options, columns=earlier.result.settings.columns or None)

    found = collect(paths, NEEDS, reading)
    place = place_of(paths, found.sources)
    whole = archive.whole(found.sources)
    if whole and _holds(whole[1].settings, options):
        file, result = whole
        numbers = {given.sha256: k for k, given in enumerate(result.inputs)}
        order = [numbers[source.sha256] for source in found.sources]
        made_with = LimitOptions(columns=result.settings.columns or None, reading_u=result.settings.reading_u_hz)
        return LimitAnalysis(
            sources=tuple(replace(source, warnings=()) for source in found.sources),
            runs=tuple(_restored(result.runs[k], result.runs[k].values, (i,)) for i, k in enumerate(order)),
            groups=tuple(
                _restored(group, group.values, tuple(order.index(k) for k in group.numbers)) for group in result.groups
            ),
            options=made_with,
            place=place,
            warnings=tuple(dict.fromkeys((*result.warnings, *map(unquoted, found.warnings)))),
            remarks=found.remarks,
            origins=(Earlier(file, result, 0).text,) * len(order),
        )
    return _anew(found.sources, options, place, (found.warnings, found.remarks))


def _anew(
    sources: tuple[Source[LimitReadings], ...],
    options: LimitOptions,
    place: Place,
    said: tuple[tuple[str, ...], tuple[str, ...]],
) -> LimitAnalysis:
    runs = tuple(limits_of(source, options, k) for k, source in enumerate(sources))
    groups = together(sources, runs, options)
    origins = ("analyzed for this page: there was no result yet that holds",) * len(runs)
    warnings = (*said[0], *about_inputs(sources, groups))
    return LimitAnalysis(sources, runs, groups, options, place, warnings, said[1], origins)


def _holds(made_with: SettingsPart, options: LimitOptions) -> bool:
    columns = not options.columns or dict(options.columns) == made_with.columns
    return columns and options.reading_u in {None, made_with.reading_u_hz}


def _restored(part: _WithLimits, values: Mapping[str, Value], runs: tuple[int, ...]) -> Limits:
    step = values["step_error"].value if "step_error" in values else None
    statistics = Statistics(
        mean=values["mean"].estimate,
        scatter=values["scatter"].estimate if "scatter" in values else None,
        n=part.repetitions,
        trend=values["trend"].estimate if "trend" in values else None,
        trend_p=part.trend_p,
        outliers=part.outliers,
        step=step or 0.0,
        freedom=math.inf if part.freedom is None else part.freedom,
        runs=len(runs),
        between=values["between_runs"].estimate if "between_runs" in values else None,
    )
    comparisons = tuple(
        Comparison(one.name, one.expected.value or 0.0, one.difference.estimate, one.p) for one in part.comparisons
    )
    said = part.device
    device = Device(said.name, said.linear_lower_hz, said.linear_upper_hz, said.resonance_hz)
    conditions = Conditions(**vars(part.conditions))
    ends = {str(kind): n for kind, n in part.ends.items()}
    return Limits(part.which, conditions, statistics, comparisons, device, ends, runs)
