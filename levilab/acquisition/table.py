"""The table of experiments, and the bench file with a table for each of them."""

import inspect
from collections.abc import Iterator
from typing import Any

from pydantic import Field, create_model

from levilab.acquisition.experiment import CounterSettings, Experiment, ExperimentSettings
from levilab.acquisition.experiments import NAMES, experiment
from levilab.bench.config import BenchConfig, Setting, SettingsTable

#: Name → experiment.
EXPERIMENTS: dict[str, Experiment[Any]] = {name: experiment(name) for name in NAMES}

_TABLES: dict[str, Any] = {
    name: (one.settings, Field(default_factory=one.settings)) for name, one in EXPERIMENTS.items()
}
#: What a bench file holds: the bench, and for each experiment a table of its name.
Configuration: type[BenchConfig] = create_model("Configuration", __base__=BenchConfig, **_TABLES)


def tables_to_write() -> tuple[SettingsTable, ...]:
    """Return the experiments' tables as they stand in a new bench file: the defaults, with what they mean."""
    return tuple(
        SettingsTable(name, one.about, tuple(_settings_to_write(one.settings))) for name, one in EXPERIMENTS.items()
    )


def _settings_to_write(settings: type[ExperimentSettings]) -> Iterator[Setting]:
    """Yield an experiment's settings, its own before those of its bases, the nearest first."""
    names = dict.fromkeys(name for one in settings.__mro__ for name in inspect.get_annotations(one))
    for name in (name for name in names if name in settings.model_fields):
        field = settings.model_fields[name]
        default = field.get_default(call_default_factory=True)
        example = field.examples[0] if default is None and field.examples else default
        yield Setting(name, example, field.description or "", is_set=default is not None)


def settings_of(config: BenchConfig, experiment: str) -> Any:
    """Return the settings of an experiment in a `Configuration`."""
    return getattr(config, experiment)


def with_settings(config: BenchConfig, experiment: str, settings: ExperimentSettings) -> BenchConfig:
    """Return a `Configuration` with other settings of an experiment."""
    return config.model_copy(update={experiment: settings})


def counter_settings(config: BenchConfig) -> CounterSettings:
    """Return the counter settings of the first experiment that counts pulses of light."""
    tables = (settings_of(config, name) for name in EXPERIMENTS)
    return next((table for table in tables if isinstance(table, CounterSettings)), CounterSettings())
