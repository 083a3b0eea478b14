"""The priors of the cross-check: a row for each number that a trial draws, with its reason."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from analysis.tuning import TEMPERATURE_U

Law = Literal["even", "even in the logarithm", "normal", "log-normal"]
#: Each with its two numbers as text, and the function that draws from it.
FORMS: MappingProxyType[Law, tuple[str, Callable[[np.random.Generator, float, float], float]]] = MappingProxyType({
    "even": ("{a:g} to {b:g} {unit}, evenly", lambda by, a, b: by.uniform(a, b)),
    "even in the logarithm": (
        "{a:.2g} to {b:.2g} {unit}, evenly in its logarithm",
        lambda by, a, b: 10 ** float(by.uniform(math.log10(a), math.log10(b))),
    ),
    "normal": ("({a:g} ± {b:g}) {unit}, normal", lambda by, a, b: by.normal(a, b)),
    "log-normal": ("{a:g} {unit}, its logarithm ± {b:g}, normal", lambda by, a, b: a * math.exp(b * by.normal())),
})  # fmt: skip


@dataclass(frozen=True)
class Prior:
    """A row.

    Attributes:
        name: of the number, for people.
        law: of its distribution.
        a, b: least and greatest value; of a normal one mean and standard deviation; of a log-normal one the median, and
            the standard deviation of the logarithm.
        unit: of a and b; "× usual" for multiples of the value that is usual.
        reason: where the two come from.
    """

    name: str
    law: Law
    a: float
    b: float
    unit: str
    reason: str

    def draw(self, by: np.random.Generator) -> float:
        """Return the next number."""
        return float(FORMS[self.law][1](by, self.a, self.b))

    @property
    def text(self) -> str:
        """Its distribution as text."""
        return FORMS[self.law][0].format(a=self.a, b=self.b, unit=self.unit)


_TOPS = "wider than the 2 % by which the published runs scatter: the analysis knows no scale"
_MASSES = "the masses that float above this base with {} of the moment along the axis"

#: Rows by subject.  Names of fields of a camera, and of keys of a scene, are theirs.
_ROWS: dict[str, tuple[Prior, ...]] = {
    "spin": (
        Prior("spin", "even", 24, 45, "Hz", "from above the fall to what a drive reaches"),
        Prior("drag", "even", 0.7, 1.3, "× usual", _TOPS),
        Prior("width of the tape", "even", 0.02, 0.05, "turns", "a strip of 2 to 5 mm on the rim"),
        Prior("noise of the light", "even in the logarithm", 10**-2.5, 0.1, "V", "of pulses of 1 V, seen and hidden"),
        Prior("scatter of the pulses", "even in the logarithm", 1e-5, 1e-2, "turns", "below and above that noise"),
        Prior("length", "even", 1, 4, "s", "tens of pulses to a hundred"),
    ),
    "spindown": (
        Prior("start", "even", 28, 33, "Hz", "a strong hand"),
        Prior("drag", "even", 0.8, 1.2, "× usual", _TOPS),
        Prior("fall", "even", 21.4, 22.4, "Hz", "the ten published limits, two standard deviations about their mean"),
        Prior("scatter of the pulses", "even", 0.5, 2, "× usual", "the usual one scatters a reading by 0.03 Hz"),
    ),
    "motion": (
        Prior("moment across the axis", "even", 0.022, 0.034, "of the whole (0.97 lies along it)",
              "near the root mean square of a maker's tolerance"),
        Prior("drag", "even", 0.85, 1.15, "× usual", _TOPS),
        Prior("top.mass_kg", "even", 0.0242, 0.0244, "kg", _MASSES.format(0.97)),
        Prior("start.spin_hz", "even", 29, 31, "Hz", "a hand"),
    ),
    "field": (
        Prior("moment as stated", "normal", 1, 0.01, "× usual", "1 % is its u"),
        Prior("mass as weighed", "normal", 0, 1e-5, "kg", "its u, of scales"),
        Prior("height as measured", "normal", 0, 2e-4, "m", "its u, of a ruler"),
    ),
    "sway": (
        Prior("top.mass_kg", "even", 0.025, 0.0254, "kg", _MASSES.format("all")),
        Prior("push", "even", 2e-4, 1e-3, "m", "a hand; more would be seen to hit the base"),
        Prior("azimuth", "even", 0, 2 * math.pi, "rad", "any"),
        Prior("height", "even", -5e-4, 5e-4, "m", "beside where it floats, as the push"),
        Prior("velocity", "even", -3e-3, 3e-3, "m/s", "along each axis, as the push makes it"),
        Prior("start.tilt_rad", "even", 0.003, 0.02, "rad", "a calm hand"),
        Prior("noise", "normal", 0, 1e-4, "m", "of a coordinate in a film"),
        Prior("noise of the field", "normal", 0, 1.2e-7, "T", "of a sample of a phone's magnetometer"),
        Prior("distance", "normal", 0.12, 0.005, "m", "of a magnetometer above the top, as a ruler has it; its u"),
        Prior("aside", "even", 0, 0.005, "m", "from the axis: where in a phone it is, is known to some millimetres"),
        Prior("gains", "log-normal", 1, 0.1, "1", "of y over that of x: more than a phone's are apart"),
        Prior("mass as weighed", "normal", 0, 1e-5, "kg", "its u, of scales"),
        Prior("radius as measured", "normal", 0, 1e-4, "m", "its u, of a calliper; inner and outer"),
    ),
    "video": (
        Prior("start.spin_hz", "even", 26, 42, "Hz", "from above the fall to what a drive reaches"),
        Prior("share of newton", "even", 0, 1, "1", "the drag of a real top is not known: any exponent from 1 to 2"),
        Prior("scale", "even", 4.6e-4, 5.4e-4, "m/pixel", "known to 10 %"),
        Prior("exposure", "even", 3e-4, 1.5e-3, "s", "of a phone's slow motion by a window and by a lamp"),
        Prior("line_time", "even", 5e-6, 25e-6, "s", "of the shutters of phones"),
        Prior("blur", "even", 1, 3, "pixels", "of lens and codec"),
        Prior("noise", "even", 1, 4, "of 255", "of a sensor by day and by lamp"),
        Prior("away", "even", -4, 4, "pixels", "of the top from the middle, each way"),
        Prior("distance", "even", 0.25, 0.6, "m", "a stand on the table"),
        Prior("length", "even", 0.8, 4, "s", "with and without readings of a second"),
    ),
    "tune": (
        Prior("temperature coefficient", "normal", -0.002, 0.0007, "1/K", "of ferrites, by makers; base and top"),
        Prior("strength", "normal", 1, 0.01, "× usual", "from base to base"),
        Prior("share of the window", "log-normal", 0.4, 0.7, "1", "that a hand floats: a fifth to all of it"),
        Prior("place in the window", "even", 0, 1, "1", "any"),
        Prior("washers needed", "even", 0.2, 0.8, "of them", "an owner has enough"),
        Prior("thermometer", "normal", 0, TEMPERATURE_U, "K", "what the analysis takes for its u"),
    ),
    "hold": (Prior("spin", "even", 28, 48, "Hz", "from a hand's to what the drive holds"),),
    "limit": (
        Prior("lower mean", "even", 21.4, 22.4, "Hz", "as the fall of a spin-down"),
        Prior("upper mean", "even", 33, 38, "Hz", "soon reached"),
        Prior("top", "normal", 0, 0.25, "Hz", "the ten published limits"),
    ),
}  # fmt: skip
#: Subject → name → row.
PRIORS = MappingProxyType({subject: {row.name: row for row in rows} for subject, rows in _ROWS.items()})


def drawing(subject: str, by: np.random.Generator) -> Callable[[str], float]:
    """Return a function that draws a number of a subject by its name."""
    return lambda name: PRIORS[subject][name].draw(by)
