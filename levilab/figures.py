"""Results → figures.  The only module that draws."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from analysis.spindown import SpinDown
    from levilab.pipeline import SpinDownAnalysis

    Array = NDArray[np.float64]

#: Okabe and Ito's colours, told apart by everyone; one a law, whatever the figure.
COLOURS = {"stokes": "#0072B2", "newton": "#D55E00", "disc": "#009E73", "mixed": "#CC79A7", "power": "#E69F00"}
NAMES = {
    "stokes": "Stokes  ω̇ = −C₁ω",
    "newton": "Newton  ω̇ = −C₂ω²",
    "disc": "laminar disc  ω̇ = −Cω$^{3/2}$",
    "mixed": "mixed  ω̇ = −C₁ω − C₂ω²",
    "power": "power  ω̇ = −cωⁿ",
}
MARKERS = "osD^vP*X"
#: (title, what is drawn of ν, the law that makes it straight)
STRAIGHT_LINES: tuple[tuple[str, Callable[[Array], Array], str], ...] = (
    ("ln ν", np.log, "stokes"),
    ("1/ν  [s]", lambda nu: 1 / nu, "newton"),
    ("ν$^{−1/2}$  [s$^{1/2}$]", lambda nu: nu**-0.5, "disc"),
)
#: More points than a figure can show are thinned out evenly.
MOST_POINTS = 2000

_STYLE: Any = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "levilab",
    "axes.formatter.use_mathtext": True,
}


def spindown_figure(analysis: SpinDownAnalysis) -> Figure:
    """Data and laws; residuals of every law; the thesis's straight-line panels."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(10, 10.5), layout="constrained")
        rows = figure.add_gridspec(3, 1, height_ratios=[1.5, 1.0, 1.0])
        _draw_spin(figure.add_subplot(rows[0]), analysis)
        columns = rows[1].subgridspec(1, len(COLOURS), wspace=0.02)
        shared: Axes | None = None
        for k, name in enumerate(COLOURS):
            axes = figure.add_subplot(columns[k], sharey=shared)
            _draw_residuals(axes, analysis, name, labelled=shared is None)
            shared = shared or axes
        columns = rows[2].subgridspec(1, len(STRAIGHT_LINES), wspace=0.02)
        for k, (title, transform, law) in enumerate(STRAIGHT_LINES):
            _draw_straight(figure.add_subplot(columns[k]), analysis, title, transform, law)
    return figure


def save_png(figure: Figure, path: Path) -> None:
    """Write a figure as a picture.  Raises OSError."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=150)
    path.write_bytes(buffer.getvalue())


def as_svg(figure: Figure) -> str:
    """A figure as SVG text, the same bytes for the same figure."""
    buffer = io.StringIO()
    with mpl.rc_context(_STYLE):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


def _thin(n: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, n - 1, min(n, MOST_POINTS)).astype(np.intp))


def _marks(run: SpinDown, k: int) -> dict[str, Any]:
    few = len(run.time) <= MOST_POINTS // 10
    return {"linestyle": "none", "marker": MARKERS[k % len(MARKERS)], "markersize": 4 if few else 1.5, "alpha": 0.8}


def _draw_spin(axes: Axes, analysis: SpinDownAnalysis) -> None:
    """The readings of all runs and, through each, every law."""
    for k, (source, run) in enumerate(zip(analysis.sources, analysis.runs, strict=True)):
        t = np.linspace(run.time[0], run.time[-1], 300)
        for fit in run.fits:
            label = NAMES[fit.name] if k == 0 else None
            width = 1.6 if fit.name == run.best else 0.8
            axes.plot(t, fit.spin_frequency(t), color=COLOURS[fit.name], linewidth=width, label=label)
        points = _thin(len(run.time))
        label = source.name if len(analysis.runs) <= len(MARKERS) else None
        axes.plot(
            run.time[points],
            run.frequency[points],
            color="black",
            markerfacecolor="white",
            label=label,
            **_marks(run, k),
        )
        _draw_outliers(axes, analysis, k)
    axes.set(xlabel="time  [s]", ylabel="spin frequency ν  [Hz]")
    together = "" if len(analysis.runs) == 1 else f" of {len(analysis.runs)} runs"
    axes.set_title(f"Spin-down{together}: readings and drag laws{_synthetic(analysis)}", loc="left")
    axes.legend(ncols=2)


def _draw_outliers(axes: Axes, analysis: SpinDownAnalysis, k: int) -> None:
    readings, outliers = analysis.sources[k].readings, list(analysis.runs[k].outliers)
    if outliers:
        axes.plot(
            readings.time[outliers], readings.frequency[outliers], "x", color="red", markersize=9, label="outlier"
        )


def _synthetic(analysis: SpinDownAnalysis) -> str:
    return "  (SYNTHETIC)" if any(source.synthetic for source in analysis.sources) else ""


def _draw_residuals(axes: Axes, analysis: SpinDownAnalysis, name: str, *, labelled: bool) -> None:
    """What one law leaves over: it should be noise about zero, without a shape."""
    for k, run in enumerate(analysis.runs):
        points = _thin(len(run.time))
        axes.plot(run.time[points], run.fit(name).residuals[points], color=COLOURS[name], **_marks(run, k))
    axes.axhline(0, color="black", linewidth=0.8)
    axes.set_title(NAMES[name].split("  ")[0], loc="left", color=COLOURS[name])
    axes.set_xlabel("time  [s]")
    if labelled:
        axes.set_ylabel("residual  [Hz]")
    else:
        axes.tick_params(labelleft=False)


def _draw_straight(
    axes: Axes, analysis: SpinDownAnalysis, title: str, transform: Callable[[Array], Array], law: str
) -> None:
    """The thesis's panels: where this law holds, the points lie on the line."""
    for k, run in enumerate(analysis.runs):
        y = transform(run.frequency)
        slope, intercept = np.polyfit(run.time - run.time[0], y, 1)
        ends = run.time[[0, -1]]
        axes.plot(ends, intercept + slope * (ends - run.time[0]), color=COLOURS[law], linewidth=1)
        points = _thin(len(run.time))
        axes.plot(run.time[points], y[points], color="black", markerfacecolor="white", **_marks(run, k))
    axes.set(xlabel="time  [s]")
    axes.set_title(f"{title}: straight for {NAMES[law].split('  ')[0]}", loc="left", color=COLOURS[law])
