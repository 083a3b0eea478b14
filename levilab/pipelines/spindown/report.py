"""Spin-downs → their part of a report."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.pipelines.part import (
    VALUE_U,
    FigureText,
    ReportPart,
    first_of,
    input_parts,
    labels_of,
    origin_of_u,
    size_of_u,
)
from levilab.pipelines.spindown.laws import STRAIGHT_LINES, SYMBOLS
from levilab.pipelines.spindown.meaning import answer, meaning
from levilab.pipelines.spindown.quantities import OF_RUN
from levilab.pipelines.spindown.table import (
    QUALITY_IN_WORDS,
    count_table,
    is_best,
    law_constants,
    quality_table,
)
from levilab.pipelines.spindown.words import verdict_of_run
from levilab.present.clock import with_clock
from levilab.present.document.blocks import Details, Listing, Note, Paragraph, Points, Tabular
from levilab.present.numbers import column, off, reading, short_name, with_decimals, with_uncertainty
from levilab.present.tables import Row, Table, table
from levilab.present.units import unit as unit_row
from levilab.runs.events import RunEvent

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from analysis.spindown.combine import CombinedLaw, Mean
    from analysis.spindown.fit import SpinDown
    from levilab.pipelines.options import SpinDownOptions
    from levilab.pipelines.sources import Source
    from levilab.pipelines.spindown.analysis import SpinDownAnalysis
    from levilab.pipelines.spindown.readings import SpinReadings
    from levilab.present.document.blocks import Block

#: Readings printed in the page; more stay in the run folder.
MOST_READINGS = 200
#: Runs with more readings have a figure in which not each is a point.
MOST_POINTS = 300
#: Runs whose wobble is shown without unfolding it.
MOST_COUNTS = 12
#: Most falls that are listed; of more the range is given.
MOST_FALLS = 8


def spindown_part(analysis: SpinDownAnalysis) -> ReportPart:
    """Return verdict, laws, their meaning, how well they fit, the constants run by run, and the readings."""
    combined = analysis.combined
    n = combined.fit(combined.best).statistics.n
    return ReportPart(
        subject="spin-down",
        heading="Spin-down of a levitated top",
        lead=f"{n} readings used",
        answer=answer(analysis),
        result=(*_meaning(analysis), *_falls(analysis), *_laws(analysis), *_count(analysis)),
        figure=FigureText(
            title="Spin-down.",
            caption=(
                "The readings with all drag laws; what each law leaves over, which is noise about zero where the law "
                "holds; and the straight lines that one draws on paper, straight where their law holds."
            ),
            alt="Readings with all drag laws, residuals of each law, and straight lines",
            points=_points(analysis),
        ),
        runs_title="Run by run",
        runs=_run_by_run(analysis),
        inputs=input_parts(
            analysis,
            _in_words,
            lambda source, run, options: (_readings(source, run, options, combined.best),),
            verdict_of_run,
        ),
    )


# --- what the fits mean --------------------------------------------------------------------------------


def _meaning(analysis: SpinDownAnalysis) -> tuple[Paragraph, ...]:
    """Return what takes the spin by the best law, how fast, and the meaning of the constants."""
    return (Paragraph(" ".join(meaning(analysis)), "What it means."),)


def _falls(analysis: SpinDownAnalysis) -> tuple[Paragraph, ...]:
    """Return the facts of the falls; of many their range."""
    falls = [
        (short_name(source.name), fall)
        for source, run in zip(analysis.sources, analysis.runs, strict=True)
        if (fall := _fall(source, run))
    ]
    if len(falls) > MOST_FALLS:
        return (Paragraph(f"{_falls_in_short(analysis, len(falls))}.", "The falls."),)
    several = len(analysis.runs) > 1
    return tuple(Paragraph(f"{text}.", f"The fall of {name}." if several else "The fall.") for name, text in falls)


# --- tables --------------------------------------------------------------------------------------------


def _laws(analysis: SpinDownAnalysis) -> tuple[Tabular, Tabular]:
    """Return the constants of all laws, and how well they fit."""
    several = len(analysis.runs) > 1
    n = analysis.combined.fit(analysis.combined.best).statistics.n
    low, high = max(2 - 4 / math.sqrt(n), 0), min(2 + 4 / math.sqrt(n), 4)
    u = "Of a mean it comes from the scatter s of the runs, u = s/√N." if several else "ν₀: the spin at first."
    constants = f"{VALUE_U} {u}"
    quality = (
        "constants: how many were fitted, beside the start of each run; the exponent is common to all runs."
        " χ²/dof is near 1 where a law leaves nothing but the readings' own "
        "uncertainty. ΔAICc counts against a law, more than 10 "
        "excludes it; weight: the law's share of the evidence (Akaike). Order test p (Wald–Wolfowitz): how probable it "
        "is that residuals in random order change their sign so seldom, or so often; below 0.01 they have a shape. "
        f"Durbin–Watson is near 2 for noise: chance alone gives {low:.2f} to {high:.2f} (2 ± 4/√n, 2σ); less means a "
        "shape."
    )
    return (
        Tabular("spindown-laws", _laws_table(analysis), constants),
        Tabular("spindown-models-compared", quality_table(analysis, QUALITY_IN_WORDS), quality),
    )


def _count(analysis: SpinDownAnalysis) -> tuple[Block, ...]:
    """Return tilt, wobble and correlation in the count beside the spin."""
    found = count_table(analysis)
    if found is None:
        return (Note("The top is taken to turn upright: what a tilt of its moment would change is in no uncertainty."),)
    explained = (
        "A counter counts turns about the vertical. A moment that points off the axis by δ makes the top wobble with "
        "its spin, the more the nearer the spin is to the resonance ν_r, and the count is higher than the spin by what "
        "is given for the last reading. K, beside a law's constants, is the size of what nutation adds. Where "
        "neighbouring readings resemble each other they say as much as fewer independent ones."
    )
    shown = Tabular("spindown-count", found, explained)
    if len(found.rows) <= MOST_COUNTS:
        return (shown,)
    return (Details("What the counter sees of the wobble, run by run", (shown,)),)


def _run_by_run(analysis: SpinDownAnalysis) -> tuple[Block, ...]:
    """Return straight lines and the best law's fit, a row for each run."""
    combined = analysis.combined
    best = combined.best + " law" + (", the best" if combined.verdict.decided else "")
    paper = (
        "Unweighted straight lines as one draws them on paper (ln ω, 1/ω, ω^−½ against time), and beside them the fit "
        f"of the {best}."
    )
    several = " s: standard deviation of one run's constant from another's; the uncertainty of the mean is s/√N."
    note = f"ν₀: the spin at the first reading.{several if len(analysis.runs) > 1 else ''}"
    shown = Tabular("spindown-runs", _by_run_table(analysis), note, first_column_wraps=True)
    return Paragraph(paper), shown


def _laws_table(analysis: SpinDownAnalysis) -> Table:
    several = len(analysis.runs) > 1
    heads = ("law", "mean over the runs", "scatter s between the runs") if several else ("law", "constants")
    rows = [
        Row(_law_cells(analysis, law), "best" if is_best(analysis, law.name) else "") for law in analysis.combined.fits
    ]
    return table("", heads, rows)


def _law_cells(analysis: SpinDownAnalysis, law: CombinedLaw) -> tuple[str, ...]:
    name = law.name + (" (best)" if is_best(analysis, law.name) else "")
    constants = [
        f"{SYMBOLS[of]} = {with_uncertainty(value)}" for of, value in law_constants(analysis, law.name).items()
    ]
    if len(analysis.runs) == 1:
        return name, "\n".join(constants)
    scatters = [with_uncertainty(s) if (s := scatter(mean)) else "—" for mean in law.constants.values()]
    return name, "\n".join(constants), "\n".join(scatters)


@dataclass(frozen=True)
class _Column:
    """A constant, run by run.  head: where it comes from, its symbol and unit; estimates: one a run."""

    head: str
    estimates: tuple[Estimate | None, ...]
    mean: Mean | None = None

    @property
    def cells(self) -> list[str]:
        """The runs; of several runs mean and scatter, empty where there is none."""
        together = [self.mean, scatter(self.mean) if self.mean else None] if len(self.estimates) > 1 else []
        return ["" if cell == "—" else cell for cell in column([*self.estimates, *together])]


def _by_run_table(analysis: SpinDownAnalysis) -> Table:
    columns = _columns(analysis)
    heads = ("run", "readings\nused", *(one.head for one in columns))
    names = [
        (short_name(source.name), str(len(run.time)), "")
        for source, run in zip(analysis.sources, analysis.runs, strict=True)
    ]
    if len(analysis.runs) > 1:
        names += [("mean", "", "together"), ("scatter s", "", "together")]
    rows = [
        Row((name, count, *cells), kind)
        for (name, count, kind), *cells in zip(names, *(one.cells for one in columns), strict=True)
    ]
    return table("", heads, rows, numbers=heads[1:2])


def _columns(analysis: SpinDownAnalysis) -> list[_Column]:
    """Return the straight lines' constants and those of the best law's fit."""
    combined = analysis.combined
    columns = [_Column(one.head, one.show_all(analysis.runs)) for one in OF_RUN]
    for law in combined.fits:
        if law.linearised:
            lines = [run.fit(law.name).linearised or {} for run in analysis.runs]
            columns += _of_law(f"{STRAIGHT_LINES[law.name].quantity} against t", law.linearised, lines)
    best = combined.fit(combined.best)
    fits = [run.fit(best.name).parameters for run in analysis.runs]
    starts = tuple(fit["start_frequency"] for fit in fits)
    columns.append(_Column(_head(f"{best.name} fit", "start_frequency", starts[0].unit), starts))
    return columns + _of_law(f"{best.name} fit", best.constants, fits)


def _of_law(of: str, means: Mapping[str, Mean], runs: Sequence[Mapping[str, Estimate]]) -> list[_Column]:
    return [_Column(_head(of, name, mean.unit), tuple(run[name] for run in runs), mean) for name, mean in means.items()]


def _head(of: str, name: str, unit: str) -> str:
    shown = unit_row(unit).text
    return f"{of}\n{SYMBOLS[name]}" + (f" [{shown}]" if shown else "")


def scatter(mean: Mean) -> Estimate | None:
    """Return the standard deviation between the runs; its own u is s/√(2·dof) (GUM E.4.3)."""
    if mean.scatter is None:
        return None
    return Estimate(mean.scatter, mean.scatter / math.sqrt(2 * mean.degrees_of_freedom), mean.unit)


# --- one input -----------------------------------------------------------------------------------------


def _in_words(source: Source[SpinReadings], fit: SpinDown, options: SpinDownOptions) -> tuple[str, ...]:
    count, outliers = len(source.readings), len(fit.outliers)
    text = f"{count} readings"
    if outliers:
        text += f", {outliers} of them outlier{'s' * (outliers > 1)}, {'kept' if options.keep_outliers else 'left out'}"
    t, nu = fit.time, fit.frequency
    span = f"{with_decimals(t[0], 1)} s to {with_decimals(t[-1], 1)} s, {nu[0]:.2f} Hz to {nu[-1]:.2f} Hz"
    return f"{text}; {span}", _uncertainty(source, fit, options)


def _uncertainty(source: Source[SpinReadings], fit: SpinDown, options: SpinDownOptions) -> str:
    """Return how large u of a reading is, and where it comes from."""
    if fit.u is None:
        return "u of a reading: not known, taken from the scatter about each law"
    return f"u of a reading: {size_of_u(fit.u)}, {origin_of_u(source, 'spin_frequency_u_hz', options)}"


def _residuals(source: Source[SpinReadings], fit: SpinDown, law: str) -> dict[int, float]:
    """Return number of a reading → its residual from the law [Hz]; of those that were fitted."""
    out = frozenset(fit.outliers)
    used = [i for i in range(len(source.readings)) if i not in out or len(fit.time) == len(source.readings)]
    return dict(zip(used, fit.fit(law).residuals.tolist(), strict=True))


def _readings(source: Source[SpinReadings], fit: SpinDown, options: SpinDownOptions, best: str) -> Listing:
    """Return the first readings; rows of clock time, if it is known, time [s], spin [Hz], u and residual [Hz]."""
    readings, given_u = source.readings, options.reading_u
    shown = min(len(readings), MOST_READINGS)
    u = [given_u] * shown if readings.u is None or given_u is not None else readings.u[:shown].tolist()
    outliers, left = frozenset(fit.outliers), _residuals(source, fit, best)
    named = ("t [s]", "ν [Hz]", "u [Hz]", "residual [Hz]")
    heads, clocks = with_clock(source.time_zero, readings.time[:shown].tolist(), named)
    rows = [
        Row(
            (*clocks[i], with_decimals(t, 3), *reading(float(nu), u_, left.get(i))),
            "outlier" if i in outliers else "",
        )
        for i, (t, nu, u_) in enumerate(zip(readings.time[:shown], readings.frequency[:shown], u, strict=True))
    ]
    note = f"Residual: reading − {best} law. {first_of(shown, len(readings))}".rstrip()
    return Listing("spindown-readings", table("Readings", heads, rows, numbers=heads), note)


def _points(analysis: SpinDownAnalysis) -> tuple[Points, ...]:
    """Return what each point of the figure answers: of run k, its readings, and the residuals from every law."""
    return tuple(
        points
        for k, (name, run) in enumerate(zip(labels_of(analysis.sources), analysis.runs, strict=True))
        if len(run.time) <= MOST_POINTS
        for points in _points_of_run(k, name, run, analysis)
    )


def _points_of_run(k: int, name: str, run: SpinDown, analysis: SpinDownAnalysis) -> Iterator[Points]:
    u = [None] * len(run.time) if run.u is None else run.u.tolist()
    heads = [
        f"{name}\n" * bool(name) + f"t = {digits(t, 6)} s\nν = {with_uncertainty(Estimate(nu, u_, 'Hz'))}"
        for t, nu, u_ in zip(run.time.tolist(), run.frequency.tolist(), u, strict=True)
    ]
    for law in run.fits:
        left = zip(heads, law.residuals.tolist(), u, strict=True)
        texts = tuple(f"{head}\nν − {law.name} law = {off(r, u_)} Hz" for head, r, u_ in left)
        yield Points(f"residuals-{law.name}-{k}", texts)
        if law.name == analysis.combined.best:
            yield Points(f"readings-{k}", texts)
            yield Points(f"residuals-best-{k}", texts)


def _fall(source: Source[SpinReadings], fit: SpinDown) -> str:
    """Return the facts of the fall."""
    events = source.run.events() if source.run else []
    text = next((str(event["text"]) for event in reversed(events) if event["kind"] == RunEvent.FELL), None)
    if text is None:
        return ""
    return f"{text}; last reading that was fitted {fit.frequency[-1]:.2f} Hz at {fit.time[-1]:.1f} s"


def _falls_in_short(analysis: SpinDownAnalysis, seen: int) -> str:
    """Return between which spins the tops fell."""
    last = sorted(float(run.frequency[-1]) for run in analysis.runs)
    span = f"{last[0]:.2f} Hz to {last[-1]:.2f} Hz, {last[len(last) // 2]:.2f} Hz in the middle"
    return f"Seen in {seen} of {len(last)} runs. The last reading that was fitted is {span}"
