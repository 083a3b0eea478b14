"""Scans of the base's field at some paths: each by itself and together."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from analysis.errors import AnalysisError
from analysis.field.fit import LEARNS_NOTHING, FieldScan, fit_scan
from analysis.field.floating import FERRITE_PER_K, Floating, KnownTop, follow
from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.errors import DataError
from levilab.pipelines.analyzed import Analyzed, Method
from levilab.pipelines.field.device import known_of, known_top, usual
from levilab.pipelines.field.quantities import QUANTITIES
from levilab.pipelines.field.readings import FieldReadings, read_scan_file, read_scan_run
from levilab.pipelines.options import FieldOptions
from levilab.pipelines.sources import Needs
from levilab.present.numbers import enumeration, with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from levilab.pipelines.sources import Source

FIELD = "field"
#: The runs that suit, and what is needed of a data file.
NEEDS = Needs(
    analysis=FIELD,
    experiments=frozenset({"field"}),
    read_file=read_scan_file,
    read_run=read_scan_run,
    particular=True,
)
#: Correlations above this are worth a word.
_STRONG = 0.9


@dataclass(frozen=True, eq=False)
class FieldRun:
    """One scan.

    Attributes:
        scan: its fit.
        top: of which top what follows is.
        floating: what follows, None where no top floats.
        text: what it says, in a few sentences.
        warnings: what to know before using the numbers.
    """

    scan: FieldScan
    top: KnownTop
    floating: Floating | None
    text: str
    warnings: tuple[str, ...]

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
        return self.runs[0].values if len(self.runs) == 1 else means([run.values for run in self.runs])

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        if len(self.runs) == 1:
            return self.runs[0].text
        strength = self.values["strength"]
        agree = _scatter_in_words(strength)
        return f"{len(self.runs)} scans: {_format('strength', strength)} in the mean; {agree}. {_advice(self.values)}"

    def about_run(self, run: FieldRun) -> Iterable[str]:
        """Return what to know of one scan."""
        return run.warnings


def analyze_source(source: Source[FieldReadings], options: FieldOptions) -> FieldRun:
    """Fit one input, and compute what follows.  Raises DataError, which names the file."""
    readings = source.readings
    known = known_of(source, options.device)
    try:
        top, warnings = known_top(options, usual(readings.height_u))
        scan = fit_scan(
            readings.height,
            readings.flux_density,
            known,
            readings.u,
            0.0 if readings.height_u is None else readings.height_u,
            free_radii=options.free_radii,
        )
        floating = follow(scan, top)
    except AnalysisError as error:
        raise DataError(f"{source.data}: {error}") from error
    if floating is None:
        warnings = ["no top of this kind floats above this base at any mass and spin: are radii and inertias right?"]
    if readings.u is None:
        warnings.append("no uncertainty of the readings is given: their scatter about the fit stands for it")
    if readings.height_u is None:
        warnings.append("no uncertainty of the heights is given: they are taken as exact")
    every = (*scan.warnings, *warnings, *(floating.warnings if floating else ()))
    return FieldRun(scan, top, floating, _in_words(scan, floating), every)


METHOD = Method(
    needs=NEEDS,
    kind=FieldAnalysis,
    options=FieldOptions,
    fit=analyze_source,
    mixed="a mean over both says nothing about a real base",
)


def means(runs: Sequence[Mapping[str, Estimate]]) -> dict[str, Mean]:
    """Return unweighted means over scans, of the quantities that all of them have.

    What calliper and data sheet leave open is common to all scans, and no mean makes it smaller: u is that of one scan,
    or s/√N where the scans scatter more.
    """
    names = [name for name in runs[0] if all(name in run for run in runs)]
    found = {}
    for name in names:
        values = [run[name].value or 0.0 for run in runs]
        sizes = [run[name].u or 0.0 for run in runs]
        n, mean = len(values), sum(values) / len(values)
        scatter = math.sqrt(sum((value - mean) ** 2 for value in values) / (n - 1))
        u = max(math.sqrt(sum(size**2 for size in sizes) / n), scatter / math.sqrt(n))
        found[name] = Mean(mean, u, runs[0][name].unit, scatter=scatter, runs=n)
    return found


# --- in words ------------------------------------------------------------------------------------------


def _format(name: str, estimate: Estimate) -> str:
    return with_uncertainty(QUANTITIES[name].show(estimate))


def _scatter_in_words(strength: Estimate) -> str:
    assert isinstance(strength, Mean)
    share = 100 * strength.scatter / abs(strength.value or 1.0)
    return f"one differs from another by {digits(share)} %"


def _in_words(scan: FieldScan, floating: Floating | None) -> str:
    base = (
        f"The base has ρ = {_format('strength', scan.parameters['strength'])}, its middle at "
        f"{_format('origin', scan.parameters['origin'])}; its field points {_pole(scan)} above it."
    )
    parts = [base, _learned_in_words(scan)]
    parts.append(_advice(floating.values) if floating else "No top floats above it.")
    return " ".join(part for part in parts if part)


def _pole(scan: FieldScan) -> str:
    return "up" if scan.values[0] > 0 else "down (by the sign of the probe)"


def _learned_in_words(scan: FieldScan) -> str:
    """Return what the scan can tell, and what it cannot."""
    words = {
        "origin": "origin",
        "thickness": "thickness",
        "inner_radius": "inner radius",
        "outer_radius": "outer radius",
    }
    of_calliper = [
        words[name] for name in scan.fitted if name in words and (scan.learned(name) or 0.0) > LEARNS_NOTHING
    ]
    said = []
    if of_calliper:
        said.append(f"The scan does not tell {enumeration(of_calliper)} better than the calliper.")
    pairs = [
        (one, other)
        for k, one in enumerate(scan.fitted)
        for other in scan.fitted[k + 1 :]
        if abs(scan.correlation(one, other)) > _STRONG
    ]
    said += [
        f"{one.replace('_', ' ').capitalize()} and {other.replace('_', ' ')} can hardly be told apart "
        f"(correlation {digits(scan.correlation(one, other))})."
        for one, other in pairs
    ]
    return " ".join(said)


def _advice(values: Mapping[str, Estimate]) -> str:
    """Return the mass to set, and what to mind."""
    if "mass_to_set" not in values:
        return ""
    shown = {name: _format(name, value) for name, value in values.items() if name in QUANTITIES}
    per_mass = QUANTITIES["height_per_mass"].show(values["height_per_mass"]).value or 0.0  # mm/g
    mass = values["mass_to_set"].value or 0.0
    per_kelvin = 2 * FERRITE_PER_K * mass * 1e3
    tops = (
        f"Tops float from {shown['lowest_height']} to {shown['highest_height']} if they weigh {shown['lightest_mass']} "
        f"to {shown['heaviest_mass']}. Set {shown['mass_to_set']}: such a top floats at {shown['height_at_mass']}, "
        f"0.1 g more lowers it by {0.1 * abs(per_mass):.2f} mm, and it must spin at {shown['slowest_spin']} to "
        f"{shown['fastest_spin']}."
    )
    texts = [tops]
    if "moment" in values:
        texts.append(f"From the height at which it floats its moment is {shown['moment']}.")
    if "mass_to_add" in values:
        add = values["mass_to_add"].value or 0.0
        word = "add" if add > 0 else "take off"
        amount = with_uncertainty(QUANTITIES["mass_to_add"].show(Estimate(abs(add), values["mass_to_add"].u, "kg")))
        texts.append(f"To this top {word} {amount}." if add > 0 else f"From this top {word} {amount}.")
    texts.append(
        f"Ferrite loses 0.2 % of its strength per kelvin, base and top alike: 1 K warmer, and the mass to set is "
        f"{abs(per_kelvin):.2f} g less."
    )
    return " ".join(texts)
