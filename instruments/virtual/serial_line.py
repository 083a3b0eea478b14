"""A serial line between a program and a virtual instrument: bits, not bytes.

When both ends are set alike the bytes arrive as they were sent; when baud rate, data bits or parity differ, the
receiver samples the sender's bits at the wrong places, as a UART does, and hears garbage: the same each time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.bus import Bus, Hold, Session

#: Where the URL handler finds the benches: by the name in ``levilab://instrument?bench=name``, "" when there is none.
benches: dict[str, Callable[[], Bus]] = {}

#: What looking whether something has come costs [s]: a program that waits by looking gets ahead on a virtual clock too.
_LOOK = 1e-3
_ALL = 1 << 30

#: The parity bit behind an even and behind an odd number of ones.
_PARITY_BITS = {"E": (0, 1), "O": (1, 0), "M": (1, 1), "S": (0, 0)}


@dataclass(frozen=True)
class LineSettings:
    """How one end of a line is set.  parity: N, E, O, M or S; stop_bits: 1, 1.5 or 2."""

    baud_rate: int = 9600
    data_bits: int = 8
    parity: str = "N"
    stop_bits: float = 1.0

    @property
    def bits(self) -> float:
        """Bits on the line for one byte, start and stop included."""
        return 1 + self.data_bits + (self.parity != "N") + self.stop_bits

    def duration(self, count: int) -> float:
        """How long so many bytes take [s]."""
        return count * self.bits / self.baud_rate


def carried(data: bytes, sender: LineSettings, receiver: LineSettings, *, checked: bool = True) -> bytes:
    r"""What the receiver hears of these bytes, sent one after the other on a line that was quiet.

    checked: a byte with a wrong parity bit becomes a NUL, as VISA has it (VPP-4.3, VI_ATTR_ASRL_REPLACE_CHAR).  A
    missing stop bit stops no byte.

    >>> line = LineSettings(57600, 7, "O")
    >>> carried(b"LSCI", line, line)
    b'LSCI'
    >>> carried(b"LSCI", line, LineSettings(57600, 8, "N"))
    b'L\xd3CI'
    """
    if (sender.baud_rate, sender.data_bits, sender.parity) == (
        receiver.baud_rate,
        receiver.data_bits,
        receiver.parity,
    ):
        mask = (1 << sender.data_bits) - 1
        return data if mask == 0xFF else bytes(byte & mask for byte in data)
    parity = _PARITY_BITS.get(receiver.parity) if checked else None
    return _sampled(_half_bits(data, sender), sender.baud_rate, receiver, parity)


def _half_bits(data: bytes, sender: LineSettings) -> list[int]:
    """The levels on the line, two for each bit."""
    levels: list[int] = []
    for byte in data:
        bits = [byte >> place & 1 for place in range(sender.data_bits)]
        if sender.parity in _PARITY_BITS:
            bits.append(_PARITY_BITS[sender.parity][sum(bits) & 1])
        for bit in (0, *bits):
            levels += (bit, bit)
        levels += [1] * round(2 * sender.stop_bits)
    return levels


def _sampled(levels: list[int], sent_at: int, receiver: LineSettings, parity_bits: tuple[int, int] | None) -> bytes:
    """The bytes of a receiver that looks at the middle of each of its own bits.

    Time is counted in units that make half a bit of the sender and half a bit of the receiver whole numbers.
    """
    half_sent, half_heard = receiver.baud_rate, sent_at
    heard = bytearray()
    index = 0
    while True:
        while index < len(levels) and levels[index]:
            index += 1
        if index >= len(levels):
            return bytes(heard)
        start = index * half_sent
        places = range(receiver.data_bits + (receiver.parity != "N") + 1)
        looks = [(start + (2 * place + 3) * half_heard) // half_sent for place in places]
        bits = [levels[look] if look < len(levels) else 1 for look in looks]
        byte = sum(bit << place for place, bit in enumerate(bits[: receiver.data_bits]))
        wrong = parity_bits and bits[receiver.data_bits] != parity_bits[byte.bit_count() & 1]
        heard.append(0 if wrong else byte)
        index = looks[-1]
        while index < len(levels) and not levels[index]:  # no stop bit: the next start is an edge, not a level
            index += 1


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
