"""The way from paths on the command line to the readings of an analysis."""

from __future__ import annotations

import hashlib
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Generic, Protocol, Self, TypeVar

from levilab.errors import DataError, DoesNotSuit
from levilab.formats.table import Table, read_table
from levilab.runs.run import READINGS, RECORD, Run, find_runs

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from analysis.spindown.lawfit import Uncertainty
    from levilab.formats.device import Device


@dataclass(frozen=True)
class Options:
    """How to analyze.

    columns: the data file's own names; reading_u: of every reading [Hz], in the place of what the data say;
    bootstrap_samples, seed: of the bootstrap, where it is asked for; orthogonal: a line with uncertainties along both
    axes.  Of scans of a field: device: what calliper and data sheet say; height_m, height_u_m: where the top was seen
    to float; free_radii: let the scan move the radii.
    """

    columns: Mapping[str, str] | None = None
    reading_u: float | None = None
    uncertainty: Uncertainty = "covariance"
    keep_outliers: bool = False
    bootstrap_samples: int = 1000
    seed: int = 0
    orthogonal: bool = False
    device: Device | None = None
    height_m: float | None = None
    height_u_m: float | None = None
    free_radii: bool = False


class Readings(Protocol):
    """What an analysis reads from a run or a file."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know before using them."""

    def __len__(self) -> int: ...

    def same_as(self, other: Self) -> bool:
        """Whether these are the same readings, written in another way perhaps."""


R = TypeVar("R", bound=Readings)


@dataclass(frozen=True)
class Needs(Generic[R]):
    """What an analysis needs of its inputs.

    analysis: its name; experiments: those whose runs suit it; quantities: columns of a data file that it looks at;
    read: from a table to readings, which raises DataError for what cannot be used.
    """

    analysis: str
    experiments: frozenset[str]
    quantities: tuple[str, ...]
    read: Callable[[Table], R]

    @property
    def runs(self) -> str:
        """Which runs suit, in words."""
        return " or ".join(sorted(self.experiments))


@dataclass(frozen=True)
class Source(Generic[R]):
    """One input.

    path: what was given or found; data: the file with the readings; sha256: of that file;
    run: None for a data file; name: for people, as short as tells it from the others; warnings: about the input.
    """

    path: Path
    data: Path
    sha256: str
    run: Run | None
    readings: R
    name: str
    warnings: tuple[str, ...] = ()

    @property
    def synthetic(self) -> bool:
        """Whether any of it is known to be simulated or made up."""
        return bool(self.run and self.run.record.synthetic)


@dataclass(frozen=True)
class Found(Generic[R]):
    """What lies at some paths.

    warnings: about what cannot be used; remarks: about what does not belong to the analysis.
    """

    sources: tuple[Source[R], ...]
    warnings: tuple[str, ...]
    remarks: tuple[str, ...]


# --- finding the inputs --------------------------------------------------------------------------------


def collect(paths: Sequence[Path], needs: Needs[R], columns: Callable[[Path], Mapping[str, str] | None]) -> Found[R]:
    """What lies at the paths that suits an analysis, the same data once, and what was passed over.

    A run folder or a file is taken, or refused with a reason; a folder is searched for runs, and what does not
    suit there is passed over.  Raises DataError.

    Args:
        paths: run folders, data files, folders to search.
        needs: of the analysis.
        columns: the names of the columns of a data file.
    """
    found: list[Source[R]] = []
    warnings: list[str] = []
    remarks: list[str] = []
    for path in paths:
        if path.is_dir() and not (path / RECORD).exists():
            here = _search(path, needs)
            found += here.sources
            warnings += here.warnings
            remarks += here.remarks
        else:
            found.append(_one(path, needs, columns))
    return Found(_named(_without_copies(found, warnings)), tuple(warnings), tuple(remarks))


def _without_copies(found: Sequence[Source[R]], warnings: list[str]) -> list[Source[R]]:
    """Copies of the same readings are no runs of their own: they would pass for agreement."""
    kept: dict[int, list[Source[R]]] = {}
    for source in found:
        alike = kept.setdefault(len(source.readings), [])
        first = next((other for other in alike if other.readings.same_as(source.readings)), None)
        if first is None:
            alike.append(source)
        elif first.data.resolve() != source.data.resolve():
            warnings.append(f"{source.path}: holds the same readings as {first.path}, counted once")
    return [source for source in found if any(source is one for one in kept[len(source.readings)])]


def _named(sources: Sequence[Source[R]]) -> tuple[Source[R], ...]:
    """Names that differ: the last part of the path, or as many more as it takes."""
    for parts in range(1, 10):
        names = ["/".join(source.path.resolve().parts[-parts:]) for source in sources]
        if max(Counter(names).values(), default=1) == 1:
            break
    return tuple(replace(source, name=name) for source, name in zip(sources, names, strict=True))


def _one(path: Path, needs: Needs[R], columns: Callable[[Path], Mapping[str, str] | None]) -> Source[R]:
    if not path.exists():
        raise DataError(f"{path}: there is no such file or folder")
    if path.is_dir():
        return _of_run(Run.load(path), needs)
    if path.name == READINGS and (path.parent / RECORD).exists():
        try:
            return _of_run(Run.load(path.parent), needs)
        except DataError:  # its record is damaged; that the readings can be saved is what they are text for
            doubt = f"{path}: its run.json cannot be used, so whether it is SYNTHETIC is not known"
            source = _of_file(path, needs, columns(path))
            return replace(source, warnings=(*source.warnings, doubt))
    return _of_file(path, needs, columns(path))


def _of_file(path: Path, needs: Needs[R], columns: Mapping[str, str] | None) -> Source[R]:
    readings = needs.read(read_table(path, columns=columns, quantities=needs.quantities))
    return Source(path, path, sha256_of(path), None, readings, path.name, readings.warnings)


def _of_run(run: Run, needs: Needs[R]) -> Source[R]:
    if run.record.experiment not in needs.experiments:
        kind = run.record.experiment
        raise DoesNotSuit(f"{run.folder}: holds a {kind} run, {needs.analysis} needs a {needs.runs} run")
    data = run.folder / READINGS
    readings = needs.read(run.readings())
    warnings = (*readings.warnings, *run.warnings())
    return Source(run.folder, data, sha256_of(data), run, readings, run.folder.name, warnings)


def sha256_of(path: Path) -> str:
    """The hash of a file.  Raises DataError."""
    if path.exists() and not path.is_file():  # reading from a pipe would wait for ever
        raise DataError(f"{path}: is a folder, a pipe or a device; a file is expected")
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from error


def _search(root: Path, needs: Needs[R]) -> Found[R]:
    """The runs below a folder that suit; what is broken or too short is passed over with a warning."""
    found: list[Source[R]] = []
    broken: list[str] = []
    others: Counter[str] = Counter()
    for folder in find_runs(root):
        try:
            run = Run.load(folder)
            if run.record.experiment in needs.experiments:
                found.append(_of_run(run, needs))
            else:
                others[run.record.experiment] += 1
        except DataError as error:
            broken.append(f"passed over: {error}")
    if not found:
        text = f"{root}: {_nothing_found(root, needs, others, broken)}"
        raise DataError(text) if broken else DoesNotSuit(text)
    kinds = [f"passed over: {count} {kind} run{'s' * (count > 1)}" for kind, count in sorted(others.items())]
    return Found(tuple(found), tuple(broken), tuple(kinds))


def _nothing_found(root: Path, needs: Needs[Any], others: Counter[str], broken: list[str]) -> str:
    files = [path.name for path in sorted(root.iterdir()) if path.suffix.lower() in {".csv", ".txt", ".dat", ".tsv"}]
    seen = [f"{count} {kind} run{'s' * (count > 1)}" for kind, count in sorted(others.items())]
    seen += [f"{len(broken)} that cannot be used, as {broken[0].removeprefix('passed over: ')}"] if broken else []
    seen += [f"{len(files)} data file{'s' * (len(files) > 1)}, as {files[0]}"] if files else []
    what = f"found only {'; '.join(seen)}" if seen else "found nothing"
    return f"no {needs.runs} run to analyze in this folder ({what}); name a run folder or a data file"
