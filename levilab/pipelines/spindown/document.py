"""Results → result.json, and the figures beside it."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from levilab.files import CannotWrite, replace_atomically
from levilab.pipelines.spindown.table import all_warnings
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Mapping

    from analysis.spindown.lawfit import LawFit
    from analysis.spindown.selection import Statistics
    from analysis.uncertainty import Estimate
    from levilab.pipelines.sources import Source
    from levilab.pipelines.spindown.analysis import SpinDownAnalysis

SCHEMA = "levilab-result/1"
RESULT, FIGURE = "result.json", "spindown.png"

#: What of the statistics is written, in INTERFACE's names.
_STATISTICS = (
    "n", "rms_residual", "reduced_chi_square", "aicc", "bic", "weight", "durbin_watson", "runs_test_p",
    "difference",
)  # fmt: skip


def save_result(analysis: SpinDownAnalysis, folder: Path) -> list[Path]:
    """Write result.json and the figure into a folder; returns the files.  Raises CannotWrite."""
    from levilab.pipelines.spindown.figure import spindown_figure
    from levilab.present.style import save_png

    text = json.dumps(as_document(analysis, folder), indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        replace_atomically(folder / RESULT, text + "\n")
        save_png(spindown_figure(analysis), folder / FIGURE)
    except OSError as error:
        raise CannotWrite(
            f"the result could not be written into {folder} ({error.strerror or error}): "
            "choose another place with --out, or print only with --no-save"
        ) from error
    return [folder / RESULT, folder / FIGURE]


def as_document(analysis: SpinDownAnalysis, folder: Path) -> dict[str, Any]:
    """The content of result.json; paths in it are relative to the folder that it is for."""
    combined = analysis.combined
    document: dict[str, Any] = _finite(
        {
            "schema": SCHEMA,
            "analysis": "spindown",
            "inputs": [
                {"path": _relative(source.data, folder), "sha256": source.sha256} for source in analysis.sources
            ],
            "synthetic": any(source.synthetic for source in analysis.sources),
            "software": software_versions(),
            "settings": _settings(analysis),
            "values": _combined_values(analysis),
            "models": _combined_models(analysis),
            "best_model": combined.best,
            "verdict": combined.verdict.text,
            "decided": combined.verdict.decided,
            "runs": [_run(source, analysis, k, folder) for k, source in enumerate(analysis.sources)],
            "warnings": all_warnings(analysis),
        }
    )
    return document


def _combined_values(analysis: SpinDownAnalysis) -> dict[str, Any]:
    """The favoured law's constants, and by how much they differ from run to run."""
    best = analysis.combined.fit(analysis.combined.best)
    scatter = {
        f"{name}_scatter": {"value": mean.scatter, "u": None, "unit": mean.unit, "runs": mean.degrees_of_freedom + 1}
        for name, mean in best.constants.items()
        if mean.scatter is not None
    }
    return _values(best.constants) | scatter


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
            "statistics": _statistics(fit.statistics),
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
        "statistics": _statistics(fit.statistics),
        "warnings": list(fit.warnings),
    } | ({"linearised": _values(fit.linearised)} if fit.linearised else {})


def _settings(analysis: SpinDownAnalysis) -> dict[str, Any]:
    options = analysis.options
    return {
        "columns": dict(options.columns or {}),
        "reading_u_hz": options.reading_u,
        "uncertainty": options.uncertainty,
        "keep_outliers": options.keep_outliers,
        "bootstrap": {"samples": options.bootstrap_samples, "seed": options.seed}
        if options.uncertainty == "bootstrap"
        else None,
    }


def _run(source: Source, analysis: SpinDownAnalysis, k: int, folder: Path) -> dict[str, Any]:
    run = analysis.runs[k]
    return {
        "path": _relative(source.path, folder),
        "synthetic": source.synthetic,
        "values": {
            "start_time": {"value": run.start_time, "u": None, "unit": "s"},
            "duration": {"value": float(run.time[-1] - run.time[0]), "u": None, "unit": "s"},
        }
        | _values(run.fit(run.best).parameters),
        "models": [_model(fit) for fit in run.fits],
        "best_model": run.best,
        "verdict": run.verdict.text,
        "outliers": [
            {
                "index": i,
                "time_s": float(source.readings.time[i]),
                "spin_frequency_hz": float(source.readings.frequency[i]),
            }
            for i in run.outliers
        ],
        "warnings": [*source.readings.warnings, *run.warnings],
    }


def _values(estimates: Mapping[str, Estimate]) -> dict[str, Any]:
    return {name: _value(estimate) for name, estimate in estimates.items()}


def _value(estimate: Estimate) -> dict[str, Any]:
    value: dict[str, Any] = {"value": estimate.value, "u": estimate.u, "unit": estimate.unit}
    return value | ({"interval_68": list(estimate.interval)} if estimate.interval else {})


def _statistics(statistics: Statistics) -> dict[str, Any]:
    return {name: getattr(statistics, name) for name in _STATISTICS}


def _relative(path: Path, folder: Path) -> str:
    """With forward slashes on every system; whole where there is no way (another drive)."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return path.resolve().as_posix()


def _finite(value: Any) -> Any:
    """What no number can say becomes null; json.dumps with allow_nan=False guards the rest."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
