"""Lists of pulse times: one number a line, with a title or without."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.budget import printed_step
from levilab.formats.columns import SHORTHANDS, TableError, find_column, shorten
from levilab.formats.dialect import Dialect
from levilab.formats.titles import is_unit, plain_unit, read_title, unit_factor
from levilab.formats.waveforms.header import NoRate, NoWaveform
from levilab.formats.waveforms.rows import Block, Head, read_blocks
from levilab.formats.waveforms.waveform import FEWEST_PULSES, PulseTimes, Signal, Waveform, check_count, check_step
from levilab.texts.note import of_file
from levilab.texts.text import Text

#: Slower turns are no turns [s]: times in µs or ms without a unit, of which a window of seconds holds none.
_LONGEST_TURN_S = 10.0
#: No top has pulses so near [s], ten a turn at 100 Hz: they are differences of the times between pulses.
_SHORTEST_S = 1e-3
#: A turn of a top that floats lasts so long [s], at 75 to 14 Hz.
_TURNS_S = (1 / 75, 1 / 14)
#: Units in which micro-controllers print the time from pulse to pulse, and names of it beside those of a period.
_UNITS, _BETWEEN = ("s", "ms", "us"), re.compile(r"(d|δ|Δ|delta)[ _]?t\b|interval|pulse to pulse", re.IGNORECASE)
#: A counter of 32 bits, as micros(), goes on from 0 here: after 71.6 min.
_OVERFLOW = 2**32
#: What a title of times may say: nothing known, times, or Δt, the uncertainty of times in a table.
_TIMES = {None, "time_s", "time_u_s"}
OTHER_COLUMNS = "holds readings: its columns are named"
#: Lines that may stand above the first number.
_MOST_TITLES = 20


def read_column(
    head: Head, dialect: Dialect, rate: float | None, *, columns: Mapping[str, str] | None = None, guess: bool = True
) -> PulseTimes | Waveform:
    """Read a file with one number a line: times that increase, or with a rate samples.

    Args:
        head: the beginning of the file.
        dialect: of its lines.
        rate: samples per second [Hz], of samples.
        columns: `t` or `f` for times, or times from pulse to pulse, may state their unit: 1 [us].
        guess: whether a column without a title of times is taken for times.

    Raises:
        NoWaveform: it holds something else.
        TableError: a line is damaged.
    """
    path = head.path
    fields = [dialect.split(line) if not dialect.skips(line) else [] for line in head.lines]
    rows = (k for k, row in enumerate(fields) if row and dialect.kind(row[0]) == "number")
    first = next(rows, None)
    titles = [" ".join(row) for row in fields[:first] if row]
    if first is None or len(titles) > _MOST_TITLES or any(any(row[1:]) for row in fields[first : first + 100]):
        raise NoWaveform(path, "holds no samples and no pulse times")
    titles = _stated(path, titles, columns or {})
    blocks = partial(read_blocks, head, dialect, first + 1, [0])
    if rate is not None:
        return _samples(head, rate, blocks)
    if not guess and not any(read_title(text).column == "time_s" or "pulse" in text.casefold() for text in titles):
        raise NoWaveform(path, "holds one column of numbers, which nothing calls times")
    unit = _unit(path, titles)
    found = list(blocks())
    warnings = [Text("{name:s}, {text}", path.name, block.torn) for block in found if block.torn]
    numbers = np.concatenate([block.numbers[:, 0] for block in found])
    if len(numbers) < FEWEST_PULSES:
        what = "holds {n} numbers, at least {fewest} pulse times are needed"
        raise NoWaveform(path, what, len(numbers), FEWEST_PULSES)
    unit_of_intervals = _unit_of_intervals(path, numbers, unit, titles)
    if unit_of_intervals is not None:
        return _added(path, numbers, unit_of_intervals, first + 1, warnings)
    times = _without_overflow(numbers) * (unit_factor(unit, "time") or 1.0 if unit else 1.0)
    late = np.flatnonzero(np.diff(times) <= 0)
    if late.size > max(0.01 * len(times), 3):
        raise NoRate(path, "holds one column of numbers that do not increase: of samples say the `rate` in Hz")
    if late.size:
        k = int(late[0])
        what = "pulse {n}, at {now:.9g} s, does not come after the one at {then:.9g} s: correct it"
        raise TableError(path, what, k + 2, times[k + 1], times[k])
    _must_be_of_turns(path, times, first + 1)
    return PulseTimes(path, "list of pulse times", times, tuple(warnings))


def _stated(path: Path, titles: list[str], columns: Mapping[str, str]) -> list[str]:
    """Return the titles, or in their place one that says what is stated of the column.  Raises TableError."""
    for key, column in columns.items():
        name, (_, unit) = SHORTHANDS.get(key, key), find_column(path, titles[-1:] or ["1"], key, column)
        if name == "spin_frequency_hz" and unit_factor(unit, "time"):
            titles = [f"dt [{unit}]"]
        elif name != "time_s":
            raise NoWaveform(path, OTHER_COLUMNS)
        elif unit:
            titles = [f"t [{unit}]"]
    return titles


def _must_be_of_turns(path: Path, times: NDArray[np.float64], line: int) -> None:
    """Raise TableError for times too far apart for a top's pulses, NoRate for times too near."""
    apart = float(np.median(np.diff(times)))
    if apart > _LONGEST_TURN_S:
        what = "its pulses are {s:g} s apart, too far for turns: write the unit above the numbers, as t [us] or t [ms]"
        raise TableError(path, what, apart, line=line)
    if apart < _SHORTEST_S:
        what = (
            "as times of pulses its numbers are {apart:.3g} s apart, and no top turns so fast: for times from pulse to "
            'pulse say their unit, as `columns` = "f=1 [us]", of samples say the `rate` in Hz'
        )
        raise NoRate(path, what, apart)


def _are_turns(numbers: NDArray[np.float64], unit: str) -> bool:
    """Return whether numbers can be the times that turns of a top last, in a unit."""
    shortest, longest = _TURNS_S
    return shortest < float(np.median(numbers)) * (unit_factor(unit, "time") or 1.0) < longest


def _unit_of_intervals(path: Path, numbers: NDArray[np.float64], unit: str, titles: list[str]) -> float | None:
    """Return the unit [s] in which numbers are times from pulse to pulse; None where they are none, or none of a top.

    Raises NoRate for what may be such times, or samples or limits, as neither title nor unit says it.
    """
    units = [unit] if unit else _UNITS
    found = next((one for one in units if _are_turns(numbers, one)), None)
    if found is None or any(_are_turns(np.diff(numbers), one) for one in units):  # they are times of pulses
        return None
    if not unit and not any(_BETWEEN.match(text) or read_title(text).inverse for text in titles):
        what = (
            "holds one column of numbers without a unit: for times from pulse to pulse say "
            '`columns` = "f=1 [{unit:s}]", of samples say the `rate` in Hz, of spins add a column of their times'
        )
        raise NoRate(path, what, found)
    return unit_factor(found, "time") or 1.0


def _added(path: Path, numbers: NDArray[np.float64], unit: float, line: int, warnings: Sequence[str]) -> PulseTimes:
    """Return the times of pulses by the times between them in a unit [s], the first in a line.  Raises TableError."""
    turns, step = numbers * unit, (printed_step(numbers) or 0.0) * unit
    wrong = np.flatnonzero(turns <= 0)
    if wrong.size:
        k = int(wrong[0])
        what = "a time from pulse to pulse of {turn:.6g} s, above 0 is expected: correct it, or leave the line out"
        raise TableError(path, what, turns[k], line=line + k)
    said = "{name:s}: its numbers are times from pulse to pulse, of {slow:.4g} to {fast:.4g} Hz"
    note = of_file("turns", Text(said, path.name, 1 / turns.max(), 1 / turns.min()), "advice")
    return PulseTimes(path, "list of times from pulse to pulse", np.cumsum(turns), (*warnings, note), step)


def _without_overflow(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return whole numbers of a counter that went on from 0 as ones that go on; others as they are."""
    if not np.all((numbers % 1 == 0) & (numbers < _OVERFLOW)):
        return numbers
    return np.asarray(numbers + _OVERFLOW * np.cumsum(np.diff(numbers, prepend=numbers[0]) < -_OVERFLOW / 2))


def _unit(path: Path, titles: list[str]) -> str:
    """Return the unit of the times: of the title, of its last word, or of a row of units; empty without one.

    Raises NoWaveform where the title of the column, or its unit, is that of another quantity than a time.
    """
    units = [""]
    for text in titles:
        title, (name, _, last) = read_title(text), text.rpartition(" ")
        unit = plain_unit(text) if is_unit(text) else title.unit or ""
        if not unit and unit_factor(last, "time") and read_title(name.rpartition(" ")[2]).column == "time_s":
            unit = plain_unit(last)  # "Pulse time us"
        is_time = bool(unit) and unit_factor(unit, "time") is not None
        if (is_unit(unit) and not is_time) or (title.column not in _TIMES and not title.inverse):
            what = "holds one column, '{title:s}', which is no time: times of pulses are expected, as t [s]"
            raise NoWaveform(path, what, shorten(text))
        units += [unit] if is_time else []
    return units[-1]


def _samples(head: Head, rate: float, blocks: Callable[[], Iterator[Block]]) -> Waveform:
    path = head.path
    count, torn = 0, None
    for block in blocks():
        count += len(block.numbers)
        torn = torn or block.torn
    check_count(path, count)
    check_step(path, 1 / rate)

    def read(_: int) -> Iterator[NDArray[np.float64]]:
        return (block.numbers[:, 0] for block in blocks() if block.numbers.size)

    warnings = (Text("{name:s}, {text}", shorten(path.name), torn),) if torn else ()
    return Waveform(path, "one column of samples", 0.0, 1 / rate, count, (Signal("CH1"),), read, warnings)
