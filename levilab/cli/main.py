"""The application and its console script.  Heavy imports happen inside the commands that need them."""

import codecs
import contextlib
import os
import sys
from typing import Annotated, NoReturn

import typer

from levilab.cli import crosscheck, exit_codes, report, simulate, top
from levilab.cli.acquire import acquire_app
from levilab.cli.analyze import analyze_app
from levilab.cli.bench import bench_app
from levilab.cli.options import in_options
from levilab.cli.output import message

app = typer.Typer(
    name="levilab",
    help="The lab application for experiments on the Levitron: acquire, analyze, report.",
    epilog="Try: levilab acquire spin --mock",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(acquire_app, name="acquire")
app.add_typer(analyze_app, name="analyze")
app.add_typer(bench_app, name="bench")
report.add_to(app)
simulate.add_to(app)
crosscheck.add_to(app)
top.add_to(app)


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


def main() -> None:
    """The console script: known failures become one line and an exit status, everything else stays loud."""
    _prepare_output()
    try:
        app()
    except BrokenPipeError:  # the reader closed the pipe
        _silence_output()
        sys.exit(exit_codes.FAILED)
    except Exception as error:  # noqa: BLE001 - sorted by kind below
        _exit_with(error)


def _exit_with(error: Exception) -> NoReturn:
    try:
        status = exit_codes.exit_status(error)
    except OSError:  # no file can be opened any more, not even that of a module
        status = exit_codes.FAILED
    if status is None:
        raise error
    with contextlib.suppress(OSError):
        message("levilab: " + _in_one_line(in_options(error, app)))
    sys.exit(status)


def _in_one_line(text: str) -> str:
    """Without line ends, and without what would steer the terminal: a file's name may hold it."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in " ".join(text.split()))


def _silence_output() -> None:
    """Python flushes its streams when it ends; into a broken pipe it would complain."""
    with open(os.devnull, "w", encoding="utf-8") as nowhere:  # noqa: PTH123 - a descriptor is needed
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                os.dup2(nowhere.fileno(), stream.fileno())


def _prepare_output() -> None:
    """Consoles and pipes of Windows may use code pages without ν and ⁻³: those are spelled out there.

    A stream that is closed from the start, as by ``>&-``, is None in Python: what goes there is thrown away.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115 - until the end
        reconfigure = getattr(getattr(sys, name), "reconfigure", None)
        if reconfigure and codecs.lookup(getattr(sys, name).encoding or "utf-8").name != "utf-8":
            from levilab.present.characters import SPELLED_OUT

            reconfigure(errors=SPELLED_OUT)
        elif reconfigure:  # what UTF-8 has no place for, as in the name of a file
            reconfigure(errors="replace")
