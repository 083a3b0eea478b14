"""Export of what scripts and notebooks have: runs, results, maps, paths."""

import sys
from os import PathLike
from pathlib import Path
from typing import Any

from levilab.errors import UsageError, unquote
from levilab.notebook.analysis import analyze_data
from levilab.notebook.motion import SimulatedMotion
from levilab.notebook.result import AnalysisResult
from levilab.notebook.sweep import SimulatedMap
from levilab.report.export.contents import Contents, contents_of, contents_of_results
from levilab.report.export.write import export
from levilab.runs.run import Run


def export_data(data: Any, output: str | PathLike[str], **options: Any) -> list[Path]:
    """Write data for other programs; see `levilab.export`."""
    if isinstance(data, AnalysisResult) and Path(output).suffix == ".json":
        raise UsageError("output", "to_json(path) of a result writes it, save(folder) with its figure", value=output)
    return export(lambda: _contents(data), Path(output), **options)


def _contents(data: Any) -> Contents:
    """Return what is exported.  Raises UsageError, DataError."""
    if isinstance(data, AnalysisResult):
        return contents_of_results(data.found.sources[0].path, None, [(data.analysis, data.found)])
    if isinstance(data, list | tuple):
        results = [one for one in data if isinstance(one, AnalysisResult)]
        if not results:
            return _contents(analyze_data(data, None, {}))
        if len({one.kind for one in results}) == len(data):
            found = [(one.analysis, one.found) for one in results]
            return contents_of_results(results[0].found.sources[0].path, None, found)
    if isinstance(data, SimulatedMotion):
        return data.contents
    if isinstance(data, SimulatedMap):
        return contents_of(data.store)
    try:
        path = data.folder if isinstance(data, Run) else Path(data)
    except TypeError:
        expected = "a run, a result, a motion, a map, a path, a list of runs or of results of unlike kinds is expected"
        raise UsageError("data", f"{expected}: export(analyze([…]), …)", value=type(data).__name__) from None
    return contents_of([path], lambda text: print(unquote(text), file=sys.stderr))  # noqa: T201 - as warnings are
