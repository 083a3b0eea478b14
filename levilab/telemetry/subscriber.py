"""A view's end: asks a bench for messages every second, and reads what has come."""

import contextlib
import socket
import time
from collections.abc import Callable
from typing import Self

from levilab.telemetry.address import LOOPBACK, Address
from levilab.telemetry.codec import MalformedMessage
from levilab.telemetry.datagrams import DATAGRAM_BYTES, Joiner, wish
from levilab.telemetry.messages import Message, decode

#: Interval between two wishes of a view [s]; a bench forgets a view after three intervals.
ASKS_EVERY_S = 1.0
#: Most datagrams that are read at once, and room for those that have come since [bytes].
_MOST_AT_ONCE, _ROOM_BYTES = 500, 1 << 20


class Subscriber:
    """Receives the messages of a bench; no call waits for one.

    A program with an event loop calls `receive` some 20 times a second, or when `fileno` can be read.

    Args:
        address: of the bench.
        clock: of the wall; a test has its own.

    Raises:
        OSError: no socket can be had.
    """

    def __init__(self, address: Address, clock: Callable[[], float] = time.monotonic) -> None:
        self.address, self.clock = address, clock
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._joiner = Joiner(address.token)
        self._next = -1.0
        try:
            self._socket.bind((LOOPBACK, 0))
            self._socket.settimeout(0)
            with contextlib.suppress(OSError):
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _ROOM_BYTES)
        except OSError:
            self._socket.close()
            raise

    def fileno(self) -> int:
        """Return the file number of the socket."""
        return self._socket.fileno()

    def receive(self) -> list[Message]:
        """Return the messages that have come, and ask for more when it is time."""
        self._ask()
        found: list[Message] = []
        for _ in range(_MOST_AT_ONCE):
            try:
                data, sender = self._socket.recvfrom(DATAGRAM_BYTES)
            except BlockingIOError:
                break
            except OSError:  # Windows: no bench is there any more, ConnectionResetError; or a datagram is too long
                continue
            if sender == (LOOPBACK, self.address.port) and (message := self._joiner.join(data)) is not None:
                with contextlib.suppress(MalformedMessage):
                    found.append(decode(message))
        return found

    def _ask(self) -> None:
        now = self.clock()
        if now >= self._next:
            self._next = now + ASKS_EVERY_S
            with contextlib.suppress(OSError):
                self._socket.sendto(wish(self.address.token), (LOOPBACK, self.address.port))

    def close(self) -> None:
        """Listen no longer."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
