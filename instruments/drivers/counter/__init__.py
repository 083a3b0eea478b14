"""Frequency counters: a frequency with a gate and a trigger level, whatever the model.

Facts and their sources stand with each driver, and in docs/instruments/counter.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol

from instruments.drivers import Instrument

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Signal:
    """What a counter counts.

    Attributes:
        name: of the signal, as people read it where there is none.
        advice: what may be wrong then, as a question.
        has_level: whether it is counted at a trigger level.
    """

    name: str
    advice: str
    has_level: bool = False


#: The phototransistor's signal.
LIGHT = Signal(
    "light pulses", "is the top floating and lit, and the trigger level between dark and bright", has_level=True
)


@dataclass(frozen=True)
class Count:
    """A count of an instrument that estimates the frequency from samples.

    Attributes:
        frequency: [Hz].
        u: its standard uncertainty, without that of the clock [Hz].
        time: the moment at which it holds, on the clock of the bench [s].
        gaps: lengths of the pauses in its samples [s].
        folds: other frequencies that it may be, as samples at this rate cannot tell [Hz].
    """

    frequency: float
    u: float | None
    time: float
    gaps: tuple[float, ...] = ()
    folds: tuple[float, ...] = ()


class Counter(Instrument, Protocol):
    """What every counter offers.

    SIGNAL: what it counts; ESTIMATES: whether it estimates from samples, so that each count has a u and a time; last:
    the last such count, None where there was none.
    """

    SIGNAL: ClassVar[Signal]
    ESTIMATES: ClassVar[bool]
    last: Count | None

    def prepare(self, *, gate_s: float, trigger_level_v: float, channel: int = 1) -> None:
        """Measure frequency over a gate [s], rising edges, at a fixed trigger level [V].

        channel: the input, 1 or 2 (A or B).  Raises OutOfRange for one that it does not have.
        """

    def frequency(self) -> float | None:
        """Return one reading [Hz]; None when no signal crossed the trigger level.  Takes the gate time and more."""

    def readings(self, count: int) -> NDArray[np.float64]:
        """Take this number of readings one after the other, shape (count,) [Hz], NaN where there was none.

        Raises OutOfRange if the memory of the counter does not hold that number.
        """
