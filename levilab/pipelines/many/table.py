"""Many inputs → one table, in parallel; an input that fails has a row with its problem."""

from __future__ import annotations

import os
from collections import Counter
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from levilab.errors import DataError, NoneUsable
from levilab.formats.texts import locate
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.many.file import TableFile, check_name
from levilab.pipelines.many.one import PassedOver, Row, Task, analyze_one, columns_of, name_of, row
from levilab.pipelines.sources import data_files, sha256_of
from levilab.runs.find import RECORD, find_run, no_such_path, run_folders
from levilab.software import software_versions
from levilab.workers import processes, results_of, this_process

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from levilab.pipelines.document import Analysis
    from levilab.workers import Done

#: Failures that are kept for messages; all stand in the table.
MOST_FAILURES = 10


@dataclass
class Tally:
    """Counts of the inputs of a table.

    Attributes:
        total: inputs that were found.
        kept: rows of an earlier call.
        done: inputs that have an outcome, those of an earlier call included.
        failed: of the rows of this call.
        failures: the first of them, (path, problem).
        left_out: inputs that do not belong into the table.
        passed_over: why → how many of them; without files that hold no readings.
        same: rows of this call with the same readings as another one.
    """

    total: int
    kept: int = 0
    done: int = 0
    failed: int = 0
    failures: list[tuple[str, str]] = field(default_factory=list)
    left_out: int = 0
    passed_over: Counter[str] = field(default_factory=Counter)
    same: int = 0
    _seen: set[bytes] = field(default_factory=set)

    @property
    def rows(self) -> int:
        """Rows of the table."""
        return self.done - self.left_out

    def count(self, outcome: Row | PassedOver) -> None:
        """Count an input."""
        self.done += 1
        if isinstance(outcome, PassedOver):
            self.left_out += 1
            if outcome.why:
                self.passed_over[outcome.why] += 1
            return
        if outcome.problem:
            self.failed += 1
            if len(self.failures) < MOST_FAILURES:
                self.failures.append((str(outcome.cells[0]), outcome.problem))
        if outcome.sha256:
            readings = bytes.fromhex(outcome.sha256)
            self.same += readings in self._seen
            self._seen.add(readings)


def write_table(
    analysis: Analysis[Any],
    paths: Sequence[Path],
    given: Mapping[str, Any],
    table: Path,
    *,
    cores: int | None = None,
    resume: bool = False,
    save: bool = False,
    show: Callable[[Tally], None] = lambda _: None,
) -> Tally:
    """Analyze each input by itself, and write a row of each into a table; its rows are in the order of the paths.

    Args:
        analysis: a row of the catalogue.
        paths: run folders, data files, folders to search.
        given: options by their names.
        table: the file, which ends in .csv or .parquet.
        cores: processes that analyze, 1: this one alone; None: one for each core.
        resume: whether rows of an earlier call are kept, if their readings are the same still, and only the inputs that
            failed, have changed or are new are analyzed.
        save: whether a result.json, without its figure, is written beside each input.
        show: called after each input.

    Raises:
        DataError: no input was found.
        UsageError: of the table's name, or an earlier call had other options.
        CannotWrite: of the table.
    """
    check_name(table)
    options = analysis.options_from(given)
    folder = table.parent
    found = {name_of(Path(path), folder): (path, is_run, searched) for path, is_run, searched in inputs(paths)}
    if not found:
        raise NoneUsable(f"{paths[0]}: holds no run and no data file; name run folders, or a folder with some of them")
    made_with = {
        "analysis": analysis.name,
        "settings": analysis.settings(options).model_dump(mode="json", by_alias=True),
        "software": software_versions(),
    }
    tally = Tally(len(found))
    with TableFile(table, columns_of(analysis), made_with).open(resume=resume) as file:
        for name, (path, is_run, _) in found.items():
            if name not in file:
                continue
            if _hash(Path(path, analysis.data) if is_run else Path(path)) == file.sha256(name):
                tally.kept += 1
                tally.done += 1
            else:  # its readings are others now
                file.forget(name)
        show(tally)
        tasks = (
            Task(Path(path), is_run, searched, analysis.name, options, folder, save)
            for name, (path, is_run, searched) in found.items()
            if name not in file
        )
        workers = this_process() if cores == 1 or tally.total - tally.done <= 1 else processes(cores)
        with closing(results_of(analyze_one, tasks, workers)) as results:
            for done in results:
                outcome = _outcome(done)
                if isinstance(outcome, Row):
                    file.add(outcome.cells)
                tally.count(outcome)
                show(tally)
        file.publish(found)
    return tally


def _hash(readings: Path) -> str | None:
    """Return the hash of a file; None if it cannot be read any more."""
    try:
        return sha256_of(readings)
    except DataError:
        return None


def _outcome(done: Done[Task, Row | PassedOver]) -> Row | PassedOver:
    """Return the outcome of an input; one that killed its processes has a row with that problem."""
    if done.result is not None:
        return done.result
    task = done.task
    about = {"path": name_of(task.path, task.folder), "problem": f"its analysis ended its process: {done.error}"}
    return row(ANALYSES[task.analysis], about, None)


def inputs(paths: Sequence[Path]) -> Iterator[tuple[str, bool, bool]]:
    """Find each input, with whether it is a run and whether a search found it: in the order of the paths, by name.

    As text: a Path takes a kilobyte.  Raises DataError for a path that does not exist.
    """
    for path in map(find_run, paths):
        if not locate(path)[0].exists():
            raise no_such_path(path)
        yield from _below(path)


def _below(path: Path) -> Iterator[tuple[str, bool, bool]]:
    if not path.is_dir() or (path / RECORD).exists():
        yield str(path), path.is_dir(), False
        return
    files = [str(file) for file in data_files(path)]
    found = [*((run, True, True) for run in run_folders(path)), *((file, False, True) for file in files)]
    yield from sorted(found, key=lambda one: one[0].split(os.sep))  # noqa: PTH206 - as text, see `inputs`
