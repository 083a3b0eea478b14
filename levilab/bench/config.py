"""bench.toml → frozen, validated settings.  Keys end in their unit; a wrong key or value is named with its path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import (
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from levilab.errors import LevilabError
from levilab.files import parse_toml
from levilab.settings import Settings, in_one_line

if TYPE_CHECKING:
    from pathlib import Path


class ConfigError(LevilabError):
    """A configuration that cannot be used."""


class InstrumentSettings(Settings):
    """Where an instrument is, and what it is.

    timeout_s: of one answer; baud_rate, data_bits, parity, stop_bits: of a serial line, where they are not those that
    the instrument leaves the factory with.
    """

    model: str
    address: str
    timeout_s: PositiveFloat = 2.0
    baud_rate: PositiveInt | None = None
    data_bits: Literal[5, 6, 7, 8] | None = None
    parity: Literal["none", "odd", "even", "mark", "space"] | None = None
    stop_bits: float | None = Field(default=None, ge=1, le=2)

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


class ExperimentSettings(Settings):
    """What every experiment that reads again and again needs.  longest_s: an end if nothing else ends it."""

    interval_s: PositiveFloat = 10.0
    longest_s: PositiveFloat = 1800.0


class SpinSettings(ExperimentSettings):
    """The spin-down: drive up to a frequency, switch off, read until the top falls.

    reading_u_hz: standard uncertainty of one reading, where it is known; ramp_hz_per_s: no faster than the drive can
    pull the top; of the 0.4 Hz/s that 0.4 mT can, drag takes up to 0.17 and the swing about the drive most of the rest.
    """

    drive_frequency_hz: PositiveFloat = 40.0
    drive_amplitude_vpp: PositiveFloat = 10.0
    drive_waveform: Literal["SIN", "SQU", "TRI"] = "SIN"
    ramp_hz_per_s: PositiveFloat = 0.05
    gate_s: PositiveFloat = 1.0
    trigger_level_v: float = 0.6
    reading_u_hz: PositiveFloat | None = None

    @model_validator(mode="after")
    def _gate_within_interval(self) -> SpinSettings:
        if self.gate_s >= self.interval_s:
            raise PydanticCustomError(
                "gate",
                "gate_s = {gate} must be shorter than interval_s = {interval}: a reading takes the gate and more",
                {"gate": f"{self.gate_s:g}", "interval": f"{self.interval_s:g}"},
            )
        return self


class BenchConfig(Settings):
    """The bench: its instruments by kind, its limits, and how the experiments are run on it."""

    visa_library: str = "@py"
    counter: InstrumentSettings | None = None
    generator: InstrumentSettings | None = None
    oscilloscope: InstrumentSettings | None = None
    magnetometer: InstrumentSettings | None = None
    limits: Limits = Field(default_factory=Limits)
    spin: SpinSettings = Field(default_factory=SpinSettings)


def read_bench(path: Path) -> BenchConfig:
    """The bench described in a TOML file.  Raises ConfigError."""
    try:
        table = parse_toml(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise ConfigError(
            f"{path}: there is no such file: describe your bench in it (docs/bench.md), or try --mock"
        ) from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}): a TOML file is expected") from error
    except ValueError as error:
        raise ConfigError(f"{path}: not readable as TOML: {error}") from error
    try:
        return BenchConfig.model_validate(table)
    except ValidationError as error:
        raise ConfigError(f"{path}: {in_one_line(error)}") from error


def within_limits(config: BenchConfig) -> BenchConfig:
    """The configuration, if what its spin-down wants is allowed on its bench.  Raises ConfigError."""
    spin, limits = config.spin, config.limits
    for name in ("drive_amplitude_vpp", "drive_frequency_hz"):
        wanted, limit = getattr(spin, name), getattr(limits, name)
        if wanted > limit:
            raise ConfigError(f"spin.{name} = {wanted:g} is more than this bench stands, limits.{name} = {limit:g}")
    if spin.drive_frequency_hz < limits.drive_lowest_hz:
        raise ConfigError(
            f"spin.drive_frequency_hz = {spin.drive_frequency_hz:g} is less than this bench stands, "
            f"limits.drive_lowest_hz = {limits.drive_lowest_hz:g}"
        )
    return config
