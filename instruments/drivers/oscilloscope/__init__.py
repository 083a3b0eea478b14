"""Oscilloscopes: a trace with time base, scaling and trigger, whatever the model.

What the drivers share is in scope.py and setup.py; facts and their sources stand with each driver, in
rigol_ds1000z.py and keysight_dsox.py.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from instruments.drivers import Instrument
from instruments.errors import InstrumentError

Codes = NDArray[np.uint8] | NDArray[np.uint16]


#: No scope of these families has a longer record; a preamble that says so was misheard.
_MOST_POINTS = 100_000_000


class NeverTriggered(InstrumentError):
    """No trigger came in time.  level_v: its level [V]; source: its channel; waited_s: for how long [s]."""

    def __init__(self, address: str, *, level_v: float, source: str, waited_s: float) -> None:
        self.level_v, self.source, self.waited_s = level_v, source, waited_s
        super().__init__(
            address,
            f"no trigger at {level_v:g} V on {source} within {waited_s:g} s: is the signal there, does it cross this "
            'level, is the probe factor 1 and the coupling DC?  Look at it with sweep="auto", which needs no trigger',
        )


class NothingAcquired(InstrumentError):
    """A trace was asked for, but none was taken since the scope was prepared: its record would be an old one."""

    def __init__(self, address: str) -> None:
        super().__init__(address, "nothing was acquired since the last preparation or failure: call acquire() first")


@dataclass(frozen=True, eq=False)
class Trace:
    """One channel's record.

    codes: of the converter, shape (n,), uint8 or uint16; dt_s: between samples [s]; t0_s: of the first one, counted
    from the trigger [s]; volts_per_code, offset_v: what a code means [V]; channel: which input;
    lowest, highest: the codes that the signal may be beyond; none: the code that means "no sample".
    """

    codes: Codes
    dt_s: float
    t0_s: float
    volts_per_code: float
    offset_v: float
    channel: int
    lowest: int = 0
    highest: int = 255
    none: int | None = None

    @property
    def volts(self) -> NDArray[np.float64]:
        """The voltage at each sample, NaN where there is no sample, shape (n,) [V]: eight bytes per sample."""
        volts = self.codes.astype(np.float64) * self.volts_per_code + self.offset_v
        if self.none is not None:
            volts[self.codes == self.none] = np.nan
        return volts

    @property
    def clipped(self) -> NDArray[np.bool_]:
        """Whether each sample is as low or as high as the converter goes, shape (n,): its voltage is a bound."""
        return np.isin(self.codes, (self.lowest, self.highest))


@dataclass(frozen=True)
class Preamble:
    """How to read a record.  points: how many; the rest as in :class:`Trace`."""

    points: int
    dt_s: float
    t0_s: float
    volts_per_code: float
    offset_v: float

    @property
    def plausible(self) -> bool:
        """Whether a scope can have such a record."""
        numbers = (self.dt_s, self.t0_s, self.volts_per_code, self.offset_v)
        return 1 <= self.points <= _MOST_POINTS and self.dt_s > 0 and all(map(math.isfinite, numbers))


class Oscilloscope(Instrument, Protocol):
    """What every oscilloscope offers.

    INPUT_COUPLINGS: that its inputs have, the usual one first; ended: when the last record was complete, on the clock
    of the bench [s].
    """

    INPUT_COUPLINGS: ClassVar[tuple[str, ...]]

    @property
    def ended(self) -> float:
        """When the last record was complete [s]."""

    def prepare(
        self,
        *,
        channels: Sequence[int] = (1,),
        duration_s: float,
        points: int,
        volts_per_division: float,
        offset_v: float = 0.0,
        coupling: str = "DC",
        trigger_level_v: float,
        trigger_slope: str = "rising",
        trigger_source: int = 1,
        sweep: str = "normal",
    ) -> None:
        """Set the scope up; the trigger is in the middle of the record.

        channels: which are recorded, all with the same scaling, input 1 MΩ, probe 1:1;
        duration_s: the record is at least as long [s]; points: their least number, if the converter is fast enough and
        the memory large enough; volts_per_division: of eight [V]; offset_v: voltage in the middle of the screen;
        coupling: DC or AC; trigger_level_v: [V]; trigger_slope: rising, falling or either; trigger_source: a channel;
        sweep: normal or single wait for the trigger, auto takes a record without one if it does not come.
        Raises OutOfRange before anything is sent that the scope does not have, and for a setting that it changes;
        CommandRefused; SettingsLost if it was reset meanwhile.
        """

    def acquire(self, *, timeout_s: float) -> None:
        """Take one record.  timeout_s: how long the trigger is waited for [s].

        Whatever error ends it, the scope is stopped.  Raises NeverTriggered; SettingsLost if no trigger came because
        the scope is no longer as it was prepared.
        """

    def trace(self, channel: int, arrived: Callable[[Trace, int], None] | None = None) -> Trace:
        """Return the record of one channel, whole: one byte per point.

        Args:
            channel: an input that was prepared.
            arrived: called after each piece with the record so far, and how many points it is to have; a transfer may
                take minutes, and what is kept meanwhile is not lost with the process.

        Raises:
            NothingAcquired: no record was taken.
            SettingsLost: the scope is no longer as it was prepared; what arrived is of no use.
        """

    def blocks(self, channel: int) -> Iterator[Codes]:
        """Return the codes of the same record, piece by piece as they come: never more than one piece in memory.

        Raises NothingAcquired; SettingsLost, before the first or behind the last piece.
        """

    def off(self) -> None:
        """Acquire no more."""
