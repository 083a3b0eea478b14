"""Spin-downs → tables, for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.numbers import digits
from analysis.spindown.drag import LAWS
from analysis.spindown.tilt import PARAMETERS as WOBBLE
from analysis.spindown.tilt import count_of
from levilab.pipelines.part import title_of
from levilab.pipelines.row import cells_of
from levilab.pipelines.spindown.laws import STRAIGHT_LINES, SYMBOLS
from levilab.pipelines.spindown.quantities import OF_RUN
from levilab.present.numbers import (
    column,
    plain,
    share,
    short_name,
    with_uncertainty,
    without_unit,
)
from levilab.present.tables import Row, Table, table
from levilab.present.units import unit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from analysis.spindown.lawfit import LawFit
    from analysis.spindown.selection import Statistics
    from analysis.uncertainty import Estimate
    from levilab.pipelines.spindown.analysis import SpinDownAnalysis

    Array = NDArray[np.float64]

#: How well a law fits: heads for 80 columns, and in words.
QUALITY = ("constants", "rms [Hz]", "χ²/dof", "ΔAICc", "weight", "order p", "DW")
QUALITY_IN_WORDS = (*QUALITY[:5], "order test p", "Durbin–Watson")
#: Below it ΔAICc has a digit behind the point: only there does it decide anything.
_WITH_TENTHS = 100.0


def spindown_tables(analysis: SpinDownAnalysis) -> tuple[Table, ...]:
    """Return the runs, the laws, how well they fit, the straight lines.  Each fits a terminal of 80 columns."""
    quality = quality_table(analysis, QUALITY)
    count = count_table(analysis, symbols=True)
    return _runs_table(analysis), _laws_table(analysis), quality, *([count] if count else []), _lines_table(analysis)


def _runs_table(analysis: SpinDownAnalysis) -> Table:
    rows = [
        (
            source.name,
            str(len(run.time)),
            *cells,
            f"{run.frequency[0]:.2f} → {run.frequency[-1]:.2f}",
            run.best if run.verdict.decided else "undecided",
        )
        for source, run, *cells in zip(analysis.sources, analysis.runs, *cells_of(OF_RUN, analysis.runs), strict=True)
    ]
    heads = ("run", "readings", *(one.head for one in OF_RUN), "spin [Hz]", "best law")
    return table(title_of("Spin-down", analysis.sources), heads, rows, numbers=["readings"])


def _laws_table(analysis: SpinDownAnalysis) -> Table:
    of = "" if len(analysis.runs) == 1 else f", means over {len(analysis.runs)} runs, u from their scatter"
    rows = [
        (
            fit.name,
            "best" if is_best(analysis, fit.name) else "",
            "\n".join(_equations(law_constants(analysis, fit.name))),
        )
        for fit in analysis.combined.fits
    ]
    return table(f"Drag laws{of}", ("law", "", "constants"), rows)


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
_WOBBLE_SYMBOLS = "δ: tilt of the moment; ν_r: resonance, below the last reading"
_NUTATION = "; K, with the laws: nutation"


def count_table(analysis: SpinDownAnalysis, *, symbols: bool = False) -> Table | None:
    """Return tilt, wobble and correlation in the count, and the effective number of readings; None: none is seen."""
    if not any(run.has_tilt or run.is_correlated for run in analysis.runs):
        return None
    heads = ("run", "δ [rad]", "ν_r [Hz]", "adds at the end [Hz]", "correlation", "count as")
    rows = []
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
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
                    plain(float(added[-1]), 2) if tilt else "—",
                    f"{rho:.2f} ± {seen.u:.2f}" if seen else "none",
                    f"{digits(n * (1 - rho) / (1 + rho))} of {n}" if seen else f"{n}",
                )
            )
        )
    tilted = any(run.has_tilt for run in analysis.runs)
    title = "What the counter sees of the wobble, by the best law"
    if tilted and symbols:
        title += f". {_WOBBLE_SYMBOLS}{_NUTATION if len(analysis.runs) == 1 else ''}"
    return table(title, heads, rows)


def tilt_part(fit: LawFit, time: Array) -> Array:
    """Return the share of tilt and wobble in the count at some times [Hz], shape (n,); zeros without them."""
    p = len(fit.law.parameters)
    tau = (time - fit.start_time) / fit.reference[1]
    spin: Array = fit.reference[0] * count_of(fit.law, tau, fit.solution[:p], fit.top)
    return fit.spin_frequency(time) - spin


def _lines_table(analysis: SpinDownAnalysis) -> Table:
    """Return the thesis's straight lines, run by run, beside the fit of the favoured law."""
    best = analysis.combined.fit(analysis.combined.best)
    lines = [fit for fit in analysis.combined.fits if fit.linearised]
    heads = [f"{STRAIGHT_LINES[fit.name].quantity}\n{_head(fit.linearised or {})}" for fit in lines]
    means = [_first(fit.linearised or {}) for fit in lines] + [_first(best.constants)]
    of_runs = [
        [_first(run.fit(fit.name).linearised or {}) for fit in lines]
        + [run.fit(best.name).parameters[next(iter(best.constants))]]
        for run in analysis.runs
    ]
    several = len(analysis.runs) > 1
    columns = [column(cells) for cells in zip(*of_runs, *([means] if several else []), strict=True)]
    names = [*(short_name(source.name) for source in analysis.sources), *(["mean"] if several else [])]
    rows = [
        Row((name, *cells), "together" if several and name is names[-1] else "")
        for name, *cells in zip(names, *columns, strict=True)
    ]
    title = f"Run by run: unweighted straight lines, and the fit of the {best.name} law"
    return table(title, ("run", *heads, f"{best.name} fit\n{_head(best.constants)}"), rows)


def _equations(estimates: Mapping[str, Estimate]) -> list[str]:
    return [f"{SYMBOLS[name]} = {with_uncertainty(estimate)}" for name, estimate in estimates.items()]


def _head(estimates: Mapping[str, Estimate]) -> str:
    name, estimate = next(iter(estimates.items()))
    return f"{SYMBOLS[name]} [{unit(estimate.unit).text}]"


def _first(estimates: Mapping[str, Estimate]) -> Estimate:
    return next(iter(estimates.values()))


# --- readings as columns of tables for programs ---


def spindown_columns(analysis: SpinDownAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the readings of each run; residual_hz: reading less the best law of all runs, NaN for unused readings."""
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
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
