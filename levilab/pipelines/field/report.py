"""Scans of a field → tables, and their part of a report."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.field.fit import LEARNS_NOTHING, FieldScan
from analysis.field.ring import on_axis
from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.pipelines.field.analysis import FieldAnalysis, FieldRun
from levilab.pipelines.field.readings import FieldReadings
from levilab.pipelines.field.words import OF_TOPS, QUANTITIES
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.part import VALUE_U, FigureText, ReportPart, first_of, input_parts, points_of, title_of
from levilab.present.document.blocks import Block, Listing, Note, Paragraph, Section, Tabular
from levilab.present.numbers import off, plain, short_name, with_decimals, with_sign, with_uncertainty, without_unit
from levilab.present.tables import Row, Table, table
from levilab.texts.text import Sentences, Text

#: What is shown of several scans, a row each.
_BY_RUN = ("strength", "origin", "lightest_mass", "heaviest_mass", "mass_to_set")


def field_tables(analysis: FieldAnalysis) -> tuple[Table, ...]:
    """Return the scans, the base, and what follows.  Each fits a terminal of 80 columns."""
    if len(analysis.runs) > 1:
        return scans_table(analysis), by_run_table(analysis), follows_table(analysis.values)
    return scans_table(analysis), base_table(analysis.runs[0].scan), follows_table(analysis.values)


def scans_table(analysis: FieldAnalysis) -> Table:
    """Return what was measured, and how well the model fits."""
    rows = []
    for source, run in analysis.each:
        scan, statistics = run.scan, run.scan.statistics
        rows.append(
            (
                short_name(source.name),
                str(statistics.n),
                _range(1e2 * scan.height, 2),
                _range(1e3 * scan.flux_density, 3),
                plain(1e6 * statistics.rms_residual),
                plain(statistics.reduced_chi_square),
                plain(statistics.runs_test_p, 2),
            )
        )
    heads = ("scan", "readings", "heights [cm]", "field [mT]", "rms [µT]", "χ²/dof", "order p")
    numbers = ("readings", "rms [µT]", "χ²/dof", "order p")
    return table(title_of("Field of the base", analysis.sources, "scan"), heads, rows, numbers=numbers)


def _range(values: NDArray[np.float64], decimals: int) -> str:
    """Return the least and the greatest value, which need not be the first and the last."""
    least, greatest = (with_decimals(float(end), decimals) for end in (values.min(), values.max()))
    return Text("{least:n} … {greatest:n}", least=least, greatest=greatest)


def base_table(scan: FieldScan) -> Table:
    """Return what the scan says of the base, beside what was known before."""
    rows = []
    for name, estimate in scan.parameters.items():
        prior = scan.known.prior(name)
        known = [] if prior is None else [replace(estimate, value=prior.value, u=prior.u)]
        found, *before = (with_uncertainty(QUANTITIES[name].show(one)) for one in (estimate, *known))
        rows.append((QUANTITIES[name].shown_symbol, found, *(before or [""]), _gain(scan, name)))
    return table("The base", ("", "found", "known before", "what the scan adds"), rows)


def _gain(scan: FieldScan, name: str) -> str:
    """Return what the scan adds to what was known."""
    left = scan.learned(name)
    if name not in scan.fitted:
        return "held"
    if left is None:
        return "all of it"
    return "nothing" if left > LEARNS_NOTHING else Text("u is {percent:.0f} % of what it was", percent=100 * left)


def follows_table(values: Mapping[str, Estimate]) -> Table:
    """Return what follows for the tops that float there."""
    names = [name for name in OF_TOPS if name in values]
    rows = [(QUANTITIES[name].shown_symbol, with_uncertainty(QUANTITIES[name].show(values[name]))) for name in names]
    return table("What follows for a top", ("", ""), rows or [("no masses and no spins follow from this scan", "")])


def by_run_table(analysis: FieldAnalysis) -> Table:
    """Return the main results, scan by scan, and their means."""
    heads = ["scan", *(QUANTITIES[name].head.replace(" [", "\n[") for name in _BY_RUN)]
    rows = [Row((short_name(source.name), *_cells(run.values))) for source, run in analysis.each]
    if len(analysis.runs) > 1:
        rows.append(Row(("mean", *_cells(analysis.values)), "together"))
    return table("Scan by scan", heads, rows)


def _cells(values: Mapping[str, Estimate]) -> list[str]:
    return [without_unit(QUANTITIES[name].show(values[name])) if name in values else "—" for name in _BY_RUN]


# --- readings as columns of tables for programs ---


def field_columns(analysis: FieldAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the readings of each scan by rising height; flux_density_u_t contains the uncertainty of the height."""
    for run in analysis.runs:
        scan = run.scan
        yield {
            "height_m": scan.height,
            "flux_density_t": scan.flux_density,
            "flux_density_u_t": scan.u,
            "residual_t": scan.residuals,
        }


#: Readings printed in the page; more stay in the run folder.
MOST_READINGS = 200


def field_part(analysis: FieldAnalysis) -> ReportPart:
    """Return what the scans say, the base, what follows, and the readings."""
    several = len(analysis.runs) > 1
    means = "Of several scans these are means; what is common to them makes no mean more certain." if several else ""
    return ReportPart(
        subject="field of the base",
        heading="Field of the base on its axis",
        lead=Text("{n} heights measured", n=sum(run.scan.statistics.n for run in analysis.runs)),
        result=(
            Paragraph(Sentences(*_meaning(analysis)), "What it means."),
            Tabular("field-follows", follows_table(analysis.values), Sentences(*_FOLLOWS.each, means)),
            Tabular("field-scans", scans_table(analysis), _SCANS, first_column_wraps=True),
        ),
        values=(Tabular("field-follows", follows_table(analysis.values), VALUE_U),),
        figure=FigureText(
            title="Field of the base.",
            caption=(
                "Flux density against height with the fitted ring, what the fit leaves over, and the masses and spins "
                "of tops that float in this field."
            ),
            points=points_of(analysis, _points, "readings", "residuals"),
        ),
        runs_title="Scan by scan" if several else "The base",
        runs=_bases(analysis),
        inputs=input_parts(analysis, _in_words, _readings),
    )


_FOLLOWS = Sentences(
    VALUE_U,
    "All of what calliper, scales and scan leave open is in it, to first order. Masses and heights are those at which "
    "a moment that follows the field is stable; spins those at which small motions of the whole top stay small, for a "
    "top of the mass to set.",
)
_SCANS = (
    "χ²/dof is near 1 where the fit leaves nothing but the uncertainties. Order p: the order test (Wald–Wolfowitz); a "
    "small one, below 0.01 say, means that the residuals have a shape."
)
_BASE = (
    "Known before: by calliper and data sheet. Held: not moved by the fit; what the calliper leaves open of it is in "
    "the uncertainties of the others."
)


def _bases(analysis: FieldAnalysis) -> tuple[Block, ...]:
    """Return the base as each scan finds it."""
    if len(analysis.runs) == 1:
        return (Tabular("field-base", replace(base_table(analysis.runs[0].scan), title=""), _BASE),)
    bases = (
        Section(source.name, (Tabular("field-base", replace(base_table(run.scan), title="")),))
        for source, run in analysis.each
    )
    by_run = Tabular("field-runs", replace(by_run_table(analysis), title=""), first_column_wraps=True)
    return by_run, *bases, Note(_BASE)


def _in_words(_: Source[FieldReadings], run: FieldRun, *__: object) -> tuple[str, ...]:
    scan = run.scan
    low, high = 1e2 * scan.height[0], 1e2 * scan.height[-1]
    text = Text(
        "{n} heights, {low:n} cm to {high:n} cm", scan.statistics.n, with_decimals(low, 2), with_decimals(high, 2)
    )
    u = Text("u of a reading against the fit: {low:.0f} µT to {high:.0f} µT", 1e6 * scan.u.min(), 1e6 * scan.u.max())
    return text, Text("{u}, that of its height included", u=u)


def _readings(_: Source[FieldReadings], run: FieldRun, *__: object) -> tuple[Listing]:
    """Return the first readings; rows of height [cm], flux density [mT] and residual [u]."""
    scan = run.scan
    shown = min(len(scan.height), MOST_READINGS)
    scaled = scan.residuals / scan.u
    rows = [
        (with_decimals(1e2 * z, 3), with_decimals(1e3 * b, 4), with_sign(float(r), 1))
        for z, b, r in zip(scan.height[:shown], scan.flux_density[:shown], scaled[:shown], strict=True)
    ]
    heads = ("z [cm]", "B [mT]", "residual [u]")
    note = Sentences("Residual: reading − fit, in units of u.", first_of(shown, len(scan.height)))
    return (Listing("field-readings", table("Readings", heads, rows, numbers=heads), note),)


def _points(run: FieldRun) -> Iterator[tuple[str, ...]]:
    """Yield the lines of each reading of the figure."""
    scan = run.scan
    for z, b, u, residual in zip(scan.height, scan.flux_density, 1e3 * scan.u, 1e3 * scan.residuals, strict=True):
        field = Estimate(1e3 * float(b), float(u), "mT")
        left = off(float(residual), float(u))
        yield (
            Text("z = {z:n} cm", z=with_decimals(1e2 * z, 3)),
            Text("B = {z:n}", z=with_uncertainty(field)),
            Text("B − fit = {z:n} mT", z=left),
        )


# --- what it means ---

#: Where the thesis's top floats [m].
_HEIGHT_M = 0.073


def _meaning(analysis: FieldAnalysis) -> Iterator[str]:
    """Yield the meaning of the first scan in sentences that a student understands."""
    scan = analysis.runs[0].scan
    strength = analysis.values["strength"]
    if not strength.value or not strength.u:
        return
    b, slope = (float(each[0]) for each in on_axis(scan.ring, np.array([_HEIGHT_M]))[:2])
    yield Text(
        "The base is as strong as ρ = {strength:n}, known to {percent:n} %; {height:g} cm up that is "
        "{mt:n} mT, and {less:n} mT less for each centimetre higher.",
        strength=with_uncertainty(QUANTITIES["strength"].show(strength)),
        percent=digits(100 * strength.u / abs(strength.value)),
        height=1e2 * _HEIGHT_M,
        mt=plain(abs(1e3 * b)),
        less=plain(abs(10 * slope)),
    )
    yield "What the base holds up is in proportion to its strength: 1 % stronger, and the top weighs 1 % more."
    reduced = scan.statistics.reduced_chi_square
    if reduced is None:
        yield "Uncertainties of readings or heights are not given, so whether a ring describes the field is not tested."
    elif all(remark.kind != "scan scatters" for remark in scan.remarks):
        yield Text("A uniform ring describes the readings to their uncertainties (χ²/dof = {chi:n}).", digits(reduced))
    else:
        yield Text(
            "A uniform ring leaves more than the uncertainties explain (χ²/dof = {chi:n}): the magnet is "
            "not uniform, or the probe was off the axis, or a size is wrong.",
            chi=digits(reduced),
        )
