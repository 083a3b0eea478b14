"""A serial line between a program and a virtual instrument: bits, not bytes.

When both ends are set alike the bytes arrive as they were sent; when baud rate, data bits or parity differ, the
receiver samples the sender's bits at the wrong places, as a UART does, and gets garbage, the same each time.
"""

import math

from instruments.virtual.bench.session import ClientLock, Session
from instruments.virtual.core.line import LineSettings, receive

#: What one look for received bytes costs [s], so that a program that waits by polling advances on a virtual clock, too.
_LOOK = 1e-3
_ALL = 1 << 30


class SerialLine:
    """The program's end of a line to an instrument; it has the methods of a Session.

    The instrument's end has its ``serial_settings``; an instrument without them follows the program's.

    Attributes:
        session: with the instrument.
        settings: of this end; they may change at any time.
    """

    def __init__(self, session: Session, settings: LineSettings | None = None) -> None:
        self.session, self.settings = session, settings or LineSettings()
        self._received = b""

    @property
    def client_lock(self) -> ClientLock:
        """The lock on the instrument."""
        return self.session.client_lock

    def _far_end(self) -> LineSettings:
        far_end: LineSettings | None = getattr(self.session.device, "serial_settings", None)
        return far_end or self.settings

    def write(self, data: bytes, *, end: bool = True) -> None:
        """Send bytes, and return when the last one has left.  end: ignored, as a serial line has no marks."""
        self.session.device.clock.sleep(self.settings.duration(len(data)))
        # assumed: the instrument does not check parity; if it did, a wrong one would mean silence without a hint
        self.session.write(receive(data, self.settings, self._far_end(), checked=False))

    def receive(self, count: int, timeout: float, *, until: bytes = b"") -> bytes:
        """Wait for bytes.

        Args:
            count: how many at most.
            timeout: how long to wait [s].
            until: the byte after which to stop, if any.

        Returns:
            The bytes received: fewer than `count` up to `until`, or when the time is over.
        """
        clock = self.session.device.clock
        deadline = clock.now() + timeout
        while not (size := self._size_to_return(count, until)):
            ready = self.session.ready()
            if ready is None or ready > deadline:
                if math.isfinite(deadline):  # a clock cannot jump to infinity
                    clock.sleep(max(0.0, deadline - clock.now()))
                size = len(self._received)
                break
            clock.sleep(max(0.0, ready - clock.now()))
            self._receive_ready()
        chunk, self._received = self._received[:size], self._received[size:]
        return chunk

    def _size_to_return(self, count: int, until: bytes) -> int:
        found = self._received.find(until, 0, count) + 1 if until else 0
        return found or (count if len(self._received) >= count else 0)

    def _receive_ready(self) -> None:
        far_end = self._far_end()
        data, _ = self.session.take(_ALL)
        self.session.device.clock.sleep(far_end.duration(len(data)))
        self._received += receive(data, far_end, self.settings)

    def read(self, count: int, timeout: float, *, until: bytes = b"") -> tuple[bytes, bool] | None:
        """Wait for bytes, as Session.read; fewer than `count`, without `until`, are a time-out (None), and are lost."""
        got = self.receive(count, timeout, until=until)
        return (got, False) if got and (len(got) == count or got[-1:] == until) else None

    def waiting(self) -> int:
        """Return the number of received bytes that the program has not read."""
        clock = self.session.device.clock
        while (ready := self.session.ready()) is not None and ready <= clock.now():
            self._receive_ready()
        if not self._received:
            clock.sleep(_LOOK)
        return len(self._received)

    def discard(self) -> None:
        """Drop the received bytes that the program has not read."""
        self.session.discard()
        self._received = b""

    def clear(self) -> None:
        """Empty the buffers of this end.  The instrument does not notice, and a late answer still comes."""
        self.discard()

    def status_byte(self) -> int:
        """Return the status byte; see Session."""
        return self.session.status_byte()

    def trigger(self) -> None:
        """Trigger the instrument; see Session."""
        self.session.trigger()

    def close(self) -> None:
        """End the session, and release its lock."""
        self.client_lock.release(self)
        self.session.close()
