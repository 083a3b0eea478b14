"""RMSE over the bound against SNR, and samples per second, of all methods."""

import math

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from levilab.benchmark.estimators.study import AIMS, OURS, Score, Study
from levilab.present.drawing import SMALL, headline, panel
from levilab.present.looks import BLACK, BLUE, GREEN, PURPLE, SKY, VERMILION
from levilab.present.style import STYLE, WIDE

#: Methods: colour, marker, line.
LINES = {
    "default": (BLUE, "o", "-"),
    "fast": (SKY, "s", "-"),
    "maximum likelihood": (GREEN, "^", "--"),
    "FFT peak, interpolated": (VERMILION, "o", "-"),
    "autocorrelation": (PURPLE, "s", "-"),
    "find_peaks, mean period": (BLACK, "^", "-"),
}


@mpl.rc_context(STYLE)
def estimators_figure(found: Study) -> Figure:
    """Draw three panels: RMSE over the bound, speed, and coverage of the hard cases."""
    rows = len(found.hard)
    figure = Figure(figsize=(WIDE, 4.6 + 0.17 * rows))
    headline(figure, _title(found))
    _errors(panel(figure, 0.65, 0.55, 3.3, 2.2), found)
    _speeds(panel(figure, 5.45, 0.55, 1.45, 2.2), found)
    _hard(panel(figure, 2.35, 4.05, 4.5, 0.1 + 0.17 * rows), found.hard)
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
    axes.legend(loc="upper left", fontsize=SMALL, bbox_to_anchor=(-0.1, -0.2), ncols=2, borderaxespad=0)


def _speeds(axes: Axes, found: Study) -> None:
    names = [name for name in LINES if any(s.name == name for s in found.scores)]
    aims = {name: speed for name, _, _, speed in AIMS}
    for row, name in enumerate(reversed(names)):
        colour, marker, _ = LINES[name]
        values = [1e-6 * s.samples_per_s for s in found.scores if s.name == name and s.samples_per_s]
        axes.plot([min(values), max(values)], [row, row], color=colour, marker=marker, markersize=5)
        if name in aims:
            axes.plot([1e-6 * aims[name]], [row], color="black", marker="|", markersize=12, linestyle="")
    axes.set_xscale("log")
    axes.set(xlabel="MS/s of one core\n(bar: aim)", ylim=(-0.6, len(names) - 0.4))
    axes.set_yticks(range(len(names)), list(reversed(names)), fontsize=SMALL)


def _hard(axes: Axes, scores: tuple[Score, ...]) -> None:
    axes.axvspan(63, 73, color=BLUE, alpha=0.12, linewidth=0)
    for row, score in enumerate(reversed(scores)):
        if score.coverage is not None:
            axes.errorbar(
                100 * score.coverage, row, xerr=100 * score.coverage_error,
                color=VERMILION if score.failures else BLUE, marker="s" if score.failures else "o", linewidth=1,
            )  # fmt: skip
    axes.set_yticks(
        range(len(scores)),
        [s.name + (f" ({s.failures} failed)" if s.failures else "") for s in reversed(scores)],
        fontsize=SMALL,
    )
    axes.set_title("The default on hard cases; shaded: as wanted", fontsize=8)
    axes.set(xlabel="1σ intervals that hold the truth  [%]", xlim=(55, 81), ylim=(-0.8, len(scores) - 0.2))
