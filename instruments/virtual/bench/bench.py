"""The virtual bench: instruments by their addresses, and the sessions that programs open with them."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from instruments.virtual.bench.faults import Fault
from instruments.virtual.bench.session import ClientLock, Session
from instruments.virtual.core.device import VirtualInstrument


@dataclass
class VirtualBench:
    """The instruments of one virtual bench, and what their sessions share.

    Attributes:
        instruments: by resource name.
        lock: held while an instrument works, as several threads may use the bench.
        faults: that are to strike.
        unreachable_until: the time until which an instrument cannot be reached [s], by the id of the device.
        on_message: called whenever a client of a server sends something.
    """

    instruments: Mapping[str, VirtualInstrument]
    lock: threading.RLock = field(default_factory=threading.RLock)
    faults: list[Fault] = field(default_factory=list)
    unreachable_until: dict[int, float] = field(default_factory=dict)
    on_message: Callable[[], None] = lambda: None
    _client_locks: dict[int, ClientLock] = field(default_factory=dict)

    def open(self, address: str) -> Session | None:
        """Open a session with the instrument at this address, in any case; None where there is none to be reached."""
        wanted = address.upper()
        found = (device for name, device in self.instruments.items() if name.upper() == wanted)
        device = next(found, None)
        if device is None or not self.reachable(device):
            return None
        return self.session(device, stream=wanted.startswith("ASRL") or wanted.endswith("::SOCKET"))

    def reachable(self, device: VirtualInstrument) -> bool:
        """Return whether a program can connect to this instrument now."""
        return device.clock.now() >= self.unreachable_until.get(id(device), 0.0)

    def session(self, device: VirtualInstrument, *, stream: bool) -> Session:
        """Make a session with one of the instruments.  stream: see Session."""
        client_lock = self._client_locks.setdefault(id(device), ClientLock())
        return Session(
            device,
            stream=stream,
            lock=self.lock,
            client_lock=client_lock,
            faults=self.faults,
            unreachable_until=self.unreachable_until,
        )
