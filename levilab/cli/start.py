"""The console script and `python -m levilab`: Ctrl-C ends them in one line from their first import on."""

import atexit
import sys

from levilab.cli.exit_codes import INTERRUPTED
from levilab.cli.importing import LINE, importing
from levilab.interruption import end_process_at_interruption, ignore_all_signals, let_the_status_count


def main() -> None:
    """Import the application and carry out the command line."""
    atexit.register(ignore_all_signals)  # runs last: while Python itself ends, 0.2 s, a signal would give the status
    try:
        with importing():
            from levilab.cli.main import main as carry_out  # with typer: a tenth of a second, in which Ctrl-C may come

        carry_out()
    except KeyboardInterrupt:
        sys.stderr.write(LINE)
        sys.exit(INTERRUPTED)
    finally:  # all messages are out; only threads are left to wait for
        end_process_at_interruption(INTERRUPTED)
        let_the_status_count()
