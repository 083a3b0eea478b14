"""Tables of samples as waveforms: the step from the header, checked against the printed times."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from analysis.arrays import Array
from analysis.numbers import digits
from levilab.formats.columns import TableError, quote_names, shorten
from levilab.formats.dialect import Dialect
from levilab.formats.waveforms.header import LONGEST_DOUBTFUL_STEP_S, Header, NoRate, NoWaveform, printed, read_header
from levilab.formats.waveforms.rows import Block, Head, read_blocks
from levilab.formats.waveforms.waveform import (
    FEWEST_PULSES,
    PulseTimes,
    Signal,
    Waveform,
    about_rate,
    check_count,
    check_step,
)
from levilab.texts.note import of_file
from levilab.texts.text import Text

#: Scopes keep times in single precision before they print them: relative rounding, 2⁻²⁴ twice.
SINGLE = 1.2e-7
#: A header's step that agrees so far with the printed times is taken as it stands.
SAME = 1e-7
#: Units that times are printed in by mistake, against seconds.
_UNITS = (1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9)


@dataclass
class _Clock:
    """The column of times or numbers, as it passes by.

    first, last: its ends; shortest, longest: (difference of neighbours, line of the second); resolution: of the texts;
    count, means, sums: for a straight line through all of them (Chan, Golub & LeVeque, Am. Stat. 37, 242 (1983)).
    """

    first: float | None = None
    last: float = 0.0
    shortest: tuple[float, int] = (np.inf, 0)
    longest: tuple[float, int] = (-np.inf, 0)
    resolution: float = 0.0
    count: int = 0
    means: tuple[float, float] = (0.0, 0.0)
    sums: tuple[float, float] = (0.0, 0.0)

    @property
    def slope(self) -> float:
        """Of the straight line of least squares through values against their number."""
        return self.sums[1] / self.sums[0]

    def pass_by(self, header: Header, block: Block) -> None:
        """Take note of a block."""
        values = block.numbers[:, 0]
        if not values.size:
            return
        column = header.used[0]
        texts = [printed(text, header.dialect) for text in block.fields(column, header.dialect)]
        finest = min((one.resolution for one in texts if one), default=0.0)
        self.resolution = max(self.resolution, finest)
        before = values[:1] if self.first is None else np.array([self.last])
        differences = np.diff(np.concatenate((before, values)))[int(self.first is None) :]
        if differences.size:
            offset = int(self.first is None)
            for k, better in ((int(differences.argmin()), "shortest"), (int(differences.argmax()), "longest")):
                value, known = float(differences[k]), getattr(self, better)[0]
                if value < known if better == "shortest" else value > known:
                    setattr(self, better, (value, block.line_of(k + offset, header.dialect)))
        self.first = float(values[0]) if self.first is None else self.first
        self.last = float(values[-1])
        self._sum_up(values)

    def _sum_up(self, values: Array) -> None:
        """Add a block of values to the sums of the straight line."""
        n, m = self.count, len(values)
        numbers = n + np.arange(m, dtype=np.float64)
        means = float(numbers.mean()), float(values.mean())
        off = numbers - means[0]
        apart = means[0] - self.means[0], means[1] - self.means[1]
        share = n * m / (n + m)
        self.sums = (
            self.sums[0] + float(off @ off) + share * apart[0] ** 2,
            self.sums[1] + float(off @ (values - means[1])) + share * apart[0] * apart[1],
        )
        self.means = self.means[0] + apart[0] * m / (n + m), self.means[1] + apart[1] * m / (n + m)
        self.count = n + m


@dataclass(frozen=True)
class _Times:
    """Start, step and its standard uncertainty where rounded times give it [s], and what to know of them.

    times: of all samples [s], where they are uneven.
    """

    start: float
    step: float
    warnings: tuple[str, ...] = ()
    step_u: float = 0.0
    times: Array | None = None


@dataclass
class _Survey:
    """What one pass over the rows finds.  torn: of a last line that was cut off.

    off_range: number of samples beyond the range of their input; lowest, highest: of the others, of each column.
    """

    count: int = 0
    off_range: int = 0
    lowest: Array = field(default_factory=lambda: np.array(np.inf))
    highest: Array = field(default_factory=lambda: np.array(-np.inf))
    clock: _Clock = field(default_factory=_Clock)
    torn: str | None = None

    def clip(self, values: Array, column: int) -> Array:
        """Return samples of a column with those beyond the range at the ends of the others, at 0 without others."""
        if not self.off_range:
            return values
        low, high = self.lowest[column], self.highest[column]
        return values.clip(low, high) if low <= high else np.zeros_like(values)


def read_samples(
    head: Head, dialect: Dialect, *, columns: Mapping[str, str], rate: float | None
) -> Waveform | PulseTimes:
    """Read a table of samples.  The file is read once for its length and its times, and again for each channel.

    A logic analyser's table with a row for each change of a channel is read as the times of rising edges.

    Args:
        head: the beginning of the file.
        dialect: of its lines.
        columns: `t` names the column of times.
        rate: samples per second [Hz], in the place of what the file says.

    Raises:
        NoWaveform: it is no table of samples.
        TableError: it is damaged, or it contradicts itself.
    """
    path, header = head.path, read_header(head, dialect, columns, needs_times=rate is None)
    certain = header.certain or rate is not None
    try:
        survey = _look_over(head, header)
        times = _times(head, header, survey, rate)
        check_step(path, times.step)
        check_count(path, survey.count)
    except TableError as error:
        if certain:
            raise
        raise NoWaveform(path, error.message, line=error.line) from error

    def read(signal: int) -> Iterator[Array]:
        column, left = header.columns[signal], survey.count  # a last line may be torn in another column
        for block in read_blocks(head, header.dialect, header.first_line, [column.index]):
            values = survey.clip(block.numbers[:left, 0], header.used.index(column.index))
            left -= len(values)
            if values.size:
                yield values * column.factor if column.factor != 1 else values

    if times.times is not None and (edges := _rising_edges(path, header, times.times, read)):
        return edges
    if not certain and times.step > LONGEST_DOUBTFUL_STEP_S:
        text = "its rows are {s:g} s apart, which is no sampling of a top that spins: say `rate` if it is"
        raise NoWaveform(path, text, times.step)
    warnings = (*times.warnings, *_about_count(path, header, survey))
    signals = tuple(Signal(column.name, column.unit) for column in header.columns)
    return Waveform(
        path, header.format, times.start, times.step, survey.count, signals, read, warnings, times.step_u,
        times=times.times,
    )  # fmt: skip


def _rising_edges(
    path: Path, header: Header, times: Array, read: Callable[[int], Iterator[Array]]
) -> PulseTimes | None:
    """Return the rising edges of the first channel that has some; None unless each row is a change from 0 to 1 or back.

    read: from the index of a channel to its samples.
    """
    levels = np.zeros((len(header.columns), times.size), dtype=np.int8)
    for k, row in enumerate(levels):
        at = 0
        for block in read(k):
            if not np.isin(block, (0, 1)).all():
                return None
            row[at : at + block.size] = block
            at += block.size
    steps = np.diff(levels, axis=1)
    if not steps[:, :-1].any(axis=0).all():  # the last row of a table may be its end alone
        return None
    counts = np.count_nonzero(steps > 0, axis=1)
    chosen = int(np.argmax(counts >= FEWEST_PULSES))
    edges = times[1:][steps[chosen] > 0]
    if edges.size < FEWEST_PULSES:
        raise NoWaveform(path, "has {n} rising edges, at least {fewest} are needed", edges.size, FEWEST_PULSES)
    others = [column.name for k, column in enumerate(header.columns) if counts[k] and k != chosen]
    cut = "; {names:s} change, too: cut the other columns off for them"
    more = Text(cut, names=quote_names(others)) if others else ""
    said = "{name:s}: each row is a change: the rising edges of {column:s} are the pulses{more}"
    note = Text(said, name=path.name, column=header.columns[chosen].name, more=more)
    return PulseTimes(path, "changes of a logic signal", edges, (of_file("changes", note),))


def _about_count(path: Path, header: Header, survey: _Survey) -> Iterator[str]:
    """Yield warnings about the end of the file."""
    if survey.off_range:
        said = (
            "{name:s}: {n} samples lie beyond the range of the input (∞): they are taken at the ends of the others, as "
            "clipped: choose a larger range"
        )
        yield of_file("off range", Text(said, path.name, survey.off_range))
    if survey.torn:
        yield of_file("torn", Text("{name:s}, {text}", path.name, survey.torn))
    if header.count is not None and header.count != survey.count:
        said = "{name:s}: its header announces {said} samples, it holds {n}"
        yield of_file("count", Text(said, path.name, header.count, survey.count))


def _look_over(head: Head, header: Header) -> _Survey:
    survey = _Survey()
    if not header.columns:
        raise TableError(head.path, "its header names channels, but none has samples: export a channel that is on")
    timed = header.time is not None or header.sequence is not None
    for block in read_blocks(head, header.dialect, header.first_line, header.used):
        survey.count += len(block.numbers)
        survey.torn = survey.torn or block.torn
        off_range = np.isinf(block.numbers)
        survey.off_range += int(off_range.sum())
        survey.lowest = np.minimum(survey.lowest, block.numbers.min(axis=0, initial=np.inf, where=~off_range))
        survey.highest = np.maximum(survey.highest, block.numbers.max(axis=0, initial=-np.inf, where=~off_range))
        if timed and off_range[:, 0].any():
            line = block.line_of(int(off_range[:, 0].argmax()), header.dialect)
            raise TableError(head.path, "a time is ∞: correct it, or remove the line", line=line)
        if timed:
            survey.clock.pass_by(header, block)
    return survey


def _times(head: Head, header: Header, survey: _Survey, rate: float | None) -> _Times:
    """Start and step [s], and what to know of them."""
    path = head.path
    if header.time is not None:
        return _printed_times(head, header, survey, rate)
    if header.sequence is not None:
        _check_numbers(path, survey.clock)
    known = header.step.value if header.step else None
    if rate is None and known is None:
        raise NoRate(path, "does not say its sampling rate: say `rate` in Hz")
    step = 1 / rate if rate is not None else known or 0.0
    number = (survey.clock.first or 0.0) if header.sequence is not None else 0.0
    return _Times((header.start or 0.0) + number * step, step, tuple(about_rate(path, known, rate)))


def _check_numbers(path: Path, clock: _Clock) -> None:
    for difference, line in (clock.shortest, clock.longest):
        if np.isfinite(difference) and difference != 1:
            what = "the number of a sample is {n:g} more than that before, 1 is expected: export the record again"
            raise TableError(path, what, difference, line=line)


def _printed_times(head: Head, header: Header, survey: _Survey, rate: float | None) -> _Times:
    path, clock, n = head.path, survey.clock, survey.count
    if clock.first is None or n < 2:
        check_count(path, n)
    unit = header.time_factor
    first, last = (clock.first or 0.0) * unit, clock.last * unit
    mean = (last - first) / (n - 1)
    if rate is not None:
        return _Times(first, 1 / rate, tuple(about_rate(path, header.step.value if header.step else mean, rate)))
    if not mean > 0:
        spacing = Text(" = {rate:.6g}, if the rows follow one another", rate=-1 / mean) if mean else ""
        what = "its times do not increase, from {first:g} s to {last:g} s: sort the rows, or say `rate`{spacing}"
        raise TableError(path, what, first, last, spacing)
    largest = max(abs(first), abs(last))
    allowed = max(1.01 * clock.resolution * unit, min(SINGLE * largest, mean / 4)) + 1e-9 * mean
    if max(clock.longest[0] * unit - mean, mean - clock.shortest[0] * unit) > allowed:
        return _uneven_times(head, header, survey)
    if header.step is None:
        return _fit_step(path, clock, unit, first=first, mean=mean, allowed=allowed)
    step, u = header.step.value, 0.505 * header.step.resolution
    off = abs(mean - step)
    if off <= u + allowed / (n - 1):
        return _Times(first, step if off <= SAME * step or u <= allowed / (n - 1) else mean)
    return _times_by_header(path, header, first, mean)


#: Relative uncertainty of the step below which nothing is said of it: of a frequency it is 0.03 mHz at 30 Hz.
_FINE = 1e-6


def _fit_step(path: Path, clock: _Clock, unit: float, *, first: float, mean: float, allowed: float) -> _Times:
    """Return the step from the times alone: from the ends, or by a straight line where they lost digits."""
    if allowed / (clock.count - 1) < 1e-3 * _FINE * mean:
        return _Times(first, mean)
    step, resolution = clock.slope * unit, clock.resolution * unit
    alike = max(resolution / step, 1.0)  # neighbours that are rounded to the same time
    u = resolution * alike**0.5 / clock.count**1.5  # of n rounded times, each ± resolution/√12
    if u < _FINE * step or clock.longest[0] - clock.shortest[0] < 1e-6 * clock.resolution:  # all differences alike
        return _Times(first, step)
    lost = (
        "{name:s}: its printed times have lost digits (one unit of the last is {resolution:g} s, a step {step:.4g} s): "
        "the sampling rate, and so any frequency, is known to {part:n} of it"
    )
    known = Text(lost, name=path.name, resolution=resolution, step=step, part=digits(u / step, 1))
    return _Times(first, step, (of_file("digits", known),), u)


#: Most uneven times, which are held in memory.
MOST_UNEVEN = 50_000_000


def _uneven_times(head: Head, header: Header, survey: _Survey) -> _Times:
    """Return the times as they are printed, where the samples are not evenly spaced.

    Raises:
        TableError: they go back, or there are too many for memory.
    """
    path, unit, (shortest, line) = head.path, header.time_factor, survey.clock.shortest
    if shortest < 0:
        what = "its time goes back by {s:g} s: sort the rows, or say `rate`"
        raise TableError(path, what, -shortest * unit, line=line)
    if survey.count > MOST_UNEVEN:
        raise TableError(path, "holds {n} samples with uneven times: say `rate`, or cut the file", survey.count)
    blocks = read_blocks(head, header.dialect, header.first_line, header.used)
    times = np.concatenate([block.numbers[:, 0] for block in blocks])[: survey.count] * unit
    apart = np.diff(times)
    step, (longest, line) = float(np.median(apart)) or float(apart.mean()), survey.clock.longest
    said = (
        "{name:s}: its times are {shortest:.4g} to {longest:.4g} s apart (line {line}), mostly {step:.4g} s: they are "
        "used as printed"
    )
    text = Text(said, path.name, shortest * unit, longest * unit, line, step)
    return _Times(float(times[0]), step, (of_file("uneven", text),), times=times)


def _times_by_header(path: Path, header: Header, first: float, mean: float) -> _Times:
    """Return the times in the unit that makes header and printed times agree.  Raises TableError without one."""
    step = header.step.value if header.step else mean
    factor = next((unit for unit in _UNITS if abs(mean / step / unit - 1) < 1e-3), None)
    if factor is None:
        what = (
            "its header says a sampling interval of {step:.6g} s, its printed times {mean:.6g} s: say which holds, "
            "`rate` = {header:.6g} or {printed:.6g}"
        )
        raise TableError(path, what, step, mean, 1 / step, 1 / mean)
    said = (
        "{name:s}: its printed times are {mean:.6g} s apart where its header says {step:.6g} s: the times are taken to "
        "be in units of {unit:g} s"
    )
    return _Times(first / factor, step, (Text(said, shorten(path.name, 200), mean, step, 1 / factor),))
