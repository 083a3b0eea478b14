"""Spin-downs → uncertainty budgets and result.json."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from analysis.budget import Budget, Component, printed_step, rest, u_of_step
from analysis.numbers import digits
from analysis.spindown.combine import Combined, CombinedLaw
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import SpinDown
from analysis.spindown.lawfit import LawFit, Parts
from analysis.spindown.tilt import PARAMETERS as WOBBLE
from analysis.spindown.verdict import Verdict
from analysis.uncertainty import Estimate, Mean
from levilab.pipelines.budget import bench_clock, direct_row, gate_of, time_base
from levilab.pipelines.document import Analysis, number, statistics_of, value_of, values_of
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.row import find_all
from levilab.pipelines.spindown.analysis import EXPERIMENT, SpinDownAnalysis, combine_sound, fit_source
from levilab.pipelines.spindown.readings import SpinReadings, read_run_readings, read_spin_file
from levilab.pipelines.spindown.report import (
    spindown_columns,
    spindown_curve,
    spindown_curve_u,
    spindown_part,
    spindown_tables,
)
from levilab.pipelines.spindown.words import (
    CORRELATION,
    QUANTITIES,
    SPINDOWN_ROW,
    SYMBOLS,
    is_prior,
    law_name,
    remark,
    verdict_of_run,
)
from levilab.texts.text import Text

#: The law whose exponent is a result beside the constants of the best one.
_POWER, _EXPONENT = "power", "exponent"
#: c of the power law depends exponentially on the exponent: known no better than to itself, it has no budget.
_NOT_DETERMINED = 1.0
#: The longer gate that is proposed, as a factor, and as the part of the time between two readings.
_LONGER, _MOST_OF_INTERVAL = 10.0, 0.8
#: Four times as many runs halve what scatters from one to the next.
_TO_HALVE = 4


# --- one run -------------------------------------------------------------------------------------------


def budget_of_run(source: Source[SpinReadings], run: SpinDown, options: SpinDownOptions) -> tuple[Budget, ...]:
    """Return the budgets of the best law, of laws that fit as well with no more constants, and of the exponent."""
    return tuple(
        Budget(name, estimate.value, estimate.u, estimate.unit, tuple(_rows(source, run, fit, name, options)), fit.name)
        for fit, name in _parameters(run)
        if (estimate := fit.parameters[name]).value is not None and estimate.u and name in fit.parts
    )


def _parameters(run: SpinDown) -> list[tuple[LawFit, str]]:
    best = run.fit(run.best)
    determined = [(best, name) for name in best.parameters if _is_determined(best, name)]
    wanted = [one for one in determined if one[1] not in WOBBLE]
    wobble = [one for one in determined if one[1] in WOBBLE]  # the last, as the readings tell little of it
    as_good = [(run.fit(law), name) for law in _as_good(run.verdict, run.fits) for name in LAWS[law].constants]
    others = [fit for fit in run.fits if fit.name == _POWER and fit is not best]
    return [*wanted, *as_good, *((fit, _EXPONENT) for fit in others), *wobble]


def _as_good(verdict: Verdict, fits: Sequence[LawFit | CombinedLaw]) -> list[str]:
    """Return the laws with constants of their own that fit as well as the best one and have no more of them."""
    count = {fit.name: len(LAWS[fit.name].constants) for fit in fits}
    tied = [name for name in verdict.indistinguishable if name not in {verdict.best, _POWER}]
    return [name for name in tied if count[name] <= count[verdict.best]]


def _is_determined(fit: LawFit, name: str) -> bool:
    value, u = fit.parameters[name].value, fit.parameters[name].u
    return name != "c" or (value is not None and u is not None and u < _NOT_DETERMINED * abs(value))


def _rows(
    source: Source[SpinReadings], run: SpinDown, fit: LawFit, name: str, options: SpinDownOptions
) -> Iterator[Component]:
    estimate, parts = fit.parameters[name], fit.parts[name]
    yield from _of_readings(source, run, fit, name, options)
    yield from _of_model(parts, estimate)
    gate = gate_of(source, EXPERIMENT)
    if gate is not None and parts.gate is not None:
        note: str = Text("the mean over {gate:g} s is higher than the spin in the middle; not corrected", gate=gate)
        yield Component(
            "gate", "gate: a mean over a falling spin", "B", gate**2, "s²", parts.gate / gate**2,
            included=False, note=note, remedy="a shorter gate",
        )  # fmt: skip
    if name in fit.law.constants and name != _EXPONENT:
        note = "one run says nothing of it; the thesis's four differ by 2 %, of which the u of each explains a tenth"
        yield Component(
            "runs", "scatter from run to run", "A", None, estimate.unit, 1.0,
            included=False, note=note, remedy="several runs",
        )  # fmt: skip
    by_counter, by_times = _by_clocks(fit, name)
    value = estimate.value or 0.0
    if by_counter:
        yield time_base(source, "counter", by_counter * value, options.clock_u)
    if by_times:
        yield bench_clock(by_times * value)


def _of_readings(
    source: Source[SpinReadings], run: SpinDown, fit: LawFit, name: str, options: SpinDownOptions
) -> Iterator[Component]:
    """Yield the parts by the readings: their scatter, their digits, and the correlation of neighbours."""
    parts, unit, stated = fit.parts[name], fit.parameters[name].unit, run.u is not None
    if run.u is not None:
        each = float(np.sqrt(np.mean(run.u**2)))
        what, note = "readings, by their stated u", "as given to the analysis" if options.reading_u else ""
    else:
        each = math.sqrt(fit.statistics.rss / max(fit.statistics.degrees_of_freedom, 1))
        what, note = "scatter of the readings", "standard deviation about the law"
    if not each > 0:
        return
    sensitivity = parts.scatter / each
    step = printed_step(run.frequency.tolist()) or 0.0
    rounding, is_part = u_of_step(step), u_of_step(step) < each
    if rounding > 0:
        within = "a part of what a reading scatters" if is_part else "more than the u of a reading"
        yield Component(
            "resolution", "last digit of the readings", "B", rounding, "Hz", sensitivity,
            included=is_part, remedy="more digits",
            note=Text("steps of {step:g} Hz, {within}", step=step, within=within),
        )  # fmt: skip
    own = rest(each, rounding) if is_part else each
    remedy = _better_readings(source)
    yield Component("scatter", what, "B" if stated else "A", own, "Hz", sensitivity, note=note, remedy=remedy)
    if parts.excess > 0:
        chi, law = digits(fit.statistics.reduced_chi_square or 0.0), law_name(fit.name)
        note = Text("χ²/dof = {chi:n} about the {law} law", chi, law)
        remedy = "finding what the law, or the stated u, leaves out"
        yield direct_row("excess", "scatter beyond the stated u", parts.excess, unit, note, remedy, kind="A")
    if (found := run.correlation) and parts.correlation > 0:
        note = Text("ρ = {r:.2f} ± {u:.2f} between neighbours", r=found.value, u=found.u)
        yield direct_row(
            "correlation", "correlation of neighbouring readings", parts.correlation, unit, note,
            "a calmer top, or more runs", kind="A",
        )  # fmt: skip


def _of_model(parts: Parts, estimate: Estimate) -> Iterator[Component]:
    """Yield the parts by the unknown tilt of the top's moment and by its nutation."""
    if parts.tilt > 0:
        note = "what was known of them beforehand, and the readings do not tell"
        remedy = "less noise in the readings, readings until the top falls, and the top's file for --device"
        yield direct_row("tilt", "tilt and nutation of the top", parts.tilt, estimate.unit, note, remedy)


def _by_clocks(fit: LawFit, name: str) -> tuple[float, float]:
    """Return the relative change of a parameter with the rates of the counter's clock and of the clock of the times.

    Where all frequencies are multiplied by 1 + ε and all times by 1 + η, C of ω̇ = −Cωⁿ is by (1 + ε)^(1 − n)/(1 + η).
    """
    if name in {"start_frequency", "resonance", "wobble"}:
        return 1.0, 0.0
    constants = fit.law.constants
    if name not in constants or name == _EXPONENT:
        return 0.0, 0.0
    exponent = fit.parameters[_EXPONENT].value if _EXPONENT in constants else None
    order = fit.law.orders[constants.index(name)] if fit.law.orders else (exponent or 1.0) - 1
    return -order, -1.0


def _better_readings(source: Source[SpinReadings]) -> str:
    """Return advice for better readings, as the end of a sentence."""
    gate, interval = gate_of(source, EXPERIMENT), source.number(EXPERIMENT, "interval_s")
    if gate is None or not interval:
        return "more readings in the same time, or a longer gate"
    longer = min(_LONGER * gate, _MOST_OF_INTERVAL * interval)
    if longer < 2 * gate:
        return Text("more runs: their mean over N is better by √N (the gate, {gate:g} s, can hardly be longer)", gate)
    return Text(
        "a gate of {longer:g} s instead of {gate:g} s, where single pulses scatter, or by more runs", longer, gate
    )


# --- several runs --------------------------------------------------------------------------------------


def budget_of_all(analysis: SpinDownAnalysis) -> tuple[Budget, ...]:
    """Return the budgets of the means over several runs, from the budgets of each."""
    combined = analysis.combined
    best = combined.fit(combined.best)
    laws = [best, *(combined.fit(name) for name in _as_good(combined.verdict, combined.fits))]
    wanted = [(law.name, name, mean) for law in laws for name, mean in law.constants.items() if name != "c"]
    if best.name != _POWER:
        power = next((fit for fit in combined.fits if fit.name == _POWER), None)
        wanted += [(_POWER, _EXPONENT, power.constants[_EXPONENT])] if power else []
    made = (_budget_of_mean(analysis, law, name, mean) for law, name, mean in wanted)
    return tuple(one for one in made if one)


def _budget_of_mean(analysis: SpinDownAnalysis, law: str, name: str, mean: Mean) -> Budget | None:
    """Return u of a mean: the scatter between runs, or what their own u imply if that is more; and what they share."""
    fits = [run.fit(law) for run in analysis.taken]
    n = mean.degrees_of_freedom + 1
    if mean.value is None or not mean.u or mean.scatter is None or n != len(fits):
        return None
    shared = float(np.mean([fit.shared_u.get(name, 0.0) for fit in fits]))
    by_runs = rest(mean.u, shared)
    own = [rest(u, fit.shared_u.get(name, 0.0)) for fit in fits if (u := fit.parameters[name].u)]
    of_readings = float(np.linalg.norm(own)) / n
    remedy = Text("more runs: it takes {more} instead of {n} to halve it", more=_TO_HALVE * n, n=n)
    rows: list[Component] = []
    if of_readings >= by_runs * (1 - 1e-9):
        note: str = Text("the runs scatter by no more ({scatter:n}) than their readings explain", digits(mean.scatter))
        rows.append(
            Component("runs", "readings of the runs", "A", of_readings * math.sqrt(n), mean.unit, 1 / math.sqrt(n),
                      note=note, remedy=remedy)
        )  # fmt: skip
    else:
        note = Text(
            "standard deviation of one run from another, {n} runs; the readings of each are part of it "
            "and alone would leave {rest:n} to the mean",
            n=n,
            rest=digits(of_readings),
        )
        rows.append(
            Component("runs", "scatter between the runs", "A", mean.scatter, mean.unit, by_runs / mean.scatter,
                      note=note, remedy=remedy)
        )  # fmt: skip
    if shared > 0:
        note = "the same in all runs of one top, so that no number of them makes it smaller"
        rows.append(
            direct_row("tilt", "tilt that all runs share", shared, mean.unit, note, "less noise in the readings")
        )
    return Budget(name, mean.value, mean.u, mean.unit, (*rows, *_systematic(analysis, law, name, mean)), law)


def _systematic(analysis: SpinDownAnalysis, law: str, name: str, mean: Mean) -> Iterator[Component]:
    """Yield the effects that are common to all runs and in no u."""
    source, fit = analysis.sources[0], analysis.runs[0].fit(law)
    of_runs = [_row(origin.budget or (), law, name, "gate") for origin in analysis.origins]
    gates = [one for one in of_runs if one and one.u]
    if gates and len(gates) == len(of_runs):
        u = float(np.mean([one.u for one in gates]))
        yield replace(gates[0], u=u, sensitivity=float(np.mean([one.contribution for one in gates])) / u)
    by_counter, by_times = _by_clocks(fit, name)
    if by_counter:
        yield time_base(source, "counter", by_counter * (mean.value or 0.0), analysis.options.clock_u)
    if by_times:
        yield bench_clock(by_times * (mean.value or 0.0))


def _row(budgets: Sequence[Budget], law: str, name: str, row: str) -> Component | None:
    found = (one for one in budgets if (one.model, one.quantity) == (law, name))
    return next((row_ for one in found for row_ in one.components if row_.name == row), None)


def _entries(analysis: SpinDownAnalysis) -> dict[str, Any]:
    combined = analysis.combined
    several = len(analysis.runs) > 1
    if analysis.is_doubtful:
        undecided = replace(combined.verdict, decided=False)
        return {"values": {}, "models": []} | _verdict(combined.best, undecided, analysis.text)
    return {
        "values": _combined_values(combined),
        "models": [_combined_model(fit) for fit in combined.fits] if several else _models(analysis.runs[0]),
    } | _verdict(combined.best, combined.verdict, analysis.text)


def _run_entries(run: SpinDown) -> dict[str, Any]:
    values = values_of(run.fit(run.best).parameters | find_all(QUANTITIES, run))
    return {"values": values, "models": _models(run)} | _verdict(run.best, run.verdict, verdict_of_run(run))


def _verdict(best: str, verdict: Verdict, text: str) -> dict[str, Any]:
    return {
        "best_model": best, "verdict": text, "decided": verdict.decided, "describes": verdict.describes,
    }  # fmt: skip


def _combined_values(combined: Combined) -> dict[str, Any]:
    """Return the constants of the favoured law, and their scatter from run to run."""
    best = combined.fit(combined.best)
    scatter = {
        f"{name}_scatter": number(mean.scatter, mean.unit) | {"runs": mean.degrees_of_freedom + 1}
        for name, mean in best.constants.items()
        if mean.scatter is not None
    }
    tilt = {"moment_tilt": _mean_value(combined.tilt)} if combined.tilt else {}
    return _means(best.constants) | scatter | tilt | values_of(find_all([CORRELATION], combined))


def _combined_model(fit: CombinedLaw) -> dict[str, Any]:
    """Return a law over several runs."""
    return {
        "name": fit.name,
        "parameters": _means(fit.constants),
        "covariance": None,
        "scatter": {name: mean.scatter for name, mean in fit.constants.items()},
        "statistics": statistics_of(fit.statistics),
        "converged": all(each.kind != "not converged" for each in fit.remarks),
        "warnings": [remark(each) for each in fit.remarks],
    } | ({"linearised": _means(fit.linearised)} if fit.linearised else {})


def _models(run: SpinDown) -> list[dict[str, Any]]:
    """Return the laws fitted to one run."""
    return [
        {
            "name": fit.name,
            "parameters": values_of(fit.parameters),
            "covariance": None if fit.covariance is None else fit.covariance.tolist(),
            "statistics": statistics_of(fit.statistics),
            "converged": all(each.kind != "not converged" for each in fit.remarks),
            "priors": [name for name in fit.parameters if is_prior(fit, name)],
            "warnings": [remark(each) for each in fit.remarks],
        }
        | ({"linearised": values_of(fit.linearised)} if fit.linearised else {})
        for fit in run.fits
    ]


def _means(means: Mapping[str, Mean]) -> dict[str, Any]:
    return {name: _mean_value(mean) for name, mean in means.items()}


def _mean_value(mean: Mean) -> dict[str, Any]:
    scatter = {} if mean.scatter is None else {"scatter": mean.scatter, "runs": mean.degrees_of_freedom + 1}
    return value_of(mean) | scatter


def _check(run: SpinDown) -> None:
    """Raise ValueError where the curves of a run cannot be drawn."""
    for fit in run.fits:
        try:
            with np.errstate(all="ignore"):
                drawn = fit.spin_frequency(run.time)
        except (IndexError, ValueError) as error:
            raise ValueError(f"the solution of {fit.name} is of another law") from error
        if drawn.shape != fit.residuals.shape or not np.isfinite(drawn).all():
            raise ValueError(f"the curve of {fit.name} is not one of its readings")


def _check_models(run: SpinDown) -> str:
    unknown = [fit.name for fit in run.fits if fit.name not in LAWS]
    return f"its result has a drag law that this version lacks, {unknown[0]}" if unknown else ""


def _shared_u(run: SpinDown, law: str, name: str, _: float) -> float:
    return next((fit.shared_u.get(name, 0.0) for fit in run.fits if fit.name == law), 0.0)


SPINDOWN = Analysis(
    name="spindown",
    experiments=frozenset({EXPERIMENT}),
    read_file=read_spin_file,
    read_run=read_run_readings,
    kind=SpinDownAnalysis,
    options=SpinDownOptions,
    fit=fit_source,
    combine=combine_sound,
    mixed="a mean over both says nothing about a real top",
    budget_of_run=budget_of_run,
    budget_of_all=budget_of_all,
    finding=SpinDown,
    combination=Combined,
    entries=_entries,
    run_entries=_run_entries,
    check=_check,
    outdated=_check_models,
    tables=spindown_tables,
    part=spindown_part,
    columns=spindown_columns,
    row=SPINDOWN_ROW,
    symbols=SYMBOLS,
    shared_u=_shared_u,
    curve=spindown_curve,
    curve_u=spindown_curve_u,
)
