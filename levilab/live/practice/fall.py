"""Why a top fell, in a sentence."""

import math
from functools import lru_cache

from levilab.simulator.equilibrium import Stability, advice, stability_of
from levilab.simulator.scene import Scene
from levilab.texts.text import Text

#: A top whose moment is tilted leans ever more, and falls before its spin reaches the limit of an upright one, within
#: this factor: on this bench with 20.9 Hz a free one at 23.3 Hz (tilt 1.2°; at 22.5 Hz with half of it, at 20.9 Hz
#: without), one that a drive holds at 24 Hz, one with more tilt at 25 Hz.
_NEAR_LOW = 1.25
#: The same above: the published upper limits lie at 65 to 82 Hz, of 84 Hz for small motions.
_NEAR_HIGH = 0.75


@lru_cache(maxsize=1)
def _stability(table: str) -> Stability:
    return stability_of(Scene.model_validate_json(table))


def masses_that_float(scene: Scene) -> str:
    """Return the mass of a top, and which masses float over its base; empty where none does."""
    lifted = _stability(scene.changed({"base.tilt_rad": 0.0}).model_dump_json()).lifted
    if not lifted:
        return ""
    said = "the top has {mass:.2f} g; {light:.2f} to {heavy:.2f} g float today"
    return Text(said, *(1e3 * kg for kg in (scene.top.mass_kg, lifted[-1].light, lifted[-1].heavy)))


def _why_not(found: Stability, *, hides: bool) -> str:
    """Return why no top like this floats; where the mass is to be found, without the masses that do."""
    mass, window = found.scene.top.mass_kg, found.lifted[-1] if found.lifted else None
    if window is None or window.light <= mass <= window.heavy:
        return Text("it cannot float here ({advice})", advice=advice(found))
    too = "too heavy" if mass > window.heavy else "too light"
    masses = (
        ""
        if hides
        else Text(
            ": {mass:.2f} g, and {light:.2f} to {heavy:.2f} g float", 1e3 * mass, 1e3 * window.light, 1e3 * window.heavy
        )
    )
    return Text("the top is {too} for this base{masses}", too=too, masses=masses)


def cause_of_fall(
    scene: Scene,
    spin_hz: float | None,
    after_s: float | None,
    *,
    changed_s: float = math.inf,
    held: str = "",
    hides: bool = False,
) -> str:
    """Return why a top fell.

    Args:
        scene: as it was when it fell.
        spin_hz: with which it fell [Hz]; None: it was never counted.
        after_s: time since it was put there [s]; None: the run that is recorded says when it fell.
        changed_s: time since top, base or air were changed [s].
        held: how a drive held it.
        hides: whether the masses that float are to be found.
    """
    after = ""
    if after_s is not None:
        said = " {seconds:.1f} s after the change" if changed_s < after_s else " after {seconds:.0f} s"
        after = Text(said, seconds=seconds) if (seconds := min(changed_s, after_s)) >= 1.0 else " at once"
    if base_deg := abs(math.degrees(scene.base.tilt_rad)):
        scene = scene.changed({"base.tilt_rad": 0.0})  # the theory is of an upright base
    found = _stability(scene.model_dump_json())
    if found.floating is None or not found.floating.spins:
        return Text("{why}, however it spins: it fell{after}", why=_why_not(found, hides=hides), after=after)
    low, high = found.floating.spins[0]
    if spin_hz is None:
        return Text("it fell{after}, before its spin was counted", after=after)
    fell = Text("it fell at {spin:.1f} Hz{after}{held}", spin_hz, after, held)
    if spin_hz < _NEAR_LOW * low:
        across, along = scene.top.moment_tilt
        tilt = math.degrees(math.atan2(across, along))
        leans = Text(", but the moment of this one is tilted by {tilt:.1f}°, and it leans ever more before", tilt=tilt)
        said = "{fell}: the spin holds an upright top down to {low:.1f} Hz{leans}"
        return Text(said, fell=fell, low=low, leans=leans if tilt else "")
    if spin_hz > _NEAR_HIGH * high:
        said = "near {high:.1f} Hz the top is too stiff for its axis to follow the field, which alone keeps it: {fell}"
        return Text(said, high, fell)
    if base_deg:
        return Text("the base leans by {tilt:.2g}°, and the top slides off: {fell}", base_deg, fell)
    return Text("the spin could hold it, from {low:.1f} to {high:.1f} Hz, so it swung too far: {fell}", low, high, fell)
