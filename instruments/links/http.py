"""The way to an instrument that answers requests over HTTP, such as an app on a phone.

Each question has a connection of its own, so no late answer is taken for that to another question, and a link that was
lost needs no care: the next question finds the instrument again, or does not.
"""

import http.client
import io
import re
import socket
import time
from collections.abc import Callable
from typing import Any, cast
from urllib.parse import urlsplit

from instruments.clock import Clock
from instruments.errors import BadAnswer, NoAnswer, NotConnected
from instruments.ieee488 import PLAIN_BLOCK, BlockForm
from instruments.links.advice import CLOSED, one_line
from instruments.links.transport import TrafficLog

#: Sends a request and returns the whole answer, in this time [s].  Raises OSError; TimeoutError where nothing came.
Exchange = Callable[[bytes, float], bytes]

#: The longest answer: an hour of four quantities, 100 times a second, has 19 MB [bytes].
LONGEST_ANSWER = 1 << 25
_LENGTH, _HEAD_END = re.compile(rb"\r\ncontent-length: *([0-9]{1,12}) *\r\n", re.IGNORECASE), b"\r\n\r\n"
#: Signs of an answer that the traffic log has at most.
_LOGGED = 200


class HttpTransport:
    """An instrument at an address SCHEME://HOST[:PORT]; a message is a path with its query, the answer its document.

    See :class:`instruments.links.transport.Transport`.
    """

    def __init__(
        self,
        address: str,
        *,
        port: int,
        advice: str,
        library: Any = None,
        timeout: float = 2.0,
        clock: Clock | None = None,
        log: TrafficLog | None = None,
    ) -> None:
        """Take an address; the first question connects.

        Args:
            address: of the instrument.
            port: where the address has none.
            advice: what to try where nothing answers.
            library: of a virtual bench, which carries the messages itself; PyVISA's others carry none.
            timeout: of one answer [s].
            clock: not needed.
            log: called with requests, and with the beginnings of answers.

        Raises:
            NotConnected: the address has no host.
        """
        self.address, self.timeout = address, timeout
        self._advice, self._log, self._closed = advice, log, False
        try:
            parts = urlsplit(address)
            host, port = (parts.hostname or "").encode("idna").decode("ascii"), parts.port or port
        except ValueError:  # of the port, or of a name that no host can have
            host = ""
        if not host:
            raise NotConnected(
                address, f"the address of a host is expected, as {address.partition(':')[0]}://HOST:{port}"
            )
        self.url = f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
        connect: Callable[[str], Exchange] | None = getattr(library, "connect", None)
        self._exchange: Exchange = connect(address) if connect else _TcpExchange(host, port)

    def write(self, message: str) -> None:
        """Send a request whose answer says nothing."""
        self.query(message)

    def query(self, message: str, *, patience: float = 0.0) -> str:
        """Return a document as text; see :class:`Transport`.  Raises NotConnected, NoAnswer, BadAnswer."""
        data = self.query_block(message, patience=patience)
        try:
            return data.decode()
        except UnicodeDecodeError:
            raise BadAnswer(self.address, message, repr(data[:40]), "text") from None

    def query_block(self, message: str, *, patience: float = 0.0, form: BlockForm = PLAIN_BLOCK) -> bytes:
        """Return the bytes of a document; see `query`."""
        if self._closed:
            raise NotConnected(self.address, CLOSED)
        within = self.timeout + patience
        self._record(">", message)
        # a phone's server is confused by connections that stay
        head = f"GET {message} HTTP/1.1\r\nHost: {self.url[7:]}\r\nConnection: close\r\n\r\n"
        try:
            whole = self._exchange(head.encode("ascii"), within)
        except TimeoutError:
            raise NoAnswer(self.address, message, within) from None
        except OSError as error:
            what = f"nothing answers at {self.url} ({one_line(error)}): {self._advice}"
            raise NotConnected(self.address, what) from error
        document = self._document(message, whole)
        self._record("<", document[:_LOGGED].decode("ascii", errors="replace"))
        return document

    def _document(self, message: str, whole: bytes) -> bytes:
        """Return the document of an answer.  Raises BadAnswer: it is cut, too long, refused, or no HTTP."""
        answer = http.client.HTTPResponse(cast("socket.socket", _Received(whole)))
        try:
            if _HEAD_END not in whole:
                raise http.client.IncompleteRead(whole)
            answer.begin()
            document = answer.read()
        except (http.client.HTTPException, ValueError, OSError) as error:
            seen, expected = (
                f"{whole[:40]!r} ({len(whole)} bytes, {type(error).__name__})",
                "a whole document over HTTP",
            )
            raise BadAnswer(self.address, message, seen, expected) from None
        if answer.status != http.client.OK:
            raise BadAnswer(self.address, message, f"{answer.status} {answer.reason}", "200 OK", self._advice)
        if len(whole) > LONGEST_ANSWER:
            raise BadAnswer(self.address, message, f"more than {LONGEST_ANSWER} bytes", "less than that")
        return document

    def clear(self) -> None:
        """Do nothing: a late answer is lost with its connection."""

    def reopen(self) -> None:
        """Do nothing but check that it was not closed; the next question connects.  Raises NotConnected."""
        if self._closed:
            raise NotConnected(self.address, CLOSED)

    def lock(self) -> None:
        """Do nothing: there are no locks."""

    def close(self) -> None:
        """See :class:`Transport`."""
        self._closed = True

    def _record(self, direction: str, text: str) -> None:
        if self._log:
            self._log(self.address, direction, " ".join(text.split()).encode() + b"\n")


class _Received:
    """Bytes that were received, as http.client reads them from a socket."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    def makefile(self, _mode: str) -> io.BytesIO:
        return io.BytesIO(self._data)


class _TcpExchange:
    """Exchanges over TCP: the answer ends with its stated length, or with the connection."""

    def __init__(self, host: str, port: int) -> None:
        self._host, self._port = host, port

    def __call__(self, request: bytes, within: float) -> bytes:
        end = time.monotonic() + within
        try:
            link = socket.create_connection((self._host, self._port), timeout=within)
        except TimeoutError as error:  # a host that does not exist, on most networks
            raise ConnectionError(one_line(error)) from error
        with link:
            link.settimeout(_left(end))
            link.sendall(request)
            data = bytearray()
            while len(data) <= LONGEST_ANSWER and not _is_whole(data):
                link.settimeout(_left(end))
                if not (part := link.recv(1 << 16)):
                    break
                data += part
        if not data:
            raise ConnectionError("the other side has closed the connection without an answer")
        return bytes(data)


def _left(end: float) -> float:
    """Return the time left [s].  Raises TimeoutError."""
    if (left := end - time.monotonic()) <= 0:
        raise TimeoutError
    return left


def _is_whole(data: bytearray) -> bool:
    """Return whether an answer has come to its stated end."""
    head = data.find(_HEAD_END)
    stated = _LENGTH.search(data, 0, head + 2) if head >= 0 else None
    return stated is not None and len(data) >= head + len(_HEAD_END) + int(stated[1])
