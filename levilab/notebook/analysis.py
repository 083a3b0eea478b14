"""From runs, files and DataFrames to the one analysis that is made for them, and its result."""

import shutil
import tempfile
import warnings
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from glob import glob
from os import PathLike
from pathlib import Path
from types import ModuleType
from typing import Any

from levilab.errors import DataError, DoesNotSuit, DoubtWarning, LevilabError, UsageError, list_known, unquote
from levilab.notebook.frame import (
    FRAME,
    are_arrays,
    frame_of,
    has_numbers_for_titles,
    in_rows,
    is_frame,
    kind_of,
    write_frame,
)
from levilab.notebook.result import AnalysisResult
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.document import Analysis, refuse_columns_of_runs
from levilab.pipelines.inputs.unread import Skipped
from levilab.pipelines.options import read_options
from levilab.pipelines.suits import Suiting, suiting
from levilab.present.numbers import list_in_words
from levilab.runs.find import find_run
from levilab.runs.run import Run
from levilab.texts.note import reword


def analyze_data(data: Any, kind: Any, given: Mapping[str, Any], u: Any = None) -> AnalysisResult:
    """Analyze data by one analysis; what makes the numbers doubtful is a warning of Python, too.

    Args:
        data: a run, a path, a DataFrame, or several of them; or arrays, see `frame_of_arrays`; or a dictionary of
            columns.
        kind: of the analysis; None for the one that is made for the data; or the second of two arrays.
        given: options by their names; None, or what an analysis has by itself, is not given.
        u: third of three arrays.

    Raises:
        UsageError: an option or `kind` is wrong, or the data suit several analyses equally.
        DataError: the data suit none, or cannot be used.
    """
    result = _analyze_any(data, kind, given, u)
    for text in result.found.doubts:
        warnings.warn(unquote(text), DoubtWarning, stacklevel=_CALLER)
    return result


#: Frames from a warning to the line of a person: it, the function of the front door, and `bare`.
_CALLER = 4


def _analyze_any(data: Any, kind: Any, given: Mapping[str, Any], u: Any) -> AnalysisResult:
    data, kind = _join_arrays(data, kind, u)
    _check_kind(kind)
    options = read_options(given)
    if data is None or (isinstance(data, tuple) and any(item is None for item in data)):
        raise UsageError("data", "data, or `time` and `frequency` together, are expected", value="nothing")
    called = _name_type(data)
    data = frame_of(data, kind)
    kind = kind_of(data, kind)
    items: list[Any] = [data] if _is_one(data) else [frame_of(item, kind) for item in data]
    items = [path for item in items for path in _expand(item)]
    if kind and all(isinstance(item, Run) for item in items):  # as of a folder
        items = [run for run in items if ANALYSES[kind].take(run)] or items
    if not items:
        raise UsageError("data", "a run, a path or a DataFrame is expected", value="nothing")
    frames = [item for item in items if is_frame(item)]
    if not frames:
        return _analyze_paths([_path(item) for item in items], kind, options)
    folder = Path(tempfile.mkdtemp(prefix="levilab-"))
    in_words = partial(in_rows, folder=folder, titles=0 if any(map(has_numbers_for_titles, frames)) else 1)
    try:
        paths = [_path(item, folder, str(k) * (len(items) > 1)) for k, item in enumerate(items, 1)]
        result = _analyze_paths(paths, kind, options)
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, LevilabError):
            error.args = (in_words(str(error)),)
        raise
    result = _of_frames(result, folder, called if len(items) == 1 else FRAME, in_words)
    weakref.finalize(result, shutil.rmtree, folder, ignore_errors=True)  # a long record is read when it is drawn
    return result


def _join_arrays(data: Any, kind: Any, u: Any) -> tuple[Any, Any]:
    """Return data and kind where arrays were given one by one, analyze(t, f, u).  Raises UsageError."""
    if kind is not None and not isinstance(kind, str) and are_arrays(kind):  # analyze(t, f)
        data, kind = (data, kind), None
    if u is not None:
        if not (isinstance(data, tuple) and len(data) == 2):
            expected = "two arrays beside it, analyze(t, f, u), are expected; of files `reading_u` [Hz] is that of all"
            raise UsageError("u", expected, value=u)
        data = (*data, u)
    return data, kind


def _analyze_paths(paths: Sequence[Path], kind: str | None, options: Mapping[str, Any]) -> AnalysisResult:
    """Analyze paths by a kind of analysis, or by the one that suits them all."""
    if kind:
        analysis = ANALYSES[kind]
        _refuse_foreign(analysis, options)
        return AnalysisResult(analysis, analysis.analyze(paths, analysis.options_from(options)))
    one = _only_suiting(paths, options)
    _refuse_foreign(one.analysis, options)
    chosen = one.analysis.options_from(options)
    refuse_columns_of_runs(one.found, chosen)
    return AnalysisResult(one.analysis, one.analysis.analyze_found(one.paths, one.found, chosen))


def _of_frames(result: AnalysisResult, folder: Path, called: str, in_words: Callable[[str], str]) -> AnalysisResult:
    """Return a result in the words of a caller who gave no files.

    Args:
        result: of files some of which stand for data.
        folder: of these.
        called: the type of the data; of several, a number follows.
        in_words: from a message about the files to one about the data.
    """
    sources, copies = [], []
    for source in result.found.sources:
        own = replace(source, warnings=tuple(reword(text, in_words(text)) for text in source.warnings))
        if source.path.parent == folder:
            copies.append(source.path)
            own = replace(own, name=f"{called} {source.path.stem.removeprefix(FRAME)}".strip())
        sources.append(own)
    warnings = tuple(reword(text, in_words(text)) for text in result.found.warnings)
    skipped = tuple(
        replace(one, reason=in_words(one.reason)) if isinstance(one, Skipped) else one for one in result.found.skipped
    )
    found = replace(result.found, sources=tuple(sources), warnings=warnings, skipped=skipped)
    return AnalysisResult(result.analysis, found, tuple(copies))


def _check_kind(kind: object) -> None:
    if not (kind is None or isinstance(kind, str)):
        expected = "two lists go into one pair, analyze(([…], […])), or by name, analyze(time=[…], frequency=[…])"
        raise UsageError("kind", f"the name of an analysis is expected; {expected}", value=kind)
    if kind is not None and kind not in ANALYSES:
        raise UsageError("kind", list_known(kind, ANALYSES), value=kind)


def _is_one(data: object) -> bool:
    if isinstance(data, AnalysisResult) or hasattr(data, "read"):
        seen, instead = (
            ("a result", "what it was made of") if isinstance(data, AnalysisResult) else ("an open file", "its path")
        )
        raise UsageError("data", f"a run, a path, a DataFrame or arrays are expected: give {instead}", value=seen)
    return isinstance(data, str | PathLike | Run) or not hasattr(data, "__iter__") or is_frame(data)


def _expand(item: Any) -> list[Any]:
    """Return the paths that a pattern such as "runs/*-spin-*" stands for, and all else as it is.  Raises DataError."""
    if not isinstance(item, str) or not set(item) & set("*?[") or Path(item).exists():
        return [item]
    found = sorted(glob(item, recursive=True))  # noqa: PTH207 - of a whole path, which may begin anywhere
    if not found:
        raise DataError(f"{item}: no file or folder in {Path.cwd()} has such a name")
    return found


def _path(item: Any, folder: Path = Path(), number: str = "") -> Path:
    """Return the path of the data; a DataFrame is written into the folder."""
    if isinstance(item, Run):
        return item.folder
    if isinstance(item, str | PathLike):
        return find_run(Path(item))
    if is_frame(item):
        file = folder / f"{FRAME}{number}.csv"
        write_frame(item, file)
        return file
    raise UsageError("data", "a run, a path, a DataFrame or several of them are expected", value=_name_type(item))


def _name_type(item: object) -> str:
    if isinstance(item, ModuleType):
        return f"the module {item.__name__}"
    return "arrays" if are_arrays(item) else type(item).__name__


# --- options -------------------------------------------------------------------------------------------


def _refuse_foreign(analysis: Analysis[Any], options: Mapping[str, Any]) -> None:
    """Raise UsageError for an option of another analysis that was set."""
    for name, value in options.items():
        default = {one.name: one.default for one in fields(analysis.options)}
        if name in default:
            continue
        others = [
            one.name
            for one in ANALYSES.values()
            if any(field.name == name and field.default != value for field in fields(one.options))
        ]
        if others:
            raise UsageError(name, f"is no option of {analysis.name}, but of {' and '.join(others)}: leave it out")


# --- the analysis that suits data ---------------------------------------------------------------------


def _only_suiting(paths: Sequence[Path], options: Mapping[str, Any]) -> Suiting:
    """Return the one analysis that suits the inputs at all of the paths.

    Raises:
        UsageError: there are several.
        DataError: there is none, or the data cannot be used.
    """
    taken = suiting(paths, options)
    of_all = [one for one in taken if len(one.paths) == len(paths)]
    if len(of_all) == 1:
        return of_all[0]
    names = [one.analysis.name for one in of_all]
    if names:
        instead = ", or name a single run" if paths[0].is_dir() else ""
        raise UsageError("kind", f"{paths[0]} suits {', '.join(names)}: say which, as kind={names[0]!r}{instead}")
    together: dict[str, list[str]] = {}
    for path in paths:
        together.setdefault(" and ".join(one.analysis.name for one in taken if path in one.paths), []).append(path.name)
    seen = [f"{names}: {list_in_words(inputs)}" for names, inputs in together.items()]
    raise DoesNotSuit(f"no analysis takes all of these together ({'; '.join(seen)}): analyze each kind by itself")
