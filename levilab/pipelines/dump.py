"""A frozen dataclass as an entry of a JSON file, and back: the dataclass itself is the schema."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache, partial
from types import UnionType
from typing import TYPE_CHECKING, Any, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
from pydantic_core import core_schema

from levilab.files import finite

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler


@dataclass(frozen=True)
class Dump:
    """Annotation of a field of a pydantic model whose type is a frozen dataclass, or holds some.

    The file has the attributes by their names.  An array is a list, with null for NaN; a mapping is a list of pairs,
    because files sort their keys and the order of parameters counts.  An unknown attribute is one of a newer version,
    and ignored; a missing one takes its default.

    Attributes:
        extra: class → properties that are written for people, and not read.
        pairs: whether the order of mappings counts; a mapping is a table where it does not.

    >>> from pydantic import BaseModel
    >>> from typing import Annotated
    >>> from analysis.uncertainty import Estimate
    >>> class Entry(BaseModel):
    ...     found: Annotated[dict[str, Estimate], Dump()]
    >>> entry = Entry(found={"c2": Estimate(2.0, None, "1/rad"), "c1": Estimate(1.0, 0.5, "1/s")})
    >>> Entry.model_validate_json(entry.model_dump_json()).found == entry.found
    True
    """

    extra: Mapping[type, tuple[str, ...]] = field(default_factory=dict)
    pairs: bool = True

    def __get_pydantic_core_schema__(self, kind: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """Return the schema of the type, for JSON before and behind it."""
        return core_schema.no_info_before_validator_function(
            partial(_from_json, kind),
            handler(kind),
            serialization=core_schema.plain_serializer_function_ser_schema(self._as_json),
        )

    def _as_json(self, value: Any) -> Any:
        if is_dataclass(value):
            names = (*(one.name for one in fields(value)), *self.extra.get(type(value), ()))
            return {name: self._as_json(getattr(value, name)) for name in names}
        if isinstance(value, Mapping):
            items = {name: self._as_json(one) for name, one in value.items()}
            return list(map(list, items.items())) if self.pairs else items
        if isinstance(value, list | tuple):
            return [self._as_json(one) for one in value]
        return finite(value.tolist() if isinstance(value, np.ndarray | np.generic) else value)


def _from_json(kind: Any, data: Any) -> Any:
    """Put arrays and mappings in the place of lists where a type has them; what is damaged stays as it is."""
    origin, of = get_origin(kind) or kind, get_args(kind)
    if origin in (Union, UnionType):
        return data if data is None else _from_json(next(one for one in of if one is not type(None)), data)
    if origin is float and data is None:
        return math.nan
    if isinstance(data, dict) and is_dataclass(origin):
        hints = _types(cast("type", origin))
        return {name: _from_json(hints.get(name), one) for name, one in data.items()}
    return _from_list(origin, of, data) if isinstance(data, list) and isinstance(origin, type) else data


def _from_list(kind: type, of: tuple[Any, ...], data: list[Any]) -> Any:
    """Return a list as an array or a mapping where the type is one; else its items converted."""
    if kind is np.ndarray:
        return _array(data)
    if issubclass(kind, Mapping):
        pairs = all(isinstance(one, list) and len(one) == 2 and isinstance(one[0], str) for one in data)
        return {name: _from_json(of[1], one) for name, one in data} if pairs else data
    kinds = of if kind is tuple and of[-1:] != (...,) else of[:1] * len(data)
    return [_from_json(*pair) for pair in zip(kinds, data, strict=True)] if len(kinds) == len(data) else data


@cache
def _types(kind: type) -> dict[str, Any]:
    """Return the types of the attributes of a class."""
    return get_type_hints(kind)


def _array(numbers: list[Any]) -> Any:
    """Return an array of numbers, or the list itself where there is none."""
    try:
        return np.array(numbers, dtype=np.float64)
    except (TypeError, ValueError):
        return numbers
