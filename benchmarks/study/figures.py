"""The figures of the study, from its stores and numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LinearSegmentedColormap, ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numbers_of import THESIS_KG, TOP, TRAP_HZ, load, slow_resonance, swing_hz
from PIL import Image
from plans import WAVES
from thesis import THESIS

from levilab.present.style import STYLE, save_png
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import with_settings
from levilab.stability.thesis import STARTS
from levilab.sweeps.figure import map_figure
from levilab.sweeps.store import Store

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

BLUE, GREY, ORANGE, PURPLE, GREEN, TAN = "#0072B2", "#B8B8B8", "#D55E00", "#CC79A7", "#009E73", "#E8C07D"
MEASURED_HZ, MEASURED_U_HZ, SCATTER_HZ = (THESIS[key] for key in ("measured_hz", "measured_u_hz", "scatter_hz"))
MARKS = {"IC1": "o", "IC2": "s", "IC3": "D", "IC4": "^"}
#: Colours of a picture that is kept: a page shows no difference, and it takes half of the room.
COLOURS = 128
#: Falls: slower than measured, within its scatter, within its standard error, faster.
FALLS = ("#F6E3A1", "#A6DBA0", "#1B7837", ORANGE)
#: Lost tops, from those that are lost at once to those that last.
LOST = LinearSegmentedColormap.from_list("lost", ["#F2F2F2", "#B0B0B0", "#5A5A5A"])
LIFETIMES = LogNorm(0.1, 30.0)


def cells(axes: Axes, x: Array, y: Array, up: Any, lifetimes: Any) -> Any:
    """Blue where a top is up, else grey by how long it lasted; shape (x, y).  Returns the greys for a colour bar."""
    lost = np.ma.array(np.clip(lifetimes, 0.1, 30.0), mask=up)
    greys = axes.pcolormesh(x, y, lost.T, cmap=LOST, norm=LIFETIMES, shading="nearest", rasterized=True)
    blue = np.ma.array(np.ones(up.shape), mask=~up)
    axes.pcolormesh(x, y, blue.T, cmap=ListedColormap([BLUE]), shading="nearest", rasterized=True)
    axes.grid(visible=False)
    return greys


def published(axes: Axes) -> None:
    """The thesis's simulated limits at the heights of their starts."""
    for name, settings in STARTS.items():
        height = 1e2 * with_settings(TOP, list(settings)).start.position_m[2]
        style: dict[str, Any] = {"color": "white", "markeredgecolor": "black", "linestyle": "none", "markersize": 6}
        limits_hz = [THESIS["starts"][name][key] for key in ("lower_hz", "upper_hz")]
        axes.plot(limits_hz, [height + (0.012 if name == "IC4" else 0)] * 2, marker=MARKS[name], **style)


def as_the_command_draws(folder: Path, name: str, column: str) -> Figure:
    """Return what `levilab sweep` draws of a column beside its store."""
    return map_figure(Store.open(folder / f"{name}.zarr").load(), column)


def survival_by_mass(folder: Path, _: dict[str, Any]) -> Figure:
    """Spin and mass for two heights, and how many hertz are left over mass and height."""
    found = load(folder, "survival")
    spins, masses, heights = found.axes
    figure = Figure(figsize=(11, 4.2))
    panels = figure.subplots(1, 3)
    figure.subplots_adjust(0.055, 0.24, 0.985, 0.93, 0.24)
    windows = [stability_of(TOP.changed({"top.mass_kg": float(m)})).floating for m in masses]
    for axes, height in zip(panels, (0.071, 0.073), strict=False):
        k = int(np.argmin(np.abs(heights - height)))
        cells(axes, spins, 1e3 * masses, found.up[:, :, k], found.values["lifetime_s"][:, :, k])
        for edge in (0, 1):
            axes.plot([w.spins[0][edge] if w else math.nan for w in windows], 1e3 * masses, color=ORANGE, linewidth=1.4)
        axes.set_title(f"start at {1e2 * heights[k]:.2f} cm", loc="left")
        axes.set(xlabel="spin at the start  [Hz]", ylabel="mass  [g]", xlim=(spins[0], spins[-1]))
    hertz = found.up.sum(axis=0) * (spins[1] - spins[0])
    shown = np.ma.masked_equal(hertz, 0)
    image = panels[2].pcolormesh(1e2 * heights, 1e3 * masses, shown, cmap="viridis", shading="nearest", rasterized=True)
    floats = [(1e2 * w.height, 1e3 * m) for w, m in zip(windows, masses, strict=True) if w]
    panels[2].plot(*np.array(floats).T, color="white", linewidth=2.5)
    panels[2].plot(*np.array(floats).T, color="black", linewidth=1, linestyle=":")
    panels[2].grid(visible=False)
    panels[2].set(xlabel="height of the start  [cm]", ylabel="mass  [g]")
    panels[2].set_title("hertz of spin in which it stays up", loc="left")
    figure.colorbar(image, ax=panels[2])
    adiabatic = stability_of(TOP).lifted[0]
    for axes in panels:
        for mass in (adiabatic.light, adiabatic.heavy):
            axes.axhline(1e3 * mass, color="black", linewidth=1, linestyle="--")
    figure.legend(
        handles=[
            Patch(color=BLUE, label="still up after 30 s"),
            Patch(color=GREY, label="lost (darker: later)"),
            Line2D([], [], color=ORANGE, label="window of small motions"),
            Line2D([], [], color="black", linestyle="--", label="lightest and heaviest top that floats (adiabatic)"),
            Line2D([], [], color="black", linestyle=":", label="where it floats"),
        ],
        loc="lower center",
        ncols=5,
        fontsize=8,
    )
    return figure


def edge(folder: Path, numbers: dict[str, Any]) -> Figure:
    """Return the upper edge closely, how the number of islands grows, and what is chance."""
    found, shown = load(folder, "edge"), numbers["edge"]
    figure = Figure(figsize=(11, 4.8))
    axes = figure.add_axes((0.055, 0.2, 0.5, 0.72))
    spins, heights = found.axes
    cells(axes, spins, 1e2 * heights, found.up, found.values["lifetime_s"])
    stability = stability_of(TOP)
    assert stability.floating is not None
    axes.axvline(stability.floating.spins[0][1], color=ORANGE, linewidth=1.4)
    axes.axvline(slow_resonance(TOP), color=PURPLE, linewidth=1.4, linestyle="--")
    axes.axhline(1e2 * stability.floating.height, color="black", linewidth=0.8, linestyle=":")
    axes.set(xlabel="spin at the start  [Hz]", ylabel="height of the start  [cm]")
    axes.set_title(
        f"{1e3 * THESIS_KG:.2f} g, started as IC1 at each height: up (blue) or lost (darker: later)", loc="left"
    )
    published(axes)
    axes.set_xlim(spins[0], spins[-1])
    figure.legend(
        handles=[
            Patch(color=BLUE, label="still up after 30 s"),
            Line2D([], [], color=ORANGE, label="upper edge for small motions"),
            Line2D([], [], color=PURPLE, linestyle="--", label="resonance of three slow motions"),
            Line2D([], [], color="black", linestyle=":", linewidth=0.8, label="where it floats"),
            *published_handles(),
        ],
        loc="lower left",
        bbox_to_anchor=(0.04, 0.0),
        ncols=4,
        fontsize=7.5,
    )
    count = figure.add_axes((0.625, 0.6, 0.31, 0.32))
    steps = [one["step_hz"] for one in shown["counts"]]
    count.loglog(steps, [one["islands"] for one in shown["counts"]], "o-", color=BLUE)
    count.set_yticks([3, 10, 30, 100], ["3", "10", "30", "100"])
    count.minorticks_off()
    count.set(xlabel="step of the scan  [Hz]", ylabel="islands")
    count.set_title(f"IC1, 65 to 83 Hz: islands grow as step$^{{-{shown['count_exponent']:.2f}}}$", loc="left")
    share = count.twinx()
    share.semilogx(steps, [100 * one["share_up"] for one in shown["counts"]], "s--", color=ORANGE, markersize=4)
    share.set_ylim(0, 100)
    share.set_ylabel("share up  [%]", color=ORANGE)
    share.grid(visible=False)
    chance = figure.add_axes((0.625, 0.13, 0.155, 0.32))
    flips = {float(n): 100 * f / shown["nudge_tops"] for n, f in shown["flips_of_nudge_m"].items()}
    chance.semilogx(list(flips), list(flips.values()), "o-", color=BLUE)
    chance.set(xlabel="start moved by  [m]", ylabel="fate changed  [%]")
    chance.set_title("sensitivity", loc="left")
    longer = figure.add_axes((0.845, 0.13, 0.14, 0.32))
    after = shown["share_up_after_s"]
    longer.semilogx([float(t) for t in after], [100 * s for s in after.values()], "o-", color=BLUE)
    longer.set(xlabel="duration  [s]", ylabel="share up  [%]", ylim=(0, 100))
    longer.set_title("patience", loc="left")
    return figure


def published_handles() -> list[Line2D]:
    """Signs of the thesis's limits for a legend."""
    style: dict[str, Any] = {"color": "white", "markeredgecolor": "black", "linestyle": "none", "markersize": 6}
    return [Line2D([], [], marker=mark, label=f"thesis {name}", **style) for name, mark in MARKS.items()]


def limits(folder: Path, numbers: dict[str, Any]) -> Figure:
    """Return the lower limit by height, with its reason; and where a top with drag falls."""
    shown = numbers["foot"]
    figure = Figure(figsize=(11, 5))
    left, right = figure.add_axes((0.06, 0.29, 0.41, 0.64)), figure.add_axes((0.55, 0.29, 0.43, 0.64))
    height = np.array(shown["height_cm"])
    left.axhspan(MEASURED_HZ - MEASURED_U_HZ, MEASURED_HZ + MEASURED_U_HZ, color=GREEN, alpha=0.35, linewidth=0)
    left.plot(
        height,
        np.array(shown["limit_hz"], dtype=float),
        "o",
        color=BLUE,
        markersize=4,
        label="up from here on (simulated, IC1's start)",
    )
    left.plot(
        height,
        np.array(shown["sleeping_hz"], dtype=float),
        color="black",
        linewidth=1,
        label="sleeping top's limit where it swings deepest",
    )
    left.axhline(shown["window_hz"][0], color=ORANGE, linewidth=1.4, label="lower edge of the window of small motions")
    for name, settings in STARTS.items():
        place = 1e2 * with_settings(TOP, list(settings)).start.position_m[2]
        left.plot(
            place,
            THESIS["starts"][name]["lower_hz"],
            marker=MARKS[name],
            color="white",
            markeredgecolor="black",
            linestyle="none",
            label=f"thesis {name}, simulated",
        )
    left.set(xlabel="height of the start  [cm]", ylabel="lower limit of the spin  [Hz]", ylim=(21.5, 23.15))
    left.set_title(f"No drag, {1e3 * THESIS_KG:.2f} g; band: measured {MEASURED_HZ} ± {MEASURED_U_HZ} Hz", loc="left")
    left.legend(fontsize=7.5, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2)
    found = load(folder, "fall")
    masses, heights = found.axes
    spin = found.values["fall_spin_hz"]
    off = np.where(np.isfinite(spin) & (spin < 29), spin - MEASURED_HZ, np.nan)
    classes = np.select(
        [np.abs(off) <= MEASURED_U_HZ, np.abs(off) <= SCATTER_HZ, off < 0, off > 0], [2, 1, 0, 3], default=-1
    )
    right.pcolormesh(
        1e2 * heights, 1e3 * masses, np.ma.masked_less(classes, 0), cmap=ListedColormap(list(FALLS)), vmin=0, vmax=3,
        shading="nearest", rasterized=True,
    )  # fmt: skip
    floats = [
        (1e2 * f.height, 1e3 * m)
        for m in masses
        if (f := stability_of(TOP.changed({"top.mass_kg": float(m)})).floating)
    ]
    right.plot(*np.array(floats).T, color="black", linestyle=":", linewidth=1.2)
    for name in ("IC1", "IC2"):
        place = 1e2 * with_settings(TOP, list(STARTS[name])).start.position_m[2]
        right.plot(place, 1e3 * THESIS_KG, marker=MARKS[name], color="white", markeredgecolor="black")
    right.grid(visible=False)
    right.set(xlabel="height of the start  [cm]", ylabel="mass  [g]")
    right.set_title("With drag from 30 Hz: the spin when the top is down at 6 cm", loc="left")
    means = [
        f"slower than {MEASURED_HZ - SCATTER_HZ:.2f} Hz",
        f"measured ± its scatter, {SCATTER_HZ} Hz",
        f"measured {MEASURED_HZ} ± {MEASURED_U_HZ} Hz",
        f"faster than {MEASURED_HZ + SCATTER_HZ:.2f} Hz",
    ]
    figure.legend(
        handles=[
            *(Patch(color=colour, label=meaning) for colour, meaning in zip(FALLS, means, strict=True)),
            Line2D([], [], color="black", linestyle=":", label="where the top floats"),
            *published_handles()[:2],
        ],
        loc="lower left", bbox_to_anchor=(0.535, 0.0), ncols=3, fontsize=7.5,
    )  # fmt: skip
    return figure


def lock(folder: Path, numbers: dict[str, Any]) -> Figure:
    """Tongues of sine and square, the start's phase, and the frequencies that throw the top."""
    shown = numbers["locks"]
    figure = Figure(figsize=(9.4, 6.0))
    spin = TRAP_HZ
    colours = ListedColormap([GREY, TAN, BLUE])
    for k, wave in enumerate(WAVES):
        found = load(folder, f"lock-{wave}")
        axes = figure.add_axes((0.065 + 0.325 * k, 0.58, 0.26, 0.36))
        drives, amplitudes = found.axes
        what = found.up.astype(int) + (found.values["locked"].astype(bool) & found.up)
        axes.pcolormesh(
            drives, 1e3 * amplitudes, what.T, cmap=colours, vmin=0, vmax=2, shading="nearest", rasterized=True
        )
        field = np.linspace(0, amplitudes[-1], 200)
        scale = 1e3 * field
        half = np.array([2 * swing_hz(found.scene, float(b), wave=wave) for b in field])
        part = abs(math.cos((found.scene.drive.phase_rad - shown["phase"]["best_rad"]) / 2))
        for sign in (-1, 1):
            axes.plot(spin + sign * part * half, scale, color="black", linewidth=1.2)
        vertical = shown["modes"]["own_vertical_hz"]
        for sign in (-1, 1):
            axes.axvline(spin + sign * vertical, color=PURPLE, linestyle="--", linewidth=1.2)
        axes.grid(visible=False)
        axes.set(
            xlabel="frequency of the drive  [Hz]",
            ylabel="amplitude  [mT]",
            xlim=(drives[0], drives[-1]),
            ylim=(0.02, 0.82),
        )
        axes.set_title(f"{wave}, spin at the start {spin} Hz", loc="left")
    axes = figure.add_axes((0.72, 0.58, 0.27, 0.36))
    phase = shown["phase"]
    turns = np.array(phase["phase_rad"]) / (2 * np.pi)
    axes.plot(turns, phase["width_hz"], "o", color=BLUE, label="simulated")
    axes.plot(turns, phase["expected_hz"], color="black", linewidth=1, label="pendulum")
    axes.set(xlabel="phase of the drive at the start  [turns]", ylabel="width of the tongue  [Hz]", ylim=(0, None))
    axes.set_title("sine of 0.2 mT: the phase decides", loc="left")
    axes.legend(fontsize=8)
    bottom = figure.add_axes((0.1, 0.16, 0.89, 0.25))
    waves = list(WAVES)
    for k, wave in enumerate(waves):
        found = load(folder, f"modes-{wave}")
        what = found.up.astype(int) + (found.values["locked"].astype(bool) & found.up)
        half_step = (found.axes[0][1] - found.axes[0][0]) / 2
        edges = np.append(found.axes[0] - half_step, found.axes[0][-1] + half_step)
        bottom.pcolormesh(edges, [k - 0.45, k + 0.45], what[None], cmap=colours, vmin=0, vmax=2, rasterized=True)
    bottom.set_yticks(range(len(waves)), waves)
    modes = [abs(x) for x in shown["modes"]["modes_hz"]] + [shown["modes"]["vertical_hz"]]
    for mode in modes:
        bottom.axvline(mode, color="black", linewidth=1)
        if mode > 5:
            bottom.axvline(mode / 3, color="black", linewidth=1, linestyle=":")
    bottom.axvline(spin, color=ORANGE, linewidth=1)
    bottom.axvline(spin / 3, color=ORANGE, linewidth=1, linestyle=":")
    bottom.grid(visible=False)
    bottom.set(xlabel="frequency of the drive  [Hz]", xlim=(0, 60))
    bottom.set_title(
        "A drive of 0.2 mT and any frequency, 30 s; the top's own frequencies (black), a third of them (dotted)",
        loc="left",
    )
    figure.legend(
        handles=[
            Patch(color=BLUE, label="up and locked"),
            Patch(color=TAN, label="up, not locked"),
            Patch(color=GREY, label="lost"),
            Line2D([], [], color="black", label="above: pendulum's estimate, started at this phase"),
            Line2D([], [], color=PURPLE, linestyle="--", label="above: spin ± its own frequency up and down"),
            Line2D([], [], color=ORANGE, label="below: spin (a third, dotted)"),
        ],
        loc="lower center",
        ncols=3,
        fontsize=8,
    )
    return figure


FIGURES: dict[str, Callable[[Path, dict[str, Any]], Figure]] = {
    "survival": lambda folder, _: as_the_command_draws(folder, "survival", "survived"),
    "tongue": lambda folder, _: as_the_command_draws(folder, "lock-sine", "locked"),
    "masses": survival_by_mass,
    "edge": edge,
    "limits": limits,
    "lock": lock,
}


def draw(folder: Path, numbers: dict[str, Any], out: Path) -> None:
    """Draw all of them into a folder."""
    out.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(STYLE):
        for name, figure in FIGURES.items():
            path = out / f"{name}.png"
            save_png(figure(folder, numbers), path)
            with Image.open(path) as picture:
                small = picture.convert("RGB").quantize(COLOURS)
            small.save(path, optimize=True)
            print(f"{out / name}.png: {(out / f'{name}.png').stat().st_size / 1000:.0f} kB")
