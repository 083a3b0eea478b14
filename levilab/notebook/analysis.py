"""From runs, files and DataFrames to the one analysis that is made for them, and its result."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from contextlib import contextmanager, suppress
from dataclasses import fields, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from analysis.errors import AnalysisError
from levilab.errors import DataError, DoesNotSuit, LevilabError, UsageError
from levilab.notebook.frame import has_numbers_for_titles, in_rows, is_frame, write_frame
from levilab.notebook.result import AnalysisResult
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import OPTIONS, read_options, typed_name
from levilab.pipelines.sources import data_files
from levilab.runs.run import READINGS, RECORD, Run, find_run, find_runs

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    import pandas as pd

    from levilab.pipelines.catalogue import Analysis

    One: TypeAlias = "Run | str | PathLike[str] | pd.DataFrame"

#: Analyses that need columns which nothing else has: a file that one of them reads is made for it.
_PARTICULAR = ("field", "precession")
#: Options that messages name as the command line has them → names of the keywords, which have the unit.
_KEYWORDS = {typed_name(name): name for name in OPTIONS if typed_name(name) != name}
#: What DataFrames are called, in messages and beside saved results.
_FRAME = "DataFrame"


def analyze_data(data: One | Sequence[One], kind: str | None, given: Mapping[str, Any]) -> AnalysisResult:
    """The result of one analysis.

    Args:
        data: a run, a path, a DataFrame, or several of them.
        kind: of the analysis; None for the one that is made for the data.
        given: options by their names; None, or what an analysis has by itself, is not given.

    Raises:
        UsageError: an option or `kind` is wrong, or the data suit several analyses equally.
        DataError: the data suit none, or cannot be used.
    """
    options = read_options(given)
    items: list[Any] = [data] if _is_one(data) else list(data)  # type: ignore[arg-type]
    if not items:
        raise UsageError("data", "a run, a path or a DataFrame is expected", value="nothing")
    if kind is not None and kind not in ANALYSES:
        raise UsageError("kind", f"{', '.join(ANALYSES)} or None is expected", value=kind)
    frames = [item for item in items if is_frame(item)]
    if not frames:
        return _analyzed([_path(item) for item in items], kind, options, _in_keywords)
    folder = Path(tempfile.mkdtemp(prefix="levilab-"))
    in_words = partial(_in_rows, folder=folder, titles=0 if any(map(has_numbers_for_titles, frames)) else 1)
    try:
        paths = [_path(item, folder, str(k) * (len(items) > 1)) for k, item in enumerate(items, 1)]
        result = _analyzed(paths, kind, options, in_words, folder)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(result, shutil.rmtree, folder, ignore_errors=True)  # a long record is read when it is drawn
    return result


def _analyzed(
    paths: Sequence[Path],
    kind: str | None,
    options: Mapping[str, Any],
    in_words: Callable[[str], str],
    folder: Path | None = None,
) -> AnalysisResult:
    """in_words: a message as the caller reads it; folder: in which DataFrames were written."""
    with _errors(in_words):
        analysis = ANALYSES[kind] if kind else _made_for(paths, options)
        _refuse_foreign(analysis, options)
        found = analysis.analyze(paths, analysis.options_from(options))
    copies = tuple(path for path in paths if path.parent == folder)
    return AnalysisResult(analysis, _with_words(found, in_words), copies)


def _is_one(data: object) -> bool:
    return isinstance(data, str | PathLike | Run) or not hasattr(data, "__iter__") or is_frame(data)


def _path(item: Any, folder: Path = Path(), number: str = "") -> Path:
    """Where the data lie; a DataFrame is written into the folder."""
    if isinstance(item, Run):
        return item.folder
    if isinstance(item, str | PathLike):
        return find_run(Path(item))
    if is_frame(item):
        file = folder / f"{_FRAME}{number}.csv"
        write_frame(item, file)
        return file
    raise UsageError("data", "a run, a path, a DataFrame or several of them are expected", value=type(item).__name__)


# --- options -------------------------------------------------------------------------------------------


def _refuse_foreign(analysis: Analysis[Any], options: Mapping[str, Any]) -> None:
    """Raise UsageError for an option of another analysis that was set."""
    for name, value in options.items():
        default = {one.name: one.default for one in fields(analysis.result.method.options)}
        if name in default:
            continue
        others = [
            one.name
            for one in ANALYSES.values()
            if any(field.name == name and field.default != value for field in fields(one.result.method.options))
        ]
        if others:
            raise UsageError(name, f"is no option of {analysis.name}, but of {' and '.join(others)}: leave it out")


# --- the analysis that is made for data ----------------------------------------------------------------


def _made_for(paths: Sequence[Path], options: Mapping[str, Any]) -> Analysis[Any]:
    """The one analysis that is made for what lies at all of the paths.

    Raises:
        UsageError: there are several.
        DataError: there is none, or the data cannot be used.
    """
    of_each = [_suiting(path, options) for path in paths]
    names = [name for name in ANALYSES if all(name in suiting for suiting in of_each)]
    if len(names) == 1:
        return ANALYSES[names[0]]
    if names:
        instead = ", or name a single run" if paths[0].is_dir() else ""
        raise UsageError("kind", f"{paths[0]} suits {', '.join(names)}: say which, as kind={names[0]!r}{instead}")
    kinds = "; ".join(f"{path.name} suits {' and '.join(one)}" for path, one in zip(paths, of_each, strict=True))
    raise DoesNotSuit(f"no analysis takes all of these together ({kinds}): analyze them one after the other")


def _suiting(path: Path, options: Mapping[str, Any]) -> list[str]:
    """Names of the analyses that are made for what lies at a path.  Raises DataError where there is none."""
    if path.name == READINGS and (path.parent / RECORD).exists():
        with suppress(DataError):  # where its record is damaged, the readings can still be analyzed
            return _for_run(Run.load(path.parent))
    if path.is_dir():
        runs = [Run.load(path)] if (path / RECORD).exists() else list(_usable_runs(path))
        suiting = {name for run in runs for name in _for_run(run)}
        if len(runs) == 1 and not suiting:
            raise DoesNotSuit(f"{path}: there is no analysis of a {runs[0].record.experiment} run")
        if not runs:
            files = data_files(path)
            suiting = {name for file in files for name in _readers(file, options)[0]}
        if not suiting:
            raise DoesNotSuit(f"{path}: holds no run and no data file that can be analyzed: name one of them")
        return [name for name in ANALYSES if name in suiting]
    suiting_file, error = _readers(path, options)
    if error and not suiting_file:
        raise error
    return suiting_file


def _usable_runs(root: Path) -> Iterator[Run]:
    """The runs below a folder; a damaged one decides nothing."""
    for folder in find_runs(root):
        try:
            yield Run.load(folder)
        except DataError:
            continue


def _for_run(run: Run) -> list[str]:
    """The analyses for the run's experiment, else those that take it."""
    rows = ANALYSES.values()
    own = [row.name for row in rows if run.record.experiment in row.needs.experiments]
    return own or [row.name for row in rows if row.needs.take(run)]


def _readers(file: Path, options: Mapping[str, Any]) -> tuple[list[str], LevilabError | None]:
    """The analyses that read a file, and what is wrong with it where none does: damage before another kind."""
    names, damage, foreign = [], None, None
    for row in ANALYSES.values():
        try:
            row.needs.read_file(file, row.options_from(options))
            names.append(row.name)
        except DoesNotSuit as error:
            foreign = foreign or error
        except DataError as error:
            damage = damage or error
        except AnalysisError as error:
            damage = damage or DataError(f"{file}: {error}")
    particular = [name for name in names if name in _PARTICULAR]
    return particular or names, damage or foreign


# --- messages ------------------------------------------------------------------------------------------


def _in_keywords(text: str) -> str:
    """A message with the names of keywords."""
    for quantity, keyword in _KEYWORDS.items():
        text = text.replace(f"`{quantity}`", f"`{keyword}`")
    return text


def _in_rows(text: str, folder: Path, titles: int) -> str:
    """A message with the names of keywords, and about a DataFrame with rows in the place of a file's lines."""
    return in_rows(_in_keywords(text), folder, titles=titles) if _FRAME in text else _in_keywords(text)


def _with_words(found: Any, in_words: Callable[[str], str]) -> Any:
    """What was found, with the warnings about its inputs in other words."""
    sources = [replace(source, warnings=tuple(map(in_words, source.warnings))) for source in found.sources]
    return replace(found, sources=tuple(sources), warnings=tuple(map(in_words, found.warnings)))


@contextmanager
def _errors(in_words: Callable[[str], str]) -> Iterator[None]:
    """Errors as the caller reads them: the same error with another text."""
    try:
        yield
    except LevilabError as error:
        error.args = (in_words(str(error)),)
        raise
