"""The limits of the spin that the thesis simulated from four starts, without and with drag, and IC3's misprint."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from analysis.arrays import Array
from levilab.present.document.blocks import Note, Picture
from levilab.reproduce.check import Among, Because, Comparison, Finding, Found, Within, check, statement
from levilab.reproduce.figure import limits_figure
from levilab.reproduce.tops import DURATION_S, FALL_M, MASS_KG, THESIS, Flags, known, many, preset_at, scan
from levilab.simulator.equilibrium import stability_of
from levilab.stability.scan import all_up_until, last_up, lower_limit, upper_edges
from levilab.stability.thesis import SIMULATED_HZ, STARTS

#: Steps of the scans for lower limits, for upper ones, and for the misprint [Hz].
STEP_HZ, UPPER_STEP_HZ, COARSE_HZ = 0.01, 0.02, 0.05
#: Lower limits are looked for so far to both sides of what the thesis prints [Hz], for these masses [kg].
AROUND_HZ = 0.2
MASSES_KG = 1e-3 * np.arange(25.26, 25.3051, 0.005)
#: Spins of the upper scans [Hz].
UPPER_HZ = (45.0, 84.0)
#: With drag: starts that nothing distinguishes [Hz], and how long a top has to come down [s].
DRAG_STARTS_HZ = 30.0 + 0.001 * np.arange(48)
DRAG_S = 150.0
#: Places beside the axis that the third start may have had [m].
ASIDE_M = 1e-3 * np.arange(2.0, 5.51, 0.5)


@dataclass(frozen=True)
class Upper:
    """A scan of the upper limit.

    Attributes:
        until: every top is up to this spin [Hz].
        last: the highest one that is up [Hz].
        edges: where the scan changes from up to lost, shape (n,) [Hz].
        up: which are up, of the spins of the scan.
        printed_lasts: how long a top of the thesis's limit lasts, up to the duration of the scan [s].
    """

    until: float
    last: float
    edges: Array
    up: Flags
    printed_lasts: float


def lower_over_masses(name: str) -> Array:
    """Return the lower limit from a start for each mass, shape (n,) [Hz]; NaN outside of the scan."""
    printed = SIMULATED_HZ[name][0]
    spins = scan(printed - AROUND_HZ, printed + AROUND_HZ, STEP_HZ)
    up = many(preset_at(name), {"start.spin_hz": spins[None, :], "top.mass_kg": MASSES_KG[:, None]}).survived
    return np.array([lower_limit(spins, row) if not row[0] else np.nan for row in up])


def best_mass(lower: dict[str, Array]) -> tuple[float, Array]:
    """Return the mass [kg] whose lower limits are nearest to the four printed ones, and each rms difference [Hz]."""
    off = np.array([lower[name] - SIMULATED_HZ[name][0] for name in STARTS])
    rms = np.sqrt(np.mean(off**2, axis=0))
    return float(MASSES_KG[np.nanargmin(rms)]), rms


def upper_scan(name: str, spins: Array) -> Upper:
    """Scan for the upper limit from a start."""
    up = many(preset_at(name), {"start.spin_hz": spins}).survived
    lasts = float(many(preset_at(name), {"start.spin_hz": [SIMULATED_HZ[name][1]]}).time[0])
    return Upper(all_up_until(spins, up), last_up(spins, up), upper_edges(spins, up), up, lasts)


def falls(name: str, *settings: str) -> Array:
    """Return the spins at which tops with the thesis's drag come down to 6 cm, from starts alike, shape (n,) [Hz]."""
    scene = preset_at(name, "friction", f"escape.height_m={FALL_M}", *settings)
    return many(scene, {"start.spin_hz": DRAG_STARTS_HZ}, DRAG_S).spin_hz


def lower_checks(lower: dict[str, Array], mass: float) -> list[Finding]:
    """Compare the lower limits at the mass that fits all."""
    at = int(np.argmin(np.abs(MASSES_KG - mass)))
    found: list[Finding] = [
        statement(
            "the one mass behind the four lower limits",
            "Table 3.1 and Table 4.2",
            "",
            f"{1e3 * mass:.3f} g, in steps of 0.005 g; Table 3.1 has 25.5 g, which cannot float",
            holds=abs(mass - MASS_KG) < 1e-6 and mass < stability_of(preset_at("IC1")).lifted[-1].heavy,
        )
    ]
    for name in STARTS:
        near = lower[name][max(at - 1, 0) : at + 2]
        room = 2 * STEP_HZ + float(np.nanmax(near) - np.nanmin(near)) / 2
        found.append(
            check(
                f"{name}: lower limit",
                THESIS[f"limits.lower.{name}"],
                float(lower[name][at]),
                Within(room, f"a step of {STEP_HZ:g} Hz in each of two scans, and half a step of mass, 0.0025 g"),
                Comparison.FITTED,
            )
        )
    return found


def upper_checks(uppers: dict[str, Upper]) -> list[Finding]:
    """Compare the upper limits: a single number only where no island is."""
    edge = known(stability_of(preset_at("IC1")).floating)
    found: list[Finding] = []
    for name, one in uppers.items():
        printed = THESIS[f"limits.upper.{name}"]
        islands = int(np.sum(one.edges > one.until + UPPER_STEP_HZ))
        nearest = float(one.edges[np.argmin(np.abs(one.edges - printed.value))])
        late = f"a top of {printed.text} Hz " + (
            "is still up" if one.printed_lasts >= DURATION_S else f"is lost after {one.printed_lasts:.1f} s"
        )
        why = (
            f"there is no single limit: every top is up to {one.until:.2f} Hz and the last one has {one.last:.2f} Hz, "
            f"with {islands} islands between at a step of {UPPER_STEP_HZ:g} Hz; the nearest edge from up to lost is at "
            f"{nearest:.2f} Hz, and {late}. Small motions are stable up to {edge.spins[0][1]:.2f} Hz"
        )
        inside = one.until - 0.5 <= printed.value <= one.last + 0.5
        found.append(
            check(f"{name}: upper limit, all tops up to", printed, one.until, Because(why, inside and islands > 0))
        )
    return found


def drag_checks() -> tuple[list[Finding], dict[str, Array]]:
    """Compare the spin at the fall with drag: of many starts alike, since the phase at the fall decides."""
    spins = {name: falls(name) for name in STARTS}
    found: list[Finding] = []
    for name, ends in spins.items():
        middle = float(np.median(ends))
        printed = THESIS[f"limits.drag.{name}"]
        below = int(np.sum(ends < printed.value))
        found.append(
            check(
                f"{name}: spin at the fall, with drag",
                printed,
                middle,
                Among(
                    float(ends.min()),
                    float(ends.max()),
                    0.0,
                    f"the phase at the fall decides: {ends.size} starts from "
                    f"{DRAG_STARTS_HZ[0]:.3f} to {DRAG_STARTS_HZ[-1]:.3f} Hz fall at {ends.min():.2f} to "
                    f"{ends.max():.2f} Hz, {below} of them below the printed value; their median is given",
                ),
            )
        )
    return found, spins


def misprint(with_030: Array) -> tuple[list[Finding], Array]:
    """Simulate the third start as printed and with other places beside the axis.

    Args:
        with_030: spins at the fall with x = 0.30 cm, shape (n,) [Hz].
    """
    printed = THESIS["limits.lower.IC3"]
    spins = scan(21.7, 25.3, COARSE_HZ)
    scene = preset_at("IC3")
    up = many(scene, {"start.spin_hz": spins[None, :], "start.position_m.0": ASIDE_M[:, None]}).survived
    lower = np.array([lower_limit(spins, row) for row in up])
    aside = float(np.interp(printed.value, lower[:-1], ASIDE_M[:-1])) if np.all(np.diff(lower[:-1]) > 0) else np.nan
    # the scan's step, as an even distribution, over the slope of the limit
    u_aside = COARSE_HZ / 12**0.5 * 0.001 / (lower[3] - lower[1])
    by_x = {round(100 * x, 2): limit for x, limit in zip(ASIDE_M.tolist(), lower.tolist(), strict=True)}
    drag = falls("IC3", "start.position_m=[0.005,0,0.0725]")
    found: list[Finding] = [
        check(
            "IC3: the start's place beside the axis that gives the printed lower limit",
            THESIS["limits.start.IC3_x"],
            100 * aside,
            Because(
                f"the lower limit is {by_x[0.5]:.2f} Hz from x = 0.50 cm as printed and {by_x[0.3]:.2f} Hz from 0.30 "
                f"cm, with steps of {COARSE_HZ:g} Hz; printed is {printed.text} Hz: a 3 read or printed as 5",
                abs(by_x[0.3] - printed.value) < COARSE_HZ and by_x[0.5] - printed.value > 1.0,
            ),
            u=100 * u_aside,
        ),
        check(
            "IC3 with x = 0.50 cm as printed: lower limit",
            printed,
            by_x[0.5],
            Because(f"with x = 0.30 cm it is {by_x[0.3]:.2f} Hz", by_x[0.3], COARSE_HZ),
        ),
        check(
            "IC3 with x = 0.50 cm as printed: spin at the fall, with drag",
            THESIS["limits.drag.IC3"],
            float(np.median(drag)),
            Because(
                f"with x = 0.30 cm tops fall at {with_030.min():.2f} to {with_030.max():.2f} Hz",
                float(np.median(with_030)),
                float(np.ptp(with_030)) / 2,
            ),
        ),
    ]
    return found, lower


def make() -> Found:
    """Make the chapter."""
    lower = {name: lower_over_masses(name) for name in STARTS}
    mass, rms = best_mass(lower)
    spins = scan(*UPPER_HZ, UPPER_STEP_HZ)
    uppers = {name: upper_scan(name, spins) for name in STARTS}
    dragged, falling = drag_checks()
    slip, by_x = misprint(falling["IC3"])
    findings = [*lower_checks(lower, mass), *upper_checks(uppers), *dragged, *slip]
    scans = spins, {name: one.up for name, one in uppers.items()}
    picture = Picture(
        "limits",
        "One mass fits four lower limits; upper limits are torn.",
        f"Above: from each start, which tops are up after 30 s (filled) in a scan of {UPPER_STEP_HZ:g} Hz; triangles "
        "are the thesis's upper limits. Below, from the left: the simulated lower limit over the mass (lines) with "
        "the thesis's figures (dashed), which meet at one mass; the spin at the fall with drag from 48 starts alike "
        "(dots) with the thesis's (dashes); the lower limit of IC3 over its place beside the axis, which is the "
        "printed one at 0.30 cm and not at 0.50 cm.",
        "Scans of survival over spin, and lower limits over mass, with drag, and over the place of the third start",
        partial(limits_figure, scans, (1e3 * MASSES_KG, lower), falling, (100 * ASIDE_M, by_x)),
    )
    said = (
        f"Survival over 30 s, scanned in steps of {STEP_HZ:g} Hz (lower) and {UPPER_STEP_HZ:g} Hz (upper), in the "
        f"thesis's field to r², with a mass of {1e3 * mass:.3f} g."
    )
    note = Note(
        f"The mass is the only number that was fitted: to the four lower limits, which it meets within {min(rms):.3f} "
        "Hz (rms). Upper limits are given as the spin up to which every top of the scan is up."
    )
    return Found(tuple(findings), (picture, note), said)
