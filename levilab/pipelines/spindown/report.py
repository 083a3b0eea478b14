"""Spin-downs → their part of a report."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.pipelines.part import InputPart, ReportPart
from levilab.pipelines.spindown.laws import SYMBOLS
from levilab.pipelines.spindown.table import (
    QUALITY_IN_WORDS,
    count_table,
    is_best,
    law_constants,
    quality_table,
    straight_quantity,
)
from levilab.present.clock import with_clock
from levilab.present.numbers import column, ends, in_words, short_name, with_uncertainty
from levilab.present.tables import Row, Table, table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from analysis.spindown.combine import CombinedLaw, Mean
    from analysis.spindown.fit import SpinDown
    from levilab.pipelines.sources import Source
    from levilab.pipelines.spindown.analysis import SpinDownAnalysis, SpinDownOptions
    from levilab.pipelines.spindown.readings import Readings

#: Readings printed in the page; more stay in the run folder.  They stand in blocks side by side.
MOST_READINGS, BLOCK = 200, 10
#: Most falls that are listed; of more the range is given.
MOST_FALLS = 8
#: The event that says when the top fell.
FELL = "fell"


def spindown_part(analysis: SpinDownAnalysis) -> ReportPart:
    """Verdict, laws, how well they fit, the constants run by run, and the readings."""
    combined, several = analysis.combined, len(analysis.runs) > 1
    n = combined.fit(combined.best).statistics.n
    falls = [
        (short_name(source.name), fall)
        for source, run in zip(analysis.sources, analysis.runs, strict=True)
        if (fall := _fall(source, run))
    ]
    asked = {origin.options.uncertainty for origin in analysis.origins} - {"covariance"}
    return ReportPart(
        subject="spin-down",
        heading="Spin-down of a levitated top",
        lead=f"{n} readings used",
        figure_text="Readings with all drag laws, residuals of each law, and straight lines",
        template="pipelines/spindown/report.html.j2",
        context={
            "several": several,
            "verdict": combined.verdict.text,
            "best": combined.best + " law" + (", the best" if combined.verdict.decided else ""),
            "falls": falls,
            "all_falls": _falls_in_short(analysis, len(falls)) if len(falls) > MOST_FALLS else "",
            "laws": _laws_table(analysis),
            "quality": quality_table(analysis, QUALITY_IN_WORDS),
            "count": count_table(analysis),
            "by_run": _by_run_table(analysis),
            "intervals": " and ".join(sorted(asked)),
            "durbin_watson": (max(2 - 4 / math.sqrt(n), 0), min(2 + 4 / math.sqrt(n), 4)),
        },
        inputs=tuple(
            InputPart(
                _in_words(source, run, origin.options),
                origin.text,
                run.verdict.text,
                _readings(source, run, origin.options),
            )
            for source, run, origin in zip(analysis.sources, analysis.runs, analysis.origins, strict=True)
        ),
    )


# --- tables --------------------------------------------------------------------------------------------


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
        f"{SYMBOLS[of]} = {with_uncertainty(value)} {interval(value)}".rstrip()
        for of, value in law_constants(analysis, law.name).items()
    ]
    if len(analysis.runs) == 1:
        return name, "\n".join(constants)
    scatters = [with_uncertainty(s) if (s := scatter(mean)) else "—" for mean in law.constants.values()]
    return name, "\n".join(constants), "\n".join(scatters)


def interval(estimate: Estimate) -> str:
    """The 68 % interval where one was asked for."""
    found = ends(estimate)
    return f"[{found[0]} … {found[1]}]" if found else ""


@dataclass(frozen=True)
class _Column:
    """A constant, run by run.  head: where it comes from, its symbol and unit; estimates: one a run."""

    head: str
    estimates: tuple[Estimate, ...]
    mean: Mean | None = None

    @property
    def cells(self) -> list[str]:
        """The runs, with their intervals; of several runs mean and scatter, empty where there is none."""
        together = [self.mean, scatter(self.mean) if self.mean else None] if len(self.estimates) > 1 else []
        shown = column([*self.estimates, *together])
        intervals = [interval(one) for one in self.estimates] + [""] * len(together)
        return [
            f"{cell}\n{more}".rstrip() if cell != "—" or more else ""
            for cell, more in zip(shown, intervals, strict=True)
        ]


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
    """The straight lines' constants and those of the best law's fit."""
    combined, columns = analysis.combined, []
    for law in combined.fits:
        if law.linearised:
            lines = [run.fit(law.name).linearised or {} for run in analysis.runs]
            columns += _of_law(f"{straight_quantity(law.name)} against t", law.linearised, lines)
    best = combined.fit(combined.best)
    fits = [run.fit(best.name).parameters for run in analysis.runs]
    starts = tuple(fit["start_frequency"] for fit in fits)
    columns.append(_Column(_head(f"{best.name} fit", "start_frequency", starts[0].unit), starts))
    return columns + _of_law(f"{best.name} fit", best.constants, fits)


def _of_law(of: str, means: Mapping[str, Mean], runs: Sequence[Mapping[str, Estimate]]) -> list[_Column]:
    return [_Column(_head(of, name, mean.unit), tuple(run[name] for run in runs), mean) for name, mean in means.items()]


def _head(of: str, name: str, unit: str) -> str:
    shown = in_words(unit)
    return f"{of}\n{SYMBOLS[name]}" + (f" [{shown}]" if shown else "")


def scatter(mean: Mean) -> Estimate | None:
    """Standard deviation between the runs; its own u is s/√(2·dof) (GUM E.4.3)."""
    if mean.scatter is None:
        return None
    return Estimate(mean.scatter, mean.scatter / math.sqrt(2 * mean.degrees_of_freedom), mean.unit)


# --- one input -----------------------------------------------------------------------------------------


def _in_words(source: Source[Readings], fit: SpinDown, options: SpinDownOptions) -> tuple[str, ...]:
    count, outliers = len(source.readings), len(fit.outliers)
    text = f"{count} readings"
    if outliers:
        text += f", {outliers} of them outlier{'s' * (outliers > 1)}, {'kept' if options.keep_outliers else 'left out'}"
    t, nu = fit.time, fit.frequency
    span = f"{t[0]:.1f} s to {t[-1]:.1f} s, {nu[0]:.2f} Hz to {nu[-1]:.2f} Hz"
    return f"{text}; {span}", _uncertainty(source, fit, options)


def _uncertainty(source: Source[Readings], fit: SpinDown, options: SpinDownOptions) -> str:
    """How large u of a reading is, and where it comes from."""
    if fit.u is None:
        return "u of a reading: not known, taken from the scatter about each law"
    low, high = float(fit.u.min()), float(fit.u.max())
    size = f"{digits(low)} Hz" if low == high else f"{digits(low)} Hz to {digits(high)} Hz"
    if options.reading_u is not None:
        return f"u of a reading: {size}, as given to the analysis"
    channels = source.run.record.channels if source.run else []
    origin = next((c.get("source") for c in channels if c.get("name") == "spin_frequency_u_hz"), None)
    return f"u of a reading: {size}, {origin or 'from a column of the data'}"


def _readings(source: Source[Readings], fit: SpinDown, options: SpinDownOptions) -> Mapping[str, object]:
    """The first readings in blocks; rows of clock time, if it is known, time [s], spin [Hz] and u [Hz]."""
    readings, given_u = source.readings, options.reading_u
    shown = min(len(readings), MOST_READINGS)
    u = [given_u] * shown if readings.u is None or given_u is not None else readings.u[:shown].tolist()
    outliers = frozenset(fit.outliers)
    heads, clocks = with_clock(source.time_zero, readings.time[:shown].tolist(), ("t [s]", "ν [Hz]", "u [Hz]"))
    rows = [
        Row(
            (*clocks[i], f"{t:.3f}", f"{nu:.5f}", "—" if u_ is None else f"{digits(u_)}"),
            "outlier" if i in outliers else "",
        )
        for i, (t, nu, u_) in enumerate(zip(readings.time[:shown], readings.frequency[:shown], u, strict=True))
    ]
    blocks = [table("", heads, rows[k : k + BLOCK], numbers=heads) for k in range(0, shown, BLOCK)]
    return {"blocks": blocks, "shown": shown, "count": len(readings)}


def _fall(source: Source[Readings], fit: SpinDown) -> str:
    """What was seen of the fall."""
    events = source.run.events() if source.run else []
    text = next((str(event["text"]) for event in reversed(events) if event["kind"] == FELL), None)
    if text is None:
        return ""
    return f"{text}; last reading that was fitted {fit.frequency[-1]:.2f} Hz at {fit.time[-1]:.1f} s"


def _falls_in_short(analysis: SpinDownAnalysis, seen: int) -> str:
    """Between which spins the tops fell."""
    last = sorted(float(run.frequency[-1]) for run in analysis.runs)
    span = f"{last[0]:.2f} Hz to {last[-1]:.2f} Hz, {last[len(last) // 2]:.2f} Hz in the middle"
    return f"Seen in {seen} of {len(last)} runs. The last reading that was fitted is {span}"
