"""How the commands end: the only place that knows exit statuses."""

FAILED = 1
WRONG_USAGE = 2
INSTRUMENT = 3
INTERRUPTED = 130


def exit_status(error: Exception) -> int | None:
    """Return the exit status of a known failure, printed in one line; None for a defect of this program."""
    from analysis.errors import AnalysisError
    from instruments.errors import InstrumentError
    from levilab.errors import LevilabError, NoInstrument, RequestError

    # of several that fit the first one counts
    statuses: tuple[tuple[type[Exception], int], ...] = (
        (RequestError, WRONG_USAGE),
        (InstrumentError, INSTRUMENT),
        (NoInstrument, INSTRUMENT),
        (LevilabError, FAILED),
        (AnalysisError, FAILED),
        (OSError, FAILED),
    )
    return next((status for kind, status in statuses if isinstance(error, kind)), None)
