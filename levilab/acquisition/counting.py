"""Counting the light of a spinning top: what the counter sees now, and the readings of a free top until it falls."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Generic, TypeVar

from instruments.errors import InstrumentError
from levilab.acquisition.experiment import CounterSettings

if TYPE_CHECKING:
    from levilab.acquisition.session import Row, Session

S = TypeVar("S", bound=CounterSettings)

#: A free top does not speed up (5 % leave room for noise), nor lose more than half its spin in 100 s (air: 30 %).
_HIGHEST_SHARE, _HALVING_S = 1.05, 100.0
#: Two counts of one spin, seconds apart, agree this well (drag takes 0.3 %/s, noise is 0.1 %).
_SAME_SHARE = 0.03
#: A fallen top rattles: after so many times without a credible count it is taken for fallen.
_MOST_MISSED = 3


class Missed(StrEnum):
    """Why there is no reading."""

    DARK = "no light pulses"
    LOST = "the instrument did not answer as it should"
    UNSTEADY = "no two counts that agree with each other or with the last reading"


def prepare_counter(session: Session[S]) -> None:
    """Set the counter up for the light of a top."""
    settings = session.settings
    session.bench.counter.prepare(gate_s=settings.gate_s, trigger_level_v=settings.trigger_level_v)
    session.bench.record_settings("counter")


def spin_now(session: Session[S]) -> float | None:
    """What the counter counts, outside of readings [Hz]; one that fails is reached again, a few times."""
    while True:
        try:
            spin = session.bench.counter.frequency()
            session.check_settings("counter")
        except InstrumentError as error:
            session.reconnect("counter", error, lambda: prepare_counter(session))
        else:
            return spin


@dataclass
class FreeTop(Generic[S]):
    """The readings of a top that spins down freely.

    Attributes:
        session: the acquisition.
        last: the last reading, None before the first.
        missed: why there was no reading, each time since the last one.
    """

    session: Session[S]
    last: Row | None = None
    missed: list[Missed] = field(default_factory=list)

    def read(self) -> Row | None:
        """A reading, or None; a count that is missing or does not follow from the last reading is asked for once more.

        Two counts that agree are a reading, even if it does not follow: then the one before was the miscount.  A
        counter that fails, or whose settings another program changed, costs this reading and is set up anew.
        """
        session = self.session
        try:
            reading = self._read_or_ask_again()
        except InstrumentError as error:
            session.reconnect("counter", error, lambda: prepare_counter(session))
            reading = Missed.LOST
        if isinstance(reading, Missed):
            self.missed.append(reading)
            return None
        self.missed.clear()
        self.last = reading
        return reading

    def fall(self, asked: float) -> str:
        """What was seen of the fall, empty while the top is up.

        A dark counter, asked twice, means that the top fell; single odd counts do not.

        Args:
            asked: when the last reading was asked for [s].
        """
        last = self.last["time_s"] if self.last else 0.0
        if self.missed and self.missed[-1] is Missed.DARK:
            return f"no light pulses any more: the top fell between {last:.1f} s and {asked:.1f} s"
        seen = [why for why in self.missed if why is not Missed.LOST]
        if len(seen) >= _MOST_MISSED:
            return f"no steady pulses at {len(seen)} times in a row: the top fell after {last:.1f} s"
        return ""

    def _read_or_ask_again(self) -> Row | Missed:
        first = self._count()
        if first and self._follows(first):
            return first
        what = "no reading" if first is None else f"{first['spin_frequency_hz']:.4g} Hz does not follow"
        self.session.event("asked again", f"{what}, asking once more", **_spin_of(first))
        second = self._count()
        if second and (self._follows(second) or (first and _is_same_spin(first, second))):
            return second
        if second:
            text = f"{second['spin_frequency_hz']:.4g} Hz is not credible either"
            self.session.event("not taken", text, **_spin_of(second))
        return Missed.UNSTEADY if first or second else Missed.DARK

    def _count(self) -> Row | None:
        """What the counter counts; its time is the middle of the exchange, which is the gate's."""
        session = self.session
        before = session.now()
        spin = session.bench.counter.frequency()
        if spin is None:
            return None
        row = {"time_s": (before + session.now()) / 2, "spin_frequency_hz": spin}
        session.check_settings("counter")
        u = session.settings.reading_u_hz
        return row | ({"spin_frequency_u_hz": u} if u else {})

    def _follows(self, reading: Row) -> bool:
        """Whether a reading is the first, or plausible after the last one."""
        return self.last is None or is_plausible(self.last, reading)


def is_plausible(last: Row, reading: Row) -> bool:
    """Whether a free top can have the spin of a reading after the last one."""
    share = reading["spin_frequency_hz"] / last["spin_frequency_hz"]
    gap = reading["time_s"] - last["time_s"]
    lowest: float = 0.5 ** (1 + gap / _HALVING_S)
    return lowest < share < _HIGHEST_SHARE


def _is_same_spin(first: Row, second: Row) -> bool:
    """Whether two counts in succession are of one spin."""
    return abs(second["spin_frequency_hz"] / first["spin_frequency_hz"] - 1) < _SAME_SHARE


def _spin_of(row: Row | None) -> Row:
    return {"spin_frequency_hz": row["spin_frequency_hz"]} if row else {}
