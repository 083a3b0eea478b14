"""What limits the highest spin that a drive can give to a top, in full motion (docs/experiments/limit.md).

    python benchmarks/upper_limit.py            # about 6 CPU minutes; writes results/upper_limit.json and .png
    python benchmarks/upper_limit.py --draw     # the figure from the kept results

The top of the scene `spindown` (24.3 g, moment tilted by 1.8°, drag of a laminar disc), locked to the drive at 45 Hz
with three angles between them.  The drive creeps up in steps of a second until the top falls, or is 1 Hz beside the
drive.  By then it has slipped for some seconds; but it only slows, so its limit lies between the spin a second before
(or the drive then, if that was lower) and the drive now: the middle of these is given, as `levilab acquire limit` does.

Against it stands the balance of torques (analysis/pull.py).

Where the drive is strong enough, two things are left: the upper edge of the linear window, and below it a resonance of
the slow motions.  Sideways the top has two slow modes that turn forwards; where their frequencies differ by that of the
motion up and down, the three exchange energy, and the swing stays larger afterwards.

And it matters how evenly the drive creeps: the top swings about its drive with a period of some seconds, and steps that
are long, or of two lengths in turn, set it swinging until it is lost below the balance.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import brentq

from analysis.pull import Driven
from analysis.stability import modes, wobble_resonance
from levilab.simulator import preset, simulate
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.kernels.motion import TIME

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from levilab.simulator.scene import Scene

RESULTS = Path(__file__).parent / "results"
TOP = preset("spindown")
#: Where the creep begins [Hz], how far it goes, the length of a step [s], and the angles of the drive then [turns].
FROM_HZ, TO_HZ, STEP_S, ANGLES = 45.0, 95.0, 1.0, (0.5, 0.625, 0.75)
HELD_WITHIN_HZ = 1.0
#: Lengths of steps that are tried, one after the other in turn [s].
STEPS = ((0.25,), (0.5,), (1.0,), (1.0, 1.5), (2.0,))
#: First harmonic of a wave of amplitude 1.
HARMONIC = {"sine": 1.0, "square": 4 / math.pi}
#: Amplitudes [T], creeps [Hz/s] and masses [kg] that are tried; the usual ones.
AMPLITUDES = (1.5e-4, 2e-4, 2.5e-4, 3e-4, 3.5e-4, 4e-4, 6e-4, 8e-4)
CREEPS = (0.02, 0.05, 0.1, 0.2, 0.4)
MASSES = (0.0240, 0.0241, 0.0242, 0.0243, 0.0244, 0.0245, 0.0246, 0.0247)
#: Washers that slip: inertia [kg m²] and coupling [N m s], those of the scene loose-washers.
LOOSE = (1.5e-7, 1e-6)
FIELD_T, STRONG_T, CREEP, FAST = 4e-4, 8e-4, 0.05, 0.1


@dataclass(frozen=True)
class Loss:
    """How a creep ended, and on the way, second by second, drives [Hz] and swings.

    between: the limit lies between these [Hz]; how: "lock" was lost, or the "top" fell; aside: largest distance from
    the axis; up_and_down: highest minus lowest place [m].
    """

    between: tuple[float, float]
    how: str
    drives: list[float]
    aside: list[float]
    up_and_down: list[float]

    @property
    def limit(self) -> float:
        """The middle [Hz]."""
        return sum(self.between) / 2

    @property
    def u(self) -> float:
        """Standard uncertainty, of an even distribution between the two [Hz]."""
        return (self.between[1] - self.between[0]) / 12**0.5


def creep_up(
    scene: Scene, waveform: str, field: float, rate: float, *, turns: float, steps: Sequence[float] = (STEP_S,)
) -> Loss:
    """Raise the drive of a locked top until it is lost.

    field: the drive's amplitude [T]; rate [Hz/s]; turns: its phase at the start; steps: how long the drive stays at a
    frequency, one after the other in turn [s].
    """
    start = FROM_HZ
    scene, state, time, step = scene.changed({"start.spin_hz": start}), None, 0.0, None
    drives: list[float] = []
    aside: list[float] = []
    up_and_down: list[float] = []
    low = start
    begin = 0.0
    for length in itertools.cycle(steps):
        drive = start + rate * begin
        if drive > TO_HZ:
            break
        driven = scene.changed(
            {
                "drive.waveform": waveform,
                "drive.amplitude_t": field,
                "drive.frequency_hz": drive,
                "drive.phase_rad": 2 * math.pi * ((turns - drive * time) % 1.0),
            }
        )
        # the step of the first second holds for twice the spin, too, if it is halved
        step = step or simulate(driven, STEP_S, tolerance=1e-6, rate=None).accuracy.step / 2
        motion = simulate(driven, length, tolerance=1e-6, rate=100.0, start=state, step=step)
        drives.append(drive)
        aside.append(float(np.hypot(motion.position[:, 0], motion.position[:, 1]).max()))
        up_and_down.append(float(np.ptp(motion.position[:, 2])))
        if motion.fell is not None:
            return Loss((low, drive), "top", drives, aside, up_and_down)
        spin = float(motion.spin_hz.mean())
        if abs(spin - drive) > HELD_WITHIN_HZ:
            return Loss((low, drive), "lock", drives, aside, up_and_down)
        low = min(spin, drive)
        state, time, turns = motion.states[-1], float(motion.states[-1, TIME]), turns + drive * length
        begin += length
    return Loss((TO_HZ, TO_HZ), "held", drives, aside, up_and_down)


def window_edge(scene: Scene) -> float:
    """Return the upper edge of the linear window [Hz]."""
    floating = stability_of(scene).floating
    return floating.spins[0][1] if floating else math.nan


def resonance_of_three(scene: Scene) -> float:
    """Return the spin [Hz] at which the two slow forward modes differ by the frequency of the motion up and down."""
    found = stability_of(scene)
    assert found.floating is not None
    height = found.floating.height

    def off(spin: float) -> float:
        slow, fast = modes(found.field, found.top, height, spin).real[1:3]
        return float(fast - slow) - found.vertical

    return float(brentq(off, 40.0, found.floating.spins[0][1] - 0.01))


def balance(scene: Scene, waveform: str, field: float, rate: float) -> float:
    """Return the spin [Hz] at which drag and creep take all that the drive can give."""
    top, found = scene.top, stability_of(scene)
    assert found.floating is not None
    resonance = wobble_resonance(found.field, found.top, found.floating.height)
    across = top.moment_tilt[0] * abs(top.moment_a_m2)
    most = HARMONIC[waveform] * across * field / (2 * top.inertia_axial_kg_m2)
    return Driven(most, scene.drag.constants[0], rate, resonance).highest()


@dataclass(frozen=True)
class Case:
    """A creep: its subject, and the values that differ from the usual ones.

    washers: inertia [kg m²] and coupling [N m s] of loose ones, which the air brakes.
    """

    subject: str
    waveform: str
    field_t: float
    creep_hz_per_s: float
    mass_kg: float = TOP.top.mass_kg
    steps_s: tuple[float, ...] = (STEP_S,)
    washers: tuple[float, float] | None = None


CASES = (
    *(Case("amplitude", waveform, field, CREEP) for waveform in HARMONIC for field in AMPLITUDES),
    *(
        Case("creep", waveform, field, rate)
        for waveform, field in (("sine", FIELD_T), ("square", FIELD_T), ("square", STRONG_T))
        for rate in CREEPS
    ),
    *(Case("mass", "square", STRONG_T, FAST, mass_kg=mass) for mass in MASSES),
    *(Case("steps", "sine", FIELD_T, FAST, steps_s=steps) for steps in STEPS),
    Case("washers", "sine", FIELD_T, FAST, washers=LOOSE),
)


def entry(case: Case) -> dict[str, Any]:
    """Return a case as it is kept: with the limit and how it was lost for each angle, and what theory says."""
    scene = TOP.changed({"top.mass_kg": case.mass_kg})
    if case.washers:
        inertia, coupling = case.washers
        keys = {"inertia_kg_m2": inertia, "coupling_n_m_s": coupling, "drag_share": 1.0}
        scene = scene.changed({f"washers.{key}": value for key, value in keys.items()})
    drive = case.waveform, case.field_t, case.creep_hz_per_s
    losses = [creep_up(scene, *drive, turns=angle, steps=case.steps_s) for angle in ANGLES]
    found = vars(case) | {
        "limit_hz": [round(loss.limit, 3) for loss in losses],
        "limit_u_hz": [round(loss.u, 3) for loss in losses],
        "how": [loss.how for loss in losses],
        "balance_hz": balance(scene, *drive),
        "window_hz": window_edge(scene),
        "resonance_hz": resonance_of_three(scene),
    }
    print(found, flush=True)
    return found


def study() -> dict[str, Any]:
    """All cases, and the swing on the way up of some creeps."""
    entries = [entry(case) for case in CASES]
    swings = {}
    for field, rate in ((FIELD_T, 0.02), (FIELD_T, CREEP), (STRONG_T, FAST), (STRONG_T, 0.2)):
        loss = creep_up(TOP, "square", field, rate, turns=ANGLES[0])
        swings[f"{rate:g} Hz/s, {1e3 * field:.1f} mT"] = {
            "drive_hz": np.round(loss.drives, 3).tolist(),
            "aside_m": np.round(loss.aside, 6).tolist(),
            "up_and_down_m": np.round(loss.up_and_down, 6).tolist(),
            "how": loss.how,
        }
    return {"entries": entries, "swings": swings}


# --- figure ---

_COLOURS = {("sine", False): "#0072B2", ("square", False): "#D55E00", ("square", True): "#009E73"}
_MARKERS = {"lock": "o", "top": "v", "held": "^"}


def draw(results: dict[str, Any], path: Path) -> None:
    """Five panels: amplitude, creep, its steps, mass, and the swing on the way up; and what their signs mean."""
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from levilab.present.style import STYLE, save_png

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(14.5, 8.2), layout="constrained")
        (amplitude, creep, steps), (mass, swing, signs) = figure.subplots(2, 3)
        _draw_losses(amplitude, results, "amplitude", "field_t", 1e3)
        amplitude.set_xlabel("amplitude of the drive  [mT]")
        amplitude.set_title(f"A weak drive loses the top: drag is stronger ({CREEP:g} Hz/s)", loc="left")
        _draw_losses(creep, results, "creep", "creep_hz_per_s", 1.0)
        creep.set(xlabel="creep  [Hz/s]", xscale="log")
        creep.set_xticks(CREEPS, [f"{rate:g}" for rate in CREEPS])
        creep.minorticks_off()
        creep.set_title("A fast creep takes torque, a slow one gives the swing time", loc="left")
        _draw_steps(steps, results)
        _draw_losses(mass, results, "mass", "mass_kg", 1e3)
        mass.set_xlabel("mass of the top  [g]")
        mass.set_title(f"A strong drive reaches the edge of the window (0.8 mT, {FAST:g} Hz/s)", loc="left")
        for axes in (amplitude, creep, steps, mass):
            axes.set_ylabel("upper limit of the spin  [Hz]")
            axes.axhline(61, color="grey", linewidth=0.8)
            axes.annotate(
                "thesis 61 Hz", (0.01, 61.5), xycoords=("axes fraction", "data"), va="bottom", color="grey", fontsize=8
            )
        _draw_swings(swing, results)
        dot = {"color": "grey", "linestyle": "none"}
        handles = [
            Line2D([], [], color=_COLOURS["sine", False], label="balance of torques, sine"),
            Line2D([], [], color=_COLOURS["square", False], label="the same, square (0.4 mT)"),
            Line2D([], [], color=_COLOURS["square", True], label="the same, square of 0.8 mT"),
            Line2D([], [], color="black", linestyle="--", label="upper edge of the linear window"),
            Line2D([], [], color="#CC79A7", linestyle=":", label="resonance of three slow motions"),
            Line2D([], [], **dot, marker="o", label="simulated: the drive lost the top"),
            Line2D(
                [], [], **dot, marker="o", fillstyle="none", label=f"the same, at once: it never held at {FROM_HZ:g} Hz"
            ),
            Line2D([], [], **dot, marker="v", label="simulated: the top fell"),
        ]
        signs.axis("off")
        what = "Top of the scene spindown: 24.3 g, moment tilted by 1.8°,\ndrag of a laminar disc; three angles each"
        signs.legend(handles=handles, loc="center left", fontsize=9, title=what, alignment="left")
    save_png(figure, path)


def _draw_steps(axes: Axes, results: dict[str, Any]) -> None:
    """The limits of a sine of the usual amplitude, by how even its creep is."""
    chosen = [one for one in results["entries"] if one["subject"] == "steps"]
    for k, one in enumerate(chosen):
        _draw_angles(axes, k, one, _COLOURS["sine", False])
    axes.axhline(chosen[0]["balance_hz"], color=_COLOURS["sine", False], linewidth=1)
    labels = [" and ".join(f"{length:g}" for length in one["steps_s"]) for one in chosen]
    axes.set_xticks(range(len(chosen)), labels)
    axes.set(xlabel="length of the drive's steps, in turn  [s]", xlim=(-0.5, len(chosen) - 0.5), ylim=(43, 97))
    axes.set_title(f"Long and uneven steps swing the top (sine, 0.4 mT, {FAST:g} Hz/s)", loc="left")


def _draw_angles(axes: Axes, x: float, one: dict[str, Any], colour: str) -> None:
    """One mark an angle, hollow where the top was lost at once."""
    for limit, how in zip(one["limit_hz"], one["how"], strict=True):
        at_once = how == "lock" and limit < FROM_HZ + HELD_WITHIN_HZ
        style: dict[str, Any] = {"marker": _MARKERS[how], "fillstyle": "none" if at_once else "full"}
        axes.plot(x, limit, color=colour, markersize=5, alpha=0.7, linestyle="none", **style)


def _draw_losses(axes: Axes, results: dict[str, Any], subject: str, key: str, factor: float) -> None:
    chosen = [one for one in results["entries"] if one["subject"] == subject]
    for (waveform, strong), colour in _COLOURS.items():
        mine = [
            one
            for one in chosen
            if one["waveform"] == waveform and (one["field_t"] == STRONG_T and subject != "amplitude") == strong
        ]
        if not mine:
            continue
        x = factor * np.array([one[key] for one in mine])
        axes.plot(x, [one["balance_hz"] for one in mine], color=colour, linewidth=1)
        for value, one in zip(x, mine, strict=True):
            _draw_angles(axes, value, one, colour)
    x = factor * np.array([one[key] for one in chosen])
    order = np.argsort(x)
    for name, colour, dashes in (("window_hz", "black", "--"), ("resonance_hz", "#CC79A7", ":")):
        axes.plot(
            x[order], np.array([one[name] for one in chosen])[order], color=colour, linestyle=dashes, linewidth=1.2
        )
    axes.set_ylim(43, 97)


def _draw_swings(axes: Axes, results: dict[str, Any]) -> None:
    colours = ("#0072B2", "#D55E00", "#009E73", "#000000")
    for (name, one), colour in zip(results["swings"].items(), colours, strict=False):
        axes.plot(one["drive_hz"], 1e3 * np.array(one["aside_m"]), color=colour, linewidth=1, label=name)
        axes.plot(
            one["drive_hz"], 1e3 * np.array(one["up_and_down_m"]), color=colour, linewidth=0.8, linestyle=(0, (1, 1))
        )
    axes.set(xlabel="drive  [Hz]", ylabel="swing  [mm]", yscale="log", ylim=(0.1, 30))
    axes.set_title("The swing on the way up: aside (lines), up and down (dots)", loc="left")
    axes.axvline(window_edge(TOP), color="black", linestyle="--", linewidth=1.2)
    axes.axvline(resonance_of_three(TOP), color="#CC79A7", linestyle=":", linewidth=1.2)
    axes.legend(loc="upper left")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draw", action="store_true", help="draw the kept results, simulate nothing")
    kept = RESULTS / "upper_limit.json"
    if not parser.parse_args().draw:
        kept.write_text(json.dumps(study()) + "\n", encoding="utf-8")
    draw(json.loads(kept.read_text(encoding="utf-8")), RESULTS / "upper_limit.png")


if __name__ == "__main__":
    main()
