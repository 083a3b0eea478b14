"""The forms of IEEE 488.2 answers: definite-length blocks, numbers, the identity.

A block is ``#``, one digit n, n digits that say how many bytes follow, and these bytes, of any value, line feeds
included (IEEE 488.2-1992, 8.7.9).
"""

import functools
import io
import re
from collections.abc import Callable
from dataclasses import dataclass

#: No instrument of a bench sends more at once [bytes]; a head that says so is noise on the line.
LONGEST_BLOCK = 1 << 28

_HEAD = re.compile(rb"#([1-9])")


class BrokenBlock(Exception):
    """The bytes are no block, or not all of one.  seen: a description of them."""

    def __init__(self, seen: str) -> None:
        self.seen = seen
        super().__init__(seen)


@dataclass(frozen=True)
class BlockForm:
    """What stands around a block.

    longest_head: signs of a header before it (Siglent: ``C1:WF DAT2,#9…``), none by IEEE 488.2; ends: line feeds
    behind it.
    """

    longest_head: int = 0
    ends: int = 1


#: As IEEE 488.2 has it.
PLAIN_BLOCK = BlockForm()


def read_block(read: Callable[[int], bytes], form: BlockForm = PLAIN_BLOCK) -> bytes:
    r"""Return the block at the head of a stream, and the line end behind it.

    read: returns the number of bytes asked for, or fewer if no more come; form: of head and end.  Raises BrokenBlock.

    >>> import io
    >>> read_block(io.BytesIO(b"#15a,\x0a,b\n").read)
    b'a,\n,b'
    """
    head = _after_header(read, form.longest_head) if form.longest_head else read(2)
    if not _HEAD.fullmatch(head):
        raise BrokenBlock(repr(head))
    size = _size(head, read(head[1] - ord("0")))
    block = read(size)
    if len(block) < size:
        raise BrokenBlock(f"{len(block)} bytes of a block of {size}")
    for _ in range(form.ends):
        _read_end(read, size)
    return block


def _read_end(read: Callable[[int], bytes], size: int) -> None:
    end = read(1)
    if end == b"\r":
        end = read(1)
    if end != b"\n":
        raise BrokenBlock(f"a block of {size} bytes that goes on with {end!r}")


def _after_header(read: Callable[[int], bytes], longest: int) -> bytes:
    """Return the first two bytes of a block behind a header of this length at most."""
    header = b""
    while len(header) <= longest:
        sign = read(1)
        if sign == b"#":
            return sign + read(1)
        header += sign
        if not b" " <= sign <= b"~":
            break
    raise BrokenBlock(repr(header))


def block(data: bytes, digits: int = 0) -> bytes:
    """Return a definite-length block, without a line end.  digits: of its length, by default as few as it needs.

    >>> block(b"abc"), block(b""), block(b"abc", digits=9)
    (b'#13abc', b'#10', b'#9000000003abc')
    """
    size = f"{len(data):0{digits}d}" if digits else str(len(data))
    return f"#{len(size)}{size}".encode() + data


def block_of(message: bytes, form: BlockForm = PLAIN_BLOCK) -> bytes:
    r"""Return the bytes of a block that came as a whole message.  Raises BrokenBlock.

    The line feed behind the block is part of an answer (IEEE 488.2, 8.7.9): without it a block that lost a byte on its
    way would be taken for whole, with the line feed as its last byte.

    >>> block_of(b"#13\x00\x0a\xff\n")
    b'\x00\n\xff'
    """
    stream = io.BytesIO(message)
    block = read_block(stream.read, form)
    if rest := stream.read().strip(b"\r\n"):
        raise BrokenBlock(f"a block of {len(block)} bytes that goes on with {rest[:20]!r}")
    return block


def _size(head: bytes, digits: bytes) -> int:
    if len(digits) != head[1] - ord("0") or not digits.isdigit():
        raise BrokenBlock(repr(head + digits))
    size = int(digits)
    if size > LONGEST_BLOCK:
        raise BrokenBlock(f"{(head + digits).decode()}, which announces {size} bytes")
    return size


@dataclass(frozen=True)
class Form:
    """The form in which an instrument prints an answer.

    An answer that came for another question, or that lost a byte on the line, is recognised by its form only: the
    narrower the form, the fewer of them pass.

    pattern: a regular expression that the whole answer matches, in ASCII; example: an answer in this form; suffix:
    what follows a number, its unit.

    >>> NR3.number("+2.5E+01"), NR1.matches("1_0"), NR1.matches("\u0661")
    (25.0, False, False)
    """

    pattern: str
    example: str
    suffix: str = ""

    def matches(self, answer: str) -> bool:
        """Return whether the whole answer has this form."""
        return _compile(self.pattern).fullmatch(answer) is not None

    def number(self, answer: str) -> float:
        """Return the number in an answer of this form.  Raises ValueError."""
        if self.suffix:
            found = _compile(f"({self.pattern}){self.suffix}").fullmatch(answer)
            answer = found[1] if found else ""
        if not self.matches(answer):
            raise ValueError(answer)
        return float(answer)


@functools.cache
def _compile(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern, re.ASCII)


#: Numeric response data (IEEE 488.2-1992, 8.7.2 to 8.7.4): a whole number, one with a point, one with an exponent, and
#: any of them.
NR1 = Form(r"[+-]?\d{1,15}", "+12")
NR2 = Form(r"[+-]?\d+\.\d+", "+12.5")
NR3 = Form(r"[+-]?\d+\.\d+[Ee][+-]\d{1,3}", "+1.25E+01")
NUMERIC = Form(f"{NR1.pattern}|{NR2.pattern}|{NR3.pattern}", NR3.example)

#: Fields of an identity (IEEE 488.2-1992, 10.14.3).
IDENTITY_FIELDS = ("maker", "model", "serial number", "firmware")


def identity_fields(answer: str) -> tuple[str, ...]:
    """Return maker, model, serial number and firmware of an answer to ``*IDN?``.

    Raises ValueError where there are not four fields, where maker or model is empty, or where it is no plain text.

    >>> identity_fields("LSCI,MODEL425, VIRTUAL,1.0")
    ('LSCI', 'MODEL425', 'VIRTUAL', '1.0')
    """
    fields = tuple(field.strip() for field in answer.split(","))
    if len(fields) != len(IDENTITY_FIELDS) or not all(fields[:2]) or not (answer.isascii() and answer.isprintable()):
        raise ValueError(answer)
    return fields


#: What SCPI instruments send when there is no reading, and for infinity (SCPI-1999, vol. 1, 7.2.1).
NOT_A_NUMBER, INFINITY = 9.91e37, 9.9e37
