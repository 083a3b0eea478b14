"""Spin-downs at some paths: each by itself and together."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from analysis.errors import AnalysisError
from analysis.spindown.combine import Combined, combine, tilt_demanded
from analysis.spindown.fit import SpinDown, fit_spin_down
from levilab.errors import DataError
from levilab.pipelines.analyzed import Analyzed, Method
from levilab.pipelines.budget import gate_of
from levilab.pipelines.sources import InputOptions, Needs
from levilab.pipelines.spindown.laws import SYMBOLS
from levilab.pipelines.spindown.readings import Readings, read_run_readings, read_spin_file

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from analysis.spindown.combine import CombinedLaw
    from analysis.spindown.lawfit import LawFit, Uncertainty
    from levilab.pipelines.sources import Source

SPINDOWN = "spindown"
#: The experiment whose runs it takes, and whose settings say how the readings were counted.
EXPERIMENT = "spin"
#: The runs and files that suit.
NEEDS = Needs(
    analysis=SPINDOWN,
    experiments=frozenset({EXPERIMENT}),
    read_file=read_spin_file,
    read_run=read_run_readings,
)


#: Whether the count holds the tilt of the top's moment.
Tilt = Literal["auto", "none", "fitted"]
TILTED: dict[Tilt, bool | None] = {"auto": None, "none": False, "fitted": True}


@dataclass(frozen=True)
class SpinDownOptions(InputOptions):
    """How spin-downs are analyzed.

    Attributes:
        reading_u: of every reading [Hz], in the place of what the data say.
        bootstrap_samples, seed: of the bootstrap, where it is asked for.
        tilt: whether the count holds the tilt of the top's moment, auto: where readings demand it, and what they may
            hide of it is in u.
        clock_u: of the counter's clock, relative; budgets say what it does, it is in no u.
    """

    reading_u: float | None = None
    uncertainty: Uncertainty = "covariance"
    keep_outliers: bool = False
    tilt: Tilt = "auto"
    bootstrap_samples: int = 1000
    seed: int = 0
    clock_u: float | None = None


class SpinDownAnalysis(Analyzed[Readings, SpinDown, Combined, SpinDownOptions]):
    """Spin-downs, each by itself and together."""

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        return self.combined.verdict.text

    def about_all(self) -> Iterable[str]:
        """What to know of the means, and of the laws that are not excluded."""
        return map(_with_symbols, (*self.combined.warnings, *self._left_out(), *self._of_laws(self.combined.fits)))

    def _left_out(self) -> Iterable[str]:
        """Yield which runs the means leave out, since their unit is in doubt."""
        names = [source.name for source in self.sources if source.readings.doubtful]
        if 0 < len(names) < len(self.sources):
            yield f"the means leave out {', '.join(names)}, whose unit is in doubt: say it, or remove the file"

    def about_run(self, run: SpinDown) -> Iterable[str]:
        """What to know of one run."""
        return (*run.warnings, *self._of_laws(run.fits))

    def _of_laws(self, fits: Iterable[LawFit | CombinedLaw]) -> Iterable[str]:
        excluded = {name for name, _ in self.combined.verdict.excluded}  # what they lack is of no interest any more
        return (warning for fit in fits if fit.name not in excluded for warning in fit.warnings)


def _with_symbols(text: str) -> str:
    """A warning with the constants' symbols, as tables and figures have them, for their names in result.json.

    >>> _with_symbols("disc: c32 scatters between the runs 25 times as much")
    'disc: C₃/₂ scatters between the runs 25 times as much'
    """
    return re.sub(r"(?<=: )(\w+)(?= scatters)", lambda found: SYMBOLS.get(found[0], found[0]), text)


def fit_source(source: Source[Readings], options: SpinDownOptions, *, tilt: bool | None = None) -> SpinDown:
    """All laws fitted to one input.

    Args:
        source: the input.
        options: of the fit.
        tilt: whether the count has the top's tilt; None: as the options say.

    Raises:
        DataError: with the name of the file.
    """
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
            tilt=TILTED[options.tilt] if tilt is None else tilt,
            driven=readings.driven,
            gate=gate_of(source, EXPERIMENT),
        )
    except AnalysisError as error:
        raise DataError(f"{source.data}: {error}") from error


def fit_with_tilt(
    sources: Sequence[Source[Readings]], runs: Sequence[SpinDown], options: Sequence[SpinDownOptions]
) -> dict[int, SpinDown]:
    """Number → fit with the tilt, of those that lack it where the runs together demand it."""
    if not tilt_demanded(runs):
        return {}
    return {
        k: fit_source(sources[k], options[k], tilt=True)
        for k, run in enumerate(runs)
        if not run.has_tilt and options[k].tilt == "auto"
    }


def _undoubted(sources: Sequence[Source[Readings]], runs: Sequence[SpinDown]) -> Sequence[SpinDown]:
    """Return the runs whose unit is not in doubt; all of them where every unit is."""
    return [run for source, run in zip(sources, runs, strict=True) if not source.readings.doubtful] or runs


METHOD = Method(
    needs=NEEDS,
    kind=SpinDownAnalysis,
    options=SpinDownOptions,
    fit=fit_source,
    combine=lambda sources, runs, _: combine(_undoubted(sources, runs)),
    mixed="a mean over both says nothing about a real top",
    refit=fit_with_tilt,
    refit_text="the runs show a tilt of the top together, not each by itself",
)


def analyze_spindowns(paths: Sequence[Path], options: SpinDownOptions) -> SpinDownAnalysis:
    """Fit the drag laws to every spin-down found at the paths.

    Raises DataError for what cannot be used; the text names the file.
    """
    return METHOD.analyze(paths, options)
