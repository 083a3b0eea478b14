"""The driver of a sound card: a microphone or line input as an oscilloscope, and what a record tells of the input.

Facts and their sources: docs/sound-card.md.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock, WallClock
from instruments.drivers import Value
from instruments.drivers.oscilloscope import Codes, NeverTriggered, NothingAcquired, Trace
from instruments.drivers.oscilloscope.setup import Setup
from instruments.errors import InstrumentError, NotConnected, OutOfRange, WrongInstrument
from instruments.links.sound import Block, Samples, SoundLink
from instruments.links.transport import Transport

Times = NDArray[np.float64]


#: Codes from 0 to full scale.
FULL_SCALE = 1 << 15
#: After the input begins to sample it settles: the capacitors of an input are charged within this time [s].
_SETTLES_S = 0.2
#: An input that gives nothing for this time is gone [s].
_GONE_S = 2.0
#: A step of the arrivals against the count of samples is a loss from this length on [s], and this part of the record by
#: which two clocks may drift apart.
_LEAST_STEP_S, _DRIFT = 5e-3, 2e-4
#: A step is where this part of it is seen.
_MOST_OF_A_STEP = 0.8
#: Arrivals on either side of a step, at least [s].
_AROUND_STEP_S = 0.25


class SamplesLost(InstrumentError):
    """The computer or the sound card lost samples of a record, or had some twice.

    Attributes:
        at_s: where, from the beginning of the record [s].
        kept: the longest part without a loss; None where none was kept.
    """

    def __init__(self, address: str, at_s: float, whole_s: float, kept: Trace | None = None) -> None:
        self.at_s, self.kept = at_s, kept
        what = "nothing was kept"
        if kept is not None:
            length = kept.codes.size * kept.dt_s
            what = f"{length:.3g} of its {whole_s:.3g} s are unbroken and were kept"
        super().__init__(
            address,
            f"samples were lost {at_s:.3g} s after the beginning of a record: {what}; end other programs, or take a "
            "lower rate (sound://?rate=44100)",
        )


class SilentInput(NeverTriggered):
    """Nothing but zeros has come since the input was opened."""

    def __init__(self, address: str, waited_s: float) -> None:
        super().__init__(address, level_v=0.0, source="the input", waited_s=waited_s)
        self.reason = (
            f"only zeros came in {waited_s:.3g} s: is the input muted?  macOS gives zeros until the "
            "terminal may use the microphone (System Settings, Privacy & Security, Microphone), Windows until desktop "
            "apps may (Settings, Privacy, Microphone)"
        )
        self.args = (f"{address}: {self.reason}",)


@dataclass(frozen=True, eq=False)
class _Record:
    """A record of all channels.

    Attributes:
        samples: the longest part without a loss, shape (n, channels).
        first: the number of its first sample, counted from the trigger.
        ended: when the last one came, on the clock of the bench [s]: later than it was taken by the input's latency.
        lost_at: numbers of the samples behind a loss, counted from the beginning of the whole record.
        whole: number of samples of that.
    """

    samples: Samples
    first: int
    ended: float
    lost_at: tuple[int, ...]
    whole: int


class SoundCard:
    """A sound card; see :class:`instruments.drivers.oscilloscope.Oscilloscope`.

    - Its volts are unknown: 1 V stands for full scale, whatever the input's gain makes of it.  So `volts_per_division`
      and `offset_v` change nothing: a record has the whole range.
    - It is AC coupled: DC is refused.
    - The trigger is looked for in the samples.
    - Lost samples are known from the flag of PortAudio, and from a step between the count of samples and the clock at
      which they came.  PortAudio's own time of a sample was seen to be wrong by half a second behind PulseAudio, and is
      not used.  A record with a loss is never joined over it: its longest part is handed out, then SamplesLost raised.

    clock_error: relative error of its clock, above 0 where it is fast, by which the times of samples are corrected;
    clock_u: the standard uncertainty of that; None where it was not measured.
    """

    MODELS: ClassVar[str] = "sound"
    SERIAL: ClassVar[Mapping[str, Value]] = {}
    INPUT_COUPLINGS: ClassVar[tuple[str, ...]] = ("AC",)

    transport: Transport
    last_set: dict[str, Value]

    def __init__(self, transport: Transport, *, clock: Clock | None = None) -> None:
        """Drive the sound card at this link, a SoundLink.  clock: of the bench; by default the wall's."""
        assert isinstance(transport, SoundLink)
        self.transport = self._link = transport
        self.clock: Clock = clock or WallClock()
        self.last_set = {}
        self.clock_error, self.clock_u = 0.0, None
        self._request: Setup | None = None
        self._record: _Record | None = None
        self._heard = False

    clock_error: float
    clock_u: float | None

    @property
    def channels(self) -> int:
        """Number of the input's channels."""
        return self._link.input.channels

    @property
    def rate(self) -> float:
        """Samples per second, corrected by the clock's error where that is known [1/s]."""
        return self._link.input.rate * (1 + self.clock_error)

    def identity(self) -> str:
        """Return interface, "sound", the input's name, and PortAudio's version.  Raises WrongInstrument."""
        answer = self.transport.query("*IDN?")
        if not re.fullmatch(self.MODELS, answer.split(",")[1]):
            raise WrongInstrument(self.transport.address, answer, "a sound card")
        return answer

    def settings(self) -> dict[str, Value]:
        """Return what can be told of the input, and what a volt stands for."""
        found: dict[str, Value] = {
            "rate_hz": self._link.input.rate,
            "channels": self.channels,
            "coupling": "AC",
            "volt": "full scale of the input, whose true voltage is not known",
        }
        if self.clock_u is not None:
            found |= {"clock_error": self.clock_error, "clock_u": self.clock_u}
        return found

    def changed_settings(
        self, now: Mapping[str, Value] | None = None, *, since: Mapping[str, Value] | None = None
    ) -> dict[str, tuple[object, object]]:
        """Return the settings that differ from earlier answers; see :class:`instruments.drivers.Instrument`."""
        now = self.settings() if now is None else now
        return {name: (then, now.get(name)) for name, then in (since or {}).items() if now.get(name) != then}

    def forget_errors(self) -> None:
        """Do nothing: a sound card has no error queue."""

    def off(self) -> None:
        """Acquire no more."""
        self._link.input.stop()

    def close(self) -> None:
        """Give the input back."""
        self.transport.close()

    # --- acquiring ---

    def prepare(
        self,
        *,
        channels: Sequence[int] = (1,),
        duration_s: float,
        points: int = 1,
        volts_per_division: float = 0.25,
        offset_v: float = 0.0,
        coupling: str = "AC",
        trigger_level_v: float = 0.0,
        trigger_slope: str = "rising",
        trigger_source: int = 1,
        sweep: str = "normal",
    ) -> None:
        """Say what a record is to be; see :class:`instruments.drivers.oscilloscope.Oscilloscope`.

        sweep: auto takes a record at once, without a trigger.  Raises OutOfRange.
        """
        self._record = None
        inputs = range(1, self.channels + 1)
        for name, value, allowed in (
            *(("channel", channel, inputs) for channel in (*channels, trigger_source)),
            ("coupling", coupling, self.INPUT_COUPLINGS),
            ("trigger_slope", trigger_slope, _SLOPES),
            ("sweep", sweep, ("normal", "single", "auto")),
        ):
            if value not in allowed:
                raise OutOfRange(self.transport.address, name, value, " or ".join(map(str, allowed)))
        if not -1 < trigger_level_v < 1:
            allowed_v = "between -1 and 1 V, which stand for full scale"
            raise OutOfRange(self.transport.address, "trigger_level_v", trigger_level_v, allowed_v)
        self._request = Setup(
            *(tuple(channels), duration_s, points, volts_per_division, offset_v, coupling),
            *(trigger_level_v, trigger_slope, trigger_source, sweep),
        )

    def acquire(self, *, timeout_s: float) -> None:
        """Take one record; see :class:`instruments.drivers.oscilloscope.Oscilloscope`.

        Raises NotConnected where the input gives no samples, SilentInput where it never gave any but zeros.
        """
        self._record = None
        if self._request is None:
            raise NothingAcquired(self.transport.address)
        self._link.input.start()
        try:
            self._record = self._collect(self._request, timeout_s)
        finally:
            self._link.input.stop()

    def _collect(self, request: Setup, timeout_s: float) -> _Record:
        """Read blocks until a record is complete."""
        rate = self._link.input.rate
        samples = math.ceil(request.duration_s * rate)
        before = samples // 2
        came = _Came()
        deadline = self.clock.now() + _SETTLES_S + samples / rate + timeout_s
        settled = searched = round(_SETTLES_S * rate)
        trigger = None
        while trigger is None or came.end < trigger + samples - before:
            block = self._next()
            if block[2] and trigger is None:  # the record begins behind it
                settled = searched = max(settled, came.end)
            came.add(block)
            if trigger is None and request.sweep == "auto":
                trigger = settled + before
            elif trigger is None:
                trigger = self._find_trigger(request, came, max(searched - 1, settled + before))
                searched = came.end
                came.keep(before + 1)
            if trigger is None and self.clock.now() > deadline:
                self._check_silence(came, timeout_s)
                level, source = request.trigger_level_v, f"channel {request.trigger_source}"
                raise NeverTriggered(self.transport.address, level_v=level, source=source, waited_s=timeout_s)
        self._check_silence(came, samples / rate)
        return came.record(trigger - before, samples, trigger, rate)

    def arrivals(self, duration_s: float, tell: Callable[[float], None]) -> tuple[NDArray[np.int64], Times]:
        """Listen for a while without keeping the samples.

        Args:
            duration_s: how long [s].
            tell: called with the share that is over.

        Returns:
            Number of samples after each block, and when the block came on the clock of the bench [s], shape (n,) each.

        Raises:
            SamplesLost: the flag of PortAudio says so.
            NotConnected: no samples come any more.
        """
        rate, count = self._link.input.rate, 0
        found: list[tuple[int, float]] = []
        self._link.input.start()
        try:
            while count < duration_s * rate:
                samples, arrived, lost = self._next()
                if lost and found:
                    raise SamplesLost(self.transport.address, count / rate, duration_s)
                count += len(samples)
                if count > _SETTLES_S * rate:
                    found.append((count, arrived))
                tell(min(count / rate / duration_s, 1.0))
        finally:
            self._link.input.stop()
        counts, times = np.array(found).reshape(-1, 2).T  # a float64 counts for 6000 years
        return counts.astype(np.int64), times

    def _next(self) -> Block:
        """Return the next samples.  Raises NotConnected."""
        block = self._link.input.read(_GONE_S)
        if block is None:
            raise NotConnected(
                self.transport.address,
                f"the input gives no samples for {_GONE_S:g} s: is it unplugged, or does another program hold it?",
            )
        return block

    def _find_trigger(self, request: Setup, came: _Came, first: int) -> int | None:
        """Return the number of the first sample behind a crossing of the level, from a number on."""
        above = came.samples(first, came.end)[:, request.trigger_source - 1] >= request.trigger_level_v * FULL_SCALE
        crossings = np.flatnonzero(_SLOPES[request.trigger_slope](above[1:].astype(np.int8) - above[:-1]))
        return first + int(crossings[0]) + 1 if crossings.size else None

    def _check_silence(self, came: _Came, waited_s: float) -> None:
        """Raise SilentInput where no sample but zeros has come since the input was opened."""
        self._heard = self._heard or bool(came.samples(came.start, came.end).any())
        if not self._heard:
            raise SilentInput(self.transport.address, waited_s)

    # --- reading ---

    def trace(self, channel: int, arrived: Callable[[Trace, int], None] | None = None) -> Trace:
        """Return the record of one channel; see :class:`instruments.drivers.oscilloscope.Oscilloscope`.

        Raises SamplesLost where the record has a loss, once `arrived` has its longest part.
        """
        record, request = self._record, self._request
        if record is None or request is None:
            raise NothingAcquired(self.transport.address)
        if channel not in request.channels:
            allowed = " or ".join(map(str, request.channels))
            raise OutOfRange(self.transport.address, "channel", channel, allowed)
        codes = (record.samples[:, channel - 1].astype(np.int32) + FULL_SCALE).astype(np.uint16)
        dt = 1 / self.rate
        trace = Trace(codes, dt, record.first * dt, 1 / FULL_SCALE, -1.0, channel, 0, 2 * FULL_SCALE - 1)
        if arrived:
            arrived(trace, record.whole)
        if record.lost_at:
            raise SamplesLost(self.transport.address, record.lost_at[0] * dt, record.whole * dt, trace)
        return trace

    def blocks(self, channel: int) -> Iterator[Codes]:
        """Yield the codes of one channel; see :class:`instruments.drivers.oscilloscope.Oscilloscope`."""
        yield self.trace(channel).codes

    @property
    def ended(self) -> float:
        """When the last sample of the record came; see :class:`instruments.drivers.oscilloscope.Oscilloscope`."""
        return math.nan if self._record is None else self._record.ended


#: Slope → which steps of "above the level" are crossings.
_SLOPES: Mapping[str, Callable[[NDArray[np.int8]], NDArray[np.bool_]]] = {
    "rising": lambda steps: steps > 0,
    "falling": lambda steps: steps < 0,
    "either": lambda steps: steps != 0,
}


class _Came:
    """The blocks that came, one after the other.

    start, end: numbers of the first sample that is kept, and of the one behind the last, from the first one that came.
    """

    def __init__(self) -> None:
        self._blocks: list[Block] = []
        self.start = self.end = 0

    def add(self, block: Block) -> None:
        """Append a block."""
        self._blocks.append(block)
        self.end += len(block[0])

    def keep(self, samples: int) -> None:
        """Drop blocks from before the last samples, but for a while in which their arrivals may tell of a loss."""
        while self.end - self.start - len(self._blocks[0][0]) > 2 * samples:
            self.start += len(self._blocks.pop(0)[0])

    def samples(self, first: int, stop: int) -> Samples:
        """Return the samples of these numbers, shape (n, channels)."""
        start = self.end
        parts: list[Samples] = []
        for samples, _, _ in reversed(self._blocks):  # a trigger is looked for in the last ones, for minutes perhaps
            start -= len(samples)
            parts.append(samples)
            if start <= first:
                break
        return np.concatenate(parts[::-1])[max(first - start, 0) : stop - start]

    def record(self, first: int, count: int, trigger: int, rate: float) -> _Record:
        """Return the longest part of a record that has no loss.

        Args:
            first: number of the record's first sample.
            count: of its samples.
            trigger: number of the sample at the trigger.
            rate: samples per second [1/s].
        """
        sizes = np.array([len(samples) for samples, _, _ in self._blocks])
        ends = self.start + np.cumsum(sizes)
        late = np.array([arrived for _, arrived, _ in self._blocks]) - ends / rate
        losses = np.array([lost for _, _, lost in self._blocks])
        if step := step_of_arrivals(late, ends, rate):
            losses[step] = True
        inside = [int(at) - first for at in (ends - sizes)[losses] if first < at < first + count]
        edges = [0, *inside, count]
        begin, stop = max(itertools.pairwise(edges), key=lambda part: part[1] - part[0])
        ended = float(late[ends > first + begin].min()) + (first + stop) / rate
        samples = self.samples(first + begin, first + stop)
        return _Record(samples, first + begin - trigger, ended, tuple(inside), count)


def step_of_arrivals(late: NDArray[np.float64], ends: NDArray[np.int64], rate: float) -> int | None:
    """Return the number of the block before which samples were lost or doubled; None where there is no such step.

    A block may arrive late, and the next ones then catch up; so the earliest arrival on one side is compared with the
    earliest on the other side.

    Args:
        late: arrival of each block less the time of its samples by their count, shape (n,) [s].
        ends: number of the sample behind each block, shape (n,).
        rate: samples per second [1/s].

    >>> late, ends = np.zeros(100), 480 * np.arange(1, 101)
    >>> step_of_arrivals(late, ends, 48_000.0) is None
    True
    >>> step_of_arrivals(late + 0.01 * (np.arange(100) >= 60), ends, 48_000.0)
    60
    """
    first, last = np.searchsorted(ends, [ends[0] + _AROUND_STEP_S * rate, ends[-1] - _AROUND_STEP_S * rate])
    if first >= last:
        return None
    before = np.minimum.accumulate(late)[:-1]
    after = np.minimum.accumulate(late[::-1])[::-1][1:]
    allowed = _LEAST_STEP_S + _DRIFT * float(ends[-1] - ends[0]) / rate
    # where samples were lost all sides further on differ, where some came twice all sides further back
    for steps, place in (((after - before)[first:last], 0), ((before - after)[first:last], -1)):
        if steps.max() > allowed:
            return int(first) + 1 + int(np.flatnonzero(steps > _MOST_OF_A_STEP * steps.max())[place])
    return None
