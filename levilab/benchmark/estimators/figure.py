"""RMSE over the bound against SNR, and samples per second, of all methods."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.figure import Figure

from levilab.benchmark.estimators.study import AIMS, OURS
from levilab.present.style import STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from levilab.benchmark.estimators.study import Score, Study

#: Methods: colour, marker, line.
LINES = {
    "default": ("#0072B2", "o", "-"),
    "fast": ("#56B4E9", "s", "-"),
    "maximum likelihood": ("#009E73", "^", "--"),
    "FFT peak, interpolated": ("#D55E00", "o", "-"),
    "autocorrelation": ("#CC79A7", "s", "-"),
    "find_peaks, mean period": ("#333333", "^", "-"),
}


def estimators_figure(found: Study) -> Figure:
    """Three panels: RMSE over the bound, speed, and coverage of the hard cases."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(11, 5.2))
        errors = figure.add_axes((0.06, 0.11, 0.33, 0.76))
        speeds = figure.add_axes((0.45, 0.11, 0.16, 0.76))
        hard = figure.add_axes((0.80, 0.11, 0.18, 0.76))
        _errors(errors, found)
        _speeds(speeds, found)
        _hard(hard, found.hard)
        figure.text(0.06, 0.945, _title(found), fontsize=11)
    return figure


def _title(found: Study) -> str:
    ours = max((s.rmse_over_bound for s in found.scores if s.name == "default"), default=math.nan)
    others = [s.rmse_over_bound for s in found.scores if s.name not in OURS]
    text = f"Frequency of light pulses: the default is within {100 * (ours - 1):.0f} % of the bound"
    return text + (f", others at {min(others):.0f} times it or more" if others else "")


def _errors(axes: Axes, found: Study) -> None:
    for name, (colour, marker, line) in LINES.items():
        scores = sorted((s for s in found.scores if s.name == name), key=lambda s: s.snr_db)
        if scores:
            axes.semilogy(
                [s.snr_db for s in scores], [s.rmse_over_bound for s in scores],
                color=colour, marker=marker, linestyle=line, markersize=4, linewidth=1.3, label=name,
            )  # fmt: skip
    axes.axhline(1, color="black", linewidth=0.8)
    axes.set(xlabel="signal to noise A/σ  [dB]", ylabel="RMSE / Cramér–Rao bound")
    axes.legend(loc="lower center", fontsize=8, bbox_to_anchor=(0.5, 0.13), ncols=2)


def _speeds(axes: Axes, found: Study) -> None:
    names = [name for name in LINES if any(s.name == name for s in found.scores)]
    aims = {name: speed for name, _, _, speed in AIMS}
    for row, name in enumerate(reversed(names)):
        colour, marker, _ = LINES[name]
        values = [1e-6 * s.samples_per_s for s in found.scores if s.name == name and s.samples_per_s]
        axes.plot([min(values), max(values)], [row, row], color=colour, marker=marker, markersize=5)
        place: dict[str, Any] = {
            "xytext": (0, 7),
            "textcoords": "offset points",
            "ha": "right" if max(values) > 100 else "center",
        }
        axes.annotate(name, (max(values), row), fontsize=8, color=colour, **place)
        if name in aims:
            axes.plot([1e-6 * aims[name]], [row], color="black", marker="|", markersize=12, linestyle="")
    axes.set_xscale("log")
    axes.set(xlabel="MS/s of one core (bar: aim)", yticks=[], ylim=(-0.6, len(names) - 0.3))


def _hard(axes: Axes, scores: tuple[Score, ...]) -> None:
    axes.axvspan(63, 73, color="#0072B2", alpha=0.12, linewidth=0)
    for row, score in enumerate(reversed(scores)):
        if score.coverage is not None:
            axes.errorbar(
                100 * score.coverage, row, xerr=100 * score.coverage_error,
                color="#D55E00" if score.failures else "#0072B2", marker="o", markersize=4, linewidth=1,
            )  # fmt: skip
    axes.set_yticks(
        range(len(scores)), [s.name + (f" ({s.failures} failed)" if s.failures else "") for s in reversed(scores)]
    )
    axes.set(xlabel="1σ intervals that\nhold the truth [%]", xlim=(55, 81))
