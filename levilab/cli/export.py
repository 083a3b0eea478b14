"""Export.  Heavy imports happen inside the command."""

from pathlib import Path
from typing import Annotated, Any

from levilab.cli.analyze import takes_options
from levilab.cli.options import argument, existing_paths, flag, option, place, writable
from levilab.cli.output import interruptible, message, result
from levilab.errors import UsageError, check_ending
from levilab.pipelines.options import OF_REPORT, read_options
from levilab.report.export.endings import ENDINGS


def _split(paths: list[Path] | None, out: Path | None) -> tuple[list[Path], Path | None]:
    """Return the inputs, and the file to write: without --out the last of several names, unless it is another input.

    Raises UsageError, also for a last name of a file that exists: it may be an input; DataError, CannotWrite.
    """
    if not paths:
        raise UsageError("PATH", "is missing: name a run, a data file or a sweep, as in levilab export runs/NAME")
    *inputs, last = paths
    if not (out or not inputs or (last.exists() and last.suffix.lower() not in ENDINGS)):
        check_ending(last, ENDINGS)
        if last.exists():
            raise UsageError("PATH", "is there already: name the file to write with `out`", value=last)
        paths, out = inputs, writable(last)
    return existing_paths(paths) or [], out


@takes_options(OF_REPORT)
def export_data(
    paths: Annotated[
        list[Path] | None,
        argument(
            "PATH",
            "Run folders, data files, folders to search, or a sweep's NAME.zarr; then FILE, the same as --out.",
            readable=False,
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        place("FILE", f"The file to write; its ending is {', '.join(ENDINGS)}.", ENDINGS, show_default="NAME.zip"),
    ] = None,
    creator: Annotated[str, option("NAMES", "Who measured; by default the run's group.")] = "",
    licence: Annotated[str, option("NAME", "Under which others may use the data, as CC-BY-4.0 or CC0-1.0.")] = "",
    force: Annotated[bool, flag("Replace files that are there.", "--force")] = False,
    **given: Any,
) -> None:
    """Export."""
    from levilab.report.export.contents import contents_of
    from levilab.report.export.write import export

    inputs, out = _split(paths, out)
    options, path = read_options(given, typed=True), inputs[0]
    target = out or Path(f"{path.stem if path.is_file() or path.suffix == '.zarr' else path.name}.zip")
    with interruptible("nothing is written"):
        written = export(
            lambda: contents_of(inputs, message, options), target, creator=creator, licence=licence, force=force
        )
    for one in written:
        result(f"wrote {one}")
