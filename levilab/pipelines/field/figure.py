"""Scans of a field → their figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from analysis.field.floating import floating_spins, floating_top
from analysis.field.magnet import axial_field
from levilab.pipelines.field.quantities import SHOWN
from levilab.present.numbers import short_name, with_uncertainty
from levilab.present.style import STYLE, row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from levilab.pipelines.field.analysis import FieldAnalysis, FieldRun

    Array = NDArray[np.float64]

#: Okabe and Ito's colours, a scan each as long as there are so few; the model, what floats, and what to set.
COLOURS = ("#0072B2", "#D55E00", "#CC79A7", "#56B4E9")
FLOATS, SET = "#009E73", "#E69F00"
#: The curves go on by this part of the scan's length on either side.
_BEYOND = 0.06
#: Points of a curve, and of the windows of spin, which take longer.
_POINTS, _MASSES = 300, 11
#: The lightest and the heaviest top float at the very edge of the window, or, by rounding, beyond it: the part of the
#: window that is left out at both ends.
_INSIDE = 1e-6


def field_figure(analysis: FieldAnalysis) -> Figure:
    """Flux density and fit, residuals in units of their uncertainty, and what follows: masses, heights, spins."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 10))
        above = row(figure, 0.575, 0.385)[0]
        _draw_field(above, analysis)
        _draw_residuals(row(figure, 0.405, 0.11)[0], analysis, above.get_xlim())
        run = analysis.runs[0]
        left, right = row(figure, 0.055, 0.26, 2, gap=0.09)
        if run.floating is None:
            for axes in (left, right):
                axes.set_axis_off()
            left.text(0.0, 0.5, "no top floats above this base", fontsize=11)
        else:
            _draw_masses(left, run)
            _draw_spins(right, run)
    return figure


# --- field and residuals -------------------------------------------------------------------------------


def _draw_field(axes: Axes, analysis: FieldAnalysis) -> None:
    low = min(float(run.scan.height[0]) for run in analysis.runs)
    high = max(float(run.scan.height[-1]) for run in analysis.runs)
    z = np.linspace(low - _BEYOND * (high - low), high + _BEYOND * (high - low), _POINTS)
    for k, run in enumerate(analysis.runs):
        colour, scan = COLOURS[k % len(COLOURS)], run.scan
        axes.plot(1e3 * z, 1e3 * scan.model(z), color=colour, linewidth=1.3, label=_curve_label(analysis, k))
        axes.plot(
            1e3 * scan.height,
            1e3 * scan.flux_density,
            linestyle="none",
            marker="o",
            markersize=4.5,
            markerfacecolor="white",
            color=colour,
            zorder=3,
            label=_points_label(analysis, k),
        )
    axes.axhline(0, color="black", linewidth=0.8)
    axes.set_xlim(1e3 * z[0], 1e3 * z[-1])
    _mark_window(axes, analysis)
    axes.set(ylabel="flux density along the axis, B  [mT]")
    axes.tick_params(labelbottom=False)
    made_up = sum(source.synthetic for source in analysis.sources)
    synthetic = (
        "" if not made_up else "  (SYNTHETIC)" if made_up == len(analysis.sources) else f"  ({made_up} SYNTHETIC)"
    )
    strength = with_uncertainty(SHOWN["strength"].of(analysis.values["strength"]))
    axes.set_title(f"Field of the base on its axis: ρ = {strength}{synthetic}", loc="left", fontsize=11)
    axes.legend(loc="best")


def _curve_label(analysis: FieldAnalysis, k: int) -> str | None:
    return "fit: a ring of inner and outer radius, with thickness" if k == 0 and len(analysis.runs) == 1 else None


def _points_label(analysis: FieldAnalysis, k: int) -> str | None:
    if len(analysis.runs) == 1:
        return "readings"
    return short_name(analysis.sources[k].name)[:40].replace("$", r"\$") if k < len(COLOURS) else None


def _mark_window(axes: Axes, analysis: FieldAnalysis) -> None:
    """Where tops float, and the height of the one to set."""
    values = analysis.values
    if "lowest_height" not in values:
        return
    low, high, middle = (
        1e3 * (values[name].value or 0.0) for name in ("lowest_height", "highest_height", "height_at_mass")
    )
    axes.axvspan(low, high, color=FLOATS, alpha=0.15, linewidth=0, label=f"tops float: {low:.2f} to {high:.2f} mm")
    mass = with_uncertainty(SHOWN["mass_to_set"].of(values["mass_to_set"]))
    axes.axvline(middle, color=SET, linewidth=1.5, linestyle="dashed", label=f"a top of {mass}")


def _draw_residuals(axes: Axes, analysis: FieldAnalysis, limits: tuple[float, float]) -> None:
    """What the fit leaves over should be noise: two thirds within the dark band."""
    axes.axhspan(-2, 2, color="black", alpha=0.06, linewidth=0)
    axes.axhspan(-1, 1, color="black", alpha=0.10, linewidth=0)
    axes.axhline(0, color="black", linewidth=0.8)
    most = 2.5
    for k, run in enumerate(analysis.runs):
        scaled = run.scan.residuals / run.scan.u
        most = max(most, 1.15 * float(np.abs(scaled).max()))
        axes.plot(
            1e3 * run.scan.height, scaled, linestyle="none", marker="o", markersize=4, color=COLOURS[k % len(COLOURS)]
        )
    axes.set(xlim=limits, ylim=(-most, most), xlabel="height  [mm]", ylabel="residual\n[its u]")
    u = np.concatenate([run.scan.u for run in analysis.runs])
    text = (
        f"reading − fit, in units of its u ({1e6 * u.min():.0f} to {1e6 * u.max():.0f} µT, that of the height included)"
    )
    axes.set_title(text, loc="left", fontsize=9)


# --- what follows --------------------------------------------------------------------------------------


def _draw_masses(axes: Axes, run: FieldRun) -> None:
    """Which mass floats at which height, with its uncertainty."""
    floating, ring, top = run.floating, run.scan.ring, run.top
    assert floating is not None
    low, high = floating["lowest_height"], floating["highest_height"]
    z = np.linspace(low - 0.5 * (high - low), high + 0.5 * (high - low), _POINTS)
    moment = floating_top(ring, top).moment
    mass = np.abs(moment * axial_field(ring, top.magnet)(z)[1]) / top.gravity
    share = (floating.values["mass_to_set"].u or 0.0) / floating["mass_to_set"]
    inside = (z >= low) & (z <= high)
    axes.fill_between(
        1e3 * z, 1e3 * mass * (1 - share), 1e3 * mass * (1 + share), color="grey", alpha=0.25, linewidth=0
    )
    axes.plot(1e3 * z, 1e3 * mass, color="grey", linewidth=1)
    axes.plot(1e3 * z[inside], 1e3 * mass[inside], color=FLOATS, linewidth=2.5)
    for name, height in (("heaviest_mass", low), ("lightest_mass", high)):
        axes.plot(1e3 * height, 1e3 * floating[name], marker="o", color=FLOATS)
    set_at = 1e3 * floating["height_at_mass"], 1e3 * floating["mass_to_set"]
    axes.plot(*set_at, marker="D", color=SET, markersize=7, zorder=4)
    axes.annotate(
        f"set {with_uncertainty(SHOWN['mass_to_set'].of(floating.values['mass_to_set']))}",
        set_at,
        (9, 5),
        textcoords="offset points",
        fontsize=9,
    )
    axes.set(xlabel="height at which it floats  [mm]", ylabel="mass of the top  [g]")
    axes.set_title("masses that float (green: stably); grey: ±u", loc="left")


def _draw_spins(axes: Axes, run: FieldRun) -> None:
    """At which spins tops of these masses float."""
    floating = run.floating
    assert floating is not None
    light, heavy = floating["lightest_mass"], floating["heaviest_mass"]
    masses = light + (heavy - light) * np.linspace(_INSIDE, 1 - _INSIDE, _MASSES)
    heights = floating["lowest_height"], floating["highest_height"]
    found = [floating_spins(run.scan.ring, run.top, float(mass), heights) for mass in masses]
    spins: Array = np.array([window or (math.nan, math.nan) for window in found])
    slow, fast = spins.T
    axes.fill_between(1e3 * masses, slow, fast, color=FLOATS, alpha=0.2, linewidth=0)
    axes.plot(1e3 * masses, slow, color=FLOATS, linewidth=1.5)
    axes.plot(1e3 * masses, fast, color=FLOATS, linewidth=1.5)
    at = 1e3 * floating["mass_to_set"]
    for name, side in (("slowest_spin", 8), ("fastest_spin", -14)):
        axes.plot(at, floating[name], marker="D", color=SET, markersize=7, zorder=4)
        text = with_uncertainty(SHOWN[name].of(floating.values[name]))
        axes.annotate(text, (at, floating[name]), (9, side), textcoords="offset points", fontsize=9)
    axes.set(xlabel="mass of the top  [g]", ylabel="spin  [Hz]", ylim=(0, None))
    axes.set_title("spins at which small motions stay small", loc="left")
