"""What is observed at the points of a sweep, a row a column, and how quantities are named and shown.

Nothing heavy is imported here: the command refuses an unknown name before anything is compiled.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import starmap
from typing import TYPE_CHECKING, Any, Literal

from levilab.errors import UsageError
from levilab.present.units import split, unit
from levilab.simulator.keys import nearest
from levilab.texts.text import Text

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

#: What must be simulated: the ends alone, those and once more with longer steps, or samples on the way.
Need = Literal["ends", "errors", "samples"]


@dataclass(frozen=True)
class Observable:
    """One column of results.

    Attributes:
        name: with its unit at the end.
        unit: "1" for a number without one.
        meaning: one sentence; where a value is missing, it says when.
        dtype: of its array; a missing float is NaN.
        needs: what must be simulated for it.
    """

    name: str
    unit: str
    meaning: str
    dtype: str
    needs: Need


#: A line's columns begin with this → its name in `levilab.motion.lines`.
LINES = {
    "precession": "precession",
    "nutation": "nutation",
    "swing": "swing sideways",
    "back_swing": "swing sideways, backwards",
    "drive": "drive",
    "wobble": "wobble, once a turn",
}


def _columns_of_line(start: str, name: str) -> tuple[Observable, Observable]:
    of = f"of the axis's line that is called {name}; NaN where there is none"
    return (
        Observable(f"{start}_line_hz", "Hz", f"Frequency {of}.", "float64", "samples"),
        Observable(f"{start}_line_rad", "rad", f"Amplitude {of}.", "float64", "samples"),
    )


#: Rows of Observable.
_ROWS: tuple[tuple[str, str, str, str, Need], ...] = (
    ("survived", "1", "Whether the top is still up at the end.", "bool", "ends"),
    ("lifetime_s", "s", "Time from the start to the fall; NaN of a top that is still up.", "float64", "ends"),
    ("fall_spin_hz", "Hz", "Spin at the moment of the fall; NaN of a top that is still up.", "float64", "ends"),
    ("end_spin_hz", "Hz", "Spin at the end, or at the fall.", "float64", "ends"),
    ("energy_error", "1",
     "Change of the energy from start to end, relative; NaN where drag, drive or washers change it.", "float64",
     "ends"),
    ("position_error_m", "m", "Estimated error of the place at the end, or at the fall.", "float64", "errors"),
    ("highest_spin_hz", "Hz", "Highest spin on the way, with its swing about a drive.", "float64", "samples"),
    ("height_spread_m", "m", "Highest less lowest place; NaN of a top that falls.", "float64", "samples"),
    ("locked", "1",
     "Whether the top is up and its body slips by no turn behind the drive in the last half of the time.", "bool",
     "samples"),
)  # fmt: skip
OBSERVABLES: dict[str, Observable] = {
    one.name: one
    for one in (
        *starmap(Observable, _ROWS),
        *(column for start, name in LINES.items() for column in _columns_of_line(start, name)),
    )
}

#: Short names of several columns.
GROUPS: dict[str, tuple[str, ...]] = {
    "lines": tuple(name for name in OBSERVABLES if name.endswith(("_line_hz", "_line_rad")))
}

#: Names for `--observe`: each is a column, or several.
NAMES = (*(name for name in OBSERVABLES if name not in GROUPS["lines"]), *GROUPS)


def columns_of(names: Iterable[str]) -> tuple[Observable, ...]:
    """Return the columns that these observables fill, each once.  Raises UsageError for a name that is unknown."""
    found: dict[str, Observable] = {}
    for name in names:
        columns = GROUPS.get(name, (name,))
        if columns[0] not in OBSERVABLES:
            near = nearest(name, [*NAMES, *OBSERVABLES])
            meant = f"did you mean {near}? Known" if near else "known"
            raise UsageError("observe", f"there is no such observable; {meant} are {', '.join(NAMES)}", value=name)
        found |= {column: OBSERVABLES[column] for column in columns}
    return tuple(found.values())


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
        factor = (values[-1] / values[0]) ** (count / steps)
        return Text("a factor {factor:.3g} ({quantity})", factor=factor, quantity=quantity.name)
    step = abs(values[-1] - values[0]) * quantity.factor * count / steps
    unit = f" {quantity.unit}" if quantity.unit else ""
    return Text("{step:.3g}{unit} ({quantity})", step=step, unit=unit, quantity=quantity.name)
