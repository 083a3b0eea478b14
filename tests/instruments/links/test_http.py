"""The link over HTTP: whatever answers at that port, an error comes in time, or the whole document."""

import socket
import threading
import time

import pytest

from instruments.errors import BadAnswer, InstrumentError, NoAnswer, NotConnected
from instruments.links import http
from instruments.links.http import HttpTransport
from instruments.links.opening import open_link

OK = b"HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhello"


class Server:
    """Sends these pieces to each client, with a pause between them [s]; then closes, or not."""

    def __init__(self, *pieces, pause=0.0, closes=True):
        self._pieces, self._pause, self._closes = pieces, pause, closes
        self.requests = []
        self._kept = []
        self._ended = threading.Event()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = self._listening.getsockname()[1]
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_error):
        self._ended.set()
        socket.create_connection(("127.0.0.1", self.port)).close()
        self._thread.join()
        self._listening.close()
        for link in self._kept:
            link.close()

    def _serve(self):
        while True:
            link, _ = self._listening.accept()
            if self._ended.is_set():
                link.close()
                return
            self._kept.append(link)
            self.requests.append(link.recv(4096))
            try:
                for piece in self._pieces:
                    link.sendall(piece)
                    if self._ended.wait(self._pause):
                        return
            except OSError:
                continue  # the client has left
            if self._closes:
                link.close()


def link_to(server, timeout=0.5, **options):
    return HttpTransport(f"phyphox://127.0.0.1:{server.port}", port=80, advice="try this", timeout=timeout, **options)


@pytest.mark.parametrize(
    "pieces",
    [
        (OK,),
        tuple(bytes([byte]) for byte in OK),
        (b"HTTP/1.0 200 OK\r\n\r\nhello",),
        (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n",),
    ],
)
def test_a_document_comes_whole(pieces):
    with Server(*pieces) as server:
        assert link_to(server).query("/get?a=1%7Cb") == "hello"
    assert server.requests[0].startswith(b"GET /get?a=1%7Cb HTTP/1.1\r\nHost: 127.0.0.1:")
    assert b"Connection: close" in server.requests[0]


def test_a_document_of_stated_length_needs_no_end_of_the_connection():
    with Server(OK, closes=False) as server:
        assert link_to(server).query("/") == "hello"


@pytest.mark.parametrize(
    ("pieces", "error"),
    [
        ((), NotConnected),
        ((b"SSH-2.0-OpenSSH_9.2\r\n",), BadAnswer),
        ((b"\x00\xff" * 50,), BadAnswer),
        ((OK[:-2],), BadAnswer),
        ((OK[:20],), BadAnswer),
        ((b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n",), BadAnswer),
        ((b"HTTP/1.1 302 Found\r\nLocation: http://elsewhere/\r\n\r\n",), BadAnswer),
        ((b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n\xff\xfe",), BadAnswer),
        ((b"HTTP/1.1 200 OK\r\n" + b"A: b\r\n" * 200 + b"\r\n",), BadAnswer),
        ((b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",), BadAnswer),
    ],
)
def test_anything_else_is_an_error(pieces, error):
    with Server(*pieces) as server, pytest.raises(error):
        link_to(server).query("/get")


def test_a_page_that_is_not_there_is_no_fault_of_a_cable():
    with Server(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n") as server, pytest.raises(BadAnswer) as caught:
        link_to(server).query("/get")
    assert str(caught.value).endswith("expected 200 OK: try this")


def test_silence_and_an_answer_that_drips_end_with_the_time_out():
    for server in (Server(closes=False), Server(*([b"HTTP/1.1 200 OK\r\n"] + [b"A"] * 1000), pause=0.02)):
        with server:
            began = time.monotonic()
            with pytest.raises(NoAnswer, match=r"within 0\.2 s"):
                link_to(server, timeout=0.2).query("/get")
        assert time.monotonic() - began < 2.0  # of which 0.2 s are the time-out


def test_an_answer_without_end_is_cut_off(monkeypatch):
    monkeypatch.setattr(http, "LONGEST_ANSWER", 1 << 16)
    with Server(b"HTTP/1.1 200 OK\r\n\r\n", *[b"x" * 50_000] * 10) as server, pytest.raises(BadAnswer, match="65536"):
        link_to(server).query("/get")


def test_where_nothing_listens_the_error_says_what_to_do_in_the_app():
    with Server() as server:
        pass
    link = open_link(f"phyphox://127.0.0.1:{server.port}", line={})
    with pytest.raises(NotConnected) as refused:
        link.query("/meta")
    text = str(refused.value)
    assert f"nothing answers at http://127.0.0.1:{server.port} (" in text
    assert "menu ⋮ → Allow remote access; the address stands at the bottom of the screen" in text


@pytest.mark.parametrize(
    ("address", "url"),
    [("phyphox://Händy.fritz.box", "http://xn--hndy-loa.fritz.box:8080"), ("phyphox://[::1]:80", "http://[::1]:80")],
)
def test_a_host_is_written_as_http_wants_it(address, url):
    sent = []

    class Library:
        def connect(self, _):
            return lambda request, _: sent.append(request) or b"HTTP/1.1 200 OK\r\n\r\n{}"

    link = open_link(address, line={}, library=Library())
    assert link.query("/meta") == "{}"
    assert f"\r\nHost: {url.removeprefix('http://')}\r\n".encode() in sent[0]


@pytest.mark.parametrize(
    "address", ["phyphox://", "phyphox://:8080", "phyphox://host:port", "phyphox://host:99999", "phyphox://no..host"]
)
def test_an_address_without_a_host_is_refused(address):
    with pytest.raises(NotConnected, match="phyphox://HOST:8080"):
        open_link(address, line={})


def test_a_link_that_was_lost_needs_no_care_and_a_closed_one_stays_closed():
    with Server() as server:
        link = link_to(server)
        with pytest.raises(InstrumentError):
            link.query("/")
        server._pieces = (OK,)
        assert link.query("/") == "hello"
        link.close()
        with pytest.raises(NotConnected, match="closed"):
            link.query("/")
        with pytest.raises(NotConnected, match="closed"):
            link.reopen()


def test_the_log_has_questions_and_the_beginnings_of_answers():
    traffic = []
    body = b"x" * 1000
    with Server(b"HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\n" + body) as server:
        link = link_to(server, log=lambda *line: traffic.append(line))
        link.query("/get?a")
    assert traffic == [(link.address, ">", b"/get?a\n"), (link.address, "<", b"x" * 200 + b"\n")]
