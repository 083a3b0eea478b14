"""A simulated motion → its figure: the path, what changes in time, and the spectrum of the axis."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from levilab.motion.summary import changing_energy
from levilab.present.style import STYLE, row

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from levilab.motion.lines import NamedLine
    from levilab.motion.summary import Summary

    Array = NDArray[np.float64]

BLUE, RED, GREEN, PINK = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
#: A curve of more points is drawn as the band between its least and greatest values in so many pieces.
PIECES = 1500
#: A path of more points than these is no clearer.
MOST_POINTS = 30_000
#: Most lines with a name, most rows of names above the highest line; a row's height and the gap between names, in parts
#: of the panel's height and width.
MOST_NAMED, ROWS, _ROW, _GAP = 10, 4, 0.072, 0.008
_NAMES_SHARE = 0.31
_FONT = 7.5
#: A path is not magnified more than to this width [cm]: what is left then is rounding.
_SMALLEST_CM = 1e-4
#: Decades of the spectrum that are shown below its highest line.
DECADES = 5


def motion_figure(summary: Summary) -> Figure:
    """The path from the side and from above, height, spin, tilt and energy in time, and the spectrum of n_x + i n_y."""
    with mpl.rc_context({**STYLE, "agg.path.chunksize": 10_000}):
        if summary.motion.scene.observed == "spin":
            return _spin_figure(summary)
        return _whole_figure(summary)


#: Sizes [inches]: the figure's width; what the spectrum adds to its height; heights and distance of the panels.
_WIDTH, _SPECTRUM, _PATHS, _PANEL, _PITCH = 10.0, 2.87, 2.9, 1.242, 1.5525


def _whole_figure(summary: Summary) -> Figure:
    """Without the spectrum's part where there is none."""
    lowest = 0.55 + (_SPECTRUM if _has_spectrum(summary) else 0.0)
    paths = lowest + 3 * _PITCH + _PANEL + 0.92
    height = paths + _PATHS + 0.67
    figure = Figure(figsize=(_WIDTH, height))
    _draw_paths(row(figure, paths / height, _PATHS / height, 2, gap=0.075), summary)
    panels = [row(figure, (lowest + k * _PITCH) / height, _PANEL / height)[0] for k in (3, 2, 1, 0)]
    for panel, draw in zip(panels, (_draw_height, _draw_spin, _draw_tilt, _draw_energy), strict=True):
        draw(panel, summary)
        panel.set_xlim(0, summary.end)
        panel.tick_params(labelbottom=panel is panels[-1])
    panels[-1].set_xlabel("time  [s]", labelpad=1)
    if _has_spectrum(summary):
        _draw_spectrum(row(figure, 0.54 / height, 2.0 / height)[0], summary)
    figure.text(0.01, 1 - 0.2 / height, _headline(summary), fontsize=11, va="top")
    return figure


def _has_spectrum(summary: Summary) -> bool:
    return summary.lines.signal is not None and bool(summary.lines.lines)


def _spin_figure(summary: Summary) -> Figure:
    """Of a scene that has no motion."""
    figure = Figure(figsize=(10, 4))
    (axes,) = row(figure, 0.13, 0.7)
    _draw_spin(axes, summary)
    axes.set(xlim=(0, summary.end), xlabel="time  [s]")
    figure.text(0.01, 0.97, _headline(summary), fontsize=11, va="top")
    return figure


def _headline(summary: Summary) -> str:
    name = (summary.motion.scene.name or "simulation").replace("$", r"\$")
    return f"Simulated motion (SYNTHETIC): {name[:60]}, {summary.ending}"


# --- the path ---


def _draw_paths(panels: list[Axes], summary: Summary) -> None:
    """Both on the same scale in both directions, a circle is a circle; and both over the same x."""
    place = 100 * summary.motion.position[:: max(1, len(summary.motion.time) // MOST_POINTS)]
    width = 0.6 if len(place) < 20_000 else 0.2
    middle = (place.min(axis=0) + place.max(axis=0)) / 2
    size = panels[0].get_window_extent()
    shape = size.width / size.height
    span = np.ptp(place, axis=0)
    half = 0.5 * 1.16 * max(span[0], shape * span[1], shape * span[2], _SMALLEST_CM)
    for panel, across, up, title in ((panels[0], 0, 2, "from the side"), (panels[1], 0, 1, "from above")):
        panel.plot(place[:, across], place[:, up], color=BLUE, linewidth=width)
        panel.plot(*place[0, [across, up]], "o", color="black", markersize=4, markerfacecolor="white", label="start")
        panel.plot(*place[-1, [across, up]], "s", color=RED, markersize=4, label="end")
        panel.set_aspect("equal")
        panel.set_xlim(middle[across] - half, middle[across] + half)
        panel.set_ylim(middle[up] - half / shape, middle[up] + half / shape)
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
    axes.set_title(f"Spin: {summary.spin}", loc="left")
    _limit_zoom(axes, 1e-6 * abs(float(motion.spin_hz[0])))


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
    axes.set_ylabel("(E − E₀)/E₀" + (f"  [10$^{{{power}}}$]" if power else ""))
    axes.set_title(_energy_title(summary), loc="left")


def _energy_title(summary: Summary) -> str:
    there = changing_energy(summary.motion.scene)
    if not there:
        return f"Error of the energy: it should stay as it is, and does {_exactly(summary.energy_change)}"
    own = " (without the drive's own part)" if "drive" in there else ""
    *others, last = there
    named = f"{', '.join(others)} and {last} change" if others else f"{last} changes"
    return f"Energy, change since the start: {named} it{own}"


def _exactly(change: float) -> str:
    return f"to {change:.1g}" if change else "exactly"


def _curve(axes: Axes, time: Array, values: Array, colour: str, label: str | None = None) -> None:
    """A line, or the band that it fills."""
    if len(time) <= 2 * PIECES:
        axes.plot(time, values, color=colour, linewidth=0.8, label=label)
        return
    edges = np.linspace(0, len(time), PIECES + 1).astype(int)[:-1]
    low, high = np.minimum.reduceat(values, edges), np.maximum.reduceat(values, edges)
    axes.fill_between(time[edges], low, high, color=colour, linewidth=0.5, label=label)


def _limit_zoom(axes: Axes, span: float) -> None:
    """No range so small that rounding would look like a motion."""
    low, high = axes.get_ylim()
    if high - low < span:
        axes.set_ylim((low + high) / 2 - 50 * span, (low + high) / 2 + 50 * span)
        axes.ticklabel_format(axis="y", useOffset=False)


# --- the spectrum ---


def _draw_spectrum(axes: Axes, summary: Summary) -> None:
    lines = summary.lines
    assert lines.spectrum
    axes.set(xlabel="frequency  [Hz], positive in the sense of a spin above 0", ylabel="amplitude  [mrad]")
    frequency, amplitude = lines.spectrum[0], 1000 * lines.spectrum[1]
    places = [0.0, *(line.frequency for line in lines.lines)]
    margin = 3 + 0.15 * max(map(abs, places))
    limits = (min(places) - margin, max(places) + margin)
    shown = (frequency >= limits[0]) & (frequency <= limits[1])
    top = amplitude.max()
    axes.semilogy(*_outline(frequency[shown], amplitude[shown]), color=BLUE, linewidth=0.7)
    room = DECADES * _NAMES_SHARE / (1 - _NAMES_SHARE)  # decades above the highest line, for the names
    axes.set(xlim=limits, ylim=(top / 10**DECADES, top * 10**room))
    _name_lines(axes, summary)
    piece = "" if lines.until > 0.99 * summary.end else f" of the first {lines.until:.3g} s"
    axes.set_title(f"Spectrum of the axis, n$_x$ + i n$_y${piece}: resolution {lines.resolution:.2g} Hz", loc="left")


def _outline(frequency: Array, amplitude: Array) -> tuple[Array, Array]:
    """The highest bin of each piece: no line is lost."""
    if len(frequency) <= 4 * PIECES:
        return frequency, amplitude
    edges = np.linspace(0, len(frequency), 4 * PIECES + 1).astype(int)[:-1]
    highest = np.maximum.reduceat(amplitude, edges)
    return frequency[edges], highest


@dataclass(frozen=True)
class _Label:
    """A name beside the pole of its line, in parts of the panel's width, and its row above the spectrum."""

    pole: float
    left: float
    right: float
    row: int

    def fits(self, others: list[_Label]) -> bool:
        """Whether it is inside of the panel and neither it nor its pole crosses another one."""
        inside = self.left >= 0 and self.right <= 1
        return inside and not any(self._crosses(other) or other._under(self) or self._under(other) for other in others)

    def _crosses(self, other: _Label) -> bool:
        beside = self.right + _GAP < other.left or other.right + _GAP < self.left
        return self.row == other.row and not beside

    def _under(self, other: _Label) -> bool:
        """Whether the other's pole goes up through this name."""
        return self.row <= other.row and self.covers([other.pole])

    def covers(self, poles: list[float]) -> bool:
        """Whether one of the poles would go through this name if it were high enough."""
        return any(self.left - _GAP / 2 < pole < self.right + _GAP / 2 for pole in poles)


def _name_lines(axes: Axes, summary: Summary) -> None:
    """Frequency and name of the strongest lines, where there is room; of sidebands, which come last, the frequency."""
    flags: list[_Label] = []
    lines = sorted(summary.lines.lines, key=lambda line: line.sideband)[:MOST_NAMED]
    for k, line in enumerate(lines):
        waiting = [_pole(axes, other.frequency) for other in lines[k + 1 :] if not other.sideband]
        number = f"{line.frequency:.2f}".replace("-", "−")
        texts = [number] if line.sideband or not line.name else [f"{number} {line.name}", number]
        places = [(text, flag) for text in texts for flag in _flags(axes, line.frequency, text) if flag.fits(flags)]
        if places:
            # the first place that leaves room for the poles to come, if there is one
            found = next((place for place in places if not place[1].covers(waiting)), places[0])
            flags.append(found[1])
            _draw_label(axes, line, *found)


def _pole(axes: Axes, frequency: float) -> float:
    low, high = axes.get_xlim()
    return float((frequency - low) / (high - low))


def _flags(axes: Axes, frequency: float, text: str) -> Iterator[_Label]:
    """Where a name may hang: away from zero or towards it, in the lowest row first."""
    pole = _pole(axes, frequency)
    probe = axes.text(0, 0, text, fontsize=_FONT)
    width = 1.03 * probe.get_window_extent().width / axes.get_window_extent().width
    probe.remove()
    right = _Label(pole, pole + _GAP / 2, pole + _GAP / 2 + width, 0)
    left = _Label(pole, pole - _GAP / 2 - width, pole - _GAP / 2, 0)
    for flag in (left, right) if frequency < 0 else (right, left):
        yield from (replace(flag, row=k) for k in range(ROWS))


def _draw_label(axes: Axes, line: NamedLine, text: str, flag: _Label) -> None:
    height = 1 - _NAMES_SHARE + 0.01 + flag.row * _ROW
    mixed = axes.get_xaxis_transform()  # frequencies across, parts of the panel up
    low, high = np.log10(axes.get_ylim())
    peak = (math.log10(1000 * line.amplitude) - low) / (high - low)
    axes.plot(
        [line.frequency] * 2, [peak + 0.01, height + 0.8 * _ROW], color="darkgrey", linewidth=0.6, transform=mixed
    )
    x, side = (flag.right, "right") if flag.right < flag.pole else (flag.left, "left")
    axes.text(x, height, text, fontsize=_FONT, color="dimgrey", transform=axes.transAxes, ha=side)
