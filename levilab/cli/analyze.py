"""Analyze: runs and data files.  Heavy imports happen inside the commands that need them."""

from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
import typer.core

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
from levilab.errors import LevilabError, UsageError

if TYPE_CHECKING:
    from levilab.pipelines.catalogue import Analysis


class AnalyzeGroup(typer.core.TyperGroup):
    """`levilab analyze PATH…` without the name of an analysis is `levilab analyze each PATH…`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put in the name where there is none, and none was meant."""
        if args and args[0] not in ctx.help_option_names:
            k = self._first_word(args)
            named = k is not None and (args[k] in self.commands or self._is_misspelt(args[k]))
            args = [args[k], *args[:k], *args[k + 1 :]] if k is not None and named else ["each", *args]
        return super().parse_args(ctx, args)

    def _first_word(self, args: list[str]) -> int | None:
        """Where the first word stands that is no option, nor the value of one."""
        options = [one for one in self.commands["each"].params if not getattr(one, "is_flag", True)]
        with_value = {name for option in options for name in option.opts}
        numbered = iter(enumerate(args))
        for k, word in numbered:
            if word in with_value:
                next(numbered, None)
            elif word == "--" or not word.startswith("-"):
                return None if word == "--" else k
        return None

    def _is_misspelt(self, word: str) -> bool:
        """Whether a word is nearly the name of an analysis, and no path."""
        from difflib import get_close_matches  # not for every help

        return bool(get_close_matches(word, self.commands)) and not Path(word).exists()


analyze_app = typer.Typer(
    cls=AnalyzeGroup,
    no_args_is_help=True,
    help="Analyze runs or data files.  Without a COMMAND: each analysis that suits, as levilab analyze runs/.",
)


class Uncertainty(StrEnum):
    """How the uncertainties of the fitted constants are found."""

    COVARIANCE = "covariance"
    PROFILE = "profile"
    BOOTSTRAP = "bootstrap"


class Method(StrEnum):
    """How the pulses of a trace are found."""

    AUTO = "auto"
    EDGES = "edges"
    MATCHED = "matched"
    LIKELIHOOD = "likelihood"


PulseMethod = Annotated[
    Method, typer.Option("--method", help="How pulses are found: edges is the fastest, likelihood for weak ones.")
]
UncertaintyKind = Annotated[
    Uncertainty, typer.Option("--uncertainty", help="profile and bootstrap add 68 % intervals, and take longer.")
]
Orthogonal = Annotated[
    bool, typer.Option("--orthogonal", help="Let the uncertainty of the drive's frequency count, too.")
]
Save = Annotated[bool, typer.Option(help="Write the result and figures beside the run.")]
ResultFolder = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Write them there instead.")]


#: Analysis → what its command does.  The catalogue itself takes too long to import for a help page.
ANALYSIS_HELP = {
    "spindown": (
        "Drag laws from spin-downs: stokes, newton, disc, mixed and power law, and which of them the data exclude."
    ),
    "spin": (
        "Spin frequency and chirp from traces of a detector (WAV, scopes' CSV, .npy), lists of pulse times, runs with "
        "traces."
    ),
    "field": "The base from a Hall scan: strength, origin, thickness; heights, masses and spins of tops that float.",
    "precession": (
        "Precession against drive: slope and intercept, tested against a locked top, and what 1.05 would take."
    ),
    "limit": "Limits of the spin, lower and upper: mean, scatter, trend and outliers, beside the window of the top.",
}
#: The command that stands for no name, and is not listed.
_EACH = "each"
_EACH_HELP = "Each analysis that suits the runs or data files; --json prints a list where several suit."


def spindown(
    context: typer.Context,
    paths: Paths,
    columns: Columns = "",
    channel: Channel = None,
    rate: Rate = None,
    reading_u: ReadingU = None,
    uncertainty: UncertaintyKind = Uncertainty.COVARIANCE,
    keep_outliers: KeepOutliers = False,
    save: Save = True,
    out: ResultFolder = None,
    as_json: Json = False,
) -> None:
    """Fit the drag laws."""
    given = inputs(columns, channel, rate) | spindown_options(reading_u, uncertainty.value, keep_outliers)
    _analyze(context, paths, given, save=save, out=out, as_json=as_json)


def spin(
    context: typer.Context,
    paths: Paths,
    columns: Columns = "",
    channel: Channel = None,
    rate: Rate = None,
    method: PulseMethod = Method.AUTO,
    save: Save = True,
    out: ResultFolder = None,
    as_json: Json = False,
) -> None:
    """Find the spin frequency."""
    given = inputs(columns, channel, rate) | {"method": method.value}
    _analyze(context, paths, given, save=save, out=out, as_json=as_json)


def field(
    context: typer.Context,
    paths: Paths,
    columns: Columns = "",
    device: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Describes base and top, as sample_data/device.toml does; see levilab top."),
    ] = None,
    height: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Where the top was seen to float: its moment follows, if its mass is known."),
    ] = None,
    height_u: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Standard uncertainty of --height.", show_default="that of the scan's heights"),
    ] = None,
    free_radii: Annotated[
        bool, typer.Option("--free-radii", help="Let the scan move the radii, too, within what the calliper says.")
    ] = False,
    save: Save = True,
    out: ResultFolder = None,
    as_json: Json = False,
) -> None:
    """Fit scans of the base's field, and work out what follows."""
    from levilab.formats.device import read_device

    for name, value, lowest in (("height", height, -1000.0), ("height_u", height_u, 0.0)):
        if value is not None and not lowest <= value <= 2000.0:
            raise UsageError(name, f"a number of millimetres from {lowest:g} to 2000 is expected", value=value)
    if height_u is not None and height is None:
        raise UsageError("height_u", "goes with `height` alone")
    given = {
        "columns": inputs(columns, None, None)["columns"],
        "device": None if device is None else read_device(device),
        "height_m": None if height is None else height / 1000,
        "height_u_m": None if height_u is None else height_u / 1000,
        "free_radii": free_radii,
    }
    _analyze(context, paths, given, save=save, out=out, as_json=as_json)


def limit(
    context: typer.Context,
    paths: Paths,
    columns: Columns = "",
    reading_u: ReadingU = None,
    save: Save = True,
    out: ResultFolder = None,
    as_json: Json = False,
) -> None:
    """Find the mean and the scatter of limits."""
    given = inputs(columns, None, None) | {"reading_u": positive_u(reading_u)}
    _analyze(context, paths, given, save=save, out=out, as_json=as_json)


def precession(
    context: typer.Context,
    paths: Paths,
    columns: Columns = "",
    reading_u: ReadingU = None,
    keep_outliers: KeepOutliers = False,
    orthogonal: Orthogonal = False,
    save: Save = True,
    out: ResultFolder = None,
    as_json: Json = False,
) -> None:
    """Fit the line of precession against drive."""
    given = inputs(columns, None, None) | {
        "reading_u": positive_u(reading_u),
        "keep_outliers": keep_outliers,
        "orthogonal": orthogonal,
    }
    _analyze(context, paths, given, save=save, out=out, as_json=as_json)


def each(
    context: typer.Context,
    paths: Paths,
    columns: Columns = "",
    channel: Channel = None,
    rate: Rate = None,
    reading_u: ReadingU = None,
    uncertainty: UncertaintyKind = Uncertainty.COVARIANCE,
    keep_outliers: KeepOutliers = False,
    method: PulseMethod = Method.AUTO,
    save: Save = True,
    out: ResultFolder = None,
    as_json: Json = False,
) -> None:
    """Carry out each analysis that suits; an option goes to those that know it."""
    given = inputs(columns, channel, rate) | spindown_options(reading_u, uncertainty.value, keep_outliers)
    _analyze(context, paths, given | {"method": method.value}, save=save, out=out, as_json=as_json)


_COMMANDS: dict[str, Callable[..., None]] = {
    command.__name__: command for command in (spindown, spin, field, limit, precession)
}
for _name, _help in ANALYSIS_HELP.items():
    analyze_app.command(_name, help=_help, epilog=f"Example: levilab analyze {_name} sample_data/")(_COMMANDS[_name])
analyze_app.command(_EACH, help=_EACH_HELP, hidden=True, epilog="Example: levilab analyze sample_data/")(each)


def inputs(columns: str, channel: str | None, rate: float | None) -> dict[str, Any]:
    """How inputs are read, from the options of the commands.  Raises UsageError."""
    from levilab.formats.table import parse_columns

    if rate is not None and not 0 < rate < float("inf"):
        raise UsageError("rate", "samples per second are expected, a number above 0 [Hz]", value=rate)
    return {"columns": parse_columns(columns), "channel": channel, "rate": rate}


def positive_u(reading_u: float | None) -> float | None:
    """The uncertainty of a reading [Hz].  Raises UsageError for one that is not positive."""
    if reading_u is not None and not 0 < reading_u < float("inf"):
        raise UsageError("reading_u", "a standard uncertainty above 0 [Hz] is expected", value=reading_u)
    return reading_u


def spindown_options(reading_u: float | None, uncertainty: str, keep_outliers: bool) -> dict[str, Any]:
    """How to analyze spin-downs, from the options of the commands.  Raises UsageError."""
    return {"reading_u": positive_u(reading_u), "uncertainty": uncertainty, "keep_outliers": keep_outliers}


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
    from levilab.pipelines.catalogue import ANALYSES, analyze_suiting

    left_out: list[str] = []
    with interruptible("what was fitted so far is lost, nothing is written"):
        if context.info_name == _EACH:
            results = analyze_suiting(paths, given, left_out.append)
        else:
            analysis = ANALYSES[str(context.info_name)]
            results = [(analysis, analysis.analyze(paths, analysis.options_from(given)))]
    with interruptible("look which results are written: each one is whole"):
        _write_and_print(context, results, left_out, save=save, out=out, as_json=as_json)


def _write_and_print(
    context: typer.Context,
    results: list[tuple["Analysis[Any]", Any]],
    left_out: list[str],
    *,
    save: bool,
    out: Path | None,
    as_json: bool,
) -> None:
    """Write the results, then print them: a reader that goes away must not cost a result.

    left_out: why other analyses have no result.
    """
    from levilab.pipelines.catalogue import print_analysis, remarks

    in_words = partial(with_options, names=option_names(context.find_root().command))
    failures: list[LevilabError] = []
    messages = [*left_out, *remarks([found.remarks for _, found in results])]
    for analysis, found in results:
        if save:
            failure, written = _save(analysis, found, out)
            failures += [failure] if failure else []
            messages += [f"wrote {path}" for path in written]
    if as_json:
        documents = [analysis.document(found, out or found.home) for analysis, found in results]
        print_json(documents[0] if len(documents) == 1 else documents, sort_keys=True)
    else:
        for analysis, found in results:
            print_analysis(analysis, found, in_words)
    for text in messages:
        message(in_words(text))
    if failures:
        raise failures[0]


def _save(analysis: "Analysis[Any]", found: Any, out: Path | None) -> tuple[LevilabError | None, list[Path]]:
    """What kept the result from being written, or the files; what was found is shown either way."""
    from levilab.pipelines.catalogue import save

    try:
        return None, save(analysis, found, out)
    except LevilabError as error:
        return error, []
