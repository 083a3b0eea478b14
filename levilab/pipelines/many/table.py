"""Many inputs → one table, in parallel; an input that fails has a row with its problem."""

import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from levilab.errors import DataError, DoesNotSuit, unquote
from levilab.files import CannotWrite
from levilab.formats.texts import locate
from levilab.formats.waveforms.header import NoRate
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.document import Analysis
from levilab.pipelines.inputs.files import data_files
from levilab.pipelines.inputs.search import sha256_of
from levilab.pipelines.many.file import TableFile, check_name
from levilab.pipelines.options import InputOptions
from levilab.pipelines.result import relative
from levilab.pipelines.row import Cell, Column, entry, plain
from levilab.pipelines.suits import save
from levilab.runs.find import RECORD, find_run, no_such_path, run_folders
from levilab.runs.run import Run
from levilab.software import software_versions
from levilab.workers import Done, processes, results_of, this_process


@dataclass(frozen=True)
class Task:
    """One input.

    Attributes:
        path: a run folder or a data file.
        is_run: which of them.
        searched: it was found in a folder, so that what does not suit is passed over; else that is a failure.
        analysis: by its name.
        options: of the analysis.
        folder: of the table, from which the paths in it lead.
        save: whether result.json is written beside the input.
    """

    path: Path
    is_run: bool
    searched: bool
    analysis: str
    options: InputOptions
    folder: Path
    save: bool = False


@dataclass(frozen=True)
class Row:
    """The row of an input.

    Attributes:
        cells: one for each column of `columns_of`.
        problem: why it could not be analyzed; empty if it was.
        sha256: of its readings; None where there are none.
    """

    cells: tuple[Cell, ...]
    problem: str
    sha256: str | None


@dataclass(frozen=True)
class PassedOver:
    """An input that does not belong into the table.

    Attributes:
        why: such as "a trace run"; empty for a file that holds no readings.
    """

    why: str


#: The columns of the input itself, before and after those of the analysis.
HEAD = (
    entry("path", "text", "run folder or data file, from the table's folder"),
    entry("started_utc", "text", "when the run began, as in run.json"),
    entry("experiment", "text", "of the run"),
    entry("group", "text", "who measured, as in run.json"),
    entry("note", "text", "as in run.json"),
    entry("status", "text", "finished, interrupted, failed, or running when it was analyzed"),
    entry("synthetic", "truth", "whether any of it is simulated or synthetic; empty for a data file"),
    entry("readings_sha256", "text", "of the file with the readings"),
)
TAIL = (
    entry("warnings", "count", "warnings that levilab analyze gives for the input by itself"),
    entry("problem", "text", "why it could not be analyzed; the analysis's columns are empty then"),
)


def columns_of(analysis: Analysis[Any]) -> tuple[Column, ...]:
    """Return the columns of the table."""
    return (*HEAD, *analysis.row, *TAIL)


def name_of(path: Path, folder: Path) -> str:
    r"""Return the path of an input from a folder, as it is but for line breaks and the like, which are escaped.

    >>> from pathlib import Path
    >>> name_of(Path("runs/two\n  lines"), Path())
    'runs/two\\n  lines'
    """
    text = relative(path, folder)
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def analyze_one(task: Task) -> Row | PassedOver:
    """Analyze one input by itself; an error becomes the problem of its row."""
    analysis = ANALYSES[task.analysis]
    about: dict[str, Any] = {"path": name_of(task.path, task.folder)}
    part: dict[str, Any] | None = None
    try:
        if task.is_run and (passed_over := _read_record(task, analysis, about)):
            return passed_over
        part = _analyze(task, analysis, about)
    except DoesNotSuit as error:
        if task.searched and not task.is_run:
            return PassedOver(unquote(str(error)) if isinstance(error, NoRate) else "")
        about["problem"] = str(error)
    except (DataError, CannotWrite, OSError) as error:
        about["problem"] = str(error)
    except MemoryError:
        about["problem"] = "memory ran out: analyze it alone, or record less at a time"
    except Exception as error:  # noqa: BLE001 - a defect of ours in one run is no reason to lose thousands of others
        about["problem"] = f"a defect of levilab, please report it: {type(error).__name__}: {error}"
    return row(analysis, about, part)


def row(analysis: Analysis[Any], about: dict[str, Any], part: dict[str, Any] | None) -> Row:
    """Return the row from facts about the input, and from its part of result.json; None where there is no result."""
    if problem := about.get("problem", ""):
        about["problem"] = problem = " ".join(unquote(problem).split())
    path, *others = HEAD
    cells = (
        path.read(about),  # as it is: two names may differ in their spaces
        *(plain(column.read(about), column.kind) for column in others),
        *(None if part is None else plain(column.read(part), column.kind) for column in analysis.row),
        *(plain(column.read(about), column.kind) for column in TAIL),
    )
    return Row(cells, problem, about.get("readings_sha256"))


def _read_record(task: Task, analysis: Analysis[Any], about: dict[str, Any]) -> PassedOver | None:
    """Copy facts from run.json, and return the reason if the run does not belong into the table.  Raises DataError."""
    run = Run.load(task.path)
    about |= {
        "started_utc": run.record.started_utc,
        "experiment": run.record.experiment,
        "group": run.record.group,
        "note": run.record.note,
        "status": run.status,
        "synthetic": run.record.synthetic,
    }
    if not task.searched:
        return None
    if run.continued_in:
        return PassedOver("a run that was broken off and goes on in another folder")
    return None if analysis.take(run) else PassedOver(f"a {run.record.experiment} run")


def _analyze(task: Task, analysis: Analysis[Any], about: dict[str, Any]) -> dict[str, Any]:
    """Return the input's part of result.json.  Raises DataError, CannotWrite."""
    options = replace(task.options, guess=False) if task.searched and not task.is_run else task.options
    if task.is_run and task.searched:
        options = replace(options, columns=None)  # they are those of the files beside it
    found = analysis.analyze([task.path], options)
    if len(found.sources) > 1:
        raise DataError("{path:s}: holds several runs: name each, as {one:s}", task.path, found.sources[0].path)
    about["readings_sha256"] = found.sources[0].sha256
    document = analysis.document(found, task.path.parent)
    about["warnings"] = len(document["warnings"])
    if task.save:
        save(analysis, found, with_figure=False)
    part: dict[str, Any] = document["runs"][0]
    return part


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
        said = "{path:s}: holds no run and no data file; name run folders, or a folder with some of them"
        raise DataError(said, paths[0])
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
