"""A serial line over TCP, as a terminal server or a converter offers it."""

import socket
import struct

import pytest

from instruments.errors import NotConnected
from instruments.links.opening import open_link


@pytest.fixture
def converter():
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = open_link(f"socket://127.0.0.1:{server.getsockname()[1]}")
        far_end, _ = server.accept()
        with far_end:
            yield transport, far_end
        transport.close()


def test_a_message_behind_one_without_an_answer_is_sent_at_once(converter):
    transport, _ = converter
    transport.lock()  # sockets have none
    assert transport.port.connection().getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_converter_that_hung_up_is_called_again(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = open_link(f"socket://127.0.0.1:{server.getsockname()[1]}")
        first, _ = server.accept()
        first.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        first.close()
        with pytest.raises(NotConnected):
            transport.query("RDGFIELD?")
        monkeypatch.setattr(transport, "_resynchronise", lambda: None)  # no instrument answers here
        transport.write("UNIT 2")
        second, _ = server.accept()
        with second:
            assert second.recv(100) == b"UNIT 2\n"
        transport.close()


def test_closing_leaves_nothing_open_when_the_other_side_has_hung_up(converter):
    transport, far_end = converter
    link = transport.port.connection()
    far_end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # hang up hard, with a reset
    far_end.close()
    with pytest.raises(NotConnected):
        transport.query("*IDN?")
    transport.close()
    assert link.fileno() == -1
