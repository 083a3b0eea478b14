"""The file that describes a device: the base by the calliper, the magnetometer by its data sheet, the top.

All of it may be left out; what is not there is taken from the run, or is not known.
"""

from pathlib import Path
from typing import Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, ValidationError, field_validator, model_validator

from levilab.errors import DataError
from levilab.files import read_toml
from levilab.formats.typed import check_range
from levilab.settings import Settings, in_one_line
from levilab.texts.text import Text


class DeviceError(DataError):
    """A file that describes no device."""


class BaseTable(Settings):
    """The ring magnet.

    Attributes:
        origin_m: height of the middle of its thickness, on the scale of the scan's heights.
    """

    _in_range = field_validator("*")(check_range)

    inner_radius_m: PositiveFloat | None = None
    inner_radius_u_m: NonNegativeFloat = 1e-4
    outer_radius_m: PositiveFloat | None = None
    outer_radius_u_m: NonNegativeFloat = 1e-4
    thickness_m: NonNegativeFloat | None = None
    thickness_u_m: NonNegativeFloat = 2e-4
    origin_m: float | None = None
    origin_u_m: NonNegativeFloat = 1e-3


class MagnetometerTable(Settings):
    """What is common to all readings: gain_u of the scale, relative; background_u_t of zero and earth's field."""

    gain_u: NonNegativeFloat | None = None
    background_u_t: NonNegativeFloat | None = None


class PartTable(Settings):
    """A uniform cylinder of the top.

    Attributes:
        offset_m: of its middle along the axis, from any mark.
    """

    _in_range = field_validator("*")(check_range)

    name: str
    mass_kg: PositiveFloat
    mass_u_kg: NonNegativeFloat = 0.0
    outer_radius_m: PositiveFloat
    outer_radius_u_m: NonNegativeFloat = 0.0
    inner_radius_m: NonNegativeFloat = 0.0
    inner_radius_u_m: NonNegativeFloat = 0.0
    height_m: NonNegativeFloat = 0.0
    height_u_m: NonNegativeFloat = 0.0
    offset_m: float = 0.0
    offset_u_m: NonNegativeFloat = 0.0


class TopTable(Settings):
    """The top: mass and inertias as they are known, or its parts; its moment; the size of its magnet."""

    _in_range = field_validator("*")(check_range)

    mass_kg: PositiveFloat | None = None
    mass_u_kg: NonNegativeFloat = 0.0
    inertia_transverse_kg_m2: PositiveFloat | None = None
    inertia_transverse_u_kg_m2: NonNegativeFloat = 0.0
    inertia_axial_kg_m2: PositiveFloat | None = None
    inertia_axial_u_kg_m2: NonNegativeFloat = 0.0
    moment_a_m2: PositiveFloat | None = None
    moment_u_a_m2: NonNegativeFloat = 0.0
    magnet_radius_m: PositiveFloat | None = None
    magnet_height_m: PositiveFloat | None = None
    parts: tuple[PartTable, ...] = ()

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        whole = (self.mass_kg, self.inertia_transverse_kg_m2, self.inertia_axial_kg_m2)
        if self.parts and any(value is not None for value in whole):
            raise ValueError("mass and inertias follow from the parts: leave one or the other out")
        if (self.inertia_transverse_kg_m2 is None) != (self.inertia_axial_kg_m2 is None):
            raise ValueError("both inertias are expected, or none")
        if (self.magnet_radius_m is None) != (self.magnet_height_m is None):
            raise ValueError("magnet_radius_m and magnet_height_m are expected, or none of them")
        return self


class Device(Settings):
    """All of it."""

    gravity_m_s2: PositiveFloat = 9.82
    base: BaseTable = Field(default_factory=BaseTable)
    magnetometer: MagnetometerTable = Field(default_factory=MagnetometerTable)
    top: TopTable = Field(default_factory=TopTable)


def read_device(path: Path) -> Device:
    """Return the device described in a TOML file.  Raises DeviceError."""
    advice = "a TOML file with [base] and [top] is expected, as sample_data/device.toml"
    missing = Text("{path:s}: there is no such file; {advice}", path=path, advice=advice)
    table = read_toml(path, DeviceError, missing, advice)
    try:
        return Device.model_validate(table)
    except ValidationError as error:
        raise DeviceError("{path:s}: {fault}", path=path, fault=in_one_line(error)) from error
