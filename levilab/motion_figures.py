"""A simulated motion → its figure: the path, what changes in time, and the spectrum of the axis."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from levilab.figures import STYLE, row
from levilab.motion_summary import conserved

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from levilab.motion_summary import Summary

    Array = NDArray[np.float64]

BLUE, RED, GREEN, PINK = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
#: A curve of more points is drawn as the band between its least and greatest values in so many pieces.
PIECES = 1500
#: A path of more points than these is no clearer.
MOST_POINTS = 30_000
#: Lines with their frequency written beside them, and how far apart the writing must be, in parts of the width.
MOST_NAMED, _APART = 10, 0.035
#: Decades of the spectrum that are shown below its highest line.
DECADES = 5


def motion_figure(summary: Summary) -> Figure:
    """The path from the side and from above, height, spin, tilt and energy in time, and the spectrum of n_x + i n_y."""
    with mpl.rc_context({**STYLE, "agg.path.chunksize": 10_000}):
        if summary.motion.scene.observed == "spin":
            return _spin_figure(summary)
        figure = Figure(figsize=(10, 13.5))
        _draw_paths(row(figure, 0.735, 0.215, 2, gap=0.075), summary)
        heights = [0.575, 0.46, 0.345, 0.23]
        panels = [row(figure, bottom, 0.092)[0] for bottom in heights]
        for panel, draw in zip(panels, (_draw_height, _draw_spin, _draw_tilt, _draw_energy), strict=True):
            draw(panel, summary)
            panel.set_xlim(0, summary.end)
            panel.tick_params(labelbottom=panel is panels[-1])
        panels[-1].set_xlabel("time  [s]", labelpad=1)
        _draw_spectrum(row(figure, 0.04, 0.125)[0], summary)
        figure.text(0.01, 0.985, _headline(summary), fontsize=11, va="top")
    return figure


def _spin_figure(summary: Summary) -> Figure:
    """Of a scene that has no motion."""
    figure = Figure(figsize=(10, 4))
    (axes,) = row(figure, 0.13, 0.7)
    _draw_spin(axes, summary)
    axes.set(xlim=(0, summary.end), xlabel="time  [s]")
    figure.text(0.01, 0.97, _headline(summary), fontsize=11, va="top")
    return figure


def _headline(summary: Summary) -> str:
    motion = summary.motion
    ended = f"stayed up for {summary.end:g} s" if motion.survived else f"{summary.fell} after {summary.end:.4g} s"
    name = (motion.scene.name or "simulation").replace("$", r"\$")
    return f"Simulated motion (SYNTHETIC): {name[:60]}, {ended}"


# --- the path ---


def _draw_paths(panels: list[Axes], summary: Summary) -> None:
    """Both on the same scale in both directions: a circle is a circle."""
    place = 100 * summary.motion.position[:: max(1, len(summary.motion.time) // MOST_POINTS)]
    width = 0.6 if len(place) < 20_000 else 0.2
    for panel, across, up, title in ((panels[0], 0, 2, "from the side"), (panels[1], 0, 1, "from above")):
        panel.plot(place[:, across], place[:, up], color=BLUE, linewidth=width)
        panel.plot(*place[0, [across, up]], "o", color="black", markersize=4, markerfacecolor="white", label="start")
        panel.plot(*place[-1, [across, up]], "s", color=RED, markersize=4, label="end")
        panel.set_aspect("equal", adjustable="datalim")
        panel.margins(0.08)
        panel.set(xlabel="x  [cm]", ylabel=f"{'xyz'[up]}  [cm]")
        panel.set_title(f"Path {title}", loc="left")
    panels[0].legend(loc="best", fontsize=8)


# --- in time ---


def _draw_height(axes: Axes, summary: Summary) -> None:
    _curve(axes, summary.motion.time, 100 * summary.motion.position[:, 2], BLUE)
    axes.set_ylabel("height z  [cm]")
    axes.set_title(f"Height: {summary.heights}", loc="left")


def _draw_spin(axes: Axes, summary: Summary) -> None:
    motion, scene = summary.motion, summary.motion.scene
    _curve(axes, motion.time, motion.spin_hz, RED, label="top")
    if scene.washers.inertia_kg_m2 > 0:
        _curve(axes, motion.time, motion.washer_spin_hz, PINK, label="loose washers")
    if scene.drive.waveform != "off":
        axes.axhline(scene.drive.frequency_hz, color="black", linewidth=0.8, linestyle="dashed", label="drive")
    if len(axes.get_legend_handles_labels()[1]) > 1:
        axes.legend(loc="lower right", bbox_to_anchor=(1, 0.98), ncols=3, fontsize=8, borderpad=0)
    axes.set_ylabel("spin ω₃/2π  [Hz]")
    axes.set_title(f"Spin: {motion.spin_hz[0]:.3f} Hz at the start, {motion.spin_hz[-1]:.3f} Hz at the end", loc="left")
    _not_finer(axes, 1e-6 * abs(float(motion.spin_hz[0])))


def _draw_tilt(axes: Axes, summary: Summary) -> None:
    tilt = np.degrees(summary.motion.tilt)
    _curve(axes, summary.motion.time, tilt, GREEN)
    axes.set_ylabel("tilt  [degrees]")
    axes.set_ylim(bottom=0)
    axes.set_title(f"Tilt of the axis against the base's: up to {tilt.max():.3g}°", loc="left")


def _draw_energy(axes: Axes, summary: Summary) -> None:
    energy = summary.motion.energies
    change = (energy - energy[0]) / (abs(energy[0]) or 1.0)
    power = math.floor(math.log10(summary.energy_change)) if summary.energy_change > 0 else 0
    _curve(axes, summary.motion.time, change / 10.0**power, "black")
    kept = conserved(summary.motion.scene)
    axes.set_ylabel("(E − E₀)/E₀" + (f"  [10$^{{{power}}}$]" if power else ""))
    axes.set_title(
        f"Error of the energy: it should stay as it is, and does to {summary.energy_change:.1g}"
        if kept
        else "Energy, change since the start: drag, drive or friction change it (without the drive's own part)",
        loc="left",
    )


def _curve(axes: Axes, time: Array, values: Array, colour: str, label: str | None = None) -> None:
    """A line, or the band that it fills."""
    if len(time) <= 2 * PIECES:
        axes.plot(time, values, color=colour, linewidth=0.8, label=label)
        return
    edges = np.linspace(0, len(time), PIECES + 1).astype(int)[:-1]
    low, high = np.minimum.reduceat(values, edges), np.maximum.reduceat(values, edges)
    axes.fill_between(time[edges], low, high, color=colour, linewidth=0.5, label=label)


def _not_finer(axes: Axes, span: float) -> None:
    """No range so small that rounding would look like a motion."""
    low, high = axes.get_ylim()
    if high - low < span:
        axes.set_ylim((low + high) / 2 - 50 * span, (low + high) / 2 + 50 * span)
        axes.ticklabel_format(axis="y", useOffset=False)


# --- the spectrum ---


def _draw_spectrum(axes: Axes, summary: Summary) -> None:
    lines = summary.lines
    axes.set(xlabel="frequency  [Hz], positive in the sense of a spin above 0", ylabel="amplitude  [mrad]")
    if lines.spectrum is None or not lines.lines:
        axes.set_title("Spectrum of the axis, n$_x$ + i n$_y$: the motion is too short for one", loc="left")
        axes.set_axis_off()
        return
    frequency, amplitude = lines.spectrum[0], 1000 * lines.spectrum[1]
    places = [0.0, *(line.frequency for line in lines.lines)]
    margin = 3 + 0.15 * max(map(abs, places))
    limits = (min(places) - margin, max(places) + margin)
    shown = (frequency >= limits[0]) & (frequency <= limits[1])
    top = amplitude.max()
    axes.semilogy(*_outline(frequency[shown], amplitude[shown]), color=BLUE, linewidth=0.7)
    axes.set(xlim=limits, ylim=(top / 10**DECADES, 8 * top))
    _name_lines(axes, summary, limits)
    piece = "" if lines.until > 0.99 * summary.end else f" of the first {lines.until:.3g} s"
    axes.set_title(
        f"Spectrum of the axis, n$_x$ + i n$_y${piece}: lines {lines.resolution:.2g} Hz apart are told apart",
        loc="left",
    )


def _outline(frequency: Array, amplitude: Array) -> tuple[Array, Array]:
    """The highest bin of each piece: no line is lost."""
    if len(frequency) <= 4 * PIECES:
        return frequency, amplitude
    edges = np.linspace(0, len(frequency), 4 * PIECES + 1).astype(int)[:-1]
    highest = np.maximum.reduceat(amplitude, edges)
    return frequency[edges], highest


def _name_lines(axes: Axes, summary: Summary, limits: tuple[float, float]) -> None:
    """The frequency above each of the strongest lines, where there is room for it; sidebands come last."""
    written: list[float] = []
    apart = _APART * (limits[1] - limits[0])
    by_worth = sorted(summary.lines.lines, key=lambda line: line.sideband)
    for line in by_worth[:MOST_NAMED]:
        if any(abs(line.frequency - x) < apart and line.frequency * x > 0 for x in written):
            continue
        written.append(line.frequency)
        back = line.frequency < 0
        style: Any = {"rotation": -45, "ha": "right"} if back else {"rotation": 45, "ha": "left"}
        place = (line.frequency, 1000 * line.amplitude)
        text = f"{line.frequency:.2f}".replace("-", "−")
        axes.annotate(
            text, place, (0, 2), textcoords="offset points", va="bottom", fontsize=7.5, color="dimgrey", **style
        )
