"""Report, and the list of runs.  Heavy imports happen inside the commands that need them."""

from pathlib import Path
from typing import Annotated

import typer

from levilab.cli.analyze import inputs, spindown_options
from levilab.cli.options import (
    Channel,
    Columns,
    Json,
    KeepOutliers,
    Paths,
    Rate,
    ReadingU,
    option_names,
    with_options,
)
from levilab.cli.output import interruptible, message, print_json


def add_to(app: typer.Typer) -> None:
    """Make the commands known to the application."""
    app.command(epilog="Example: levilab report sample_data/ -o report.html")(report)
    app.command(epilog="Example: levilab runs runs/")(runs)


def report(
    context: typer.Context,
    paths: Paths,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE.html", help="The file to write.")] = Path(
        "report.html"
    ),
    columns: Columns = "",
    channel: Channel = None,
    rate: Rate = None,
    reading_u: ReadingU = None,
    keep_outliers: KeepOutliers = False,
) -> None:
    """Report runs in one self-contained file: what was measured, with what, figures, numbers, warnings.

    The numbers are those that levilab analyze wrote beside the runs, of every analysis; where it wrote them elsewhere
    (--out), give that folder or result.json.  What has no result, or one of other readings or options than the given,
    is analyzed for the page.
    """
    from levilab.report.page import write_report

    given = inputs(columns, channel, rate) | spindown_options(reading_u, "covariance", keep_outliers)
    names = option_names(context.find_root().command)
    with interruptible("no report is written"):
        written = write_report(paths, output, given, lambda text: message(with_options(text, names)))
    typer.echo(f"the report is in {written}")


def runs(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="The folder to search.")] = Path("runs"),
    as_json: Json = False,
) -> None:
    """List runs: when, what, status, length."""
    from levilab.runs.listing import list_runs, print_runs

    found = list_runs(folder)
    if as_json:
        print_json([vars(run) for run in found])
    else:
        print_runs(found, folder)
