"""The live view.  Heavy imports happen inside the command."""

import sys
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from levilab.cli import exit_codes
from levilab.cli.importing import importing
from levilab.cli.options import PageLanguage, argument, flag, option, place
from levilab.cli.output import message, result
from levilab.errors import UsageError


def live(
    run: Annotated[
        Path | None,
        argument("RUN", "A run folder.", readable=False, show_default="the newest, one that is running first"),
    ] = None,
    mock: Annotated[bool, flag("A virtual bench to play with, and to record runs on.", "--mock")] = False,
    seed: Annotated[int, option("N", "With --mock, draws the top; of Group 1, as in levilab worksheet.", min=0)] = 0,
    out: Annotated[Path, place("DIR", "The folder with the runs.")] = Path("runs"),
    port: Annotated[int, option("N", "Of the loopback address; 0: any that is free.", min=0, max=65535)] = 8765,
    share: Annotated[
        bool, flag("Let phones in the same network look on, by a second address with a QR code.", "--share")
    ] = False,
    language: PageLanguage = "",
    no_open: Annotated[bool, flag("Open no browser: print the address only.", "--no-open", "--no-browser")] = False,
) -> None:
    """Serve the view until Ctrl-C."""
    if seed and not mock:
        raise UsageError("seed", "goes with `mock`: it draws the top of the virtual bench")
    if run is not None:  # before what takes long to import
        from levilab.runs.find import run_or_folder

        run_or_folder(run, out)
    said = (
        "Ctrl-C ends the view and the bench for practice, whose time stands still while no page is open"
        if mock
        else "Ctrl-C ends the view; a run goes on without it"
    )
    serve(said, opens=not no_open, run=run, out=out, mock=mock, seed=seed, port=port, share=share, language=language)


def serve(said: str, *, opens: bool, **options: Any) -> NoReturn:
    """Serve pages until Ctrl-C, and end the command.

    Args:
        said: how it ends, for the person at the terminal.
        opens: whether a browser is opened.
        options: of `levilab.live.serve.LiveOptions`.
    """
    with importing():
        from levilab.animation.three import three_js

        three_js("the live view")  # raises where the extra is not installed
        from levilab.interruption import watching_for_end
        from levilab.live.serve import LiveOptions, serve_live

    def announce(address: str, shared: str) -> None:
        result(address)
        if shared:
            _show_code(shared)
        message(said)
        if opens:
            import webbrowser

            webbrowser.open(address)

    with watching_for_end() as end:  # up to the last word
        serve_live(LiveOptions(**options), end, announce, message)
        message("levilab: the view is closed")
    raise typer.Exit(exit_codes.INTERRUPTED)


def _show_code(address: str) -> None:
    """Print the address for guests, who they are, and on a terminal its QR code, light on dark in any colours."""
    from levilab.live.share import code_of, who_may_look

    message(f"for phones: {address}\n{who_may_look(address)}")
    if sys.stderr.isatty() and "utf" in sys.stderr.encoding.casefold():
        for line in code_of(address):
            typer.echo(f"\N{ESCAPE}[97;40m{line}\N{ESCAPE}[0m", err=True)
