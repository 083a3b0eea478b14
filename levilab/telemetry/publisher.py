"""The bench's end: sends messages to the views that asked for some, and costs next to nothing where none did."""

import contextlib
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self

from levilab.telemetry.address import LOOPBACK, Address, remove_address, write_address
from levilab.telemetry.datagrams import DATAGRAM_BYTES, is_wish, split
from levilab.telemetry.messages import Message, encode

#: A view that has not asked for so long gets nothing more [s].
FORGOTTEN_AFTER_S = 3.0
#: Least time between two rounds of messages [s]: 20 a second.
LEAST_PAUSE_S = 0.05
#: Most views at a time, and most datagrams that are read at once.
_MOST_VIEWS, _MOST_AT_ONCE = 8, 32


class Publisher:
    """A UDP socket on the loopback address, which no call waits for.

    It has no thread: call `is_due` whenever there is a moment, and send a round of messages where it is True.  No
    failure of the network ever raises: a measurement goes on without its views.

    Attributes:
        address: where views ask for messages; None where no socket could be had.
        clock: of the wall; a test has its own.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self.address: Address | None = None
        self._folder: Path | None = None
        self._views: dict[tuple[str, int], float] = {}  # → when it asked last
        self._next, self._number = 0.0, 0
        self._socket = self._open_socket()

    def _open_socket(self) -> socket.socket | None:
        try:
            opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        except OSError:
            return None
        try:
            opened.bind((LOOPBACK, 0))
            opened.settimeout(0)
            self.address = Address.at(opened.getsockname()[1])
        except OSError:
            opened.close()
            return None
        return opened

    def announce(self, folder: Path) -> None:
        """Say in a run folder where it publishes; in no other one any longer."""
        if folder is self._folder or self.address is None:
            return
        self._withdraw()
        self._folder = folder
        with contextlib.suppress(OSError):
            write_address(folder, self.address)

    def _withdraw(self) -> None:
        if self._folder is not None and self.address is not None:
            remove_address(self._folder, self.address)
        self._folder = None

    @property
    def is_watched(self) -> bool:
        """Whether a view listened when it was last looked."""
        return bool(self._views)

    def is_due(self) -> bool:
        """Return whether a view listens, and the last round of messages is long enough ago; then a new round begins."""
        if self._socket is None or (now := self.clock()) < self._next:
            return False
        self._next = now + LEAST_PAUSE_S
        self._read_wishes(self._socket, now)
        return bool(self._views)

    def _read_wishes(self, opened: socket.socket, now: float) -> None:
        for _ in range(_MOST_AT_ONCE):
            try:
                data, view = opened.recvfrom(DATAGRAM_BYTES)
            except BlockingIOError:
                break
            except OSError:  # Windows: a view has gone, ConnectionResetError; or a datagram is too long
                continue
            has_room = view in self._views or len(self._views) < _MOST_VIEWS
            if has_room and self.address and is_wish(data, self.address.token):
                self._views[view] = now
        self._views = {view: asked for view, asked in self._views.items() if now - asked < FORGOTTEN_AFTER_S}

    def send(self, message: Message) -> None:
        """Send a message to all views; one that cannot be sent is lost."""
        if self._socket is None or self.address is None or not self._views:
            return
        self._number += 1
        for datagram in split(encode(message), self._number, self.address.token):
            for view in self._views:
                with contextlib.suppress(OSError):
                    self._socket.sendto(datagram, view)

    def close(self) -> None:
        """Stop publishing."""
        self._withdraw()
        if self._socket is not None:
            self._socket.close()
        self._socket = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
