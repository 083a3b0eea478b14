"""Programs that mean no good, and a page beside them: whatever they send, the page gets its frames.

Each of them goes on until the page has what it asked for, so a page that they hold up would wait for ever.
"""

import contextlib
import socket
import struct
import sys
import threading
from collections import deque
from itertools import repeat

import pytest
from websockets.sync.client import connect

from support.live_pages import PATIENCE_S, GrowingRun, address, request, serving, spin_down, wait_for

UPGRADE = (
    "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: MDEyMzQ1Njc4OTAxMjM0NQ==\r\n\r\n"
)
ASK, HUGE = b"\x81\x82\0\0\0\0{}", b"\x81\xff" + bytes([0x3F] * 8)  # frames of text, the first with a mask of zeros
#: Of a socket: it is closed by a reset, without a goodbye.
AT_ONCE = struct.pack("hh" if sys.platform == "win32" else "ii", 1, 0)
REQUEST = b"GET /runs HTTP/1.1\r\nHost: a\r\n\r\n"

#: The first line, the rest of the head, and what is sent then, over and over; no answer is read.
ENDLESS = {
    "nothing": ("GET /", "", ()),
    "byte by byte": ("GET /", "X-Slow: ", repeat(b"x")),
    "huge length": ("POST /do", f"Content-Length: {1 << 40}\r\n\r\n", repeat(bytes(1 << 16))),
    "requests": ("GET /page/three.js", "\r\n", repeat(REQUEST * 20)),
    "questions": ("GET /frames", UPGRADE, repeat(ASK * 100)),
    "a huge frame": ("GET /frames", UPGRADE, repeat(HUGE)),
}


@pytest.fixture(scope="module")
def hall(tmp_path_factory):
    root = tmp_path_factory.mktemp("runs")
    GrowingRun(root, "one").readings(spin_down(19))
    with serving(root) as hall:
        yield hall


def be_hostile(port, what, begun, over):
    """Connect and send without end, or leave at once and come again."""
    first, head, pieces = ENDLESS["requests" if what == "leaving" else what]
    while not over.is_set():
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)) as connection:
            connection.sendall(f"{first} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{head}".encode())
            begun.append(connection)
            if what == "leaving":
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, AT_ONCE)
                continue
            for piece in pieces:
                connection.sendall(piece)
            over.wait()


@pytest.mark.parametrize("what", [*ENDLESS, "leaving"])
def test_a_page_gets_its_frames_beside_hostile_programs(hall, what):
    begun = deque()
    over = threading.Event()
    threads = [threading.Thread(target=be_hostile, args=(hall.doors.port, what, begun, over)) for _ in range(3)]
    for thread in threads:
        thread.start()
    wait_for(lambda: len(begun) >= len(threads))
    origin = address(hall).rstrip("/")
    with connect(origin.replace("http", "ws") + "/frames?run=one", origin=origin, open_timeout=PATIENCE_S) as page:
        for _ in range(3):
            page.send("{}")
            assert page.recv(PATIENCE_S)
    assert request(address(hall), "/")[0] == request(address(hall), "/runs")[0] == 200
    over.set()
    while any(thread.is_alive() for thread in threads):
        for connection in list(begun):  # one may have been made a moment ago
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)  # a write that waits ends
        threads[0].join(0.05)
