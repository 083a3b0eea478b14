"""crosscheck.json beside a result: written by `levilab crosscheck --like`, read by a report."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, ValidationError

from levilab.crosscheck.own.study import OwnCheck
from levilab.crosscheck.study import Spread
from levilab.errors import DataError
from levilab.files import parse_json, replace_atomically, writing
from levilab.pipelines.dump import Dump
from levilab.pipelines.result import Part
from levilab.settings import in_one_line

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from levilab.pipelines.result import Place

NAME = "crosscheck.json"
SCHEMA: Literal["levilab-crosscheck-own/1"] = "levilab-crosscheck-own/1"


#: The checks in the file; what follows from the pulls of a quantity stands with them.
Checks = Annotated[tuple[OwnCheck, ...], Dump({Spread: ("n", "mean", "deviation", "coverage")}, pairs=False)]


class FilePart(Part):
    """The file."""

    schema_: Literal["levilab-crosscheck-own/1"] = Field(default=SCHEMA, alias="schema")
    checks: Checks


def file_of(place: Place) -> Path:
    """Return the file with the trials of a result."""
    return place.folder / (f"{place.name}.{NAME}" if place.name else NAME)


def as_text(found: Sequence[OwnCheck]) -> str:
    """Return the trials as they stand in the file."""
    content = FilePart(schema=SCHEMA, checks=tuple(found)).model_dump(mode="json", by_alias=True)
    return json.dumps(content, indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False)


def store(found: Sequence[OwnCheck], place: Place) -> Path:
    """Write the trials of a result, in the place of earlier ones of the same analyses.  Raises CannotWrite."""
    file = file_of(place)
    named = {one.analysis for one in found}
    others = [one for one in _checks(file, tolerant=True) if one.analysis not in named]
    with writing(f"{file}: the cross-check cannot be written"):
        replace_atomically(file, as_text([*others, *found]) + "\n")
    return file


def read_own(place: Place, analysis: str, inputs: Sequence[str], settings: dict[str, Any]) -> OwnCheck | None:
    """Read the trials of just this result, if they were made.  Raises DataError where the file is damaged."""
    for one in _checks(file_of(place)):
        if one.analysis == analysis and one.inputs == tuple(inputs) and one.settings == settings:
            return one
    return None


def _checks(file: Path, *, tolerant: bool = False) -> tuple[OwnCheck, ...]:
    """Read the trials in a file; none where there is no file, or one of another kind."""
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
