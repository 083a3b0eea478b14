"""Spin-downs at some paths: each by itself and together."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.errors import AnalysisError
from analysis.spindown.combine import Combined, combine
from analysis.spindown.fit import SpinDown, fit_spin_down
from levilab.errors import DataError
from levilab.pipelines.sources import (
    Options,
    Source,
    collect,
)
from levilab.runs.run import find_run

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


@dataclass(frozen=True)
class SpinDownAnalysis:
    """Spin-downs, each by itself and together.

    runs: one per source; home: the folder that the result belongs to; warnings: about the inputs.
    """

    sources: tuple[Source, ...]
    runs: tuple[SpinDown, ...]
    combined: Combined
    options: Options
    home: Path
    warnings: tuple[str, ...]


def analyze_spindowns(paths: Sequence[Path], options: Options) -> SpinDownAnalysis:
    """Fit the drag laws to every spin-down found at the paths.

    Raises DataError for what cannot be used; the text names the file.
    """
    paths = [find_run(path) for path in paths]
    sources, warnings = collect(paths, "spindown", options)
    runs = tuple(_fit(source, options) for source in sources)
    told = (*warnings, *_about_inputs(sources, options))
    return SpinDownAnalysis(sources, runs, combine(runs), options, _home(paths, sources), told)


def _fit(source: Source, options: Options) -> SpinDown:
    readings = source.readings
    try:
        return fit_spin_down(
            readings.time,
            readings.frequency,
            readings.u if options.reading_u is None else options.reading_u,
            uncertainty=options.uncertainty,
            bootstrap_samples=options.bootstrap_samples,
            seed=options.seed,
            keep_outliers=options.keep_outliers,
        )
    except AnalysisError as error:
        raise DataError(f"{source.data}: {error}") from error


def _home(paths: Sequence[Path], sources: Sequence[Source]) -> Path:
    """Beside the run or the file; of several runs the folder that was searched for them, else the present one."""
    if len(sources) == 1:
        return sources[0].path if sources[0].run else sources[0].path.parent
    return paths[0] if len(paths) == 1 else Path()


def _about_inputs(sources: Sequence[Source], options: Options) -> Iterable[str]:
    synthetic = sum(source.synthetic for source in sources)
    if 0 < synthetic < len(sources):
        yield (
            f"{synthetic} of {len(sources)} inputs are SYNTHETIC, the others are not known to be: "
            "a mean over both says nothing about a real top"
        )
    given = [source.name for source in sources if source.readings.u is not None]
    if options.reading_u is not None and given:
        yield f"--reading-u {options.reading_u:g} Hz takes the place of the uncertainties in {', '.join(given)}"
    if options.columns and all(source.run for source in sources):
        yield "--columns is for data files; there is none among the inputs"
