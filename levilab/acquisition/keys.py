"""The keys of an experiment's settings, for lists."""

import json
from dataclasses import dataclass
from typing import Any

from levilab.acquisition.given import describe_values, schema_of
from levilab.acquisition.table import settings_of, tables_to_write
from levilab.bench.config import BenchConfig
from levilab.present.tables import Table, table


@dataclass(frozen=True)
class Key:
    """A setting.

    Attributes:
        name: without its table's.
        value: the present one.
        expected: what may stand there.
        meaning: of it.
    """

    name: str
    value: Any
    expected: str
    meaning: str


def keys_of(config: BenchConfig, experiment: str) -> tuple[Key, ...]:
    """Return the settings of an experiment, its own before those that it shares with others."""
    (listed,) = (one for one in tables_to_write() if one.name == experiment)
    now = settings_of(config, experiment)
    values, schema = now.model_dump(mode="json"), schema_of(now, config.limits)
    return tuple(
        Key(one.name, values[one.name], describe_values(one.name, schema[one.name]), one.comment)
        for one in listed.settings
    )


def keys_table(keys: tuple[Key, ...], experiment: str) -> Table:
    """Return a table for the terminal."""
    rows = [(one.name, _as_typed(one.value), one.expected, one.meaning) for one in keys]
    return table(f"levilab acquire {experiment} --set {experiment}.KEY=VALUE", ("KEY", "is", "may be", ""), rows)


def _as_typed(value: Any) -> str:
    return "–" if value is None else json.dumps(value) if isinstance(value, list) else str(value)
