"""Where the virtual instruments are plugged in: addresses, and the links that programs open to them."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from instruments.virtual.bench.session import Session

if TYPE_CHECKING:
    from collections.abc import Mapping

    from instruments.virtual.bench.faults import Fault
    from instruments.virtual.core.device import VirtualInstrument


@dataclass
class Hold:
    """Who keeps the others from an instrument: one, or all that know the key.

    >>> hold = Hold()
    >>> hold.take("me", None), hold.take("you", None)
    (True, False)
    >>> hold.let_go("me")
    >>> hold.take("you", "key"), hold.take("me", "key")
    (True, True)
    """

    holders: list[object] = field(default_factory=list)
    key: str | None = None

    def take(self, who: object, key: str | None) -> bool:
        """Whether it is theirs now.  key: to share it with, None to share it with nobody."""
        others = [holder for holder in self.holders if holder is not who]
        if others and (key is None or key != self.key):
            return False
        self.holders, self.key = [*others, who], key
        return True

    def let_go(self, who: object) -> None:
        """Give it up; it is no error not to have it."""
        self.holders = [holder for holder in self.holders if holder is not who]

    def keeps_out(self, who: object) -> bool:
        """Whether somebody else has it."""
        return bool(self.holders) and all(holder is not who for holder in self.holders)


@dataclass
class Bus:
    """The instruments of one virtual bench by resource name.

    lock: whoever lets an instrument work holds it; servers do so from several threads; faults: that are to happen;
    away: until when [s] instruments cannot be reached, by the id of the device.
    """

    instruments: Mapping[str, VirtualInstrument]
    lock: threading.RLock = field(default_factory=threading.RLock)
    faults: list[Fault] = field(default_factory=list)
    away: dict[int, float] = field(default_factory=dict)
    _holds: dict[int, Hold] = field(default_factory=dict)

    def open(self, address: str) -> Session | None:
        """A session with the instrument at this address (any case), or None if there is none."""
        wanted = address.upper()
        found = (device for name, device in self.instruments.items() if name.upper() == wanted)
        device = next(found, None)
        if device is None or not self.reachable(device):
            return None
        return self.session(device, stream=wanted.startswith("ASRL") or wanted.endswith("::SOCKET"))

    def reachable(self, device: VirtualInstrument) -> bool:
        """Whether anybody can connect to it now."""
        return device.clock.now() >= self.away.get(id(device), 0.0)

    def session(self, device: VirtualInstrument, *, stream: bool) -> Session:
        """A link to one of the instruments."""
        hold = self._holds.setdefault(id(device), Hold())
        return Session(device, stream=stream, lock=self.lock, hold=hold, bus=self)
