"""What is fuzzed: functions of bytes that must end, and must not raise.

Each takes any bytes, does with them what a program at the other end of a wire could do, and asserts what must hold
afterwards.  Nothing here knows the fuzzer: tests/instruments/virtual/bench/test_fuzz.py calls the same functions.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import itertools
import struct
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from instruments.ieee488 import BrokenBlock, block_of, read_block
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.session import LinkLost
from instruments.virtual.core.message import Framer, Overrun
from instruments.virtual.servers import hislip, vxi11
from instruments.virtual.servers.clients import Disconnected, ServedInstrument
from instruments.virtual.servers.hislip import Message, Type
from instruments.virtual.servers.rpc import pack
from support import hostile

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True)
class Target:
    """run: what takes the bytes; words: what the fuzzer may build from; seeds: what it begins with."""

    run: Callable[[bytes], None]
    words: tuple[bytes, ...] = ()
    seeds: tuple[bytes, ...] = ()


# --- instruments ---

#: Greatest number of messages of one input, so that only long messages can take long.
_MOST_MESSAGES = 40


def instrument(name: str) -> Target:
    """Feed framer, parser and model with messages, each a line; the first byte says how they come."""

    def run(data: bytes) -> None:
        how, rest = (data[0], data[1:]) if data else (0, b"")
        bench = hostile.Bench(name, stream=bool(how & 1))
        lines = rest.split(b"\n", _MOST_MESSAGES)[:_MOST_MESSAGES]
        size = (how >> 3) or 1 << 20
        for line in lines:
            message = line + b"\n"
            for start in range(0, len(message), size):
                bench.send(message[start : start + size], end=start + size >= len(message))
            if how & 2:
                bench.read(10.0 if how & 4 else 0.01)
        bench.recover()

    device = hostile.instrument(name)
    words = {word.encode("latin-1") for word in (*hostile.headers(device), *hostile.words(device), *hostile.NASTY)}
    questions = [header for header in hostile.headers(device) if header.endswith("?")]
    seeds = [b"\x06" + b"\n".join(header.encode() for header in batch) for batch in _batches(questions, 20)]
    return Target(run, tuple(sorted(word for word in words if len(word) < 60)), tuple(seeds))


def _batches(items: list[str], size: int) -> list[list[str]]:
    return [items[k : k + size] for k in range(0, len(items), size)]


# --- bytes ---


def framer(data: bytes) -> None:
    """Check that the messages are the same however the bytes are cut; the first byte says how."""
    size = (data[0] if data else 0) % 7 + 1
    for blocks in (True, False):
        whole, pieces = Framer(blocks=blocks), Framer(blocks=blocks)
        at_once = whole.feed(data[1:])
        one_by_one = [message for k in range(1, len(data), size) for message in pieces.feed(data[k : k + size])]
        shown = [[repr(m) if isinstance(m, Overrun) else m for m in messages] for messages in (at_once, one_by_one)]
        assert shown[0] == shown[1]
        whole.clear()
        assert whole.feed(b"*IDN?\n") == ["*IDN?"]


def blocks(data: bytes) -> None:
    """Read a block, or get BrokenBlock, and never more than came; both readers agree on what is whole."""
    whole = _block_or_none(lambda: block_of(data))
    stream = io.BytesIO(data)
    streamed = _block_or_none(lambda: read_block(stream.read))
    if streamed is not None:
        assert data.find(streamed) >= 0
        rest = stream.read()
        assert whole == (streamed if not rest.strip(b"\r\n") else None)


def _block_or_none(read: Callable[[], bytes]) -> bytes | None:
    try:
        return read()
    except BrokenBlock:
        return None


# --- servers ---


class Sink:
    """The writing side of a connection that is read at once; counts what is written."""

    def __init__(self) -> None:
        self.count = 0

    def write(self, data: bytes) -> None:
        self.count += len(data)

    async def drain(self) -> None:
        await asyncio.sleep(0)

    def close(self) -> None:
        """Nothing is open."""


class Client:
    """One connection to a server's conversation, without a socket."""

    def __init__(self, talk) -> None:
        self.reader, self.sink = asyncio.StreamReader(limit=1 << 24), Sink()
        self.task = asyncio.ensure_future(self._talk(talk))

    async def _talk(self, talk) -> None:
        with contextlib.suppress(EOFError, Disconnected, LinkLost):  # as the listener has it: the client is gone
            await talk(self.reader, self.sink)

    async def send(self, data: bytes) -> None:
        """Bytes, and time for what they set off."""
        if not self.task.done():
            self.reader.feed_data(data)
        for _ in range(12):
            await asyncio.sleep(0)

    def hang_up(self) -> None:
        """Raise an error: the client is gone."""
        if not self.task.done():
            self.reader.feed_eof()


#: Number of messages to one client after the other, at most.
_MOST_PIECES = 60
#: The instrument behind the servers.
_BEHIND = "33500B"


def _server(converse) -> Callable[[bytes], None]:
    def run(data: bytes) -> None:
        bench = hostile.Bench(_BEHIND)
        bus = VirtualBench({"TCPIP0::box.levilab::inst0::INSTR": bench.device})
        _loop().run_until_complete(converse(ServedInstrument(bus, bench.device), io.BytesIO(data)))
        for client_lock in bus._client_locks.values():
            assert not client_lock.holders, "a lock that its client has left"
        bench.recover()

    return run


_loops: list[asyncio.AbstractEventLoop] = []


def _loop() -> asyncio.AbstractEventLoop:
    """One for all: a new one for each input takes longer than the input."""
    if not _loops:
        _loops.append(asyncio.new_event_loop())
    return _loops[0]


def _pieces(stream: io.BytesIO):
    """(first byte, bytes) pairs: a byte that says what, one for a length, and so much."""
    for _ in range(_MOST_PIECES):
        head = stream.read(2)
        if len(head) < 2:
            return
        yield head[0], stream.read(head[1])


async def _hislip(instrument: ServedInstrument, stream: io.BytesIO) -> None:
    """Two clients with both channels; each piece is a message of one of them, or bare bytes."""
    server = hislip.HislipServer(instrument)
    clients = []
    for number in (1, 2):
        main, aside = Client(server._talk), Client(server._talk)
        clients += [main, aside]
        await main.send(Message(Type.INITIALIZE, 0, 0x01000000, b"hislip0").pack())
        await aside.send(Message(Type.ASYNC_INITIALIZE, 0, number).pack())
    for what, data in _pieces(stream):
        client = clients[what & 3]
        if what & 4:
            await client.send(data)
        else:
            kind, control, parameter = struct.unpack("!BBI", data[:6].ljust(6, b"\0"))
            # the high bits choose among the types that there are
            kind = kind if what & 8 else [*Type][kind % len(Type)]
            await client.send(Message(kind, control, parameter, data[6:]).pack())
    await _ended(clients)
    assert not server._clients


async def _vxi11(instrument: ServedInstrument, stream: io.BytesIO) -> None:
    """Two clients of the core channel and one of the abort channel; each piece is a call, or bare bytes."""
    server = vxi11.Vxi11Server(instrument)
    clients = [Client(server._talk), Client(server._talk), Client(server._talk_abort)]
    for number, client in enumerate(clients[:2]):
        await client.send(_call(number, vxi11.CORE, 10, pack(0, 0, 0, b"inst0")))
    serial = itertools.count()
    for what, data in _pieces(stream):
        client = clients[(what & 3) % 3]
        if what & 4:
            await client.send(data)
        else:
            program = vxi11.ABORT if client is clients[2] else vxi11.CORE
            await client.send(_call(next(serial), program, data[0] if data else 0, data[1:]))
    await _ended(clients)
    assert not server.links


def _call(number: int, program: int, procedure: int, parameters: bytes) -> bytes:
    record = pack(number, 0, 2, program, vxi11.PROGRAM_VERSION, procedure, 0, b"", 0, b"") + parameters
    return struct.pack("!I", 1 << 31 | len(record)) + record


async def _ended(clients: list[Client]) -> None:
    """All conversations end with their clients.  Raises what one of them has raised."""
    for client in clients:
        client.hang_up()
    async with asyncio.timeout(20):
        await asyncio.gather(*(client.task for client in clients))


def _piece(what: int, data: bytes) -> bytes:
    return bytes([what, len(data)]) + data


_HISLIP_SEEDS = (
    _piece(0, struct.pack("!BBI", 7, 0, 0xFFFFFF00) + b"*IDN?\n") + _piece(1, struct.pack("!BBI", 20, 1, 0xFFFFFF00)),
    _piece(1, struct.pack("!BBI", 4, 1, 100) + b"key") + _piece(3, struct.pack("!BBI", 4, 1, 0)) + _piece(1, b"\x04"),
    _piece(1, struct.pack("!BBI", 19, 0, 0)) + _piece(0, struct.pack("!BBI", 8, 0, 0)),
    _piece(1, struct.pack("!BBI", 15, 0, 0) + (64).to_bytes(8)) + _piece(0, struct.pack("!BBI", 7, 0, 0) + b"APPL?\n"),
)
_VXI11_SEEDS = (
    _piece(0, b"\x0b" + pack(1, 100, 0, 8, b"*IDN?\n")) + _piece(0, b"\x0c" + pack(1, 99, 100, 0, 0, 0)),
    _piece(0, b"\x12" + pack(1, 0, 0)) + _piece(1, b"\x0b" + pack(2, 9, 9, 9, b"*RST\n")),
    _piece(0, b"\x0d" + pack(1, 0, 0, 0)) + _piece(2, b"\x01" + pack(1)) + _piece(0, b"\x17\0\0\0\1"),
    *(_piece(0, bytes([procedure]) + pack(1, 0, 0, 0, 0, 0)) for procedure in (14, 15, 16, 19, 20, 22, 25, 26)),
)

TARGETS: dict[str, Callable[[], Target]] = {
    **{name: (lambda name=name: instrument(name)) for name in hostile.NAMES},
    "framer": lambda: Target(framer, (b"#13abc", b"#", b'"', b"'", b"\n", b",#216"), (b"\0DATA #12\n\n\nFR",)),
    "blocks": lambda: Target(blocks, (b"#13", b"#800000003", b"\r\n"), (b"#13a\nb\n", b"#800000003abc\r\n")),
    "hislip": lambda: Target(_server(_hislip), (b"HS", b"*IDN?\n"), _HISLIP_SEEDS),
    "vxi11": lambda: Target(_server(_vxi11), (b"*IDN?\n", b"inst0", pack(1)), _VXI11_SEEDS),
}
