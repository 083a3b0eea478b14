"""Instruments that answer requests over HTTP, as an app on a phone does: one request, one answer, a connection each."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from instruments.virtual.servers.clients import CHUNK, FIRST_WORDS, Disconnected, Link, Listener

if TYPE_CHECKING:
    from instruments.virtual.servers.clients import ServedInstrument


def http_listener(instrument: ServedInstrument) -> Listener:
    """Return a listener that serves an instrument over HTTP."""

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            async with asyncio.timeout(FIRST_WORDS):
                head = await reader.readuntil(b"\r\n\r\n")
        except (TimeoutError, asyncio.LimitOverrunError, asyncio.IncompleteReadError):
            raise Disconnected from None
        link = Link(instrument)
        try:
            await link.write(head.partition(b"\r\n")[0])
            ended = False
            while not ended and await link.wait_for_answer(give_up=link.is_idle):
                data, ended = link.take(CHUNK)
                writer.write(data)
                await writer.drain()
        finally:
            link.close()

    return Listener(instrument, talk)
