"""Scans of the base's field at some paths: each by itself and together."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from analysis.field.fit import FieldScan, fit_scan
from analysis.field.floating import Floating, KnownTop, follow
from analysis.uncertainty import Estimate, mean
from levilab.pipelines.analyzed import Analyzed
from levilab.pipelines.field.device import known_of, known_top, usual
from levilab.pipelines.field.readings import FieldReadings
from levilab.pipelines.field.words import about_top, remark, scan_as_text, scans_as_text
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import FieldOptions
from levilab.texts.note import Note


@dataclass(frozen=True, eq=False)
class FieldRun:
    """One scan.

    Attributes:
        scan: its fit.
        top: of which top what follows is.
        floating: what follows, None where no top floats, or the scan shows no ring.
        warnings: what else to know before using the numbers.
        taken: which quantities of the thesis's top stand for those of this one, see `known_top`.
    """

    scan: FieldScan
    top: KnownTop
    floating: Floating | None
    warnings: tuple[str, ...]
    taken: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """What the scan says, in a few sentences."""
        return scan_as_text(self.scan, self.floating, self.taken)

    @property
    def values(self) -> dict[str, Estimate]:
        """All that was found, by name."""
        return {**self.scan.parameters, **(self.floating.values if self.floating else {})}


@dataclass(frozen=True)
class Mean(Estimate):
    """A mean over scans.

    Attributes:
        scatter: of one from another.
        runs: how many.
    """

    scatter: float = 0.0
    runs: int = 1


class FieldAnalysis(Analyzed[FieldReadings, FieldRun, None, FieldOptions]):
    """Scans, each by itself and together."""

    @property
    def values(self) -> Mapping[str, Estimate]:
        """Of one scan what it says; of several means over them."""
        return self.runs[0].values if len(self.runs) == 1 else self.means

    @property
    def means(self) -> dict[str, Mean]:
        """Of several scans."""
        return means([run.values for run in self.runs])

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        if len(self.runs) == 1:
            return self.runs[0].text
        found = self.means
        taken = {name for run in self.runs for name in run.taken}
        return scans_as_text(found, len(self.runs), found["strength"].scatter, taken)

    def about_run(self, run: FieldRun) -> Iterable[str]:
        """Return what to know of one scan."""
        of_top = run.floating.remarks if run.floating else ()
        taken = about_top(run.taken) if run.floating else ()
        return (*map(remark, run.scan.remarks), *taken, *run.warnings, *map(remark, of_top))


def analyze_source(source: Source[FieldReadings], options: FieldOptions) -> FieldRun:
    """Fit one input, and compute what follows.  Raises AnalysisError."""
    readings = source.readings
    known = known_of(source, options.device)
    top, taken = known_top(source, options, usual(readings.height_u))
    scan = fit_scan(readings.height, readings.flux_density, known, readings.u, readings.height_u)
    floating = follow(scan, top) if scan.is_of_a_ring else None
    warnings = list[str]()
    if floating is None and scan.is_of_a_ring:
        warnings = ["no top of this kind floats above this base at any mass and spin: are radii and inertias right?"]
    if readings.u is None:
        said = "no uncertainty of the readings is given: their scatter about the fit stands for it"
        warnings.append(Note("no u", said, weight="advice"))
    if readings.height_u is None:
        said = "no uncertainty of the heights is given: their scatter about the fit stands for it"
        warnings.append(Note("no height u", said, weight="advice"))
    return FieldRun(scan, top, floating, tuple(warnings), taken)


def means(runs: Sequence[Mapping[str, Estimate]]) -> dict[str, Mean]:
    """Return unweighted means over scans, of the quantities that all of them have.

    What calliper and data sheet leave open is nearly all of u, and common to all scans: u is that of one scan and, in
    quadrature, s/√N.
    """
    names = [name for name in runs[0] if all(name in run for run in runs)]
    found = {}
    for name in names:
        of_runs = [run[name] for run in runs]
        of_all = mean(of_runs, [one.u or 0.0 for one in of_runs])
        found[name] = Mean(of_all.value, of_all.u, of_all.unit, scatter=of_all.scatter or 0.0, runs=len(runs))
    return found
