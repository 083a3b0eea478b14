"""Export.  Heavy imports happen inside the command."""

from pathlib import Path
from typing import Annotated, Any

from levilab.cli.analyze import takes_options
from levilab.cli.options import argument, existing_path, flag, option, place, writable
from levilab.cli.output import interruptible, message, result
from levilab.errors import UsageError, check_ending
from levilab.pipelines.options import OF_REPORT, read_options
from levilab.report.export.endings import ENDINGS


def _named_path(path: Path | None) -> Path | None:
    if path is None:
        raise UsageError("PATH", "is missing: name a run, a data file or a sweep, as in levilab export runs/NAME")
    return existing_path(path)


_ONE = "one path is exported into one file: name the folder of several runs, which has a row for each of them"


def _named_file(file: Path | None) -> Path | None:
    """Return the name of a file in one of the formats that can be written.  Raises UsageError, CannotWrite."""
    if file and file.suffix.lower() not in ENDINGS and file.exists():
        raise UsageError("PATH", _ONE, value=f"… {file}")
    if file:
        check_ending(file, ENDINGS)
    return writable(file)


@takes_options(OF_REPORT)
def export_data(
    path: Annotated[
        Path | None,
        argument(
            "PATH",
            "A run folder, a data file, a sweep's NAME.zarr.",
            readable=False,
            show_default=False,
            callback=_named_path,
        ),
    ] = None,
    file: Annotated[Path | None, argument("FILE", "The same as --out.", readable=False, callback=_named_file)] = None,
    out: Annotated[
        Path | None,
        place(
            "FILE",
            f"The file to write; its ending is {', '.join(ENDINGS)}.",
            show_default="NAME.zip",
            callback=_named_file,
        ),
    ] = None,
    creator: Annotated[str, option("NAMES", "Who measured; by default the run's group.")] = "",
    licence: Annotated[str, option("NAME", "Under which others may use the data, as CC-BY-4.0 or CC0-1.0.")] = "",
    force: Annotated[bool, flag("Replace files that are there.", "--force")] = False,
    **given: Any,
) -> None:
    """Export."""
    from levilab.report.export.contents import contents_of
    from levilab.report.export.write import export

    assert path  # else it was refused
    if out and file:
        raise UsageError("PATH", _ONE, value=f"… {file}")
    options = read_options(given, typed=True)
    target = out or file or Path(f"{path.stem if path.is_file() or path.suffix == '.zarr' else path.name}.zip")
    with interruptible("nothing is written"):
        written = export(
            lambda: contents_of(path, message, options), target, creator=creator, licence=licence, force=force
        )
    for one in written:
        result(f"wrote {one}")
