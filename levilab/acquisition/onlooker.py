"""What others see of an acquisition while it goes on: views in other processes, and the terminal.

The clock calls an onlooker while bench time passes, and the session whenever something changed.  Where no view listens
and the terminal needs nothing, a call compares two times and returns.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from instruments.drivers.oscilloscope import Trace
from levilab.acquisition.session import Session
from levilab.bench.bench import Bench
from levilab.bench.wiring import Wiring
from levilab.telemetry.messages import MOST_POINTS, POSES_PER_S, Counting, Drive, Poses, Record, State
from levilab.telemetry.publisher import Publisher

#: Interval at which a record is sent again [s].
_AGAIN_EVERY_S = 1.0
#: What a virtual bench's oscilloscope would show is drawn so often [s of the wall]: length [s], step [s].  A trigger
#: comes in the first 70 ms of it, of a top at 15 Hz.
_DRAWN_EVERY_S, _DRAWN_S, _DRAWN_STEP_S = 0.15, 0.24, 4e-4
#: Of a bench that jumps ahead only the last part of its motion is shown [s].
_SHOWN_S = 1.0


@dataclass
class Sent:
    """What was sent to the views.

    Attributes:
        records: channel → its last record that was sent, and when [s of the wall].
        pose: number of the next pose to be sent, counted from bench time 0.
        drawn: number of the last records that were drawn from signals, and when [s of the wall].
    """

    records: dict[str, tuple[Record, float]] = field(default_factory=dict)
    pose: int = 0
    drawn: tuple[int, float] = (0, -math.inf)

    def send_scope(
        self, publisher: Publisher, records: dict[str, tuple[int, float, Trace]], signals: Signals, now: float
    ) -> None:
        """Send the records that a run takes; where it takes none, what an oscilloscope would show up to now [s].

        To read an oscilloscope would keep the counter waiting; a virtual bench knows its signals anyway.
        """
        number, when = self.drawn
        if records:
            self.send_new_records(publisher, records)
        elif publisher.clock() - when >= _DRAWN_EVERY_S:
            self.drawn = number + 1, publisher.clock()
            n = round(_DRAWN_S / _DRAWN_STEP_S)
            for channel, signal in signals.items():
                volts = signal(now - _DRAWN_S, _DRAWN_STEP_S, n).astype(np.float32)
                publisher.send(Record(number + 1, channel, now, 0.0, _DRAWN_STEP_S, volts, volts, drawn=True))

    def send_new_records(self, publisher: Publisher, records: dict[str, tuple[int, float, Trace]]) -> None:
        """Send the records that are new, and each again every second, for views that came later."""
        now = publisher.clock()
        for channel, (number, time_s, trace) in records.items():
            record, when = self.records.get(channel, (None, -math.inf))
            if record is None or record.number != number:
                record, when = record_of(number, channel, time_s, trace), -math.inf
            if now - when >= _AGAIN_EVERY_S:
                self.records[channel] = record, now
                publisher.send(record)

    def send_poses(self, publisher: Publisher, poses: Callable[[float, float, int], Poses] | None, now: float) -> None:
        """Send the poses since the last ones, up to now [s]; at most those of _SHOWN_S."""
        if poses is None:
            return
        end = math.floor(now * POSES_PER_S) + 1
        begin = max(min(self.pose, end), end - round(_SHOWN_S * POSES_PER_S), 0)
        if end > begin:
            self.pose = end
            publisher.send(poses(begin / POSES_PER_S, 1 / POSES_PER_S, end - begin))


#: What an oscilloscope would show → first time [s], step [s], number → its voltages [V].
Signals = Mapping[str, Callable[[float, float, int], "NDArray[np.float64]"]]
#: What makes an onlooker of an acquisition at a bench, for the time of a context.
Watch = Callable[["Session[Any]", "Wiring"], AbstractContextManager[Callable[[], None]]]


@contextlib.contextmanager
def publishing(session: Session[Any], wiring: Wiring) -> Iterator[Onlooker]:
    """Yield an onlooker that publishes for views; its address stands in the run folder until the context ends."""
    with Publisher() as publisher:
        yield Onlooker(session, publisher, wiring.poses, wiring.signals)


@dataclass
class Onlooker:
    """Shows an acquisition to views and on the terminal.

    Attributes:
        session: the acquisition.
        publisher: to the views; it is announced in the run folder.
        poses: first time [s], step [s], number → where the top of a virtual bench is; None on a real one.
        signals: what an oscilloscope would show → the same → its voltages [V]; none on a real bench.
    """

    session: Session[Any]
    publisher: Publisher
    poses: Callable[[float, float, int], Poses] | None = None
    signals: Signals = field(default_factory=dict)
    _sent: Sent = field(default_factory=Sent)

    def __call__(self) -> None:
        """Show the state of the acquisition, if it is time."""
        self.publisher.announce(self.session.writer.folder)
        to_views, to_terminal = self.publisher.is_due(), self.session.show.is_due()
        if not (to_views or to_terminal):
            return
        state = state_of(self.session, virtual=self.poses is not None)
        if to_terminal:
            self.session.show.state(state)
        if to_views:
            self.publisher.send(state)
            self._sent.send_scope(self.publisher, self.session.doing.records, self.signals, state.time_s)
            self._sent.send_poses(self.publisher, self.poses, state.time_s)


def state_of(session: Session[Any], *, virtual: bool) -> State:
    """Return the present state of bench and acquisition; no instrument is asked."""
    bench, doing = session.bench, session.doing
    now = bench.clock.now()
    return State(
        time_s=now,
        elapsed_s=None if session.zero is None else session.now(),
        experiment=session.writer.record.experiment,
        folder=str(session.writer.folder),
        text=doing.text,
        share=doing.share,
        time_left_s=None if doing.end is None else max(0.0, doing.end[1] - now),
        least_left_s=None if doing.end is None else max(0.0, doing.end[0] - now),
        readings=len(session.rows),
        events=session.writer.events,
        last=dict(doing.seen),
        drive=drive_of(bench),
        counting=counting_of(bench),
        count=doing.count,
        lost=tuple(sorted(doing.lost)),
        virtual=virtual,
        speed=bench.clock.speed if virtual and math.isfinite(bench.clock.speed) else None,
    )


def drive_of(bench: Bench) -> Drive | None:
    """Return the generator as it was commanded; None where the bench has none."""
    if "generator" not in bench.instruments:
        return None
    commanded: dict[str, Any] = bench.generator.last_set
    names = {"waveform": "", "frequency_hz": 0.0, "amplitude_vpp": 0.0, "offset_v": 0.0, "output": False}
    known = {name: commanded.get(name, missing) for name, missing in names.items()}
    return Drive(**known, triggered=commanded.get("burst", False))


def counting_of(bench: Bench) -> Counting | None:
    """Return the counter as it was commanded; None where there is none, or it was not set up yet."""
    if "counter" not in bench.instruments:
        return None
    commanded: dict[str, Any] = bench.counter.last_set
    if "gate_s" not in commanded:
        return None
    return Counting(commanded["gate_s"], commanded.get("trigger_level_v", 0.0), getattr(bench.counter, "channel", 1))


def record_of(number: int, channel: str, time_s: float, trace: Trace) -> Record:
    """Return an oscilloscope's record by the lowest and the highest voltage of at most 1000 steps.

    Args:
        number: of the record.
        channel: the quantity that it shows.
        time_s: bench time when it was taken [s].
        trace: its samples.
    """
    codes = trace.codes
    each = max(1, -(-codes.size // (MOST_POINTS // 2)))
    starts = np.arange(0, codes.size, each)
    if trace.none is not None and np.any(codes == trace.none):  # fmin and fmax leave NaN out
        codes = np.where(codes == trace.none, np.float32(np.nan), codes.astype(np.float32))
    low = np.fmin.reduceat(codes, starts) if codes.size else codes
    high = np.fmax.reduceat(codes, starts) if codes.size else codes
    volts = [part * np.float32(trace.volts_per_code) + np.float32(trace.offset_v) for part in (low, high)]
    if trace.volts_per_code < 0:
        volts.reverse()
    return Record(number, channel, time_s, trace.t0_s, each * trace.dt_s, volts[0], volts[1])
