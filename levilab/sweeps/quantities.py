"""Names of the quantities of a map for figures and tables, and units with the prefixes of a laboratory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from levilab.present.units import split, unit
from levilab.sweeps.observables import OBSERVABLES

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Quantity:
    """A quantity on an axis or a colour bar.

    Attributes:
        name: in words.
        unit: as it is shown; empty for a number without one.
        factor: from SI to that unit.
    """

    name: str
    unit: str
    factor: float

    @property
    def label(self) -> str:
        """For an axis."""
        return f"{self.name}  [{self.unit}]" if self.unit else self.name

    def text(self, value: float) -> str:
        """Return a value in SI, as people read it."""
        return f"{value * self.factor:.4g} {self.unit}".strip()


_NAMES = {
    "start.spin_hz": "spin at the start",
    "start.tilt_rad": "tilt at the start",
    "start.position_m.0": "distance from the axis at the start, x",
    "start.position_m.1": "distance from the axis at the start, y",
    "start.position_m.2": "height at the start",
    "start.velocity_m_s.2": "upward velocity at the start",
    "top.mass_kg": "mass",
    "top.moment_a_m2": "moment",
    "top.moment_tilt.0": "transverse part of the moment",
    "base.strength_t_m": "strength of the base, ρ",
    "drive.frequency_hz": "frequency of the drive",
    "drive.amplitude_t": "amplitude of the drive",
    "drive.ramp_hz_per_s": "ramp of the drive",
    "lifetime_s": "time until the fall",
    "fall_spin_hz": "spin at the fall",
    "end_spin_hz": "spin at the end",
    "highest_spin_hz": "highest spin",
    "height_spread_m": "spread of the height",
    "energy_error": "relative change of the energy",
    "position_error_m": "estimated error of the place",
}


def quantity_of(name: str) -> Quantity:
    """Return how a key of a scene or a column is shown.

    >>> quantity_of("top.mass_kg").label, quantity_of("drive.amplitude_t").text(4e-4)
    ('mass  [g]', '0.4 mT')
    >>> quantity_of("precession_line_hz").label, quantity_of("escape.radius_m").label
    ('precession line  [Hz]', 'escape.radius  [cm]')
    """
    of_name, found = split(name.rstrip(".0123456789"))
    si = OBSERVABLES[name].unit if name in OBSERVABLES else found.si if found else "1"
    plain = of_name.replace("_", " ") if name in OBSERVABLES else of_name
    return Quantity(_NAMES.get(name) or plain, *unit(si).shown)


def step_in_words(key: str, values: NDArray[Any], count: int = 1, *, logarithmic: bool = False) -> str:
    """Return a number of steps of an axis in words.

    >>> import numpy as np
    >>> step_in_words("start.spin_hz", np.linspace(20, 30, 21), 8)
    '4 Hz (spin at the start)'
    >>> step_in_words("drive.amplitude_t", np.geomspace(1e-5, 1e-3, 3), logarithmic=True)
    'a factor 10 (amplitude of the drive)'
    """
    quantity, steps = quantity_of(key), len(values) - 1
    if logarithmic:
        return f"a factor {(values[-1] / values[0]) ** (count / steps):.3g} ({quantity.name})"
    step = abs(values[-1] - values[0]) * quantity.factor * count / steps
    return f"{f'{step:.3g} {quantity.unit}'.strip()} ({quantity.name})"
