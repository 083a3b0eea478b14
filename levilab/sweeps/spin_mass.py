"""The map of survival over spin and mass, `levilab stability SCENE --map`: a sweep with usual axes, and its files."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from levilab.errors import UsageError
from levilab.files import CannotWrite, replace_atomically, writing
from levilab.formats.ranges import problem_of
from levilab.formats.typed import read_number
from levilab.settings import hint_about
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import Scene
from levilab.sweeps.observables import cut
from levilab.sweeps.plan import Axis, Plan
from levilab.sweeps.store import Map

#: Tops that a map may have: some minutes of 30 s each.
MOST_TOPS = 250_000
#: Tops outside of the window may stay up for this time [s].
SHORT_S = 10.0
USUAL_SPINS = (18.0, 90.0, 145)
MASS, SPIN = "top.mass_kg", "start.spin_hz"
TABLE, PICTURE = "survival.csv", "survival.png"
_ELSEWHERE = "give another folder with `out`"
#: Spins and masses: the first, the last, how many.
Span = tuple[float, float, int]


def span_of(name: str, text: str) -> Span:
    """LOW:HIGH:STEP as the first, the last and how many.

    Args:
        name: of the quantity.
        text: what was given.

    Raises:
        UsageError: it is no range.

    >>> span_of("spins", "20:30:0.5"), span_of("masses", "24g:32g:4g")
    ((20.0, 30.0, 21), (0.024, 0.032, 3))
    """
    example, unit = ("0.0250:0.0254:2e-5", "kg") if name == "masses" else ("20:30:0.5", "Hz")
    expected = f"LOW:HIGH:STEP is expected, such as {example}"
    try:
        low, high, step = (read_number(part, unit) for part in text.split(":"))
    except ValueError:
        hints = (hint_about(part, f", which is {unit}") for part in text.split(":"))
        raise UsageError(name, expected + next(filter(None, hints), ""), value=text) from None
    finite = all(map(math.isfinite, (low, high, step)))
    steps = (high - low) / step * (1 + 1e-9) if finite and step > 0 else 0.0  # rounding must not lose the last one
    if steps < 1:
        raise UsageError(name, f"{expected}, with HIGH at least one STEP above LOW", value=text)
    if steps > MOST_TOPS:
        raise UsageError(name, f"at most {MOST_TOPS} values are possible, take a longer STEP", value=text)
    return low, low + math.floor(steps) * step, math.floor(steps) + 1


def check_duration(duration: float) -> float:
    """Check how long a top of a map has to stay up [s].  Raises UsageError."""
    if not 0 < duration < math.inf:
        raise UsageError("duration", "a number of seconds above 0 is expected", value=duration)
    return duration


def plan_of(scene: Scene, spins: Span | None = None, masses: Span | None = None, duration: float = 30.0) -> Plan:
    """Return the plan of a map: whether the scene's top survives, over masses [kg] and spins [Hz].

    Where none are given: 18 to 90 Hz, and from a little below to a little above the masses that float.
    Raises UsageError for more tops than a map may have, or masses that are not above 0.
    """
    spins, masses = spins or USUAL_SPINS, masses or _usual_masses(scene, floating_masses(scene))
    _check(spins, masses)
    axes = (Axis(MASS, np.linspace(*masses)), Axis(SPIN, np.linspace(*spins)))
    floating = stability_of(scene).floating if scene.start.place == "equilibrium" else None
    here = {"start.position_m": [0.0, 0.0, floating.height], "start.velocity_m_s": [0.0, 0.0, 0.0]} if floating else {}
    # from the place of the scene's own top: some of the masses of a map float nowhere
    return cut(Plan(scene.changed({"start.place": "given", **here}), axes, ("survived",), duration))


def floating_masses(scene: Scene) -> tuple[tuple[float, float], ...]:
    """Return the masses [kg] that float, the region nearest to the scene's mass first."""
    windows = sorted(stability_of(scene).lifted, key=lambda w: abs((w.light + w.heavy) / 2 - scene.top.mass_kg))
    return tuple((window.light, window.heavy) for window in windows)


def _usual_masses(scene: Scene, floating: tuple[tuple[float, float], ...]) -> Span:
    light, heavy = floating[0] if floating else (scene.top.mass_kg * 0.95,) * 2
    margin = 0.2 * (heavy - light) + 1e-5
    return light - margin, heavy + margin, 61


def _check(spins: Span, masses: Span) -> None:
    if masses[0] <= 0:
        raise UsageError("masses", "masses above 0 are expected", value=f"from {masses[0]:g} kg")
    if problem := problem_of("mass_kg", masses[0]):
        raise UsageError("masses", problem, value=f"from {masses[0]:g} kg")
    if (tops := spins[2] * masses[2]) > MOST_TOPS:
        raise UsageError(
            "masses",
            f"{spins[2]} spins and {masses[2]} masses are {tops} tops, at most {MOST_TOPS} are possible: take longer "
            "steps in `spins` or `masses`",
        )


def notes_of(plan: Plan) -> tuple[str, ...]:
    """Return notes on a map that is easily misread."""
    if plan.duration_s >= SHORT_S:
        return ()
    reason = f"{plan.duration_s:g} s are short: tops outside of the window may only last a while"
    return (f"{reason}; take a duration of {SHORT_S:g} s or more",)


def as_document(found: Map) -> dict[str, Any]:
    """Return the map as JSON has it; survived: a list for each mass."""
    masses, spins = (axis.values for axis in found.plan.axes)
    return {
        "duration_s": found.plan.duration_s,
        "spin_step_hz": float(spins[1] - spins[0]),
        "spins_hz": spins.tolist(),
        "masses_kg": masses.tolist(),
        "survived": found.values["survived"].tolist(),
        "floating_kg": [list(region) for region in floating_masses(found.plan.scene)],
        "notes": list(notes_of(found.plan)),
    }


def place_for_map(folder: Path) -> None:
    """Make the folder, before anything is simulated; a map that is there stays.  Raises CannotWrite."""
    for path in (folder / TABLE, folder / PICTURE):
        if path.exists():
            raise CannotWrite(f"{path} is there already: give another folder with `out`, or move it away")
    with writing(f"{folder}: the map cannot be written", _ELSEWHERE):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / TABLE).touch()
        (folder / TABLE).unlink()


def write_map(found: Map, folder: Path) -> list[Path]:
    """Write survival.png and survival.csv (one row a top; 1: survived) into a folder.  Raises CannotWrite."""
    # matplotlib, which a command without --map does not need
    from levilab.present.style import save_png
    from levilab.sweeps.figure import map_figure

    masses, spins = (axis.values for axis in found.plan.axes)
    rows = ["mass_kg,spin_hz,survived"]
    for mass, alive in zip(masses, found.values["survived"], strict=True):
        rows += [f"{mass:.8g},{spin:.6g},{one:d}" for spin, one in zip(spins, alive, strict=True)]
    with writing(f"{folder}: the map cannot be written", _ELSEWHERE):
        folder.mkdir(parents=True, exist_ok=True)
        replace_atomically(folder / TABLE, "\n".join(rows) + "\n")
        save_png(map_figure(found, notes=notes_of(found.plan)), folder / PICTURE)
    return [folder / TABLE, folder / PICTURE]
