"""Instruments over VXI-11, which is remote procedure calls over TCP.

Its port is part of the resource name, or a port mapper at the host has it; see
:mod:`instruments.virtual.servers.port_mapper`.

Source: VXI-11 revision 1.0, TCP/IP Instrument Protocol (section numbers below are its).  No interrupt channel: a client
polls the status byte.
"""

import asyncio
import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from instruments.virtual.servers.clients import CHUNK, MOST_CLIENTS, Link, Listener, ServedInstrument
from instruments.virtual.servers.rpc import Procedure, Program, Reader, pack, serve

#: Program numbers of the core and the abort channel (B.6, B.7); both are of version 1.
CORE, ABORT, PROGRAM_VERSION = 0x0607AF, 0x0607B0, 1

#: The longest data taken by one device_write, and the longest record around it [bytes].
LONGEST, LONGEST_RECORD = 1 << 20, (1 << 20) + 1024


class Error(IntEnum):
    """Error codes in the answer to a call (B.5.2, table B.2)."""

    NONE = 0
    NOT_ACCESSIBLE = 3
    INVALID_LINK = 4
    PARAMETER = 5
    CHANNEL_NOT_ESTABLISHED = 6
    NOT_SUPPORTED = 8
    OUT_OF_RESOURCES = 9
    LOCKED_BY_ANOTHER = 11
    NOT_LOCKED = 12
    IO_TIMEOUT = 15
    ABORT = 23


class Flag(IntFlag):
    """Flags of a call (B.5.3)."""

    WAIT_LOCK = 1
    END = 8
    TERMINATION_CHARACTER = 128


class Reason(IntFlag):
    """Why a read ended (B.6.4)."""

    COUNT = 1
    CHARACTER = 2
    END = 4


@dataclass(eq=False)
class OpenLink:
    """A link that a client has created.  aborted: whether the call that waits on it shall end."""

    link: Link
    aborted: bool = False


def _program(number: int, procedures: Mapping[int, Procedure]) -> Program:
    return Program(number, PROGRAM_VERSION, procedures, longest=LONGEST_RECORD)


class Vxi11Server:
    """The core and the abort channel of one instrument, whose only device is inst0."""

    def __init__(self, instrument: ServedInstrument) -> None:
        self._instrument = instrument
        self.links: dict[int, OpenLink] = {}
        self._numbers = itertools.count(1)
        self.core, self.abort = Listener(instrument, self._talk), Listener(instrument, self._talk_abort)

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        connection = _Connection(self)
        try:
            await serve(_program(CORE, connection.procedures()), reader, writer)
        except EOFError:
            await connection.linger()
            raise
        finally:
            connection.close()

    async def _talk_abort(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await serve(_program(ABORT, {1: self._device_abort}), reader, writer)

    async def _device_abort(self, parameters: Reader) -> bytes:
        """End the call that waits on a link (B.7.1)."""
        found = self.links.get(parameters.number())
        if found is None:
            return pack(Error.INVALID_LINK)
        found.aborted = True
        self._instrument.notify()
        return pack(Error.NONE)

    def create(self, device: str) -> tuple[Error, int]:
        """Create a link to the device.  Returns an error code, and the number of the link."""
        if device.lower() not in {"", "inst0"}:
            return Error.NOT_ACCESSIBLE, 0
        if len(self.links) >= MOST_CLIENTS:
            return Error.OUT_OF_RESOURCES, 0
        number = next(number for number in (n & 0x7FFFFFFF for n in self._numbers) if number not in self.links)
        self.links[number] = OpenLink(Link(self._instrument))
        return Error.NONE, number


class _Connection:
    """One connection to the core channel, and the links that it has created, which end with it."""

    def __init__(self, server: Vxi11Server) -> None:
        self._server = server
        self._links: dict[int, OpenLink] = {}

    async def linger(self) -> None:
        """Wait until the instrument has worked on the last commands."""
        for found in self._links.values():
            await found.link.linger(found.link.wait_until_done)

    def close(self) -> None:
        for number in list(self._links):
            self._forget(number)

    def _forget(self, number: int) -> None:
        self._links.pop(number)
        self._server.links.pop(number).link.close()

    def procedures(self) -> Mapping[int, Procedure]:
        """Return the procedures of the core channel (B.6)."""
        return {
            10: self._create_link,
            11: self._device_write,
            12: self._device_read,
            13: self._device_read_status_byte,
            14: self._once_unlocked(Link.trigger),
            15: self._once_unlocked(Link.clear),
            16: self._once_unlocked(),  # remote and local: there is no front panel to lock
            17: self._once_unlocked(),
            18: self._device_lock,
            19: self._device_unlock,
            20: self._device_enable_request,
            22: _always(Error.NOT_SUPPORTED, b""),  # device_docmd
            23: self._destroy_link,
            25: _always(Error.NOT_SUPPORTED),  # create_intr_chan
            26: _always(Error.CHANNEL_NOT_ESTABLISHED),  # destroy_intr_chan
        }

    async def _wait_for_lock(self, number: int, flags: int, lock_timeout: int) -> tuple[Error, OpenLink | None]:
        """Wait until no other link has the instrument locked (B.4.3).

        Args:
            number: of the link.
            flags: of the call; without WAIT_LOCK it does not wait.
            lock_timeout: how long at most [ms].

        Returns:
            An error code, and the link where there is no error.
        """
        if (found := self._links.get(number)) is None:
            return Error.INVALID_LINK, None
        found.aborted = False
        timeout = lock_timeout / 1000 if flags & Flag.WAIT_LOCK else 0.0
        if await found.link.wait_unlocked(timeout, give_up=lambda: found.aborted):
            return Error.NONE, found
        return (Error.ABORT if found.aborted else Error.LOCKED_BY_ANOTHER), None

    async def _create_link(self, parameters: Reader) -> bytes:
        _, wants_lock, lock_timeout = parameters.numbers(3)
        error, number = self._server.create(parameters.opaque().decode("latin-1"))
        if error == Error.NONE:
            found = self._links[number] = self._server.links[number]
            if wants_lock and not await found.link.lock(None, lock_timeout / 1000):
                self._forget(number)
                error, number = Error.LOCKED_BY_ANOTHER, 0
        return pack(error, number, self._server.abort.port, LONGEST)

    async def _device_write(self, parameters: Reader) -> bytes:
        number, io_timeout, lock_timeout, flags = parameters.numbers(4)
        data = parameters.opaque()
        if len(data) > LONGEST:
            return pack(Error.PARAMETER, 0)
        error, found = await self._wait_for_lock(number, flags, lock_timeout)
        if found is None:
            return pack(error, 0)
        end = bool(flags & Flag.END)
        if await found.link.write(data, end=end, timeout=io_timeout / 1000, give_up=lambda: found.aborted):
            return pack(Error.NONE, len(data))
        return pack(Error.ABORT if found.aborted else Error.IO_TIMEOUT, 0)

    async def _device_read(self, parameters: Reader) -> bytes:
        number, count, io_timeout, lock_timeout, flags, character = parameters.numbers(6)
        error, found = await self._wait_for_lock(number, flags, lock_timeout)
        if found is None:
            return pack(error, 0, b"")
        until = bytes([character & 0xFF]) if flags & Flag.TERMINATION_CHARACTER else b""
        if not await self._wait_for_answer(found, io_timeout / 1000):
            return pack(Error.ABORT if found.aborted else Error.IO_TIMEOUT, 0, b"")
        data, end = found.link.take(min(count, CHUNK), until=until)
        reason = Reason.END * end | Reason.COUNT * (len(data) >= count)
        reason |= Reason.CHARACTER * (bool(until) and data.endswith(until))
        return pack(Error.NONE, reason, data)

    @staticmethod
    async def _wait_for_answer(found: OpenLink, timeout: float) -> bool:
        link = found.link
        if (
            link.seconds_until_ready() is None
            and await link.wait_until_done(0.0)
            and link.seconds_until_ready() is None
        ):
            link.session.read(0, 0.0)  # queues error −420: a read without a question
        return await link.wait_for_answer(timeout, give_up=lambda: found.aborted)

    async def _generic(self, parameters: Reader) -> tuple[Error, OpenLink | None]:
        """Read the parameters that most calls have (link, flags, times for lock and data [ms]); wait for the lock."""
        number, flags, lock_timeout, _ = parameters.numbers(4)
        return await self._wait_for_lock(number, flags, lock_timeout)

    async def _device_read_status_byte(self, parameters: Reader) -> bytes:
        error, found = await self._generic(parameters)
        if found:
            await found.link.catch_up()
        return pack(error, found.link.status_byte() if found else 0)

    def _once_unlocked(self, act: Callable[[Link], None] = lambda _link: None) -> Procedure:
        """Return a procedure that does this with its link, once no other link has the instrument locked."""

        async def procedure(parameters: Reader) -> bytes:
            error, found = await self._generic(parameters)
            if found:
                act(found.link)
            return pack(error)

        return procedure

    async def _device_lock(self, parameters: Reader) -> bytes:
        number, flags, lock_timeout = parameters.numbers(3)
        error, found = await self._wait_for_lock(number, flags, lock_timeout)
        if found and not await found.link.lock(None, 0.0):
            error = Error.LOCKED_BY_ANOTHER
        return pack(error)

    async def _device_unlock(self, parameters: Reader) -> bytes:
        if (found := self._links.get(parameters.number())) is None:
            return pack(Error.INVALID_LINK)
        if not found.link.has_lock():
            return pack(Error.NOT_LOCKED)
        found.link.unlock()
        return pack(Error.NONE)

    async def _device_enable_request(self, parameters: Reader) -> bytes:
        number, _ = parameters.numbers(2)
        return pack(Error.NONE if number in self._links else Error.INVALID_LINK)

    async def _destroy_link(self, parameters: Reader) -> bytes:
        number = parameters.number()
        if (found := self._links.get(number)) is None:
            return pack(Error.INVALID_LINK)
        await found.link.linger(found.link.wait_until_done)  # the last commands may wait for those of other clients
        self._forget(number)
        return pack(Error.NONE)


def _always(*results: int | bytes) -> Procedure:
    """Return a procedure with the same results whatever its parameters."""

    async def procedure(_: Reader) -> bytes:
        return pack(*results)

    return procedure
