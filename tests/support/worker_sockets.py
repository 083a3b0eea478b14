"""Worker processes that speak to their test over a socket, and are waited for with a deadline that fails the test."""

import contextlib
import socket

#: What a test of workers waits for takes a second or two: the start of a process, or its end [s].
DEADLINE_S = 180.0
Address = tuple[str, int]


@contextlib.contextmanager
def listening():
    """Yield a socket to which workers speak; `accept` raises TimeoutError where none comes."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(DEADLINE_S)
        yield server


@contextlib.contextmanager
def worker_at_work(server):
    """Yield the conversation with the next worker that has begun its task.  Raises TimeoutError."""
    conversation, _ = server.accept()
    with conversation:
        conversation.settimeout(DEADLINE_S)
        assert conversation.recv(1) == b"!"
        yield conversation


def assert_dead(conversation):
    """Fail unless the process at the other end has ended: the operating system closes its conversations then."""
    with contextlib.suppress(ConnectionError):
        assert conversation.recv(1) == b""


def say_and_wait(address):
    """Say that this process is at work, and wait until the other side ends the conversation."""
    with contextlib.suppress(ConnectionError), socket.create_connection(address) as conversation:
        conversation.sendall(b"!")
        conversation.recv(1)
