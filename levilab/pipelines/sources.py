"""Which analysis suits which runs, and the way from paths on the command line to results."""

from __future__ import annotations

import hashlib
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from levilab.errors import DataError
from levilab.formats.table import read_table
from levilab.pipelines.spindown.readings import Readings, spin_readings
from levilab.runs.run import READINGS, RECORD, Run, find_runs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from analysis.spindown.lawfit import Uncertainty

#: Analysis: the experiments whose runs suit it.
SUITS = {"spindown": frozenset({"spin"})}
#: What a spin-down needs of a data file.
QUANTITIES = ("time_s", "spin_frequency_hz", "spin_frequency_u_hz")


@dataclass(frozen=True)
class Options:
    """How to analyze.

    columns: the data file's own names; reading_u: of every reading [Hz], in the place of what the data say;
    bootstrap_samples, seed: of the bootstrap, where it is asked for.
    """

    columns: Mapping[str, str] | None = None
    reading_u: float | None = None
    uncertainty: Uncertainty = "covariance"
    keep_outliers: bool = False
    bootstrap_samples: int = 1000
    seed: int = 0


@dataclass(frozen=True)
class Source:
    """One input.

    path: what was given or found; data: the file with the readings; sha256: of that file;
    run: None for a data file; name: for people, as short as tells it from the others.
    """

    path: Path
    data: Path
    sha256: str
    run: Run | None
    readings: Readings
    name: str

    @property
    def synthetic(self) -> bool:
        """Whether any of it is known to be simulated or made up."""
        return bool(self.run and self.run.record.synthetic)


# --- finding the inputs --------------------------------------------------------------------------------


def collect(paths: Sequence[Path], analysis: str, options: Options) -> tuple[tuple[Source, ...], tuple[str, ...]]:
    """What lies at the paths that suits an analysis, the same data once, and what was passed over.

    A run folder or a file is taken, or refused with a reason; a folder is searched for runs, and what does not
    suit there is passed over.  Raises DataError.
    """
    found: list[Source] = []
    warnings: list[str] = []
    for path in paths:
        if path.is_dir() and not (path / RECORD).exists():
            sources, passed_over = _search(path, analysis)
            warnings += passed_over
        else:
            sources = [_one(path, analysis, options)]
        found += sources
    return _named(_once(found, warnings)), tuple(warnings)


def _once(found: Sequence[Source], warnings: list[str]) -> list[Source]:
    """Copies of the same readings are no runs of their own: they would pass for agreement."""
    kept: dict[str, Source] = {}
    for source in found:
        first = kept.setdefault(source.sha256, source)
        if first.data.resolve() != source.data.resolve():
            warnings.append(f"{source.path}: holds the same readings as {first.path}, counted once")
    return list(kept.values())


def _named(sources: Sequence[Source]) -> tuple[Source, ...]:
    """Names that differ: the last part of the path, or as many more as it takes."""
    for parts in range(1, 10):
        names = ["/".join(source.path.resolve().parts[-parts:]) for source in sources]
        if max(Counter(names).values(), default=1) == 1:
            break
    return tuple(replace(source, name=name) for source, name in zip(sources, names, strict=True))


def _one(path: Path, analysis: str, options: Options) -> Source:
    if not path.exists():
        raise DataError(f"{path}: there is no such file or folder")
    if path.is_dir():
        return _of_run(Run.load(path), analysis)
    if path.name == READINGS and (path.parent / RECORD).exists():
        try:
            return _of_run(Run.load(path.parent), analysis)
        except DataError:  # its record is damaged; that the readings can be saved is what they are text for
            doubt = f"{path}: its run.json cannot be used, so whether it is SYNTHETIC is not known"
            source = _of_file(path, options)
            return replace(source, readings=replace(source.readings, warnings=(*source.readings.warnings, doubt)))
    return _of_file(path, options)


def _of_file(path: Path, options: Options) -> Source:
    table = read_table(path, columns=options.columns, quantities=QUANTITIES)
    return Source(path, path, _sha256(path), None, spin_readings(table), path.name)


def _of_run(run: Run, analysis: str) -> Source:
    if run.record.experiment not in SUITS[analysis]:
        wanted = " or ".join(sorted(SUITS[analysis]))
        raise DataError(f"{run.folder}: holds a {run.record.experiment} run, {analysis} needs a {wanted} run")
    data = run.folder / READINGS
    return Source(run.folder, data, _sha256(data), run, spin_readings(run.readings()), run.folder.name)


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from error


def _search(root: Path, analysis: str) -> tuple[list[Source], list[str]]:
    """The runs below a folder that suit; what is broken, too short or of another kind is passed over and told."""
    found: list[Source] = []
    passed_over: list[str] = []
    others: Counter[str] = Counter()
    for folder in find_runs(root):
        try:
            run = Run.load(folder)
            if run.record.experiment in SUITS[analysis]:
                found.append(_of_run(run, analysis))
            else:
                others[run.record.experiment] += 1
        except DataError as error:
            passed_over.append(f"passed over: {error}")
    if not found:
        raise DataError(f"{root}: {_nothing_found(root, analysis, others, passed_over)}")
    kinds = [f"passed over: {count} {kind} run{'s' * (count > 1)}" for kind, count in sorted(others.items())]
    return found, [*passed_over, *kinds]


def _nothing_found(root: Path, analysis: str, others: Counter[str], broken: list[str]) -> str:
    wanted = " or ".join(sorted(SUITS[analysis]))
    files = [path.name for path in sorted(root.iterdir()) if path.suffix.lower() in {".csv", ".txt", ".dat", ".tsv"}]
    seen = [f"{count} {kind} run{'s' * (count > 1)}" for kind, count in sorted(others.items())]
    seen += [f"{len(broken)} that cannot be used, as {broken[0].removeprefix('passed over: ')}"] if broken else []
    seen += [f"{len(files)} data file{'s' * (len(files) > 1)}, as {files[0]}"] if files else []
    what = f"found only {'; '.join(seen)}" if seen else "found nothing"
    return f"no {wanted} run to analyze in this folder ({what}); name a run folder or a data file"
