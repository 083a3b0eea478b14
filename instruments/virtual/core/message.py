"""Messages in a stream of bytes: where they end, and their units, headers with their path, and parameters.

Source: SCPI-1999, volume 1, 6.2.4 (compound messages with path memory); IEEE 488.2, 7.5 (where a message ends), 7.7.6
(blocks).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

#: White space is every control character and the space (IEEE 488.2, 7.4.1.2), and no other character of Latin-1.
_BLANK, _DIGITS = "".join(map(chr, range(0x21))), re.compile("[0-9]+")
_UNIT = re.compile(r"([^\x00-\x20]+)[\x00-\x20]*(.*)", re.DOTALL)
_SPECIAL = re.compile(r"[\"'();,]|(?<![^\x00-\x20,])#[1-9]")


#: Special characters, or empty units, between two places where the work may be interrupted.
_AT_A_STRETCH = 1000


def read_units(message: str, *, path_memory: bool = True) -> Iterator[tuple[str, list[str]] | None]:
    """Yield the units of a compound message: the full header of each, and its parameters.

    Yields None where the work may be interrupted: between units, and now and then within a long one.

    Args:
        message: without its line end.
        path_memory: whether a header continues the path of the one before it, as in SCPI, or begins at the root.

    >>> list(read_units("SOUR:FREQ 40;*OPC?;VOLT 1,2"))
    [('SOUR:FREQ', ['40']), None, ('*OPC?', []), None, ('SOUR:VOLT', ['1', '2'])]
    """
    path, first = "", True
    for unit in split_units(message):
        if unit is None or (unit and not first):
            yield None
        if not unit:
            continue
        first = False
        header, rest, path = read_unit(unit, path if path_memory else "")
        parameters: list[str] = []
        for parameter in split_parameters(rest):
            if parameter is None:
                yield None
            else:
                parameters.append(parameter)
        yield header, parameters


def split_units(message: str) -> Iterator[str | None]:
    """Return the units of a compound message: split at semicolons outside of quotes and blocks.

    Yields None now and then in a long message, where the work may be interrupted; an empty unit is "".

    >>> list(split_units('FREQ 40; DISP:TEXT "a;b"'))
    ['FREQ 40', 'DISP:TEXT "a;b"']
    """
    return _split(message, ";")


def read_unit(unit: str, path: str) -> tuple[str, str, str]:
    """Return the full header of a unit, the text of its parameters, and the path that the next unit starts from.

    >>> read_unit("FREQ 40", "SOUR:")
    ('SOUR:FREQ', '40', 'SOUR:')
    """
    parts = _UNIT.fullmatch(unit)
    assert parts, "a unit begins with no blank"
    header, rest = parts.groups()
    if header.startswith("*"):
        return header, rest, path
    full = header[1:] if header.startswith(":") else path + header
    return full, rest, full.rpartition(":")[0] + ":" if ":" in full else ""


def split_parameters(text: str) -> Iterator[str | None]:
    """Return the parameters of a unit: split at commas outside of quotes, parentheses and blocks.

    Yields None where the work may be interrupted, as split_units() does.

    >>> list(split_parameters("25, MAX, (@1,2)"))
    ['25', 'MAX', '(@1,2)']
    >>> list(split_parameters("ARB1,#13,;,"))
    ['ARB1', '#13,;,']
    """
    return _split(text, ",") if text.strip(_BLANK) else iter(())


def _split(text: str, separator: str) -> Iterator[str | None]:
    """Yield the pieces between separators, without blanks around them, but with blanks that are bytes of a block.

    Yields None after every _AT_A_STRETCH special characters, where the work may be interrupted.
    """
    start = looked = block_end = depth = seen = 0
    while found := _SPECIAL.search(text, looked):
        what, looked = found[0], found.end()
        seen += 1
        if seen % _AT_A_STRETCH == 0:
            yield None
        if what in {'"', "'"}:
            closing = text.find(what, looked)
            looked = closing + 1 if closing >= 0 else len(text)
        elif what[0] == "#":
            looked = block_end = _end_of_block(text, found.start())
        elif what in "()":
            depth = depth + 1 if what == "(" else max(0, depth - 1)
        elif what == separator and not depth:
            yield _piece(text, start, found.start(), block_end)
            start = looked
    yield _piece(text, start, len(text), block_end)


def _piece(text: str, start: int, end: int, block_end: int) -> str:
    if block_end <= start:
        return text[start:end].strip(_BLANK)
    kept = min(block_end, end)
    return (text[start:kept] + text[kept:end].rstrip(_BLANK)).lstrip(_BLANK)


def _end_of_block(text: str, head: int) -> int:
    """Return the end of the definite-length block whose # is at `head`; just behind the # where it is no block."""
    data = head + 2 + int(text[head + 1])
    length = text[head + 2 : data]
    return min(len(text), data + int(length)) if _DIGITS.fullmatch(length) else head + 1


#: The framer drops a longer line, and takes the head of a longer block for text [bytes].
LONGEST_LINE, LONGEST_BLOCK = 1 << 22, 1 << 26
#: What decides where a message ends: a line end, a quote, or a block's head where a parameter can begin.
_SPECIAL_BYTE = re.compile(rb"[\n\"']|(?<=[\x00-\x20,])#[1-9]")
_LINE_END = re.compile(rb"\n")
#: White space (IEEE 488.2, 7.4.1.2).
_BLANK_BYTES = bytes(range(0x21))


class Overrun(Exception):
    """A message was longer than the input buffer; it is dropped up to the next line end."""


@dataclass
class Framer:
    r"""Collects bytes and returns whole messages, decoded as Latin-1 (each byte a character).

    Attributes:
        blocks: whether the instrument knows blocks; for others # is a character like any other.

    >>> Framer().feed(b"*IDN?\nDATA #12\n\n\nFR")
    ['*IDN?', 'DATA #12\n\n']
    """

    blocks: bool = True
    _buffer: bytearray = field(default_factory=bytearray)
    _looked: int = 0  # up to here nothing ends the message
    _block_end: int = 0  # up to here the bytes belong to blocks
    _quote: bytes = b""
    _dropping: bool = False

    def feed(self, data: bytes, *, marked: bool = False) -> list[str | Overrun]:
        """Add bytes.

        Args:
            data: the bytes.
            marked: whether the interface marks the end of a message behind them, which stands for a missing line feed
                (IEEE 488.2, 7.5).

        Returns:
            The messages that these bytes complete, with an Overrun in the place of one that was too long.
        """
        self._buffer += data if not marked or data.endswith(b"\n") else data + b"\n"
        messages: list[str | Overrun] = []
        while (end := self._end_of_message()) is not None:
            if not self._dropping:
                text = self._buffer[: self._block_end] + self._buffer[self._block_end : end].rstrip(_BLANK_BYTES)
                messages.append(text.lstrip(_BLANK_BYTES).decode("latin-1"))
            self._forget(end + 1)
        if len(self._buffer) > max(self._block_end, 0) + LONGEST_LINE:
            if not self._dropping:
                messages.append(Overrun())
            self._forget(len(self._buffer))
            self._dropping = True
        if marked and self.begun:  # that line feed was a byte of a block
            messages += self.feed(b"\n")
        return messages

    @property
    def begun(self) -> bool:
        """Whether a message has begun and not ended yet."""
        return bool(self._buffer) or self._dropping

    def clear(self) -> None:
        """Drop the bytes of an unfinished message."""
        self._forget(len(self._buffer))

    def _forget(self, count: int) -> None:
        del self._buffer[:count]
        self._looked, self._block_end, self._quote, self._dropping = 0, 0, b"", False

    def _end_of_message(self) -> int | None:
        """Return the place of the line feed that ends the first message, None where it has not come yet."""
        special = _SPECIAL_BYTE if self.blocks else _LINE_END
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
        """Return the end of the block at `head`; just behind the head where it is no block; None: not known yet."""
        digits = self._buffer[head + 2 : head + 2 + self._buffer[head + 1] - ord("0")]
        length = bytes(digits)
        if not length.isdigit() and length:
            return head + 2
        if len(length) < self._buffer[head + 1] - ord("0"):
            return None
        size = int(length)
        # all blocks of a message together may be as long as one block at most
        return head + 2 + len(length) + (size if head + size <= LONGEST_BLOCK else 0)
