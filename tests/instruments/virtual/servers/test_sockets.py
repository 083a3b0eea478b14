"""Bare TCP: a line feed ends a message, answers follow each other."""

import socket

from support.served import AT_MOST, until


def test_many_questions_at_once_are_answered_in_order(served):
    bare = served.bare("socket")
    bare.sendall(b"*OPC?\n" * 1000 + b"*IDN?\n")
    received = b""
    while not received.endswith(b"1.0\n"):
        received += bare.recv(1 << 16)
    assert received == b"1\n" * 1000 + b"levilab,thing,7,1.0\n"


def test_bytes_may_come_one_by_one(served):
    bare = served.bare("socket")
    bare.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for byte in b"*OPC?\r\n":
        bare.sendall(bytes([byte]))
    assert bare.recv(10) == b"1\n"


def test_who_has_said_all_still_gets_the_answer(served, monkeypatch):
    monkeypatch.setattr("instruments.virtual.servers.clients.LINGER", AT_MOST)
    bare = served.bare("socket")
    bare.sendall(b"*IDN?\n")
    bare.shutdown(socket.SHUT_WR)
    assert bare.recv(100) == b"levilab,thing,7,1.0\n"
    assert bare.recv(100) == b""


def test_a_flood_of_questions_without_reading_is_held_back(served):
    bare = served.bare("socket")
    bare.setblocking(False)
    until(lambda: served.thing.blocks or not flooded(bare))
    until(lambda: not flooded(bare))  # the server takes no more
    assert served.open("hislip").query("*OPC?").strip() == "1"
    assert served.thing.blocks < 10  # as many as fit into the system's buffers


def flooded(bare):
    """Whether the other side took some more questions."""
    try:
        return bare.send(b"BLOC?\n" * 10_000) > 0
    except BlockingIOError:
        return False
