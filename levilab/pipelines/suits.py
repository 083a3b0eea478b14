"""Which analysis suits an input: one rule for the command line, notebooks and reports.

A run is for the analyses of its experiment; where there are none, for those that take its records.  A data file is for
the analyses that read it; where one of them reads it by columns that no other analysis reads, for that one alone.  A
folder is for the analyses of the runs and files in it.  A result that was written before says itself what suits; beside
inputs without one its input is for their analyses, too, or it would be missing in what they are compared by.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from analysis.errors import AnalysisError
from levilab.errors import DataError, DoesNotSuit
from levilab.pipelines import catalogue
from levilab.pipelines.analyzed import A
from levilab.pipelines.document import Analysis
from levilab.pipelines.inputs.files import data_files
from levilab.pipelines.inputs.search import Found, find, join
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.inputs.unread import NoneUsable, NothingSuits, in_words
from levilab.pipelines.options import InputOptions
from levilab.pipelines.result import ResultError, is_of_another
from levilab.pipelines.result import save as save_files
from levilab.runs.find import find_run, find_runs
from levilab.runs.run import Run
from levilab.texts.text import how_many

#: How each analysis reads an input.
Readers = Mapping[str, Callable[[Path], InputOptions]]
#: What an analysis, by its name, finds at a path.
Look = tuple[Path, str, Found[Any]]
#: An input as each analysis takes it; and such inputs → the analyses that each of them gets.
Taken = Mapping[str, Source[Any]]
Choose = Callable[[Sequence[Taken]], list[Collection[str]]]


@dataclass(frozen=True)
class Suiting:
    """An analysis, and the inputs that suit it.

    Attributes:
        analysis: the row of the catalogue.
        paths: those of the paths with something for it.
        found: the inputs there that suit it.
    """

    analysis: Analysis[Any]
    paths: tuple[Path, ...]
    found: Found[Any]


def suiting(paths: Sequence[Path], given: Mapping[str, Any]) -> list[Suiting]:
    """Return the analyses that suit the inputs at the paths, in the order of the catalogue.

    Args:
        paths: run folders, data files, folders to search.
        given: options by their names, of any analysis.

    Raises:
        DoesNotSuit: no analysis suits one of the paths.
        DataError: one of them is damaged, so that no analysis can use it.
    """

    def reader(analysis: Analysis[Any]) -> Callable[[Path], InputOptions]:
        chosen = analysis.options_from(given)
        return lambda _: chosen

    readers = {name: reader(row) for name, row in catalogue.ANALYSES.items()}
    looks = [one for path in paths for one in look(find_run(path), readers)]
    return together(choose_inputs(looks, lambda inputs: [*map(made_for, inputs)]))


def analyze_suiting(paths: Sequence[Path], given: Mapping[str, Any]) -> list[tuple[Analysis[Any], Any]]:
    """Analyze the inputs at the paths by each analysis that suits; see `suiting`."""
    return [
        (one.analysis, one.analysis.analyze_found(one.paths, one.found, one.analysis.options_from(given)))
        for one in suiting(paths, given)
    ]


# --- the rule ------------------------------------------------------------------------------------------


def made_for(taken: Taken) -> Collection[str]:
    """Return those of the analyses which take an input that are made for it."""
    run = next(iter(taken.values())).run
    if run:
        own = _of_experiment(run)
        return [name for name in taken if name in own] if own else taken
    return [name for name in taken if catalogue.ANALYSES[name].particular] or taken


def _of_experiment(run: Run) -> list[str]:
    return [row.name for row in catalogue.ANALYSES.values() if run.record.experiment in row.experiments]


def look(path: Path, readers: Readers) -> list[Look]:
    """Return what each analysis finds at a path, with the inputs there that none can use.

    Args:
        path: a run folder, a data file, a folder to search.
        readers: analysis → how it reads an input.

    Raises:
        DoesNotSuit: no analysis finds anything.
        DataError: what lies there is damaged.
    """
    found: dict[str, Found[Any]] = {}
    errors: dict[str, DataError] = {}
    for name, row in catalogue.ANALYSES.items():
        try:
            found[name] = find(path, row, readers[name])
        except ResultError:
            raise
        except DataError as error:
            errors[name] = error
        except AnalysisError as error:
            errors[name] = DataError("{path:s}: {error}", path=path, error=error)
    if not found:
        raise _refusal(path, errors)
    used = {source.path for one in found.values() for source in one.sources}
    unusable = [one for error in errors.values() if isinstance(error, NoneUsable) for one in error.skipped]
    skipped = [replace(one, noted=False) for one in unusable if one.path not in used]
    return [(path, name, replace(one, skipped=(*one.skipped, *skipped))) for name, one in found.items()]


def choose_inputs(looks: Sequence[Look], choose: Choose) -> Iterator[Look]:
    """Yield what each analysis found at each path, with the inputs that it gets, where it gets any."""
    inputs: dict[Path, dict[str, Source[Any]]] = {}
    for _, name, one in looks:
        for source in one.sources:
            inputs.setdefault(source.path, {})[name] = source
    chosen = dict(zip(inputs, choose([*inputs.values()]), strict=True))
    for path, name, one in looks:
        if own := tuple(source for source in one.sources if name in chosen[source.path]):
            yield path, name, replace(one, sources=own)


def together(looks: Iterable[Look]) -> list[Suiting]:
    """Return each analysis with all that it found, in the order of the catalogue."""
    taken: dict[str, list[tuple[Path, Found[Any]]]] = {name: [] for name in catalogue.ANALYSES}
    for path, name, one in looks:
        taken[name].append((path, one))
    return [
        Suiting(catalogue.ANALYSES[name], tuple(path for path, _ in those), join([one for _, one in those]))
        for name, those in taken.items()
        if those
    ]


def _refusal(path: Path, errors: Mapping[str, DataError]) -> DataError:
    """Return why no analysis takes a path: damage goes before another kind of data."""
    damage = [error for error in errors.values() if not isinstance(error, DoesNotSuit)]
    if damage or not path.is_dir():
        return [*damage, *errors.values()][0]
    runs, files = _usable_runs(path), data_files(path)
    own = [name for run in runs for name in _of_experiment(run)]
    if own:
        return errors[own[0]]
    counts = Counter(run.record.experiment for run in runs)
    seen = [how_many(count, f"{name} run") for name, count in counts.items()]
    seen += [f"{how_many(len(files), 'data file')}, as {files[0].name}"] if files else []
    if runs:
        kinds = " or ".join(counts)
        what = "{path:s}: there is no analysis of a {kinds:s} run (found {seen:s})"
        return DoesNotSuit(what, path=path, kinds=kinds, seen="; ".join(seen))
    if files:
        return DoesNotSuit(
            "{path:s}: no analysis reads what is in it; {value}: name a file to see why",
            path=path, value=_left_out(errors) or seen[0],
        )  # fmt: skip
    return next(iter(errors.values()))


def _left_out(errors: Mapping[str, DataError]) -> str:
    """Return the files of a folder in which no analysis found anything, by kind."""
    lists = [error.left_out for error in errors.values() if isinstance(error, NothingSuits)]
    return in_words(lists[0]) if lists else ""


def _usable_runs(root: Path) -> list[Run]:
    """Return the runs at or below a folder; a damaged one decides nothing."""
    runs = []
    for folder in find_runs(root):
        try:
            runs.append(Run.load(folder))
        except DataError:
            continue
    return runs


# --- writing -------------------------------------------------------------------------------------------


def save(analysis: Analysis[A], found: A, folder: Path | None = None, *, with_figure: bool = True) -> list[Path]:
    """Write the result and the figure beside the inputs, or into a folder; returns the files.  Raises CannotWrite.

    The name result.json belongs to the first analysis of the run's experiment, or where there is none to the first one
    that takes the run; with data files and with several inputs, which may be of any kind, to the first of all.
    Every other analysis has its name in its result's, and into a given folder also one that would replace another's.
    """
    run = found.sources[0].run if len(found.sources) == 1 else None
    names = [row.name for row in catalogue.ANALYSES.values() if run is None or row.take(run)]
    first = (run and _of_experiment(run)) or names
    place = replace(found.place, folder=folder or found.output_folder)
    is_first = first[0] == analysis.name and not (folder and is_of_another(place.result(), analysis.name))
    picture = analysis.png(found) if with_figure else None
    return save_files(analysis.result_of(found, place), place, picture, analysis.files(found), first=is_first)
