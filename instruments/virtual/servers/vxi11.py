"""Instruments over VXI-11, which is remote procedure calls over TCP.

Its port is part of the resource name, or a port mapper at the host has it; see
:mod:`instruments.virtual.servers.port_mapper`.

Source: VXI-11 revision 1.0, TCP/IP Instrument Protocol (section numbers below are its).  No interrupt channel: a client
polls the status byte.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import TYPE_CHECKING

from instruments.virtual.servers.rpc import Program, serve
from instruments.virtual.servers.station import CHUNK, MOST_CLIENTS, Link, Listener
from instruments.virtual.servers.xdr import Reader, packed

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Mapping

    from instruments.virtual.servers.rpc import Procedure
    from instruments.virtual.servers.station import Station

#: Program numbers of the core and the abort channel (B.6, B.7); both are of version 1.
CORE, ABORT, PROGRAM_VERSION = 0x0607AF, 0x0607B0, 1

#: The longest data taken by one device_write, and the longest record around it [bytes].
LONGEST, LONGEST_RECORD = 1 << 20, (1 << 20) + 1024


class Error(IntEnum):
    """What a call answers (B.5.2, table B.2)."""

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
    """How a call is meant (B.5.3)."""

    WAIT_LOCK = 1
    END = 8
    TERMINATION_CHARACTER = 128


class Reason(IntFlag):
    """Why a read has ended (B.6.4)."""

    COUNT = 1
    CHARACTER = 2
    END = 4


@dataclass(eq=False)
class OpenLink:
    """A link that a client has created.  aborted: what it waits for is to be given up."""

    link: Link
    aborted: bool = False


def _program(number: int, procedures: Mapping[int, Procedure]) -> Program:
    return Program(number, PROGRAM_VERSION, procedures, longest=LONGEST_RECORD)


class Vxi11Server:
    """The core and the abort channel of one instrument.  device: the only one it knows."""

    def __init__(self, station: Station, *, device: str = "inst0") -> None:
        self._station, self._device = station, device
        self._links: dict[int, OpenLink] = {}
        self._numbers = itertools.count(1)
        self.core, self.abort = Listener(station, self._talk), Listener(station, self._talk_abort)

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
        """What the link waits for is given up (B.7.1)."""
        found = self._links.get(parameters.number())
        if found is None:
            return packed(Error.INVALID_LINK)
        found.aborted = True
        self._station.stir()
        return packed(Error.NONE)

    def create(self, device: str) -> tuple[Error, int]:
        """A link to the device, by its number."""
        if device.lower() not in {"", self._device}:
            return Error.NOT_ACCESSIBLE, 0
        if len(self._links) >= MOST_CLIENTS:
            return Error.OUT_OF_RESOURCES, 0
        number = next(number for number in (n & 0x7FFFFFFF for n in self._numbers) if number not in self._links)
        self._links[number] = OpenLink(Link(self._station))
        return Error.NONE, number

    def destroy(self, number: int) -> None:
        """The link is gone, and its lock with it."""
        self._links.pop(number).link.close()

    def link(self, number: int) -> OpenLink:
        """The link with this number, which exists."""
        return self._links[number]


class _Connection:
    """One connection to the core channel, and the links that were created by it (they live as long as it does)."""

    def __init__(self, server: Vxi11Server) -> None:
        self._server = server
        self._numbers: set[int] = set()

    async def linger(self) -> None:
        """Let the instrument work on the last commands."""
        for number in self._numbers:
            link = self._server.link(number).link
            await link.linger(link.finished)

    def close(self) -> None:
        for number in self._numbers:
            self._server.destroy(number)

    def procedures(self) -> Mapping[int, Procedure]:
        """The procedures of the core channel (B.6)."""
        return {
            10: self._create_link,
            11: self._device_write,
            12: self._device_read,
            13: self._device_read_status_byte,
            14: self._device_trigger,
            15: self._device_clear,
            16: self._device_remote_or_local,
            17: self._device_remote_or_local,
            18: self._device_lock,
            19: self._device_unlock,
            20: self._device_enable_request,
            22: self._device_do_command,
            23: self._destroy_link,
            25: self._create_interrupt_channel,
            26: self._destroy_interrupt_channel,
        }

    async def _free(self, number: int, flags: int, lock_timeout: int) -> tuple[Error, OpenLink | None]:
        """The link of a call, once nobody else has the instrument locked (B.4.3).  lock_timeout [ms]."""
        if number not in self._numbers:
            return Error.INVALID_LINK, None
        found = self._server.link(number)
        found.aborted = False
        within = lock_timeout / 1000 if flags & Flag.WAIT_LOCK else 0.0
        if await found.link.turn(within, given_up=lambda: found.aborted):
            return Error.NONE, found
        return (Error.ABORT if found.aborted else Error.LOCKED_BY_ANOTHER), None

    async def _create_link(self, parameters: Reader) -> bytes:
        _, wants_lock, lock_timeout = parameters.numbers(3)
        error, number = self._server.create(parameters.opaque().decode("latin-1"))
        if error == Error.NONE:
            self._numbers.add(number)
            if wants_lock and not await self._server.link(number).link.lock(None, lock_timeout / 1000):
                self._forget(number)
                error, number = Error.LOCKED_BY_ANOTHER, 0
        return packed(error, number, self._server.abort.port, LONGEST)

    async def _device_write(self, parameters: Reader) -> bytes:
        number, io_timeout, lock_timeout, flags = parameters.numbers(4)
        data = parameters.opaque()
        if len(data) > LONGEST:
            return packed(Error.PARAMETER, 0)
        error, found = await self._free(number, flags, lock_timeout)
        if found is None:
            return packed(error, 0)
        end = bool(flags & Flag.END)
        if await found.link.write(data, end=end, within=io_timeout / 1000, given_up=lambda: found.aborted):
            return packed(Error.NONE, len(data))
        return packed(Error.ABORT if found.aborted else Error.IO_TIMEOUT, 0)

    async def _device_read(self, parameters: Reader) -> bytes:
        number, count, io_timeout, lock_timeout, flags, character = parameters.numbers(6)
        error, found = await self._free(number, flags, lock_timeout)
        if found is None:
            return packed(error, 0, b"")
        until = bytes([character & 0xFF]) if flags & Flag.TERMINATION_CHARACTER else b""
        if not await self._answered(found, io_timeout / 1000):
            return packed(Error.ABORT if found.aborted else Error.IO_TIMEOUT, 0, b"")
        data, end = found.link.take(min(count, CHUNK), until=until)
        reason = Reason.END * end | Reason.COUNT * (len(data) >= count)
        reason |= Reason.CHARACTER * (bool(until) and data.endswith(until))
        return packed(Error.NONE, reason, data)

    @staticmethod
    async def _answered(found: OpenLink, within: float) -> bool:
        link = found.link
        if link.due() is None and await link.finished(0.0) and link.due() is None:
            link.session.read(0, 0.0)  # who reads what was not asked for finds it in the error queue
        return await link.answered(within, given_up=lambda: found.aborted)

    async def _generic(self, parameters: Reader) -> tuple[Error, OpenLink | None]:
        """The parameters that most calls have: link, flags, and how long to wait for a lock and for data [ms]."""
        number, flags, lock_timeout, _ = parameters.numbers(4)
        return await self._free(number, flags, lock_timeout)

    async def _device_read_status_byte(self, parameters: Reader) -> bytes:
        error, found = await self._generic(parameters)
        if found:
            await found.link.caught_up()
        return packed(error, found.link.status_byte() if found else 0)

    async def _device_trigger(self, parameters: Reader) -> bytes:
        error, found = await self._generic(parameters)
        if found:
            found.link.trigger()
        return packed(error)

    async def _device_clear(self, parameters: Reader) -> bytes:
        error, found = await self._generic(parameters)
        if found:
            found.link.clear()
        return packed(error)

    async def _device_remote_or_local(self, parameters: Reader) -> bytes:
        error, _ = await self._generic(parameters)  # there is no front panel to lock
        return packed(error)

    async def _device_lock(self, parameters: Reader) -> bytes:
        number, flags, lock_timeout = parameters.numbers(3)
        error, found = await self._free(number, flags, lock_timeout)
        if found and not await found.link.lock(None, 0.0):
            error = Error.LOCKED_BY_ANOTHER
        return packed(error)

    async def _device_unlock(self, parameters: Reader) -> bytes:
        number = parameters.number()
        if number not in self._numbers:
            return packed(Error.INVALID_LINK)
        link = self._server.link(number).link
        if not link.holds():
            return packed(Error.NOT_LOCKED)
        link.unlock()
        return packed(Error.NONE)

    async def _device_enable_request(self, parameters: Reader) -> bytes:
        number, _ = parameters.numbers(2)
        return packed(Error.NONE if number in self._numbers else Error.INVALID_LINK)

    async def _device_do_command(self, parameters: Reader) -> bytes:
        return packed(Error.NOT_SUPPORTED, b"")

    async def _destroy_link(self, parameters: Reader) -> bytes:
        number = parameters.number()
        if number not in self._numbers:
            return packed(Error.INVALID_LINK)
        link = self._server.link(number).link
        await link.linger(link.finished)  # the last commands may wait for those of other clients
        self._forget(number)
        return packed(Error.NONE)

    def _forget(self, number: int) -> None:
        self._numbers.remove(number)
        self._server.destroy(number)

    async def _create_interrupt_channel(self, parameters: Reader) -> bytes:
        return packed(Error.NOT_SUPPORTED)

    async def _destroy_interrupt_channel(self, parameters: Reader) -> bytes:
        return packed(Error.CHANNEL_NOT_ESTABLISHED)
