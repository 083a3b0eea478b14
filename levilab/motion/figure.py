"""A simulated motion → its figure: the path, what changes in time, and the spectrum of the axis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from analysis.arrays import Array
from analysis.numbers import digits
from levilab.motion.lines import NamedLine
from levilab.motion.summary import Summary, changing_energy
from levilab.present.drawing import SMALL, curve, headline, panel
from levilab.present.looks import GREY, LOOKS
from levilab.present.numbers import enumeration, with_decimals
from levilab.present.style import STYLE, WIDE, without_formula
from levilab.texts.text import Sentences, Text, in_language

#: A curve of more points is drawn as the envelope of this number of pieces.
PIECES = 700
#: A path of more points than these is no clearer.
MOST_POINTS = 30_000
#: Most lines with a name, most rows of names above the highest line; a row's height and the gap between names, in parts
#: of the panel's height and width.
MOST_NAMED, ROWS, _ROW, _GAP = 10, 6, 0.062, 0.006
_NAMES_SHARE = 0.385
#: A name in this row or higher leaves room for others below it.
_FREE_ROWS = 2
_FONT = 7.0
#: A path is not magnified more than to this width [cm]: the rest is rounding.
_SMALLEST_CM = 1e-4
#: Height of the legend of the spin [inch].
_LEGEND = 0.12
#: Letters of a title of 8 pt that find room over a curve and its zoom.
_LETTERS = 92
#: Decades of the spectrum that are shown below its highest line.
DECADES = 5
#: A motion of at least so long has a zoom of one second beside each curve [s].
_LEAST_FOR_ZOOM, ZOOM_S = 4.0, 1.0

#: Sizes [inches]: left edge and width of the panels; the zoom beside them and its distance; the row of paths, of a
#: curve and of the spectrum, from one to the next.
_LEFT, _FULL, _ZOOM, _BESIDE = 0.76, 6.1, 1.28, 0.55
_PATH, _CURVE, _PITCH, _SPECTRUM, _BOTTOM = 2.1, 0.86, 1.16, 2.3, 0.55


@mpl.rc_context(STYLE)
def motion_figure(summary: Summary) -> Figure:
    """Draw the path from the side and from above, height, spin, tilt, energy in time, the spectrum of n_x + i n_y.

    The spectrum is left out where there is none, and the zoom where all is short.
    """
    if summary.motion.scene.observed == "spin":
        return _spin_figure(summary)
    quantities = _quantities(summary)
    tops = 0.62 + _PATH + 0.74 + _PITCH * np.arange(len(quantities))
    tops[1:] += _LEGEND if quantities[1].has_legend else 0.0  # of the spin, between its title and its panel
    below = float(tops[-1]) + _CURVE
    height = below + _BOTTOM + (_SPECTRUM + 0.72 if _has_spectrum(summary) else 0.0)
    figure = Figure(figsize=(WIDE, height))
    headline(figure, _finding(summary), "SYNTHETIC")
    _draw_paths(figure, summary)
    zoom = _zoom(summary)
    wide = _FULL if zoom is None else _FULL - _ZOOM - _BESIDE
    for k, quantity in enumerate(quantities):
        axes = panel(figure, _LEFT, float(tops[k]), wide, _CURVE)
        _draw_quantity(axes, quantity, summary.motion.time)
        axes.set_xlim(0, summary.end)
        last = k == len(quantities) - 1
        axes.tick_params(labelbottom=last)
        axes.set_xlabel("time  [s]" if last else "")
        if zoom is not None:
            beside = panel(figure, _LEFT + wide + _BESIDE, float(tops[k]), _ZOOM, _CURVE)
            axes.axvspan(*zoom, color=GREY, alpha=0.25, linewidth=0, zorder=0.5)
            _draw_zoom(beside, quantity, summary.motion.time, zoom)
            beside.set_title("the second marked grey" if k == 0 else "", fontsize=SMALL, loc="right")
            beside.tick_params(labelbottom=last)
            beside.set_xlabel("time  [s]" if last else "")
    if _has_spectrum(summary):
        _draw_spectrum(panel(figure, _LEFT, below + 0.72, _FULL, _SPECTRUM), summary)
    return figure


def _has_spectrum(summary: Summary) -> bool:
    return summary.lines.signal is not None and bool(summary.lines.lines)


def _spin_figure(summary: Summary) -> Figure:
    figure = Figure(figsize=(WIDE, 3.0))
    axes = panel(figure, _LEFT, 0.85, _FULL, 1.6)
    headline(figure, _finding(summary), "SYNTHETIC")
    _draw_quantity(axes, _spin(summary), summary.motion.time)
    axes.set(xlim=(0, summary.end), xlabel="time  [s]")
    return figure


def _finding(summary: Summary) -> str:
    name = without_formula(summary.motion.scene.name or "simulation", 60)
    return Text("Simulated motion: {name:s}, {ending}", name=name, ending=summary.ending)


def _zoom(summary: Summary) -> tuple[float, float] | None:
    """Return the second that is shown by itself [s]: the last one of a top that fell, else the middle one."""
    if summary.end < _LEAST_FOR_ZOOM:
        return None
    start = summary.end - ZOOM_S if summary.motion.fell else math.floor(summary.end / 2)
    return start, start + ZOOM_S


# --- the path ---


def _draw_paths(figure: Figure, summary: Summary) -> None:
    """Draw both paths on one scale in both directions, over the same x; the colour is the time."""
    step = max(1, len(summary.motion.time) // MOST_POINTS)
    place, time = 100 * summary.motion.position[::step], summary.motion.time[::step]
    wide = 2.4
    panels = [panel(figure, left, 0.62, wide, _PATH) for left in (_LEFT, _LEFT + wide + 0.6)]
    middle = (place.min(axis=0) + place.max(axis=0)) / 2
    shape, span = wide / _PATH, np.ptp(place, axis=0)
    half = 0.5 * 1.16 * max(span[0], shape * span[1], shape * span[2], _SMALLEST_CM)
    for axes, up, title in ((panels[0], 2, "Path from the side"), (panels[1], 1, "Path from above")):
        points = place[:, [0, up]]
        path = LineCollection(
            np.stack([points[:-1], points[1:]], axis=1).tolist(), cmap="cividis", array=time[:-1], rasterized=True,
            linewidths=0.7 if len(place) < 20_000 else 0.35, clim=(0, summary.end),
        )  # fmt: skip
        axes.add_collection(path)
        axes.plot(*points[0], "o", color="black", markersize=5, markerfacecolor="white", label="start")
        axes.plot(*points[-1], "s", color=LOOKS["top"].colour, markersize=4.5, label="end")
        axes.set_aspect("equal")
        axes.set_xlim(middle[0] - half, middle[0] + half)
        axes.set_ylim(middle[up] - half / shape, middle[up] + half / shape)
        axes.locator_params(nbins=6)
        axes.set(xlabel="x  [cm]", ylabel=f"{'xyz'[up]}  [cm]")
        axes.set_title(title, loc="left")
    panels[1].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, handlelength=1, columnspacing=1)
    bar = figure.colorbar(path, cax=panel(figure, _LEFT + 2 * wide + 0.75, 0.62, 0.1, _PATH))
    bar.set_label("time  [s]")
    bar.outline.set_linewidth(0.5)


# --- in time ---


@dataclass(frozen=True, eq=False)
class _Quantity:
    """One row of curves.

    Attributes:
        title: what it is, with its range.
        axis: its name and unit.
        curves: things of `LOOKS`, their names for the legend, values of each.
        drive: the frequency at which a line is drawn [Hz]; None: no line.
        least: an axis shows no smaller range, in which rounding would look like a motion.
        from_zero: whether the axis begins at 0.
    """

    title: str
    axis: str
    curves: tuple[tuple[str, str, Array], ...]
    drive: float | None = None
    least: float = 0.0
    from_zero: bool = False

    @property
    def has_legend(self) -> bool:
        """Whether there is more than one line to tell apart."""
        return len(self.curves) > 1 or self.drive is not None


def _quantities(summary: Summary) -> tuple[_Quantity, ...]:
    motion = summary.motion
    tilt = np.degrees(motion.tilt)
    energy = motion.energies
    change = (energy - energy[0]) / (abs(energy[0]) or 1.0)
    power = math.floor(math.log10(summary.energy_change)) if summary.energy_change > 0 else 0
    return (
        _Quantity(
            Text("Height: {said}", said=summary.heights), "z  [cm]",
            (("height", "height", 100 * motion.position[:, 2]),),
        ),
        _spin(summary),
        _Quantity(
            Text("Tilt of the axis against the base's: up to {degrees:.3g}°", degrees=float(tilt.max())), "tilt  [°]",
            (("tilt", "tilt", tilt),), from_zero=True,
        ),
        _Quantity(
            _energy_title(summary), "(E − E₀)/E₀" + (f"  [10$^{{{power}}}$]" if power else ""),
            (("energy", "energy", change / 10.0**power),),
        ),
    )  # fmt: skip


def _spin(summary: Summary) -> _Quantity:
    motion, scene = summary.motion, summary.motion.scene
    curves = [("top", "top", motion.spin_hz)]
    if scene.washers.inertia_kg_m2 > 0:
        curves.append(("washers", "loose washers", motion.washer_spin_hz))
    return _Quantity(
        Text("Spin: {said}", said=summary.spin), "ω₃/2π  [Hz]", tuple(curves),
        drive=scene.drive.frequency_hz if scene.drive.is_periodic else None,
        least=1e-6 * abs(float(motion.spin_hz[0])),
    )  # fmt: skip


def _energy_title(summary: Summary) -> str:
    there = changing_energy(summary.motion.scene)
    if not there:
        return Text("Error of the energy, which should be constant: {x:n}", x=digits(summary.energy_change, 1))
    own = " (without the drive's own part)" if "drive" in there else ""
    return Text("Energy, change since the start by {what}{own}", what=enumeration(there), own=own)


def _draw_quantity(axes: Axes, quantity: _Quantity, time: Array) -> None:
    envelope = False
    for name, label, values in quantity.curves:
        envelope |= curve(axes, time, values, LOOKS[name], pieces=PIECES, label=label)
    _finish(axes, quantity)
    axes.set_ylabel(quantity.axis, fontsize=8)
    title = quantity.title
    if envelope:
        title = Sentences(title, "shaded: least to greatest, black: mean", between="; ")
    if quantity.has_legend:
        axes.legend(loc="lower left", bbox_to_anchor=(0, 0.96), ncols=3, fontsize=SMALL, borderaxespad=0, borderpad=0.2)
    title = title if len(title) < _LETTERS else quantity.title
    axes.set_title(title, loc="left", fontsize=8, pad=14 if quantity.has_legend else None)


def _draw_zoom(axes: Axes, quantity: _Quantity, time: Array, zoom: tuple[float, float]) -> None:
    inside = slice(*np.searchsorted(time, zoom))
    for name, _, values in quantity.curves:
        axes.plot(time[inside], values[inside], linewidth=0.9, **LOOKS[name].as_line)
    _finish(axes, quantity)
    axes.set_xlim(*zoom)
    axes.locator_params(axis="y", nbins=4)
    axes.ticklabel_format(axis="y", useOffset=False)
    axes.xaxis.set_major_locator(mpl.ticker.MultipleLocator(ZOOM_S / 2))
    axes.xaxis.set_major_formatter(mpl.ticker.FormatStrFormatter("%g"))
    axes.tick_params(labelsize=SMALL)


def _finish(axes: Axes, quantity: _Quantity) -> None:
    """Draw the drive's line, and set limits in which rounding does not look like a motion."""
    if quantity.drive is not None:
        axes.axhline(quantity.drive, linewidth=0.8, label="drive", **LOOKS["drive"].as_line)
    if quantity.from_zero:
        axes.set_ylim(bottom=0)
    low, high = axes.get_ylim()
    if high - low < quantity.least:
        axes.set_ylim((low + high) / 2 - 50 * quantity.least, (low + high) / 2 + 50 * quantity.least)
        axes.ticklabel_format(axis="y", useOffset=False)


# --- the spectrum ---


def _draw_spectrum(axes: Axes, summary: Summary) -> None:
    lines = summary.lines
    assert lines.spectrum
    axes.set(xlabel="frequency  [Hz]", ylabel="amplitude  [mrad]")
    frequency, amplitude = lines.spectrum[0], 1000 * lines.spectrum[1]
    places = [0.0, *(line.frequency for line in lines.lines)]
    margin = 3 + 0.15 * max(map(abs, places))
    limits = (min(places) - margin, max(places) + margin)
    shown = (frequency >= limits[0]) & (frequency <= limits[1])
    top = amplitude.max()
    axes.semilogy(*_outline(frequency[shown], amplitude[shown]), linewidth=0.7, **LOOKS["tilt"].as_line)
    room = DECADES * _NAMES_SHARE / (1 - _NAMES_SHARE)  # decades above the highest line, for the names
    axes.set(xlim=limits, ylim=(top / 10**DECADES, top * 10**room))
    _name_lines(axes, summary)
    of = "" if lines.until > 0.99 * summary.end else Text(", of the first {s:.3g} s", s=lines.until)
    said = "Spectrum of the axis, n$_x$ + i n$_y$, positive in the sense of a positive spin; resolution {hz:.2g} Hz{of}"
    axes.set_title(Text(said, hz=lines.resolution, of=of), loc="left", fontsize=8)


def _outline(frequency: Array, amplitude: Array) -> tuple[Array, Array]:
    """Return the highest bin of each piece: no line is lost."""
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
    text: str

    def fits(self, others: list[_Label]) -> bool:
        """Return whether it is inside of the panel and neither it nor its pole crosses another one."""
        inside = self.left >= 0 and self.right <= 1
        return inside and not any(self._crosses(other) or other._under(self) or self._under(other) for other in others)

    def _crosses(self, other: _Label) -> bool:
        beside = self.right + _GAP < other.left or other.right + _GAP < self.left
        return self.row == other.row and not beside

    def _under(self, other: _Label) -> bool:
        """Return whether the other's pole goes up through this name."""
        return self.row <= other.row and self.covers([other.pole])

    def covers(self, poles: list[float]) -> bool:
        """Return whether one of the poles would go through this name if it were high enough."""
        return any(self.left - _GAP / 2 < pole < self.right + _GAP / 2 for pole in poles)


def _name_lines(axes: Axes, summary: Summary) -> None:
    """Write frequency and name at the strongest lines, where there is room; at sidebands the frequency alone."""
    flags: list[_Label] = []
    lines = sorted(summary.lines.lines, key=lambda line: line.sideband)[:MOST_NAMED]
    for k, line in enumerate(lines):
        waiting = [_pole(axes, other.frequency) for other in lines[k + 1 :] if not other.sideband]
        number = in_language(Text("{hz:n}", hz=with_decimals(line.frequency, 2)))
        texts = [number] if line.sideband or not line.name else [f"{number} {in_language(line.name)}", number]
        found = next(filter(None, (_place(axes, line.frequency, text, flags, waiting) for text in texts)), None)
        if found:
            flags.append(found)
            _draw_label(axes, line, found)


def _place(axes: Axes, frequency: float, text: str, flags: list[_Label], waiting: list[float]) -> _Label | None:
    """Return a place for a name that leaves room for poles to come: beside them, or high enough above."""
    places = [flag for flag in _flags(axes, frequency, text) if flag.fits(flags)]
    beside = (flag for flag in places if not flag.covers(waiting))
    above = (flag for flag in places if flag.row >= _FREE_ROWS)
    return next(beside, None) or next(above, None)


def _pole(axes: Axes, frequency: float) -> float:
    low, high = axes.get_xlim()
    return float((frequency - low) / (high - low))


def _flags(axes: Axes, frequency: float, text: str) -> Iterator[_Label]:
    """Yield places where a name may hang: away from zero or towards it, in the lowest row first."""
    pole = _pole(axes, frequency)
    probe = axes.text(0, 0, text, fontsize=_FONT)
    width = 1.03 * probe.get_window_extent().width / axes.get_window_extent().width
    probe.remove()
    right = _Label(pole, pole + _GAP / 2, pole + _GAP / 2 + width, 0, text)
    left = _Label(pole, pole - _GAP / 2 - width, pole - _GAP / 2, 0, text)
    for flag in (left, right) if frequency < 0 else (right, left):
        yield from (replace(flag, row=k) for k in range(ROWS))


def _draw_label(axes: Axes, line: NamedLine, flag: _Label) -> None:
    height = 1 - _NAMES_SHARE + 0.01 + flag.row * _ROW
    mixed = axes.get_xaxis_transform()  # frequencies across, parts of the panel up
    low, high = np.log10(axes.get_ylim())
    peak = (math.log10(1000 * line.amplitude) - low) / (high - low)
    axes.plot([line.frequency] * 2, [peak + 0.01, height + 0.8 * _ROW], color=GREY, linewidth=0.5, transform=mixed)
    x, side = (flag.right, "right") if flag.right < flag.pole else (flag.left, "left")
    axes.text(x, height, flag.text, fontsize=_FONT, color="black", transform=axes.transAxes, ha=side)
