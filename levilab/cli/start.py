"""The console script and `python -m levilab`: Ctrl-C ends them in one line from their first import on."""

from __future__ import annotations

import sys

from levilab.cli.exit_codes import INTERRUPTED


def main() -> None:
    """Import the application and carry out the command line."""
    try:
        from levilab.cli.main import main as carry_out  # with typer: a tenth of a second, in which Ctrl-C may come

        carry_out()
    except KeyboardInterrupt:
        sys.stderr.write("levilab: interrupted\n")
        sys.exit(INTERRUPTED)
