"""One input → its row: a pure function of the input and the options, for any process."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from levilab.errors import DataError, DoesNotSuit, unquote
from levilab.files import CannotWrite
from levilab.formats.waveforms.header import NoRate
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.result import relative
from levilab.pipelines.row import Cell, Column, entry, plain
from levilab.pipelines.suits import save
from levilab.runs.run import Run

if TYPE_CHECKING:
    from pathlib import Path

    from levilab.pipelines.document import Analysis
    from levilab.pipelines.options import InputOptions


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
        raise DataError(f"{task.path}: holds several runs: name each, as {found.sources[0].path}")
    about["readings_sha256"] = found.sources[0].sha256
    document = analysis.document(found, task.path.parent)
    about["warnings"] = len(document["warnings"])
    if task.save:
        save(analysis, found, with_figure=False)
    part: dict[str, Any] = document["runs"][0]
    return part
