"""What an experiment is: a row of the table in `levilab.acquisition.experiments`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar

from pydantic import Field, PositiveFloat, field_validator, model_validator

from levilab.bench.config import SettingRefused
from levilab.formats.typed import check_range
from levilab.runs.channel import Channel
from levilab.settings import Settings
from levilab.texts.text import Text

if TYPE_CHECKING:
    from instruments.catalogue import Model
    from levilab.acquisition.session import Session
    from levilab.bench.config import BenchConfig, Limits
    from levilab.simulator.scene import Scene

#: From a kind of instrument to the row of its model; None where the bench has none.
ModelOf = Callable[[str], "Model[Any] | None"]


class ExperimentSettings(Settings):
    """What the bench file says of an experiment, in a table of its name.

    A field's description is its comment in a new bench file, where the fields stand in order, inherited ones last; a
    field that is None by default has an example.
    """

    _in_range = field_validator("*")(check_range)

    def check(self, table: str, limits: Limits) -> None:
        """Raise ConfigError for what the bench does not allow.

        Args:
            table: the name of these settings in the bench file.
            limits: of the bench.
        """

    def refusal(self, table: str, text: str, *names: str, **values: object) -> SettingRefused:
        """Return the error for settings of these names, whose values the text has beside other ones."""
        own = {name: getattr(self, name) for name in names}
        return SettingRefused(text, *names, table=table, **own, **values)

    def for_bench(self, config: BenchConfig, model_of: ModelOf) -> Self:
        """Return these settings for a bench; defaults may change to suit its instruments.

        Args:
            config: of the bench.
            model_of: from a kind of instrument to the row of its model; None where the bench has none.
        """
        return self

    def for_scene(self, scene: Scene) -> Self:
        """Return these settings for a virtual bench whose top is a scene's; defaults may change to suit it."""
        return self


class CounterSettings(ExperimentSettings):
    """Readings of the counter at an interval.

    Attributes:
        one_top: whether all readings are of one top, which falls meanwhile: then longest_s counts from time zero, else
            a resumed run starts with the full time.
    """

    one_top: ClassVar[bool] = True

    interval_s: PositiveFloat = Field(default=10.0, description="time from one reading to the next")
    gate_s: PositiveFloat = Field(default=1.0, description="length of a count")
    trigger_level_v: float = Field(default=0.6, description="half way between dark and the pulse of the tape")
    reading_u_hz: PositiveFloat | None = Field(
        default=None, description="standard uncertainty of a reading, if you know it", examples=[0.03]
    )
    longest_s: PositiveFloat = Field(default=1800.0, description="an end if the top never falls")

    @model_validator(mode="after")
    def _gate_within_interval(self) -> Self:
        if self.gate_s >= self.interval_s:
            why = "gate_s = {gate:g} must be shorter than interval_s = {interval:g}: a reading takes the gate and more"
            raise ValueError(Text(why, gate=self.gate_s, interval=self.interval_s))
        return self

    def for_bench(self, config: BenchConfig, model_of: ModelOf) -> Self:
        """See the base: the gate is the nearest of the counter's; its driver refuses what is far from all of them."""
        counter = model_of("counter") if config.count_with == "counter" else None
        gates = counter.gates if counter else ()
        if not gates or not gates[0] <= self.gate_s <= 2 * gates[-1]:
            return self
        fitting = [gate for gate in gates if gate < self.interval_s]
        nearest = min(fitting, key=lambda gate: max(gate / self.gate_s, self.gate_s / gate))
        return self.model_copy(update={"gate_s": nearest})

    def with_jitter(self, jitter: float) -> Self:
        """Add the uncertainty of a reading from pulses that scatter by this much [turns]: √2 jitter/gate."""
        u = self.reading_u_hz or round(2**0.5 * jitter / self.gate_s, 6)
        return self.model_copy(update={"reading_u_hz": u})


S = TypeVar("S", bound=ExperimentSettings)


@dataclass(frozen=True)
class Experiment(Generic[S]):
    """An experiment.

    Attributes:
        about: one line.
        instruments: the kinds that it needs.
        settings: its table in the bench file.
        channels: the columns that it writes, given its settings.
        run: carries it out.
        also_needs: the kinds of instrument that it needs only with some settings, given these.
        mock_scene: the scene of a mock unless another is asked for, None: a top that only spins.
        called: what one reading of it is called.
    """

    name: str
    about: str
    instruments: tuple[str, ...]
    settings: type[S]
    channels: Callable[[S], tuple[Channel, ...]]
    run: Callable[[Session[S]], None]
    mock_scene: str | None = None
    also_needs: Callable[[S], tuple[str, ...]] = lambda _: ()
    called: str = "reading"

    def columns(self, settings: S, *, estimated: bool) -> tuple[Channel, ...]:
        """Return the columns of the readings.

        Args:
            settings: of the experiment.
            estimated: whether the bench's counter estimates a u with each count, which then has a column behind it.
        """
        found = self.channels(settings)
        names = [channel.name for channel in found]
        if not estimated or "spin_frequency_hz" not in names or "spin_frequency_u_hz" in names:
            return found
        after = names.index("spin_frequency_hz") + 1
        u = Channel("spin_frequency_u_hz", "Hz", "standard uncertainty of a reading, from the scatter of its samples")
        return (*found[:after], u, *found[after:])

    def kinds(self, settings: S) -> tuple[str, ...]:
        """Return the kinds of instrument that it needs with these settings."""
        return (*self.instruments, *self.also_needs(settings))
