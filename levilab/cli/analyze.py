"""Analyze: runs and data files.  Heavy imports happen inside the commands that need them."""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import StrEnum
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from levilab.cli.later import Later, NamedLast
from levilab.cli.options import Json, Language, Paths, existing_path, flag, folder, number, option, place
from levilab.cli.output import interruptible, message, print_json, result
from levilab.cli.quantities import with_options
from levilab.errors import DataError, DoesNotSuit, LevilabError, UsageError, as_typed
from levilab.pipelines.options import DEFAULTS, KINDS, OPTIONS, Option, options_of, read_options, typed_name
from levilab.texts.text import Text, either, how_many, text_of, verbatim

if TYPE_CHECKING:
    from levilab.pipelines.document import Analysis
    from levilab.pipelines.many.table import Tally


#: The command without a name; the help does not list it.  Each analysis takes those options that it knows.
_EACH = "each"


class AnalyzeGroup(NamedLast):
    """`levilab analyze PATH…` without the name of an analysis is `levilab analyze each PATH…`."""

    typical = _EACH

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the name `each` unless the first word is, or was meant as, the name of an analysis."""
        if args[:1] not in [[name] for name in ctx.help_option_names]:
            args = self.with_name_first(args) or [_EACH, *args]
        if Path(args[0]).exists() and all(word.startswith("-") for word in args[1:]):
            message(Text("{name:s} is the analysis; levilab analyze ./{name:s} reads what has its name", name=args[0]))
        return super().parse_args(ctx, args)


analyze_app = typer.Typer(cls=AnalyzeGroup, add_completion=False)


#: What the command of each analysis does; the catalogue itself takes too long to import for a help page.
COMMANDS = {
    "spindown": "Drag laws from spin-downs: the constants of each, and which laws the data exclude.",
    "spin": "Spin frequency and slope from traces of a detector (WAV, scopes' CSV, .npy), lists of pulse times, runs "
    "with traces.",
    "field": "The base from a Hall scan: strength, origin, thickness; heights, masses and spins of tops that float.",
    "precession": "Precession against drive: slope and intercept, tested against a locked top, and what 1.05 would "
    "take.",
    "limit": "Limits of the spin, lower and upper: mean, scatter, trend and outliers, beside the window of the top.",
    "sway": "Slow swings of a floating top from x and y over time: their split, beside Berry's geometric magnetism.",
    "hold": "Held spins: the drag that the amplitude balances, drag laws through several, beside a spin-down's.",
    "video": "Place, spin and fall of a top in a film from above, with the tables that other analyses read.",
    _EACH: "Each analysis that suits the runs or data files; --json prints a list where several suit.",
}
#: Where in sample_data the input of an analysis lies that a search of it leaves out.
_EXAMPLES = {"sway": "sway/", "hold": "hold/", "video": "video/top.mp4 --rim 30"}


def takes_options(
    names: Iterable[str], more: Sequence[inspect.Parameter] = ()
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that puts options into the signature of a command, where typer reads them.

    Those of analyses stand behind the paths, more of them at the end; the command has all in `**given`.
    """
    own = [_parameter(name, OPTIONS[name]) for name in names]

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        paths, *shared, _ = inspect.signature(command).parameters.values()
        shared = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in shared]
        command.__signature__ = inspect.Signature([paths, *own, *shared, *more])  # type: ignore[attr-defined]
        return command

    return decorate


def _parameter(name: str, option: Option) -> inspect.Parameter:
    """Return the parameter of a command by which typer reads an option."""
    kind: Any = option.kind | None
    default, name = DEFAULTS[name], typed_name(name)
    if option.choices:
        words = {word.upper(): word for word in option.choices}
        kind = StrEnum(name.title(), words)  # type: ignore[misc,no-redef] # a class that is made here
        default = kind(default)
    about = typer.Option(
        f"--{name.replace('_', '-')}",
        metavar=option.metavar or "|".join(option.choices),
        help=option.help.replace("[", r"\["),
        show_default=option.default_text or True,
        parser=number(option.unit) if option.kind is float else None,
        callback=existing_path if option.kind is Path else None,
    )
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, about])


def _command(kind: str) -> Callable[..., None]:
    """Return the command of an analysis, or of each."""

    @takes_options(OPTIONS if kind == _EACH else options_of(KINDS[kind]))
    def analyze(
        paths: Paths = None,
        save: Annotated[
            bool | None,
            flag(
                "Write the result and figures beside the run; with --table the results alone.",
                "--save/--no-save",
                show_default="save; with --table no-save",
            ),
        ] = None,
        out: Annotated[Path | None, place("DIR", "Write them there instead.", callback=folder)] = None,
        table: Annotated[
            Path | None,
            option(
                "FILE",
                "For many runs: analyze each by itself, in parallel, and write a row for each, .csv or .parquet.",
            ),
        ] = None,
        cores: Annotated[int | None, option("N", "Processes for --table.", min=1, show_default="all of them")] = None,
        resume: Annotated[
            bool, flag("Keep the rows of an earlier --table; analyze what is new, changed or failed.", "--resume")
        ] = False,
        as_json: Json = False,
        language: Language = "en",  # noqa: ARG001 - its callback speaks it
        **given: Any,
    ) -> None:
        if table is not None:
            writing = Writing(table, cores=cores, resume=resume, save=bool(save))
            _tabulate(kind, paths or (), read_options(given, typed=True), writing, out=out, as_json=as_json)
            return
        for name, value in (("cores", cores), ("resume", resume or None)):
            if value is not None:
                raise UsageError(name, "goes with `table` alone")
        _analyze(kind, paths or (), read_options(given, typed=True), save=save is not False, out=out, as_json=as_json)

    return analyze


def _add(name: str, text: str) -> None:
    words = "levilab analyze" if name == _EACH else f"levilab analyze {name}"
    words += f" sample_data/{_EXAMPLES.get(name, '')}"

    @analyze_app.command(name, cls=Later, help=text, epilog=f"Example: {words}", hidden=name == _EACH)
    def command() -> Callable[..., None]:
        return _command(name)


for _name, _text in COMMANDS.items():
    _add(_name, _text)


def _analyze(
    kind: str, paths: Sequence[Path], given: Mapping[str, Any], *, save: bool, out: Path | None, as_json: bool
) -> None:
    """Carry out an analysis, or each."""
    from levilab.pipelines.catalogue import ANALYSES
    from levilab.pipelines.suits import analyze_suiting

    with interruptible("what was fitted so far is lost, nothing is written"):
        _advise_on_many(paths)
        if kind == _EACH:
            results = analyze_suiting(paths, given)
        else:
            analysis = ANALYSES[kind]
            results = [(analysis, _analyze_as(analysis, paths, given))]
    with interruptible("look which results are written: each one is whole"):
        write_and_print(results, save=save, out=out, as_json=as_json)


def _advise_on_many(paths: Sequence[Path]) -> None:
    """Print a note on --table before an analysis of very many runs."""
    from levilab.runs.find import find_runs

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
    kind: str, paths: Sequence[Path], given: Mapping[str, Any], writing: Writing, *, out: Path | None, as_json: bool
) -> None:
    """Write a row of each run into a table."""
    from levilab.pipelines.catalogue import ANALYSES
    from levilab.pipelines.many.table import write_table
    from levilab.present.progress import ShareBar

    if kind == _EACH:
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
        bar(tally.done / tally.total, f"{tally.done} of {how_many(tally.total, 'run')}{failed}")

    kept = f"the rows so far are in {writing.table}.part.csv: the same command with --resume goes on with them"
    with interruptible(kept):
        try:
            tally = write_table(ANALYSES[kind], paths, given, **writing._asdict(), show=show)
        finally:
            if bar:
                bar.close()
    _print_tally(tally, writing.table, as_json=as_json)


def _print_tally(tally: "Tally", table: Path, *, as_json: bool) -> None:
    """Print where the table is and which inputs are not in it.  Raises DataError where nothing was analyzed."""
    for path, problem in tally.failures:
        named = problem if PurePath(path).name in problem else f"{path}: {problem}"
        message(f"failed: {named}")
    if (more := tally.failed - len(tally.failures)) > 0:
        message(f"and {more} more, whose problem stands in the table")
    for why, count in tally.passed_over.items():
        message(f"skipped {how_many(count, 'time')}: {why}")
    if tally.same:
        rows = "row has" if tally.same == 1 else "rows have"
        message(f"note: {tally.same} {rows} the same readings as another one (readings_sha256): count them once")
    if as_json:
        print_json({
            "table": table.as_posix(), "rows": tally.rows, "failed": tally.failed, "kept": tally.kept,
            "passed_over": dict(tally.passed_over), "same_readings": tally.same,
        })  # fmt: skip
    else:
        kept = f", {tally.kept} of them of an earlier call" if tally.kept else ""
        result(f"the table of {how_many(tally.rows, 'run')} is in {table}{kept}; {tally.failed} could not be analyzed")
    if tally.failed and tally.failed == tally.rows:
        raise DataError(f"none of {how_many(tally.rows, 'run')} could be analyzed; their problems stand in {table}")


def _analyze_as(analysis: "Analysis[Any]", paths: Sequence[Path], given: Mapping[str, Any]) -> Any:
    """Return the result of one analysis.

    Raises:
        DoesNotSuit: the inputs are for other analyses, which the message names.
    """
    try:
        return analysis.analyze(paths, analysis.options_from(given))
    except DoesNotSuit as error:
        advice = _advice(analysis, paths, given, error)
        raise DoesNotSuit(Text("{why}{advice}", why=error, advice=advice) if advice else text_of(error)) from error


#: The analysis that reads any table with a column of frequencies.
_NEEDS_LEAST = "limit"


def _advice(tried: "Analysis[Any]", paths: Sequence[Path], given: Mapping[str, Any], error: DoesNotSuit) -> str:
    """Return which analyses read a path that the tried one does not, as the end of a sentence; empty if none does.

    A table in which the tried one misses its times is not meant for the one that needs none.
    """
    from levilab.formats.columns import NoSuchColumn
    from levilab.pipelines.suits import suiting

    needs_more = {_NEEDS_LEAST} if isinstance(error, NoSuchColumn) else set()
    for path in paths:
        try:
            found = [one.analysis for one in suiting([path], given)]
        except LevilabError:
            continue
        names = [one.name for one in found if one.name not in needs_more]
        if names and tried not in found:
            said = "; levilab analyze {names} {path:s} reads it"
            return Text(said, names=either(map(verbatim, names)), path=as_typed(path))
    return ""


def write_and_print(
    results: list[tuple["Analysis[Any]", Any]],
    *,
    save: bool,
    out: Path | None,
    as_json: bool,
    tables: bool = True,
) -> None:
    """Write the results before printing them, and tables if asked: a closed pipe must not cost a result."""
    from levilab.pipelines.catalogue import print_analysis
    from levilab.pipelines.inputs.unread import left_out_of, noted, skipped_by_all, texts_of

    failures: list[LevilabError] = []
    skipped = skipped_by_all([found.skipped for _, found in results])
    messages = texts_of([one for one in skipped if not noted(one)])
    for analysis, found in results:
        if save:
            failure, written = _save(analysis, found, out)
            failures += [failure] if failure else []
            messages += [Text("wrote {path:s}", path=str(path)) for path in written]
    if as_json:
        more = {"left_out": left_out_of(skipped)} if left_out_of(skipped) else {}
        documents = [analysis.document(found, out or found.output_folder) | more for analysis, found in results]
        print_json(documents[0] if len(documents) == 1 else documents, sort_keys=True)
    else:
        for analysis, found in results:
            print_analysis(analysis, found, with_options, tables=tables)
    for text in messages:
        message(text)
    if failures:
        raise failures[0]


def _save(analysis: "Analysis[Any]", found: Any, out: Path | None) -> tuple[LevilabError | None, list[Path]]:
    """Write a result.  Returns the error, if any, and the files; the caller prints the result either way."""
    from levilab.pipelines.suits import save

    try:
        return None, save(analysis, found, out)
    except LevilabError as error:
        return error, []
