"""How a virtual oscilloscope acquires: armed, it looks for a trigger, and takes the record around it.

What is simpler than in the instrument, and said here once: alternating coupling takes the mean of the second around the
arming away and does not droop; trigger coupling, noise rejection, holdoff, bandwidth limit and averaging are settings
without an effect on the samples; the trigger looks at a signal at 20 kHz, for its first hundred thousand looks faster
if the record is short, and then finds the crossing to a small part of a sample.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from instruments.virtual.oscilloscope.record import Edge, Record

#: With sweep AUTO a record is taken without a trigger after this time [s] (assumed; no source at hand).
AUTO_AFTER = 0.05
#: How far a question may look ahead for a trigger; later than this is never [s].
LOOK_AHEAD = 60.0
#: How far back a running scope looks for the last record it may have taken [s].
LOOK_BACK = 600.0
#: Between two records of a running scope [s] (assumed).
_DEAD_TIME = 1e-3


@dataclass(frozen=True)
class Plan:
    """What a scope acquires with the settings that it was armed with.

    record: the next one, all of it but its trigger; search: looks for the trigger from a time on [s], None for a
    source that never triggers; automatic: a record is taken without a trigger after AUTO_AFTER.
    """

    record: Record
    search: Callable[[float], Edge | None]
    automatic: bool

    @property
    def before(self) -> float:
        """How much of the record lies before its trigger [s]."""
        return max(0.0, -self.record.origin)

    @property
    def length(self) -> float:
        """From the first sample of the record to the last [s]."""
        return self.record.points / self.record.rate


class Acquisition:
    """Run, stop, single: whether the scope acquires, and the latest record.  It knows times, and no settings.

    plan: what is acquired when the scope is armed at a time [s]; keeps_old: whether the old record can be read until a
    single one is complete; switched_on: when the scope begins to acquire, over and over [s].  now: the time at which a
    message is worked on [s].

    latest: the latest record; armed: since when the scope acquires [s], None when it has stopped; once: for a single
    record; blocked: by a single record whose trigger never comes; was_armed, was_triggered: until the event is read.
    """

    def __init__(self, plan: Callable[[float], Plan], *, keeps_old: bool, switched_on: float) -> None:
        self._make_plan, self._keeps_old = plan, keeps_old
        self.latest: Record | None = None
        self.armed: float | None = switched_on
        self.once = self.blocked = False
        self.was_armed, self.was_triggered = True, False
        self._planned: Plan | None = None
        self._edge: Edge | None = None
        self._forced = math.inf

    @property
    def _plan(self) -> Plan:
        """What is acquired; of the first record, for which nothing was set yet, it is made when it is needed."""
        if self._planned is None:
            self._planned = self._make_plan(self.armed or 0.0)
        return self._planned

    # --- transitions ---

    def arm(self, now: float, *, once: bool) -> None:
        """Begin to acquire, over and over or once."""
        self._planned = self._make_plan(now)
        self.latest, self.armed, self.once = None, now, once
        self._edge, self._forced = None, math.inf
        self.was_armed = True

    def arm_again(self, now: float) -> None:
        """Begin again with settings that have changed."""
        if self.armed is not None and not self.blocked:
            self.arm(now, once=self.once)

    def single(self, now: float) -> None:
        """Begin to acquire one record."""
        old = self.latest if self._keeps_old else None
        self.arm(now, once=True)
        self.latest = old

    def stop(self, now: float) -> None:
        """Acquire no more; a scope that ran on its own keeps its last record."""
        self.follow(now)
        if self.armed is not None and self.latest is None and self._plan.automatic:
            trigger = max(now - self._plan.length, 0.0) - self._plan.record.origin
            self.latest = self._plan.record.trigger_at(trigger, forced=True)
        self.armed = None

    def force(self, now: float) -> None:
        """Take the record for which the scope is armed without waiting for an edge."""
        if self.running(now):
            self._forced = max(now, self.filled)

    def block(self) -> None:
        """Stay busy until a device clear: no trigger comes."""
        self.blocked = True

    def unblock(self) -> None:
        """End an acquisition that blocks."""
        if self.blocked:
            self.blocked, self.armed = False, None

    # --- what happens in time ---

    @property
    def filled(self) -> float:
        """When the part of the record before the trigger is filled: no trigger is taken earlier [s]."""
        return (self.armed or 0.0) + self._plan.before

    def first(self, until: float) -> Record | None:
        """Return the record for which the scope is armed, if its trigger comes before that time [s]."""
        if self._edge is None:
            self._edge = self._plan.search(self.filled)
        automatic = self.filled + AUTO_AFTER if self._plan.automatic else math.inf
        automatic = min(automatic, self._forced)
        edge = self._edge.until(min(until, automatic)) if self._edge else None
        if edge is not None:
            return self._plan.record.trigger_at(edge, forced=False)
        return self._plan.record.trigger_at(automatic, forced=True) if automatic <= until else None

    def follow(self, now: float) -> None:
        """Let what has happened up to now have happened."""
        if self.armed is None or self.blocked:
            return
        if self.once:
            self.settle(self.first(now), now)
            return
        # a scope that runs shows a late record; which of them is the chance of its dead times
        armed, reach = self.armed, 2 * self._plan.length + 2 * AUTO_AFTER
        while True:
            recent = max(armed, now - min(reach, LOOK_BACK))
            if recent > armed:
                self.armed, self._edge = recent, None
            record = self.first(now)
            if self.settle(record, now):
                return
            if recent == armed or reach >= LOOK_BACK:
                if record is None:  # nothing up to now: the next look begins here
                    self.armed, self._edge = max(armed, now + min(0.0, self._plan.record.origin)), None
                return
            self.armed, self._edge, reach = armed, None, 4 * reach

    def settle(self, record: Record | None, now: float) -> bool:
        """Take this record over if it is complete by now."""
        if record is None or record.done > now:
            return False
        self.latest = record
        self.was_triggered = True
        if self.once:
            self.armed = None
        else:
            self.armed, self._edge, self._forced = record.done + _DEAD_TIME, None, math.inf
        return True

    def running(self, now: float) -> bool:
        """Return whether the scope acquires or waits for a trigger."""
        self.follow(now)
        return self.armed is not None
