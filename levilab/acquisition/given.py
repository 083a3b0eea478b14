"""Settings of an experiment that are given as texts: which there are, and the values that they take.

Nothing heavy is imported here, and of the experiments that one alone: a wrong setting is refused at once.
"""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from functools import partial
from typing import Any

from pydantic import ValidationError

from levilab.acquisition import experiments
from levilab.acquisition.experiment import ExperimentSettings
from levilab.bench.config import Limits
from levilab.errors import UsageError
from levilab.formats.typed import read_masses, read_temperature
from levilab.present.units import split
from levilab.settings import hint_about, own_words
from levilab.simulator.keys import SceneError, parse_setting
from levilab.texts.text import Sentences, Text, either, text_of, verbatim

_TYPES = {"number": "a number", "integer": "a whole number", "string": "a text", "boolean": "true or false"}
#: Lists as they are typed, by the type of what stands in them.
_LISTS = {"integer": "[1, 3]", "number": "[44.0, 38.0]", "string": '["tape", "laser"]'}


def read_conditions(temperature: str | None, washers: str | None) -> tuple[float | None, tuple[float, ...] | None]:
    """Return temperature [°C] and masses of washers [kg] that were typed; None: not given.  Raises UsageError."""
    found: list[Any] = []
    of_washers = partial(read_masses, key="washer_mass_kg")
    for name, text, read in (("temperature", temperature, read_temperature), ("washers", washers, of_washers)):
        try:
            found.append(None if text is None else read(text))
        except ValueError as error:
            raise UsageError(name, text_of(error), value=text or None) from error
    return found[0], found[1]


def settings_without_bench(experiment: str) -> ExperimentSettings:
    """Return the settings of an experiment where no bench file says others; its module alone is imported."""
    settings: ExperimentSettings = experiments.experiment(experiment).settings()
    return settings


def with_given_settings(
    now: ExperimentSettings, experiment: str, given: Sequence[str], limits: Limits | None = None
) -> ExperimentSettings:
    """Return settings of an experiment some of which are changed.

    Args:
        now: the others.
        experiment: its name.
        given: as "limit.which=upper".
        limits: of the bench, which messages name.

    Raises:
        UsageError: a setting is not there, or takes other values.
    """
    texts = dict(_key_and_text(now, experiment, setting) for setting in given)
    if not texts:
        return now
    try:
        values = {name: parse_setting(f"{name}={text}")[1] for name, text in texts.items()}
    except SceneError as error:
        fault = Text("{experiment:s}.{fault}", experiment=experiment, fault=error)
        raise UsageError("settings", _with_where(fault, experiment)) from None
    table = now.model_dump(mode="json", exclude_unset=True)  # defaults may still be suited to a scene
    try:
        return type(now).model_validate(table | values)
    except ValidationError as error:
        raise _refusal(error, texts, now, limits or Limits(), experiment) from error


def _key_and_text(now: ExperimentSettings, experiment: str, setting: str) -> tuple[str, str]:
    """Split "limit.which=upper" into which and upper; a key without its table is one of the experiment's.

    Raises UsageError for another form or an unknown key.
    """
    key, equals, text = setting.partition("=")
    name, dot, field = key.strip().rpartition(".")
    if equals and (not field or (field == experiment and not dot)) and name in {"", experiment}:
        raise _wrong_form(experiment, setting, "the key is missing: ")
    name = name if dot else experiment
    if not equals or name not in experiments.NAMES:
        raise _wrong_form(experiment, setting)
    if name != experiment:
        expected = Text(
            "is a setting of levilab acquire {name:s}, this is levilab acquire {experiment:s}",
            name=name, experiment=experiment,
        )  # fmt: skip
        raise UsageError("settings", expected, value=setting)
    _refuse_unknown(now, experiment, field)
    return field, text


def _wrong_form(experiment: str, setting: str, why: str = "") -> UsageError:
    what = Text(
        "{why}{experiment:s}.KEY=VALUE is expected; levilab acquire {experiment:s} --settings lists all",
        why=why, experiment=experiment,
    )  # fmt: skip
    return UsageError("settings", what, value=setting)


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
    said = either([_describe_schema(one) for one in kinds])
    return Text("{values} [{unit:s}]", values=said, unit=unit.text) if unit else said


def _describe_schema(schema: Mapping[str, Any]) -> str:
    if "enum" in schema:
        return either([verbatim(str(one)) for one in schema["enum"]])
    if schema.get("type") == "array":
        each = _describe_schema(schema["items"])
        example = _LISTS.get(schema["items"].get("type"), "[…]")
        return Text("a list as {example:s}, each {each}", example=example, each=each)
    words = [_TYPES.get(schema.get("type", ""), "a value")]
    low, high = schema.get("minimum"), schema.get("maximum")
    if low is not None:
        words.append(Text("from {low:g}" if high is not None else "from {low:g} on", low=low))
    elif "exclusiveMinimum" in schema:
        words.append(Text("above {low:g}", low=schema["exclusiveMinimum"]))
    if high is not None:
        words.append(Text("to {high:g}" if low is not None else "up to {high:g}", high=high))
    return Sentences(*words) if words[1:] else words[0]


def _refuse_unknown(now: ExperimentSettings, experiment: str, name: str) -> None:
    """Raise UsageError for a name that is no setting of an experiment."""
    known = type(now).model_fields
    if name in known:
        return
    near = [f"{experiment}.{one}" for one in get_close_matches(name, known, cutoff=0.5)]
    meant = Text(", did you mean {names}?", names=either(near)) if near else ";"
    said = Text("there is no such setting{meant} {where}", meant=meant, where=_where(experiment))
    raise UsageError("settings", said, value=f"{experiment}.{name}")


def _refusal(
    error: ValidationError, given: Mapping[str, str], now: ExperimentSettings, limits: Limits, experiment: str
) -> UsageError:
    """Return the faults of settings that were given as texts by their names."""
    first = error.errors()[0]
    name = str(first["loc"][0]) if first["loc"] else ""
    text = own_words(first)
    if name not in given:
        return UsageError("settings", "{name:s}: {fault}", experiment, text or first["msg"])
    values = describe_values(name, schema_of(now, limits)[name])
    what = text or Text("{values} is expected{hint}", values=values, hint=hint_about(given[name]))
    return UsageError("settings", _with_where(what, experiment), value=f"{experiment}.{name}={given[name]}")


def _with_where(what: str, experiment: str) -> Text:
    return Text("{what}; {where}", what=what, where=_where(experiment))


def _where(experiment: str) -> Text:
    return Text("levilab acquire {experiment:s} --settings lists all", experiment=experiment)


def schema_of(now: ExperimentSettings, limits: Limits) -> dict[str, Any]:
    """Return the values that an experiment's settings take, by name: as declared, and as the bench allows."""
    schema: dict[str, Any] = type(now).model_json_schema()["properties"]
    allowed = {name: {"maximum": limit} for name, limit in limits.model_dump().items()}
    return {name: one | allowed.get(name, {}) for name, one in schema.items()}
