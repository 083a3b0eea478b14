"""Report, and the list of runs.  Heavy imports happen inside the commands that need them."""

from pathlib import Path
from typing import Annotated

import typer

from levilab.cli.analyze import analysis_options
from levilab.cli.options import Channel, Columns, Json, KeepOutliers, Paths, Rate, ReadingU
from levilab.cli.output import interruptible, message, place_of_report, print_json, result
from levilab.cli.quantities import with_options


def report(
    context: typer.Context,
    paths: Paths,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help=r"The file to write; its ending, .html or .pdf, chooses the format.  PDF needs levilab\[pdf].",
        ),
    ] = Path("report.html"),
    tables: Annotated[
        bool,
        typer.Option(
            "--tables",
            help="Write the tables of results, too, into a folder beside the report, report.tables for report.html: "
            "CSV with all digits, LaTeX as shown.",
        ),
    ] = False,
    columns: Columns = "",
    channel: Channel = None,
    rate: Rate = None,
    reading_u: ReadingU = None,
    keep_outliers: KeepOutliers = False,
    crosscheck: Annotated[
        bool,
        typer.Option(
            "--crosscheck/--no-crosscheck",
            help="Make a cross-check with the result's own parameters where none is stored and it takes seconds.",
        ),
    ] = True,
) -> None:
    """Write the report."""
    from levilab.report.page import write_report

    given = {
        "columns": columns,
        "channel": channel,
        "rate": rate,
        "reading_u": reading_u,
        "keep_outliers": keep_outliers,
    }
    app = context.find_root().command
    place = place_of_report(output)
    with interruptible("no report is written"):
        written = write_report(
            paths,
            output,
            analysis_options(given),
            lambda text: message(with_options(text, app)),
            tables=tables,
            crosscheck=crosscheck,
        )
    result(place)
    if tables:
        from levilab.report.tables.folder import folder_of

        result(f"its tables are in {folder_of(written)}")


def runs(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", readable=False, help="The folder to search.")] = Path(
        "runs"
    ),
    last: Annotated[int | None, typer.Option(metavar="N", min=1, help="The latest N runs alone.")] = None,
    as_json: Json = False,
) -> None:
    """List the runs in a folder."""
    from levilab.runs.listing import list_runs, print_runs

    found = list_runs(folder)
    found = found if last is None else found[-last:]
    if as_json:
        print_json([vars(run) for run in found])
    else:
        print_runs(found, folder)
