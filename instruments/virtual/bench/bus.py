"""Where the virtual instruments are plugged in: addresses, and the links that programs open to them."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from instruments.virtual.bench.session import Hold, Session

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from instruments.virtual.bench.faults import Fault
    from instruments.virtual.core.device import VirtualInstrument


@dataclass
class Bus:
    """The instruments of one virtual bench by resource name.

    lock: held while an instrument works; servers do so from several threads; faults: that are to happen;
    away: until when [s] instruments cannot be reached, by the id of the device; heard: called with each message that a
    client of a server sends.
    """

    instruments: Mapping[str, VirtualInstrument]
    lock: threading.RLock = field(default_factory=threading.RLock)
    faults: list[Fault] = field(default_factory=list)
    away: dict[int, float] = field(default_factory=dict)
    heard: Callable[[], None] = lambda: None
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
        return Session(device, stream=stream, lock=self.lock, hold=hold, faults=self.faults, away=self.away)
