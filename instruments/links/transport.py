"""What a driver needs of a link, whatever it is made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from instruments.ieee488 import PLAIN_BLOCK

if TYPE_CHECKING:
    from instruments.ieee488 import BlockForm


class Transport(Protocol):
    """Messages to and from one instrument.  timeout: how long an answer is waited for [s]."""

    address: str
    timeout: float

    def write(self, message: str) -> None:
        """Send one message."""

    def query(self, message: str, *, patience: float = 0.0) -> str:
        """Send a question and return the answer without its line end.

        patience: how long the instrument works on this answer before it can send it [s]; added to the
        timeout.  Raises NoAnswer when nothing came in time.
        """

    def query_block(self, message: str, *, patience: float = 0.0, form: BlockForm = PLAIN_BLOCK) -> bytes:
        """Send a question and return the bytes of the definite-length block that answers it (IEEE 488.2, 8.7.9).

        form: what stands around the block.

        Raises NoAnswer as query does, BadAnswer when it is no block or one that breaks off.
        """

    def clear(self) -> None:
        """Drop whatever is under way in either direction."""

    def reopen(self) -> None:
        """Give the link up and make it anew.  Raises NotConnected, also after close()."""

    def lock(self) -> None:
        """Keep other programs from the instrument, where the interface can.  Raises Occupied if one has it."""

    def close(self) -> None:
        """Give the instrument back, for good.  Afterwards all else raises NotConnected; closing twice does no harm."""


#: Called with the address, ">" or "<", and the bytes that were sent or received.
TrafficLog = Callable[[str, str, bytes], None]
