"""How the virtual oscilloscopes acquire: armed, they look for a trigger, and take the record around it.

The record itself is in scope_record.py, the settings are in scope_setup.py.

What is simpler than in the instrument, and said here once: alternating coupling takes the mean of the second around the
arming away and does not droop; trigger coupling, noise rejection, holdoff, bandwidth limit and averaging are settings
without an effect on the samples; the trigger looks at a signal at 20 kHz, for its first hundred thousand looks faster
if the record is short, and then finds the crossing to a small part of a sample.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from instruments.virtual.core.parameters import choice
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.oscilloscope.record import COARSEST, Edge, Input, Record, open_input
from instruments.virtual.oscilloscope.setup import ScopeSetup

if TYPE_CHECKING:
    from collections.abc import Mapping

    from instruments.virtual.core.device import Clock
    from instruments.virtual.oscilloscope.record import Signal

#: Below the level by this part of a division the trigger is armed again.
_HYSTERESIS = 0.3
#: With sweep AUTO a record is taken without a trigger after this time [s] (assumed; no source at hand).
AUTO_AFTER = 0.05
#: How far a question may look ahead for a trigger; later than this is never [s].
LOOK_AHEAD = 60.0
#: How far back a running scope looks for the last record it may have taken [s].
LOOK_BACK = 600.0
#: Between two records of a running scope [s] (assumed).
_DEAD_TIME = 1e-3


class ScopeAcquisition(ScopeSetup):
    """Run, stop, single: what an oscilloscope of eight bits sees at its inputs.

    signals: the voltage at each input, by channel; an input without one is open, 0 V.
    """

    #: What a code cannot go beyond.
    lowest: ClassVar[int]
    highest: ClassVar[int] = 255
    #: How the words of the trigger slope are meant.
    SLOPES: ClassVar[dict[str, tuple[float, ...]]] = {
        "POS": (1.0,),
        "NEG": (-1.0,),
        "RFAL": (1.0, -1.0),
        "EITH": (1.0, -1.0),
        "ALT": (1.0, -1.0),
    }
    #: Whether the old record can be read until a single one is complete.
    keeps_old: ClassVar[bool] = False

    def __init__(
        self, clock: Clock, *, signals: Mapping[int, Signal], channels: int = 4, identity: str | None = None
    ) -> None:
        self.channels = range(1, channels + 1)
        self._signals = signals
        self.identity = identity or self.identity
        self._record: Record | None = None
        self._armed: float | None = None
        self._edge: Edge | None = None
        self._once = False
        self._forced = math.inf
        self._blocked = False
        self.triggered = False
        super().__init__(clock)
        self.run()

    def changed(self, name: str) -> None:
        """A setting has changed: what runs begins anew."""
        self.adjusted(name, 0.0)

    def adjusted(self, name: str, before: float) -> None:
        """A number has changed from what it was before."""
        if name.endswith("_probe") and before:
            self._follow_probe(name.removesuffix("_probe"), float(self.settings[name]) / before)
        if not name.startswith("wav") and self._armed is not None and not self._blocked:
            self._arm(once=self._once)

    def _follow_probe(self, channel: str, ratio: float) -> None:
        """With another probe the same volts at the input are other volts at its tip: scale and offset go with it."""
        for what in ("scale", "offset"):
            self.settings[f"{channel}_{what}"] = ratio * float(self.settings[f"{channel}_{what}"])
        if self.settings["trigger_source"] == channel.upper():
            self.settings["trigger_level"] = ratio * float(self.settings["trigger_level"])

    def channel_of(self, text: str) -> int:
        """The channel of ``CHAN1`` or ``CHANnel1``.  Raises ScpiError."""
        words = tuple(f"CHANnel{n}" for n in self.channels)
        return int(choice(text, words)[4:])

    # --- what a subclass says of its scaling ---

    def full_scale(self) -> tuple[float, int]:
        """Samples per second and points of the record that would be taken now."""
        raise NotImplementedError

    def screen(self) -> tuple[float, float]:
        """Where the screen begins [s from the trigger] and how long it is [s]."""
        raise NotImplementedError

    def scaling(self, channel: int) -> tuple[float, int]:
        """Volts per code and the code of 0 V, which may lie beyond the converter."""
        raise NotImplementedError

    def division(self, channel: int) -> float:
        """Volts per division."""
        return self.value(f"chan{channel}_scale")

    # --- acquiring ---

    @property
    def now(self) -> float:
        """When the message under way is worked on [s]."""
        now = self.clock.now()
        return max(self._ready, now) if math.isfinite(self._ready) else now

    def _input(self, channel: int, start: float) -> Input:
        signal = self._signals.get(channel, open_input)
        coupling = self.settings[f"chan{channel}_coupling"]
        if coupling == "GND":
            signal = open_input
        mean = 0.0
        if coupling == "AC":
            begin = max(0.0, start - 0.5)
            mean = float(np.mean(signal(begin, COARSEST, round(1 / COARSEST))))
        factor = self.value(f"chan{channel}_probe") * (-1.0 if self.settings[f"chan{channel}_invert"] else 1.0)
        volts_per_code, zero = self.scaling(channel)
        return Input(signal, factor, mean, volts_per_code, zero, self.lowest, self.highest)

    def run(self) -> None:
        """Begin to acquire, over and over."""
        self._arm(once=False)

    def single(self) -> None:
        """Begin to acquire one record."""
        old = self._record if self.keeps_old else None
        self._arm(once=True)
        self._record = old

    def _arm(self, *, once: bool) -> None:
        self._record, self._armed, self._once = None, self.now, once
        self._edge, self._forced = None, math.inf
        self._next = self._template(self.now)

    def _template(self, armed: float) -> Record:
        """What the next record will be, but for its trigger."""
        rate, points = self.full_scale()
        start, length = self.screen()
        # a record longer than the screen goes beyond it by as much on both sides
        origin = start - (points / rate - length) / 2
        inputs = {n: self._input(n, armed) for n in self.channels}
        return Record(
            trigger=armed,
            forced=False,
            rate=rate,
            points=points,
            origin=origin,
            screen=(start, length),
            inputs=inputs,
        )

    def _searching(self, start: float) -> Edge | None:
        """A look-out for the trigger from this time on, or None if the source is one that never comes."""
        source = str(self.settings["trigger_source"])
        if not source.startswith("CHAN"):
            return None
        channel = int(source[4:])
        step = max(min(COARSEST, self._next.points / self._next.rate / 1000), 1 / self._next.rate)
        return Edge(
            volts=self._next.inputs[channel].volts,
            level=self.value("trigger_level"),
            hysteresis=_HYSTERESIS * self.division(channel),
            slopes=self.SLOPES[str(self.settings["trigger_slope"])],
            step=step,
            fine=0.01 / self._next.rate,
            position=start,
        )

    @property
    def filled(self) -> float:
        """When the part of the record before the trigger is filled: no trigger is taken earlier [s]."""
        return (self._armed or 0.0) + max(0.0, -self._next.origin)

    def _first_record(self, until: float) -> Record | None:
        """The record for which the scope is armed, if its trigger comes before that time [s]."""
        if self._edge is None:
            self._edge = self._searching(self.filled)
        automatic = self.filled + AUTO_AFTER if self.settings["trigger_sweep"] == "AUTO" else math.inf
        automatic = min(automatic, self._forced)
        edge = self._edge.until(min(until, automatic)) if self._edge else None
        if edge is not None:
            return self._next.taken(edge, forced=False)
        return self._next.taken(automatic, forced=True) if automatic <= until else None

    def follow(self) -> None:
        """Let what has happened up to now have happened."""
        if self._armed is None or self._blocked:
            return
        if self._once:
            self._settle(self._first_record(self.now))
            return
        # a scope that runs shows a late record; which of them is the chance of its dead times
        armed, reach = self._armed, 2 * self._next.points / self._next.rate + 2 * AUTO_AFTER
        while True:
            recent = max(armed, self.now - min(reach, LOOK_BACK))
            if recent > armed:
                self._armed, self._edge = recent, None
            record = self._first_record(self.now)
            if self._settle(record):
                return
            if recent == armed or reach >= LOOK_BACK:
                if record is None:  # nothing up to now: the next look begins here
                    self._armed, self._edge = max(armed, self.now + min(0.0, self._next.origin)), None
                return
            self._armed, self._edge, reach = armed, None, 4 * reach

    def _settle(self, record: Record | None) -> bool:
        """Take this record over if it is complete by now."""
        if record is None or record.done > self.now:
            return False
        self._record = record
        self.triggered = True
        if self._once:
            self._armed = None
        else:
            self._armed, self._edge, self._forced = record.done + _DEAD_TIME, None, math.inf
        return True

    def stop(self) -> None:
        """Acquire no more; a scope that ran on its own keeps what it has just seen."""
        self.follow()
        if self._armed is not None and self._record is None and self.settings["trigger_sweep"] == "AUTO":
            length = self._next.points / self._next.rate
            trigger = max(self.now - length, 0.0) - self._next.origin
            self._record = self._next.taken(trigger, forced=True)
        self._armed = None

    def force(self) -> None:
        """Take the record for which the scope is armed without waiting for an edge."""
        if self.running():
            self._forced = max(self.now, self.filled)

    def digitize(self) -> None:
        """Acquire one record; what comes next has to wait for it, for ever if there is no trigger."""
        self.single()
        record = self._first_record(self.now + LOOK_AHEAD)
        if record is None:
            self._blocked = True
            self.busy_until(math.inf)
            return
        self.busy_until(record.done)
        self._settle(record)

    def abandon(self) -> None:
        """A device clear: what is under way is given up, an acquisition that blocks included."""
        super().abandon()
        if self._blocked:
            self._blocked, self._armed = False, None

    def trigger(self) -> None:
        """``*TRG``."""
        self.force()

    def record(self) -> Record:
        """The latest record; the answer waits for it if one is under way.  Raises ScpiError if there is none."""
        self.follow()
        if self._record is None and self._armed is not None and not self._once and not self._blocked:
            under_way = self._first_record(self.now + LOOK_AHEAD)
            if under_way is not None:
                self.busy_until(under_way.done)
                self._settle(under_way)
        if self._record is None:
            raise ScpiError(-230)
        return self._record

    def running(self) -> bool:
        """Whether the scope acquires or waits for a trigger."""
        self.follow()
        return self._armed is not None

    def reset(self) -> None:
        """The state after ``*RST``: it runs."""
        self._blocked = False
        super().reset()
        self.run()
