"""The bench in a few lines of a terminal: last value, trend, instruments, time left.  A function of state and width."""

from __future__ import annotations

import math
import statistics
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from levilab.present.characters import printable
from levilab.present.numbers import with_decimals, with_sign
from levilab.texts.text import Text, in_language

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from levilab.telemetry.messages import State

#: Answers of an instrument that the trend is of, and the fewest that give a rate.
_KEPT, _FEWEST = 24, 3
#: Heights of a spark line, which spans at least this share of the value: noise stays flat.
_SPARKS = "▁▂▃▄▅▆▇█"
_LEAST_SPAN = 0.01
#: A value that has been the same for longer than this is shown with its age [s].
_FRESH_S = 5.0
#: What is measured, by channel: name, unit, decimals, and the factor to that unit; the first that is known has a trend.
_SHOWN = {
    "spin_frequency_hz": ("spin", "Hz", 3, 1.0),
    "flux_density_t": ("field", "mT", 4, 1e3),
    "precession_frequency_hz": ("precession", "Hz", 3, 1.0),
    "height_m": ("height", "cm", 2, 1e2),
}
#: Narrower than this a line has no room for words beside the bar [columns].
_NARROW = 60


class Piece(NamedTuple):
    """A text that is not broken.  style: plain, strong, on, off or alarm."""

    text: str
    style: str = "plain"


Line = tuple[Piece, ...]


@dataclass
class Trend:
    """The latest answers of one channel, and how they change.

    Attributes:
        channel: as in readings.csv.
        answers: times on the clock of the bench [s], and values.
        driven: whether the drive was on then: what a driven top does is no part of the trend of a free one.
        changed_s: when the latest answer came, on the clock of the bench [s]; one that equals the last one is not seen.
    """

    channel: str = ""
    answers: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=_KEPT))
    driven: bool = False
    changed_s: float = 0.0
    _latest: float | None = None

    def take(self, state: State) -> None:
        """Take in what the bench says; another channel, or none, or a drive that was switched begins again."""
        channel = next((name for name in _SHOWN if name in state.last), "")
        driven = state.drive is not None and state.drive.output
        latest = state.last.get(channel)
        if (channel, latest) != (self.channel, self._latest):
            self.changed_s, self._latest = state.time_s, latest
        if (channel, driven) != (self.channel, self.driven):
            self.channel, self.driven = channel, driven
            self.answers.clear()
        if channel and (not self.answers or self.answers[-1][1] != state.last[channel]):
            self.answers.append((state.time_s, state.last[channel]))

    @property
    def rate(self) -> float | None:
        """The slope of the straight line through the answers [unit/s]; None of fewer than three."""
        times, values = zip(*self.answers, strict=True) if len(self.answers) >= _FEWEST else ((), ())
        return statistics.linear_regression(times, values).slope if len(set(times)) > 1 else None

    @property
    def spark(self) -> str:
        """The answers as heights.

        >>> trend = Trend("spin_frequency_hz")
        >>> trend.answers.extend([(0.0, 25.0), (10.0, 24.5), (20.0, 24.0)])
        >>> trend.spark, trend.rate
        ('█▅▁', -0.05)
        >>> trend.answers.extend([(30.0, 24.01), (40.0, 24.0)])
        >>> trend.spark
        '█▅▁▁▁'
        """
        values = [value for _, value in self.answers]
        if len(values) < _FEWEST:
            return ""
        low, high = min(values), max(values)
        span = max(high - low, _LEAST_SPAN * max(abs(low), abs(high)))
        low, steps = (low + high - span) / 2, (len(_SPARKS) - 1) / span if span else 0.0
        return "".join(_SPARKS[math.floor((value - low) * steps + 0.5)] for value in values)


def bench_lines(state: State, trend: Trend, width: int, *, plain: bool) -> list[Line]:
    """Return what a terminal shows of a bench, each line at most as wide as the terminal.

    Args:
        state: of the bench.
        trend: of what it measures.
        width: of the terminal [columns].
        plain: without characters beyond ASCII, beside those that are spelled out.
    """
    measured = [*_flow([*_readings(state, trend, plain=plain)], width)]
    instruments = [*_flow([*_instruments(state)], width)]
    return [*measured, *instruments, _bar(state, width, plain=plain)]


def _readings(state: State, trend: Trend, *, plain: bool) -> Iterator[Piece]:
    shown = [(name, *_SHOWN[name]) for name in _SHOWN if name in state.last]
    if not shown:
        yield Piece("nothing counted yet" if state.share is not None else "no light, no value", "off")
    for name, word, unit, decimals, factor in shown:
        style = "strong" if name == trend.channel else "plain"
        value = with_decimals(state.last[name] * factor, decimals)
        yield Piece(Text("{quantity} {value:n} {unit}", quantity=word, value=value, unit=unit), style)
        if name == trend.channel and (age := state.time_s - trend.changed_s) > _FRESH_S:
            yield Piece(Text("{time} ago", time=clock(age)), "off")
        if name == trend.channel and trend.rate is not None:
            yield Piece(Text("{rate:n} {unit}/s", rate=_rate(trend.rate * factor), unit=unit))
            if not plain:
                yield Piece(trend.spark)
    if state.readings:
        called = "reading" if state.readings == 1 else "readings"
        yield Piece(Text("{count} {called}", count=state.readings, called=called))


def _instruments(state: State) -> Iterator[Piece]:
    yield from (Piece(Text("{instrument} LOST", instrument=kind), "alarm") for kind in state.lost)
    if state.drive is not None and "generator" not in state.lost:
        drive = state.drive
        if drive.output:
            yield Piece("drive ON", "on")
            yield Piece(Text("{frequency:.2f} Hz", frequency=drive.frequency_hz))
            amplitude, waveform = drive.amplitude_vpp, printable(drive.waveform)
            yield Piece(Text("{amplitude:g} Vpp {waveform}", amplitude=amplitude, waveform=waveform))
        else:
            yield Piece("drive off", "off")
    if state.counting is not None and "counter" not in state.lost:
        yield Piece(Text("gate {seconds:g} s", seconds=state.counting.gate_s), "off")
        yield Piece(Text("level {volts:g} V", volts=state.counting.trigger_level_v), "off")


def _bar(state: State, width: int, *, plain: bool) -> Line:
    """Return the share that is done, and the time left; while the bench is prepared, its present step."""
    share, said = _progress(state)
    room = min(40, max(8, width - len(said) - 2)) if width >= _NARROW else max(4, width - len(said) - 2)
    if len(said) + 6 > width:
        return (Piece(said[:width]),)
    done = round(room * min(max(share, 0.0), 1.0))
    full, empty = ("#", "-") if plain else ("━", "─")
    return Piece(full * done, "on"), Piece(empty * (room - done), "off"), Piece(f"  {said}")


def _progress(state: State) -> tuple[float, str]:
    if state.share is not None:
        return state.share, printable(in_language(state.text))
    elapsed, left = state.elapsed_s or 0.0, state.time_left_s
    if left is None:
        return 0.0, in_language(Text("{time} so far", time=clock(elapsed)))
    share = elapsed / (elapsed + left) if elapsed + left > 0 else 0.0
    least = left if state.least_left_s is None else state.least_left_s
    jumps = state.virtual and state.speed is None
    time_left = time_left_in_words(least, left, bench_time=jumps)
    return share, in_language(Text("{time} done, {left}", time=clock(elapsed), left=time_left))


def time_left_in_words(least: float, most: float, *, bench_time: bool = False) -> str:
    """Return the time that is left, in words.

    Args:
        least: it is no shorter [s].
        most: it is no longer [s].
        bench_time: whether it is the time of a bench that does not keep to the wall clock, which the words then say.

    >>> [time_left_in_words(*left) for left in ((95.0, 95.2), (42.0, 95.0), (75.0, 95.0), (0.0, 20.0))]
    ['about 1:35 min left', 'about 42 s to 1:35 min left', 'about 1:15 to 1:35 min left', 'at most 20 s left']
    >>> time_left_in_words(95.0, 95.2, bench_time=True)
    'about 1:35 min of bench time left'
    """
    first, last = clock(least), clock(most)
    if first == last:
        left = Text("about {time}", time=last)
    elif least < 0.5:
        left = Text("at most {time}", time=last)
    else:
        number, unit = first.split()
        left = Text("about {first} to {last}", first=number if last.endswith(f" {unit}") else first, last=last)
    return Text("{time} of bench time left" if bench_time else "{time} left", time=left)


def _flow(pieces: Sequence[Piece], width: int) -> Iterator[Line]:
    """Yield lines of pieces with two columns between them; one that is wider than the terminal is cut."""
    line: list[Piece] = []
    used = 0
    for english, style in pieces:
        text = in_language(english)
        size = min(len(text), width)
        if line and used + 2 + size > width:
            yield tuple(line)
            line, used = [], 0
        gap = "  " if line else ""
        line.append(Piece(gap + text[:width], style))
        used += len(gap) + size
    if line:
        yield tuple(line)


def _rate(value: float) -> str:
    """Return a rate with two digits and a sign.

    >>> [_rate(value) for value in (-0.0934, 0.051, 12.0, 0.0, -1e-9)]
    ['−0.093', '+0.051', '+12', '0', '0.000000']
    """
    if not value:
        return "0"
    decimals = min(max(1 - math.floor(math.log10(abs(value))), 0), 6)
    return with_sign(value, decimals)


def clock(seconds: float) -> str:
    """Return a duration.

    >>> [clock(seconds) for seconds in (7.2, 95.0, 4000.0)]
    ['7 s', '1:35 min', '1:06 h']
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    return f"{whole // 60}:{whole % 60:02d} min" if whole < 3600 else f"{whole // 3600}:{whole % 3600 // 60:02d} h"
