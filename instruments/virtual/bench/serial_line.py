"""A serial line between a program and a virtual instrument: bits, not bytes.

When both ends are set alike the bytes arrive as they were sent; when baud rate, data bits or parity differ, the
receiver samples the sender's bits at the wrong places, as a UART does, and hears garbage: the same each time.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from instruments.virtual.core.line import LineSettings, carried

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.bench.bus import Bus
    from instruments.virtual.bench.session import Hold, Session

#: Where the URL handler finds the benches: by the name in ``levilab://instrument?bench=name``, "" when there is none.
benches: dict[str, Callable[[], Bus]] = {}

#: What looking whether something has come costs [s]: a program that waits by looking gets ahead on a virtual clock too.
_LOOK = 1e-3
_ALL = 1 << 30


class SerialLine:
    """The program's end of a line to an instrument; stands where a Session stands.

    settings: of this end, may change at any time.  The instrument's end is set as its ``serial_settings`` say; one
    that has none follows the program.
    """

    def __init__(self, session: Session, settings: LineSettings | None = None) -> None:
        self.session, self.settings = session, settings or LineSettings()
        self._heard = b""

    @property
    def hold(self) -> Hold:
        """Who has the instrument."""
        return self.session.hold

    def _far_end(self) -> LineSettings:
        far_end: LineSettings | None = getattr(self.session.device, "serial_settings", None)
        return far_end or self.settings

    def write(self, data: bytes, *, end: bool = True) -> None:
        """Send bytes; returns when the last one has left.  end: there are no marks on a serial line."""
        self.session.device.clock.sleep(self.settings.duration(len(data)))
        # assumed: the instrument does not check parity, or a wrong one would mean silence and no hint
        self.session.write(carried(data, self.settings, self._far_end(), checked=False))

    def receive(self, count: int, timeout: float, *, until: bytes = b"") -> bytes:
        """So many bytes, or fewer: up to one of these, or what has come when the time is over [s]."""
        clock = self.session.device.clock
        deadline = clock.now() + timeout
        while not (size := self._enough(count, until)):
            ready = self.session.ready()
            if ready is None or ready > deadline:
                if math.isfinite(deadline):  # for ever is no time to jump to
                    clock.sleep(max(0.0, deadline - clock.now()))
                size = len(self._heard)
                break
            clock.sleep(max(0.0, ready - clock.now()))
            self._hear()
        chunk, self._heard = self._heard[:size], self._heard[size:]
        return chunk

    def _enough(self, count: int, until: bytes) -> int:
        found = self._heard.find(until, 0, count) + 1 if until else 0
        return found or (count if len(self._heard) >= count else 0)

    def _hear(self) -> None:
        far_end = self._far_end()
        data, _ = self.session.take(_ALL)
        self.session.device.clock.sleep(far_end.duration(len(data)))
        self._heard += carried(data, far_end, self.settings)

    def read(self, count: int, timeout: float, *, until: bytes = b"") -> tuple[bytes, bool] | None:
        """As Session.read.  A line has no ends: less than was waited for is a time-out, and is lost."""
        got = self.receive(count, timeout, until=until)
        return (got, False) if got and (len(got) == count or got[-1:] == until) else None

    def waiting(self) -> int:
        """How many bytes have come and were not read."""
        clock = self.session.device.clock
        while (ready := self.session.ready()) is not None and ready <= clock.now():
            self._hear()
        if not self._heard:
            clock.sleep(_LOOK)
        return len(self._heard)

    def discard(self) -> None:
        """Drop what has come and was not read."""
        self.session.discard()
        self._heard = b""

    def clear(self) -> None:
        """Empty the buffers of this end; the instrument hears nothing of it, and a late answer still comes."""
        self.discard()

    def status_byte(self) -> int:
        """As Session.status_byte."""
        return self.session.status_byte()

    def trigger(self) -> None:
        """As Session.trigger."""
        self.session.trigger()

    def close(self) -> None:
        """The program is gone."""
        self.hold.let_go(self)
        self.session.close()
