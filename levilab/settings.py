"""Frozen tables of settings, and what is wrong with one in a line."""

from __future__ import annotations

import re

from pydantic import (
    BaseModel,
    ConfigDict,
    ValidationError,
)


class Settings(BaseModel):
    """A table of a configuration: frozen, and no key beside the ones named."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def in_one_line(error: ValidationError) -> str:
    """The first thing that is wrong, with its path and what is allowed, and how many more there are."""
    # a key that is unknown may be why another one is missing
    first = min(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
    where = ".".join(str(part) for part in first["loc"]) or "the whole"
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    if first["type"] == "extra_forbidden":
        return f"{where} is no key known here{more}"
    hint = "" if first["type"] == "literal_error" else hint_about(first["input"])  # where words are expected
    whole_table = first["type"] == "missing" or isinstance(first["input"], dict)
    seen = "" if whole_table else f" = {str(first['input'])[:60]!r}"
    return f"{where}{seen}: {first['msg']}{hint}{more}"


#: Numbers as people write them and TOML does not, with what to say.
_NUMBERS = (
    (re.compile(r"\s*[+-]?\d+,\d+\s*"), "; write a decimal point, not a comma"),
    (
        re.compile(r"\s*[+-]?\d*\.?\d+(e[+-]?\d+)?\s*[A-Za-zµ°%][\w/²^*°]*\s*", re.IGNORECASE),
        "; write the number without its unit, which is in the key's name",
    ),
)


def hint_about(seen: object) -> str:
    """What is wrong with a text that was nearly a number, as the rest of a sentence; empty for any other."""
    found = (text for pattern, text in _NUMBERS if isinstance(seen, str) and pattern.fullmatch(seen))
    return next(found, "")
