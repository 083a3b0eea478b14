"""How the commands end: the only place that knows exit statuses."""

from __future__ import annotations

from analysis.errors import AnalysisError
from instruments.errors import InstrumentError
from levilab.errors import LevilabError, NoInstrument, UsageError

FAILED = 1
WRONG_USAGE = 2
INSTRUMENT = 3
INTERRUPTED = 130

#: Known failures, told in one line, and their exit status; of several that fit the first one counts.
STATUS_OF: tuple[tuple[type[Exception], int], ...] = (
    (UsageError, WRONG_USAGE),
    (InstrumentError, INSTRUMENT),
    (NoInstrument, INSTRUMENT),
    (LevilabError, FAILED),
    (AnalysisError, FAILED),
    (OSError, FAILED),
)


def exit_status(error: Exception) -> int | None:
    """The exit status of a known failure; None for what is a defect of this program."""
    return next((status for kind, status in STATUS_OF if isinstance(error, kind)), None)
