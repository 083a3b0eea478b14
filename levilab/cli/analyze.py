"""Analyze: runs and data files.  Heavy imports happen inside the commands that need them."""

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
import typer.core

from levilab.cli.later import Later
from levilab.cli.options import Channel, Columns, Json, KeepOutliers, Paths, Rate, ReadingU
from levilab.cli.output import interruptible, message, print_json, result
from levilab.cli.quantities import with_options
from levilab.errors import DoesNotSuit, LevilabError, NoneUsable, UsageError

if TYPE_CHECKING:
    from levilab.pipelines.catalogue import Analysis
    from levilab.pipelines.many.table import Tally


class AnalyzeGroup(typer.core.TyperGroup):
    """`levilab analyze PATH…` without the name of an analysis is `levilab analyze each PATH…`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the name `each` unless the first word is, or was meant as, the name of an analysis."""
        if args and args[0] not in ctx.help_option_names:
            k = self._first_word(args)
            named = k is not None and (args[k] in self.commands or self._is_misspelt(args[k]))
            args = [args[k], *args[:k], *args[k + 1 :]] if k is not None and named else [_EACH, *args]
        return super().parse_args(ctx, args)

    def _first_word(self, args: list[str]) -> int | None:
        """Return the index of the first word that is neither an option nor the value of one; None if there is none."""
        each: Any = self.commands[_EACH]
        options = [one for one in each.command.params if not getattr(one, "is_flag", True)]
        with_value = {name for option in options for name in option.opts}
        numbered = iter(enumerate(args))
        for k, word in numbered:
            if word in with_value:
                next(numbered, None)
            elif word == "--" or not word.startswith("-"):
                return None if word == "--" else k
        return None

    def _is_misspelt(self, word: str) -> bool:
        """Return whether a word is similar to the name of an analysis, and no path."""
        from difflib import get_close_matches  # not for every help

        return bool(get_close_matches(word, self.commands)) and not Path(word).exists()


analyze_app = typer.Typer(cls=AnalyzeGroup, no_args_is_help=True, add_completion=False)


class Uncertainty(StrEnum):
    """How the uncertainties of the fitted constants are found."""

    COVARIANCE = "covariance"
    PROFILE = "profile"
    BOOTSTRAP = "bootstrap"


class Tilt(StrEnum):
    """Whether the count of a spin-down holds the tilt of the top's moment."""

    AUTO = "auto"
    NONE = "none"
    FITTED = "fitted"


class Method(StrEnum):
    """How the pulses of a trace are found."""

    AUTO = "auto"
    EDGES = "edges"
    MATCHED = "matched"
    LIKELIHOOD = "likelihood"


class Option(NamedTuple):
    """An option of some analyses.

    Attributes:
        kind: its type, as typer reads it.
        default: its value without the option.
        read: turns a value of the command line, other than None, into the analysis's; raises UsageError.
        to: its name in the analysis; empty: the same name.
    """

    kind: Any
    default: Any = None
    read: Callable[[Any], Any] = lambda given: given
    to: str = ""


def _columns(text: str) -> Any:
    from levilab.formats.table import parse_columns

    return parse_columns(text) or None  # none named: those of an earlier result count


def _device(path: Path) -> Any:
    from levilab.formats.device import read_device

    return read_device(path)


def _positive(name: str, what: str) -> Callable[[float], float]:
    """Return a check that a number is above 0."""

    def check(value: float) -> float:
        if not 0 < value < math.inf:
            raise UsageError(name, what, value=value)
        return value

    return check


def _metres(name: str, lowest: float) -> Callable[[float], float]:
    """Return a function from millimetres to metres, which checks the range."""

    def read(value: float) -> float:
        if not lowest <= value <= 2000.0:
            raise UsageError(name, f"a number of millimetres from {lowest:g} to 2000 is expected", value=value)
        return value / 1000

    return read


OPTIONS = {
    "columns": Option(Columns, "", _columns),
    "channel": Option(Channel),
    "rate": Option(
        Rate,
        read=_positive("rate", "samples per second are expected, a number above 0 [Hz]"),
    ),
    "reading_u": Option(
        ReadingU,
        read=_positive("reading_u", "a standard uncertainty above 0 [Hz] is expected"),
    ),
    "uncertainty": Option(
        Annotated[
            Uncertainty,
            typer.Option("--uncertainty", help="profile and bootstrap add 68 % intervals, and take longer."),
        ],
        Uncertainty.COVARIANCE,
        str,
    ),
    "keep_outliers": Option(KeepOutliers, False),
    "tilt": Option(
        Annotated[
            Tilt,
            typer.Option(
                "--tilt",
                help="Whether counts hold the tilt of the top's moment.  auto: fitted if the counts demand it; u "
                "covers a tilt that noise may hide.  none: a top that only spins.",
            ),
        ],
        Tilt.AUTO,
        str,
    ),
    "method": Option(
        Annotated[
            Method,
            typer.Option("--method", help="How pulses are found: edges is the fastest, likelihood for weak ones."),
        ],
        Method.AUTO,
        str,
    ),
    "orthogonal": Option(
        Annotated[bool, typer.Option("--orthogonal", help="Use the uncertainty of the drive's frequency, too.")],
        False,
    ),
    "device": Option(
        Annotated[
            Path | None,
            typer.Option(
                metavar="FILE", help="Describes base and top, as sample_data/device.toml does; see levilab top."
            ),
        ],
        read=_device,
    ),
    "height": Option(
        Annotated[
            float | None,
            typer.Option(
                metavar="MM", help="Height at which the top floats; its moment follows, if its mass is known."
            ),
        ],
        read=_metres("height", -1000.0),
        to="height_m",
    ),
    "height_u": Option(
        Annotated[
            float | None,
            typer.Option(
                metavar="MM",
                help="Standard uncertainty of --height.",
                show_default="that of the scan's heights",
            ),
        ],
        read=_metres("height_u", 0.0),
        to="height_u_m",
    ),
    "clock_u": Option(
        Annotated[
            float | None,
            typer.Option(
                "--clock-u",
                metavar="PART",
                help="Relative standard uncertainty of the clock that counts or samples, as 2e-6, from its manual; the "
                "budgets show what it does.",
            ),
        ],
        read=_positive("clock_u", "a relative standard uncertainty above 0 is expected, such as 2e-6"),
    ),
    "free_radii": Option(
        Annotated[
            bool,
            typer.Option("--free-radii", help="Fit the radii, too, within the calliper's uncertainty."),
        ],
        False,
    ),
}


class Command(NamedTuple):
    """An analysis: what its command does, and its options."""

    help: str
    options: tuple[str, ...]


#: The command without a name; the help does not list it.  Each analysis takes those options that it knows.
_EACH = "each"
#: The catalogue itself takes too long to import for a help page.
COMMANDS = {
    "spindown": Command(
        "Drag laws from spin-downs: stokes, newton, disc, mixed and power law, and which of them the data exclude.",
        ("columns", "channel", "rate", "reading_u", "uncertainty", "keep_outliers", "tilt", "clock_u"),
    ),
    "spin": Command(
        "Spin frequency and slope from traces of a detector (WAV, scopes' CSV, .npy), lists of pulse times, runs with "
        "traces.",
        ("columns", "channel", "rate", "method", "clock_u"),
    ),
    "field": Command(
        "The base from a Hall scan: strength, origin, thickness; heights, masses and spins of tops that float.",
        ("columns", "device", "height", "height_u", "free_radii"),
    ),
    "precession": Command(
        "Precession against drive: slope and intercept, tested against a locked top, and what 1.05 would take.",
        ("columns", "reading_u", "keep_outliers", "orthogonal", "clock_u"),
    ),
    "limit": Command(
        "Limits of the spin, lower and upper: mean, scatter, trend and outliers, beside the window of the top.",
        ("columns", "reading_u", "clock_u"),
    ),
    _EACH: Command(
        "Each analysis that suits the runs or data files; --json prints a list where several suit.",
        ("columns", "channel", "rate", "reading_u", "uncertainty", "keep_outliers", "tilt", "method", "clock_u"),
    ),
}


def _command(options: Sequence[str]) -> Callable[..., None]:
    """Return the command of an analysis, with these options in its signature, before --save, where typer reads them."""

    def analyze(
        context: typer.Context,
        paths: Paths,
        save: Annotated[
            bool | None,
            typer.Option(
                "--save/--no-save",
                help="Write the result and figures beside the run; with --table the results alone.",
                show_default="save; with --table no-save",
            ),
        ] = None,
        out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Write them there instead.")] = None,
        table: Annotated[
            Path | None,
            typer.Option(
                metavar="FILE",
                help="For many runs: analyze each by itself, in parallel, and write a row for each, .csv or .parquet.",
            ),
        ] = None,
        cores: Annotated[
            int | None, typer.Option(metavar="N", min=1, help="Processes for --table.", show_default="all of them")
        ] = None,
        resume: Annotated[
            bool,
            typer.Option(
                "--resume", help="Keep the rows of an earlier --table; analyze what is new, changed or failed."
            ),
        ] = False,
        as_json: Json = False,
        **given: Any,
    ) -> None:
        if table is not None:
            writing = Writing(table, cores=cores, resume=resume, save=bool(save))
            _tabulate(context, paths, analysis_options(given), writing, out=out, as_json=as_json)
            return
        for name, value in (("cores", cores), ("resume", resume or None)):
            if value is not None:
                raise UsageError(name, "goes with `table` alone")
        _analyze(context, paths, analysis_options(given), save=save is not False, out=out, as_json=as_json)

    context, paths, *shared, _ = inspect.signature(analyze).parameters.values()
    own = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=option.default, annotation=option.kind)
        for name, option in OPTIONS.items()
        if name in options
    ]
    shared = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in shared]
    analyze.__signature__ = inspect.Signature([context, paths, *own, *shared])  # type: ignore[attr-defined]
    return analyze


def _add(name: str, row: Command) -> None:
    words = "levilab analyze" if name == _EACH else f"levilab analyze {name}"

    @analyze_app.command(name, cls=Later, help=row.help, epilog=f"Example: {words} sample_data/", hidden=name == _EACH)
    def command() -> Callable[..., None]:
        return _command(row.options)


for _name, _row in COMMANDS.items():
    _add(_name, _row)


def analysis_options(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the analyses' options, in SI, from those of the command line.  Raises UsageError."""
    if given.get("height_u") is not None and given.get("height") is None:
        raise UsageError("height_u", "goes with `height` alone")
    return {
        OPTIONS[name].to or name: None if value is None else OPTIONS[name].read(value) for name, value in given.items()
    }


def _analyze(
    context: typer.Context,
    paths: Sequence[Path],
    given: Mapping[str, Any],
    *,
    save: bool,
    out: Path | None,
    as_json: bool,
) -> None:
    """Carry out the analysis that the command is named after, or each."""
    from levilab.pipelines.catalogue import ANALYSES
    from levilab.pipelines.suits import analyze_suiting

    left_out: list[str] = []
    with interruptible("what was fitted so far is lost, nothing is written"):
        _advise_on_many(paths)
        if context.info_name == _EACH:
            results = analyze_suiting(paths, given, left_out.append)
        else:
            analysis = ANALYSES[str(context.info_name)]
            results = [(analysis, _analyze_as(analysis, paths, given))]
    with interruptible("look which results are written: each one is whole"):
        _write_and_print(context, results, left_out, save=save, out=out, as_json=as_json)


def _advise_on_many(paths: Sequence[Path]) -> None:
    """Print a note on --table before an analysis of very many runs."""
    from levilab.runs.run import find_runs

    if (count := sum(len(find_runs(path)) for path in paths if path.is_dir())) >= MANY_RUNS:
        advice = "--table FILE.csv writes a row for each by itself, in parallel, and goes on where it was interrupted"
        message(f"{count} runs are analyzed together, in one process, with all readings in memory; {advice}")


class Writing(NamedTuple):
    """How a table of many runs is written; see `levilab.pipelines.many.table.write_table`."""

    table: Path
    cores: int | None
    resume: bool
    save: bool


#: Interval between lines of progress where standard error is no terminal [s].
LINE_EVERY_S = 30.0
#: From this number of runs on, an analysis without --table begins with a note on it.
MANY_RUNS = 500


def _tabulate(
    context: typer.Context,
    paths: Sequence[Path],
    given: Mapping[str, Any],
    writing: Writing,
    *,
    out: Path | None,
    as_json: bool,
) -> None:
    """Write a row of each run into a table."""
    from levilab.pipelines.catalogue import ANALYSES
    from levilab.pipelines.many.table import write_table
    from levilab.present.progress import ShareBar

    if context.info_name == _EACH:
        example = f"as levilab analyze spindown {paths[0]} --table {writing.table}"
        raise UsageError("table", f"has columns of one analysis: name it, {example}")
    if out is not None:
        raise UsageError("out", "does not go with `table`: the results have names that differ only beside their runs")
    bar: ShareBar | None = None

    def show(tally: "Tally") -> None:
        nonlocal bar
        if bar is None:
            bar = ShareBar("runs", first=tally.done / tally.total, line_every=LINE_EVERY_S)
        failed = f", {tally.failed} failed" if tally.failed else ""
        bar(tally.done / tally.total, f"{tally.done} of {tally.total} runs{failed}")

    kept = f"the rows so far are in {writing.table}.part.csv: the same command with --resume goes on with them"
    with interruptible(kept):
        try:
            tally = write_table(ANALYSES[str(context.info_name)], paths, given, **writing._asdict(), show=show)
        finally:
            if bar:
                bar.close()
    _print_tally(context, tally, writing.table, as_json=as_json)


def _print_tally(context: typer.Context, tally: "Tally", table: Path, *, as_json: bool) -> None:
    """Print where the table is and what did not get into it.  Raises NoneUsable where nothing was analyzed."""
    app = context.find_root().command
    for path, problem in tally.failures:
        named = problem if PurePath(path).name in problem else f"{path}: {problem}"
        message(with_options(f"failed: {named}", app))
    if (more := tally.failed - len(tally.failures)) > 0:
        message(f"and {more} more, whose problem stands in the table")
    for why, count in tally.passed_over.items():
        message(f"skipped {count} times: {why}")
    if tally.same:
        message(f"note: {tally.same} rows have the same readings as another one (readings_sha256): count them once")
    if as_json:
        print_json({
            "table": table.as_posix(), "rows": tally.rows, "failed": tally.failed, "kept": tally.kept,
            "passed_over": dict(tally.passed_over), "same_readings": tally.same,
        })  # fmt: skip
    else:
        kept = f", {tally.kept} of them of an earlier call" if tally.kept else ""
        result(f"the table of {tally.rows} runs is in {table}{kept}; {tally.failed} could not be analyzed")
    if tally.failed and tally.failed == tally.rows:
        raise NoneUsable(f"none of {tally.rows} runs could be analyzed; their problems stand in {table}")


def _analyze_as(analysis: "Analysis[Any]", paths: Sequence[Path], given: Mapping[str, Any]) -> Any:
    """Return the result of one analysis.

    Raises:
        DoesNotSuit: the inputs are for other analyses, which the message names.
    """
    try:
        return analysis.analyze(paths, analysis.options_from(given))
    except DoesNotSuit as error:
        raise DoesNotSuit(f"{error}{_advice(paths, given)}") from error


def _advice(paths: Sequence[Path], given: Mapping[str, Any]) -> str:
    """Return which analyses read the paths, as the end of a sentence; empty if none does."""
    from levilab.pipelines.suits import suiting

    for path in paths:
        try:
            names = [one.analysis.name for one in suiting([path], given)]
        except LevilabError:
            continue
        return f"; levilab analyze {' or '.join(names)} {path} reads it"
    return ""


def _write_and_print(
    context: typer.Context,
    results: list[tuple["Analysis[Any]", Any]],
    left_out: list[str],
    *,
    save: bool,
    out: Path | None,
    as_json: bool,
) -> None:
    """Write the results before printing them: a closed pipe must not cost a result.

    left_out: why other analyses have no result.
    """
    from levilab.pipelines.catalogue import print_analysis
    from levilab.pipelines.suits import remarks

    in_words = partial(with_options, app=context.find_root().command)
    failures: list[LevilabError] = []
    messages = [*left_out, *map(str, remarks([found.remarks for _, found in results]))]
    for analysis, found in results:
        if save:
            failure, written = _save(analysis, found, out)
            failures += [failure] if failure else []
            messages += [f"wrote {path}" for path in written]
    if as_json:
        documents = [analysis.document(found, out or found.output_folder) for analysis, found in results]
        print_json(documents[0] if len(documents) == 1 else documents, sort_keys=True)
    else:
        for analysis, found in results:
            print_analysis(analysis, found, in_words)
    for text in messages:
        message(in_words(text))
    if failures:
        raise failures[0]


def _save(analysis: "Analysis[Any]", found: Any, out: Path | None) -> tuple[LevilabError | None, list[Path]]:
    """Write a result.  Returns the error, if any, and the files; the caller prints the result either way."""
    from levilab.pipelines.suits import save

    try:
        return None, save(analysis, found, out)
    except LevilabError as error:
        return error, []
