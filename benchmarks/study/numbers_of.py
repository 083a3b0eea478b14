"""The numbers of the study, from its stores: what docs/study.md says."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from plans import CHANGES, NUDGES, RESONANT, WAVES
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from thesis import THESIS

from analysis.stability import sleeping_limit, wobble_resonance
from levilab.simulator.equilibrium import modes_at, stability_of
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate
from levilab.stability.scan import intervals, lower_limit
from levilab.stability.thesis import STARTS
from levilab.sweeps.store import Store

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from levilab.simulator.equilibrium import Stability
    from levilab.simulator.scene import Scene

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]

TOP = preset("undriven")
THESIS_KG = TOP.top.mass_kg
#: Steps [Hz] in which the fine scan is looked at, as multiples of its own.
MULTIPLES = (200, 100, 40, 20, 10, 4, 2, 1)
#: The sleeping top's limit is compared for starts that swing at least so far [m], between these heights [m].
SWINGS_M, COMPARED_M = 0.0007, (0.0692, 0.0756)
#: Spin at which the driven tops start, and how near to it a drive can lock them [Hz].
TRAP_HZ, NEAR_HZ = preset("driven").start.spin_hz, 0.4
#: Points of the map that are kept for tests.
SPOTS = 24
#: A place at the end that is known no better was chaotic [m].
CHAOTIC_M = 1e-5


@dataclass(frozen=True)
class Found:
    """A store's values with its axes, in the order of the plan."""

    axes: tuple[Array, ...]
    values: dict[str, NDArray[Any]]
    scene: Scene

    @property
    def up(self) -> Flags:
        """Whether each top survived."""
        return np.asarray(self.values["survived"], dtype=np.bool_)


def load(folder: Path, name: str) -> Found:
    """Open a store of the study."""
    found = Store.open(folder / f"{name}.zarr").load()
    return Found(tuple(axis.values for axis in found.plan.axes), found.values, found.plan.scene)


def hole(spins: Array, up: Flags, least: float = 0.2) -> tuple[float, float] | None:
    """Return the first run of lost tops that is so wide, of those that have survivors beyond it [Hz]."""
    for a, b in intervals(~up):
        if a > 0 and b < spins.size - 1 and spins[b] - spins[a] >= least:
            return float(spins[a]), float(spins[b])
    return None


# --- theory ---


def lowest_point(stability: Stability, height: float, speed: float) -> float:
    """How deep a top swings that starts on the axis at a height [m] with a speed up or down [m/s]; NaN if it falls."""
    top = stability.top
    assert stability.floating is not None

    def energies(z: Array) -> Array:
        return np.asarray(top.mass * top.gravity * z - top.moment * stability.field(z)[0])

    start = float(energies(np.array([height]))[0]) + top.mass * speed**2 / 2
    depths = np.linspace(min(height, stability.floating.height), 0.06, 2000)
    too_high = np.flatnonzero(energies(depths) > start)
    if not too_high.size or too_high[0] == 0:
        return math.nan
    return float(depths[too_high[0]])


def sleeping_at_lowest(stability: Stability, height: float, speed: float) -> float:
    """Return the sleeping top's limit where it swings deepest [Hz]; NaN if it does not come back."""
    return sleeping_limit(stability.field, stability.top, lowest_point(stability, height, speed))


def slow_resonance(scene: Scene) -> float:
    """Return the spin at which the two slow forward modes differ by the frequency of the motion up and down [Hz]."""
    found = stability_of(scene)
    assert found.floating is not None
    height = found.floating.height

    def off(spin: float) -> float:
        slow, fast = np.sort(modes_at(scene, height, spin).real)[1:3]
        return float(fast - slow) - found.vertical

    return float(brentq(off, 40.0, found.floating.spins[0][1] - 0.01))


def swing_hz(scene: Scene, amplitude: float, *, wave: str = "sine") -> float:
    """Frequency of small swings of a locked top about its drive [Hz].

    Half of a field along one line turns with the top; in step with the moment the top leans, which adds to the moment
    across the axis δ the part δ/((ν/ν_r)² − 1).
    """
    top, found = scene.top, stability_of(scene)
    assert found.floating is not None
    resonance = wobble_resonance(found.field, found.top, found.floating.height)
    across = top.moment_tilt[0] * abs(top.moment_a_m2) * (1 + 1 / ((scene.start.spin_hz / resonance) ** 2 - 1))
    field = amplitude * (4 / math.pi if wave == "square" else 1.0)
    return math.sqrt(across * field / (2 * top.inertia_axial_kg_m2)) / (2 * math.pi)


def hill_trace(stability: Stability, mass: float, height: float) -> float:
    """Trace of the motion aside over one bounce of a top that starts at rest at a height [m]; NaN if it never returns.

    The axis follows the field (adiabatic), the motion up and down is given: what remains is Hill's equation, whose
    solutions stay small if the trace is between -2 and 2.
    """
    moment, gravity = abs(stability.top.moment), stability.top.gravity

    def rates(_: float, state: Array) -> list[float]:
        z, speed, x, along, other, against = state
        field, slope, bend = stability.field(np.array([z]))[:3, 0]
        hold = aside_stiffness(moment, field, slope, bend) / mass
        return [speed, -moment * slope / mass - gravity, along, -hold * x, against, -hold * other]

    upwards = rates(0.0, np.array([height, 0, 0, 0, 0, 0]))[1] > 0

    def returned(time: float, state: Array) -> float:
        return float(state[1]) if time > 1e-3 else (1.0 if upwards else -1.0)

    returned.direction, returned.terminal = (1 if upwards else -1), True  # type: ignore[attr-defined]
    bounce = solve_ivp(rates, (0, 2), [height, 0, 1, 0, 0, 1], rtol=1e-8, atol=1e-10, events=returned)
    return float(bounce.y[2, -1] + bounce.y[5, -1]) if bounce.status == 1 else math.nan


def aside_stiffness(moment: float, field: Any, slope: Any, bend: Any) -> Any:
    """Of |μ||B| sideways, from B, B′, B″ on the axis [N/m]; below zero the field pushes the top aside."""
    return moment * (slope**2 / 4 - field * bend / 2) / field


# --- what is found ---


def survival(folder: Path) -> dict[str, Any]:
    """Return the whole map, its borders, and how the windows of theory bound it."""
    found = load(folder, "survival")
    spins, masses, heights = found.axes
    up = found.up
    windows = np.full((masses.size, 2), np.nan)
    for k, mass in enumerate(masses):
        floating = stability_of(TOP.changed({"top.mass_kg": float(mass)})).floating
        if floating:
            windows[k] = floating.spins[0]
    adiabatic = next(w for w in stability_of(TOP).lifted)
    below = up & (spins[:, None, None] < windows[None, :, None, 0])
    above = up & (spins[:, None, None] > windows[None, :, None, 1])
    light = up & (masses[None, :, None] < adiabatic.light)
    inside = (spins[:, None, None] > windows[None, :, None, 0]) & (spins[:, None, None] < windows[None, :, None, 1])
    inside = np.broadcast_to(inside, up.shape)
    at = int(np.argmin(np.abs(masses - THESIS_KG)))
    return {
        "tops": up.size,
        "up": int(up.sum()),
        "spin_hz": extremes(spins[up.any(axis=(1, 2))]),
        "mass_g": extremes(1e3 * masses[up.any(axis=(0, 2))]),
        "height_cm": extremes(1e2 * heights[up.any(axis=(0, 1))]),
        "up_of_mass": {f"{1e3 * m:.2f}": int(n) for m, n in zip(masses, up.sum(axis=(0, 2)), strict=True)},
        "most_at_mass_g": float(1e3 * masses[np.argmax(up.sum(axis=(0, 2)))]),
        "below_window": int(below.sum()),
        "above_window": int(above.sum()),
        "above_window_most_hz": float(np.max(np.where(above, spins[:, None, None] - windows[None, :, None, 1], 0.0))),
        "lighter_than_adiabatic": int(light.sum()),
        "adiabatic_g": [1e3 * adiabatic.light, 1e3 * adiabatic.heavy],
        "adiabatic_cm": [1e2 * adiabatic.low, 1e2 * adiabatic.high],
        "window_share_up": float(up[inside].mean()),
        "heights_cm_of_thesis_mass": {
            f"{spin:g}": extremes(1e2 * heights[up[int(np.argmin(np.abs(spins - spin))), at]])
            for spin in (25, 30, 50, 70, 75, 80)
        },
        "strict": differ(load(folder, "survival-strict").up, up[:, at]),
    }


def differ(strict: Flags, plain: Flags) -> dict[str, int]:
    """How many tops have another fate with a thousandth of the wanted error."""
    return {"tops": plain.size, "differ": int(np.sum(strict != plain)), "up": [int(plain.sum()), int(strict.sum())]}


def extremes(values: Array) -> list[float]:
    """Smallest and largest; nothing of nothing."""
    return [round(float(values.min()), 4), round(float(values.max()), 4)] if values.size else []


def bounces(folder: Path) -> dict[str, Any]:
    """Tops too light to float, that bounce: how many last, in the field near the axis and in the exact one."""
    answers: dict[str, Any] = {}
    for name in ("bounce", "bounce-exact"):
        found = load(folder, name)
        lifetimes = np.where(found.up, np.inf, found.values["lifetime_s"])
        by_mass = zip(found.axes[1], (lifetimes > 30).sum(axis=(0, 2)), found.up.sum(axis=(0, 2)), strict=True)
        answers[name] = [[1e3 * float(mass), int(short), int(long)] for mass, short, long in by_mass]
    found = load(folder, "bounce-exact")
    lightest = int(np.flatnonzero(found.up.any(axis=(0, 2)))[0])
    places = np.argwhere(found.up[:, lightest])
    motions = []
    for i, k in places:
        keys = ("start.spin_hz", "top.mass_kg", "start.position_m.2")
        values = (found.axes[0][i], found.axes[1][lightest], found.axes[2][k])
        scene = found.scene.changed({key: float(value) for key, value in zip(keys, values, strict=True)})
        motions.append(simulate(scene, 300.0, rate=100.0, tolerance=1e-6))
    calmest = min(motions, key=lambda motion: float(np.hypot(*motion.position[:, :2].T).max()))
    stability = stability_of(TOP)
    _, masses, heights = found.axes
    traces = np.array([[hill_trace(stability, float(mass), float(height)) for height in heights] for mass in masses])
    for name in ("bounce", "bounce-exact"):
        up = load(folder, name).up
        calm = np.broadcast_to(np.abs(traces) < 2, up.shape)
        answers[name.replace("bounce", "hill")] = {
            "calm": int(calm.sum()),
            "calm_up": int(up[calm].sum()),
            "other": int((~calm).sum()),
            "other_up": int(up[~calm].sum()),
        }
    moment, places = abs(stability.top.moment), calmest.position[:, 2]
    field, slope, bend = stability.field(places)[:3]
    push = -moment * slope / (calmest.scene.top.mass_kg * stability.top.gravity)
    answers["example"] = {
        "push_low": float(push[np.argmin(places)]),
        "push_high": float(push[np.argmax(places)]),
        "held_share": float(np.mean(aside_stiffness(moment, field, slope, bend) > 0)),
        "mass_g": 1e3 * calmest.scene.top.mass_kg,
        "spin_hz": calmest.scene.start.spin_hz,
        "start_cm": 1e2 * calmest.scene.start.position_m[2],
        "height_cm": extremes(1e2 * calmest.position[:, 2]),
        "aside_mm": float(1e3 * np.hypot(*calmest.position[:, :2].T).max()),
        "position_error_m": calmest.accuracy.position,
    }
    return answers


def edge(folder: Path) -> dict[str, Any]:
    """Islands at the upper edge: their number by the step, sizes, and whether they are chance."""
    fine, spacing = load(folder, "fine"), 0.0025
    spins, up = fine.axes[0], fine.up
    counts = []
    for multiple in MULTIPLES:
        part = up[::multiple]
        counts.append({"step_hz": spacing * multiple, "islands": len(intervals(part)), "share_up": float(part.mean())})
    steps, numbers = np.array([one["step_hz"] for one in counts]), np.array([one["islands"] for one in counts])
    slope = np.polyfit(np.log(steps[2:]), np.log(numbers[2:]), 1)[0]
    widths = np.array([spins[b] - spins[a] + spacing for a, b in intervals(up)])
    base = load(folder, "long").axes[0]
    plain = np.interp(base, spins, up.astype(float)) > 0.5
    flips = {f"{nudge:g}": int(np.sum(load(folder, f"nudge-{nudge:g}").up != plain)) for nudge in NUDGES}
    some = [(n, f) for n, f in ((n, flips[f"{n:g}"]) for n in NUDGES) if f >= 10]
    long, second = load(folder, "long"), load(folder, "long-IC2")
    lifetimes = np.where(long.up, np.inf, long.values["lifetime_s"])
    ic1 = load(folder, "IC1")
    upper = (ic1.axes[0] >= 65) & (ic1.axes[0] <= 83)
    errors = ic1.values["position_error_m"]
    blocks = [(float(spins[a]), float(spins[b])) for a, b in intervals(up) if spins[a] > 71]
    return {
        "resonance_hz": slow_resonance(TOP),
        "beyond_hole_hz": list(max(blocks, key=lambda block: block[1] - block[0])),
        "from_hz": 65.0,
        "to_hz": 83.0,
        "counts": counts,
        "count_exponent": float(-slope),
        "widest_hz": np.sort(widths)[::-1][:3].round(4).tolist(),
        "islands_below_0.05_hz": int(np.sum(widths < 0.05)),
        "nudge_tops": int(base.size),
        "flips_of_nudge_m": flips,
        "uncertainty_exponent": float(np.polyfit(np.log([n for n, _ in some]), np.log([f for _, f in some]), 1)[0])
        if len(some) > 1
        else math.nan,
        "share_up_after_s": {f"{t:g}": float(np.mean(lifetimes > t)) for t in (5, 10, 30, 60, 120, 299)},
        "islands_after_300_s": len(intervals(long.up)),
        "chaotic_survivors": int(np.sum((errors > CHAOTIC_M) & ic1.up & upper)),
        "survivors": int(np.sum(ic1.up & upper)),
        "chaotic_all": int(np.sum((errors > CHAOTIC_M) & upper)),
        "tops": int(upper.sum()),
        "IC2_hole_300_s_hz": hole(second.axes[0], second.up),
        "IC2_last_up_300_s_hz": last_up(second),
        "hole_by_height": {
            f"{1e2 * z:.3f}": hole(load(folder, "edge").axes[0], load(folder, "edge").up[:, k])
            for k, z in enumerate(load(folder, "edge").axes[1])
        },
    }


def foot(folder: Path) -> dict[str, Any]:
    """Return the lower limit by height, and the sleeping top's limit where each top swings deepest."""
    found, stability = load(folder, "foot"), stability_of(TOP)
    spins, heights = found.axes
    speed = TOP.start.velocity_m_s[2]
    limits = np.array([lower_limit(spins, found.up[:, k]) for k in range(heights.size)])
    sleeping = np.array([sleeping_at_lowest(stability, float(z), speed) for z in heights])
    assert stability.floating is not None
    swing = np.abs(heights - stability.floating.height)
    off = (limits - sleeping)[(swing > SWINGS_M) & (heights > COMPARED_M[0]) & (heights < COMPARED_M[1])]
    return {
        "height_cm": (1e2 * heights).round(4).tolist(),
        "limit_hz": [None if math.isnan(x) else round(float(x), 3) for x in limits],
        "sleeping_hz": [None if math.isnan(x) else round(float(x), 3) for x in sleeping],
        "compared": int(off.size),
        "largest_difference_hz": float(np.abs(off).max()),
        "rms_difference_hz": float(np.sqrt(np.mean(off**2))),
        "window_hz": list(stability.floating.spins[0]),
        "floats_at_cm": 1e2 * stability.floating.height,
        "lowest_hz": float(np.nanmin(limits)),
    }


def starts(folder: Path) -> dict[str, Any]:
    """Where the thesis's starts have their limits."""
    found: dict[str, Any] = {}
    for name in STARTS:
        scan, low = load(folder, name), load(folder, f"{name}-low")
        spins, up = scan.axes[0], scan.up
        blocks = [(float(spins[a]), float(spins[b])) for a, b in intervals(up)]
        main = max(blocks, key=lambda block: block[1] - block[0])
        after = spins > main[1]
        drag = load(folder, f"{name}-drag").values["fall_spin_hz"]
        published = THESIS["starts"][name]
        tenth = up[::5]
        found[name] = {
            "lower_hz": lower_limit(low.axes[0], low.up),
            "all_up_until_hz": main[1],
            "last_up_hz": blocks[-1][1],
            "islands_above": sum(block[0] > main[1] for block in blocks),
            "islands_above_in_steps_of_0.1_hz": sum(bool(spins[::5][a] > main[1]) for a, _ in intervals(tenth)),
            "share_up_between": float(up[after & (spins <= blocks[-1][1])].mean()),
            "up_beside_published_upper": [nothing_if_nan(x) for x in neighbours(blocks, published["upper_hz"])],
            "with_drag_hz": [float(np.mean(drag)), float(np.min(drag)), float(np.max(drag))],
        }
    found["changes"] = {
        name: {
            "lower_hz": nothing_if_nan(
                lower_limit(load(folder, f"{name}-low").axes[0], load(folder, f"{name}-low").up)
            ),
            "hole_hz": hole(load(folder, f"{name}-high").axes[0], load(folder, f"{name}-high").up),
            "last_up_hz": last_up(load(folder, f"{name}-high")),
        }
        for name in CHANGES
    }
    return found


def nothing_if_nan(x: float) -> float | None:
    """None instead of NaN, which JSON does not have."""
    return None if math.isnan(x) else x


def last_up(found: Found) -> float | None:
    """Return the highest spin of a scan that is up [Hz]."""
    return float(found.axes[0][found.up][-1]) if found.up.any() else None


def neighbours(blocks: list[tuple[float, float]], spin: float) -> tuple[float, float]:
    """Return the highest spin that is up at or below one, and the lowest above it [Hz]; NaN where none is."""
    edges = [min(b, spin) for a, b in blocks if a <= spin]
    later = [max(spin, a) for a, b in blocks if b > spin]
    return max(edges, default=math.nan), min(later, default=math.nan)


def falls(folder: Path) -> dict[str, Any]:
    """With drag from 30 Hz: which masses and heights fall where the thesis measured it."""
    found = load(folder, "fall")
    masses, heights = found.axes
    spin = found.values["fall_spin_hz"]
    came = np.isfinite(spin) & (spin < 29)
    answers: dict[str, Any] = {"came_down": int(came.sum()), "tops": int(spin.size), "spin_hz": extremes(spin[came])}
    for name, width in (("within_se", THESIS["measured_u_hz"]), ("within_scatter", THESIS["scatter_hz"])):
        here = came & (np.abs(spin - THESIS["measured_hz"]) <= width)
        answers[name] = {
            "share": float(here.sum() / came.sum()),
            "mass_g": extremes(1e3 * masses[here.any(axis=1)]),
            "height_cm": extremes(1e2 * heights[here.any(axis=0)]),
        }
        at = int(np.argmin(np.abs(masses - THESIS_KG)))
        answers[name]["height_cm_of_thesis_mass"] = [
            [round(1e2 * float(heights[a]), 3), round(1e2 * float(heights[b]), 3)] for a, b in intervals(here[at])
        ]
    at = int(np.argmin(np.abs(masses - THESIS_KG)))
    floating = stability_of(TOP).floating
    assert floating is not None
    off = heights - floating.height
    answers["scatter_of_starts_mm"] = {
        str(far): float(np.nanstd(np.where(came[at] & (np.abs(off) <= 1e-3 * far + 1e-9), spin[at], np.nan), ddof=1))
        for far in (0.5, 1, 1.5, 2)
    }
    answers["thesis_mass_lowest_hz"] = float(np.nanmin(np.where(came[at], spin[at], np.nan)))
    lowest = np.array(
        [np.nanmin(np.where(c, s, np.nan)) if c.any() else np.nan for c, s in zip(came, spin, strict=True)]
    )
    answers["lowest_by_mass"] = {
        f"{1e3 * m:.2f}": nothing_if_nan(round(float(x), 3)) for m, x in zip(masses, lowest, strict=True)
    }
    return answers


def resonance(folder: Path) -> list[dict[str, Any]]:
    """Where tops of other masses are lost, against the resonance of their slow motions."""
    found = []
    for mass in RESONANT:
        scan = load(folder, f"resonance-{1000 * mass:g}")
        found.append(
            {
                "mass_g": 1e3 * mass,
                "resonance_hz": slow_resonance(TOP.changed({"top.mass_kg": mass})),
                "hole_hz": hole(scan.axes[0], scan.up),
            }
        )
        found[-1]["off_hz"] = beside(found[-1]["hole_hz"], found[-1]["resonance_hz"])
    return found


def beside(hole_hz: tuple[float, float] | None, spin: float) -> float | None:
    """How far a spin is outside a hole [Hz]; None where there is none."""
    return float(max(hole_hz[0] - spin, spin - hole_hz[1], 0.0)) if hole_hz else None


def locks(folder: Path) -> dict[str, Any]:
    """Return the tongue of each wave, the start's phase, and what throws the top."""
    found: dict[str, Any] = {}
    for wave in ("sine", "square"):
        tongue = load(folder, f"lock-{wave}")
        drives, amplitudes = tongue.axes
        locked = tongue.values["locked"].astype(bool)
        rows = []
        for k, amplitude in enumerate(amplitudes):
            here = drives[locked[:, k]]
            near = np.abs(drives - TRAP_HZ) < NEAR_HZ
            rows.append(
                {
                    "amplitude_mt": round(1e3 * float(amplitude), 4),
                    "locked_hz": extremes(here),
                    "width_hz": float(locked[:, k].sum() * (drives[1] - drives[0])),
                    "lost_near": float(np.mean(~tongue.up[near, k])),
                    "lost": float(np.mean(~tongue.up[:, k])),
                    "swing_hz": swing_hz(tongue.scene, float(amplitude), wave=wave),
                }
            )
        weak = [row for row in rows if row["amplitude_mt"] <= 0.4]
        x, y = np.log([row["amplitude_mt"] for row in weak]), np.log([row["width_hz"] for row in weak])
        found[wave] = {"rows": rows, "exponent": float(np.polyfit(x, y, 1)[0])}
        found[wave]["width_over_4_swings"] = float(np.mean([row["width_hz"] / (4 * row["swing_hz"]) for row in weak]))
    ratio = [
        b["width_hz"] / a["width_hz"]
        for a, b in zip(found["sine"]["rows"], found["square"]["rows"], strict=True)
        if a["amplitude_mt"] <= 0.4
    ]
    found["square_over_sine"] = float(np.mean(ratio))
    for wave in WAVES:
        plain, strict = load(folder, f"lock-{wave}"), load(folder, f"lock-{wave}-strict")
        found[wave]["strict"] = differ(strict.up, plain.up) | {
            "locked_differ": int(np.sum(strict.values["locked"] != plain.values["locked"]))
        }
        for name in ("straight", "floating"):
            near = load(folder, f"lock-{wave}-{name}")
            found[wave][name] = {
                "lost": int(np.sum(~near.up)),
                "tops": near.up.size,
                "lost_from_mt": first_lost(near.axes[1], near.up),
            }
        near = np.abs(plain.axes[0] - TRAP_HZ) < NEAR_HZ
        found[wave]["lost_from_mt"] = first_lost(plain.axes[1], plain.up[near])
        found[wave]["swing_at_loss_hz"] = (
            swing_hz(plain.scene, found[wave]["lost_from_mt"] / 1e3, wave=wave) if found[wave]["lost_from_mt"] else None
        )
    drives = load(folder, "lock-sine").axes[0]
    found |= {"trap_hz": TRAP_HZ, "near_hz": NEAR_HZ, "step_hz": float(drives[1] - drives[0])}
    found |= {
        "swing_at_0.4_mt_hz": swing_hz(preset("driven"), 4e-4),
        "square_over_sine_expected": math.sqrt(4 / math.pi),
    }
    found |= {"phase": by_phase(folder), "modes": by_mode(folder), "beat": by_beat(folder)}
    *light, heavy = found["beat"]
    found["beat_off_hz"] = {
        "weak": max(abs(row["shaken_most_hz"] - row["own_hz"]) for row in found["beat"]),
        "light": max(abs(row["median_off_hz"] - row["own_hz"]) for row in light),
        "heaviest": heavy["own_hz"] - heavy["median_off_hz"],
        "upright": heavy["vertical_hz"] - heavy["own_hz"],
        "straight": max(abs(row["vertical_hz"] - row["straight_hz"]) for row in found["beat"]),
    }
    return found


def first_lost(amplitudes: Array, up: Flags) -> float | None:
    """Return the weakest drive with which a tenth of the tops of a map (frequency, amplitude) is lost [mT]."""
    lost = np.flatnonzero(np.mean(~up, axis=0) >= 0.1)
    return round(1e3 * float(amplitudes[lost[0]]), 4) if lost.size else None


def by_phase(folder: Path) -> dict[str, Any]:
    """Width of the tongue by the drive's phase at the start, against 4 swings |cos| of half the angle."""
    phase = load(folder, "lock-phase")
    drives, phases = phase.axes
    widths = phase.values["locked"].astype(bool).sum(axis=0) * (drives[1] - drives[0])
    swing = swing_hz(phase.scene, phase.scene.drive.amplitude_t)
    # the best phase: the direction of the first harmonic of the widths
    best = float(-np.angle(np.sum(widths * np.exp(-1j * phases)))) % (2 * math.pi)
    expected = 4 * swing * np.abs(np.cos((phases - best) / 2))
    return {
        "phase_rad": phases.round(4).tolist(),
        "width_hz": widths.round(3).tolist(),
        "expected_hz": expected.round(3).tolist(),
        "best_rad": best,
        "swing_hz": swing,
        "largest_hz": float(widths.max()),
        "smallest_hz": float(widths.min()),
        "rms_difference_hz": float(np.sqrt(np.mean((widths - expected) ** 2))),
    }


def by_mode(folder: Path) -> dict[str, Any]:
    """At which frequencies a drive throws the top, against the top's own."""
    scene = preset("driven")
    stability = stability_of(scene)
    answers: dict[str, Any] = {
        "modes_hz": np.sort(stability.modes.real).round(3).tolist(),
        "vertical_hz": stability.vertical,
        "own_vertical_hz": bounce_hz(scene.changed({"drive.waveform": "off", "start.place": "equilibrium"})),
    }
    for wave in ("sine", "square"):
        found = load(folder, f"modes-{wave}")
        drives = found.axes[0]
        lost = [[round(float(drives[a]), 3), round(float(drives[b]), 3)] for a, b in intervals(~found.up)]
        answers[wave] = {
            "lost_hz": [pair for pair in lost if pair[1] > pair[0]],
            "lost_alone_hz": [pair[0] for pair in lost if pair[1] == pair[0]],
            "locked_hz": extremes(drives[found.values["locked"].astype(bool)]),
        }
    found = load(folder, "modes-sine")
    answers["thirds"] = []
    for mode in answers["modes_hz"][2:]:
        third = mode / 3
        near = [pair for pair in answers["square"]["lost_hz"] if pair[0] - 0.3 < third < pair[1] + 0.3]
        beside = np.abs(found.axes[0] - third) < 0.3
        answers["thirds"].append({"hz": third, "square_lost_hz": near, "sine_lost": int(np.sum(~found.up[beside]))})
    return answers


def by_beat(folder: Path) -> list[dict[str, Any]]:
    """How far from the spin a drive throws the top, by mass, against the frequency of the motion up and down."""
    found, weak = load(folder, "beat"), load(folder, "beat-weak")
    drives, masses = found.axes
    rows = []
    for k, mass in enumerate(masses):
        scene = found.scene.changed({"top.mass_kg": float(mass)})
        off = drives - scene.start.spin_hz
        lost = np.abs(off[~found.up[:, k]])
        rows.append(
            {
                "mass_g": 1e3 * float(mass),
                "vertical_hz": stability_of(scene).vertical,
                "own_hz": bounce_hz(scene.changed({"drive.waveform": "off"})),
                "straight_hz": bounce_hz(straight(scene)),
                "shaken_most_hz": float(weak.axes[0][np.argmax(weak.values["height_spread_m"][:, k])] - TRAP_HZ),
                "weak_lost": int(np.sum(~weak.up[:, k])),
                "lost": int(lost.size),
                "median_off_hz": float(np.median(lost)) if lost.size else None,
            }
        )
    return rows


def straight(scene: Scene) -> Scene:
    """Return a top whose moment is as strong along its axis, and not tilted, 0.2 mm above where it floats."""
    floating = stability_of(scene).floating
    assert floating is not None
    start = {"place": "given", "position_m": [0.0, 0.0, floating.height + 2e-4], "velocity_m_s": [0.0, 0.0, 0.0]}
    settings: dict[str, Any] = {f"start.{key}": value for key, value in start.items()}
    return scene.changed(settings | {"drive.waveform": "off", "top.moment_tilt": [0.0, scene.top.moment_tilt[1]]})


def bounce_hz(scene: Scene, seconds: float = 60.0, rate: float = 50.0) -> float:
    """Return the frequency of a simulated top's motion up and down [Hz]: its highest line, to 1/960 Hz."""
    heights = simulate(scene, seconds, rate=rate, tolerance=1e-6).position[:, 2]
    padded = 16 * heights.size
    spectrum = np.abs(np.fft.rfft((heights - heights.mean()) * np.hanning(heights.size), padded))
    frequencies = np.fft.rfftfreq(padded, 1 / rate)
    shown = (frequencies > 0.4) & (frequencies < 3)
    return float(frequencies[shown][np.argmax(spectrum[shown])])


def spots(folder: Path) -> dict[str, list[list[Any]]]:
    """Points whose fate is no chance, for tests to compute again: all around them ended alike."""
    found = load(folder, "survival")
    spins, masses, heights = found.axes
    up, lifetimes = found.up, found.values["lifetime_s"]
    draw = np.random.default_rng(11)
    chosen: list[list[Any]] = []
    while len(chosen) < SPOTS:
        i, j, k = (int(draw.integers(2, size - 2)) for size in up.shape)
        around = up[i - 2 : i + 3, j - 1 : j + 2, k - 1 : k + 2]
        if around.min() == around.max() and int(up[i, j, k]) == len(chosen) % 2:
            lasted = None if up[i, j, k] else round(float(lifetimes[i, j, k]), 6)
            chosen.append([float(spins[i]), float(masses[j]), float(heights[k]), bool(up[i, j, k]), lasted])
    tongue = load(folder, "lock-sine")
    drives, amplitudes = tongue.axes
    k = int(np.argmin(np.abs(amplitudes - 3e-4)))
    locks = [
        [float(drives[i]), float(amplitudes[k]), bool(tongue.up[i, k]), bool(tongue.values["locked"][i, k])]
        for i in (int(np.argmin(np.abs(drives - drive))) for drive in (29.3, 30.0, 30.3, 30.7))
    ]
    return {"survival": chosen, "lock": locks}


def numbers(folder: Path) -> dict[str, Any]:
    """All of them."""
    return {
        "thesis": THESIS,
        "survival": survival(folder),
        "bounces": bounces(folder),
        "edge": edge(folder),
        "foot": foot(folder),
        "starts": starts(folder),
        "falls": falls(folder),
        "resonance": resonance(folder),
        "locks": locks(folder),
        "spots": spots(folder),
    }
