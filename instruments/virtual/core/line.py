"""A serial line: its settings, and the bytes that a receiver with other settings gets."""

from dataclasses import dataclass

#: The parity bit behind an even and behind an odd number of ones.
_PARITY_BITS = {"E": (0, 1), "O": (1, 0), "M": (1, 1), "S": (0, 0)}


@dataclass(frozen=True)
class LineSettings:
    """The settings of one end of a line.  parity: N, E, O, M or S; stop_bits: 1, 1.5 or 2."""

    baud_rate: int = 9600
    data_bits: int = 8
    parity: str = "N"
    stop_bits: float = 1.0

    @property
    def bits(self) -> float:
        """Bits on the line for one byte, start and stop included."""
        return 1 + self.data_bits + (self.parity != "N") + self.stop_bits

    def duration(self, count: int) -> float:
        """Return how long this number of bytes takes on the line [s]."""
        return count * self.bits / self.baud_rate


def receive(data: bytes, sender: LineSettings, receiver: LineSettings, *, checked: bool = True) -> bytes:
    r"""Return the bytes that a receiver gets of those sent one after the other, on a line that was idle before.

    A missing stop bit stops no byte.

    Args:
        data: the bytes sent.
        sender: settings of their sender.
        receiver: settings of the receiver.
        checked: whether a byte with a wrong parity bit becomes a NUL, as in VISA (VPP-4.3, VI_ATTR_ASRL_REPLACE_CHAR).

    >>> line = LineSettings(57600, 7, "O")
    >>> receive(b"LSCI", line, line)
    b'LSCI'
    >>> receive(b"LSCI", line, LineSettings(57600, 8, "N"))
    b'L\xd3CI'
    """
    if (sender.baud_rate, sender.data_bits, sender.parity) == (receiver.baud_rate, receiver.data_bits, receiver.parity):
        mask = (1 << sender.data_bits) - 1
        return data if mask == 0xFF else bytes(byte & mask for byte in data)
    parity = _PARITY_BITS.get(receiver.parity) if checked else None
    return _sample_bits(_half_bits(data, sender), sender.baud_rate, receiver, parity)


def _half_bits(data: bytes, sender: LineSettings) -> list[int]:
    """Return the levels on the line, two for each bit."""
    levels: list[int] = []
    for byte in data:
        bits = [byte >> place & 1 for place in range(sender.data_bits)]
        if sender.parity in _PARITY_BITS:
            bits.append(_PARITY_BITS[sender.parity][sum(bits) & 1])
        for bit in (0, *bits):
            levels += (bit, bit)
        levels += [1] * round(2 * sender.stop_bits)
    return levels


def _sample_bits(levels: list[int], sent_at: int, receiver: LineSettings, parity_bits: tuple[int, int] | None) -> bytes:
    """Return the bytes of a receiver that samples the line in the middle of each of its own bits.

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
