"""Scans of a field → their figure."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.arrays import Array
from analysis.field.floating import floating_spins, floating_top
from analysis.field.magnet import axial_field
from levilab.pipelines.field.analysis import FieldAnalysis, FieldRun
from levilab.pipelines.field.words import QUANTITIES
from levilab.present.drawing import SMALL, band, new_figure, panel, sigma_bands
from levilab.present.looks import BLUE, GREY, LOOKS, PURPLE, SKY, VERMILION
from levilab.present.numbers import short_name, with_uncertainty
from levilab.present.style import without_formula
from levilab.texts.text import Text

#: A scan each as long as there are so few: colour and marker.
COLOURS, _MARKERS = (BLUE, VERMILION, PURPLE, SKY), "o^vD"
FLOATS, SET = LOOKS["floats"].colour, LOOKS["to set"].colour
#: Left edge and width of the panels of the field [inch], and where what explains them begins, in parts of the width.
_LEFT, _WIDTH, _BESIDE = 0.7, 4.05, 1.02
#: The curves go on by this part of the scan's length on either side.
_BEYOND = 0.06
#: Points of a curve, and of the windows of spin, which take longer.
_POINTS, _MASSES = 300, 11
#: The lightest and the heaviest top float at the very edge of the window, or, by rounding, beyond it: the part of the
#: window that is left out at both ends.
_INSIDE = 1e-6


def field_figure(analysis: FieldAnalysis) -> Figure:
    """Draw flux density and fit, residuals in units of their uncertainty, and what follows: masses, heights, spins."""
    with new_figure(6.9, _finding(analysis), [one.synthetic for one in analysis.sources]) as figure:
        above = panel(figure, _LEFT, 0.45, _WIDTH, 2.0)
        _draw_field(above, analysis)
        _draw_residuals(panel(figure, _LEFT, 2.62, _WIDTH, 1.0), analysis, above.get_xlim())
        run = analysis.runs[0]
        left, right = (panel(figure, x, 4.45, 2.55, 1.9) for x in (_LEFT, _LEFT + 3.7))
        if run.floating is None:
            for axes in (left, right):
                axes.set_axis_off()
            left.text(0.0, 1.0, "no masses and no spins follow from this scan", fontsize=9)
        else:
            _draw_masses(left, run)
            _draw_spins(right, run)
    return figure


def _finding(analysis: FieldAnalysis) -> str:
    values = analysis.values
    strength = with_uncertainty(QUANTITIES["strength"].show(values["strength"]))
    said = Text("Field of the base on its axis: ρ = {strength:n}", strength=strength)
    if "lowest_height" not in values:
        return said
    mass = with_uncertainty(QUANTITIES["mass_to_set"].show(values["mass_to_set"]))
    low, high = (1e2 * (values[name].value or 0.0) for name in ("lowest_height", "highest_height"))
    return Text("{said}; tops float from {low:.2f} to {high:.2f} cm, set {mass:n}", said, low, high, mass)


# --- field and residuals -------------------------------------------------------------------------------


def _draw_field(axes: Axes, analysis: FieldAnalysis) -> None:
    low = min(float(run.scan.height[0]) for run in analysis.runs)
    high = max(float(run.scan.height[-1]) for run in analysis.runs)
    z = np.linspace(low - _BEYOND * (high - low), high + _BEYOND * (high - low), _POINTS)
    for k, run in enumerate(analysis.runs):
        colour, scan = COLOURS[k % len(COLOURS)], run.scan
        axes.plot(1e2 * z, 1e3 * scan.model(z), color=colour, linewidth=1.3, label=_curve_label(analysis, k))
        style: Any = {"markersize": 4.0, "markerfacecolor": "white", "zorder": 3, "linestyle": "none", "color": colour}
        axes.plot(
            1e2 * scan.height, 1e3 * scan.flux_density, marker=_MARKERS[k % len(COLOURS)], gid=f"readings-{k}",
            label=_points_label(analysis, k), **style,
        )  # fmt: skip
    axes.axhline(0, color="black", linewidth=0.6)
    axes.set_xlim(1e2 * z[0], 1e2 * z[-1])
    _mark_window(axes, analysis)
    axes.set(ylabel="B along the axis  [mT]")
    axes.tick_params(labelbottom=False)
    axes.legend(loc="upper left", bbox_to_anchor=(_BESIDE, 1.0), borderaxespad=0, labelspacing=0.7)


def _curve_label(analysis: FieldAnalysis, k: int) -> str | None:
    return "fit: a ring of inner and\nouter radius, with thickness" if k == 0 and len(analysis.runs) == 1 else None


def _points_label(analysis: FieldAnalysis, k: int) -> str | None:
    if len(analysis.runs) == 1:
        return "readings"
    return without_formula(short_name(analysis.sources[k].name), 24) if k < len(COLOURS) else None


def _mark_window(axes: Axes, analysis: FieldAnalysis) -> None:
    """Mark the heights at which tops float, and the height of the one to set."""
    values = analysis.values
    if "lowest_height" not in values:
        return
    low, high, middle = (
        1e2 * (values[name].value or 0.0) for name in ("lowest_height", "highest_height", "height_at_mass")
    )
    axes.axvspan(
        low,
        high,
        color=FLOATS,
        alpha=0.15,
        linewidth=0,
        label=Text("tops float:\n{low:.2f} to {high:.2f} cm", low=low, high=high),
    )
    mass = with_uncertainty(QUANTITIES["mass_to_set"].show(values["mass_to_set"]))
    axes.axvline(middle, linewidth=1.3, label=Text("a top of {mass:n}", mass=mass), **LOOKS["to set"].as_line)


def _draw_residuals(axes: Axes, analysis: FieldAnalysis, limits: tuple[float, float]) -> None:
    """Draw what the fit leaves over should be noise: two thirds within the dark band."""
    sigma_bands(axes)
    most = 2.5
    for k, run in enumerate(analysis.runs):
        scaled = run.scan.residuals / run.scan.u
        most = max(most, 1.15 * float(np.abs(scaled).max()))
        axes.plot(
            1e2 * run.scan.height, scaled, linestyle="none", marker=_MARKERS[k % len(COLOURS)], markersize=3.5,
            color=COLOURS[k % len(COLOURS)], gid=f"residuals-{k}",
        )  # fmt: skip
    axes.set(xlim=limits, ylim=(-most, most), xlabel="height  [cm]", ylabel="residual  [u]")
    u = 1e6 * np.concatenate([run.scan.u for run in analysis.runs])
    text = Text(
        "reading − fit, in units of its\nu of {low:.0f} to {high:.0f} µT, that of the\nheight included; shaded ±1, ±2",
        low=u.min(),
        high=u.max(),
    )
    axes.text(_BESIDE, 1.0, text, transform=axes.transAxes, va="top", fontsize=8)


# --- what follows --------------------------------------------------------------------------------------


def _draw_masses(axes: Axes, run: FieldRun) -> None:
    """Draw the mass that floats over the height, with its uncertainty."""
    floating, ring, top = run.floating, run.scan.ring, run.top
    assert floating is not None
    low, high = floating["lowest_height"], floating["highest_height"]
    z = np.linspace(low - 0.5 * (high - low), high + 0.5 * (high - low), _POINTS)
    moment = floating_top(ring, top).moment
    mass = np.abs(moment * axial_field(ring, top.magnet)(z)[1]) / top.gravity
    share = (floating.values["mass_to_set"].u or 0.0) / floating["mass_to_set"]
    inside = (z >= low) & (z <= high)
    band(axes, 1e2 * z, 1e3 * mass, 1e3 * mass * share, GREY, label="± u")
    axes.plot(1e2 * z, 1e3 * mass, color=GREY, linewidth=1, label="not stable there")
    axes.plot(1e2 * z[inside], 1e3 * mass[inside], color=FLOATS, linewidth=2.5, label="floats stably")
    for name, height in (("heaviest_mass", low), ("lightest_mass", high)):
        axes.plot(1e2 * height, 1e3 * floating[name], marker="s", color=FLOATS)
    set_at = 1e2 * floating["height_at_mass"], 1e3 * floating["mass_to_set"]
    mass_to_set = with_uncertainty(QUANTITIES["mass_to_set"].show(floating.values["mass_to_set"]))
    axes.plot(
        *set_at,
        marker="D",
        color=SET,
        linestyle="none",
        markersize=5,
        zorder=4,
        label=Text("to set: {mass:n}", mass=mass_to_set),
    )
    axes.set(xlabel="height at which it floats  [cm]", ylabel="mass of the top  [g]")
    bottom, top_of = axes.get_ylim()
    axes.set_ylim(bottom, top_of + 0.55 * (top_of - bottom))
    axes.legend(loc="upper left", fontsize=SMALL, ncols=2, columnspacing=1.0, handlelength=1.6, borderaxespad=0)
    axes.set_title("Which mass floats where", loc="left")


def _draw_spins(axes: Axes, run: FieldRun) -> None:
    """Draw the spins at which tops of these masses float."""
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
    for name in ("slowest_spin", "fastest_spin"):
        axes.plot(at, floating[name], linestyle="none", marker="D", color=SET, markersize=5, zorder=4)
    texts = [
        with_uncertainty(QUANTITIES[name].show(floating.values[name])) for name in ("slowest_spin", "fastest_spin")
    ]
    axes.set(xlabel="mass of the top  [g]", ylabel="spin  [Hz]", ylim=(0, 1.35 * float(np.nanmax(fast))))
    axes.set_title("Spins at which small motions stay small", loc="left")
    about = Text("at the mass to set:\n{slow:n} to {fast:n}", slow=texts[0], fast=texts[1])
    axes.text(0.02, 0.98, about, transform=axes.transAxes, va="top", fontsize=SMALL)
