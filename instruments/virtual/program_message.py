"""Program messages taken apart: their units, the headers of these with the path before them, and parameters.

Source: SCPI-1999, volume 1, 6.2.4 (compound messages with path memory); IEEE 488.2, 7.7.6 (blocks).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

#: White space is every control character and the space (IEEE 488.2, 7.4.1.2), and no other sign of Latin-1.
_BLANK, _DIGITS = "".join(map(chr, range(0x21))), re.compile("[0-9]+")
_UNIT = re.compile(r"([^\x00-\x20]+)[\x00-\x20]*(.*)", re.DOTALL)
_SPECIAL = re.compile(r"[\"'();,]|(?<![^\x00-\x20,])#[1-9]")


def split_units(message: str) -> Iterator[str]:
    """The units of a compound message: split at semicolons outside of quotes and blocks.

    >>> list(split_units('FREQ 40; DISP:TEXT "a;b"'))
    ['FREQ 40', 'DISP:TEXT "a;b"']
    """
    return filter(None, _split(message, ";"))


def read_unit(unit: str, path: str) -> tuple[str, str, str]:
    """The full header of a unit, the text of its parameters, and the path that the next unit starts from.

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


def split_parameters(text: str) -> list[str]:
    """The parameters of a unit: split at commas outside of quotes, parentheses and blocks.

    >>> split_parameters("25, MAX, (@1,2)")
    ['25', 'MAX', '(@1,2)']
    >>> split_parameters("ARB1,#13,;,")
    ['ARB1', '#13,;,']
    """
    return list(_split(text, ",")) if text.strip(_BLANK) else []


def _split(text: str, separator: str) -> Iterator[str]:
    """The pieces between separators, blanks taken away, but not those that are the bytes of a block."""
    start = looked = block_end = depth = 0
    while found := _SPECIAL.search(text, looked):
        what, looked = found[0], found.end()
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
    kept = max(start, min(block_end, end))
    return (text[start:kept] + text[kept:end].rstrip(_BLANK)).lstrip(_BLANK)


def _end_of_block(text: str, head: int) -> int:
    """Where a definite-length block ends whose # stands at head; just behind the # if it is none."""
    data = head + 2 + int(text[head + 1])
    length = text[head + 2 : data]
    return min(len(text), data + int(length)) if _DIGITS.fullmatch(length) else head + 1
