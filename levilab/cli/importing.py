"""Ctrl-C while a command imports its modules, before it does anything."""

from contextlib import AbstractContextManager

from levilab.cli.exit_codes import INTERRUPTED
from levilab.interruption import interruption_ends_process

LINE = "levilab: interrupted\n"


def importing() -> AbstractContextManager[None]:
    """Return the context of these imports: Ctrl-C ends the process in one line."""
    return interruption_ends_process(INTERRUPTED, LINE)
