"""bench.toml → frozen, validated settings.  Keys end in their unit; a wrong key or value is named with its path."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, ValidationError

from instruments.drivers.generator import Limits as DriveLimits
from levilab.errors import LevilabError
from levilab.files import read_toml, toml_value
from levilab.settings import Settings, in_one_line
from levilab.texts.text import Text


@dataclass(frozen=True)
class Setting:
    """A line of a table.  comment: its meaning, or empty; is_set: otherwise the line is a comment, an example."""

    name: str
    value: Any
    comment: str = ""
    is_set: bool = True

    @property
    def line(self) -> str:
        """As it stands in the file."""
        assignment = f"{'' if self.is_set else '# '}{self.name} = {toml_value(self.value)}"
        return f"{assignment:31} # {self.comment}" if self.comment else assignment


@dataclass(frozen=True)
class SettingsTable:
    """A table of settings.  about: its subject."""

    name: str
    about: str
    settings: tuple[Setting, ...]


class ConfigError(LevilabError):
    """A configuration that cannot be used."""


class SettingRefused(ConfigError):
    """A setting that the bench does not allow.

    Attributes:
        names: of the settings in the text.
    """

    def __init__(self, text: str, *names: str, **values: object) -> None:
        self.names = names
        super().__init__(text, **values)


class InstrumentSettings(Settings):
    """Address and model of an instrument.

    timeout_s: of one answer; baud_rate, data_bits, parity, stop_bits: of a serial line, where they are not those that
    the instrument leaves the factory with; clock_error: relative error of a sound card's clock, above 0 where it is
    fast, by which its times are corrected; clock_u: relative standard uncertainty of the instrument's clock; trigger:
    the edge of the tape's pulse at a generator's trigger input, where a wire leads there from the phototransistor.
    """

    model: str
    address: str
    timeout_s: PositiveFloat = 2.0
    baud_rate: PositiveInt | None = None
    data_bits: Literal[5, 6, 7, 8] | None = None
    parity: Literal["none", "odd", "even", "mark", "space"] | None = None
    stop_bits: float | None = Field(default=None, ge=1, le=2)
    clock_error: float | None = Field(default=None, gt=-1e-3, lt=1e-3)
    clock_u: PositiveFloat | None = None
    trigger: Literal["rising", "falling"] | None = None

    @property
    def line(self) -> dict[str, Any]:
        """What is given of the serial line."""
        names = ("baud_rate", "data_bits", "parity", "stop_bits")
        return {name: value for name in names if (value := getattr(self, name)) is not None}


class Limits(Settings):
    """What this bench stands; more is refused, never clipped.

    drive_amplitude_vpp, drive_offset_v: largest; drive_frequency_hz, drive_lowest_hz: the range of the drive.
    """

    drive_amplitude_vpp: PositiveFloat = 10.0
    drive_offset_v: NonNegativeFloat = 5.0
    drive_frequency_hz: PositiveFloat = 100.0
    drive_lowest_hz: NonNegativeFloat = 0.0

    def of_the_drive(self) -> DriveLimits:
        """Return the same limits for the generator's driver, which compares with them."""
        return DriveLimits(**self.model_dump())


class BenchConfig(Settings):
    """The bench: its instruments by kind, and what its coil stands.

    count_with: the kind of instrument that counts; an oscilloscope's records are counted by estimating their frequency.
    """

    visa_library: str = "@py"
    count_with: Literal["counter", "oscilloscope"] = "counter"
    counter: InstrumentSettings | None = None
    generator: InstrumentSettings | None = None
    oscilloscope: InstrumentSettings | None = None
    magnetometer: InstrumentSettings | None = None
    limits: Limits = Field(default_factory=Limits)

    def instruments(self) -> dict[str, InstrumentSettings]:
        """Return the described instruments, by kind."""
        kinds = ("counter", "generator", "oscilloscope", "magnetometer")
        return {kind: settings for kind in kinds if (settings := getattr(self, kind)) is not None}


C = TypeVar("C", bound=BenchConfig)


def read_bench(path: Path, tables: type[C], *, instead: str = ", or try `mock`") -> C:
    """Return the bench described in a TOML file.

    tables: what the file may hold; `BenchConfig`, or one with more tables; instead: what else can be done where there
    is no file.  Raises ConfigError.
    """
    try:
        return tables.model_validate(read_table(path, instead=instead))
    except ValidationError as error:
        raise ConfigError("{path:s}: {fault}", path=path, fault=in_one_line(error, tables)) from error


def read_table(path: Path, *, instead: str = ", or try `mock`") -> dict[str, Any]:
    """Return the content of a bench file, whatever it is; see `read_bench`.  Raises ConfigError."""
    missing = "{path}: there is no such file: describe your bench in it (docs/bench.md){instead}"
    expected = "a TOML file is expected, as docs/bench.md describes"
    return read_toml(path, ConfigError, Text(missing, path=path, instead=instead), expected)
