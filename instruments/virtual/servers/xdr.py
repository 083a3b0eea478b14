"""XDR: the form in which remote procedure calls write numbers and strings of bytes (RFC 4506)."""

from __future__ import annotations

import struct


class Garbage(Exception):
    """The bytes are not the values that were expected."""


class Reader:
    """Reads whole numbers and strings of bytes, each padded to a multiple of four bytes."""

    def __init__(self, data: bytes) -> None:
        self._data, self._place = data, 0

    def number(self) -> int:
        """Return an unsigned whole number of 32 bits (a signed one is not negative here).  Raises Garbage."""
        return int.from_bytes(self._bytes(4))

    def numbers(self, count: int) -> tuple[int, ...]:
        """Return the next `count` numbers.  Raises Garbage."""
        return tuple(self.number() for _ in range(count))

    def opaque(self) -> bytes:
        """Return a string of bytes.  Raises Garbage."""
        length = self.number()
        data = self._bytes(length)
        self._place += -length % 4
        return data

    def _bytes(self, count: int) -> bytes:
        data = self._data[self._place : self._place + count]
        if len(data) < count:
            raise Garbage
        self._place += count
        return data


def pack(*values: int | bytes) -> bytes:
    r"""Pack whole numbers and strings of bytes, the inverse of `Reader`.

    >>> pack(1, b"abc")
    b'\x00\x00\x00\x01\x00\x00\x00\x03abc\x00'
    """
    return b"".join(
        struct.pack("!I", value)
        if isinstance(value, int)
        else struct.pack("!I", len(value)) + value + b"\0" * (-len(value) % 4)
        for value in values
    )
