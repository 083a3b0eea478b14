"""crosscheck.json: written by `levilab crosscheck`, beside a result by `--like`, and read by a report."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from levilab.crosscheck.study import Spread, Study
from levilab.errors import DataError
from levilab.files import as_json as to_json
from levilab.files import finite, parse_json, replace_atomically, writing
from levilab.pipelines.result import Place
from levilab.settings import in_one_line
from levilab.software import software_versions

NAME = "crosscheck.json"
SCHEMA = "levilab-crosscheck/1"
_STUDIES = TypeAdapter(tuple[Study, ...])


def document(studies: Sequence[Study]) -> dict[str, Any]:
    """Return all numbers, as JSON has them: each study as it is, with what follows from its pulls."""
    return {
        "schema": SCHEMA,
        "software": software_versions(),
        "checks": [
            finite(asdict(one) | {"holds": one.holds, "spreads": [_numbers(spread) for spread in one.spreads]})
            for one in studies
        ],
    }


def _numbers(spread: Spread) -> dict[str, Any]:
    names = ("n", "mean", "u_mean", "deviation", "wanted_deviation", "coverage", "wanted_coverage", "room")
    return asdict(spread) | {name: getattr(spread, name) for name in names} | {"verdict": spread.verdict.name.lower()}


def as_json(studies: Sequence[Study]) -> str:
    """Return the text of the file."""
    return to_json(document(studies))


def file_of(place: Place) -> Path:
    """Return where the trials of a result lie."""
    return place.folder / (f"{place.name}.{NAME}" if place.name else NAME)


def store(studies: Sequence[Study], place: Place) -> Path:
    """Write the trials of a result, in the place of earlier ones of the same analyses.  Raises CannotWrite."""
    file = file_of(place)
    named = {one.name for one in studies}
    others = [one for one in _studies(file, tolerant=True) if one.inputs and one.name not in named]
    with writing(f"{file}: the cross-check cannot be written"):
        replace_atomically(file, as_json([*others, *studies]) + "\n")
    return file


def read_study(place: Place, analysis: str, inputs: Sequence[str], settings: dict[str, Any]) -> Study | None:
    """Return the trials of just this result, if they were made.  Raises DataError where the file is damaged."""
    for study in _studies(file_of(place)):
        if study.name == analysis and study.inputs == tuple(inputs) and study.settings == settings:
            return study
    return None


def _studies(file: Path, *, tolerant: bool = False) -> tuple[Study, ...]:
    """Return the studies of a file; nothing where there is none, or one of another kind."""
    if not file.is_file():
        return ()
    try:
        data = parse_json(file.read_text(encoding="utf-8"))
        if not isinstance(data, dict) or data.get("schema") != SCHEMA:
            return ()
        return _STUDIES.validate_python(data.get("checks"))
    except ValidationError as error:
        problem = in_one_line(error)
    except (OSError, ValueError) as error:
        problem = str(error)
    if tolerant:
        return ()
    raise DataError(f"{file}: {problem}; make it again with levilab crosscheck --like, or move the file away")
