"""Which analysis suits an input: one rule for the command line, notebooks and reports.

A run is for the analyses of its experiment; where there are none, for those that take its records.  A data file is for
the analyses that read it; where one of them reads it by columns that no other analysis reads, for that one alone.  A
folder is for the analyses of the runs and files in it.  A result that was written before says itself what suits; beside
inputs without one its input is for their analyses, too, or it would be missing in what they are compared by.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from analysis.errors import AnalysisError
from levilab.errors import DataError, DoesNotSuit, NoneUsable
from levilab.pipelines import catalogue
from levilab.pipelines.analyzed import A
from levilab.pipelines.document import Analysis
from levilab.pipelines.options import InputOptions
from levilab.pipelines.result import Archive, ResultError, Written, is_of_another, read_inputs, results_in
from levilab.pipelines.result import save as save_files
from levilab.pipelines.sources import (
    FEW,
    OTHER_COLUMNS,
    Found,
    LeftOut,
    NothingSuits,
    NotTaken,
    Skipped,
    SkippedRuns,
    Source,
    data_files,
    find,
    in_words,
    join,
    number_by_kind,
    short_paths,
)
from levilab.runs.find import RECORD, find_run, find_runs
from levilab.runs.run import Run
from levilab.texts.text import Text, how_many, text_of

Tell = Callable[[str], None]
#: An input as each analysis takes it; and such inputs → the analyses that each of them gets.
Taken = Mapping[str, Source[Any]]
Choose = Callable[[Sequence[Taken]], list[Collection[str]]]
#: Notes on inputs that are skipped, and their errors.
Errors = list[tuple[str, DataError]]
T = TypeVar("T")


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


def suiting(paths: Sequence[Path], given: Mapping[str, Any], tell: Tell | None = None) -> list[Suiting]:
    """Return the analyses that suit the inputs at the paths, in the order of the catalogue.

    Args:
        paths: run folders, data files, folders to search.
        given: options by their names, of any analysis.
        tell: called with the reason why no analysis can use a file or a run in a folder.

    Raises:
        DoesNotSuit: no analysis suits one of the paths.
        DataError: one of them is damaged, so that no analysis can use it.
    """

    def options(analysis: Analysis[Any]) -> Callable[[Path], InputOptions]:
        chosen = analysis.options_from(given)
        return lambda _: chosen

    return _suiting([find_run(path) for path in paths], options, _each_made_for, tell)


def analyze_suiting(
    paths: Sequence[Path], given: Mapping[str, Any], tell: Tell | None = None
) -> list[tuple[Analysis[Any], Any]]:
    """Analyze the inputs at the paths by each analysis that suits; see `suiting`."""
    return [
        (one.analysis, one.analysis.analyze_found(one.paths, one.found, one.analysis.options_from(given)))
        for one in suiting(paths, given, tell)
    ]


def recall_suiting(
    paths: Sequence[Path], given: Mapping[str, Any], tell: Tell | None = None, *, skips: bool = False
) -> list[tuple[Analysis[Any], Any]]:
    """Read the results of the inputs at the paths, of each analysis that has one; in the order of the catalogue.

    An input that has no result is analyzed by those that suit it.  Where results by one analysis share an input, the
    analysis is returned several times.  Raises DataError: no analysis suits a path, or damage.

    Args:
        paths: run folders, data files, folders to search, and results that lie elsewhere: their files, or a folder with
            nothing to analyze in it.
        given: options by their names, of any analysis.
        tell: called with the reason why no analysis can use a file or a run in a folder.
        skips: whether an input that cannot be used is skipped with a note, as long as there is another one.
    """
    errors: Errors | None = [] if skips else None
    places, written = _split(paths)
    shares = _without_shared_inputs(written, [*_results_of(places)])
    names = _names_of_results(shares)
    done = []
    for k, results in enumerate(shares):
        recalled = _recall(places if k == 0 else [], results, given, tell, errors)
        done += [(analysis, _with_names_of_results(analysis, found, results, names)) for analysis, found in recalled]
    if errors and not done:
        raise errors[0][1]
    done.sort(key=lambda one: [*catalogue.ANALYSES].index(one[0].name))
    if errors:
        first, found = done[0]
        done[0] = first, replace(found, warnings=(*found.warnings, *(note for note, _ in errors)))
    return done


def _recall(
    places: Sequence[Path],
    written: Sequence[Written],
    given: Mapping[str, Any],
    tell: Tell | None,
    errors: Errors | None,
) -> list[tuple[Analysis[Any], Any]]:
    """Read or make the results of inputs; errors: where those of inputs that are skipped go, None: none is skipped."""
    own = {name: [one for one in written if one.analysis == name] for name in catalogue.ANALYSES}
    archives: dict[str, Archive[Any]] = {}

    def options(analysis: Analysis[Any]) -> Callable[[Path], InputOptions]:
        of_results = own[analysis.name]
        inputs = [*places, *(path for one in of_results for path in one.inputs)]
        archive = analysis.archive(inputs, [one.file for one in of_results])
        archives[analysis.name] = archive
        chosen = analysis.options_from(given)
        reading = analysis.reading(archive, chosen)
        return lambda path: with_sound_result(lambda: reading(path), chosen)

    def has_result(name: str, source: Source[Any]) -> bool:
        return (
            with_sound_result(lambda: archives[name].earlier(source.path, source.data, source.sha256), None) is not None
        )

    def with_sound_result(read: Callable[[], T], otherwise: T) -> T:
        """Read by a result; of one that is damaged, and so skipped with its input later, take something else."""
        try:
            return read()
        except ResultError:
            if errors is None:
                raise
            return otherwise

    def choose(inputs: Sequence[Taken]) -> list[Collection[str]]:
        stored = [{name for name, source in taken.items() if has_result(name, source)} for taken in inputs]
        each = list(zip(stored, _each_made_for(inputs), strict=True))
        of_others = {name for own, suiting in each if not own for name in suiting}
        return [own | of_others.intersection(suiting) if own else suiting for own, suiting in each]

    results = {name: [path for one in of for path in one.inputs] for name, of in own.items()}
    done = []
    for one in _suiting(places, options, choose, tell, results, skipped=errors):
        chosen, archive = one.analysis.options_from(given), archives[one.analysis.name]
        with _skipping(errors, one.found.sources[0].path, one.found.warnings):
            found = one.analysis.recall_found(one.paths, one.found, archive, chosen, skips=errors is not None)
            done.append((one.analysis, found))
    return done


@contextmanager
def _skipping(errors: Errors | None, path: Path, notes: Sequence[str] = ()) -> Iterator[None]:
    """Keep notes on the inputs at a path that are skipped, with the error; with None no input is."""
    try:
        yield
    except DataError as error:
        if errors is None:
            raise
        reasons = error.reasons.values() if isinstance(error, NoneUsable) else ()
        skipped = [*reasons] or [Skipped(text_of(error), path=path).note]
        errors += [(note, error) for note in (*notes, *skipped)]


def _results_of(places: Sequence[Path]) -> Iterator[Written]:
    """Yield the results that lie in folders and beside data files; a damaged one is for who reads it."""
    for place in places:
        with suppress(ResultError):
            found = results_in(place if place.is_dir() else place.parent)
            yield from (one for one in found if place.is_dir() or place.resolve() in map(Path.resolve, one.inputs))


def _without_shared_inputs(written: Sequence[Written], of_places: list[Written]) -> list[list[Written]]:
    """Return the results in lists, in none of which an analysis has an input twice; the first one is with places."""
    shares, files = [[*of_places]], {one.file.resolve() for one in of_places}
    for one in {one.file.resolve(): one for one in written if one.file.resolve() not in files}.values():
        free = (share for share in shares if not any(_share_inputs(one, other) for other in share))
        if (share := next(free, None)) is None:
            shares.append(share := [])
        share.append(one)
    return [shares[0][len(of_places) :], *shares[1:]]


def _share_inputs(one: Written, other: Written) -> bool:
    inputs = {path.resolve() for path in other.inputs}
    return one.analysis == other.analysis and not inputs.isdisjoint(path.resolve() for path in one.inputs)


def _names_of_results(shares: Sequence[Sequence[Written]]) -> dict[Path, str]:
    """Return how results of the same inputs are distinguished: by their folders, or else their files."""
    if len(shares) == 1:
        return {}
    files = [one.file for share in shares for one in share]
    folders = [file.parent for file in files]
    return dict(zip(files, short_paths(folders if len({*folders}) == len(files) else files), strict=True))


def _with_names_of_results(analysis: Analysis[A], found: A, written: Sequence[Written], names: Mapping[Path, str]) -> A:
    """Return what was found with the name of its result behind that of each input, where the result has a name."""
    own = [one for one in written if one.analysis == analysis.name and one.file in names]
    known = {path.resolve(): names[one.file] for one in own for path in one.inputs}
    sources = [
        replace(source, name=f"{source.name} ({known[place]})") if (place := source.path.resolve()) in known else source
        for source in found.sources
    ]
    return replace(found, sources=tuple(sources))


def _split(paths: Sequence[Path]) -> tuple[list[Path], list[Written]]:
    """Return the paths to read or search, and the results that were named by their own paths.  Raises DataError."""
    places: list[Path] = []
    written: list[Written] = []
    for path in map(find_run, paths):
        results = []
        if path.suffix == ".json" and path.is_file():
            results = [read_inputs(path)]
        elif path.is_dir() and not (path / RECORD).exists() and not find_runs(path) and not data_files(path):
            results = results_in(path)
        written += results
        places += [] if results else [path]
    return places, written


# --- the rule ------------------------------------------------------------------------------------------


def _each_made_for(inputs: Sequence[Taken]) -> list[Collection[str]]:
    return [_made_for(taken) for taken in inputs]


def _made_for(taken: Taken) -> Collection[str]:
    """Return those of the analyses which take an input that are made for it."""
    run = next(iter(taken.values())).run
    if run:
        own = _of_experiment(run)
        return [name for name in taken if name in own] if own else taken
    return [name for name in taken if catalogue.ANALYSES[name].particular] or taken


def _of_experiment(run: Run) -> list[str]:
    return [row.name for row in catalogue.ANALYSES.values() if run.record.experiment in row.experiments]


def _suiting(
    paths: Sequence[Path],
    options: Callable[[Analysis[Any]], Callable[[Path], InputOptions]],
    choose: Choose,
    tell: Tell | None,
    more: Mapping[str, Sequence[Path]] | None = None,
    *,
    skipped: Errors | None = None,
) -> list[Suiting]:
    """Return the analyses with the inputs that they take.

    Args:
        paths: run folders, data files, folders to search.
        options: an analysis → how it reads an input.
        choose: which of them each input gets.
        tell: see `suiting`.
        more: analysis → paths that are for it alone.
        skipped: where the errors of paths that are skipped go; None: no path is skipped.
    """
    rows = catalogue.ANALYSES
    readers = {name: options(row) for name, row in rows.items()}
    taken: dict[str, list[tuple[Path, Found[Any]]]] = {name: [] for name in rows}
    unusable: list[NoneUsable] = []
    looks: list[tuple[Path, dict[str, Found[Any]]]] = []
    for path in paths:
        with _skipping(skipped, path):
            found, errors = _look(path, readers)
            if not found:
                raise _refusal(path, errors)
            unusable += [error for error in errors.values() if isinstance(error, NoneUsable)]
            looks.append((path, found))
    for path, name, one in _chosen(looks, choose):
        taken[name].append((path, one))
    for name, inputs in (more or {}).items():
        for path in inputs:
            with _skipping(skipped, path):
                taken[name].append((path, find(path, rows[name], readers[name])))
    done = [
        Suiting(rows[name], tuple(path for path, _ in those), join([one for _, one in those]))
        for name, those in taken.items()
        if those
    ]
    said = {text for one in done for text in one.found.warnings}
    used = {source.path for one in done for source in one.found.sources}
    for file, reason in {pair: None for error in unusable for pair in error.reasons.items()}:
        if tell and file not in used and reason not in said:
            tell(reason)
    return done


def _chosen(
    looks: Sequence[tuple[Path, dict[str, Found[Any]]]], choose: Choose
) -> Iterator[tuple[Path, str, Found[Any]]]:
    """Yield what each analysis found at each path, with the inputs that it gets, where it gets any."""
    found = [(path, name, one) for path, at in looks for name, one in at.items()]
    inputs: dict[Path, dict[str, Source[Any]]] = {}
    for _, name, one in found:
        for source in one.sources:
            inputs.setdefault(source.path, {})[name] = source
    chosen = dict(zip(inputs, choose([*inputs.values()]), strict=True))
    for path, name, one in found:
        if own := tuple(source for source in one.sources if name in chosen[source.path]):
            yield path, name, replace(one, sources=own)


def _look(
    path: Path, readers: Mapping[str, Callable[[Path], InputOptions]]
) -> tuple[dict[str, Found[Any]], dict[str, DataError]]:
    """Return what each analysis finds at a path, and why the others find nothing."""
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
    return found, errors


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


def remarks(of_each: Sequence[Sequence[NotTaken]]) -> list[NotTaken]:
    """Join the remarks of several analyses; runs and files that were left out count only if all of them did."""
    said = list(dict.fromkeys(remark for those in of_each for remark in those))
    joined = [one for one in said if isinstance(one, Skipped) or all(one in those for those in of_each)]
    if len(of_each) == 1:
        return joined
    return [LeftOut(one.path, OTHER_COLUMNS) if isinstance(one, LeftOut) and one.why else one for one in joined]


def left_out_of(remarks: Sequence[NotTaken]) -> list[dict[str, str]]:
    """Return the files that are left out, for programs."""
    return [
        {"path": one.path.as_posix(), "kind": one.kind.name.partition(" ")[2], "advice": one.why or one.kind.advice}
        for one in remarks
        if isinstance(one, LeftOut)
    ]


def texts_of(remarks: Sequence[NotTaken]) -> list[str]:
    """Return remarks as lines of text: runs and files that are left out in one, a few files by name in their own."""
    left_out = [one for one in remarks if isinstance(one, LeftOut)]
    few, unexplained = len(left_out) <= FEW, [one for one in left_out if not one.why]
    things = (*(str(one) for one in remarks if isinstance(one, SkippedRuns)), *number_by_kind([] if few else left_out))
    skipped = "skipped {things}" if few else "skipped {things} (levilab analyze --json names the files)"
    return [
        *(str(one) for one in remarks if isinstance(one, Skipped)),
        *([Text(skipped, things=things)] if things else []),
        *(str(Skipped(one.why)) for one in left_out if few and one.why),
        *([in_words(unexplained)] if few and unexplained else []),
    ]


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
