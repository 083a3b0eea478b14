"""Reports from scripts and notebooks."""

import sys
import tempfile
from collections.abc import Mapping
from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import Any

from levilab.errors import DataError, UsageError, check_ending, check_language
from levilab.notebook.motion import SimulatedMotion
from levilab.notebook.result import AnalysisResult
from levilab.notebook.sweep import SimulatedMap
from levilab.report.page import FORMATS, write_report
from levilab.runs.find import find_run
from levilab.runs.run import Run
from levilab.texts.text import speaking

Reported = Run | AnalysisResult | SimulatedMotion | SimulatedMap | str | PathLike[str]


def report_on(data: Any, output: str | PathLike[str], language: str, **how: Any) -> Path:
    """Write a report of runs, files, folders or results; see `levilab.report`.

    how: as `write_report` takes it.

    Raises:
        UsageError: an argument is wrong, or results were made with unlike options.
        DataError: there is nothing to report.
    """
    check_language(language)
    check_ending(output := Path(output), FORMATS)
    several = isinstance(data, list | tuple | set)
    items = [*data] if several else [data]
    if not items:
        raise DataError("there is nothing to report: a run, a result or a path is expected")
    given = dict[str, Any]()
    for item in items:
        for name, value in _options(item).items():
            if given.setdefault(name, value) != value:
                raise UsageError("data", f"results with unlike options ({name}) need a report each")
    with tempfile.TemporaryDirectory(prefix="levilab-") as made, speaking(language):
        paths = [path for item in items for path in _paths(item, Path(made))]
        folder = "" if output.parent.is_dir() else ", in a new folder"
        print(f"writing {output}{folder} …", file=sys.stderr)  # noqa: T201 - a cross-check takes seconds
        return write_report(paths, output, given, **how)


def _paths(item: Reported, made: Path) -> list[Path]:
    """Return the paths of an item; a motion without a folder is written into that of what is made for the report."""
    if isinstance(item, AnalysisResult):
        return [source.path for source in item.found.sources]
    if isinstance(item, Run):
        return [item.folder]
    if isinstance(item, SimulatedMotion):
        return [item.write(made)]
    if isinstance(item, SimulatedMap):
        if item.path is None:
            raise UsageError("data", "a report needs its store: sweep with out='map.zarr'", value=repr(item))
        return [item.path]
    if isinstance(item, str | PathLike):
        return [find_run(Path(item))]
    raise UsageError("data", "runs, results, motions, maps or paths are expected", value=type(item).__name__)


def _options(item: Reported) -> Mapping[str, Any]:
    """Return the options with which a result was made; those at their defaults count as not given."""
    if not isinstance(item, AnalysisResult):
        return {}
    options = item.found.options
    return {
        one.name: value for one in fields(options) if (value := getattr(options, one.name)) not in (None, one.default)
    }
