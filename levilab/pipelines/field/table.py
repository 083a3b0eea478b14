"""Scans of a field → tables."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from analysis.field.fit import LEARNS_NOTHING
from levilab.pipelines.field.quantities import OF_TOPS, QUANTITIES
from levilab.pipelines.part import title_of
from levilab.present.numbers import plain, short_name, with_decimals, with_uncertainty, without_unit
from levilab.present.tables import Row, Table, table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    import numpy as np
    from numpy.typing import NDArray

    from analysis.field.fit import FieldScan
    from analysis.uncertainty import Estimate
    from levilab.pipelines.field.analysis import FieldAnalysis

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
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
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
    return " … ".join(with_decimals(float(end), decimals) for end in (values.min(), values.max()))


def base_table(scan: FieldScan) -> Table:
    """Return what the scan says of the base, beside what was known before."""
    rows = []
    for name, estimate in scan.parameters.items():
        prior = scan.known.prior(name)
        known = [] if prior is None else [replace(estimate, value=prior.value, u=prior.u)]
        found, *before = (with_uncertainty(QUANTITIES[name].show(one)) for one in (estimate, *known))
        rows.append((QUANTITIES[name].shown_symbol, found, "".join(before), _gain(scan, name)))
    return table("The base", ("", "found", "known before", "what the scan adds"), rows)


def _gain(scan: FieldScan, name: str) -> str:
    """Return what the scan adds to what was known."""
    left = scan.learned(name)
    if name not in scan.fitted:
        return "held"
    if left is None:
        return "all of it"
    return "nothing" if left > LEARNS_NOTHING else f"u is {100 * left:.0f} % of what it was"


def follows_table(values: Mapping[str, Estimate]) -> Table:
    """Return what follows for the tops that float there."""
    names = [name for name in OF_TOPS if name in values]
    rows = [(QUANTITIES[name].shown_symbol, with_uncertainty(QUANTITIES[name].show(values[name]))) for name in names]
    return table("What follows for a top", ("", ""), rows or [("no top floats above this base", "")])


def by_run_table(analysis: FieldAnalysis) -> Table:
    """Return the main results, scan by scan, and their means."""
    heads = ["scan", *(QUANTITIES[name].head.replace(" [", "\n[") for name in _BY_RUN)]
    rows = [
        Row((short_name(source.name), *_cells(run.values)))
        for source, run in zip(analysis.sources, analysis.runs, strict=True)
    ]
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


def field_curve(analysis: FieldAnalysis, number: int, _: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return the flux density [T] of the ring fitted to one scan, of heights [m]."""
    return analysis.runs[number].scan.model


def field_curve_u(analysis: FieldAnalysis, number: int, _: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return the standard uncertainty [T] of the flux density fitted to one scan, of heights [m]."""
    return analysis.runs[number].scan.u_model
