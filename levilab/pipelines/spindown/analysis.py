"""Spin-downs at some paths: each by itself and together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from analysis.errors import AnalysisError
from analysis.spindown.combine import Combined, combine, tilt_demanded
from analysis.spindown.fit import SpinDown, fit_spin_down
from levilab.errors import DataError
from levilab.pipelines.result import Place, place_of
from levilab.pipelines.sources import Needs, Options, Source, collect
from levilab.pipelines.spindown.readings import Readings, spin_readings
from levilab.runs.run import find_run

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

SPINDOWN = "spindown"
#: The runs that suit, and what is needed of a data file.
NEEDS = Needs(
    analysis=SPINDOWN,
    experiments=frozenset({"spin"}),
    quantities=("time_s", "spin_frequency_hz", "spin_frequency_u_hz"),
    read=spin_readings,
)


@dataclass(frozen=True)
class Origin:
    """Where the fits of one run come from.  options: how they were made; text: for people."""

    options: Options
    text: str = "analyzed now"


@dataclass(frozen=True)
class SpinDownAnalysis:
    """Spin-downs, each by itself and together.

    runs, origins: one per source; place: where the result belongs; warnings: about the inputs; remarks: what does not
    belong to the analysis.
    """

    sources: tuple[Source[Readings], ...]
    runs: tuple[SpinDown, ...]
    combined: Combined
    options: Options
    place: Place
    warnings: tuple[str, ...]
    remarks: tuple[str, ...]
    origins: tuple[Origin, ...]

    @property
    def home(self) -> Path:
        """The folder that the result belongs to."""
        return self.place.folder

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        return self.combined.verdict.text

    @property
    def all_warnings(self) -> list[str]:
        """Every warning once, a run's with its name where there are several runs."""
        several = len(self.runs) > 1
        texts = [*self.warnings, *self.combined.warnings]
        excluded = {name for name, _ in self.combined.verdict.excluded}  # what they lack is of no interest any more
        texts += [text for fit in self.combined.fits if fit.name not in excluded for text in fit.warnings]
        for source, run in zip(self.sources, self.runs, strict=True):
            of_laws = [warning for fit in run.fits if fit.name not in excluded for warning in fit.warnings]
            prefix = f"{source.name}: " if several else ""
            texts += [prefix + text for text in (*source.warnings, *run.warnings, *of_laws)]
        return list(dict.fromkeys(texts))


def analyze_spindowns(paths: Sequence[Path], options: Options) -> SpinDownAnalysis:
    """Fit the drag laws to every spin-down found at the paths.

    Raises DataError for what cannot be used; the text names the file.
    """
    paths = [find_run(path) for path in paths]
    found = collect(paths, NEEDS, lambda _: options.columns)
    runs = tuple(fit_source(source, options) for source in found.sources)
    if tilt_demanded(runs):
        runs = tuple(
            run if run.has_tilt else fit_source(source, options, tilt=True)
            for source, run in zip(found.sources, runs, strict=True)
        )
    return SpinDownAnalysis(
        sources=found.sources,
        runs=runs,
        combined=combine(runs),
        options=options,
        place=place_of(paths, found.sources),
        warnings=(*found.warnings, *about_inputs(found.sources, options)),
        remarks=found.remarks,
        origins=(Origin(options),) * len(runs),
    )


def fit_source(source: Source[Readings], options: Options, *, tilt: bool | None = None) -> SpinDown:
    """All laws fitted to one input.  Raises DataError, which names the file.

    tilt: whether the count has the top's tilt; None: if the readings demand it.
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
            tilt=tilt,
        )
    except AnalysisError as error:
        raise DataError(f"{source.data}: {error}") from error


def about_inputs(sources: Sequence[Source[Readings]], options: Options) -> Iterable[str]:
    """What to know of the inputs before using the numbers."""
    synthetic = sum(source.synthetic for source in sources)
    if 0 < synthetic < len(sources):
        yield (
            f"{synthetic} of {len(sources)} inputs are SYNTHETIC, the others are not known to be: "
            "a mean over both says nothing about a real top"
        )
    given = [source.name for source in sources if source.readings.u is not None]
    if options.reading_u is not None and given:
        names = ", ".join(given)
        yield f"the given u of a reading, {options.reading_u:g} Hz, takes the place of the uncertainties in {names}"
    if options.columns and all(source.run for source in sources):
        yield "names of columns were given, but none of the inputs is a data file"
