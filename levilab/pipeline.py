"""Which analysis suits which runs, and the way from paths on the command line to results."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.combine import Combined, combine
from analysis.errors import AnalysisError
from analysis.spindown import SpinDown, fit_spin_down
from levilab.errors import DataError
from levilab.formats import read_table
from levilab.readings import Readings, spin_readings
from levilab.run import READINGS, RECORD, Run, find_runs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from analysis.lawfit import Uncertainty

#: Analysis: the experiments whose runs suit it.
SUITS = {"spindown": frozenset({"spin"})}


@dataclass(frozen=True)
class Options:
    """How to analyze.  columns: the data file's own names; reading_u [Hz] where the data give none."""

    columns: Mapping[str, str] | None = None
    reading_u: float | None = None
    uncertainty: Uncertainty = "covariance"
    keep_outliers: bool = False


@dataclass(frozen=True)
class Source:
    """One input: what was given, and its readings.  run: None for a data file; data: the file with the readings."""

    path: Path
    data: Path
    run: Run | None
    readings: Readings

    @property
    def name(self) -> str:
        """For people."""
        return self.path.name

    @property
    def synthetic(self) -> bool:
        """Whether any of it is known to be simulated or made up."""
        return bool(self.run and self.run.record.synthetic)


@dataclass(frozen=True)
class SpinDownAnalysis:
    """Spin-downs, each by itself and together.  runs: one per source; warnings: about what was passed over."""

    sources: tuple[Source, ...]
    runs: tuple[SpinDown, ...]
    combined: Combined
    options: Options
    warnings: tuple[str, ...]

    @property
    def home(self) -> Path:
        """The folder beside which the result belongs: the run's, the file's, or the one that holds all of them."""
        if len(self.sources) == 1:
            path = self.sources[0].path
            return path if self.sources[0].run else path.parent
        return Path(os.path.commonpath([source.path.parent for source in self.sources]))


def analyze_spindowns(paths: Sequence[Path], options: Options) -> SpinDownAnalysis:
    """Fit the drag laws to every spin-down found at the paths.

    Raises DataError for what cannot be used; the text names the file.
    """
    sources, warnings = collect(paths, "spindown", options)
    runs = tuple(_fit(source, options) for source in sources)
    return SpinDownAnalysis(sources, runs, combine(runs), options, warnings)


def _fit(source: Source, options: Options) -> SpinDown:
    readings = source.readings
    u = readings.u if readings.u is not None else options.reading_u
    try:
        return fit_spin_down(
            readings.time,
            readings.frequency,
            u,
            uncertainty=options.uncertainty,
            keep_outliers=options.keep_outliers,
        )
    except AnalysisError as error:
        raise DataError(f"{source.data}: {error}") from error


# --- finding the inputs --------------------------------------------------------------------------------


def collect(paths: Sequence[Path], analysis: str, options: Options) -> tuple[tuple[Source, ...], tuple[str, ...]]:
    """What lies at the paths that suits an analysis, each once, and what was passed over.

    A run folder or a file is taken, or refused with a reason; a folder is searched for runs, and what does not
    suit there is passed over.  Raises DataError.
    """
    sources: dict[Path, Source] = {}
    warnings: list[str] = []
    for path in paths:
        if path.is_dir() and not (path / RECORD).exists():
            found, passed_over = _search(path, analysis)
            warnings += passed_over
        else:
            found = [_one(path, analysis, options)]
        sources |= {source.path.resolve(): source for source in found}
    return tuple(sources.values()), tuple(warnings)


def _one(path: Path, analysis: str, options: Options) -> Source:
    if not path.exists():
        raise DataError(f"{path}: there is no such file or folder")
    if path.is_file():
        return Source(path, path, None, spin_readings(read_table(path, columns=options.columns)))
    return _of_run(Run.load(path), analysis)


def _of_run(run: Run, analysis: str) -> Source:
    if run.record.experiment not in SUITS[analysis]:
        wanted = " or ".join(sorted(SUITS[analysis]))
        raise DataError(f"{run.folder}: holds a {run.record.experiment} run, {analysis} needs a {wanted} run")
    return Source(run.folder, run.folder / READINGS, run, spin_readings(run.readings()))


def _search(root: Path, analysis: str) -> tuple[list[Source], list[str]]:
    """The runs below a folder that suit; what is broken or too short there is passed over and told."""
    found: list[Source] = []
    passed_over: list[str] = []
    others: list[str] = []
    for folder in find_runs(root):
        try:
            run = Run.load(folder)
            if run.record.experiment in SUITS[analysis]:
                found.append(_of_run(run, analysis))
            else:
                others.append(run.record.experiment)
        except DataError as error:
            passed_over.append(f"passed over: {error}")
    if not found:
        raise DataError(f"{root}: {_nothing_found(analysis, others, passed_over)}")
    return found, passed_over


def _nothing_found(analysis: str, others: list[str], broken: list[str]) -> str:
    wanted = " or ".join(sorted(SUITS[analysis]))
    seen = [f"{others.count(name)} {name}" for name in sorted(set(others))] + broken[:1]
    what = f"found only {', '.join(seen)}" if seen else "found no run at all"
    return f"no {wanted} run to analyze in this folder ({what}); give a run folder or a CSV file"
