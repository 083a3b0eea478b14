"""Results that were written before, each for the inputs that it suits; other inputs are analyzed."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from levilab.errors import DataError
from levilab.pipelines import catalogue
from levilab.pipelines.analyzed import A
from levilab.pipelines.document import Analysis
from levilab.pipelines.inputs.files import data_files
from levilab.pipelines.inputs.names import short_paths
from levilab.pipelines.inputs.search import find
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.inputs.unread import NoneUsable, NotTaken, Skipped, skip
from levilab.pipelines.options import InputOptions
from levilab.pipelines.result import Archive, ResultError, Written, read_inputs, results_in
from levilab.pipelines.suits import Look, Readers, Taken, choose_inputs, look, made_for, together
from levilab.runs.find import RECORD, find_run, find_runs

T = TypeVar("T")


@dataclass(frozen=True)
class Skips:
    """Inputs that cannot be used, and the errors that say why.

    Attributes:
        allowed: whether they are skipped; else the first error is raised.
    """

    allowed: bool
    skipped: list[Skipped] = field(default_factory=list)
    errors: list[DataError] = field(default_factory=list)

    @contextmanager
    def over(self, path: Path, skipped: Sequence[NotTaken] = ()) -> Iterator[None]:
        """Skip the inputs at a path that cannot be used, with those there that are skipped already."""
        try:
            yield
        except DataError as error:
            if not self.allowed:
                raise
            own = error.skipped if isinstance(error, NoneUsable) else [skip(error, path)]
            self.skipped.extend((*(one for one in skipped if isinstance(one, Skipped)), *own))
            self.errors.append(error)


def recall_suiting(
    paths: Sequence[Path],
    given: Mapping[str, Any],
    *,
    skips: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> list[tuple[Analysis[Any], Any]]:
    """Read the results of the inputs at the paths, of each analysis that has one; in the order of the catalogue.

    An input that has no result is analyzed by those that suit it.  Where results by one analysis share an input, the
    analysis is returned several times.  Raises DataError: no analysis suits a path, or damage.

    Args:
        paths: run folders, data files, folders to search, and results that lie elsewhere: their files, or a folder with
            nothing to analyze in it.
        given: options by their names, of any analysis.
        skips: whether an input that cannot be used is skipped with a note, as long as there is another one.
        progress: called before each input that is analyzed, with the share of them that is done.
    """
    skipped = Skips(skips)
    places, written = _split(paths)
    shares = _without_shared_inputs(written, [*_results_of(places)])
    names = _names_of_results(shares)
    done = []
    for k, results in enumerate(shares):
        recalled = _recall(places if k == 0 else [], results, given, skipped, progress if k == 0 else lambda _: None)
        done += [(analysis, _with_names_of_results(analysis, found, results, names)) for analysis, found in recalled]
    if skipped.errors and not done:
        raise skipped.errors[0]
    done.sort(key=lambda one: [*catalogue.ANALYSES].index(one[0].name))
    if skipped.skipped:
        first, found = done[0]
        done[0] = first, replace(found, skipped=(*found.skipped, *skipped.skipped))
    return done


def _recall(
    places: Sequence[Path],
    written: Sequence[Written],
    given: Mapping[str, Any],
    skips: Skips,
    progress: Callable[[float], None],
) -> list[tuple[Analysis[Any], Any]]:
    """Read or make the results of inputs; skips: where those go that are skipped."""
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
            if not skips.allowed:
                raise
            return otherwise

    def choose(inputs: Sequence[Taken]) -> list[Collection[str]]:
        stored = [{name for name, source in taken.items() if has_result(name, source)} for taken in inputs]
        each = [*zip(stored, map(made_for, inputs), strict=True)]
        of_others = {name for own, suiting in each if not own for name in suiting}
        return [own | of_others.intersection(suiting) if own else suiting for own, suiting in each]

    readers = {name: options(row) for name, row in catalogue.ANALYSES.items()}
    looks = [*choose_inputs([*_looks(places, readers, skips)], choose), *_inputs_of(own, readers, skips)]
    done, inputs = [], together(looks)
    count = sum(len(one.found.sources) for one in inputs)
    shares = (k / count for k in range(count))
    for one in inputs:
        chosen, archive = one.analysis.options_from(given), archives[one.analysis.name]
        with skips.over(one.found.sources[0].path, one.found.skipped):
            found = one.analysis.recall_found(
                one.paths, one.found, archive, chosen, skips=skips.allowed, step=lambda: progress(next(shares))
            )
            done.append((one.analysis, found))
    return done


def _looks(places: Sequence[Path], readers: Readers, skips: Skips) -> Iterator[Look]:
    for path in places:
        with skips.over(path):
            yield from look(path, readers)


def _inputs_of(written: Mapping[str, Sequence[Written]], readers: Readers, skips: Skips) -> Iterator[Look]:
    """Yield the inputs of the results of each analysis."""
    for name, path in ((name, path) for name, of in written.items() for one in of for path in one.inputs):
        with skips.over(path):
            yield path, name, find(path, catalogue.ANALYSES[name], readers[name])


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
