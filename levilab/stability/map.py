"""Maps of survival over spin and mass, with the edges that the linear theory gives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levilab.errors import UsageError
from levilab.simulator.ensemble import simulate_many
from levilab.simulator.equilibrium import HEAVIEST_KG, stability_of, windows_over

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.simulator.scene import Scene

Array = NDArray[np.float64]
#: Tops that a map may have: some minutes of 30 s each.
MOST_TOPS = 250_000
#: A top outside of the window can take this long to be lost [s].
SHORT_S = 10.0
USUAL_SPINS = (18.0, 90.0, 145)
#: Spins and masses: the first, the last, how many.
Span = tuple[float, float, int]


@dataclass(frozen=True)
class Map:
    """Which tops survived.

    Attributes:
        survived: shape (masses, spins).
        slowest, fastest: the linear window [Hz] of each mass, NaN where none floats.
        floating: lightest and heaviest mass [kg] of each region in which the top can float.
    """

    scene: Scene
    spins: Array
    masses: Array
    duration: float
    survived: NDArray[np.bool_]
    slowest: Array
    fastest: Array
    floating: tuple[tuple[float, float], ...] = ()

    @property
    def spin_step(self) -> float:
        """The scan's step [Hz]: a limit is known no better."""
        return float(self.spins[1] - self.spins[0])

    @property
    def notes(self) -> tuple[str, ...]:
        """What to mind."""
        if self.duration >= SHORT_S:
            return ()
        reason = f"{self.duration:g} s are short: tops outside of the window may only last a while"
        return (f"{reason}; take a duration of {SHORT_S:g} s or more",)


def span_of(name: str, text: str) -> Span:
    """LOW:HIGH:STEP as the first, the last and how many.

    Args:
        name: of the quantity.
        text: what was given.

    Raises:
        UsageError: it is no range.

    >>> span_of("spins", "20:30:0.5")
    (20.0, 30.0, 21)
    """
    expected = "LOW:HIGH:STEP is expected, such as 20:30:0.5"
    try:
        low, high, step = map(float, text.split(":"))
    except ValueError:
        raise UsageError(name, expected, value=text) from None
    if not (all(map(math.isfinite, (low, high, step))) and step > 0 and high >= low + step):
        raise UsageError(name, f"{expected}, with HIGH at least one STEP above LOW", value=text)
    steps = (high - low) / step * (1 + 1e-9)  # rounding must not lose the last one
    if steps > MOST_TOPS:
        raise UsageError(name, f"at most {MOST_TOPS} values are possible, take a longer STEP", value=text)
    return low, low + math.floor(steps) * step, math.floor(steps) + 1


def check_duration(duration: float) -> float:
    """How long a top of a map has to stay up [s].  Raises UsageError."""
    if not 0 < duration < math.inf:
        raise UsageError("duration", "a number of seconds above 0 is expected", value=duration)
    return duration


def survival_map(
    scene: Scene,
    spins: Span | None = None,
    masses: Span | None = None,
    duration: float = 30.0,
    progress: Callable[[float], None] | None = None,
) -> Map:
    """Whether the scene's top survives, over spins [Hz] and masses [kg], each (first, last, how many).

    Where none are given: 18 to 90 Hz, and from a little below to a little above the masses that float.
    Raises UsageError for more tops than a map may have, or masses that are not above 0.
    """
    floating = _floating(scene)
    spins, masses = spins or USUAL_SPINS, masses or _usual_masses(scene, floating)
    _check(spins, masses)
    over_spins, over_masses = np.linspace(*spins), np.linspace(*masses)
    theory = windows_over(scene, over_masses)
    return Map(
        scene,
        over_spins,
        over_masses,
        duration,
        survival(scene, over_spins, over_masses, duration, progress),
        theory.slowest,
        theory.fastest,
        floating,
    )


def _floating(scene: Scene) -> tuple[tuple[float, float], ...]:
    """The masses [kg] that float, the region nearest to the scene's mass first."""
    windows = sorted(stability_of(scene).lifted, key=lambda w: abs((w.light + w.heavy) / 2 - scene.top.mass_kg))
    return tuple((window.light, window.heavy) for window in windows)


def _usual_masses(scene: Scene, floating: tuple[tuple[float, float], ...]) -> Span:
    light, heavy = floating[0] if floating else (scene.top.mass_kg * 0.95,) * 2
    margin = 0.2 * (heavy - light) + 1e-5
    return light - margin, heavy + margin, 61


def _check(spins: Span, masses: Span) -> None:
    if masses[0] <= 0:
        raise UsageError("masses", "masses above 0 are expected", value=f"from {masses[0]:g} kg")
    if masses[0] > HEAVIEST_KG:
        low, high = masses[0] / 1000, masses[1] / 1000
        step = (high - low) / (masses[2] - 1)
        meant = f"kilograms are expected.  Were grams meant?  They are {low:g}:{high:g}:{step:.3g}"
        raise UsageError("masses", meant, value=f"from {masses[0]:g} kg")
    if (tops := spins[2] * masses[2]) > MOST_TOPS:
        raise UsageError(
            "masses",
            f"{spins[2]} spins and {masses[2]} masses are {tops} tops, at most {MOST_TOPS} are possible: "
            "take longer steps in `spins` or `masses`",
        )


def survival(
    scene: Scene,
    spins: ArrayLike,
    masses: ArrayLike,
    duration: float = 30.0,
    progress: Callable[[float], None] | None = None,
) -> NDArray[np.bool_]:
    """Whether the top is still up after so long [s], for spins [Hz] and masses [kg]; shape (masses, spins)."""
    values = {"start.spin_hz": np.asarray(spins)[None, :], "top.mass_kg": np.asarray(masses)[:, None]}
    # from the given place: some of the masses of a map float nowhere
    given = scene.changed({"start.place": "given"})
    return simulate_many(given, values, duration, errors=False, tolerance=1e-6, progress=progress).survived
