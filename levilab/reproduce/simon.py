"""Simon, Heflinger & Ridgway 1997, Table I: the quartic's window, and simulated limits, of three tops and bases."""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import brentq

from analysis.arrays import Array
from analysis.stability import SymmetricTop, sleeping_limit, spin_windows
from levilab.present.document.blocks import Note, Picture
from levilab.present.numbers import with_sign
from levilab.reproduce.check import Among, Because, Finding, Found, check, statement
from levilab.reproduce.figure import simon_figure
from levilab.reproduce.tops import Flags, many, scan
from levilab.simulator.field import field_of, on_axis
from levilab.simulator.published.printed import published
from levilab.simulator.scene import Scene, preset
from levilab.stability.scan import all_up_until, lower_limit

SIMON = published("simon-1997")
TOPS = ("1", "2", "3")
#: The paper's spins are in rad/s.
TURN = 2 * math.pi
#: Starts of the scans, a calm one and others: distance from the place where the top floats [m], and tilt [rad].  The
#: paper does not give its own.
STARTS = ((1e-5, 1e-4), (5e-4, 5e-3), (1e-3, 1e-2))
STEP_RAD_S, DURATION_S = 1.0, 30.0
#: Ratio of the radii of a ring that has the paper's B, B′ and B″ where the top floats; 1.5 and 3 give the same limits.
RATIO = 2.0


@dataclass(frozen=True)
class Simon:
    """A top of Table I.

    Attributes:
        top: mass, inertias, moment.
        flux: B, B′, B″ where it floats [T, T/m, T/m²].
    """

    top: SymmetricTop
    flux: tuple[float, float, float]

    @property
    def gravity(self) -> float:
        """The gravity that balances the force [m/s²]: the table's numbers are rounded."""
        return abs(self.top.moment * self.flux[1]) / self.top.mass

    @property
    def window(self) -> tuple[float, float]:
        """The window of the quartic [rad/s]."""
        low, high = spin_windows(lambda z: np.array(self.flux)[:, None] * np.ones_like(z), self.top, 0.0)[0]
        return TURN * low, TURN * high

    @property
    def sleeping(self) -> float:
        """The sleeping top's limit, their equation 11 [rad/s]."""
        return TURN * sleeping_limit(lambda z: np.array(self.flux)[:, None] * np.ones_like(z), self.top, 0.0)


def row(number: str) -> Simon:
    """Return a row of the table."""
    get = {key: SIMON[f"top.{number}.{key}"].value for key in ("mass", "moment", "axial", "transverse")}
    flux = tuple(SIMON[f"top.{number}.{key}"].value for key in ("field", "slope", "half_bend"))
    top = SymmetricTop(get["mass"], get["transverse"], get["axial"], -get["moment"])
    return Simon(top, (flux[0], flux[1], 2 * flux[2]))


def base_like(simon: Simon) -> tuple[float, float, float]:
    """Return a thin ring whose field has these B, B′, B″ at some height: inner radius [m], strength [T m], height [m].

    With lengths in parts of the inner radius, B B″/B′² is a function of the height alone; there the radius follows
    from B/B′, and the strength from B.

    Raises:
        ValueError: no ring has them.
    """
    b, slope, second = simon.flux
    unit = field_of(1.0, RATIO, 1.0, "exact")
    wanted = b * second / slope**2

    def off(z: float) -> float:
        f, s, c = on_axis(unit, z)[:, 0]
        return float(f * c / s**2) - wanted

    heights = np.linspace(1.2 * RATIO**0.5, 4.0 * RATIO, 400)
    values = np.array([off(z) for z in heights])
    for k in np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))[::-1]:
        z = float(brentq(off, heights[k], heights[k + 1]))
        f, s = (float(value) for value in on_axis(unit, z)[:2, 0])
        a = b / slope * s / f
        if a > 0:
            return a, b / f * a, z * a
    raise ValueError(f"no ring with b = {RATIO} a has B, B', B'' = {simon.flux}")


def scene_of(simon: Simon, start: tuple[float, float]) -> Scene:
    """Return the top over a ring with the paper's field at its height, to r² in the potential, as the paper has it."""
    a, strength, height = base_like(simon)
    return preset("undriven").changed(
        {
            "gravity_m_s2": simon.gravity,
            "base.inner_radius_m": a,
            "base.outer_radius_m": RATIO * a,
            "base.strength_t_m": strength,
            "top.mass_kg": simon.top.mass,
            "top.inertia_transverse_kg_m2": simon.top.transverse,
            "top.inertia_axial_kg_m2": simon.top.axial,
            "top.moment_a_m2": simon.top.moment,
            "start.position_m": [start[0], 0.0, height + start[0]],
            "start.velocity_m_s": [0.0, 0.0, 0.0],
            "start.tilt_rad": start[1],
            "start.precession": "steady",
        }
    )


def limits(scene: Scene, simon: Simon) -> tuple[float, float, Array, Flags]:
    """Simulate lower and upper limit [rad/s], the spins of the scan [rad/s], and which tops are up."""
    low, high = simon.window
    spins = scan(math.floor(0.9 * low), math.ceil(1.12 * high), STEP_RAD_S)
    up = many(scene, {"start.spin_hz": spins / TURN}, DURATION_S).survived
    middle = int(np.searchsorted(spins, math.sqrt(low * high)))
    if not up[middle]:
        return math.nan, math.nan, spins, up
    return lower_limit(spins[: middle + 1], up[: middle + 1]), all_up_until(spins[middle:], up[middle:]), spins, up


def lasting(simon: Simon, spin: float) -> float:
    """Return how long a calm top lasts at a spin [rad/s], up to the duration of the scans [s]."""
    return float(many(scene_of(simon, STARTS[0]), {"start.spin_hz": [spin / TURN]}, DURATION_S).time[0])


def _among(values: list[float]) -> Among:
    """Return a limit that depends on the start, which the paper does not give [rad/s]."""
    low, high = min(values), max(values)
    starts = " and ".join(f"{1e3 * away:g} mm, {1e3 * tilt:g} mrad" for away, tilt in (STARTS[0], STARTS[-1]))
    why = (
        f"within a step of {STEP_RAD_S:g} rad/s of what starts give, of which the paper's is not known: {len(STARTS)} "
        f"starts between {starts} give {low:.0f} to {high:.0f} rad/s; that of the calm one is given"
    )
    return Among(low, high, STEP_RAD_S, why)


def make() -> Found:
    """Make the chapter."""
    findings: list[Finding] = []
    scans: list[tuple[str, Array, Flags, tuple[float, float], tuple[float, float]]] = []
    for number in TOPS:
        simon = row(number)
        low, high = simon.window
        printed = {key: SIMON[f"top.{number}.{key}"] for key in ("lower", "upper", "lower_quartic", "upper_quartic")}
        name = f"base and top {number}"
        calm, *others = (limits(scene_of(simon, start), simon) for start in STARTS)
        lowest, highest = [one[0] for one in (calm, *others)], [one[1] for one in (calm, *others)]
        last = printed["upper"].value
        scans.append((name, calm[2], calm[3], (low, high), (printed["lower"].value, last)))
        lasts = lasting(simon, last)
        beyond = Because(
            f"over a ring with its B, B′, B″ every calm top is up to {calm[1]:.0f} rad/s, those that start farther "
            f"away to {' and '.join(f'{one[1]:.0f}' for one in others)}; the quartic ends at {high:.0f}. At "
            f"{printed['upper'].text} rad/s a calm top takes {lasts:.1f} s to be lost: a shorter simulation has it up",
            1.0 < lasts < DURATION_S,
        )
        near = _among(highest)
        upper = near if near.low - STEP_RAD_S <= last <= near.high + STEP_RAD_S else beyond
        findings += [
            check(f"{name}: lower edge of the quartic", printed["lower_quartic"], low),
            check(f"{name}: upper edge of the quartic", printed["upper_quartic"], high),
            check(f"{name}: lower limit, simulated", printed["lower"], calm[0], _among(lowest)),
            check(f"{name}: upper limit, simulated", printed["upper"], calm[1], upper),
        ]
    three = row("3")
    rpm = {key: SIMON[f"abstract.{key}"].value * TURN / 60 for key in ("upper_simulated", "upper_measured")}
    findings.append(
        statement(
            "the upper limits of the abstract beside Table I",
            SIMON["abstract.upper_simulated"].place,
            f"{SIMON['abstract.upper_simulated'].text} rpm = {rpm['upper_simulated']:.0f} rad/s simulated, "
            f"{SIMON['abstract.upper_measured'].text} rpm = {rpm['upper_measured']:.0f} rad/s measured",
            f"the quartic ends at {three.window[1]:.0f} rad/s: "
            f"{with_sign(100 * (three.window[1] / rpm['upper_simulated'] - 1), 0)} % of the simulated, "
            f"{with_sign(100 * (three.window[1] / rpm['upper_measured'] - 1), 0)} % of the measured one",
            holds=abs(three.window[1] / rpm["upper_simulated"] - 1) < 0.05,
        )
    )
    picture = Picture(
        "simon",
        "Three tops of Simon, Heflinger and Ridgway.",
        f"Which tops are up after {DURATION_S:g} s (filled) over a ring that has the paper's B, B′ and B″ where the "
        f"top floats, in steps of {STEP_RAD_S:g} rad/s; lines: the window of the quartic; triangles: Table I.",
        "Survival of three tops over their spin",
        partial(simon_figure, tuple(scans)),
    )
    note = Note(
        "The second derivative in Table I is half of B″. The weight is taken as the force of the table's own numbers, "
        f"which are rounded: gravity comes out as {', '.join(f'{row(k).gravity:.2f}' for k in TOPS)} m/s²."
    )
    return Found(tuple(findings), (picture, note), "The first simulated limits of a Levitron, of three tops and bases.")
