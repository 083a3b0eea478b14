"""Clients that mean no good, and a polite one beside them: whatever they send, it is served.

Each of them goes on until the server ends, so a polite client that they hold up would wait for ever.
"""

import contextlib
import itertools
import socket
import struct
import sys
import threading
from collections import deque

import pytest

from instruments.virtual.servers.clients import MOST_CLIENTS
from instruments.virtual.servers.hislip import HEADER, LONGEST, Type
from support.served import Served, Thing, channels, rpc, until, welcome

WAYS = ("socket", "hislip", "vxi11")


def begin(served, way):
    """A connection on which messages may follow; over VXI-11 with link 1 and more."""
    if way == "hislip":
        return channels(served)[0]
    bare = served.bare(way)
    if way == "vxi11":
        rpc(bare, parameters=struct.pack("!4I8s", 1, 0, 0, 5, b"inst0"))
    return bare


def message(way, text):
    """A message as each protocol wraps it."""
    if way == "socket":
        return text + b"\n"
    if way == "hislip":
        return HEADER.pack(b"HS", Type.DATA_END, 0, 2, len(text)) + text
    call = struct.pack("!15I", 7, 0, 2, 0x0607AF, 1, 11, 0, 0, 0, 0, 1, 1000, 0, 8, len(text)) + text
    call += bytes(-len(text) % 4)
    return struct.pack("!I", 1 << 31 | len(call)) + call


def announce(way, length):
    """The head of a message of this length."""
    heads = {
        "socket": b"BLOC #9%09d" % length,
        "hislip": HEADER.pack(b"HS", Type.DATA_END, 0, 2, length),
        "vxi11": struct.pack("!I", min(length, 0x7FFFFFFF)),
    }
    return heads[way]


#: What comes after the first words, over and over: no client of these reads anything.
ENDLESS = {
    "byte by byte": lambda way: itertools.chain([announce(way, LONGEST - 1)], itertools.repeat(b"x", LONGEST - 2)),
    "huge length": lambda way: itertools.chain([announce(way, 999_999_999)], itertools.repeat(bytes(1 << 16))),
    "commands": lambda way: itertools.repeat(message(way, b"*CLS;*RST;LEV 3") * 100),
    "questions": lambda way: itertools.repeat(message(way, b"BLOC?") * 100),
    "empty lines": lambda way: itertools.repeat(message(way, b"\n" * 10_000)),
}


def send_without_end(connection, way, what):
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.settimeout(None)
    for piece in ENDLESS[what](way):
        connection.sendall(piece)


def leave(connection, way, _):
    connection.sendall(message(way, b"BLOC?") + message(way, b"BLOC #9999999999")[:-5])
    at_once = struct.pack("hh" if sys.platform == "win32" else "ii", 1, 0)  # a reset, and no goodbye
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, at_once)
    connection.close()


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("what", [*ENDLESS, "leaving"])
def test_a_polite_client_is_served_beside_hostile_ones(what, way):
    act, served, rounds, over = leave if what == "leaving" else send_without_end, Served(), deque(), threading.Event()

    def be_hostile():
        while not over.is_set():
            with contextlib.suppress(OSError, EOFError, struct.error):  # it was sent away
                connection = begin(served, way)
                rounds.append(1)
                act(connection, way, what)

    threads = [threading.Thread(target=be_hostile) for _ in range(2)]
    with served.opened:  # which closes what the threads opened, once they have ended
        with served.server:
            polite = [served.open(one) for one in WAYS]
            for thread in threads:
                thread.start()
            until(lambda: len(rounds) >= 2)
            for client in [*polite, served.open(way)]:
                for _ in range(3):
                    assert client.query("*IDN?").strip() == Thing.identity
                client.close()
            over.set()
        for thread in threads:  # the end of the server ends them
            thread.join()


@pytest.mark.parametrize("way", WAYS)
def test_who_says_nothing_makes_way_where_all_places_are_taken(served, way):
    silent = [served.bare(way) for _ in range(MOST_CLIENTS * (2 if way == "hislip" else 1))]
    until(lambda: welcome(served, way))
    assert silent[0].recv(1) == b""
