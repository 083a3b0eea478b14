"""Report, the list of runs, the calculator for the top.  Heavy imports happen inside the commands that need them."""

from pathlib import Path
from typing import Annotated, Any

from levilab.cli.analyze import takes_options
from levilab.cli.options import HEADING, Json, Language, Paths, argument, existing_path, flag, option, place
from levilab.cli.output import interruptible, message, place_of_report, print_json, result
from levilab.pipelines.options import OF_REPORT, read_options


@takes_options(OF_REPORT, HEADING)
def report(
    paths: Paths = None,
    out: Annotated[
        Path,
        place(
            "FILE",
            r"The file to write; its ending, .html or .pdf, chooses the format.  PDF needs levilab\[pdf].",
            (".html", ".pdf"),
        ),
    ] = Path("report.html"),
    tables: Annotated[
        bool,
        flag(
            "Write the tables of results, too, into a folder beside the report, report.tables for report.html: "
            "CSV with all digits, LaTeX as shown.",
            "--tables",
        ),
    ] = False,
    crosscheck: Annotated[
        bool,
        flag(
            "Make a cross-check with the result's own parameters where none is stored and it takes seconds.",
            "--crosscheck/--no-crosscheck",
        ),
    ] = True,
    short: Annotated[
        bool, flag("Answer, values, figure and notes alone; of one experiment a page.", "--short")
    ] = False,
    language: Language = "en",  # noqa: ARG001 - its callback speaks it
    **given: Any,
) -> None:
    """Write the report."""
    from levilab.report.page import write_report
    from levilab.report.reproduction import Heading

    heading = Heading(**{one.name: given.pop(one.name) for one in HEADING})
    place = place_of_report(out)
    message("making the report; what has no result yet is analyzed for it")
    with interruptible("no report is written"):
        written = write_report(
            paths or (),
            out,
            read_options(given, typed=True),
            message,
            tables=tables,
            crosscheck=crosscheck,
            short=short,
            heading=heading,
        )
    result(place)
    if tables:
        from levilab.report.tables.values import folder_of

        result(f"its tables are in {folder_of(written)}")


def runs(
    folder: Annotated[
        Path | None, argument("DIR", "The folder to search.", readable=False, show_default="runs")
    ] = None,
    out: Annotated[Path | None, place("DIR", "The same, as acquire has it.", readable=False, callback=None)] = None,
    last: Annotated[int | None, option("N", "The latest N runs alone.", min=1)] = None,
    as_json: Json = False,
    language: Language = "en",  # noqa: ARG001 - its callback speaks it
) -> None:
    """List the runs in a folder."""
    from levilab.runs.find import RUNS, must_be_searchable

    folder = folder or out or RUNS
    must_be_searchable(folder)  # before what takes long to import
    from levilab.runs.listing import list_runs, print_runs

    found = list_runs(folder)
    found = found if last is None else found[-last:]
    if as_json:
        print_json([vars(run) for run in found])
    else:
        print_runs(found, folder)


def top(
    device: Annotated[
        Path,
        argument(
            "FILE",
            "Describes the top's parts, as sample_data/device.toml does.",
            readable=False,
            callback=existing_path,
        ),
    ],
    as_json: Json = False,
) -> None:
    """Calculate mass and moments of inertia."""
    from levilab.pipelines.top import calculate_top, top_document, top_table, top_text

    found = calculate_top(device)
    if as_json:
        print_json(top_document(found), sort_keys=True)
        return
    from levilab.present.terminal import draw, terminal  # with rich

    console = terminal()
    console.print(draw(top_table(found)))
    console.print(top_text(found), markup=False)
