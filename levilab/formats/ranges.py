"""The range of each quantity that a person states: a row each, which every door reads; outside, a unit was mistaken.

Wide enough for any top that floats and its bench.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple, Self

from levilab.texts.text import Sentences, Text


class Unit(NamedTuple):
    """A unit: its sign, its name, and the factor and the shift to the quantity's own unit."""

    sign: str
    name: str
    factor: float
    shift: float = 0.0


class WithUnit(float):
    """A number that was typed with its unit, in the one that was wanted.  `text` is what was typed."""

    def __new__(cls, value: float, text: str) -> Self:
        """Make it of both."""
        self = super().__new__(cls, value)
        self.text = text
        return self

    text: str


_MASS = (Unit("kg", "kilograms", 1.0), Unit("g", "grams", 1e-3), Unit("mg", "milligrams", 1e-6))
_LENGTH = (Unit("m", "metres", 1.0), Unit("cm", "centimetres", 1e-2), Unit("mm", "millimetres", 1e-3))
_FREQUENCY = (Unit("Hz", "hertz", 1.0), Unit("rpm", "turns per minute", 1 / 60))
_TEMPERATURE = (
    Unit("°C", "degrees Celsius", 1.0),
    Unit("K", "kelvins", 1.0, -273.15),
    Unit("°F", "degrees Fahrenheit", 5 / 9, -160 / 9),
)
_FIELD = (Unit("T", "teslas", 1.0), Unit("mT", "milliteslas", 1e-3), Unit("G", "gauss", 1e-4))
_MOMENT = (Unit("A m²", "A m²", 1.0), Unit("mA m²", "mA m²", 1e-3))
_PART = (Unit("", "parts of one", 1.0), Unit("ppm", "millionths", 1e-6))

#: The end of a key, or the name of an option → its units, the own one first, and its least and greatest value in it.
RANGES: Mapping[str, tuple[tuple[Unit, ...], float, float]] = MappingProxyType({
    "mass_kg": (_MASS, 1e-6, 1.0),
    "washer_mass_kg": (_MASS, 1e-6, 0.02),  # a top that floats weighs 20 to 30 g, washers a few
    "temperature_c": (_TEMPERATURE, -30.0, 60.0),
    "inner_radius_m": (_LENGTH, 0.0, 0.5),
    "outer_radius_m": (_LENGTH, 1e-4, 0.5),
    "magnet_radius_m": (_LENGTH, 1e-4, 0.1),
    "magnet_height_m": (_LENGTH, 1e-5, 0.1),
    "thickness_m": (_LENGTH, 0.0, 0.2),
    "lowest_m": (_LENGTH, -1.0, 2.0),
    "highest_m": (_LENGTH, -1.0, 2.0),
    "height_m": (_LENGTH, -1.0, 2.0),
    "below_m": (_LENGTH, -1.0, 1.0),
    "distance_m": (_LENGTH, 1e-3, 5.0),
    "sensor_m": (_LENGTH, 1e-3, 2.0),
    "rim_m": (_LENGTH, 1e-3, 0.2),
    "base_m": (_LENGTH, 5e-3, 0.8),
    "stem_m": (_LENGTH, 1e-4, 0.1),
    "camera_m": (_LENGTH, 2e-2, 50.0),
    "scale_m": (_LENGTH, 1e-7, 1e-2),
    "moment_a_m2": (_MOMENT, -100.0, 100.0),
    "range_t": (_FIELD, 0.0, 10.0),
    "amplitude_t": (_FIELD, 0.0, 0.1),
    "near": (_FREQUENCY, 0.1, 300.0),
    "drive": (_FREQUENCY, 0.1, 300.0),
    "clock_u": (_PART, 0.0, 1e-2),
})  # fmt: skip


def problem_of(key: str, value: float, factor: float = 1.0, *, asks: bool = True) -> str:
    """Return what is wrong with the size of a value, and what was probably meant; empty where nothing is.

    Args:
        key: of a setting, or the name of an option; only its end counts.
        value: in the quantity's own unit.
        factor: to that unit from the one in which it was typed.
        asks: whether it was typed without its unit.

    >>> problem_of("top.mass_kg", 25.0)
    'a number from 1e-06 to 1 kg is expected.  Were grams meant?  25 g are 0.025, 25 mg are 2.5e-05'
    >>> problem_of("camera_m", 0.0015, 1e-3), problem_of("rim_m", 0.029)
    ('a number from 20 to 50000 mm is expected.  Were metres meant?  1.5 m are 1500', '')
    """
    name = key.rpartition(".")[2]
    row = next((RANGES[end] for end in (name, name.partition("_")[2]) if end in RANGES), None)
    if row is None or row[1] <= value <= row[2]:
        return ""
    units, low, high = row
    typed = value / factor
    own = next((one for one in units if math.isclose(one.factor, factor)), None)
    if own is None:  # no row: in the quantity's own unit
        own, factor, typed = units[0], 1.0, value
    said = Text(
        "a number from {low:g} to {high:g}{unit:s} is expected", low / factor, high / factor, f" {own.sign}".rstrip()
    )
    meant = [(one, typed * one.factor + one.shift) for one in units if asks and one is not own]
    fitting = [(one, size / factor) for one, size in meant if low <= size <= high and size]
    if not fitting:
        return said
    one, size = fitting[0]
    asked = Text("Were {units} meant?  {typed:g} {sign:s} are {meant:.6g}", one.name, typed, one.sign, size)
    also = [Text("{typed:g} {sign:s} are {meant:.6g}", typed, one.sign, size) for one, size in fitting[1:2]]
    return Text("{said}.  {asked}", said, Sentences(asked, *also, between=", "))
