"""Frozen tables of settings, and what is wrong with one in a line."""

import difflib
import re
from typing import Any, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from levilab.texts.text import Text, text_of


class Settings(BaseModel):
    """A table of a configuration: frozen, and no key beside the ones named."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def in_one_line(error: ValidationError, of: type[BaseModel] | None = None) -> str:
    """Return the first fault, with its path and the allowed values, and the number of others.

    Args:
        error: of the table.
        of: what did not suit, so that an unknown key can be compared with those that it has.
    """
    # a key that is unknown may be why another one is missing
    first = min(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
    where = ".".join(str(part) for part in first["loc"]) or "the whole"
    more = Text(" (and {n} more)", n=error.error_count() - 1) if error.error_count() > 1 else ""
    if first["type"] == "extra_forbidden":
        known = _suggest_key(first["loc"], of)
        return Text("{key:s} is no key known here{known}{more}", key=where, known=known, more=more)
    named = ("",) if "_" not in where else ()  # a unit in a key stands behind _
    hint = "" if first["type"] == "literal_error" else hint_about(first["input"], *named)  # where words are expected
    whole_table = first["type"] == "missing" or isinstance(first["input"], dict)
    given = str(first["input"])[:60]
    seen = "" if whole_table else f" = {given if first['type'] == 'range' else repr(given)}"
    what = own_words(first) or explain_message(first["msg"])
    return Text("{key}{seen:s}: {what}{hint}{more}", key=where, seen=seen, what=what, hint=hint, more=more)


def own_words(fault: Any) -> str:
    """Return what a check of ours says of a fault of pydantic's; empty where it is none of ours."""
    about = fault.get("ctx", {})
    return about.get("problem") or (text_of(about["error"]) if "error" in about else "")


#: Beginning and end of pydantic's message about a wrong value, and its names of the expected kinds.
_SHOULD_BE = re.compile(r"Input should be (a valid )?(.*?)(, unable to .*|, got .*)?")
_LIMIT = re.compile(r"(greater than or equal to|greater than|less than or equal to|less than) (.+)")
WHOLE = {
    "Field required": "is missing",
    "Input should be an instance of ndarray": "numbers in lists of one length are expected",
}
KINDS = {
    "boolean": "true or false is expected", "integer": "a whole number is expected", "number": "a number is expected",
    "string": "a text is expected", **dict.fromkeys(("tuple", "array", "list"), "a list is expected"),
    "dictionary": "a table is expected",
}  # fmt: skip
LIMITS = {
    "greater than": "a number greater than {limit:n} is expected",
    "greater than or equal to": "a number greater than or equal to {limit:n} is expected",
    "less than": "a number less than {limit:n} is expected",
    "less than or equal to": "a number less than or equal to {limit:n} is expected",
}


def explain_message(text: str) -> str:
    """Translate pydantic's message about a wrong value.

    >>> explain_message("Input should be a valid number, unable to parse string as a number")
    'a number is expected'
    >>> explain_message("Input should be greater than 0"), explain_message("Input should be 'motion' or 'spin'")
    ('a number greater than 0 is expected', "'motion' or 'spin' is expected")
    >>> explain_message("Input should be a valid boolean, unable to interpret input"), explain_message("Field required")
    ('true or false is expected', 'is missing')
    """
    found = None if text in WHOLE else _SHOULD_BE.fullmatch(text)
    if not found:
        return WHOLE.get(text, text.removeprefix("Value error, "))
    what = found[2]
    if found[1]:
        return KINDS.get(what, f"a {what} is expected")
    if limit := _LIMIT.fullmatch(what):
        return Text(LIMITS[limit[1]], limit=limit[2])
    *some, what = re.split(", | or ", what)
    return Text("{some:s} or {what:s} is expected" if some else "{what} is expected", some=", ".join(some), what=what)


def _suggest_key(where: tuple[int | str, ...], of: type[BaseModel] | None) -> str:
    """Return a hint for an unknown key: the most similar one, or the known ones."""
    *tables, key = where
    for name in tables:
        field = of.model_fields.get(str(name)) if of else None
        of = next((kind for kind in _kinds(field.annotation) if issubclass(kind, BaseModel)), None) if field else None
    if of is None:
        return ""
    near = difflib.get_close_matches(str(key), of.model_fields, n=1)
    return Text(": did you mean {name:s}?" if near else ": known are {name:s}", name=", ".join(near or of.model_fields))


def _kinds(annotation: Any) -> list[type]:
    """Return the classes of an annotation such as ``Counter | None``."""
    return [kind for kind in (annotation, *get_args(annotation)) if isinstance(kind, type)]


#: Numbers as people write them and TOML does not, with what to say.
_NUMBERS = (
    (re.compile(r"\s*[+-]?\d+,\d+\s*"), "; write a decimal point, not a comma"),
    (
        re.compile(r"\s*[+-]?\d*\.?\d+(e[+-]?\d+)?\s*[A-Za-zµ°%][\w/²^*°]*\s*", re.IGNORECASE),
        "; write the number without its unit{unit}",
    ),
)


def hint_about(seen: object, unit: str = ", which is in the key's name") -> str:
    """Return the fault of a text that is nearly a number, as the rest of a sentence; empty for any other.

    Args:
        seen: what was given.
        unit: where the unit stands, as the rest of the sentence.
    """
    found = (text for pattern, text in _NUMBERS if isinstance(seen, str) and pattern.fullmatch(seen))
    return Text(next(found, ""), unit=unit)
