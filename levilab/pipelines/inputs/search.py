"""The way from paths on the command line to the inputs of an analysis."""

import hashlib
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic

from levilab.errors import DataError, DoesNotSuit
from levilab.formats.columns import NoSuchColumn, TableError
from levilab.formats.kinds import OTHER
from levilab.formats.texts import locate
from levilab.formats.understanding import SeveralRuns
from levilab.formats.waveforms.header import NoRate
from levilab.pipelines.inputs.correction import corrected_parts, describe, place_of_correction, read_correction
from levilab.pipelines.inputs.files import data_files, files_of_levilab, other_files
from levilab.pipelines.inputs.names import by_group, with_short_names
from levilab.pipelines.inputs.source import Needs, R, Source
from levilab.pipelines.inputs.unread import (
    OTHER_COLUMNS,
    PROSE,
    UNSUITABLE,
    LeftOut,
    NoneUsable,
    NothingSuits,
    NotTaken,
    Skipped,
    SkippedRuns,
    files_by_kind,
    kind_of_unused,
    noted,
    skip,
)
from levilab.pipelines.options import InputOptions
from levilab.runs.find import RECORD, find_runs, no_such_path
from levilab.runs.run import Run
from levilab.texts.note import Note, of_file
from levilab.texts.note import kind_of as kind_of_text
from levilab.texts.text import Sentences, Text, text_of


@dataclass(frozen=True)
class Found(Generic[R]):
    """What lies at some paths.

    Attributes:
        warnings: about them.
        skipped: runs and files that the analysis does not take.
    """

    sources: tuple[Source[R], ...]
    warnings: tuple[str, ...] = ()
    skipped: tuple[NotTaken, ...] = ()


def collect(paths: Sequence[Path], needs: Needs[R], options: Callable[[Path], InputOptions]) -> Found[R]:
    """Find the inputs at the paths that suit an analysis, the same data once.

    A run folder or a file is taken, or refused with a reason; a folder is searched for runs and data files, and what
    does not suit there is skipped.  Of several paths, as a pattern `runs/*` has them, those that levilab has written
    itself are left out.  Raises DataError.

    Args:
        paths: run folders, data files, folders to search.
        needs: of the analysis.
        options: how an input is read.
    """
    own = files_of_levilab(paths)
    return join([find(path, needs, options) for path in paths if path not in own or len(own) == len(paths)])


def find(path: Path, needs: Needs[R], options: Callable[[Path], InputOptions]) -> Found[R]:
    """Find the inputs at one path; see `collect`."""
    if path.is_dir() and not (path / RECORD).exists():
        return _search(path, needs, options)
    return Found(tuple(_at(path, needs, options)))


def join(found: Sequence[Found[R]]) -> Found[R]:
    """Join what was found at several paths, the same data once, with short names."""
    warnings = [text for one in found for text in one.warnings]
    sources = _without_copies([source for one in found for source in one.sources], warnings)
    skipped = tuple(skipped for one in found for skipped in one.skipped)
    return Found(with_short_names(by_group(sources)), tuple(warnings), skipped)


#: Logarithms of fingerprints that are alike differ by less: those of the same readings are in neighbouring cells.
_CELL = 1e-4


def _without_copies(found: Sequence[Source[R]], warnings: list[str]) -> list[Source[R]]:
    """Leave out copies of the same readings: they would pass for agreement."""
    kept: list[Source[R]] = []
    cells: dict[tuple[int, int], list[Source[R]]] = {}  # of thousands not each is compared with each
    for source in found:
        length, size = len(source.readings), source.readings.fingerprint
        cell = math.floor(math.log(size) / _CELL) if size > 0 else 0
        near = [other for k in (cell - 1, cell, cell + 1) for other in cells.get((length, k), ())]
        first = next((other for other in near if other.readings.same_as(source.readings)), None)
        if first is None:
            kept.append(source)
            cells.setdefault((length, cell), []).append(source)
        elif first.data.resolve() != source.data.resolve():
            text = "{path:s}: holds the same readings as {other:s}, counted once"
            said = Text(text, source.path, first.path)
            warnings.append(of_file("same readings", said, paths=(source.path, first.path)))
    return kept


#: How the name of a run folder begins, to the second.
_SECOND = re.compile(r"\d{8}T\d{6}Z")


def _begun(source: Source[Any]) -> tuple[list[str], str, str]:
    """Return the place of a run among those of a folder: by name, but of one second by the time in its record."""
    *folders, name = source.path.parts
    second = _SECOND.match(name)
    return [*folders, second[0] if second else name], (source.run and source.run.record.started_utc) or "", name


def _at(path: Path, needs: Needs[R], options: Callable[[Path], InputOptions]) -> Iterator[Source[R]]:
    """Yield the input at a path, or the runs in a file that holds several.  Raises DataError."""
    parts = corrected_parts(path)
    if parts == [path]:
        try:
            yield _one(path, needs, options(path))
        except SeveralRuns as several:
            for run in several.paths:
                yield _of_file(run, needs, options(run))
        return
    sources: list[Source[R]] = []
    errors: list[DataError] = []
    for part in parts:
        try:
            sources += _at(part, needs, options)
        except DataError as error:
            errors.append(error)
    damage = [error for error in errors if not isinstance(error, DoesNotSuit)]
    if not sources:
        raise [*damage, *errors][0]
    notes = (of_file("not read", Text("not read: {problem}", error)) for error in damage)
    yield from (replace(sources[0], warnings=(*sources[0].warnings, *notes)), *sources[1:])


def _one(path: Path, needs: Needs[R], options: InputOptions) -> Source[R]:
    if not locate(path)[0].exists():
        raise no_such_path(path)
    if path.is_dir():
        return _of_run(Run.load(path), needs, options)
    if path.name == needs.data and (path.parent / RECORD).exists():
        try:
            return _of_run(Run.load(path.parent), needs, options)
        except DataError:  # its record is damaged; that the readings can be saved is what they are text for
            text = "{path:s}: its run.json cannot be used, so whether it is SYNTHETIC is not known"
            doubt = of_file("no record", Text(text, path))
            source = _of_file(path, needs, options)
            return replace(source, warnings=(*source.warnings, doubt))
    return _of_file(path, needs, options)


def _of_file(path: Path, needs: Needs[R], options: InputOptions) -> Source[R]:
    """Read a data file.  Options that are given go before those of the correction beside it."""
    kept = {key: value for key, value in read_correction(path).items() if getattr(options, key) in (None, value)}
    readings = needs.read_file(path, replace(options, **kept))
    said = "{name:s}: is read as {file:s} says: {options:s}"
    text = Text(said, path.name, place_of_correction(path).name, describe(kept))
    note = [of_file("correction", text, "advice")] if kept else []
    return Source(path, path, sha256_of(path), None, readings, path.name, (*readings.warnings, *note), kept)


def _of_run(run: Run, needs: Needs[R], options: InputOptions) -> Source[R]:
    if not needs.take(run):
        kind = run.record.experiment
        other = "{path:s}: holds a {kind}, {analysis:s} needs a {needed}"
        raise DoesNotSuit(other, path=run.folder, kind=f"{kind} run", analysis=needs.name, needed=needs.runs)
    data = run.folder / needs.data
    if not data.exists():  # as after a kill before the first record
        what = "{path:s}: holds no {name:s}, so nothing was recorded; analyze another run"
        raise DataError(what, path=run.folder, name=data.name)
    readings = needs.read_run(run, options)
    doubts = (Note(kind_of_text(text), text, weight="doubt") for text in run.warnings())
    return Source(run.folder, data, sha256_of(data), run, readings, run.folder.name, (*doubts, *readings.warnings))


def sha256_of(path: Path) -> str:
    """Return the hash of a file; of a run in it, that of the file and the run's name.  Raises DataError."""
    path, inside = locate(path)
    if path.exists() and not path.is_file():  # reading from a pipe would wait for ever
        raise DataError("{path:s}: is a folder, a pipe or a device; a file is expected", path=path)
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256")
            digest.update(inside.encode())
            return digest.hexdigest()
    except OSError as error:
        raise DataError("{path:s}: cannot be read ({why})", path=path, why=error.strerror) from error


def _search(root: Path, needs: Needs[R], options: Callable[[Path], InputOptions]) -> Found[R]:
    """Find the runs and data files below a folder that suit; a broken or too short one is skipped with a warning."""
    found: list[Source[R]] = []
    skipped: list[NotTaken] = []
    others: Counter[str] = Counter()
    for folder in find_runs(root):
        chosen = options(folder)
        try:
            run = Run.load(folder)
            if goes_on := run.continued_in:
                said = "{folder:s}, which was broken off: its run goes on in {name:s}"
                skipped.append(Skipped(Text(said, str(folder), goes_on.name), noted=False))
            elif needs.take(run):
                found.append(_of_run(run, needs, chosen))
            else:
                others[run.record.experiment] += 1
        except DataError as error:
            skipped.append(skip(error, folder, type(error).__name__))
    found.sort(key=_begun)
    files = data_files(root)
    skipped += [LeftOut(file, kind_of_unused(file)) for file in other_files(root)]
    for file in files:
        with _skipping(file, skipped):
            found += _at(file, needs, lambda path: replace(options(path), guess=False))
    kinds = [SkippedRuns(kind, count) for kind, count in sorted(others.items())]
    if not found:
        left_out, broken = [one for one in skipped if isinstance(one, LeftOut)], [*filter(noted, skipped)]
        text = Text("{path:s}: {why}", path=str(root), why=_nothing_found(needs, kinds, broken, left_out))
        raise NoneUsable(text, broken) if broken else NothingSuits(text, left_out)
    return Found(tuple(found), (), (*kinds, *skipped))


@contextmanager
def _skipping(file: Path, skipped: list[NotTaken]) -> Iterator[None]:
    """Note what is wrong with a data file that was found in a folder, or of which kind it is."""
    try:
        yield
    except NoRate as error:
        skipped.append(Skipped(text_of(error), noted=False))
    except DoesNotSuit as error:
        kind = kind_of_unused(file)
        kind = OTHER_COLUMNS if isinstance(error, NoSuchColumn) and kind is not PROSE else kind
        fits = kind is OTHER_COLUMNS and not isinstance(error, TableError)
        skipped.append(LeftOut(file, UNSUITABLE, text_of(error)) if fits else LeftOut(file, kind))
    except DataError as error:
        skipped.append(skip(error, file, type(error).__name__))


def _nothing_found(
    needs: Needs[Any], others: list[SkippedRuns], broken: list[Skipped], left_out: Sequence[LeftOut]
) -> str:
    seen = [*map(str, others)]
    seen += [f"{len(broken)} that cannot be used, as {broken[0].reason}"] if broken else []
    seen += [one.why for one in left_out if one.why]
    rest = [one for one in left_out if not one.why]
    seen += [files_by_kind(rest)] if any(one.kind is not OTHER for one in rest) else []
    if not seen:
        return "holds no run and no data file; name a run folder, a data file, or a folder with some of them"
    only = "no {runs} to analyze in this folder (found only {found}); name a run folder or a data file"
    return Text(only, runs=needs.runs, found=Sentences(*seen, between="; "))
