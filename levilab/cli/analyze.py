"""Analyze: runs and data files.  Heavy imports happen inside the commands that need them."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from levilab.cli.options import Columns, Json, KeepOutliers, Paths, ReadingU
from levilab.errors import LevilabError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from analysis.spindown.lawfit import Uncertainty as Kind
    from levilab.pipelines.sources import Options

analyze_app = typer.Typer(no_args_is_help=True, help="Analyze runs or data files.")


class Uncertainty(StrEnum):
    """How the uncertainties of the fitted constants are found."""

    COVARIANCE = "covariance"
    PROFILE = "profile"
    BOOTSTRAP = "bootstrap"


@analyze_app.command("spindown", epilog="Example: levilab analyze spindown sample_data/")
def analyze_spindown(
    paths: Paths,
    columns: Columns = "",
    reading_u: ReadingU = None,
    uncertainty: Annotated[
        Uncertainty, typer.Option(help="profile and bootstrap add 68 % intervals, and take longer.")
    ] = Uncertainty.COVARIANCE,
    keep_outliers: KeepOutliers = False,
    save: Annotated[bool, typer.Option(help="Write result.json and figures beside the run.")] = True,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Write them there instead.")] = None,
    as_json: Json = False,
) -> None:
    """Drag laws from spin-downs: stokes, newton, disc, mixed and power law, and which of them the data exclude."""
    from levilab.pipelines.spindown.analysis import analyze_spindowns
    from levilab.pipelines.spindown.document import as_document, save_result
    from levilab.pipelines.spindown.table import print_spindown

    analysis = analyze_spindowns(paths, options(columns, reading_u, uncertainty.value, keep_outliers))
    failure: LevilabError | None = None
    written: list[Path] = []
    if save:  # first: a reader that goes away must not cost the result
        failure, written = _tried(lambda: save_result(analysis, out or analysis.home))
    if as_json:
        import json

        document = as_document(analysis, out or analysis.home)
        typer.echo(json.dumps(document, indent=2, sort_keys=True, allow_nan=False))
    else:
        print_spindown(analysis)
    for path in written:
        typer.echo(f"wrote {path}", err=True)
    if failure:
        raise failure


def options(columns: str, reading_u: float | None, uncertainty: str, keep_outliers: bool) -> Options:
    """How to analyze, from the options of the commands.  Raises UsageError."""
    from levilab.formats.table import parse_columns
    from levilab.pipelines.sources import Options

    if reading_u is not None and not 0 < reading_u < float("inf"):
        raise UsageError("reading_u", "a standard uncertainty above 0 [Hz] is expected", value=reading_u)
    return Options(parse_columns(columns), reading_u, cast("Kind", uncertainty), keep_outliers)


def _tried(save: Callable[[], list[Path]]) -> tuple[LevilabError | None, list[Path]]:
    """What kept the result from being written, or the files; what was found is shown either way."""
    try:
        return None, save()
    except LevilabError as error:
        return error, []
