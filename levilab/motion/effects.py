"""The effects that a scene models or leaves out, and how much each of them changes what can be observed.

Each effect is switched on or off by itself, and both motions are simulated from the start that the scene describes, for
at most LONGEST seconds.  Their mean heights, precession frequencies and spins are compared.  No formula estimates an
effect: the simulator is fast enough to compute it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.lines import spectral_lines
from levilab.errors import SimulationError
from levilab.motion.lines import rate_for
from levilab.simulator.equilibrium import advice, modes_at, stability_of
from levilab.simulator.scene import Scene, SceneError
from levilab.simulator.single import simulate
from levilab.simulator.trajectory import Trajectory
from levilab.texts.text import Text, text_of

#: Time that is compared [s]: some twenty oscillations of the height, and a resolution of 0.1 Hz.
LONGEST = 20.0
#: A smaller change counts as none: no experiment could see it [m, Hz].
LEAST_M, LEAST_HZ = 1e-7, 1e-5


@dataclass(frozen=True)
class Effect:
    """One effect, and the changes by it.

    Attributes:
        name: of the effect.
        included: whether the scene has it.
        what: a description, with what is assumed if the scene does not have it.
        height_m, precession_hz, spin_hz: the value with the effect less the one without it; NaN where one of the two
            motions has no such value.
        remark: what else it changes, such as that the top falls.
    """

    name: str
    included: bool
    what: str
    height_m: float
    precession_hz: float
    spin_hz: float
    remark: str


@dataclass(frozen=True)
class _Kind:
    """An effect, for any scene.

    Attributes:
        name: of the effect.
        what: a description.
        included: whether a scene has it.
        on: changes of a scene that switch it on.
        off: changes that switch it off.
    """

    name: str
    what: str
    included: Callable[[Scene], bool]
    on: Callable[[Scene], dict[str, Any]]
    off: dict[str, Any]


def _lean_moment(scene: Scene) -> dict[str, Any]:
    """Return the change to a moment that leans by 1.77°, as the thesis's does, with the same part along the axis."""
    return {"top.moment_tilt": [0.03 / 0.97 * scene.top.moment_tilt[1], scene.top.moment_tilt[1]]}


def field_kinds(scene: Scene) -> tuple[_Kind, ...]:
    """Return the effects of the field's series: its terms beyond r², and those that it lacks of the exact ring."""
    to_exact, to_least = lambda _: {"base.field": "exact"}, {"base.field": "paraxial-2"}
    if scene.base.field in {"exact", "paraxial-2"}:
        what = "terms r⁴ and higher of the field's potential, all of them: the exact ring"
        return (_Kind("field beyond r²", what, lambda s: s.base.field == "exact", to_exact, to_least),)
    power = scene.base.field.removeprefix("paraxial-")
    return (
        _Kind(f"field from r⁴ to r^{power}", "these terms of its potential", lambda _: True, to_exact, to_least),
        _Kind(f"field beyond r^{power}", "all higher terms: the exact ring", lambda _: False, to_exact, {}),
    )


KINDS = (
    _Kind(
        "thickness of the base",
        "1 cm instead of a sheet at the same height, equally strong in all",
        lambda s: s.base.thickness_m > 0,
        lambda _: {"base.thickness_m": 0.01},
        {"base.thickness_m": 0.0},
    ),
    _Kind(
        "size of the magnet",
        "a disc, 2.88 cm wide and 3.3 mm thick unless the scene says otherwise, instead of a point",
        lambda s: s.top.magnet == "disc",
        lambda _: {"top.magnet": "disc"},
        {"top.magnet": "point"},
    ),
    _Kind(
        "drag of the air",
        "on the spin, as on a laminar disc, with the constant of the thesis's spin-downs",
        lambda s: s.drag.law != "none",
        lambda _: {"drag.law": "disc"},
        {"drag.law": "none"},
    ),
    _Kind(
        "tilt of the moment",
        "by 1.77° in the top, as in the thesis, with the same part along the axis",
        lambda s: not s.top.aligned,
        _lean_moment,
        {},
    ),
    _Kind(
        "drive",
        "a field of 0.4 mT along y at the spin of the start",
        lambda s: s.drive.waveform != "off" and s.drive.amplitude_t > 0,
        lambda s: {"drive.waveform": "sine", "drive.frequency_hz": abs(s.start.spin_hz) or 30.0},
        {"drive.waveform": "off"},
    ),
    _Kind(
        "lean of the base",
        "by 0.01 rad",
        lambda s: s.base.tilt_rad != 0,
        lambda _: {"base.tilt_rad": 0.01},
        {"base.tilt_rad": 0.0},
    ),
    _Kind(
        "loose washers",
        "of 9 % of the axial inertia",
        lambda s: s.washers.inertia_kg_m2 > 0,
        lambda s: {"washers.inertia_kg_m2": 0.09 * s.top.inertia_axial_kg_m2},
        {"washers.inertia_kg_m2": 0.0},
    ),
)


def explain(scene: Scene, duration: float = 30.0) -> tuple[Effect, ...]:
    """Return every effect of a scene with its changes, the field's first.  Raises as `simulate` does."""
    if scene.observed == "spin":
        scene = scene.changed({"observed": "motion"})
    time = min(abs(duration), LONGEST)
    as_it_is = simulate(scene, time, tolerance=1e-6, rate=rate_for(scene))
    return tuple(_effect(kind, scene, as_it_is, time) for kind in (*field_kinds(scene), *KINDS))


def _effect(kind: _Kind, scene: Scene, as_it_is: Trajectory, time: float) -> Effect:
    included = kind.included(scene)
    off = kind.off or {"top.moment_tilt": [0.0, scene.top.moment_tilt[1]]}
    changes = off if included else kind.on(scene)
    try:
        changed = scene.changed(changes)
        other = simulate(changed, time, tolerance=1e-6, rate=rate_for(changed))
    except (SceneError, SimulationError) as error:
        return Effect(kind.name, included, kind.what, math.nan, math.nan, math.nan, text_of(error))
    with_it, without = (as_it_is, other) if included else (other, as_it_is)
    height, precession, spin = (a - b for a, b in zip(_observe(with_it), _observe(without), strict=True))
    return Effect(
        kind.name,
        included,
        kind.what,
        _zero_if_below(height, LEAST_M),
        _zero_if_below(precession, LEAST_HZ),
        _zero_if_below(spin, LEAST_HZ),
        _remark(included, as_it_is, other),
    )


def _zero_if_below(change: float, least: float) -> float:
    return 0.0 if abs(change) < least else change


def _observe(motion: Trajectory) -> tuple[float, float, float]:
    """Return mean height [m], precession frequency [Hz] and spin at the end [Hz]; NaN of a top that fell."""
    if not motion.survived:
        return math.nan, math.nan, math.nan
    even = slice(None, -1)
    # several frequencies have no common period to average over: a window gives the ends less weight instead
    weight = np.hanning(motion.time.size - 1)
    height = float(np.average(motion.position[even, 2], weights=weight))
    return height, _precession(motion), float(motion.spin_hz[-1])


def _precession(motion: Trajectory) -> float:
    """Return the frequency of the strongest line near the theoretical precession [Hz]; NaN if there is none."""
    scene, n = motion.scene, motion.time.size - 1
    height, spin = float(np.mean(motion.position[:, 2])), float(np.mean(motion.spin_hz))
    modes = modes_at(scene, height, spin)
    expected = modes[2].real if spin > 0 else modes[1].real
    rate = (n - 1) / float(motion.time[n - 1] - motion.time[0])
    found = spectral_lines((motion.axis[:, 0] + 1j * motion.axis[:, 1])[:n], rate, most=16, weakest=1e-4).lines
    near = [line for line in found if abs(line.frequency - expected) < 0.25 * abs(expected)]
    return near[0].frequency if near else math.nan


def _remark(included: bool, as_it_is: Trajectory, other: Trajectory) -> str:  # noqa: FBT001
    """Return a remark on a change that decides whether the top stays up; empty if it stays up either way."""
    if as_it_is.survived == other.survived:
        return "" if as_it_is.survived else "lost either way"
    assert other.fell or as_it_is.fell
    lost = as_it_is if other.survived else other
    if lost is as_it_is:
        return "without it the top stays up" if included else "with it the top stays up"
    found = stability_of(lost.scene)
    why = Text(": {advice}", advice=advice(found)) if not found.floating else ""
    said = "without it the top is lost after {s:.3g} s{why}"
    said = said if included else "with it the top is lost after {s:.3g} s{why}"
    return Text(said, s=float(lost.time[-1]), why=why)
