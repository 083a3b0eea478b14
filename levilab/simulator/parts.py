"""The parts of a scene: the magnets, what acts on them, and how the motion begins.

Lengths [m], angles [rad], spins and drives [Hz], moments [A m²], flux densities [T].  Keys end in their unit; the
defaults are the thesis's device.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, NonNegativeFloat, field_validator, model_validator

from levilab.formats.typed import check_range
from levilab.settings import Settings
from levilab.simulator.laws import LAWS
from levilab.texts.text import Text

FieldKind = Literal[
    "exact", "paraxial-2", "paraxial-4", "paraxial-6", "paraxial-8", "paraxial-10", "paraxial-12", "paraxial-14",
    "paraxial-16", "paraxial-18", "paraxial-20",
]  # fmt: skip
if TYPE_CHECKING:
    Law = str
else:
    Law = Literal["none", *LAWS]


def _numbers(count: int) -> BeforeValidator:
    def check(value: Any) -> Any:
        if isinstance(value, list | tuple) and len(value) == count:
            return tuple(value)
        raise ValueError(Text("{count} numbers in brackets are expected", count=count))

    return BeforeValidator(check)


def _one_or_two(value: Any) -> Any:
    """Read a constant of drag, one number or two; pydantic's own words for a union name its parts as keys."""
    numbers = list(value) if isinstance(value, list | tuple) else [value]
    if value is None or (1 <= len(numbers) <= 2 and all(map(_from_zero, numbers))):
        return tuple(numbers) if len(numbers) == 2 else numbers[0]
    raise ValueError("a number from 0 is expected, two of them ([c1, c2]) for the law mixed")


def _from_zero(value: Any) -> bool:
    # NaN is in no range, and True is an int to Python
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= sys.float_info.max


# what no bench has, and no number of a float stands: named here rather than found as an infinity inside a kernel
Length = Annotated[float, Field(gt=1e-6, lt=1e3)]
Mass = Annotated[float, Field(gt=1e-9, lt=1e6)]
Inertia = Annotated[float, Field(gt=1e-18, lt=1e6)]
Turns = Annotated[float, Field(gt=-1e6, lt=1e6)]
Frequency = Annotated[float, Field(gt=0, lt=1e6)]
Coordinate = Annotated[float, Field(gt=-1e6, lt=1e6)]
#: So that no magnet turns over: a change below 1 at any TemperatureRise.
PerKelvin = Annotated[float, Field(gt=-0.01, lt=0.01)]
TemperatureRise = Annotated[float, Field(gt=-100, lt=100)]
Vector = Annotated[tuple[Coordinate, Coordinate, Coordinate], _numbers(3)]
Direction = Annotated[tuple[float, float, float], _numbers(3)]
Pair = Annotated[tuple[float, float], _numbers(2)]
Coefficient = Annotated[float | tuple[float, float] | None, BeforeValidator(_one_or_two)]
Never = Annotated[NonNegativeFloat | None, BeforeValidator(lambda value: None if value == "never" else value)]


class Part(Settings):
    """A table of a scene.  Strict: a number in quotes is no number."""

    model_config = ConfigDict(strict=True)
    _in_range = field_validator("*")(check_range)


class Base(Part):
    """The ring magnet.

    Attributes:
        inner_radius_m, outer_radius_m: its radii.
        strength_t_m: dipole density integrated over the thickness [T m].
        temperature_coefficient_per_k: relative change of the strength per kelvin; of ferrite, with u = 0.0007.
        field: how it is computed.
        thickness_m: 0 for a thin ring.
        origin_m: height of the middle of its thickness.
        tilt_rad: by so much the base leans ...
        tilt_azimuth_rad: ... in this direction.
    """

    inner_radius_m: Length = 0.030
    outer_radius_m: Length = 0.055
    strength_t_m: Coordinate = 1.40e-3
    temperature_coefficient_per_k: PerKelvin = -0.002
    field: FieldKind = "paraxial-2"
    thickness_m: float = Field(default=0.0, ge=0, lt=1e3)
    origin_m: Coordinate = 0.0
    tilt_rad: float = Field(default=0.0, gt=-math.pi / 2, lt=math.pi / 2)
    tilt_azimuth_rad: float = 0.0


class Top(Part):
    """The symmetric top.

    Attributes:
        mass_kg: of the whole.
        inertia_transverse_kg_m2, inertia_axial_kg_m2: of the whole.
        moment_a_m2: signed along its axis, negative when it floats over the thesis's base.
        temperature_coefficient_per_k: relative change of the moment per kelvin, as of the base.
        moment_tilt: transverse and axial part of the moment, as fractions of moment_a_m2.
        magnet: "disc": the moment is spread evenly over a disc of magnet_radius_m and magnet_height_m.
    """

    mass_kg: Mass = 0.02526
    inertia_transverse_kg_m2: Inertia = 1.04e-6
    inertia_axial_kg_m2: Inertia = 1.731314e-6
    moment_a_m2: Coordinate = -0.714
    temperature_coefficient_per_k: PerKelvin = -0.002
    moment_tilt: Pair = (0.0, 1.0)
    magnet: Literal["point", "disc"] = "point"
    magnet_radius_m: Length = 0.0144
    magnet_height_m: Length = 0.0033

    @property
    def aligned(self) -> bool:
        """Whether the moment lies along the axis."""
        return self.moment_tilt[0] == 0


class Washers(Part):
    """Washers that an O-ring holds.

    Attributes:
        inertia_kg_m2: the part of the axial inertia that is loose, 0 = none.
        coupling_n_m_s: torque between washers and top per slip [N m s].
        drag_share: part of the drag that they take.
    """

    inertia_kg_m2: NonNegativeFloat = 0.0
    coupling_n_m_s: NonNegativeFloat = 1e-6
    drag_share: float = Field(default=1.0, ge=0, le=1)


class Drag(Part):
    """Drag of the air on the spin, dω/dt = −C|ω|^(n−1) ω: n = 1 stokes, 2 newton, 3/2 disc; mixed: c1 and c2.

    Attributes:
        coefficient: where none is given, that of the thesis's spin-downs.
    """

    law: Law = "none"
    coefficient: Coefficient = None

    @model_validator(mode="before")
    @classmethod
    def _usual(cls, table: Any) -> Any:
        if isinstance(table, dict) and table.get("coefficient") is None:
            usual = LAWS[law].usual if (law := str(table.get("law"))) in LAWS else (None,)
            return table | {"coefficient": usual if len(usual) > 1 else usual[0]}
        return table

    @property
    def constants(self) -> tuple[float, ...]:
        """What the law takes: nothing, one number or two."""
        if self.law == "none" or self.coefficient is None:
            return ()
        return self.coefficient if isinstance(self.coefficient, tuple) else (self.coefficient,)


class Drive(Part):
    """A uniform field, amplitude_t · s(2π frequency_hz t + phase_rad) along direction, until off_s (None: always).

    s is 0 at phase 0 and 1 at π/2 (sine, triangle), the sine's sign (square), or 1 and 0 in turn (unipolar).  With
    "triggered" it is one cycle of a sine from phase_rad on, each time the top's tape has passed a light, and else 0.

    Attributes:
        ramp_hz_per_s: rate at which the frequency of a sine goes up, from frequency_hz at time 0 until off_s.
        light_rad: of a triggered drive: the body's angle φ + ψ about the vertical when its tape passes the light.
        latency_s: from then to the burst; a tape that passes during a burst is not seen.
        cycle_turns: 0, or the burst's period in turns of the top as it passes, in place of 1/frequency_hz.
    """

    waveform: Literal["off", "sine", "triangle", "square", "unipolar", "triggered"] = "off"
    amplitude_t: float = Field(default=4e-4, ge=0, lt=1e6)
    frequency_hz: Frequency = 30.0
    phase_rad: float = math.pi / 2
    direction: Direction = (0.0, 1.0, 0.0)
    off_s: Never = None
    ramp_hz_per_s: float = Field(default=0.0, ge=0, lt=1e3)
    light_rad: float = -math.pi / 2
    latency_s: float = Field(default=2e-5, ge=0, lt=1e3)
    cycle_turns: float = Field(default=0.0, ge=0, lt=1e3)

    @property
    def is_periodic(self) -> bool:
        """Whether the field repeats with frequency_hz, whatever the top does."""
        return self.waveform not in {"off", "triggered"}

    @property
    def highest_hz(self) -> Any:
        """The highest frequency of a drive that goes up [Hz]."""
        return self.frequency_hz + self.ramp_hz_per_s * (self.off_s or 0.0)

    def turns(self, times: Any) -> Any:
        """Return the angle of a periodic drive since time 0 at some times [s], in turns."""
        return (self.frequency_hz + self.ramp_hz_per_s / 2 * times) * times


class Start(Part):
    """How the motion begins: IC1 of the thesis.  place "equilibrium": at rest where the top floats.

    precession "thesis": φ̇ = ψ̇ = 2π spin_hz/(1 + cos tilt); "steady": the slow precession without nutation, or, below
    about 21.7 Hz, where there is none, the rate nearest to one; "none": the axis starts at rest.

    Attributes:
        spin_hz: turns about the axis per second, ω₃/2π.
    """

    place: Literal["given", "equilibrium"] = "given"
    position_m: Vector = (0.001, 0.0, 0.071)
    velocity_m_s: Vector = (-0.0007, 0.0, 0.002)
    tilt_rad: float = Field(default=0.01, ge=0, lt=math.pi)
    spin_hz: Turns = 30.0
    precession: Literal["thesis", "steady", "none"] = "thesis"

    @property
    def away2(self) -> float:
        """The square of the place's distance from the base's axis [m²]."""
        x, y, _ = self.position_m
        return x * x + y * y


class Escape(Part):
    """Where the top counts as fallen: farther than radius_m from the base's axis, or at height_m or below."""

    radius_m: Length = 0.02
    height_m: Coordinate = 0.0
