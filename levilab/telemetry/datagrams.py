"""Datagrams: a message in one or more of them, and a view's wish to get some.

====================  ===================================================================
4 bytes               ``LVT1`` from a bench, ``LVS1`` from a view
16 bytes              the token
====================  ===================================================================

A bench's go on, little-endian:

====================  ===================================================================
4 bytes               number of the message, which grows by one and begins again after 2³²
2 bytes               which part of it this is, from 0
2 bytes               number of parts
up to 8000 bytes      the part
====================  ===================================================================
"""

import hmac
import struct
from collections import OrderedDict
from collections.abc import Iterator

from levilab.telemetry.address import TOKEN_BYTES

#: Bytes of a message in a datagram: macOS sends none of more than 9216.
PART_BYTES = 8000
#: Longest datagram that is read.
DATAGRAM_BYTES = 9000
#: Most parts of a message.
_MOST_PARTS = 255
#: Messages that are still incomplete: when a newer one comes, the oldest is given up.
_MOST_OPEN = 4

_WISH, _PART = b"LVS1", b"LVT1"
_HEAD = struct.Struct(f"<4s{TOKEN_BYTES}sIHH")


def wish(token: bytes) -> bytes:
    """Return the datagram with which a view asks for messages."""
    return _WISH + token


def is_wish(data: bytes, token: bytes) -> bool:
    """Return whether a datagram is a view's wish, with this token."""
    return hmac.compare_digest(data, wish(token))


def split(message: bytes, number: int, token: bytes) -> Iterator[bytes]:
    """Yield the datagrams of a message; one that is too long for _MOST_PARTS is not sent."""
    parts = max(1, -(-len(message) // PART_BYTES))
    if parts > _MOST_PARTS:
        return
    for k in range(parts):
        head = _HEAD.pack(_PART, token, number & 0xFFFFFFFF, k, parts)
        yield head + message[k * PART_BYTES : (k + 1) * PART_BYTES]


class Joiner:
    """Joins the parts of messages; whatever is no part of one with this token is dropped."""

    def __init__(self, token: bytes) -> None:
        self._token = token
        self._open: OrderedDict[int, dict[int, bytes]] = OrderedDict()

    def join(self, data: bytes) -> bytes | None:
        """Take in a datagram.  Returns the message if it is complete now, else None."""
        if len(data) < _HEAD.size or len(data) > _HEAD.size + PART_BYTES:
            return None
        magic, token, number, part, parts = _HEAD.unpack_from(data)
        if magic != _PART or not hmac.compare_digest(token, self._token) or not part < parts <= _MOST_PARTS:
            return None
        body = data[_HEAD.size :]
        if parts == 1:
            return body
        known = self._open.setdefault(number, {})
        known[part] = body
        if all(k in known for k in range(parts)):
            del self._open[number]
            return b"".join(known[k] for k in range(parts))
        while len(self._open) > _MOST_OPEN:
            self._open.popitem(last=False)
        return None
