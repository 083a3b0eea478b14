"""Times on the clock of the person who reads: local, with the offset from UTC."""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

from levilab.texts.text import Text

#: No run is longer [s]; the calendar ends at 3×10¹¹ s.
_LONGEST_S = 1e9


def local(utc: str | None) -> datetime | None:
    """Return a time of run.json on the local clock; None for what is no time."""
    try:
        return datetime.fromisoformat(utc).astimezone() if utc else None
    except (ValueError, OverflowError):
        return None


def in_utc(utc: str) -> str:
    """Return a time of run.json to the second; what is no time stands as it is."""
    found = local(utc)
    return f"{found.astimezone(UTC):%Y-%m-%d %H:%M:%S UTC}" if found else utc


def moment(when: datetime) -> str:
    """Return day and clock time with the offset.

    >>> moment(datetime.fromisoformat("2026-11-21T01:52:00+01:00"))
    '2026-11-21 01:52:00 +01:00'
    """
    return f"{when:%Y-%m-%d %H:%M:%S} {offset(when)}"


def offset(when: datetime) -> str:
    """Return the offset from UTC.

    >>> offset(datetime.fromisoformat("2026-11-21T01:52:00-03:30"))
    '-03:30'
    """
    text = f"{when:%z}"
    return f"{text[:3]}:{text[3:5]}"


def with_clock(
    zero: datetime | None, times_s: Sequence[float] | None, heads: Sequence[str]
) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return the heads of a table with the clock time as first column, and its cell of each row; neither if not known.

    The head has the offset from UTC at time zero; all rows use it.

    >>> with_clock(datetime.fromisoformat("2026-11-21T23:59:58+01:00"), [0.0, 1.4, 3.0], ["t [s]"])
    (['clock +01:00', 't [s]'], [('23:59:58',), ('23:59:59',), ('00:00:01',)])
    """
    count = 0 if times_s is None else len(times_s)
    if zero is None or times_s is None or any(abs(time) > _LONGEST_S for time in times_s):
        return [*heads], [()] * count
    cells: list[tuple[str, ...]] = [(f"{zero + timedelta(seconds=float(time)):%H:%M:%S}",) for time in times_s]
    return [Text("clock {offset:s}", offset=offset(zero)), *heads], cells
