"""result.json: what every analysis writes into it, where it lies, and reading it back."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cache, partial
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Generic, Literal, Self, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, ValidationError, model_validator
from pydantic_core import core_schema

from analysis.budget import Budget, Component
from levilab.errors import DataError
from levilab.files import as_json, finite, parse_json, replace_atomically, writing
from levilab.formats.texts import locate
from levilab.pipelines.inputs.source import Source
from levilab.runs.find import RECORD
from levilab.settings import in_one_line
from levilab.software import software_versions
from levilab.texts.text import Text


@dataclass(frozen=True)
class Dump:
    """Annotation of a field of a pydantic model whose type is a frozen dataclass, or holds some.

    The file has the attributes by their names.  An array is a list, with null for NaN; a mapping is a list of pairs,
    because files sort their keys and the order of parameters counts.  An unknown attribute is one of a newer version,
    and ignored; a missing one takes its default.

    Attributes:
        extra: class → properties that are written for people, and not read.
        pairs: whether the order of mappings counts; a mapping is a table where it does not.

    >>> from pydantic import BaseModel
    >>> from typing import Annotated
    >>> from analysis.uncertainty import Estimate
    >>> class Entry(BaseModel):
    ...     found: Annotated[dict[str, Estimate], Dump()]
    >>> entry = Entry(found={"c2": Estimate(2.0, None, "1/rad"), "c1": Estimate(1.0, 0.5, "1/s")})
    >>> Entry.model_validate_json(entry.model_dump_json()).found == entry.found
    True
    """

    extra: Mapping[type, tuple[str, ...]] = field(default_factory=dict)
    pairs: bool = True

    def __get_pydantic_core_schema__(self, kind: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """Return the schema of the type, for JSON before and behind it."""
        return core_schema.no_info_before_validator_function(
            partial(_from_json, kind),
            handler(kind),
            serialization=core_schema.plain_serializer_function_ser_schema(self._as_json),
        )

    def _as_json(self, value: Any) -> Any:
        if is_dataclass(value):
            names = (*(one.name for one in fields(value)), *self.extra.get(type(value), ()))
            return {name: self._as_json(getattr(value, name)) for name in names}
        if isinstance(value, Mapping):
            items = {name: self._as_json(one) for name, one in value.items()}
            return list(map(list, items.items())) if self.pairs else items
        if isinstance(value, list | tuple):
            return [self._as_json(one) for one in value]
        return finite(value.tolist() if isinstance(value, np.ndarray | np.generic) else value)


def _from_json(kind: Any, data: Any) -> Any:
    """Put arrays and mappings in the place of lists where a type has them; what is damaged stays as it is."""
    origin, of = get_origin(kind) or kind, get_args(kind)
    if origin in (Union, UnionType):
        return data if data is None else _from_json(next(one for one in of if one is not type(None)), data)
    if origin is float and data is None:
        return math.nan
    if isinstance(data, dict) and is_dataclass(origin):
        hints = _types(cast("type", origin))
        return {name: _from_json(hints.get(name), one) for name, one in data.items()}
    return _from_list(origin, of, data) if isinstance(data, list) and isinstance(origin, type) else data


def _from_list(kind: type, of: tuple[Any, ...], data: list[Any]) -> Any:
    """Return a list as an array or a mapping where the type is one; else its items converted."""
    if kind is np.ndarray:
        return _array(data)
    if issubclass(kind, Mapping):
        pairs = all(isinstance(one, list) and len(one) == 2 and isinstance(one[0], str) for one in data)
        return {name: _from_json(of[1], one) for name, one in data} if pairs else data
    kinds = of if kind is tuple and of[-1:] != (...,) else of[:1] * len(data)
    return [_from_json(*pair) for pair in zip(kinds, data, strict=True)] if len(kinds) == len(data) else data


@cache
def _types(kind: type) -> dict[str, Any]:
    """Return the types of the attributes of a class."""
    return get_type_hints(kind)


def _array(numbers: list[Any]) -> Any:
    """Return an array of numbers, or the list itself where there is none."""
    try:
        return np.array(numbers, dtype=np.float64)
    except (TypeError, ValueError):
        return numbers


SCHEMA: Literal["levilab-result/1"] = "levilab-result/1"
RESULT = "result.json"
AGAIN = "analyze again with levilab analyze"
_AGAIN_OR_AWAY = Text("{again}, or move the file away", AGAIN)


# --- what is in it -------------------------------------------------------------------------------------


class Part(BaseModel):
    """A part of a result.  Keys that are not known here are of a newer version, and passed over."""

    model_config = ConfigDict(frozen=True, validate_by_name=True, validate_by_alias=True, arbitrary_types_allowed=True)


class Value(Part):
    """A quantity: a mean over runs has their scatter and says how many there were.

    group: number of the group of inputs that it is of, from 0; None: of all inputs.
    """

    value: float | None
    u: float | None
    unit: str
    interval_68: tuple[float, float] | None = None
    scatter: float | None = Field(default=None, ge=0)
    runs: int | None = Field(default=None, ge=2)
    group: int | None = Field(default=None, ge=0)

    @model_validator(mode="after")
    def _scatter_is_of_runs(self) -> Self:
        if self.scatter is not None and self.runs is None:
            raise ValueError("a scatter does not say of how many runs it is")
        return self


class Input(Part):
    """A data file, by its path relative to the result."""

    path: str
    sha256: str


#: Rows of a budget with what they contribute, and what is known beside u.
Budgets = Annotated[tuple[Budget, ...], Dump({Budget: ("u_with_all",), Component: ("contribution",)})]


#: Further entries are written for people and other programs: levilab does not read them.
_FOR_OTHERS = ConfigDict(extra="allow")


class Model(Part):
    """A model that was fitted."""

    model_config = _FOR_OTHERS

    name: str
    parameters: dict[str, Value]
    covariance: tuple[tuple[float | None, ...], ...] | None
    statistics: dict[str, Any]


class RunPart(Part):
    """One input by itself.

    result: the dataclass of the analysis; an analysis says which.
    """

    model_config = _FOR_OTHERS

    path: str
    group: str = ""
    synthetic: bool
    values: dict[str, Value]
    models: tuple[Model, ...] = ()
    warnings: tuple[str, ...]
    budget: Budgets = ()
    result: Any


class Result(Part):
    """What results of all analyses have in common.

    combined: what was found of all inputs together; None where the analysis combines nothing.
    """

    model_config = _FOR_OTHERS

    schema_: Literal["levilab-result/1"] = Field(alias="schema")
    analysis: str
    inputs: tuple[Input, ...]
    synthetic: bool
    software: dict[str, str]
    settings: Any
    values: dict[str, Value]
    models: tuple[Model, ...] = ()
    runs: tuple[Any, ...]
    warnings: tuple[str, ...]
    budget: Budgets = ()
    combined: Any = None

    @model_validator(mode="after")
    def _one_run_an_input(self) -> Self:
        if not self.runs or len(self.runs) != len(self.inputs):
            raise ValueError(f"{len(self.inputs)} inputs but {len(self.runs)} runs")
        return self

    def as_dict(self) -> dict[str, Any]:
        """Return the result as it stands in the file."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)


def relative(path: Path, folder: Path) -> str:
    """Return a path from a folder, with forward slashes; the whole path where there is no way (another drive)."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return path.resolve().as_posix()


# --- where it lies -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Place:
    """Where results belong: a folder, and the name of the data file that they are of, if they are of one.

    No two files share a name: an analysis has no dot in its name and is not called "result".
    """

    folder: Path
    name: str = ""

    def result(self, analysis: str = "") -> Path:
        """Return the file of the result: of the analysis that is first here, or of another one by its name."""
        return self.file(f"result.{analysis}.json" if analysis else RESULT)

    def results(self, analysis: str) -> tuple[Path, Path]:
        """Return the files that may hold the result of an analysis."""
        return self.result(), self.result(analysis)

    def figure(self, analysis: str) -> Path:
        """Return the file of the figure."""
        return self.file(f"{analysis}.png")

    def file(self, name: str) -> Path:
        """Return the file of a name here."""
        return self.folder / (f"{self.name}.{name}" if self.name else name)


def beside(path: Path) -> Place:
    """Return the place of the result of a run folder, or of a data file: by its whole name, which is its alone."""
    file, inside = locate(path)
    name = ".".join(filter(None, (file.name, inside.replace("/", "."))))
    return Place(path) if path.is_dir() else Place(file.parent, name)


def place_of(paths: Sequence[Path], sources: Sequence[Source[Any]]) -> Place:
    """Return the place of the result of inputs: beside a single one; of several see `_together`."""
    return beside(sources[0].path) if len(sources) == 1 else _together(paths)


def _together(paths: Sequence[Path]) -> Place:
    """Return the folder that was searched for several inputs, else the present one, or the one above a present run.

    Of the runs in one file it is that of the file.
    """
    if len(paths) == 1:
        return beside(paths[0])
    return Place(Path("..") if Path(RECORD).exists() else Path())


def save(
    result: Result, place: Place, picture: bytes | None, tables: Mapping[str, str] | None = None, *, first: bool = True
) -> list[Path]:
    """Write a result, its figure and tables; returns the files.  Raises CannotWrite.

    Args:
        result: what is written.
        place: where.
        picture: the figure, as PNG; None: none is written.
        tables: for other analyses, by the names of their files.
        first: whether the analysis is the first here, so that result.json is its own.
    """
    text = as_json(result.as_dict())
    files = [place.result("" if first else result.analysis)]
    advice = "choose another place with `out`, or print only with `save` = False"
    with writing(f"the result could not be written into {place.folder}", advice):
        place.folder.mkdir(parents=True, exist_ok=True)
        if picture is not None:  # before the result: a reader that finds that shows the figure with it
            files.append(place.figure(result.analysis))
            replace_atomically(files[1], picture)
        for name, table in (tables or {}).items():
            files.append(place.folder / name)
            replace_atomically(files[-1], table)
        replace_atomically(files[0], text + "\n")
    return files


# --- reading it back -----------------------------------------------------------------------------------

R = TypeVar("R", bound=Result)
T = TypeVar("T")


class ResultError(DataError):
    """A result that cannot be used."""


class NoResult(ResultError):
    """A file of that name that no levilab wrote."""


def read_result(path: Path, model: type[R]) -> R | None:
    """Read a result that was written before; None where there is none, or one of another analysis.

    Raises ResultError when it is damaged or of another schema.
    """
    if not path.is_file():
        return None
    data = _read(path)
    if data.get("analysis") != model.model_fields["analysis"].default:
        return None
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise ResultError("{path:s}: {problem:s}; {do}", path, in_one_line(error), _AGAIN_OR_AWAY) from error


def is_of_another(path: Path, analysis: str) -> bool:
    """Return whether a file holds the result of another analysis than this."""
    try:
        return path.is_file() and _read(path).get("analysis") != analysis
    except ResultError:
        return False


def _read(path: Path) -> dict[str, Any]:
    """Read a result as it stands in the file.  Raises NoResult for another program's file, else ResultError."""
    try:
        data = parse_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultError("{path:s}: cannot be read ({why:s}); {do}", path, error.strerror, _AGAIN_OR_AWAY) from error
    except ValueError as error:
        raise NoResult("{path:s}: is cut off or not JSON ({why}); {do}", path, error, _AGAIN_OR_AWAY) from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        seen = data.get("schema") if isinstance(data, dict) else type(data).__name__
        ours = isinstance(seen, str) and seen.startswith("levilab-result/")
        said = "{path:s}: schema is {seen:s}, expected {schema:s} of this version; {do}"
        raise (ResultError if ours else NoResult)(said, path, repr(seen)[:60], repr(SCHEMA), _AGAIN_OR_AWAY)
    return data


@dataclass(frozen=True)
class Written:
    """A result that was named by its own path.

    Attributes:
        inputs: the run folders and data files that it says it is of.
    """

    file: Path
    analysis: str
    inputs: tuple[Path, ...]


def read_inputs(path: Path) -> Written:
    """Read of which inputs a result is.

    Raises NoResult for another program's file, ResultError for damage or an input that is gone.
    """
    data = _read(path)
    try:
        written = _Head.model_validate(data)
    except ValidationError as error:
        raise ResultError("{path:s}: {problem:s}; {do}", path, in_one_line(error), _AGAIN_OR_AWAY) from error
    inputs = tuple(path.parent / run.path for run in written.runs)
    for one in inputs:
        if not locate(one)[0].exists():
            said = "{path:s}: is of {one:s}, which is not there: name the run or data file where it lies now"
            raise ResultError(said, path, one)
    return Written(path, written.analysis, inputs)


class _Run(Part):
    path: str


class _Head(Part):
    """What says of which analysis and inputs a result is."""

    analysis: str
    runs: tuple[_Run, ...]


def results_in(folder: Path) -> list[Written]:
    """Read the results that lie in a folder, by name; files of other programs are skipped.  Raises ResultError."""
    found = []
    for file in sorted(folder.glob("*.json")):
        if "result" in file.name.split("."):
            with suppress(NoResult):
                found.append(read_inputs(file))
    return found


@dataclass(frozen=True)
class Earlier(Generic[R]):
    """An input as it was found in a result written before.

    Attributes:
        file: the result.
        number: of the input in it.
    """

    file: Path
    result: R
    number: int = 0

    @property
    def sha256(self) -> str:
        """Of the data file at that time."""
        return self.result.inputs[self.number].sha256

    @property
    def part(self) -> Any:
        """What the result says of the input."""
        return self.result.runs[self.number]

    @property
    def text(self) -> str:
        """Where it comes from, for people."""
        then = self.result.software
        if then == software_versions():
            return Text("as levilab analyze found it: {file}", file=self.file)
        version = then.get("levilab", "?")
        return Text("as levilab analyze found it, by levilab {version:s}: {file}", version=version, file=self.file)

    def of(self, source: Source[Any]) -> Earlier[R]:
        """Return the same of another input of the result."""
        number = next(k for k, given in enumerate(self.result.inputs) if given.sha256 == source.sha256)
        return replace(self, number=number)


class Archive(Generic[R]):
    """The results that were written before, where the paths of a command lead to them.

    Args:
        paths: run folders, data files, folders to search.
        model: of the analysis.
        files: results that lie elsewhere; they go before all others.
    """

    def __init__(self, paths: Sequence[Path], model: type[R], files: Sequence[Path] = ()) -> None:
        self._model = model
        self._analysis: str = model.model_fields["analysis"].default
        self._read: dict[Path, R | None] = {}
        self._known: dict[Path, dict[str | Path, int]] = {}
        several = len(paths) > 1 or not any((path / RECORD).exists() for path in paths)
        self._named = tuple(files)
        self._together = _together(paths).results(self._analysis) if several else ()
        if len(paths) > 1:
            for file in self._together:  # what lies in the present folder may as well be another program's
                with suppress(NoResult):
                    self._result(file)
                self._read.setdefault(file, None)

    def whole(self, sources: Sequence[Source[Any]]) -> Earlier[R] | None:
        """Return the result of just these inputs, unchanged, none of which was analyzed again by itself since."""
        files = beside(sources[0].path).results(self._analysis) if len(sources) == 1 else self._together
        wanted = sorted(source.sha256 for source in sources)
        for file in (*self._named, *files):
            result = self._result(file)
            if result and sorted(given.sha256 for given in result.inputs) == wanted:
                each = (self.earlier(source.path, source.data, source.sha256) for source in sources)
                return Earlier(file, result) if all(one and one.file == file for one in each) else None
        return None

    def earlier(self, path: Path, data: Path, sha256: str | None = None) -> Earlier[R] | None:
        """Return the result of an input: of the same bytes if there is such a result, else of the same path.

        Args:
            path: the run folder or the data file.
            data: the file with the readings.
            sha256: of that file.
        """
        files = self._files(path)
        keys: list[str | Path] = [sha256] if sha256 else []
        for key in (*keys, data.resolve()):
            for file in files:
                number = self._numbers(file).get(key)
                if number is not None:
                    result = self._result(file)
                    assert result
                    return Earlier(file, result, number)
        return None

    def _files(self, path: Path) -> list[Path]:
        """Return where the result of an input may lie."""
        written = filter(Path.exists, (*self._together, *beside(path).results(self._analysis)))
        own = [*self._named, *sorted(written, key=lambda file: -file.stat().st_mtime_ns)]
        above = Place(path.parent).results(self._analysis)
        for file in above:
            if file not in own:
                self._result_above(file)
        return [*own, *above]

    def _numbers(self, file: Path) -> dict[str | Path, int]:
        """Return the inputs of a result by their hash and by their path."""
        if file not in self._known:
            result = self._result(file)
            inputs = result.inputs if result else ()
            self._known[file] = {given.sha256: k for k, given in enumerate(inputs)}
            self._known[file] |= {(file.parent / given.path).resolve(): k for k, given in enumerate(inputs)}
        return self._known[file]

    def _result(self, file: Path) -> R | None:
        if file not in self._read:
            self._read[file] = read_result(file, self._model)
        return self._read[file]

    def _result_above(self, file: Path) -> R | None:
        """Read a result above a run, or beside a data file; None where it is another program's file."""
        try:
            return self._result(file)
        except ResultError:
            return self._read.setdefault(file, None)
