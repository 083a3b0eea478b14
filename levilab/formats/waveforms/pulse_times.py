"""Lists of pulse times: one number a line, with a title or without."""

from collections.abc import Callable, Iterator
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
from levilab.texts.text import Text

#: Slower turns are no turns [s]: times in µs or ms without a unit, of which a window of seconds holds none.
_LONGEST_TURN_S = 10.0
#: No top has pulses so near [s], ten a turn at 100 Hz: they are differences of the times between pulses.
_SHORTEST_S = 1e-3
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
    factor = _factor(path, titles)
    found = list(blocks())
    times = np.concatenate([block.numbers[:, 0] for block in found]) * factor
    late = np.flatnonzero(np.diff(times) <= 0)
    if late.size > max(0.01 * len(times), 3):
        raise NoRate(path, "holds one column of numbers that do not increase: of samples say the `rate` in Hz")
    if late.size:
        k = int(late[0])
        what = "pulse {n}, at {now:.9g} s, does not come after the one at {then:.9g} s: correct it"
        raise TableError(path, what, k + 2, times[k + 1], times[k])
    if len(times) < FEWEST_PULSES:
        what = "holds {n} numbers, at least {fewest} pulse times are needed"
        raise NoWaveform(path, what, len(times), FEWEST_PULSES)
    _must_be_of_turns(path, times, first + 1)
    warnings = [Text("{name:s}, {text}", path.name, block.torn) for block in found if block.torn]
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


def _factor(path: Path, titles: list[str]) -> float:
    """Return the unit of the times [s], by the title or a row of units; seconds without one.

    Raises NoWaveform where the title of the column, or its unit, is that of another quantity than a time.
    """
    factors = [1.0]
    for text in titles:
        title = read_title(text)
        unit = plain_unit(text) if is_unit(text) else title.unit or ""
        factor = unit_factor(unit, "time") if unit else None
        if (is_unit(unit) and factor is None) or title.column not in {None, "time_s"}:
            what = "holds one column, '{title:s}', which is no time: times of pulses are expected, as t [s]"
            raise NoWaveform(path, what, shorten(text))
        factors += [factor] if factor else []
    return factors[-1]


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
