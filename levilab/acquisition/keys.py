"""The keys of an experiment's settings: the allowed values as text, for lists and for messages."""

from __future__ import annotations

import json
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from levilab.acquisition.table import settings_of, tables_to_write
from levilab.errors import UsageError
from levilab.present.tables import Table, table
from levilab.present.units import split
from levilab.settings import hint_about

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import ValidationError

    from levilab.bench.config import BenchConfig

_TYPES = {"number": "a number", "integer": "a whole number", "string": "a text", "boolean": "true or false"}
#: Lists as they are typed, by the type of what stands in them.
_LISTS = {"integer": "[1, 3]", "number": "[44.0, 38.0]", "string": '["tape", "laser"]'}


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
    values = settings_of(config, experiment).model_dump(mode="json")
    schema = _schema(config, experiment)
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


def describe_values(name: str, schema: Mapping[str, Any]) -> str:
    """Return the values that a key takes, with their unit.

    Args:
        name: of the key, which ends with its unit.
        schema: of the key, as JSON Schema describes it.

    >>> describe_values("gate_s", {"exclusiveMinimum": 0, "type": "number"})
    'a number above 0 [s]'
    >>> describe_values("which", {"enum": ["lower", "upper"], "type": "string"})
    'lower or upper'
    """
    _, unit = split(name)
    kinds = [schema | one for one in schema.get("anyOf", [{}]) if one.get("type") != "null"]
    return " or ".join(_describe_schema(one) for one in kinds) + (f" [{unit.text}]" if unit else "")


def _describe_schema(schema: Mapping[str, Any]) -> str:
    if "enum" in schema:
        *some, last = map(str, schema["enum"])
        return f"{', '.join(some)} or {last}" if some else last
    if schema.get("type") == "array":
        each = _describe_schema(schema["items"])
        return f"a list as {_LISTS.get(schema['items'].get('type'), '[…]')}, each {each}"
    words = [_TYPES.get(schema.get("type", ""), "a value")]
    low, high = schema.get("minimum"), schema.get("maximum")
    if low is not None:
        words.append(f"from {low:g}" if high is not None else f"from {low:g} on")
    elif "exclusiveMinimum" in schema:
        words.append(f"above {schema['exclusiveMinimum']:g}")
    if high is not None:
        words.append(f"to {high:g}" if low is not None else f"up to {high:g}")
    return " ".join(words)


def refuse_unknown(config: BenchConfig, experiment: str, name: str) -> None:
    """Raise UsageError for a name that is no setting of an experiment."""
    known = _schema(config, experiment)
    if name in known:
        return
    near = [f"{experiment}.{one}" for one in get_close_matches(name, known, cutoff=0.5)]
    meant = f", did you mean {' or '.join(near)}?" if near else ";"
    raise UsageError("settings", f"there is no such setting{meant} {_where(experiment)}", value=f"{experiment}.{name}")


def refusal(error: ValidationError, given: Mapping[str, str], config: BenchConfig, experiment: str) -> UsageError:
    """Return the faults of settings that were given as texts by their names."""
    first = error.errors()[0]
    name = str(first["loc"][1]) if len(first["loc"]) > 1 else ""
    own = first["type"] == "value_error" or not name  # the experiment's own words
    text = str(first.get("ctx", {}).get("error", first["msg"])) if own else ""
    if name not in given:
        return UsageError("settings", f"{experiment}: {text or first['msg']}")
    what = text or f"{allowed_values(config, experiment, name)} is expected{hint_about(given[name])}"
    return UsageError("settings", f"{what}; {_where(experiment)}", value=f"{experiment}.{name}={given[name]}")


def allowed_values(config: BenchConfig, experiment: str, name: str) -> str:
    """Return the values that a key of an experiment takes on this bench, with their unit."""
    return describe_values(name, _schema(config, experiment)[name])


def _where(experiment: str) -> str:
    return f"levilab acquire {experiment} --settings lists all"


def _schema(config: BenchConfig, experiment: str) -> dict[str, Any]:
    """Return the values that an experiment's settings take, by name: as declared, and as the bench allows."""
    schema: dict[str, Any] = type(settings_of(config, experiment)).model_json_schema()["properties"]
    allowed = {name: {"maximum": limit} for name, limit in config.limits.model_dump().items()}
    return {name: one | allowed.get(name, {}) for name, one in schema.items()}
