"""crosscheck.json beside a result: written by `levilab crosscheck --like`, read by a report."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, ValidationError

from levilab.crosscheck.own.study import OwnCheck
from levilab.crosscheck.study import Spread
from levilab.errors import DataError
from levilab.files import finite, parse_json, replace_atomically, writing
from levilab.pipelines.result import Part
from levilab.settings import in_one_line

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from levilab.pipelines.result import Place

NAME = "crosscheck.json"
SCHEMA: Literal["levilab-crosscheck-own/1"] = "levilab-crosscheck-own/1"


class QuantityPart(Part):
    """The pulls of a quantity."""

    name: str
    n: int = Field(ge=1)
    mean: float
    deviation: float | None
    coverage: float = Field(ge=0, le=1)
    relative_u: float | None
    pulls: tuple[float, ...]


class CheckPart(Part):
    """The trials of one analysis."""

    analysis: str
    inputs: tuple[str, ...]
    settings: dict[str, Any]
    about: str
    trials: int = Field(ge=1)
    seed: int
    quantities: tuple[QuantityPart, ...]
    law: str
    laws: dict[str, int]
    excluded: int = Field(ge=0)
    tested: int = Field(ge=0)
    hypothesis: str
    expected_share: float
    failures: dict[str, int]
    freedom: dict[str, int] = Field(default_factory=dict)
    more: tuple[str, ...]
    widened: float | None = Field(default=None, ge=1)


class FilePart(Part):
    """The file."""

    schema_: Literal["levilab-crosscheck-own/1"] = Field(default=SCHEMA, alias="schema")
    checks: tuple[CheckPart, ...]


def file_of(place: Place) -> Path:
    """Where the trials of a result lie."""
    return place.folder / (f"{place.name}.{NAME}" if place.name else NAME)


def as_part(found: OwnCheck) -> CheckPart:
    """The trials as they stand in the file."""
    quantities = [
        {
            "name": one.quantity,
            "n": one.n,
            "mean": one.mean,
            "deviation": None if math.isnan(one.deviation) else one.deviation,
            "coverage": one.coverage,
            "relative_u": None if math.isnan(one.relative_u) else one.relative_u,
            "pulls": one.pulls,
        }
        for one in found.spreads
    ]
    return CheckPart.model_validate(finite({**vars(found), "quantities": quantities}))


def restored(part: CheckPart) -> OwnCheck:
    """The trials from the file."""
    spreads = (
        Spread(one.name, one.pulls, math.nan if one.relative_u is None else one.relative_u) for one in part.quantities
    )
    fields = {name: getattr(part, name) for name in CheckPart.model_fields if name != "quantities"}
    return OwnCheck(**fields, spreads=tuple(spreads))


def store(found: Sequence[OwnCheck], place: Place) -> Path:
    """Write the trials of a result, in the place of earlier ones of the same analyses.  Raises CannotWrite."""
    file = file_of(place)
    named = {one.analysis for one in found}
    others = [one for one in _checks(file, tolerant=True) if one.analysis not in named]
    content = FilePart(schema=SCHEMA, checks=(*others, *map(as_part, found)))
    text = json.dumps(content.model_dump(mode="json", by_alias=True), indent=2, sort_keys=True, ensure_ascii=False)
    with writing(f"{file}: the cross-check cannot be written"):
        replace_atomically(file, text + "\n")
    return file


def read_own(place: Place, analysis: str, inputs: Sequence[str], settings: dict[str, Any]) -> OwnCheck | None:
    """The trials of just this result, if they were made.  Raises DataError where the file is damaged."""
    for part in _checks(file_of(place)):
        if part.analysis == analysis and part.inputs == tuple(inputs) and part.settings == settings:
            return restored(part)
    return None


def _checks(file: Path, *, tolerant: bool = False) -> tuple[CheckPart, ...]:
    """What a file holds; nothing where there is none, or one of another kind."""
    if not file.is_file():
        return ()
    try:
        data = parse_json(file.read_text(encoding="utf-8"))
        if not isinstance(data, dict) or data.get("schema") != SCHEMA:
            return ()
        return FilePart.model_validate(data).checks
    except ValidationError as error:
        problem = in_one_line(error)
    except (OSError, ValueError) as error:
        problem = str(error)
    if tolerant:
        return ()
    raise DataError(f"{file}: {problem}; make it anew with levilab crosscheck --like, or move the file away")
