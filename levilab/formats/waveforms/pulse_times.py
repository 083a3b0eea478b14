"""Lists of pulse times: one number a line, with a title or without."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from levilab.formats.columns import TableError, shorten
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
#: A turn of a top that floats is so long [s], at 75 to 14 Hz.  Of its turns, of which few are missed, most differ from
#: the next by less than this share.
_TURNS_S, _NEXT, _MISSED = (1 / 75, 1 / 14), 0.1, 0.02
#: By this factor turns without a unit must grow to be taken for such.
_GROWTH = 1.02
#: Units in which micro-controllers print the time from pulse to pulse.
_UNITS = ("s", "ms", "us")
#: Lines that may stand above the first number.
_MOST_TITLES = 20


def read_column(head: Head, dialect: Dialect, rate: float | None, *, guess: bool = True) -> PulseTimes | Waveform:
    """Read a file with one number a line: times that increase, or with a rate samples.

    Args:
        head: the beginning of the file.
        dialect: of its lines.
        rate: samples per second [Hz], of samples.
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
    turns = _turns(numbers, [unit] if unit else _UNITS) if unit or _grow(numbers) else None
    if turns is not None:
        said = "{name:s}: its numbers are taken for times from pulse to pulse, of {slow:.4g} to {fast:.4g} Hz"
        warnings.append(of_file("turns", Text(said, path.name, 1 / turns.max(), 1 / turns.min()), "advice"))
        return PulseTimes(path, "list of times from pulse to pulse", np.cumsum(turns), tuple(warnings))
    times = numbers * (unit_factor(unit, "time") or 1.0 if unit else 1.0)
    late = np.flatnonzero(np.diff(times) <= 0)
    if late.size > max(0.01 * len(times), 3):
        raise NoRate(path, "holds one column of numbers that do not increase: of samples say the `rate` in Hz")
    if late.size:
        k = int(late[0])
        what = "pulse {n}, at {now:.9g} s, does not come after the one at {then:.9g} s: correct it"
        raise TableError(path, what, k + 2, times[k + 1], times[k])
    _must_be_of_turns(path, times, first + 1)
    return PulseTimes(path, "list of pulse times", times, tuple(warnings))


def _must_be_of_turns(path: Path, times: NDArray[np.float64], line: int) -> None:
    """Raise TableError for times too far apart for a top's pulses, NoRate for times too near."""
    apart = float(np.median(np.diff(times)))
    if apart > _LONGEST_TURN_S:
        what = "its pulses are {s:g} s apart, too far for turns: write the unit above the numbers, as t [us] or t [ms]"
        raise TableError(path, what, apart, line=line)
    if apart < _SHORTEST_S:
        what = (
            "as times of pulses its numbers are {apart:.3g} s apart, and no top turns so fast: of times from pulse to "
            "pulse write the sums (numpy.cumsum), of samples say the `rate` in Hz"
        )
        raise NoRate(path, what, apart)


def _turns(numbers: NDArray[np.float64], units: Sequence[str]) -> NDArray[np.float64] | None:
    """Return the times from pulse to pulse [s] in the first unit in which numbers are such times of a top, or None.

    They change little from one to the next, and are no times of pulses in any unit.
    """
    factors = [unit_factor(unit, "time") or 1.0 for unit in units]
    steps = np.diff(numbers)
    near = np.abs(steps) < _NEXT * numbers[1:]
    if near.mean() < 1 - _MISSED or any(_are_turns(steps * factor) for factor in factors):
        return None
    return next((turns for factor in factors if _are_turns(turns := numbers * factor)), None)


def _grow(numbers: NDArray[np.float64]) -> bool:
    """Return whether numbers grow as the turns of a top that slows down: samples of a light have a steady ground."""
    tenth = max(len(numbers) // 10, 1)
    return bool(np.median(numbers[-tenth:]) > _GROWTH * np.median(numbers[:tenth]))


def _are_turns(durations: NDArray[np.float64]) -> bool:
    shortest, longest = _TURNS_S
    return shortest < float(np.median(durations)) < longest


def _unit(path: Path, titles: list[str]) -> str:
    """Return the unit of the times, by the title, its last word, or a row of units; empty without one.

    Raises NoWaveform where the title of the column, or its unit, is that of another quantity than a time.
    """
    units = [""]
    for text in titles:
        title, last = read_title(text), plain_unit(text.split()[-1])
        unit = plain_unit(text) if is_unit(text) else title.unit or (last if unit_factor(last, "time") else "")
        is_time = bool(unit) and unit_factor(unit, "time") is not None
        if (is_unit(unit) and not is_time) or (title.column not in {None, "time_s"} and not title.inverse):
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
