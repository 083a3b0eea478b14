"""Limits → tables, and their part of a report."""

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from analysis.locked import Cause
from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.limit.analysis import LimitAnalysis, Limits
from levilab.pipelines.limit.readings import LimitReadings
from levilab.pipelines.part import (
    VALUE_U,
    FigureText,
    ReportPart,
    first_of,
    input_parts,
    labels_of,
    size_of_u,
    title_of,
)
from levilab.present.document.blocks import Listing, Paragraph, Points, Tabular
from levilab.present.numbers import off, reading, share, short_name, with_uncertainty, without_unit
from levilab.present.tables import Row, Table, table
from levilab.stability.thesis import ISLANDS_HZ, MEASURED_HZ, MEASURED_U_HZ
from levilab.texts.text import Sentences, Text, how_many

HEADS = ("limits", "tops", "mean [Hz]", "scatter [Hz]", "trend [Hz/top]", "outliers")


def limit_tables(analysis: LimitAnalysis) -> tuple[Table, ...]:
    """Return the runs, and theory beside them where it says something.  Each fits a terminal of 80 columns."""
    theory = theory_table(analysis)
    return (runs_table(analysis), theory) if theory.rows else (runs_table(analysis),)


def runs_table(analysis: LimitAnalysis) -> Table:
    """Return the statistics, run by run and of each kind together."""
    rows = [
        Row((Text("{name:s} ({group})", name=short_name(source.name), group=_group(analysis, k)), *_cells(run)))
        for k, (source, run) in enumerate(analysis.each)
    ]
    rows += [
        Row(
            (
                Text("{n} runs ({group})", n=group.statistics.runs, group=_group(analysis, group.runs[0])),
                *_cells(group),
            ),
            "together",
        )
        for group in analysis.groups
        if len(group.runs) > 1
    ]
    return table(title_of("Limits of the spin", analysis.sources), HEADS, rows, numbers=["tops"])


def _cells(limits: Limits) -> tuple[str, ...]:
    found = limits.statistics
    outliers = ", ".join(str(i + 1) for i in found.outliers) or "none"
    return (
        str(found.n),
        without_unit(found.mean),
        without_unit(found.scatter) if found.scatter else "—",
        without_unit(found.trend) if found.trend else "—",
        outliers if found.trend else "—",
    )


def theory_table(analysis: LimitAnalysis) -> Table:
    """Return what theory says, and how far the mean is from it."""
    rows = [
        Row(
            (
                one.name
                if analysis.number(group) is None
                else Text("{number}: {name}", number=analysis.number(group), name=one.name),
                Text("{hz:.2f}", hz=one.expected),
                without_unit(one.difference),
                Text("{p:n}", p=share(one.p)),
                "—" if one.agrees is None else "yes" if one.agrees else "no",
            )
        )
        for group in analysis.groups
        for one in group.comparisons
    ]
    devices = list(dict.fromkeys(group.device.name for group in analysis.groups))
    top = devices[0] if len(devices) == 1 else Text("{n} kinds of top", n=len(devices))
    heads = ("theory", "[Hz]", "mean − theory [Hz]", "p", "agrees")
    return table(Text("Beside theory, for {top}", top=top), heads, rows)


def _group(analysis: LimitAnalysis, run: int) -> str:
    """Return the group that a run is of: its kind, and its number where there are several, as in result.json."""
    group = next(group for group in analysis.groups if run in group.runs)
    number = analysis.number(group)
    return group.which if number is None else Text("{which} {number}", which=group.which, number=number)


# --- readings as columns of tables for programs ---


def limit_columns(analysis: LimitAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the tops of each run; residual_hz: limit less the mean of the run, which includes outliers."""
    for source, run in analysis.each:
        limit, n = source.readings.limit, len(source.readings)
        given, found = analysis.options.reading_u, run.statistics
        u = np.full(n, np.nan) if source.readings.u is None else source.readings.u
        yield {
            "top": np.arange(1, n + 1),
            "spin_frequency_hz": limit,
            "spin_frequency_u_hz": u if given is None else np.full(n, given),
            "residual_hz": limit - (np.nan if found.mean.value is None else found.mean.value),
            "outlier": np.isin(np.arange(n), found.outliers),
        }


#: Limits printed in the page.
_MOST_SHOWN = 200


def limit_part(analysis: LimitAnalysis) -> ReportPart:
    """Return verdict, statistics, theory, and the limits."""
    n = sum(run.statistics.n for run in analysis.runs)
    theory = theory_table(analysis)
    return ReportPart(
        subject="limits of the spin",
        heading="Limits of the spin of a levitated top",
        lead=how_many(n, "top"),
        result=(
            Paragraph(
                Sentences(*dict.fromkeys(text for group in analysis.groups for text in _meaning(group))),
                "What it means.",
            ),
            Tabular("limit-statistics", runs_table(analysis), _STATISTICS, first_column_wraps=True),
        ),
        figure=FigureText(
            title="Limits of the spin.",
            caption=(
                "The limits top by top with their mean, their scatter and what theory says, and how they are "
                "distributed."
            ),
            points=_points(analysis),
        ),
        runs_title="Beside theory",
        runs=(
            Paragraph("Spins that theory names for the top, and the distance of the mean from them."),
            Tabular("limit-theory", theory, _THEORY, first_column_wraps=True),
        )
        if theory.rows
        else (Paragraph("These spins are no limits of the top, so none is compared with theory."),),
        inputs=input_parts(analysis, _in_words, _readings),
    )


_STATISTICS = Sentences(
    VALUE_U,
    "That of the mean is the standard error: s/√n from the scatter s of the tops, and what the steps of the drive "
    "leave, up to step/√12 where the tops scatter less than that. Several runs of the same conditions have a "
    "random-effects mean, whose standard error holds the scatter between them; runs of other conditions are no "
    "repetitions, and stand apart. Trend: slope of a straight line through the limits of a run. Outliers by Grubbs's "
    "test, 1 %; the mean includes them.",
)
_THEORY = (
    "p: how probable so large a difference is by chance (Student's t); below 0.05 it is called a difference. The "
    "linear window holds for small motions of a top without drag; the resonance is that of a wobble that turns with "
    "the top, which a moment that is not along the axis keeps up."
)


def _in_words(source: Source[LimitReadings], run: Limits, *_: object) -> tuple[str, ...]:
    limit, u = source.readings.limit, source.readings.u
    span = Text(
        "{limits}, {low:.2f} Hz to {high:.2f} Hz",
        limits=how_many(run.statistics.n, f"{run.which} limit"),
        low=float(limit.min()),
        high=float(limit.max()),
    )
    return span, Text("u of a limit: {u}", u="not known" if u is None else size_of_u(u))


def _readings(source: Source[LimitReadings], run: Limits, *_: object) -> tuple[Listing]:
    """Return the limits; rows of number, limit, u and its distance from the mean of the run [Hz]."""
    limit, u = source.readings.limit, source.readings.u
    shown = min(limit.size, _MOST_SHOWN)
    heads = ("top", "limit [Hz]", "u [Hz]", "− mean [Hz]")
    mean = run.statistics.mean.value
    rows = [
        Row(
            (str(i + 1), *reading(x, None if u is None else float(u[i]), None if mean is None else x - mean)),
            "outlier" if i in run.statistics.outliers else "",
        )
        for i, x in enumerate(limit[:shown].tolist())
    ]
    return (Listing("limit-readings", table("Limits", heads, rows, numbers=heads), first_of(shown, limit.size)),)


def _points(analysis: LimitAnalysis) -> tuple[Points, ...]:
    """Return what each top of the figure answers."""
    each = zip(labels_of(analysis.sources), analysis.sources, analysis.runs, strict=True)
    return tuple(
        Points(
            f"readings-{run.which}-{k}",
            tuple(_point(name, source.readings, run, i) for i in range(source.readings.limit.size)),
        )
        for k, (name, source, run) in enumerate(each)
    )


def _point(name: str, readings: LimitReadings, run: Limits, i: int) -> str:
    limit, mean = float(readings.limit[i]), run.statistics.mean.value
    u = None if readings.u is None else float(readings.u[i])
    lines = [
        name,
        Text("top {limit:n}", limit=i + 1),
        Text("limit = {limit:n}", limit=with_uncertainty(Estimate(limit, u, "Hz"))),
    ]
    lines += [] if mean is None else [Text("limit − mean = {off:n} Hz", off=off(limit - mean, u))]
    return Sentences(*lines, between="\n")


# --- what it means ---

#: The limit → why there is one.
_WHY = MappingProxyType({
    "lower": "below it the top spins too slowly to be upright, and the field turns it over",
    "upper": "above it the top is so stiff that its axis no longer follows the field, or the drive "
    "cannot take it along",
})  # fmt: skip


#: Cause of a loss → its meaning for drive and top.
_CAUSES = MappingProxyType({
    Cause.LEFT_BEHIND: "Where a top was left behind, its lag behind the drive grew past a quarter turn and ran away: "
    "drag, the creep and the swing about the drive took more than the drive gives; a stronger drive gets higher.",
    Cause.OUT_OF_WINDOW: "Where a top left the window, the drive held it until it fell: no drive gets much higher.",
})  # fmt: skip


def _meaning(group: Limits) -> Iterator[str]:
    """Yield the meaning of a limit in sentences that a student understands."""
    found = group.statistics
    mean = found.mean
    if mean.value is None:
        return
    if group.conditions.levels_off:
        yield Text(
            "The drive pulls no further than {spin:n}: there the drag of the air is as large as its "
            "pull. This is no limit of the top; a stronger drive gets higher.",
            spin=with_uncertainty(mean),
        )
        return
    yield Text("The {which} limit is {limit:n}: {why}.", group.which, with_uncertainty(mean), _WHY[group.which])
    yield from (_CAUSES[cause] for cause in _CAUSES if group.causes.get(cause))
    if group.which == "upper" and group.device.is_thesis and ISLANDS_HZ[0] < mean.value < ISLANDS_HZ[1]:
        yield Text(
            "From {low:g} to {high:g} Hz a simulated top without a drive is up or lost by its start "
            "(islands), so a top that falls there has met no edge.",
            low=ISLANDS_HZ[0],
            high=ISLANDS_HZ[1],
        )
    if found.scatter is None or not found.scatter.value or not mean.u:
        yield "How far another top's limit lies from that one top does not say."
        return
    ratio = found.scatter.value / mean.u
    yield Text(
        "One top is lost {hz:n} Hz from another, so a single one may be off by that much.", digits(found.scatter.value)
    )
    if ratio > 1:
        yield Text("The mean of {n} is {times:n} times as good.", n=found.n, times=digits(ratio))
    else:
        yield Text(
            "The mean of {n} is known to {hz:n} Hz only: the drive's steps, or runs that differ, add to u and do not "
            "become less by more tops.",
            n=found.n,
            hz=digits(mean.u),
        )
    if group.which == "lower":
        value, u = MEASURED_HZ, MEASURED_U_HZ
        away = abs(mean.value - value) / math.hypot(mean.u, u)
        said = "which agrees" if away < 2 else Text("{away:n} u from it: another top, or mass", away=digits(away))
        yield Text("The thesis's ten tops have {spin:n}, {said}.", with_uncertainty(Estimate(value, u, "Hz")), said)
