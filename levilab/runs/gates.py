"""The gates of a counter at the points of a sweep, in the events of a run: a line a point."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.precession.gates import Gates
from levilab.runs.events import RunEvent

if TYPE_CHECKING:
    from collections.abc import Sequence

    from levilab.runs.run import Run

SERIES = ("spin", "laser")
_COLUMNS = ("begin_s", "end_s", "frequency_hz")
#: Counts of a series, at least.
_FEWEST = 3
#: The event is written before the reading; times are rounded where a run is kept as sample data [s].
_LATER_S = 1e-3


def gates_event(spin: Gates, laser: Gates) -> dict[str, dict[str, list[float | None]]]:
    """Return the gates of a point as they stand in an event, times to a microsecond."""
    return {
        name: {
            "begin_s": [round(time, 6) for time in gates.begin.tolist()],
            "end_s": [round(time, 6) for time in gates.end.tolist()],
            "frequency_hz": [None if math.isnan(count) else count for count in gates.frequency.tolist()],
        }
        for name, gates in zip(SERIES, (spin, laser), strict=True)
    }


def gates_of(run: Run, times: Sequence[float], drives: Sequence[float]) -> list[tuple[Gates, Gates]] | None:
    """Return the gates of spin and laser behind each reading of a run; None where a reading has none, or damaged ones.

    Args:
        run: a sweep.
        times: of its readings [s].
        drives: their drive frequencies [Hz].
    """
    events = [event for event in run.events() if event["kind"] == RunEvent.COUNTED]
    found = []
    before = -math.inf
    for time, drive in zip(times, drives, strict=True):
        of_point = [event for event in events if _belongs(event, before, time, drive)]
        spin, laser = (_gates(of_point[-1].get(name)) if of_point else None for name in SERIES)
        if spin is None or laser is None:
            return None
        found.append((spin, laser))
        before = time
    return found


def _belongs(event: dict[str, Any], after: float, until: float, drive: float) -> bool:
    time, frequency = event["time_s"], event.get("drive_frequency_hz")
    return (
        isinstance(time, int | float)
        and isinstance(frequency, int | float)
        and after < time <= until + _LATER_S
        and math.isclose(frequency, drive, rel_tol=1e-9)
    )


def _gates(entry: Any) -> Gates | None:
    """Return three columns of one length, three counts at least; None for anything else."""
    try:
        begin, end, frequency = (
            np.array([math.nan if value is None else value for value in entry[name]], dtype=np.float64)
            for name in _COLUMNS
        )
    except (KeyError, TypeError, ValueError):
        return None
    counted = np.isfinite(frequency)
    right = begin.shape == end.shape == frequency.shape and begin.ndim == 1 and counted.sum() >= _FEWEST
    right = right and bool((end > begin).all() and (np.diff(begin) > 0).all() and (frequency[counted] > 0).all())
    return Gates(begin, end, frequency) if right else None
