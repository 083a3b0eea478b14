"""The result of a magnetometer's record."""

import math
from dataclasses import dataclass
from typing import Literal

#: "folded": above half the sampling rate, as the times or the slope tell; "fold-doubt": `folds` cannot be
#: distinguished; "fold-by-slope": they are distinguished by the slope alone, of a spin that falls; "regular": the
#: samples lie more evenly than their times say; "weak": the line hardly stands out; "on-mains": it may be the mains.
Kind = Literal["folded", "fold-doubt", "fold-by-slope", "regular", "weak", "on-mains"]


@dataclass(frozen=True)
class Fold:
    """A frequency that has the same samples, but for the jitter of their times.

    Attributes:
        frequency: at the reference time [Hz].
        chirp: [Hz/s].
        likelihood: natural logarithm, relative to the greatest.
        probability: of this one among all, with the slope's sense.
    """

    frequency: float
    chirp: float
    likelihood: float
    probability: float


@dataclass(frozen=True)
class FieldSpin:
    """The spin frequency of a top at one time, and its slope.

    Attributes:
        frequency: at the reference time [Hz].
        u_frequency: its standard uncertainty [Hz].
        chirp: its slope there [Hz/s].
        u_chirp: its standard uncertainty [Hz/s].
        u_of_noise: standard uncertainties of both, were the law of the drag known [Hz], [Hz/s].
        reference_time: the mean of the times [s].
        amplitude: of the line in each axis, shape (k,) [T].
        u_amplitude: their standard uncertainties, shape (k,) [T].
        noise: standard deviation of a sample in each axis, shape (k,) [T].
        sense: +1: the field turns from the sensor's x to y; −1: from y to x; 0: the axes do not tell.
        bound: Cramér–Rao bound of the frequency in white noise [Hz].
        snr_db: 20 log₁₀ of amplitude over noise of a sample, in the axis where it is greatest.
        rate: samples per second.
        duration: of the record [s].
        samples: number of those used.
        folds: frequencies that could be it, the first is this one: the most probable, where none is certain that of
            the spins that tops have.
        kinds: of warnings.
    """

    frequency: float
    u_frequency: float
    chirp: float
    u_chirp: float
    u_of_noise: tuple[float, float]
    reference_time: float
    amplitude: tuple[float, ...]
    u_amplitude: tuple[float, ...]
    noise: tuple[float, ...]
    sense: int
    bound: float
    snr_db: float
    rate: float
    duration: float
    samples: int
    folds: tuple[Fold, ...]
    kinds: tuple[Kind, ...] = ()

    @property
    def turns(self) -> int:
        """Number of turns in the record."""
        return round(self.frequency * self.duration)

    @property
    def scatter(self) -> float:
        """Standard deviation of the time of one turn, as its own samples tell it [s]."""
        return self.bound * self.duration * math.sqrt(self.turns / 12) / self.frequency

    @property
    def doubtful(self) -> bool:
        """Whether another of the folds may be the spin."""
        return "fold-doubt" in self.kinds
