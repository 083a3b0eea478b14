"""Definite-length blocks: how instruments send bytes of any value, line feeds included.

``#`` one digit n, n digits that say how many bytes follow, and so many bytes (IEEE 488.2-1992, 8.7.9).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


#: No instrument of a bench sends more at once [bytes]; a head that says so is noise on the line.
LONGEST_BLOCK = 1 << 28

_HEAD = re.compile(rb"#([1-9])")


class BrokenBlock(Exception):
    """What came is no block, or not all of one.  seen: in words."""

    def __init__(self, seen: str) -> None:
        self.seen = seen
        super().__init__(seen)


def read_block(read: Callable[[int], bytes]) -> bytes:
    r"""The block at the head of a stream, and the line end behind it.

    read: exactly so many bytes, or fewer if no more come.  Raises BrokenBlock.

    >>> import io
    >>> read_block(io.BytesIO(b"#15a,\x0a,b\n").read)
    b'a,\n,b'
    """
    head = read(2)
    if not _HEAD.fullmatch(head):
        raise BrokenBlock(repr(head))
    size = _size(head, read(head[1] - ord("0")))
    block = read(size)
    if len(block) < size:
        raise BrokenBlock(f"{len(block)} bytes of a block of {size}")
    end = read(1)
    if end == b"\r":
        end = read(1)
    if end != b"\n":
        raise BrokenBlock(f"a block of {size} bytes that goes on with {end!r}")
    return block


def block_of(message: bytes) -> bytes:
    r"""The bytes of a block that came as a whole message.  Raises BrokenBlock.

    >>> block_of(b"#13\x00\x0a\xff\n")
    b'\x00\n\xff'
    """
    head = message[:2]
    if not _HEAD.fullmatch(head):
        raise BrokenBlock(repr(message[:20]))
    data = 2 + head[1] - ord("0")
    size = _size(head, message[2:data])
    rest = message[data + size :]
    if len(message) < data + size:
        raise BrokenBlock(f"{len(message) - data} bytes of a block of {size}")
    if rest.strip(b"\r\n"):
        raise BrokenBlock(f"a block of {size} bytes that goes on with {rest[:20]!r}")
    return message[data : data + size]


def _size(head: bytes, digits: bytes) -> int:
    if len(digits) != head[1] - ord("0") or not digits.isdigit():
        raise BrokenBlock(repr(head + digits))
    size = int(digits)
    if size > LONGEST_BLOCK:
        raise BrokenBlock(f"{(head + digits).decode()}, which announces {size} bytes")
    return size


#: What SCPI instruments send when there is no reading, and for infinity (SCPI-1999, vol. 1, 7.2.1).
NOT_A_NUMBER, INFINITY = 9.91e37, 9.9e37
