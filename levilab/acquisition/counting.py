"""Counting the light of a spinning top: what the counter sees now, and the readings of a free top until it falls."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Generic, TypeVar

from instruments.errors import InstrumentError
from levilab.acquisition.experiment import CounterSettings
from levilab.acquisition.session import ExperimentFailed, Row, Session
from levilab.runs.events import RunEvent
from levilab.texts.text import Text

S = TypeVar("S", bound=CounterSettings)

#: A free top does not speed up (5 % leave room for noise) but loses a thousandth a second at least (air: 0.3 %/s), and
#: no more than half its spin in 100 s (air: 30 %).
_HIGHEST_SHARE, _LEAST_LOSS_PER_S, _HALVING_S = 1.05, 1e-3, 100.0
#: Two counts of one spin, seconds apart, agree this well (drag takes 0.3 %/s, noise is 0.1 %).
_SAME_SHARE = 0.03
#: Number of readings that a new one is compared with: the last one, and two in case that it was a miscount.
_KEPT = 3
#: A fallen top rattles: after this many times without a credible count it is taken for fallen; after as many in a
#: row that are too high, for another one.
_MOST_MISSED = 3
#: A count takes its gate, and the time in which an input settles; one that takes so much longer than those before, or
#: than the gate at first, came while the computer stood still, and its time is not known [s].  A top at 40 Hz loses
#: 0.05 Hz in the one, less than 2 u of a usual reading.
_STALLED_S, _SETTLED_S = 0.5, 3.0
#: No top gives more pulses in a gate: then something else is counted.
_MOST_PERIODS = 1e9


class Missed(StrEnum):
    """Why there is no reading."""

    DARK = "nothing to count"
    LOST = "the instrument did not answer as it should"
    UNSTEADY = "no two counts that agree with each other or with the last reading"
    MULTIPLE = "twice or three times what a coasting top can have"
    FASTER = "more than a coasting top can have"


#: Why there is no reading where the counter saw something that may be a fallen top.
NO_TOP = frozenset({Missed.DARK, Missed.UNSTEADY})


class AnotherTop(ExperimentFailed):
    """The counter sees a top that spins faster than the last reading allows: not the one that was coasting."""

    def __init__(self, last: Row, seen: Row) -> None:
        self.last, self.seen = last, seen
        super().__init__(
            Text(
                "the counter sees {now:.4g} Hz, {later:.0f} s after "
                "{before:.4g} Hz, and it stays so: a top that coasts gains no spin, so this "
                "one was set spinning meanwhile; begin a new run with it",
                now=seen["spin_frequency_hz"],
                later=seen["time_s"] - last["time_s"],
                before=last["spin_frequency_hz"],
            )
        )


def prepare_counter(session: Session[S], gate_s: float | None = None) -> None:
    """Set the counter up for the light of a top; a gate is as long as the settings say, or gate_s [s]."""
    settings = session.settings
    session.bench.counter.prepare(
        gate_s=settings.gate_s if gate_s is None else gate_s, trigger_level_v=settings.trigger_level_v
    )
    session.bench.record_settings("counter")


def prepare_counter_again(session: Session[S], gate_s: float | None = None) -> None:
    """Set the counter up in the middle of a run; one that fails is reached again."""
    try:
        prepare_counter(session, gate_s)
    except InstrumentError as error:
        session.reconnect("counter", error, lambda: prepare_counter(session, gate_s))


def spin_now(session: Session[S], gate_s: float | None = None) -> float | None:
    """Return a count outside of readings [Hz]; reach the counter again, a few times, where it fails.

    gate_s: as it was prepared.
    """

    def count() -> float | None:
        spin = session.bench.counter.frequency()
        session.check_settings("counter")
        return spin

    spin = session.insist("counter", count, lambda: prepare_counter(session, gate_s))
    session.saw("spin_frequency_hz", spin)
    return spin


@dataclass
class FreeTop(Generic[S]):
    """The readings of a top that spins down freely.

    Attributes:
        session: the acquisition.
        before: the readings so far, of which the last ones count.
        missed: why there was no reading, each time since the last one.
        missed_by: when the first of these without a top would have ended, which may begin late: it was down [s].
    """

    session: Session[S]
    before: list[Row] = field(default_factory=list)
    missed: list[Missed] = field(default_factory=list)
    missed_by: float = math.inf
    _warned: bool = False
    _in_doubt: bool = False
    _took: float = math.inf  # the last count [s]
    _least: float = math.inf  # the shortest [s]; a multimeter's begins a second after it was asked for
    _faster: Row = field(default_factory=dict)

    @property
    def last(self) -> Row | None:
        """The last reading, None before the first."""
        return self.before[-1] if self.before else None

    def read(self) -> Row | None:
        """Return a reading, or None; ask once more for a count that is missing or does not follow the last one.

        Two counts that agree are a reading, even if they do not follow, as long as a coasting top can have them: less
        than before, or as much as before a miscount.  More than it can have is no reading.  A counter that fails, or
        whose settings another program changed, costs this reading and is set up again.

        Raises:
            AnotherTop: one that is faster, three times in a row.
        """
        session, asked = self.session, self.session.now()
        try:
            reading = self._read_or_ask_again()
        except InstrumentError as error:
            session.reconnect("counter", error, lambda: prepare_counter(session))
            reading = Missed.LOST
        if isinstance(reading, Missed):
            self.missed.append(reading)
            again, now = min(self._took, session.settings.gate_s + _SETTLED_S), session.now()
            stood_still = max(0.0, now - asked - self._took - again)  # the computer, in the first of the two counts
            if reading in NO_TOP:  # a counter that was lost saw nothing of the top, which may have been up
                self.missed_by = min(self.missed_by, asked + self._least + stood_still, now)
            if self.missed[-_MOST_MISSED:] == [Missed.FASTER] * _MOST_MISSED:
                raise AnotherTop(self.before[-1], self._faster)
            return None
        self.missed.clear()
        self.missed_by = math.inf
        self.before = [*self.before[1 - _KEPT :], reading]
        return reading

    def fall(self) -> str:
        """Return a description of the fall, empty while the top is up.

        A dark counter, asked twice, means that the top fell; single odd counts do not.
        """
        last = self.last["time_s"] if self.last else 0.0
        if self.missed and self.missed[-1] is Missed.DARK:
            said = "no {signal} any more: the top fell between {last:.1f} s and {missed_by:.1f} s"
            return Text(said, signal=self.session.bench.counter.SIGNAL.name, last=last, missed_by=self.missed_by)
        seen = [why for why in self.missed if why in NO_TOP]
        if len(seen) >= _MOST_MISSED:
            said = "no steady pulses at {times} times in a row: the top fell after {last:.1f} s"
            return Text(said, times=len(seen), last=last)
        return ""

    def _read_or_ask_again(self) -> Row | Missed:
        first = self._count()
        if first and self._is_plausible(first):
            return first
        what = "no reading" if first is None else Text("{spin:.4g} Hz does not follow", spin=first["spin_frequency_hz"])
        self.session.event(RunEvent.ASKED_AGAIN, Text("{what}, asking once more", what=what), **_spin_of(first))
        second = self._count()
        if second and self._is_plausible(second):
            return second
        if first and second and abs(second["spin_frequency_hz"] / first["spin_frequency_hz"] - 1) < _SAME_SHARE:
            return self._judge_pair(second)
        if second:
            text = Text("{spin:.4g} Hz is not credible either", spin=second["spin_frequency_hz"])
            self.session.event(RunEvent.NOT_TAKEN, text, **_spin_of(second))
        return Missed.UNSTEADY if first or second else Missed.DARK

    def _judge_pair(self, reading: Row) -> Row | Missed:
        """Return the meaning of two counts that agree, but do not follow from the last reading."""
        last = self.before[-1]  # else they would follow
        if reading["spin_frequency_hz"] < last["spin_frequency_hz"]:
            return reading
        if any(_is_drop(row, last) and is_plausible(row, reading) for row in self.before[:-1]):
            text = Text("the reading before, {spin:.4g} Hz, was a miscount", spin=last["spin_frequency_hz"])
            self.session.event(RunEvent.MISCOUNTED, text, **_spin_of(last))
            return reading
        times = next((k for k in (2, 3) if _coasts(last, reading, k)), None)
        seen, before = reading["spin_frequency_hz"], last["spin_frequency_hz"]
        if times is None:
            self._faster = reading
            said = "{seen:.4g} Hz after {before:.4g} Hz: a top that coasts gains no spin; no reading"
            self.session.event(RunEvent.NOT_TAKEN, Text(said, seen=seen, before=before), **_spin_of(reading))
            return Missed.FASTER
        if not self._warned:
            self._warned = True
            self.session.warn(
                "the counter sees {seen:.4g} Hz after {before:.4g} Hz, {times} times what follows: such "
                "counts are no readings; is there a second bright mark, or is the trigger level too low?",
                seen=seen,
                before=before,
                times=times,
            )
        return Missed.MULTIPLE

    def _count(self) -> Row | None:
        """Return one count; its time is the middle of the gate, or as the counter estimates it."""
        session = self.session
        spin = self._count_without_stall()
        session.saw("spin_frequency_hz", spin)
        if spin is None:
            return None
        time, found, u = middle_of_count(session, spin), session.bench.counter.last, session.settings.reading_u_hz
        if found is not None:
            u = found.u
            if found.gaps:
                gaps = ", ".join(f"{gap:.2g}" for gap in found.gaps)
                text = Text("the samples of this count have gaps of {gaps} s", gaps=gaps)
                session.event(RunEvent.GAPS, text, gaps_s=list(found.gaps))
            if found.folds and not self._in_doubt:
                self._in_doubt = True
                others = " or ".join(f"{fold:.1f} Hz" for fold in found.folds)
                session.warn(
                    "the spin of {spin:.2f} Hz may be {others}: samples at this rate cannot tell; a longer gate_s may",
                    spin=spin,
                    others=others,
                )
        session.check_settings("counter")
        return {"time_s": time, "spin_frequency_hz": spin} | ({"spin_frequency_u_hz": u} if u else {})

    def _count_without_stall(self) -> float | None:
        """Return a count [Hz]; repeat one during which the computer stood still, twice at most."""
        session, counter = self.session, self.session.bench.counter
        usual = min(self._took, session.settings.gate_s + _SETTLED_S)
        said = "a count took {took:.1f} s, {usual:.1f} s at most are usual: the computer stood still, counting again"
        for tries in range(3):
            asked = session.now()
            spin = counter.frequency()
            self._took = session.now() - asked
            self._least = self._least if spin is None else min(self._least, self._took)
            if spin is None or counter.last is not None or self._took < usual + _STALLED_S or tries == 2:
                break
            text = Text(said, took=self._took, usual=usual)
            session.event(RunEvent.LEFT_OUT, text, **_spin_of({"spin_frequency_hz": spin}))
        return spin

    def _is_plausible(self, reading: Row) -> bool:
        """Return whether a reading is the first, or plausible after the last one."""
        return self.last is None or is_plausible(self.last, reading)


def free_top(session: Session[S], before: Sequence[Row] = ()) -> FreeTop[S]:
    """Return a top that was let go; a counter that estimates takes no samples of the time under the drive.

    before: the readings so far.
    """
    if session.bench.counter.ESTIMATES:
        prepare_counter_again(session)
    return FreeTop(session, list(before))


def middle_of_count(session: Session[S], count: float) -> float:
    """Return the middle of the count that has just ended, or as the counter estimates it [s].

    count: [Hz].
    """
    if session.bench.counter.last is not None:
        return session.bench.counter.last.time - (session.zero or 0.0)
    end = session.now()
    return (gate_began(end, session.settings.gate_s, count) + end) / 2


def gate_began(end: float, gate_s: float, count: float) -> float:
    """Return the time at which a gate that has just ended began [s].

    It lasts whole periods, up to the first pulse behind its length; before it the counter waits for a pulse, and reads
    its errors, so the exchange begins some 40 ms earlier.

    Args:
        end: [s].
        gate_s: its length as it was set.
        count: the frequency that was counted [Hz].

    >>> round(gate_began(10.0, 0.99, 25.0), 6)
    9.0
    """
    return end - (math.ceil(count * gate_s - 1e-6) / count if 0 < count * gate_s < _MOST_PERIODS else gate_s)


def is_plausible(last: Row, reading: Row) -> bool:
    """Return whether a free top can have the spin of a reading after the last one."""
    share = reading["spin_frequency_hz"] / last["spin_frequency_hz"]
    gap = reading["time_s"] - last["time_s"]
    lowest: float = 0.5 ** (1 + gap / _HALVING_S)
    return lowest < share < _HIGHEST_SHARE * math.exp(-_LEAST_LOSS_PER_S * gap)


def _is_drop(before: Row, last: Row) -> bool:
    """Return whether the spin fell from one reading to a later one by more than a coasting top's does."""
    gap = last["time_s"] - before["time_s"]
    lowest: float = 0.5 ** (gap / _HALVING_S) / _HIGHEST_SHARE
    return last["spin_frequency_hz"] / before["spin_frequency_hz"] < lowest


def _coasts(last: Row, reading: Row, times: int) -> bool:
    """Return whether a reading is this multiple of the spin of a top that coasts since the last one."""
    one = reading | {"spin_frequency_hz": reading["spin_frequency_hz"] / times}
    return is_plausible(last, one) and not _is_drop(last, one)


def _spin_of(row: Row | None) -> Row:
    return {"spin_frequency_hz": row["spin_frequency_hz"]} if row else {}
