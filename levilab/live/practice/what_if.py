"""What a person can change at the bench for practice, with immediate effect: a row a quantity."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from levilab.live.practice.commands import CommandRefused
from levilab.simulator.laws import LAWS
from levilab.simulator.scene import Scene


@dataclass(frozen=True)
class Change:
    """A row.

    Attributes:
        title, unit: for people.
        shows: what one learns by it, in a sentence.
        low, high, step: of its slider.
        usual: its value at first.
        keys: (the usual scene, value) → keys of a scene and their values.
    """

    title: str
    unit: str
    shows: str
    low: float
    high: float
    step: float
    usual: float
    keys: Callable[[Scene, float], dict[str, Any]]


def _drag_at(scene: Scene, pressure: float) -> float:
    """Return the drag's constant at a pressure [bar], from that of a scene at 1 bar."""
    return scene.drag.constants[0] * math.pow(pressure, (LAWS[scene.drag.law].exponent or 1.0) - 1.0)


#: Washers on the usual top [g], and the tilt of its moment, rounded to a tenth [°].
_WASHERS_G, _USUAL_TILT_DEG = 0.2, 1.2


def _tilt_moment(scene: Scene, tilt_deg: float) -> dict[str, Any]:
    """Return the parts of the moment at a tilt, in proportion to it: right to a tenth of a degree."""
    across = scene.top.moment_tilt[0] * (tilt_deg / _USUAL_TILT_DEG)
    return {"top.moment_tilt": [across, 1.0 - across]}


#: Name → row.  The washers of a set have 0.02 to 0.1 g.  The air's viscosity η does not change with its
#: pressure, and its density ρ does: a drag in proportion to ωⁿ goes as ρ^(n − 1), as η for n = 1, √(ρη) for n = 3/2 (a
#: laminar boundary layer), ρ for n = 2.
WHAT_IF: dict[str, Change] = {
    "washers_g": Change(
        "washers", "g", "A top floats if its mass is right to some tenths of a gram.", 0.0, 1.0, 0.02, _WASHERS_G,
        lambda scene, value: {"top.mass_kg": scene.top.mass_kg + 1e-3 * (value - _WASHERS_G)},
    ),
    "base_tilt_deg": Change(
        "tilt of the base", "°", "The top slides off a base that leans.", -2.0, 2.0, 0.05, 0.0,
        lambda _, value: {"base.tilt_rad": math.radians(value)},
    ),
    "temperature_k": Change(
        "warmer by", "K", "Warm magnets are weaker, by 0.2 % per kelvin each: the same top is then too heavy.",
        -10.0, 10.0, 0.5, 0.0, lambda _, value: {"temperature_rise_k": value},
    ),
    "pressure": Change(
        "air pressure", "bar", "The air alone slows a free top.", 0.0, 2.0, 0.1, 1.0,
        lambda scene, value: {"drag.coefficient": _drag_at(scene, value)},
    ),
    "moment_tilt_deg": Change(
        "tilt of the moment", "°", "What lies across the axis is what the drive holds the top by.",
        0.0, 2.4, 0.3, _USUAL_TILT_DEG, _tilt_moment,
    ),
}  # fmt: skip
USUAL = {name: row.usual for name, row in WHAT_IF.items()}


def keys_of(scene: Scene, values: Mapping[str, float]) -> dict[str, Any]:
    """Return the keys of a scene with these values.

    Args:
        scene: the usual one.
        values: names in WHAT_IF.

    Raises:
        CommandRefused: a name is unknown, or a value beyond its limits.
    """
    keys: dict[str, Any] = {}
    for name, value in values.items():
        row = WHAT_IF.get(name)
        if row is None:
            raise CommandRefused("{name}: one of {known} is expected", name=name, known=", ".join(WHAT_IF))
        if not row.low <= value <= row.high:
            raise CommandRefused(
                "{title}: from {low:g} to {high:g} {unit} is expected, not {value:g}",
                title=row.title,
                low=row.low,
                high=row.high,
                unit=row.unit,
                value=value,
            )
        keys |= row.keys(scene, value)
    return keys
