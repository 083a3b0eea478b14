"""Spin-downs → tables, the meaning of the fits, and their part of a report."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from analysis.arrays import Array
from analysis.numbers import digits
from analysis.residuals import independent
from analysis.spindown.combine import CombinedLaw
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import SpinDown
from analysis.spindown.lawfit import LawFit
from analysis.spindown.selection import Statistics
from analysis.spindown.tilt import PARAMETERS as WOBBLE
from analysis.spindown.tilt import THESIS_TOP, count_of
from analysis.uncertainty import Estimate, Mean
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.part import (
    VALUE_U,
    FigureText,
    ReportPart,
    first_of,
    input_parts,
    labels_of,
    origin_of_u,
    size_of_u,
    title_of,
)
from levilab.pipelines.row import cells_of
from levilab.pipelines.spindown.analysis import SpinDownAnalysis
from levilab.pipelines.spindown.readings import SpinReadings
from levilab.pipelines.spindown.words import (
    OF_RUN,
    STRAIGHT_LINES,
    SYMBOLS,
    UNIT_FIRST,
    doubts_about_law,
    is_prior,
    is_seen,
    law_name,
    law_names,
    verdict_of_run,
)
from levilab.present.clock import with_clock
from levilab.present.document.blocks import Block, Details, Listing, Note, Paragraph, Points, Tabular
from levilab.present.numbers import (
    column,
    enumeration,
    off,
    plain,
    reading,
    share,
    short_name,
    with_decimals,
    with_uncertainty,
    without_unit,
)
from levilab.present.tables import Row, Table, table
from levilab.present.units import unit as unit_row
from levilab.runs.events import RunEvent
from levilab.texts.text import Sentences, Text, how_many, text_from

#: Laws of one power, and the power, in its order.
_POWERS: Mapping[str, float] = MappingProxyType(
    {law.name: n for law in sorted(LAWS.values(), key=lambda one: one.orders) if (n := law.exponent) is not None}
)
#: Power of the laminar layer of air on a disc.
_LAMINAR = 1.5
#: The least difference [u].
_DIFFERS = 2.0
#: Runs differ whose scatter is this multiple of the scatter that their readings explain.
_SCATTERS = 1.5


def meaning(analysis: SpinDownAnalysis) -> tuple[str, ...]:
    """Return the sentences, of all runs together."""
    return tuple(text for part in _PARTS for text in part(analysis))


def _law(analysis: SpinDownAnalysis) -> Iterator[str]:
    verdict = analysis.combined.verdict
    if not verdict.describes:
        yield (
            "No constant below is one of the top: something other than drag moved its spin, or the counter counted "
            "something else."
        )
    elif verdict.decided:
        yield Text("The torque of the drag is proportional to {torque}.", torque=LAWS[verdict.best].torque)


def _loss(analysis: SpinDownAnalysis) -> Iterator[str]:
    """Yield how fast the top gets slower, which needs no law."""
    combined = analysis.combined
    if not combined.verdict.describes:
        return
    run = analysis.taken[0]
    fit = run.fit(combined.best)
    if fit.has_tilt:
        return
    reference, duration = fit.reference
    spins = np.array([float(run.frequency[0]), float(run.frequency[-1])])
    loss = LAWS[fit.name].slowing(spins / reference, fit.solution) * reference / duration
    first, last = (
        Text("{loss:n} Hz a second at {spin:.3g} Hz", loss=digits(float(each)), spin=float(spin))
        for each, spin in zip(loss, spins, strict=True)
    )
    several = len(analysis.taken) > 1
    loses = "In one of the runs the top loses {first}, and {last}." if several else "The top loses {first}, and {last}."
    yield Text(loses, first=first, last=last)


def _constant(analysis: SpinDownAnalysis) -> Iterator[str]:
    """Yield the meaning of the constant of a law of one power."""
    combined = analysis.combined
    if combined.best not in _POWERS or not combined.verdict.describes:
        return
    ((name, value),) = _constants(analysis).items()
    if value.value is None or not value.u or value.value <= 0:
        return
    n = _POWERS[combined.best]
    if n == 1:
        yield Text("The spin halves in {time:n} s, whatever it is.", time=plain(math.log(2) / value.value))
    elif n == _LAMINAR and not any(doubts_about_law(analysis.taken[0], len(analysis.runs))):
        disc = analysis.taken[0].model.top.disc_constant
        off, u = value.value / disc - 1, value.u / disc
        way = "above the value" if off > 0 else "below the value"
        compared = Text("{symbol} lies {percent:n} % {way}", SYMBOLS[name], digits(100 * abs(off)), way)
        top = "the thesis's top" if disc == THESIS_TOP.disc_constant else "this top"
        karman = Text("von Kármán for a bare disc as large as {top}, {value:n}×10⁻⁴", top, digits(1e4 * disc, 4))
        if abs(off) < _DIFFERS * u:
            yield Text("{symbol} agrees with the value of {karman}.", symbol=SYMBOLS[name], karman=karman)
        elif off > 0:
            yield Text(
                "{lies} of {karman}: rim, stem and washers drag, too, if this top is as large.", compared, karman
            )
        else:
            yield Text("{lies} of {karman}: this top is smaller or heavier, if nothing drives it.", compared, karman)


def _exponent(analysis: SpinDownAnalysis) -> Iterator[str]:
    """Yield the distance of the exponent from those of the laws of one power."""
    combined = analysis.combined
    power = next((fit for fit in combined.fits if fit.name == "power"), None)
    if power is None or not combined.verdict.describes:
        return
    estimates = power.constants if len(analysis.runs) > 1 else analysis.runs[0].fit("power").parameters
    exponent: Estimate = estimates["exponent"]
    if exponent.value is None or not exponent.u:
        return
    away = {name: abs(exponent.value - n) / exponent.u for name, n in _POWERS.items()}
    near = [Text("{law} ({n:g})", law_name(name), _POWERS[name]) for name, far in away.items() if far < _DIFFERS]
    far = [
        Text("{law} ({n:g}) by {far:.0f} u", law=law_name(name), n=_POWERS[name], far=far)
        for name, far in away.items()
        if far >= _DIFFERS
    ]
    agrees = Text("agrees with {laws}", laws=enumeration(near)) if near else "agrees with none of the laws of one power"
    misses = Text(" and misses {laws}", laws=enumeration(far)) if far else ""
    yield Text(
        "With a free exponent the readings choose n = {n:n}: that {agrees}{misses}.",
        n=with_uncertainty(exponent),
        agrees=agrees,
        misses=misses,
    )


def _tilt(analysis: SpinDownAnalysis) -> Iterator[str]:
    tilt = analysis.combined.tilt
    if tilt and tilt.value and is_seen(tilt):
        yield Text(
            "The magnet's moment points {degrees:n}° off the axis of the top: it wobbles with its spin, "
            "more and more towards the fall, and the counter counts a little more than the spin.",
            degrees=digits(math.degrees(tilt.value)),
        )


def _runs(analysis: SpinDownAnalysis) -> Iterator[str]:
    """Yield the meaning of the scatter between runs."""
    if len(analysis.taken) == 1:
        return
    # the constants of a general law trade against each other: their large u would hide that the runs differ
    verdict = analysis.combined.verdict
    law = next((name for name in (*verdict.indistinguishable, *verdict.weak) if name in _POWERS), verdict.best)
    for name, mean in analysis.combined.fit(law).constants.items():
        if name == "exponent" or mean.value is None or mean.scatter is None:
            continue
        scatter: float = mean.scatter
        own = [run.fit(law).parameters[name].u for run in analysis.taken]
        known = [u for u in own if u]
        if len(known) != len(own):
            continue
        ratio = scatter / math.sqrt(sum(u**2 for u in known) / len(known))
        percent = digits(100 * scatter / abs(mean.value))
        if ratio > _SCATTERS:
            yield Text(
                "From one run to the next {symbol} differs by {percent:n} %, {times:n} times as much as the "
                "readings of each explain: the runs differ, and the mean is as good as their scatter lets it "
                "be.",
                symbol=SYMBOLS[name],
                percent=percent,
                times=digits(ratio),
            )
        else:
            yield Text(
                "The {n} runs agree: {symbol} differs by {percent:n} %, no more than their readings explain.",
                n=len(own),
                symbol=SYMBOLS[name],
                percent=percent,
            )


def _constants(analysis: SpinDownAnalysis) -> Mapping[str, Estimate]:
    """Return the constants of the best law: of one run its own, of several their means."""
    combined = analysis.combined
    if len(analysis.runs) > 1:
        return combined.fit(combined.best).constants
    parameters = analysis.runs[0].fit(combined.best).parameters
    return {name: parameters[name] for name in LAWS[combined.best].constants}


_PARTS = (_constant, _law, _loss, _exponent, _tilt, _runs)


#: How well a law fits: heads for 80 columns, and spelled out.
QUALITY = ("constants", "rms [Hz]", "χ²/dof", "ΔAICc", "weight", "order p", "DW")
QUALITY_IN_WORDS = (*QUALITY[:5], "order test p", "Durbin–Watson")
#: Below it ΔAICc has a digit behind the point: only there does it decide anything.
_WITH_TENTHS = 100.0


def spindown_tables(analysis: SpinDownAnalysis) -> tuple[Table, ...]:
    """Return the runs; the laws, how well they fit, the straight lines.  Each fits a terminal of 80 columns."""
    if analysis.is_doubtful:
        return (_runs_table(analysis),)
    quality = replace(quality_table(analysis, QUALITY), title=Sentences("How well they fit.", _QUALITY_SYMBOLS))
    count = count_table(analysis, symbols=True)
    best, *lines = _of_laws(analysis)
    title = Text("Run by run: the fit of the {law} law, and unweighted straight lines", law=analysis.combined.best)
    by_run = _by_run_table(analysis, title, [best[0], *(one for columns in lines for one in columns)])
    return _runs_table(analysis), _constants_table(analysis), quality, *([count] if count else []), by_run


def _runs_table(analysis: SpinDownAnalysis) -> Table:
    rows = [
        (
            source.name,
            str(len(run.time)),
            *cells,
            Text("{first:.2f} → {last:.2f}", first=run.frequency[0], last=run.frequency[-1]),
            run.best if run.verdict.decided and not source.readings.doubtful else "undecided",
        )
        for source, run, *cells in zip(analysis.sources, analysis.runs, *cells_of(OF_RUN, analysis.runs), strict=True)
    ]
    heads = ("run", "readings", *(one.head for one in OF_RUN), "spin [Hz]", "best law")
    return table(title_of("Spin-down", analysis.sources), heads, rows, numbers=["readings"])


def laws_of(analysis: SpinDownAnalysis) -> list[str]:
    """Return the laws that were fitted, in the order of their table; a result of earlier may lack some."""
    fitted = {fit.name for fit in analysis.combined.fits}
    return [name for name in LAWS if name in fitted]


def is_best(analysis: SpinDownAnalysis, law: str) -> bool:
    """Return whether the readings single a law out."""
    verdict = analysis.combined.verdict
    return verdict.decided and law == verdict.best


def law_constants(analysis: SpinDownAnalysis, name: str) -> Mapping[str, Estimate]:
    """Return a law's constants: means over the runs, or with its start those of the only one."""
    if len(analysis.runs) > 1:
        return analysis.combined.fit(name).constants
    found = analysis.runs[0].fit(name).parameters
    excluded = name in analysis.combined.verdict.excluded
    return {one: value for one, value in found.items() if not (excluded and one in WOBBLE)}


def quality_table(analysis: SpinDownAnalysis, heads: Sequence[str]) -> Table:
    """Return how well the laws fit."""
    rows = [
        Row((fit.name, *_quality(fit.statistics, len(analysis.runs))), "best" if is_best(analysis, fit.name) else "")
        for fit in analysis.combined.fits
    ]
    return table("How well they fit", ("law", *heads), rows, numbers=heads)


def _quality(statistics: Statistics, runs: int) -> list[str]:
    difference = statistics.difference
    return [
        str(statistics.n_parameters - runs),  # each run has a start besides, under every law
        plain(statistics.rms_residual),
        plain(statistics.reduced_chi_square),
        "—" if difference is None else f"{difference:.1f}" if difference < _WITH_TENTHS else f"{difference:.0f}",
        share(statistics.weight),
        plain(statistics.runs_test_p, 2),
        plain(statistics.durbin_watson),
    ]


#: For the terminal, where nothing else explains them.
_QUALITY_SYMBOLS = "order p: below 0.01 the signs of the residuals have a pattern; DW: near 2 without correlation."
_WOBBLE_SYMBOLS = "δ: tilt of the moment; ν_r: resonance, below the last reading."
_NUTATION = "K, with the laws: nutation. (prior): known of tops beforehand, not from the readings."


def count_table(analysis: SpinDownAnalysis, *, symbols: bool = False) -> Table | None:
    """Return tilt, wobble and correlation in the count, and the effective number of readings; None: none is seen."""
    if not any(run.has_tilt or run.is_correlated for run in analysis.runs):
        return None
    heads = ("run", "δ [rad]", "ν_r [Hz]", "adds at the end [Hz]", "correlation", "count as")
    rows = []
    for source, run in analysis.each:
        fit = run.fit(run.best)
        tilt, resonance = (fit.parameters.get(name) for name in ("moment_tilt", "resonance"))
        added = tilt_part(fit, run.time)
        seen = run.correlation if run.is_correlated else None
        rho, n = (seen.value or 0.0) if seen else 0.0, len(run.time)
        rows.append(
            Row(
                (
                    short_name(source.name),
                    without_unit(tilt) if tilt else "none",
                    without_unit(resonance) if resonance else "—",
                    Text("{hz:n}", hz=plain(float(added[-1]), 2)) if tilt else "—",
                    Text("{rho:.2f} ± {u:.2f}", rho=rho, u=seen.u) if seen else "none",
                    Text("{worth:n} of {n}", worth=digits(independent(n, rho)), n=n) if seen else str(n),
                )
            )
        )
    tilted = any(run.has_tilt for run in analysis.runs)
    title = "What the counter sees of the wobble, by the best law"
    if tilted and symbols:
        title = Sentences(Text("{title}.", title), _WOBBLE_SYMBOLS, _NUTATION if len(analysis.runs) == 1 else "")
    return table(title, heads, rows)


def tilt_part(fit: LawFit, time: Array) -> Array:
    """Return the share of tilt and wobble in the count at some times [Hz], shape (n,); zeros without them."""
    p = len(fit.law.parameters)
    tau = (time - fit.start_time) / fit.reference[1]
    spin: Array = fit.reference[0] * count_of(fit.law, tau, fit.solution[:p], fit.top)
    return fit.spin_frequency(time) - spin


# --- readings as columns of tables for programs ---


def spindown_columns(analysis: SpinDownAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the readings of each run; residual_hz: reading less the best law of all runs, NaN for unused readings."""
    for source, run in analysis.each:
        readings, n = source.readings, len(source.readings)
        used = np.isin(readings.time, run.time)
        residual = np.full(n, np.nan)
        residual[used] = run.fit(analysis.combined.best).residuals
        given = analysis.options.reading_u
        own = np.full(n, np.nan) if readings.u is None else readings.u
        yield {
            "time_s": readings.time,
            "spin_frequency_hz": readings.frequency,
            "spin_frequency_u_hz": own if given is None else np.full(n, given),
            "residual_hz": residual,
            "used": used,
        }


def spindown_curve_u(analysis: SpinDownAnalysis, number: int, law: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return the standard uncertainty [Hz] of a law's curve, of times [s]; NaN: undefined, or of a tilt elsewhere."""
    run = analysis.runs[number]
    fit = run.fit(law)

    def curve_u(time: np.ndarray) -> np.ndarray:
        u = fit.u_spin_frequency(time)
        unknown = fit.has_tilt & ((time < run.time[0]) | (time > run.time[-1]))
        return np.where(unknown, np.nan, np.nan if u is None else u)

    return curve_u


def spindown_curve(analysis: SpinDownAnalysis, number: int, law: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return the spin frequency [Hz] of a law fitted to one run, of times [s]; beyond the readings by the law alone."""
    run = analysis.runs[number]
    fit, first, last = run.fit(law), float(run.time[0]), float(run.time[-1])

    def curve(time: np.ndarray) -> np.ndarray:
        inside = fit.spin_frequency(np.clip(time, first, last))
        beyond = np.where(time < first, fit.forecast(time, first), fit.forecast(time, last))
        return np.where((time >= first) & (time <= last), inside, beyond)

    return curve


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
    points = _points(analysis)
    part = ReportPart(
        subject="spin-down",
        heading="Spin-down of a levitated top",
        lead=Text("{readings} used", readings=how_many(n, "reading")),
        result=(),
        figure=FigureText("Spin-down.", "The readings as they were read.", points),
        inputs=input_parts(analysis, _in_words, lambda *_: (), lambda _: UNIT_FIRST),
    )
    if analysis.is_doubtful:
        return part
    return replace(
        part,
        result=(Paragraph(Sentences(*meaning(analysis)), "What it means."), *_falls(analysis), *_laws(analysis)),
        figure=FigureText(
            title="Spin-down.",
            caption=(
                "The readings with all drag laws; what each law leaves over, which is noise about zero where the law "
                "holds; and the lines that one draws on paper, straight where their law holds and no tilt bends them."
            ),
            points=points,
        ),
        values=(Tabular("spindown-laws", _constants_table(analysis, short=True), VALUE_U),),
        short_figure=FigureText(
            title="Spin-down.",
            caption="The readings with the law that is nearest to them; below, readings and all laws less that law.",
            points=points,
        ),
        compared=(_comparison(analysis), *_count(analysis)),
        runs_title="Run by run",
        runs=_run_by_run(analysis),
        inputs=input_parts(
            analysis,
            _in_words,
            lambda source, run, options: (_readings(source, run, options, combined.best),),
            verdict_of_run,
        ),
    )


def _falls(analysis: SpinDownAnalysis) -> tuple[Paragraph, ...]:
    """Return the facts of the falls; of many their range."""
    falls = [(short_name(source.name), fall) for source, run in analysis.each if (fall := _fall(source, run))]
    if len(falls) > MOST_FALLS:
        return (Paragraph(_falls_in_short(analysis, len(falls)), "The falls."),)
    several = len(analysis.runs) > 1
    return tuple(
        Paragraph(text, Text("The fall of {name:s}.", name=name) if several else "The fall.") for name, text in falls
    )


# --- tables --------------------------------------------------------------------------------------------


def _laws(analysis: SpinDownAnalysis) -> tuple[Block, ...]:
    """Return the constants of the laws; of excluded ones they can be opened."""
    several = len(analysis.runs) > 1
    u = "Of a mean it comes from the scatter s of the runs, u = s/√N." if several else "ν₀: the spin at first."
    constants = Sentences(VALUE_U, u)
    out = analysis.combined.verdict.excluded
    kept = [fit for fit in analysis.combined.fits if fit.name not in out]
    others = [fit for fit in analysis.combined.fits if fit.name in out]
    excluded = replace(_constants_table(analysis, others), title="")
    folded = (
        Details(Text("Excluded: {laws}", laws=law_names(out)), (Tabular("spindown-laws-excluded", excluded),))
        if others
        else None
    )
    return (Tabular("spindown-laws", _constants_table(analysis, kept), constants), *([folded] if folded else []))


def _comparison(analysis: SpinDownAnalysis) -> Tabular:
    """Return how well the laws fit."""
    n = analysis.combined.fit(analysis.combined.best).statistics.n
    low, high = max(2 - 4 / math.sqrt(n), 0), min(2 + 4 / math.sqrt(n), 4)
    quality = Text(
        "constants: how many were fitted, beside the start of each run; the exponent is common to "
        "all runs. χ²/dof is near 1 where a law leaves nothing but the readings' own uncertainty. "
        "ΔAICc counts against a law, more than 10 excludes it; the constants of such a law are the "
        "likeliest where neighbouring residuals may resemble each other, so that its rms and χ² may "
        "lie above those of least squares. Weight: the law's share of the evidence (Akaike). Order "
        "test p (Wald–Wolfowitz): how probable it is that residuals in random order change their "
        "sign so seldom, or so often; below 0.01 they have a shape. Durbin–Watson is near 2 for "
        "noise: chance alone gives {low:.2f} to {high:.2f} (2 ± 4/√n, 2σ); less means a shape.",
        low=low,
        high=high,
    )
    return Tabular("spindown-models-compared", quality_table(analysis, QUALITY_IN_WORDS), quality)


def _count(analysis: SpinDownAnalysis) -> tuple[Block, ...]:
    """Return tilt, wobble and correlation in the count beside the spin."""
    found = count_table(analysis)
    if found is None:
        return (Note("The moment of the top is taken to lie along its axis: no u here allows for a tilt of it."),)
    explained = (
        "A counter counts turns about the vertical. A moment that points off the axis by δ makes the top wobble with "
        "its spin, the more the nearer the spin is to the resonance ν_r, and the count is higher than the spin by what "
        "is given for the last reading. K, beside a law's constants, is the size of what nutation adds. Where "
        "neighbouring readings resemble each other they say as much as fewer independent ones."
    )
    shown = Tabular("spindown-count", found, explained)
    is_shown = analysis.combined.tilt is None or is_seen(analysis.combined.tilt)
    if len(found.rows) <= MOST_COUNTS and is_shown:
        return (shown,)
    folded = (replace(shown, table=replace(found, title="")),)
    on_paper: Literal["whole", "out"] = "whole" if is_shown else "out"
    return (Details("What the counter sees of the wobble, run by run", folded, on_paper=on_paper),)


def _run_by_run(analysis: SpinDownAnalysis) -> tuple[Block, ...]:
    """Return straight lines and the best law's fit, a row for each run."""
    combined = analysis.combined
    paper = Text(
        "The fit of the {law} law{decided}, and beside it unweighted straight lines as one draws them on paper "
        "(ln ω, 1/ω, ω^−½ against time).",
        law=law_name(combined.best),
        decided=", the best" if combined.verdict.decided else "",
    )
    several = "s: standard deviation of one run's constant from another's; the uncertainty of the mean is s/√N."
    note = Sentences("ν₀: the spin at the first reading.", several if len(analysis.runs) > 1 else "")
    constants = [one for columns in _of_laws(analysis) for one in columns]
    starts = tuple(run.fit(combined.best).parameters["start_frequency"] for run in analysis.runs)
    start = _Column(_head_of(combined.best, "start_frequency", starts[0].unit), starts)
    times = [_Column(one.head, one.show_all(analysis.runs)) for one in OF_RUN]
    found = _by_run_table(analysis, "", [*constants, start, *times])
    blocks = (Paragraph(paper), Tabular("spindown-runs", found, note, first_column_wraps=True))
    return (
        blocks
        if len(analysis.runs) > 1
        else (Details("Straight lines as one draws them on paper", blocks, on_paper="out"),)
    )


def _constants_table(
    analysis: SpinDownAnalysis, laws: Sequence[CombinedLaw] | None = None, *, short: bool = False
) -> Table:
    """Return the constants of laws, of all by default; short: without start, wobble and nutation of a single run."""
    several = len(analysis.runs) > 1
    heads = ("law", "mean over the runs", "scatter s between the runs") if several else ("law", "constants")
    title = "Drag laws, u of the means from the scatter" if several else "Drag laws"
    rows = [
        Row(_law_cells(analysis, law, short=short), "best" if is_best(analysis, law.name) else "")
        for law in (analysis.combined.fits if laws is None else laws)
    ]
    return table(title, heads, rows)


def _law_cells(analysis: SpinDownAnalysis, law: CombinedLaw, *, short: bool) -> tuple[str, ...]:
    name = Text("{law} (best)", law=law.name) if is_best(analysis, law.name) else law.name
    fit = analysis.runs[0].fit(law.name) if len(analysis.runs) == 1 else None
    constants = [
        Text(
            "{symbol} = {value} (prior)" if fit and is_prior(fit, of) else "{symbol} = {value}",
            symbol=SYMBOLS[of],
            value=with_uncertainty(value),
        )
        for of, value in law_constants(analysis, law.name).items()
        if not short or of in LAWS[law.name].constants
    ]
    if len(analysis.runs) == 1:
        return name, Sentences(*constants, between="\n")
    scatters = [with_uncertainty(s) if (s := scatter(mean)) else "—" for mean in law.constants.values()]
    return name, Sentences(*constants, between="\n"), Sentences(*scatters, between="\n")


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


def _by_run_table(analysis: SpinDownAnalysis, title: str, columns: Sequence[_Column]) -> Table:
    names = [(short_name(source.name), "") for source in analysis.sources]
    if len(analysis.runs) > 1:
        names += [("mean", "together"), ("scatter s", "together")]
    rows = [
        Row((name, *cells), kind) for (name, kind), *cells in zip(names, *(one.cells for one in columns), strict=True)
    ]
    return table(title, ("run", *(one.head for one in columns)), rows)


def _of_laws(analysis: SpinDownAnalysis) -> list[list[_Column]]:
    """Return the constants of the best law's fit, and then those of each straight line."""
    best = analysis.combined.fit(analysis.combined.best)
    fits = [run.fit(best.name).parameters for run in analysis.runs]
    lines = [
        (law, [run.fit(law.name).linearised or {} for run in analysis.runs])
        for law in analysis.combined.fits
        if law.linearised
    ]
    return [
        _of_law(best.name, best.constants, fits),
        *(_of_law(STRAIGHT_LINES[law.name].quantity, law.linearised or {}, found) for law, found in lines),
    ]


def _of_law(of: str, means: Mapping[str, Mean], runs: Sequence[Mapping[str, Estimate]]) -> list[_Column]:
    return [
        _Column(_head_of(of, name, mean.unit), tuple(run[name] for run in runs), mean) for name, mean in means.items()
    ]


def _head_of(of: str, name: str, unit: str) -> str:
    shown = unit_row(unit).text
    head = "{law} fit\n{symbol}{unit}" if of in LAWS else "{line:s} against t\n{symbol}{unit}"
    return Text(head, law=of, line=of, symbol=SYMBOLS[name], unit=f" [{shown}]" if shown else "")


def scatter(mean: Mean) -> Estimate | None:
    """Return the standard deviation between the runs; its own u is s/√(2·dof) (GUM E.4.3)."""
    if mean.scatter is None:
        return None
    return Estimate(mean.scatter, mean.scatter / math.sqrt(2 * mean.degrees_of_freedom), mean.unit)


# --- one input -----------------------------------------------------------------------------------------


def _in_words(source: Source[SpinReadings], fit: SpinDown, options: SpinDownOptions) -> tuple[str, ...]:
    count, outliers = len(source.readings), len(fit.outliers)
    text = how_many(count, "reading")
    if outliers:
        text = Text(
            "{readings}, {outliers} among them, {kept}",
            readings=text,
            outliers=how_many(outliers, "outlier"),
            kept="kept" if options.keep_outliers else "left out",
        )
    t, nu = fit.time, fit.frequency
    span = Text(
        "{first:n} s to {last:n} s, {fast:.2f} Hz to {slow:.2f} Hz",
        first=with_decimals(t[0], 1),
        last=with_decimals(t[-1], 1),
        fast=float(nu[0]),
        slow=float(nu[-1]),
    )
    return Text("{text}; {span}", text=text, span=span), _uncertainty(source, fit, options)


def _uncertainty(source: Source[SpinReadings], fit: SpinDown, options: SpinDownOptions) -> str:
    """Return how large u of a reading is, and where it comes from."""
    if fit.u is None:
        return "u of a reading: not known, taken from the scatter about each law"
    return Text("u of a reading: {u}, {source}", size_of_u(fit.u), origin_of_u(source, "spin_frequency_u_hz", options))


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
        Row((*clocks[i], with_decimals(t, 3), *reading(float(nu), u_, left.get(i))), "outlier" if i in outliers else "")
        for i, (t, nu, u_) in enumerate(zip(readings.time[:shown], readings.frequency[:shown], u, strict=True))
    ]
    residual = Text("Residual: reading − {law} law.", law=law_name(best))
    note = Sentences(residual, first_of(shown, len(readings)))
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
        name = law_name(law.name)
        texts = tuple(Text("{head:n}\nν − {law} law = {off:n} Hz", head, name, off(r, u_)) for head, r, u_ in left)
        yield Points(f"residuals-{law.name}-{k}", texts)
        if law.name == analysis.combined.best:
            yield Points(f"readings-{k}", texts)
            yield Points(f"residuals-best-{k}", texts)


def _fall(source: Source[SpinReadings], fit: SpinDown) -> str:
    """Return the facts of the fall."""
    events = source.run.events() if source.run else []
    said = next((event for event in reversed(events) if event["kind"] == RunEvent.FELL), None)
    if said is None:
        return ""
    return Text(
        "The last reading that was fitted is {hz:.2f} Hz at {time:.1f} s; {said}.",
        hz=float(fit.frequency[-1]),
        time=float(fit.time[-1]),
        said=text_from(said.get("says"), str(said["text"])),
    )


def _falls_in_short(analysis: SpinDownAnalysis, seen: int) -> str:
    """Return between which spins the tops fell."""
    last = sorted(float(run.frequency[-1]) for run in analysis.runs)
    span = Text("{low:.2f} Hz to {high:.2f} Hz, {middle:.2f} Hz in the middle", last[0], last[-1], last[len(last) // 2])
    return Text("Seen in {seen} of {n} runs. The last reading that was fitted is {span}.", seen, len(last), span)
