"""Where the virtual instruments are plugged in: addresses, and sessions that programs open on them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from instruments.virtual.device import VirtualInstrument


@dataclass
class Bus:
    """The instruments of one virtual bench by resource name."""

    instruments: Mapping[str, VirtualInstrument]

    def open(self, address: str) -> Session | None:
        """A session with the instrument at this address (any case), or None if there is none."""
        wanted = address.upper()
        found = (device for name, device in self.instruments.items() if name.upper() == wanted)
        device = next(found, None)
        return Session(device) if device else None


@dataclass
class Session:
    """One program's link to one instrument, as a message-based interface: a write is a whole message."""

    device: VirtualInstrument
    _rest: bytes = field(default=b"")

    def write(self, data: bytes) -> None:
        """Send a message; END takes the place of a line feed if there is none (IEEE 488.2, 7.5)."""
        self.device.receive(data if data.endswith(b"\n") else data + b"\n")

    def read(self, count: int, timeout: float) -> tuple[bytes, bool] | None:
        """At most count bytes of the answer and whether that was its end; None after the timeout [s]."""
        if not self._rest:
            answer = self.device.read(timeout)
            if answer is None:
                return None
            self._rest = answer
        chunk, self._rest = self._rest[:count], self._rest[count:]
        return chunk, not self._rest

    def clear(self) -> None:
        """Device clear."""
        self._rest = b""
        self.device.clear()
