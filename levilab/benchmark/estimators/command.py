"""`levilab benchmark estimators`: measures, prints two tables, writes JSON and the figure."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from levilab.benchmark.estimators.study import OURS, Study, as_document, study
from levilab.benchmark.found import give, tell
from levilab.errors import UsageError
from levilab.present.terminal import new_table, terminal

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from levilab.present.style import Figure


def run_and_tell(*, trials: int, cases: Sequence[str], seed: int, out: Path | None, as_json: bool) -> None:
    """Carry out the whole command.  Raises CannotWrite, and UsageError for a case that is none."""
    if cases and out:
        raise UsageError("out", "`out` keeps a figure of all cases: leave `case` away, or take `json` for the numbers")
    found = study(trials=trials, cases=cases, seed=seed, tell=tell)

    def draw() -> Figure:
        from levilab.benchmark.estimators.figure import estimators_figure

        return estimators_figure(found)

    give("estimators", as_document(found), partial(print_study, found), draw, out=out, as_json=as_json)


def print_study(found: Study) -> None:
    """RMSE over the bound by method and SNR; and the hard cases."""
    console = terminal()
    columns = [f"{snr:g} dB" for snr in dict.fromkeys(score.snr_db for score in found.scores)]
    title = f"RMSE of the frequency over the Cramér–Rao bound, {found.trials} traces each (failures)"
    shown = new_table(title, "", *columns, "MS/s", numbers=(*columns, "MS/s"))
    for name in dict.fromkeys(score.name for score in found.scores):
        scores = [score for score in found.scores if score.name == name]
        cells = [_ratio(score.rmse_over_bound) + (f" ({score.failures})" if name in OURS else "") for score in scores]
        speeds = [1e-6 * (score.samples_per_s or math.nan) for score in scores]
        shown.add_row(name, *cells, f"{min(speeds):.0f} to {max(speeds):.0f}")
    if found.scores:
        console.print(shown)
    numbers = ("failures", "covered", "pulls", "kurtosis", "RMSE / bound", "ms a trace")
    shown = new_table(f"Hard cases at 20 dB, {found.trials} traces each, the default", "", *numbers, numbers=numbers)
    for score in found.hard:
        covered = "–" if score.coverage is None else f"{100 * score.coverage:.1f} %"
        ratio = "–" if math.isnan(score.rmse_over_bound) else f"{score.rmse_over_bound:.2f}"
        pulls = f"{_number(score.pull_mean, '+.2f')} ± {_number(score.pull_sd, '.2f')}"
        kurtosis = _number(score.pull_kurtosis, "+.1f")
        shown.add_row(score.name, str(score.failures), covered, pulls, kurtosis, ratio, f"{score.median_ms:.1f}")
    console.print(shown)
    if found.hard:
        console.print(f"covered: 1σ intervals that hold the truth, ± {100 * found.hard[0].coverage_error:.1f} %")
        console.print("pulls: errors over u, mean ± standard deviation; 0 ± 1 and an excess kurtosis of 0 are wanted")


def _number(value: float | None, shape: str) -> str:
    return "–" if value is None else format(value, shape)


def _ratio(value: float) -> str:
    return f"{value:.2f}" if value < 10 else f"{float(f'{value:.2g}'):,.0f}".replace(",", " ")
