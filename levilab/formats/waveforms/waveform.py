"""What a file with samples or with pulse times says, whichever program wrote it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from analysis.arrays import Array
from levilab.errors import UsageError
from levilab.formats.columns import TableError, quote_names, shorten
from levilab.texts.note import of_file
from levilab.texts.text import Text

#: Samples that a block holds at most, where the format leaves the choice.
BLOCK = 1 << 17
#: Samples below which there is nothing to analyze, and pulses below which there is no frequency.
FEWEST_SAMPLES, FEWEST_PULSES = 16, 4
#: No sampling interval of a laboratory lies outside [s]; beyond, the numbers are no measurement.
SHORTEST_STEP_S, LONGEST_STEP_S = 1e-15, 1e6
#: A given rate is off by less than this factor: a film in slow motion by 32, one in kHz by a thousand.
MOST_OFF = 100.0
#: Values beyond are no voltage of a laboratory: scopes write 9.9E37 where a sample is missing.
HIGHEST = 1e30


class NoSuchSignal(UsageError):
    """A channel that the record does not have."""


@dataclass(frozen=True)
class Signal:
    """A channel of a record.

    Attributes:
        unit: V, or what the file says it is.
    """

    name: str
    unit: str = "V"


@dataclass(frozen=True, eq=False)
class Held:
    """Samples in memory, read as those of a file.

    Attributes:
        samples: of each channel.
    """

    samples: tuple[Array, ...]

    def __call__(self, signal: int) -> Iterator[Array]:
        """Yield the samples of a channel, by its index."""
        yield self.samples[signal]


@dataclass(frozen=True, eq=False)
class Waveform:
    """Samples of one or more channels.

    Attributes:
        path: the file.
        format: name of the program or instrument that wrote it.
        start: time of the first sample [s].
        step: from one sample to the next [s], of uneven ones the median; step_u: its standard uncertainty [s], where it
            comes from rounded times.
        count: samples of each channel.
        signals: the channels.
        read: from the index of a channel to its samples in order, in blocks, each of shape (m,), in the channel's unit.
        warnings: what to know before using it.
        start_u: standard uncertainty of the start [s], where it comes from the clock of a run.
        times: of the samples, shape (count,), not decreasing [s], where they are uneven; None: start and step say them.
    """

    path: Path
    format: str
    start: float
    step: float
    count: int
    signals: tuple[Signal, ...]
    read: Callable[[int], Iterator[Array]]
    warnings: tuple[str, ...] = ()
    step_u: float = 0.0
    start_u: float = 0.0
    times: Array | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Return what a pickle holds: the samples themselves, since another process may not have the file."""
        samples = tuple(np.concatenate([*self.read(k)]) for k in range(len(self.signals)))
        return vars(self) | {"read": Held(samples)}

    @property
    def rate(self) -> float:
        """Samples per second [Hz]."""
        return 1 / self.step

    @property
    def duration(self) -> float:
        """From the first sample to the last [s]."""
        return (self.count - 1) * self.step if self.times is None else float(self.times[-1] - self.times[0])

    def times_of(self, first: int, last: int) -> Array:
        """Return the times of the samples from one number to before another, shape (last - first,) [s]."""
        if self.times is not None:
            return self.times[first:last]
        return self.start + np.arange(first, last, dtype=np.float64) * self.step

    def numbers_at(self, start: float, end: float) -> tuple[int, int]:
        """Return the numbers of the samples between two times [s]: of the first one, and of that behind the last."""
        if self.times is not None:
            first, last = np.searchsorted(self.times, (start, end)).tolist()
            return first, last
        first = max(int((start - self.start) * self.rate), 0)
        return first, min(first + int((end - start) * self.rate), self.count)

    def signal(self, wanted: str | None = None) -> int:
        """Return the index of a channel by its name, in any case, or its 1-based number.

        Without a name that of the first whose samples are not all equal, as of a stereo sound with one microphone.

        Raises:
            NoSuchSignal: there is none of that name.
        """
        if wanted is None:
            return self._first_heard
        names = [signal.name.casefold() for signal in self.signals]
        if wanted.strip().casefold() in names:
            return names.index(wanted.strip().casefold())
        if wanted.strip().isdecimal() and 1 <= int(wanted) <= len(names):
            return int(wanted) - 1
        has = quote_names(signal.name for signal in self.signals)
        what = "{path:s} has {names:s}: name one of them"
        raise NoSuchSignal("channel", what, shorten(str(self.path), 200), has, value=f"'{shorten(wanted)}'")

    @cached_property
    def _first_heard(self) -> int:
        """The index of the first channel whose samples are not all equal, else 0; a silent one is read whole, once."""
        several = range(len(self.signals)) if len(self.signals) > 1 else ()
        return next((k for k in several if any(block.size and np.ptp(block) for block in self.read(k))), 0)

    def blocks(self, wanted: str | None = None) -> Iterator[Array]:
        """Return the samples of a channel in order, in blocks that fit into memory."""
        return self.read(self.signal(wanted))

    def samples(self, wanted: str | None = None) -> Array:
        """Return all samples of a channel, shape (count,)."""
        found = list(self.blocks(wanted))
        return np.concatenate(found) if found else np.zeros(0)

    def at_rate(self, rate: float | None) -> Waveform:
        """Return the record at a given rate [Hz], with a warning where it differs from the file's."""
        if rate is None:
            return self
        if not 1 / MOST_OFF < rate * self.step < MOST_OFF:
            said = "holds {known:.6g} samples a second, {rate:.6g} are asked for: give `rate` in Hz, or leave it out"
            raise TableError(self.path, said, 1 / self.step, rate)
        warnings = (*self.warnings, *about_rate(self.path, self.step, rate))
        return replace(self, step=1 / rate, step_u=0.0, times=None, warnings=warnings)


@dataclass(frozen=True, eq=False)
class PulseTimes:
    """Times at which pulses came.

    Attributes:
        times: shape (n,), increasing [s].
        path, format, warnings: as of a waveform.
        interval_step: of printed intervals, which the times are sums of [s]; 0 where the times were printed.
    """

    path: Path
    format: str
    times: Array
    warnings: tuple[str, ...] = ()
    interval_step: float = 0.0


def about_rate(path: Path, known: float | None, rate: float | None) -> list[str]:
    """Yield a warning where a given rate is not the file's.

    Args:
        path: the file.
        known: its step [s], None where it says none.
        rate: that was given [Hz].
    """
    if rate is None or known is None or known <= 0 or abs(known * rate - 1) <= 1e-6:
        return []
    said = "{name:s}: the given rate of {rate:g} Hz takes the place of {known:.9g} Hz in the file"
    return [of_file("rate", Text(said, path.name, rate, 1 / known))]


def check_step(path: Path, step: float) -> None:
    """Raise TableError for a sampling interval [s] that is none."""
    if not SHORTEST_STEP_S <= step <= LONGEST_STEP_S:
        said = "the sampling interval is {step:g} s, above 0 is expected: say `rate` in Hz, or correct the file"
        raise TableError(path, said, step)


def check_count(path: Path, count: int) -> None:
    """Raise TableError for a record of too few samples."""
    if count < FEWEST_SAMPLES:
        said = "holds {n} samples, at least {fewest} are needed: record longer"
        raise TableError(path, said, count, FEWEST_SAMPLES)
