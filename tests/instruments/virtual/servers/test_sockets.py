"""Bare TCP: a line feed ends a message, answers follow each other."""

from support.served import until


def test_many_questions_at_once_are_answered_in_order(served):
    bare = served.bare("socket")
    bare.sendall(b"*OPC?\n" * 1000 + b"*IDN?\n")
    received = b""
    while not received.endswith(b"1.0\n"):
        received += bare.recv(1 << 16)
    assert received == b"1\n" * 1000 + b"levilab,thing,7,1.0\n"


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
