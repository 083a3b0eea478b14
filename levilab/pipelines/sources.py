"""The way from paths on the command line to the readings of an analysis."""

import hashlib
import json
import math
import os
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar

import numpy as np

from analysis.remarks import Remark
from levilab.errors import DataError, DoesNotSuit, NoneUsable
from levilab.formats.columns import NoSuchColumn, TableError
from levilab.formats.kinds import AUDIO, OTHER, Kind, kind_of
from levilab.formats.texts import locate
from levilab.formats.understanding import SeveralRuns
from levilab.formats.waveforms.audio import advice_on_sound
from levilab.formats.waveforms.header import NoRate
from levilab.formats.waveforms.record import SEARCHED
from levilab.pipelines.correction import corrected_parts, describe, place_of_correction, read_correction
from levilab.pipelines.options import InputOptions
from levilab.present.clock import local
from levilab.present.numbers import filled, list_in_words, short_name
from levilab.runs.find import RECORD, find_runs, no_such_path
from levilab.runs.run import READINGS, Run
from levilab.texts.note import Note, Weight, of_file
from levilab.texts.note import kind_of as kind_of_text
from levilab.texts.text import Sentences, Text, how_many, text_of, verbatim

#: A file of this name keeps its folder out of searches of the folders above.
SKIP = ".levilab-skip"


#: Relative: a file rounds to 1 mHz and 10 ms, but no two runs agree so far in all readings.
SAME = 5e-5


@dataclass(frozen=True)
class Weighed:
    """A sentence in a table of remarks that is no plain warning; see `note_of`."""

    text: str | Callable[..., str]
    weight: Weight


def note_of(of: Remark, table: Mapping[str, str | Callable[..., str] | Weighed], *values: Any, **named: Any) -> Note:
    """Return a remark as a note, whose sentence stands in a table by its kind, or is made there of values.

    The fields of a sentence are the remark's values in their order, but for its ``{name}`` and ``{law}``.
    """
    row = table[of.kind]
    said, weight = (row.text, row.weight) if isinstance(row, Weighed) else (row, "warning")
    if not isinstance(said, str):
        text = said(*values, **named)
    else:
        text = filled(said, of.values, name=of.name, law=of.law) if "{" in said else said
    return Note(f"{of.kind}:{of.law} {of.name}", text, weight=weight)


class Readings:
    """What an analysis reads from a run or a file: a dataclass of arrays of equal length.

    Attributes:
        warnings: what to know before using them.
        compared: names of the arrays by which the same readings are found again; the last has the fingerprint.
        doubtful: whether their unit is in doubt: means leave them out, and fits to them deserve no remark.
    """

    warnings: tuple[str, ...]
    doubtful: bool = False
    compared: ClassVar[tuple[str, ...]]

    def _compared(self) -> list[np.ndarray]:
        return [getattr(self, name) for name in self.compared]

    def __len__(self) -> int:
        return len(self._compared()[-1])

    @property
    def fingerprint(self) -> float:
        """A number that the same readings share but for 1e-4 of it, and few others."""
        return float(np.abs(self._compared()[-1]).max())

    def same_as(self, other: Self) -> bool:
        """Return whether these are the same readings, but for the rounding in another file."""
        if len(self) != len(other):
            return False
        pairs = [*zip(self._compared(), other._compared(), strict=True)]
        # one value each first: of thousands of runs that begin alike, each pair is compared
        return all(abs(one[-1] - theirs[-1]) <= 2 * SAME * np.abs(theirs).max() for one, theirs in pairs) and all(
            np.allclose(one, theirs, rtol=SAME, atol=SAME * float(np.abs(theirs).max())) for one, theirs in pairs
        )


R = TypeVar("R", bound=Readings)


@dataclass(frozen=True, kw_only=True)
class Needs(Generic[R]):
    """What an analysis needs of its inputs.

    Attributes:
        name: of the analysis.
        experiments: those whose runs suit it.
        read_file, read_run: to readings, which raise DoesNotSuit for what is of another kind and DataError for what
            cannot be used.
        data: the file of a run that the readings come from.
        also: whether a run of any experiment suits.
        particular: whether it reads files by columns that no other analysis reads, so that such a file is made for it.
        wanted: such runs in words, where the experiment says too little.
    """

    name: str
    experiments: frozenset[str]
    read_file: Callable[[Path, Any], R]
    read_run: Callable[[Run, Any], R]
    data: str = READINGS
    also: Callable[[Run], bool] | None = None
    particular: bool = False
    wanted: str = ""

    @property
    def runs(self) -> str:
        """Which runs suit, in words."""
        return self.wanted or f"{' or '.join(sorted(self.experiments))} run"

    def take(self, run: Run) -> bool:
        """Return whether a run suits."""
        return run.record.experiment in self.experiments or bool(self.also and self.also(run))


@dataclass(frozen=True)
class Source(Generic[R]):
    """One input.

    Attributes:
        path: what was given or found.
        data: the file with the readings.
        sha256: of that file.
        run: None for a data file.
        name: for people, as short as distinguishes it from the others.
        warnings: about the input.
        kept: options out of the correction beside a data file with which it was read.
    """

    path: Path
    data: Path
    sha256: str
    run: Run | None
    readings: R
    name: str
    warnings: tuple[str, ...] = ()
    kept: Mapping[str, Any] = field(default_factory=dict)

    @property
    def group(self) -> str:
        """Who measured it; empty where that is not known."""
        return in_one_line(self.run.record.group) if self.run else ""

    @property
    def note(self) -> str:
        """What the person at the bench wrote down; empty for a data file."""
        return in_one_line(self.run.record.note) if self.run else ""

    @property
    def synthetic(self) -> bool:
        """Whether any of it is known to be simulated or made up."""
        return bool(self.run and self.run.record.synthetic)

    def settings(self, experiment: str) -> dict[str, Any]:
        """Return the settings of the run's experiment; empty where none are recorded."""
        table = self.run.record.configuration.get(experiment) if self.run else None
        return table if isinstance(table, dict) else {}

    @property
    def time_zero(self) -> datetime | None:
        """When the clock of the readings was zero, in local time; None where that is not known."""
        return local(self.run.record.time_zero_utc) if self.run else None

    @property
    def start(self) -> datetime | None:
        """When it was measured, in local time: time zero, or else the start of the run."""
        return self.time_zero or (local(self.run.record.started_utc) if self.run else None)


def mark_of(sources: Sequence[Source[Any]]) -> str:
    """Return the mark of a table with numbers of these inputs; empty where none is synthetic."""
    made_up = [source.name for source in sources if source.synthetic]
    if not made_up:
        return ""
    return "SYNTHETIC." if len(made_up) == len(sources) else f"SYNTHETIC IN PART ({list_in_words(made_up)})."


@dataclass(frozen=True)
class SkippedRuns:
    """Runs of an experiment that the analysis is not for."""

    experiment: str
    count: int

    def __str__(self) -> str:
        return how_many(self.count, f"{self.experiment} run")


@dataclass(frozen=True)
class Skipped:
    """A run or a file that is not taken.

    Attributes:
        reason: why, with its path.
        kind: skipped ones of one kind are alike.
        path: of what cannot be used.
    """

    reason: str
    kind: str = ""
    path: Path | None = None

    def __str__(self) -> str:
        return Text("skipped {things}", things=self.reason)

    @property
    def note(self) -> Note:
        """A note, whose `skipped` is this."""
        return Note(f"skipped {self.kind}".rstrip(), str(self), names_input=True, skipped=self)


@dataclass(frozen=True)
class LeftOut:
    """A file of a folder that no analysis which was asked for reads.

    Attributes:
        kind: of file, with what to do.
        why: the reason of the one analysis that was asked for, of a table with columns that it reads; else empty.
    """

    path: Path
    kind: Kind = field(compare=False)
    why: str = field(default="", compare=False)

    def __str__(self) -> str:
        return in_words([self])


class NothingSuits(DoesNotSuit):
    """A folder without anything for an analysis.

    Attributes:
        left_out: the files in it.
    """

    def __init__(self, text: str, left_out: tuple[LeftOut, ...]) -> None:
        self.left_out = left_out
        super().__init__(text)


#: Of texts and spreadsheets.
OTHER_COLUMNS = Kind("a table with other columns", "name one to see why", plural="tables with other columns")
#: Of the right columns, as of a top that does not fall.
UNSUITABLE = Kind("a table that does not suit", "name one to see why", plural="tables that do not suit")
#: Files of a kind that are named beside their number, and files of a folder with names at all, and what to do.
_NAMED, FEW = 2, 8


def in_words(left_out: Sequence[LeftOut]) -> str:
    """Return the files that hold nothing to analyze, as one line."""
    return Text("nothing to analyze in {files}", files=files_by_kind(left_out))


def _by_kind(left_out: Sequence[LeftOut]) -> dict[Kind, list[str]]:
    kinds: dict[Kind, list[str]] = {}
    for one in left_out:
        kinds.setdefault(one.kind, []).append(one.path.name)
    return kinds


def number_by_kind(left_out: Sequence[LeftOut]) -> tuple[str, ...]:
    """Return the number of files of each kind."""
    return tuple(
        Text("{n} {things}", n=len(names), things=kind.several) if len(names) > 1 else kind.name
        for kind, names in _by_kind(left_out).items()
    )


def files_by_kind(left_out: Sequence[LeftOut]) -> str:
    """Return the files by kind and number, with what to do."""
    kinds = _by_kind(left_out)
    texts = []
    for (kind, names), count in zip(kinds.items(), number_by_kind(left_out), strict=True):
        named = ", ".join([*names[:_NAMED], *["…"] * (len(names) > _NAMED)])
        with_advice = "{count} ({names:s}: {advice})" if kind.advice else "{count} ({names:s})"
        texts.append(Text(with_advice, count=count, names=named, advice=kind.advice))
    if max(map(len, kinds.values()), default=0) > _NAMED:
        texts.append(Text("levilab analyze --json names all"))
    return Sentences(*texts, between="; ")


#: What lies in a folder and is no input, without a cause for a warning.
NotTaken = SkippedRuns | Skipped | LeftOut


@dataclass(frozen=True)
class Found(Generic[R]):
    """What lies at some paths.

    Attributes:
        warnings: about what cannot be used.
        remarks: about what does not belong to the analysis.
    """

    sources: tuple[Source[R], ...]
    warnings: tuple[str, ...] = ()
    remarks: tuple[NotTaken, ...] = ()


# --- finding the inputs --------------------------------------------------------------------------------


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
    own = _own(paths)
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
    remarks = tuple(remark for one in found for remark in one.remarks)
    return Found(_with_short_names(_by_group(sources)), tuple(warnings), remarks)


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
            warnings.append(of_file("same readings", Text(text, source.path, first.path)))
    return kept


def _with_short_names(sources: Sequence[Source[R]]) -> tuple[Source[R], ...]:
    """Give the sources names that differ: the last part of the path, or more of it."""
    names = short_paths([source.path for source in sources])
    named = [_name_for_people(source, name, sources) for source, name in zip(sources, names, strict=True)]
    names = named if len({*named}) == len(named) else names
    return tuple(replace(source, name=verbatim(name)) for source, name in zip(sources, names, strict=True))


def short_paths(paths: Sequence[Path]) -> list[str]:
    """Return the last parts of the paths by which they differ."""
    for parts in range(1, 10):
        names = ["/".join(path.resolve().parts[-parts:]) for path in paths]
        if max(Counter(names).values(), default=1) == 1:
            break
    return names


#: Letters of a note in the name of a group's run; the report has all of it.
_LETTERS_OF_NOTE = 20


def _name_for_people(source: Source[R], name: str, sources: Sequence[Source[R]]) -> str:
    """Return the group of a run; if the group has several, the run's name and the beginning of its note behind it.

    A run of no group keeps its name.
    """
    if not source.group:
        return name
    if sum(other.group == source.group for other in sources) == 1:
        return source.group
    note = source.note if len(source.note) <= _LETTERS_OF_NOTE else f"{source.note[: _LETTERS_OF_NOTE - 1]}…"
    return f"{source.group}, {short_name(name)}{f' ({note})' if note else ''}"


def _by_group(sources: Sequence[Source[R]]) -> Sequence[Source[R]]:
    """Return the runs of groups in the order of their names, "Group 2" before "Group 10", those of no group last."""
    return sorted(sources, key=lambda one: (not one.group, [*_natural(one.group)]))


def _natural(name: str) -> Iterator[tuple[float, str]]:
    """Yield the parts of a name, numbers as numbers, so that names are in a person's order."""
    for digits, letters in re.findall(r"([0-9]+)|([^0-9]+)", name):
        yield (float(digits), "") if digits else (math.inf, letters.casefold())


#: How the name of a run folder begins, to the second.
_SECOND = re.compile(r"\d{8}T\d{6}Z")


def _begun(source: Source[Any]) -> tuple[list[str], str, str]:
    """Return the place of a run among those of a folder: by name, but of one second by the time in its record."""
    *folders, name = source.path.parts
    second = _SECOND.match(name)
    return [*folders, second[0] if second else name], (source.run and source.run.record.started_utc) or "", name


def in_one_line(text: str) -> str:
    """Return what a person typed, without what does not print."""
    return "".join(c if c.isprintable() else " " for c in text).strip()


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
        raise DoesNotSuit(Text(other, path=run.folder, kind=f"{kind} run", analysis=needs.name, needed=needs.runs))
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
    broken: list[Skipped] = []
    remarks: list[NotTaken] = []
    others: Counter[str] = Counter()
    for folder in find_runs(root):
        chosen = options(folder)
        try:
            run = Run.load(folder)
            if goes_on := run.continued_in:
                remarks.append(Skipped(f"{folder}, which was broken off: its run goes on in {goes_on.name}"))
            elif needs.take(run):
                found.append(_of_run(run, needs, chosen))
            else:
                others[run.record.experiment] += 1
        except DataError as error:
            broken.append(Skipped(text_of(error), type(error).__name__, folder))
    found.sort(key=_begun)
    files = data_files(root)
    remarks += [LeftOut(file, kind_of_unused(file)) for file in other_files(root)]
    for file in files:
        with _skipping(file, broken, remarks):
            found += _at(file, needs, lambda path: replace(options(path), guess=False))
    kinds = [SkippedRuns(kind, count) for kind, count in sorted(others.items())]
    if not found:
        left_out = tuple(one for one in remarks if isinstance(one, LeftOut))
        text = Text("{path:s}: {why}", path=str(root), why=_nothing_found(needs, kinds, broken, left_out))
        if not broken:
            raise NothingSuits(text, left_out)
        raise NoneUsable(text, reasons={one.path: one.note for one in broken})
    return Found(tuple(found), tuple(one.note for one in broken), (*kinds, *remarks))


@contextmanager
def _skipping(file: Path, broken: list[Skipped], remarks: list[NotTaken]) -> Iterator[None]:
    """Note what is wrong with a data file that was found in a folder, or of which kind it is."""
    try:
        yield
    except NoRate as error:
        remarks.append(Skipped(text_of(error)))
    except DoesNotSuit as error:
        kind = OTHER_COLUMNS if isinstance(error, NoSuchColumn) else kind_of_unused(file)
        fits = kind is OTHER_COLUMNS and not isinstance(error, TableError)
        remarks.append(LeftOut(file, UNSUITABLE, text_of(error)) if fits else LeftOut(file, kind))
    except DataError as error:
        broken.append(Skipped(text_of(error), type(error).__name__, file))


def kind_of_unused(file: Path) -> Kind:
    """Return the kind of a file that no analysis reads."""
    try:
        kind = kind_of(file)
    except OSError as error:
        return Kind(
            f"a file that cannot be read ({error.strerror})", plural=f"files that cannot be read ({error.strerror})"
        )
    if kind is AUDIO:
        return replace(kind, advice=advice_on_sound())
    return OTHER_COLUMNS if kind is OTHER and file.suffix.casefold() in SEARCHED else kind


def data_files(root: Path) -> list[Path]:
    """Find the files at or below a folder that may hold data, by name; those of runs belong to their runs.

    A folder below with a file `SKIP` is left out, with all in it.
    """
    return sorted(path for path in _files(root) if path.suffix.casefold() in SEARCHED)


def other_files(root: Path) -> list[Path]:
    """Find the other files at or below a folder, but for those that levilab or a computer's desktop keeps there."""
    others = [path for path in _files(root) if path.suffix.casefold() not in SEARCHED]
    return sorted(set(others) - _own(others))


def _own(paths: Sequence[Path]) -> set[Path]:
    """Return those of files that levilab has written: results, their figures, corrections of columns."""
    results = [path for path in paths if _RESULT.search(path.name)]
    figures = {result.with_name(f"{_RESULT.sub('', result.name)}{_analysis_of(result)}.png") for result in results}
    return {*results, *(path for path in paths if path in figures or path.name.endswith(_CORRECTION))}


def _analysis_of(result: Path) -> str:
    """Return the name of the analysis that wrote a result; empty where it cannot be read."""
    try:
        return str(json.loads(result.read_bytes())["analysis"])
    except (OSError, ValueError, LookupError, TypeError):
        return ""


#: How names of files begin that are not a person's.
_OF_DESKTOPS = (".", "~$", "desktop.ini", "Thumbs.db", SKIP)
#: Tables that are saved with the result of a film, and this: results, and no further inputs of a folder.
_OF_FILM, _RESULT_OF_FILM = re.compile(r"(.+)\.(tracks|spin|limit)\.csv"), re.compile(r"(.+)\.\w+\.result\.video\.json")
#: How names of files end that levilab writes beside what it reads.
_RESULT, _CORRECTION = re.compile(r"result(\.\w+)?\.json$"), ".levilab.toml"


def _files(root: Path) -> list[Path]:
    """Return the files at or below a folder that belong to no run."""
    found, seen = [], set()
    for folder, below, files in os.walk(root, followlinks=True):
        real = os.path.realpath(folder)
        if real in seen or RECORD in files or (SKIP in files and Path(folder) != root):
            below.clear()
            continue
        seen.add(real)
        films = {film[1] for name in files if (film := _RESULT_OF_FILM.fullmatch(name))}
        own = {name for name in files if (table := _OF_FILM.fullmatch(name)) and table[1] in films}
        found += [Path(folder) / name for name in files if name not in own and not name.startswith(_OF_DESKTOPS)]
    return found


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
