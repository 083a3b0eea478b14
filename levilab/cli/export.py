"""Export.  Heavy imports happen inside the command."""

from pathlib import Path
from typing import Annotated, Any

import typer

from levilab.cli.analyze import takes_options
from levilab.cli.options import existing_path, place, writable
from levilab.cli.output import interruptible, message, result
from levilab.cli.quantities import with_options
from levilab.pipelines.options import OF_REPORT, read_options


@takes_options(OF_REPORT)
def export_data(
    context: typer.Context,
    path: Annotated[
        Path,
        typer.Argument(
            metavar="PATH",
            readable=False,
            help="A run folder, a data file, a sweep's NAME.zarr.",
            callback=existing_path,
        ),
    ],
    file: Annotated[
        Path | None, typer.Argument(metavar="FILE", readable=False, help="The same as --out.", callback=writable)
    ] = None,
    out: Annotated[
        Path | None,
        place(
            "FILE",
            "The file to write; its ending is .nc, .h5, .csv or .zip.",
            show_default="NAME.zip",
            callback=writable,
        ),
    ] = None,
    creator: Annotated[str, typer.Option(metavar="NAMES", help="Who measured; by default the run's group.")] = "",
    licence: Annotated[
        str, typer.Option(metavar="NAME", help="Under which others may use the data, as CC-BY-4.0 or CC0-1.0.")
    ] = "",
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    **given: Any,
) -> None:
    """Export."""
    from levilab.report.export.contents import contents_of
    from levilab.report.export.write import export

    app, options = context.find_root().command, read_options(given, typed=True)

    def tell(text: str) -> None:
        message(with_options(text, app))

    target = out or file or Path(f"{path.stem if path.is_file() or path.suffix == '.zarr' else path.name}.zip")
    with interruptible("nothing is written"):
        written = export(
            lambda: contents_of(path, tell, options), target, creator=creator, licence=licence, force=force
        )
    for one in written:
        result(f"wrote {one}")
