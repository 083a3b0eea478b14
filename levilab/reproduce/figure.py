"""The figures of the chapters."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.special import ndtri

from analysis.arrays import Array
from analysis.limits import Statistics
from analysis.pull import Driven
from analysis.spindown.fit import SpinDown
from levilab.motion.lines import AxisLines
from levilab.present.drawing import SMALL
from levilab.present.looks import BLACK, BLUE, GREEN, GREY, LOOKS, ORANGE, SERIES, VERMILION
from levilab.present.numbers import with_decimals
from levilab.present.style import STYLE, WIDE
from levilab.reproduce.tops import MASS_KG, Flags, known
from levilab.simulator.equilibrium import MassWindows, stability_of
from levilab.simulator.scene import preset
from levilab.simulator.trajectory import Trajectory
from levilab.stability.thesis import HIGHEST_HZ, LOOSE_HZ, SIMULATED_HZ, WITH_DRAG_HZ

#: A curve of more points is drawn as the band between its least and greatest values in this number of pieces.
PIECES = 900
#: Lost tops and tops that are up.
FATES = ListedColormap([LOOKS["lost"].colour, LOOKS["up"].colour])
_UP = Patch(color=LOOKS["up"].colour, label="up after 30 s")
_LOST = Patch(color=LOOKS["lost"].colour, label="lost")
_THESIS: dict[str, Any] = {
    "marker": "v",
    "color": "white",
    "markeredgecolor": BLACK,
    "linestyle": "none",
    "markersize": 6,
}
#: Axes in parts of the figure: left, bottom, width, height.
Box = tuple[float, float, float, float]


def _figure(height: float, *boxes: Box) -> tuple[Figure, list[Axes]]:
    """Return a wide figure and its panels; placed by hand, since automatic layouts differ in the last bit."""
    figure = Figure(figsize=(WIDE, height))
    return figure, [figure.add_axes(box) for box in boxes]


def _band(axes: Axes, time: Array, values: Array, colour: str) -> None:
    """Draw a curve, or the band between its least and greatest values where it has too many points."""
    if time.size <= 2 * PIECES:
        axes.plot(time, values, color=colour, linewidth=0.8)
        return
    first = np.linspace(0, time.size, PIECES, endpoint=False).astype(int)
    least, greatest = (function.reduceat(values, first) for function in (np.minimum, np.maximum))
    axes.fill_between(time[first], least, greatest, color=colour, linewidth=0.4)


# --- where tops float ---


@dataclass(frozen=True)
class Contours:
    """A potential.

    Attributes:
        r, z: [cm], shape (n,) and (m,).
        energy: above that of the place where the top rests, shape (m, n) [µJ].
        height: of that place [cm].
    """

    r: Array
    z: Array
    energy: Array
    height: float


def rim(shown: Contours) -> float:
    """Return the energy of the lowest pass out of the trap [µJ]: below it a basin stays inside the picture."""
    from scipy.ndimage import label

    centre = (int(np.argmin(np.abs(shown.z - shown.height))), int(np.argmin(np.abs(shown.r))))
    low, high = 0.0, 200.0
    for _ in range(40):
        middle = (low + high) / 2
        basins, _ = label(shown.energy <= middle)
        own = basins == basins[centre] if basins[centre] else np.zeros(basins.shape, dtype=np.bool_)
        out = own[0].any() or own[-1].any() or own[:, 0].any() or own[:, -1].any()
        low, high = (low, middle) if out else (middle, high)
    return low


@mpl.rc_context(STYLE)
def contour_figure(shown: Sequence[Contours], names: Sequence[str]) -> Figure:
    """Draw the potential of tops of several masses."""
    width = 0.27
    figure, panels = _figure(2.9, *[(0.075 + k * 0.315, 0.16, width, 0.74) for k in range(len(shown))])
    for axes, one, name in zip(panels, shown, names, strict=True):
        top = rim(one)
        levels = np.arange(-40.0, 41.0, 2.0)
        axes.contour(one.r, one.z, one.energy, levels=levels, colors=GREY, linewidths=0.5, negative_linestyles="solid")
        axes.contour(one.r, one.z, one.energy, levels=[top], colors=LOOKS["up"].colour, linewidths=1.6)
        axes.plot(0.0, one.height, "+", color=VERMILION, markersize=7)
        axes.set_title(f"{name}: rim {top:.1f} µJ")
        axes.set(xlabel="distance r  [cm]", ylim=(one.z[0], one.z[-1]))
    panels[0].set_ylabel("height z  [cm]")
    return figure


@mpl.rc_context(STYLE)
def window_figure(over: MassWindows, estimate: float) -> Figure:
    """Draw the window of spin over mass."""
    figure, (axes,) = _figure(3.2, (0.085, 0.15, 0.57, 0.79))
    masses = 1e3 * over.masses
    up = LOOKS["up"].colour
    axes.fill_between(
        masses, over.slowest, over.fastest, color=up, alpha=0.25, linewidth=0, label="small motions stay small"
    )
    axes.plot(masses, over.slowest, color=up)
    axes.plot(masses, over.fastest, color=up)
    limits = np.array(list(SIMULATED_HZ.values()))
    axes.plot(np.full(limits.size, 1e3 * MASS_KG), limits.ravel(), **_THESIS, label="thesis, four starts, simulated")
    axes.axhline(estimate, **LOOKS["theory"].as_line, label="its estimate of the lower limit")
    axes.set(xlabel="mass  [g]", ylabel="spin  [Hz]", ylim=(0, 100), xlim=(masses[0], masses[-1]))
    figure.legend(loc="center left", bbox_to_anchor=(0.66, 0.5))
    return figure


# --- limits ---


@mpl.rc_context(STYLE)
def limits_figure(
    scans: tuple[Array, Mapping[str, Flags]],
    lower: tuple[Array, Mapping[str, Array]],
    falling: Mapping[str, Array],
    aside: tuple[Array, Array],
) -> Figure:
    """Draw scans of the upper limit, and the dependences of the lower ones.

    Args:
        scans: spins, shape (n,) [Hz], and by start which tops are up, shape (n,).
        lower: masses, shape (m,) [g], and lower limits by start, shape (m,) [Hz].
        falling: spins at the fall with drag, by start [Hz].
        aside: places of the third start beside the axis [cm], and its lower limits [Hz].
    """
    figure, panels = _figure(
        5.2, (0.085, 0.63, 0.9, 0.26), (0.085, 0.1, 0.26, 0.37), (0.49, 0.1, 0.205, 0.37), (0.785, 0.1, 0.2, 0.37)
    )
    _draw_scans(panels[0], *scans)
    figure.legend(handles=[_UP, _LOST, Line2D([], [], **_THESIS, label="thesis")], loc="upper right", ncols=3)
    _draw_lower(panels[1], *lower)
    _draw_falls(panels[2], falling)
    _draw_aside(panels[3], *aside)
    return figure


def _draw_scans(axes: Axes, spins: Array, tops: Mapping[str, Flags]) -> None:
    half = (spins[1] - spins[0]) / 2
    extent = (spins[0] - half, spins[-1] + half)
    for k, (name, up) in enumerate(tops.items()):
        axes.imshow(
            up[None, :].astype(float), cmap=FATES, vmin=0, vmax=1, aspect="auto", interpolation="nearest",
            extent=(*extent, k + 0.32, k - 0.32),
        )  # fmt: skip
        axes.plot(SIMULATED_HZ[name][1], k - 0.42, **_THESIS)
    axes.set_yticks(range(len(tops)), list(tops))
    axes.tick_params(axis="y", which="both", length=0)
    axes.set(xlim=extent, ylim=(len(tops) - 0.5, -0.75), xlabel="spin at the start  [Hz]")
    axes.spines["left"].set_visible(False)
    axes.set_title("The upper edge, scanned")


def _draw_lower(axes: Axes, masses: Array, lower: Mapping[str, Array]) -> None:
    for (name, values), colour in zip(lower.items(), SERIES, strict=False):
        axes.plot(masses, values, color=colour)
        axes.axhline(SIMULATED_HZ[name][0], color=colour, linestyle=(0, (4, 2)), linewidth=0.8)
        axes.annotate(
            name, (masses[-1], SIMULATED_HZ[name][0]), (4, 0), textcoords="offset points", color=colour,
            fontsize=8, va="center", annotation_clip=False,
        )  # fmt: skip
    axes.set(xlabel="mass  [g]", ylabel="lower limit  [Hz]", ylim=(21.6, 23.3), xlim=(masses[0], masses[-1]))
    axes.set_title("Lower limit over mass")


def _draw_falls(axes: Axes, falling: Mapping[str, Array]) -> None:
    for k, ((name, values), colour) in enumerate(zip(falling.items(), SERIES, strict=False)):
        spread = 0.5 * (np.arange(values.size) / (values.size - 1) - 0.5)
        axes.plot(k + spread, values, ".", color=colour, markersize=3)
        axes.plot([k - 0.4, k + 0.4], [WITH_DRAG_HZ[name]] * 2, color=colour, linestyle=(0, (4, 2)))
    axes.set_xticks(range(len(falling)), list(falling))
    axes.set_ylabel("spin at the fall  [Hz]")
    axes.set_title("With drag")


def _draw_aside(axes: Axes, places: Array, lower: Array) -> None:
    axes.plot(places, lower, "o-", color=SERIES[2], markersize=3)
    axes.axhline(SIMULATED_HZ["IC3"][0], color=SERIES[2], linestyle=(0, (4, 2)))
    for x in (0.3, 0.5):
        axes.axvline(x, color=GREY, linewidth=0.6, linestyle=":")
    axes.set(xlabel="x(0) of IC3  [cm]", ylabel="lower limit  [Hz]")
    axes.set_title("The misprint")


# --- motions ---


@mpl.rc_context(STYLE)
def paths_figure(shown: Mapping[str, Trajectory]) -> Figure:
    """Draw paths over x and z."""
    figure, panels = _figure(
        4.6, *[(0.085 + 0.48 * (k % 2), 0.59 - 0.48 * (k // 2), 0.41, 0.35) for k in range(len(shown))]
    )
    for axes, (name, motion) in zip(panels, shown.items(), strict=True):
        place = 100 * motion.position
        axes.plot(place[:, 0], place[:, 2], color=LOOKS["path"].colour, linewidth=0.4)
        axes.plot(place[0, 0], place[0, 2], "o", color=BLACK, markerfacecolor="white", markersize=4)
        axes.set_title(name)
        axes.set(xlabel="x  [cm]", ylabel="z  [cm]")
    return figure


@mpl.rc_context(STYLE)
def fall_figure(motion: Trajectory) -> Figure:
    """Draw tilt, height and spin up to the fall."""
    boxes = [(0.085, 0.68 - 0.285 * k, 0.43, 0.25) for k in range(3)]
    boxes += [(0.585, 0.68 - 0.285 * k, 0.4, 0.25) for k in range(3)]
    figure, panels = _figure(4.6, *boxes)
    end = float(motion.time[-1])
    rows: tuple[tuple[Array, str, str], ...] = (
        (np.degrees(motion.tilt), LOOKS["tilt"].colour, "tilt  [°]"),
        (100 * motion.position[:, 2], LOOKS["height"].colour, "height z  [cm]"),
        (motion.spin_hz, LOOKS["top"].colour, "spin ω₃/2π  [Hz]"),
    )
    late = motion.time >= end - 1.0
    for k, (values, colour, label) in enumerate(rows):
        _band(panels[k], motion.time, values, colour)
        panels[k].set_xlim(0, end)
        panels[k].set_ylabel(label)
        panels[k + 3].plot(motion.time[late], values[late], color=colour)
        panels[k + 3].set_xlim(end - 1.0, end)
        for axes in (panels[k], panels[k + 3]):
            axes.tick_params(labelbottom=k == 2)
    panels[0].set_title("From 30 Hz to the fall")
    panels[3].set_title("The last second")
    panels[2].set_xlabel("time  [s]")
    panels[5].set_xlabel("time  [s]")
    return figure


@mpl.rc_context(STYLE)
def tilted_figure(motions: tuple[Trajectory, Trajectory]) -> Figure:
    """Draw the axis from above, with a tilted and an aligned moment."""
    figure, panels = _figure(3.3, (0.1, 0.14, 0.37, 0.78), (0.6, 0.14, 0.37, 0.78))
    most = max(float(np.abs(motion.axis[:, :2]).max()) for motion in motions) * 1.05e3
    for axes, motion, name in zip(panels, motions, ("moment tilted by 1.77°", "moment along the axis"), strict=True):
        axes.plot(1e3 * motion.axis[:, 0], 1e3 * motion.axis[:, 1], color=LOOKS["path"].colour, linewidth=0.4)
        axes.set_aspect("equal")
        axes.set(xlim=(-most, most), ylim=(-most, most), xlabel="$n_x$  [10⁻³]", ylabel="$n_y$  [10⁻³]")
        axes.set_title(name)
    return figure


@mpl.rc_context(STYLE)
def driven_figure(motion: Trajectory) -> Figure:
    """Draw the spin of the driven top."""
    figure, panels = _figure(3.6, (0.085, 0.63, 0.89, 0.29), (0.085, 0.13, 0.89, 0.29))
    drive = motion.scene.drive.frequency_hz
    early = motion.time <= 20.0
    _band(panels[0], motion.time, motion.spin_hz, LOOKS["top"].colour)
    panels[1].plot(motion.time[early], motion.spin_hz[early], color=LOOKS["top"].colour, linewidth=0.8)
    for axes in panels:
        axes.axhline(drive, **LOOKS["drive"].as_line, linewidth=0.9)
        axes.set_ylabel("spin ω₃/2π  [Hz]")
        axes.set_xlabel("time  [s]")
    panels[0].set_xlim(0, motion.time[-1])
    panels[1].set_xlim(0, 20)
    panels[0].set_title("300 s: between the least and the greatest value")
    panels[1].set_title("The first 20 s")
    return figure


#: Rates of the azimuth are cut here for the figure [Hz].
_CUT_HZ = 120.0
#: Lines that are slower have one name together: they stand too near to each other.
_SLOW_HZ = 2.0


@mpl.rc_context(STYLE)
def azimuth_figure(motion: Trajectory, rate: Array, lines: AxisLines) -> Figure:
    """Draw the azimuth's rate [Hz], and the spectrum of the axis."""
    figure, panels = _figure(4.6, (0.085, 0.63, 0.5, 0.3), (0.68, 0.63, 0.305, 0.3), (0.085, 0.11, 0.9, 0.35))
    early = motion.time <= 5.0
    shown = np.where(np.abs(rate) > _CUT_HZ, np.nan, rate)
    panels[0].plot(motion.time[early], shown[early], color=LOOKS["precession"].colour, linewidth=0.7)
    panels[0].set(xlabel="time  [s]", ylabel="φ̇/2π  [Hz]", xlim=(0, 5), ylim=(-_CUT_HZ, _CUT_HZ))
    panels[0].set_title("The rate of the azimuth")
    some = slice(None, None, 7)
    panels[1].plot(1e3 * motion.tilt[some], rate[some], ",", color=LOOKS["precession"].colour)
    panels[1].set(xlabel="tilt θ  [mrad]", xlim=(0, 1e3 * motion.tilt.max()), ylim=(-_CUT_HZ, _CUT_HZ))
    panels[1].set_title("... is large near θ = 0")
    frequency, amplitude = known(lines.spectrum)
    near = (frequency > -13) & (frequency < 60)
    axes = panels[2]
    axes.semilogy(frequency[near], 1e3 * amplitude[near], color=BLUE, linewidth=0.5)
    highest = 1e3 * max(line.amplitude for line in lines.lines)
    named = [line for line in lines.lines if line.name and not line.sideband]
    for line in named:
        if abs(line.frequency) > _SLOW_HZ:
            axes.annotate(
                f"{line.name}\n{line.frequency:.2f}", (line.frequency, 1e3 * line.amplitude), (0, 5),
                textcoords="offset points", ha="center", fontsize=7,
            )  # fmt: skip
    slow = sorted(line.frequency for line in named if abs(line.frequency) <= _SLOW_HZ)
    if slow:  # to the left of the precession's name
        most = 1e3 * max(line.amplitude for line in named if abs(line.frequency) <= _SLOW_HZ)
        axes.annotate(
            "swings sideways\n" + ", ".join(with_decimals(f, 2) for f in slow), (slow[-1] + 1, most), (0, 5),
            textcoords="offset points", ha="right", fontsize=7,
        )  # fmt: skip
    axes.set(
        xlim=(-13, 60),
        ylim=(1e-4 * highest, 8 * highest),
        xlabel="frequency  [Hz]",
        ylabel="|n$_{\\rm x}$ + i n$_{\\rm y}$|  [mrad]",
    )
    axes.set_title("The axis itself: lines")
    return figure


# --- spin-downs and limits ---


@mpl.rc_context(STYLE)
def spindown_figure(runs: Sequence[tuple[Array, SpinDown]]) -> Figure:
    """Draw the residuals of the runs from three laws."""
    laws = (("stokes", "n = 1"), ("disc", "n = 3/2"), ("newton", "n = 2"))
    figure, panels = _figure(3.0, *[(0.085 + k * 0.305, 0.15, 0.285, 0.75) for k in range(3)])
    most = 1050 * max(float(np.abs(fit.fit(law).residuals).max()) for _, fit in runs for law, _ in laws)
    for axes, (law, name) in zip(panels, laws, strict=True):
        for number, ((time, fit), marker) in enumerate(zip(runs, "osD^", strict=False), start=1):
            axes.plot(
                time, 1e3 * fit.fit(law).residuals, color=LOOKS[law].colour, marker=marker, linewidth=0.4,
                markerfacecolor="white", markersize=3.5, label=f"run {number}",
            )  # fmt: skip
        axes.axhline(0, color=BLACK, linewidth=0.6)
        axes.set(xlabel="time  [s]", ylim=(-most, most))
        axes.set_title(f"{name} ({law})")
        axes.tick_params(labelleft=axes is panels[0])
    panels[0].set_ylabel("reading − fit  [mHz]")
    panels[1].legend(loc="upper center", ncols=2)
    return figure


@mpl.rc_context(STYLE)
def statistics_figure(values: Array, found: Statistics, edge: float) -> Figure:
    """Draw the ten limits, and their normal quantiles."""
    mean, u, scatter = (known(value) for value in (found.mean.value, found.mean.u, known(found.scatter).value))
    figure, panels = _figure(2.9, (0.085, 0.16, 0.5, 0.75), (0.67, 0.16, 0.315, 0.75))
    left, right = panels
    left.axhspan(mean - u, mean + u, color=LOOKS["fit"].colour, alpha=0.25, linewidth=0)
    left.axhline(mean, color=LOOKS["fit"].colour)
    for sign in (-1, 1):
        left.axhline(mean + sign * scatter, color=LOOKS["fit"].colour, linestyle=(0, (4, 2)), linewidth=0.8)
    left.axhline(edge, color=ORANGE, linestyle=":")
    left.plot(np.arange(1, values.size + 1), values, **LOOKS["readings"].as_points)
    left.set(xlabel="top", ylabel="spin at the fall  [Hz]", xlim=(0.5, values.size + 0.5))
    quantiles = ndtri((np.arange(values.size) + 0.625) / (values.size + 0.25))
    right.plot(quantiles, mean + scatter * quantiles, color=LOOKS["fit"].colour)
    right.plot(quantiles, np.sort(values), **LOOKS["readings"].as_points)
    right.set(xlabel="normal quantile", ylabel="in order  [Hz]")
    return figure


@mpl.rc_context(STYLE)
def counter_figure(spin: Array, count: Array, cosine: Array) -> Figure:
    """Draw the count less the spin."""
    figure, (axes,) = _figure(2.9, (0.1, 0.16, 0.885, 0.78))
    order = np.argsort(spin)
    axes.plot(spin[order], 1e3 * (cosine - spin)[order], color=LOOKS["tilt"].colour, label="ω₃(1/cos θ − 1)/2π")
    axes.plot(spin, 1e3 * (count - spin), **LOOKS["readings"].as_points, label="count − ω₃/2π")
    axes.set(xlabel="spin ω₃/2π  [Hz]", ylabel="count − spin  [mHz]", ylim=(0, None))
    axes.legend(loc="upper right")
    return figure


@mpl.rc_context(STYLE)
def drive_figure(
    driven: Callable[..., Driven],
    *,
    fields: Sequence[float],
    ramps: Sequence[float],
    spread: float,
    swings: Sequence[float],
    start: float,
) -> Figure:
    """Draw the pull of drives against drag and ramp, and the highest spin of a top that swings about its drive.

    Args:
        driven: amplitude and ramp, with `leans` → the top under it.
        fields: amplitudes of the drives [T].
        ramps: their rates [Hz/s].
        spread: relative scatter of the drag.
        swings: amplitudes of the spin about the drive, where a ramp begins [Hz].
        start: spin at which it begins [Hz].
    """
    figure, (left, right) = _figure(3.6, (0.085, 0.14, 0.5, 0.8), (0.67, 0.14, 0.315, 0.8))
    edge = known(stability_of(preset("undriven")).floating).spins[0][1]
    spins, turn = np.linspace(30.0, 105.0, 151), 2 * math.pi
    for field in fields:
        pull = np.array([driven(field, 0.0).pull(spin) for spin in spins]) / turn
        left.plot(spins, pull, color=GREY, linewidth=1)
        left.annotate(f"{1e3 * field:.1f} mT", (spins[30], pull[30]), va="bottom", fontsize=SMALL)
    for ramp, colour in zip(ramps, (BLUE, GREEN, VERMILION), strict=True):
        tops = [driven(field, ramp) for field in fields]
        load = np.array([tops[0].load(spin) for spin in spins]) / turn
        left.plot(spins, load, color=colour, label=f"drag and ramp of {ramp:g} Hz/s" if ramp else "drag")
        scatter = spread * (load - ramp)
        left.fill_between(spins, load - scatter, load + scatter, color=colour, alpha=0.2, linewidth=0)
        left.plot(
            [one.highest() for one in tops],
            [one.pull(one.highest()) / turn for one in tops],
            "o",
            color=colour,
            markersize=4,
        )
        for leans, style in ((False, "-"), (True, "--")) if ramp else ():
            lost = [driven(4e-4, ramp, leans=leans).highest_with_swing(swing, start) for swing in swings]
            name = f"{ramp:g} Hz/s" + ", with the lean" * leans
            right.plot(swings, lost, color=colour, linestyle=style, label=name)
    left.axvspan(edge, spins[-1], color=VERMILION, alpha=0.08, linewidth=0)
    right.axhspan(edge, spins[-1], color=VERMILION, alpha=0.08, linewidth=0)
    for spin in (HIGHEST_HZ, LOOSE_HZ):
        left.axvline(spin, color=BLACK, linewidth=0.8, linestyle=":")
        right.axhline(spin, color=BLACK, linewidth=0.8, linestyle=":")
    left.set(xlabel="spin  [Hz]", ylabel="change of the spin  [Hz/s]", xlim=(30, 105), ylim=(0, 1.0))
    right.set(xlabel=f"swing about the drive at {start:g} Hz  [Hz]", ylabel="spin at the loss  [Hz]", ylim=(40, 85))
    left.legend(loc="lower right")
    right.legend(loc="lower left")
    return figure


# --- the magnet, and the papers ---


@mpl.rc_context(STYLE)
def dipole_figure(z: Array, fields: tuple[Array, Array], height: float) -> Figure:
    """Draw the force on a disc less that on a point, and the curvature of the field of both."""
    figure, panels = _figure(2.9, (0.085, 0.17, 0.4, 0.74), (0.575, 0.17, 0.41, 0.74))
    left, right = panels
    for k, name, colour, line in ((0, "energy, B", BLUE, "-"), (1, "force, B′", VERMILION, (0, (4, 2)))):
        left.plot(z, 100 * (fields[1][k] / fields[0][k] - 1), color=colour, linestyle=line, label=name)
    left.set_title("disc over point, less 1")
    left.set_ylabel("[%]")
    # 1 T/m² is 0.1 mT/cm²
    for field, name, colour, line in ((fields[0], "a point", BLACK, (0, (4, 2))), (fields[1], "the disc", GREEN, "-")):
        right.plot(z, 0.1 * field[2], color=colour, linestyle=line, label=name)
    right.set_title("second derivative: above 0 it is stable")
    right.set_ylabel("B″  [mT/cm²]")
    for axes in panels:
        axes.axhline(0, color=BLACK, linewidth=0.6)
        axes.axvline(height, color=GREY, linewidth=0.8, linestyle=":")
        axes.set(xlabel="height z  [cm]", xlim=(z[0], z[-1]))
        axes.legend(loc="upper right" if axes is left else "lower right")
    return figure


@mpl.rc_context(STYLE)
def simon_figure(scans: Sequence[tuple[str, Array, Flags, tuple[float, float], tuple[float, float]]]) -> Figure:
    """Draw survival of the three tops over spin."""
    figure, panels = _figure(2.9, *[(0.14, 0.67 - 0.265 * k, 0.845, 0.14) for k in range(len(scans))])
    for axes, (name, spins, up, window, printed) in zip(panels, scans, strict=True):
        extent = (spins[0] - 0.5, spins[-1] + 0.5, 0.0, 1.0)
        axes.imshow(
            up[None, :].astype(float), cmap=FATES, vmin=0, vmax=1, aspect="auto", interpolation="nearest", extent=extent
        )
        for edge in window:
            axes.axvline(edge, **LOOKS["theory"].as_line)
        axes.plot(printed, [1.18, 1.18], **_THESIS, clip_on=False)
        axes.set_yticks([])
        axes.set(xlim=(spins[0], spins[-1]), ylim=(0, 1))
        axes.set_ylabel(name.replace("base and ", ""), rotation=0, ha="right", va="center")
        axes.spines["left"].set_visible(False)
    panels[-1].set_xlabel("spin  [rad/s]")
    edge_line = Line2D([], [], **LOOKS["theory"].as_line, label="quartic")
    figure.legend(
        handles=[_UP, _LOST, edge_line, Line2D([], [], **_THESIS, label="Table I")],
        loc="upper right", bbox_to_anchor=(0.975, 1.0), ncols=4,
    )  # fmt: skip
    return figure


@mpl.rc_context(STYLE)
def gans_figure(spins: Array, tilts: Array, up: Flags, window: tuple[float, float]) -> Figure:
    """Draw survival over spin and tilt."""
    figure, (axes,) = _figure(3.0, (0.085, 0.15, 0.66, 0.8))
    axes.pcolormesh(spins, tilts, up.T.astype(float), cmap=FATES, vmin=0, vmax=1, shading="nearest", rasterized=True)
    axes.set_yscale("log")
    axes.tick_params(which="both", direction="out")  # inside they would lie below the map
    for edge in window:
        if math.isfinite(edge):
            axes.axvline(edge, **LOOKS["theory"].as_line)
    axes.set(xlabel="spin  [√(g/R)]", ylabel="tilt of the start  [rad]", xlim=(spins[0], spins[-1]))
    line = Line2D([], [], **LOOKS["theory"].as_line, label="small motions")
    figure.legend(handles=[_UP, _LOST, line], loc="center left", bbox_to_anchor=(0.76, 0.5))
    return figure
