"""What an experiment is: a row of the table in `levilab.acquisition.experiments`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Self, TypeVar

from pydantic import PositiveFloat, model_validator
from pydantic_core import PydanticCustomError

from levilab.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.acquisition.session import Session
    from levilab.bench.config import Limits
    from levilab.runs.channel import Channel


class ExperimentSettings(Settings):
    """What the bench file says of an experiment, in a table of its name."""

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for what the bench does not allow.  table: the name of these settings in the bench file."""


class CounterSettings(ExperimentSettings):
    """Readings of the counter at an interval.

    interval_s: from one reading to the next; longest_s: an end if nothing else ends it; gate_s: of one reading;
    trigger_level_v: between dark and bright; reading_u_hz: standard uncertainty of one reading, where it is known.
    """

    interval_s: PositiveFloat = 10.0
    longest_s: PositiveFloat = 1800.0
    gate_s: PositiveFloat = 1.0
    trigger_level_v: float = 0.6
    reading_u_hz: PositiveFloat | None = None

    @model_validator(mode="after")
    def _gate_within_interval(self) -> Self:
        if self.gate_s >= self.interval_s:
            raise PydanticCustomError(
                "gate",
                "gate_s = {gate} must be shorter than interval_s = {interval}: a reading takes the gate and more",
                {"gate": f"{self.gate_s:g}", "interval": f"{self.interval_s:g}"},
            )
        return self

    def with_jitter(self, jitter_s: float) -> Self:
        """With the uncertainty that pulses which scatter by this much [s] give a reading, √2 jitter/gate turns."""
        u = self.reading_u_hz or round(2**0.5 * jitter_s / self.gate_s, 6)
        return self.model_copy(update={"reading_u_hz": u})


S = TypeVar("S", bound=ExperimentSettings)


@dataclass(frozen=True)
class Experiment(Generic[S]):
    """An experiment.

    about: one line; instruments: the kinds that it needs; settings: its table in the bench file; channels: the columns
    that it writes, given its settings; run: carries it out.
    """

    name: str
    about: str
    instruments: tuple[str, ...]
    settings: type[S]
    channels: Callable[[S], tuple[Channel, ...]]
    run: Callable[[Session[S]], None]
