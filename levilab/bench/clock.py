"""The clock of a sound card, compared with a tone of known frequency or with the computer's clock, and kept."""

import math
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.arrays import Array
from analysis.uncertainty import Estimate
from instruments.clock import WallClock
from instruments.drivers.oscilloscope.sound import SoundCard
from levilab.bench.bench import open_bench
from levilab.bench.config import ConfigError, InstrumentSettings
from levilab.bench.kinds import OSCILLOSCOPE
from levilab.bench.wiring import Wiring
from levilab.errors import LevilabError
from levilab.files import parse_toml, replace_atomically, writing
from levilab.present.numbers import with_uncertainty

#: The phase of a tone is followed in such pieces [s], which a sound card's clock turns by less than half a turn.
_PIECE_S = 0.05
#: Least share of a record's power that a tone has to be one.
_LEAST_SHARE = 0.5
#: No sound card's clock is off by more.
_MOST_OFF = 1e-3
#: Arrivals are compared by the earliest in each of these parts of the time, of at least this number of blocks; fewer
#: parts would not show their scatter.
_PARTS, _FEWEST_PARTS, _BLOCKS_OF_PART = 24, 6, 4
#: Standard uncertainty of a computer's clock unless another is given: one that the network does not set is up to
#: 2·10⁻⁵ off, one that it sets some 10⁻⁶.
COMPUTER_U = 1e-5


class NoTone(LevilabError):
    """The record holds no tone near the one that was named."""


class TooFewBlocks(LevilabError):
    """The samples came in so few blocks that the scatter of their arrivals is not known.  seen: their number."""

    def __init__(self, seen: int, duration_s: float) -> None:
        self.seen = seen
        super().__init__(f"in {duration_s:g} s the samples came in {seen} blocks, too few: take a longer `duration`")


class ClockTooFarOff(LevilabError):
    """No sound card's clock is so far off: the reference is not what it was taken for, or samples were lost."""


@dataclass(frozen=True)
class ClockError:
    """The relative error of a clock, above 0 where it is fast.

    Attributes:
        value: of the error.
        u: its standard uncertainty.
        of_comparison: the part of u that the comparison has, without that of the reference.
        rate: nominal samples per second [1/s].
    """

    value: float
    u: float
    of_comparison: float
    rate: float

    @property
    def text(self) -> str:
        """The result as people read it, with its meaning for a spin of 30 Hz."""
        relative = with_uncertainty(Estimate(1e6 * abs(self.value), 1e6 * self.u, "1"))
        rate = with_uncertainty(Estimate(self.rate * (1 + self.value), self.rate * self.u, "Hz"))
        of_spin = with_uncertainty(Estimate(30e3 * abs(self.value), 30e3 * self.u, "1"))
        fast = "fast" if self.value > 0 else "slow"
        return (
            f"the clock is {relative} parts in a million {fast}: {rate} instead of {self.rate:g} Hz\n"
            f"the comparison has {1e6 * self.of_comparison:.2g} of that u, the reference the rest\n"
            f"a spin of 30 Hz reads {of_spin} mHz too {'low' if self.value > 0 else 'high'} where it is not corrected"
        )


@dataclass(frozen=True)
class Comparison:
    """How a clock is measured.

    Attributes:
        tone, tone_u: frequency of a known tone and its standard uncertainty [Hz]; None: by the computer's clock.
        duration_s: how long [s].
        computer_u: relative standard uncertainty of the computer's clock.
    """

    tone: float | None
    tone_u: float | None
    duration_s: float
    computer_u: float


def measure_clock(wiring: Wiring, how: Comparison, tell: Callable[[float], None]) -> ClockError:
    """Return the error of the clock of a bench's sound card.

    Raises ConfigError where the oscilloscope is no sound card; else as `by_tone` and `by_computer`.
    """
    with open_bench(wiring, (OSCILLOSCOPE.name,)) as bench:
        scope = bench.oscilloscope
        if not isinstance(scope, SoundCard):
            model = wiring.describe(OSCILLOSCOPE.name).model
            raise ConfigError(f"the oscilloscope {model} is no sound card: its manual states its clock's error")
        if how.tone is None:
            return by_computer(scope, how.duration_s, how.computer_u, tell)
        return by_tone(scope, Estimate(how.tone, how.tone_u, "Hz"), how.duration_s)


def tone_in(shares: Array, rate: float, near: float) -> tuple[float, float]:
    """Return the frequency of a tone by the nominal rate, and its standard uncertainty [Hz].

    The phase in pieces of 0.05 s is regressed on time.

    Args:
        shares: of full scale, shape (n,).
        rate: samples per second [1/s].
        near: the frequency, right to a thousandth [Hz].

    Raises:
        NoTone: most of the record is something else.

    >>> t = np.arange(96_000) / 48_000
    >>> round(tone_in(np.sin(2 * np.pi * 1000.05 * t), 48_000.0, 1000.0)[0], 4)
    1000.05
    """
    piece = round(_PIECE_S * rate)
    count = shares.size // piece
    if count < 4:
        raise NoTone(f"{shares.size / rate:.2g} s are too short for a tone: at least {4 * _PIECE_S:g} s are expected")
    times = np.arange(count * piece) / rate
    steady = shares[: count * piece] - np.mean(shares[: count * piece])
    turned = (steady * np.exp(-2j * np.pi * near * times)).reshape(count, piece).mean(axis=1)
    share = 2 * float(np.mean(np.abs(turned) ** 2)) / max(float(np.mean(steady**2)), 1e-30)
    if share < _LEAST_SHARE:
        raise NoTone(
            f"{100 * share:.2g} % of the record's power is at {near:g} Hz, at least {100 * _LEAST_SHARE:g} % are "
            "expected: is the tone on, loud enough, and of this frequency?"
        )
    phases = np.unwrap(np.angle(turned)) / (2 * np.pi)
    middles = np.asarray((np.arange(count) + 0.5) * piece / rate, dtype=np.float64)
    slope, u = _line(middles, np.asarray(phases, dtype=np.float64))
    return near + slope, u


def _line(x: Array, y: Array) -> tuple[float, float]:
    """Return the slope of a straight line and its standard uncertainty, from the residuals."""
    away = x - x.mean()
    spread = float(away @ away)
    slope = float(away @ y) / spread
    left = y - y.mean() - slope * away
    return slope, math.sqrt(float(left @ left) / max(x.size - 2, 1) / spread)


def by_tone(scope: SoundCard, tone: Estimate, duration_s: float) -> ClockError:
    """Return the error of a sound card's clock by a tone of known frequency [Hz].  Raises NoTone, ClockTooFarOff."""
    assert tone.value is not None
    scope.clock_error = 0.0
    scope.prepare(duration_s=duration_s, sweep="auto")
    scope.acquire(timeout_s=duration_s)
    seen, u = tone_in(scope.trace(1).volts, scope.rate, tone.value)
    # a fast clock counts more samples a second, and a tone seems lower by them
    return _error(tone.value / seen - 1, u / seen, (tone.u or 0.0) / tone.value, scope.rate)


def by_computer(scope: SoundCard, duration_s: float, reference_u: float, tell: Callable[[float], None]) -> ClockError:
    """Return the error of a sound card's clock by the computer's, from the arrival of samples over a while.

    Args:
        scope: the sound card.
        duration_s: the longer the better: arrivals scatter by about a millisecond [s].
        reference_u: relative standard uncertainty of the computer's clock.
        tell: called with the share of the time that is over.

    Raises:
        ClockTooFarOff: by more than a thousandth.
        SamplesLost: before the end.
        TooFewBlocks: in a time that is too short.
    """
    scope.clock_error = 0.0
    # the network sets the time of day; the clock that only goes on is corrected by it on some systems alone
    wall, own = time.time(), time.monotonic()
    counts, arrived = scope.arrivals(duration_s, tell)
    stretch = (time.time() - wall) / (time.monotonic() - own) if isinstance(scope.clock, WallClock) else 1.0
    if counts.size < _FEWEST_PARTS * _BLOCKS_OF_PART:
        raise TooFewBlocks(counts.size, duration_s)
    nominal = counts / scope.rate
    late = (arrived - arrived[0]) * stretch - nominal
    parts = np.array_split(np.arange(late.size), min(_PARTS, late.size // _BLOCKS_OF_PART))
    earliest = np.array([part[np.argmin(late[part])] for part in parts])
    slope, u = _line(np.asarray(nominal[earliest], dtype=np.float64), late[earliest])
    return _error(1 / (1 + slope) - 1, u, reference_u, scope.rate)


def _error(value: float, u: float, reference_u: float, rate: float) -> ClockError:
    if not abs(value) < _MOST_OFF:
        raise ClockTooFarOff(
            f"the clocks differ by {100 * value:.2g} %, at most {100 * _MOST_OFF:g} % are expected: is the frequency "
            "of the tone right, or were samples lost?"
        )
    return ClockError(value, math.hypot(u, reference_u), u, rate)


def keep_clock(path: Path, settings: InstrumentSettings, found: ClockError) -> None:
    """Write the error of the oscilloscope's clock into a bench file, whose other lines stay; or a new one.

    Raises CannotWrite, ConfigError where the file's table [oscilloscope] is of another instrument.
    """
    text = path.read_text(encoding="utf-8-sig") if path.exists() else ""
    described = parse_toml(text).get("oscilloscope")
    if described is not None and described.get("address") != settings.address:
        raise ConfigError(
            f"{path}: its oscilloscope is at {described.get('address')!r}, measured was the clock of "
            f"{settings.address}: add clock_error = {found.value:.3g} and clock_u = {found.u:.2g} where it belongs"
        )
    if described is None:
        table = f'[oscilloscope]\nmodel = "{settings.model}"\naddress = "{settings.address}"\n'
        text = f"{text.rstrip()}\n\n{table}".lstrip()
    head, *after = re.split(r"(?m)^(\s*\[\s*oscilloscope\s*\].*\n)", text, maxsplit=1)
    if not after:  # an inline table, or dotted keys
        raise ConfigError(
            f"{path}: has no line [oscilloscope]: add clock_error = {found.value:.4e} and clock_u = {found.u:.1e} to "
            "its oscilloscope by hand"
        )
    table, rest = after
    others = re.search(r"(?m)^\s*\[", rest)
    end = others.start() if others else len(rest)
    kept = re.sub(r"(?m)^\s*clock_(?:error|u)\s*=.*\n?", "", rest[:end])
    lines = f"clock_error = {found.value:.4e}  # by `levilab bench clock`\nclock_u = {found.u:.1e}\n"
    with writing(f"{path}: the clock cannot be kept"):
        replace_atomically(path, head + table + lines + kept + rest[end:])
