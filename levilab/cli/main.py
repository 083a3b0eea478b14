"""The commands: translate, call, print.  Heavy imports happen inside the commands that need them."""

from __future__ import annotations

import contextlib
import os
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, cast

import typer
import typer.core

from levilab.cli import bench as cli_bench
from levilab.cli import simulate as cli_simulator
from levilab.cli.simulate import EXIT_INTERRUPTED, Json

if TYPE_CHECKING:
    from analysis.spindown.lawfit import Uncertainty as Kind
    from levilab.errors import LevilabError
    from levilab.pipelines.catalogue import Analysis
    from levilab.pipelines.sources import Options

app = typer.Typer(
    name="levilab",
    help="The lab application for experiments on the Levitron: acquire, analyze, report.",
    epilog="Try: levilab acquire spin --mock",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
acquire_app = typer.Typer(no_args_is_help=True, help="Run an experiment on the bench and write a run folder.")


class AnalyzeGroup(typer.core.TyperGroup):
    """`levilab analyze PATH…` without the name of an analysis is `levilab analyze each PATH…`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put in the name where there is none."""
        named = not args or args[0] in self.commands or args[0] in ctx.help_option_names
        return super().parse_args(ctx, args if named else ["each", *args])


analyze_app = typer.Typer(
    cls=AnalyzeGroup,
    no_args_is_help=True,
    help="Analyze runs or data files.  Without a COMMAND: each analysis that suits, as levilab analyze runs/.",
)
app.add_typer(acquire_app, name="acquire")
app.add_typer(analyze_app, name="analyze")
app.add_typer(cli_bench.bench_app, name="bench")

EXIT_FAILED, EXIT_INSTRUMENT = 1, 3


class Uncertainty(StrEnum):
    """How the uncertainties of the fitted constants are found."""

    COVARIANCE = "covariance"
    PROFILE = "profile"
    BOOTSTRAP = "bootstrap"


Columns = Annotated[
    str,
    typer.Option(
        metavar="NAME=COLUMN,…",
        help="Columns of your file: t=Zeit,f=Kanal2 or t=1,f=3; with a unit in brackets: 'f=Drehzahl \\[rpm]'.",
    ),
]
ReadingU = Annotated[
    float | None,
    typer.Option(metavar="HZ", help="Standard uncertainty of every reading; goes before what the data say."),
]
KeepOutliers = Annotated[bool, typer.Option("--keep-outliers", help="Fit readings that look like miscounts, too.")]
UncertaintyKind = Annotated[
    Uncertainty, typer.Option("--uncertainty", help="profile and bootstrap add 68 % intervals, and take longer.")
]
Save = Annotated[bool, typer.Option(help="Write the result and figures beside the run.")]
ResultFolder = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Write them there instead.")]
Paths = Annotated[list[Path], typer.Argument(metavar="PATH…", help="Run folders, data files, or folders to search.")]


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"levilab {version('levilab')}")
        raise typer.Exit


@app.callback()
def levilab(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True),
    ] = False,
) -> None:
    """The lab application for experiments on the Levitron: acquire, analyze, report."""


@acquire_app.command("spin", epilog="Example: levilab acquire spin --mock --note 'first try'")
def acquire_spin(
    mock: Annotated[bool, typer.Option("--mock", help="Use the virtual bench; needs no hardware.")] = False,
    bench: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Describes the bench; with --mock only its settings count.", show_default="bench.toml"
        ),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the run folder is made.")] = Path("runs"),
    scene: Annotated[
        str | None,
        typer.Option(
            metavar="SCENE",
            help="With --mock: a top in full motion, such as spindown, or a scene's file.",
            show_default="spin only",
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Makes a virtual run repeatable.")] = None,
    note: Annotated[str, typer.Option(help="Kept with the run.")] = "",
    realtime: Annotated[bool, typer.Option("--realtime", help="Keep the virtual bench to the wall clock.")] = False,
    resume: Annotated[
        Path | None, typer.Option(metavar="RUN", help="Go on with an interrupted run: read on, without driving again.")
    ] = None,
    wire_log: Annotated[bool, typer.Option("--wire-log", help="Keep all bytes sent and received.")] = False,
    as_json: Json = False,
) -> None:
    """Spin-down: drive the top up, switch the drive off, count its spin until it falls.

    Ctrl-C ends the run after the reading under way; outputs go off and the run is kept.
    """
    from levilab.acquisition.loop import acquire
    from levilab.acquisition.request import spin_order
    from levilab.present.progress import to_stderr

    order = spin_order(
        mock=mock,
        bench=bench,
        out=out,
        seed=seed,
        note=note,
        realtime=realtime,
        resume=resume,
        wire_log=wire_log,
        scene=scene,
        tell=lambda text: typer.echo(text, err=True),
    )
    run = acquire(order, to_stderr())
    readings = run.count()
    if as_json:
        import json

        typer.echo(json.dumps({"run": str(run.folder), "status": run.status, "readings": readings}))
    else:
        typer.echo(f"{run.status}: {readings} reading{'s' * (readings != 1)} in {run.folder}")
    if run.status == "interrupted":
        if readings:
            typer.echo(f"go on with it: levilab acquire spin --resume {run.folder}", err=True)
        raise typer.Exit(EXIT_INTERRUPTED)


@analyze_app.command("spindown", epilog="Example: levilab analyze spindown sample_data/")
def analyze_spindown(
    paths: Paths,
    columns: Columns = "",
    reading_u: ReadingU = None,
    uncertainty: UncertaintyKind = Uncertainty.COVARIANCE,
    keep_outliers: KeepOutliers = False,
    save: Save = True,
    out: ResultFolder = None,
    as_json: Json = False,
) -> None:
    """Drag laws from spin-downs: stokes, newton, disc, mixed and power law, and which of them the data exclude."""
    from levilab.pipelines.catalogue import ANALYSES

    options = _options(columns, reading_u, uncertainty.value, keep_outliers)
    analysis = ANALYSES["spindown"]
    found = analysis.analyze(paths, options)
    _write_and_print([(analysis, found)], save=save, out=out, as_json=as_json)


@analyze_app.command("each", hidden=True, epilog="Example: levilab analyze sample_data/")
def analyze_each(
    paths: Paths,
    columns: Columns = "",
    reading_u: ReadingU = None,
    uncertainty: UncertaintyKind = Uncertainty.COVARIANCE,
    keep_outliers: KeepOutliers = False,
    save: Save = True,
    out: ResultFolder = None,
    as_json: Json = False,
) -> None:
    """Each analysis that suits the runs or data files; --json prints a list where several suit."""
    from levilab.pipelines.catalogue import analyze_suiting

    options = _options(columns, reading_u, uncertainty.value, keep_outliers)
    _write_and_print(analyze_suiting(paths, options), save=save, out=out, as_json=as_json)


def _write_and_print(results: list[tuple[Analysis[Any], Any]], *, save: bool, out: Path | None, as_json: bool) -> None:
    """Write the results, then print them: a reader that goes away must not cost a result."""
    from levilab.pipelines.catalogue import print_analysis

    failures: list[LevilabError] = []
    messages: list[str] = []
    for analysis, found in results:
        messages += found.remarks
        if save:
            failure, written = _save(analysis, found, out)
            failures += [failure] if failure else []
            messages += [f"wrote {path}" for path in written]
    if as_json:
        import json

        documents = [analysis.document(found, out or found.home) for analysis, found in results]
        one_or_all = documents[0] if len(documents) == 1 else documents
        typer.echo(json.dumps(one_or_all, indent=2, sort_keys=True, allow_nan=False))
    else:
        for analysis, found in results:
            print_analysis(analysis, found)
    for text in messages:
        typer.echo(text, err=True)
    if failures:
        raise failures[0]


def _options(columns: str, reading_u: float | None, uncertainty: str, keep_outliers: bool) -> Options:
    from levilab.formats.table import parse_columns
    from levilab.pipelines.sources import Options

    if reading_u is not None and not 0 < reading_u < float("inf"):
        raise typer.BadParameter(
            f"{reading_u:g} Hz; a standard uncertainty above 0 is expected", param_hint="--reading-u"
        )
    return Options(parse_columns(columns), reading_u, cast("Kind", uncertainty), keep_outliers)


def _save(analysis: Analysis[Any], found: Any, out: Path | None) -> tuple[LevilabError | None, list[Path]]:
    """What kept the result from being written, or the files; what was found is shown either way."""
    from levilab.errors import LevilabError

    try:
        return None, analysis.save(found, out)
    except LevilabError as error:
        return error, []


@app.command(epilog="Example: levilab report sample_data/ -o report.html")
def report(
    paths: Paths,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE.html", help="The file to write.")] = Path(
        "report.html"
    ),
    columns: Columns = "",
    reading_u: ReadingU = None,
    keep_outliers: KeepOutliers = False,
) -> None:
    """Report runs in one self-contained file: what was measured, with what, figures, numbers, warnings.

    The numbers are those that levilab analyze wrote beside the runs.  What has no result there, or one of other
    readings or options than the given, is analyzed for the page.
    """
    from levilab.report.page import write_report

    options = _options(columns, reading_u, "covariance", keep_outliers)
    typer.echo(f"the report is in {write_report(paths, output, options)}")


@app.command(epilog="Example: levilab runs runs/")
def runs(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="The folder to search.")] = Path("runs"),
    as_json: Json = False,
) -> None:
    """List runs: when, what, status, length."""
    from levilab.runs.listing import list_runs, print_runs

    found = list_runs(folder)
    if as_json:
        import json

        typer.echo(json.dumps([vars(run) for run in found], indent=2))
    else:
        print_runs(found, folder)


cli_simulator.add_to(app)


def main() -> None:
    """The console script: known failures become one line and an exit status, everything else stays loud."""
    _never_fail_to_print()
    try:
        app()
    except BrokenPipeError:  # whoever read our output went away: nothing is left to say, and nobody to say it to
        _mute()
        sys.exit(EXIT_FAILED)
    except Exception as error:  # noqa: BLE001 - sorted by kind below
        _tell(error)


def _tell(error: Exception) -> NoReturn:
    from analysis.errors import AnalysisError
    from instruments.errors import InstrumentError
    from levilab.errors import LevilabError

    codes = ((LevilabError, getattr(error, "exit_code", EXIT_FAILED)), (InstrumentError, EXIT_INSTRUMENT))
    for kind, code in (*codes, (AnalysisError, EXIT_FAILED), (OSError, EXIT_FAILED)):
        if isinstance(error, kind):
            with contextlib.suppress(OSError):
                typer.echo("levilab: " + " ".join(str(error).split()), err=True)
            sys.exit(code)
    raise error


def _mute() -> None:
    """Python flushes its streams when it ends; into a broken pipe it would complain."""
    with open(os.devnull, "w", encoding="utf-8") as nowhere:  # noqa: PTH123 - a descriptor is needed
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                os.dup2(nowhere.fileno(), stream.fileno())


def _never_fail_to_print() -> None:
    """Consoles and pipes of Windows may use code pages without ν and ⁻³: those are spelled out there."""
    from levilab.present.characters import SPELLED_OUT

    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure:
            reconfigure(errors=SPELLED_OUT)
