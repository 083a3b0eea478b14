"""Inputs of a report that are no measurement, such as simulated motions and sweeps: a row for each kind.

What simulates is imported where one of them was found: a report of measurements needs no compiled kernels.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from levilab.errors import DataError
from levilab.files import parse_json
from levilab.present.document.blocks import Section
from levilab.report.tables.values import Values
from levilab.runs.find import find_runs
from levilab.runs.run import Run, read_record
from levilab.stability.report import stability_section

#: Of more inputs of a kind the report is an overview.
MOST_IN_FULL = 12
#: Marks of a run folder, a store and a file, as `motion.simulation`, `sweeps.store` and `stability.table` write them.
MOTION, SWEEP, STABILITY = "simulate", "levilab-sweep/1", "levilab-stability/1"


@dataclass(frozen=True)
class Kind:
    """A kind of input.

    Attributes:
        name: of one, such as "simulation"; the plural has an s.
        find: the inputs of this kind at or below a path, by name; none where there are none.
        sections: what the report says of the inputs found, one section each; raises DataError.
        when: an input ended, or was begun, as a time of ISO 8601; None where that is not known.
        tables: the values of the inputs found, for files beside the report.
        experiment: of runs that are of this kind, which the analyses pass over; empty where they are no runs.
    """

    name: str
    find: Callable[[Path], Sequence[Path]]
    sections: Callable[[Sequence[Path]], tuple[Section, ...]]
    when: Callable[[Path], str | None] = lambda _: None
    tables: Callable[[Sequence[Path]], tuple[Values, ...]] = lambda _: ()
    experiment: str = ""


# --- simulated motions ---------------------------------------------------------------------------------


def _motions(path: Path) -> list[Path]:
    """Run folders of simulated motions; a folder whose record is damaged is for the analyses to warn of."""
    return [folder for folder in find_runs(path) if _holds_motion(folder)] if path.is_dir() else []


def _holds_motion(folder: Path) -> bool:
    try:
        return read_record(folder).experiment == MOTION
    except DataError:
        return False


def _motion_sections(folders: Sequence[Path]) -> tuple[Section, ...]:
    from levilab.motion.report import motion_section, motions_overview

    runs = [Run.load(folder) for folder in folders]
    return (motions_overview(runs),) if len(runs) > MOST_IN_FULL else tuple(map(motion_section, runs))


def _motion_ended(folder: Path) -> str | None:
    record = read_record(folder)
    return record.ended_utc or record.started_utc


def _motion_tables(folders: Sequence[Path]) -> tuple[Values, ...]:
    from levilab.motion.report import motion_values

    heads, rows = motion_values([Run.load(folder) for folder in folders])
    return (Values("motions", "simulated motions: a row for each", heads, rows),)


# --- sweeps --------------------------------------------------------------------------------------------


def _stores(path: Path) -> list[Path]:
    """Return stores at or below a path; nothing inside of one is looked at.  A folder NAME.zarr is named for one."""
    if path.is_dir() and (path.suffix == ".zarr" or _is_store(path)):
        return [path]
    found: list[str] = []
    for folder, below, _ in os.walk(path):
        stores = [name for name in below if _is_store(Path(folder, name))]
        found += [str(Path(folder, name)) for name in stores]
        below[:] = [name for name in below if name not in stores]
    return [Path(name) for name in sorted(found)]


def _is_store(folder: Path) -> bool:
    described = _json_in(folder / "zarr.json")
    attributes = described.get("attributes")
    return isinstance(attributes, dict) and attributes.get("schema") == SWEEP


def _sweep_sections(stores: Sequence[Path]) -> tuple[Section, ...]:
    from levilab.sweeps.report import sweep_section

    return tuple(map(sweep_section, stores))


def _sweep_begun(store: Path) -> str | None:
    attributes = _json_in(store / "zarr.json").get("attributes")
    return str(attributes.get("created_utc")) if isinstance(attributes, dict) else None


def _sweep_tables(stores: Sequence[Path]) -> tuple[Values, ...]:
    from levilab.sweeps.report import sweep_values

    tables = ((store, sweep_values(store)) for store in stores)
    return tuple(
        Values(f"sweep-{store.stem}", f"the sweep {store.name}: a row for each point that is computed", *table)
        for store, table in tables
        if table
    )


# --- where a top floats --------------------------------------------------------------------------------


def _stability_files(path: Path) -> list[Path]:
    return [path] if path.suffix == ".json" and _json_in(path).get("schema") == STABILITY else []


def _json_in(file: Path) -> dict[str, Any]:
    """Return the table in a file of JSON; an empty one where there is none."""
    try:
        found = parse_json(file.read_text(encoding="utf-8")) if file.is_file() else None
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


KINDS: tuple[Kind, ...] = (
    Kind("simulated motion", _motions, _motion_sections, _motion_ended, _motion_tables, experiment=MOTION),
    Kind("sweep", _stores, _sweep_sections, _sweep_begun, _sweep_tables),
    Kind("result of stability", _stability_files, lambda files: tuple(map(stability_section, files))),
)
