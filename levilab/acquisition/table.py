"""The table of experiments, and the bench file with a table for each of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import Field, create_model

from levilab.acquisition.experiment import CounterSettings, Experiment
from levilab.acquisition.experiments import spin
from levilab.bench.config import BenchConfig

if TYPE_CHECKING:
    from levilab.acquisition.experiment import ExperimentSettings

#: Name → experiment.
EXPERIMENTS: dict[str, Experiment[Any]] = {experiment.name: experiment for experiment in (spin.EXPERIMENT,)}

_TABLES: dict[str, Any] = {
    experiment.name: (experiment.settings, Field(default_factory=experiment.settings))
    for experiment in EXPERIMENTS.values()
}
#: What a bench file holds: the bench, and for each experiment a table of its name.
Configuration: type[BenchConfig] = create_model("Configuration", __base__=BenchConfig, **_TABLES)


def settings_of(config: BenchConfig, experiment: str) -> Any:
    """What a `Configuration` says of an experiment."""
    return getattr(config, experiment)


def with_settings(config: BenchConfig, experiment: str, settings: ExperimentSettings) -> BenchConfig:
    """A `Configuration` with other settings of an experiment."""
    return config.model_copy(update={experiment: settings})


def counter_settings(config: BenchConfig) -> CounterSettings:
    """How the bench looks at the light: as the first experiment does that counts its pulses."""
    tables = (settings_of(config, name) for name in EXPERIMENTS)
    return next((table for table in tables if isinstance(table, CounterSettings)), CounterSettings())
