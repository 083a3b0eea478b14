"""Where a message of a controller ends: the bytes of a stream, cut into program messages.

Source: IEEE 488.2-1992, 7.5 (terminators) and 7.7.6 (definite-length blocks, which may hold any byte, line feeds
included).  Whatever is sent, no more than a bounded number of bytes is kept.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

#: A line longer than this is dropped, and a block that says that it is longer is no block [bytes].
LONGEST_LINE, LONGEST_BLOCK = 1 << 22, 1 << 26

#: What decides: the end of a line, a quote, or a block's head where a parameter can begin.
_SPECIAL = re.compile(rb"[\n\"']|(?<=[\x00-\x20,])#[1-9]")
_LINE_END = re.compile(rb"\n")
#: White space (IEEE 488.2, 7.4.1.2).
_BLANK = bytes(range(0x21))


class Overrun(Exception):
    """More came than an instrument can keep; it was dropped up to the next line end."""


@dataclass
class Framer:
    r"""Takes bytes as they come and gives whole messages, decoded as Latin-1 (each byte a character).

    blocks: whether the instrument knows blocks; to others # is a sign like any other.

    >>> Framer().feed(b"*IDN?\nDATA #12\n\n\nFR")
    ['*IDN?', 'DATA #12\n\n']
    """

    blocks: bool = True
    _buffer: bytearray = field(default_factory=bytearray)
    _looked: int = 0  # so far nothing ends the message
    _block_end: int = 0  # up to here are the bytes of blocks
    _quote: bytes = b""
    _dropping: bool = False

    def feed(self, data: bytes) -> list[str | Overrun]:
        """The messages that these bytes complete; Overrun in the place of one that was too long."""
        self._buffer += data
        messages: list[str | Overrun] = []
        while (end := self._end_of_message()) is not None:
            if not self._dropping:
                text = bytes(self._buffer[: self._block_end]) + self._buffer[self._block_end : end].rstrip(_BLANK)
                messages.append(text.lstrip(_BLANK).decode("latin-1"))
            self._forget(end + 1)
        if len(self._buffer) > max(self._block_end, 0) + LONGEST_LINE:
            if not self._dropping:
                messages.append(Overrun())
            self._forget(len(self._buffer))
            self._dropping = True
        return messages

    @property
    def begun(self) -> bool:
        """Whether a message has begun that has not ended yet."""
        return bool(self._buffer) or self._dropping

    def clear(self) -> None:
        """Drop what has not become a message yet."""
        self._forget(len(self._buffer))

    def _forget(self, count: int) -> None:
        del self._buffer[:count]
        self._looked, self._block_end, self._quote, self._dropping = 0, 0, b"", False

    def _end_of_message(self) -> int | None:
        """Where the line feed stands that ends the first message, or None if it is not there yet."""
        special = _SPECIAL if self.blocks else _LINE_END
        while found := special.search(self._buffer, self._looked):
            what = found[0]
            if what == b"\n":
                return found.start()
            if what in {b'"', b"'"}:
                self._quote = b"" if self._quote == what else self._quote or what
            elif not self._quote and not self._dropping:
                if (end := self._end_of_block(found.start())) is None:
                    return None
                self._looked = self._block_end = end
                if end > len(self._buffer):
                    return None
                continue
            self._looked = found.end()
        # a block's head may have come in part, with what stands before it
        self._looked = max(self._looked, self._block_end, len(self._buffer) - 2)
        return None

    def _end_of_block(self, head: int) -> int | None:
        """Where the block ends that begins here; just behind its head if it is none; None: not known yet."""
        digits = self._buffer[head + 2 : head + 2 + self._buffer[head + 1] - ord("0")]
        length = bytes(digits)
        if not length.isdigit() and length:
            return head + 2
        if len(length) < self._buffer[head + 1] - ord("0"):
            return None
        size = int(length)
        # of all the blocks of a message together no more is kept than of the longest one
        return head + 2 + len(length) + (size if head + size <= LONGEST_BLOCK else 0)
