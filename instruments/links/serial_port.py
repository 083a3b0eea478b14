"""The way to an instrument on a serial port: pyserial behind the protocol of :mod:`instruments.links.transport`."""

from __future__ import annotations

import contextlib
import errno
import math
import re
import socket
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from instruments.clock import WallClock
from instruments.errors import BadAnswer, InstrumentError, NotConnected, Occupied, OutOfRange, SilentLine
from instruments.ieee488 import PLAIN_BLOCK, BrokenBlock, read_block
from instruments.links.advice import CLOSED

if TYPE_CHECKING:
    from collections.abc import Iterator

    from instruments.clock import Clock
    from instruments.ieee488 import BlockForm
    from instruments.links.transport import TrafficLog

#: pyserial's letters for what bench.toml says in words.
PARITIES = {"none": "N", "odd": "O", "even": "E", "mark": "M", "space": "S"}

#: Bytes read at a stretch, and the longest answer that is text.
_CHUNK, _LONGEST_ANSWER = 4096, 1 << 20

#: What text on a wire consists of.
_PLAIN = re.compile(rb"[\t\r\n -~]*")

#: The question that every instrument knows, and its answer: four fields, the first no number.
_WHO, _IDENTITY = "*IDN?", re.compile(rb"[A-Za-z][^,]*,[^,]+,[^,]*,[^,]+")

_IN_USE = {errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK}
_WRONG_SETTINGS = "plain text (wrong baud rate or parity?)"


class SerialTransport:
    """An instrument at a serial port: messages end with LF, answers with LF or CR LF.

    After a time-out the line is resynchronised before the next message: ``*IDN?`` is asked, and what comes before its
    answer is dropped, for instruments answer in the order in which they were asked.  So a late answer never reaches
    the next question.
    """

    def __init__(
        self,
        address: str,
        *,
        baud_rate: int = 9600,
        data_bits: int = 8,
        parity: str = "none",
        stop_bits: float = 1,
        timeout: float = 2.0,
        pause: float = 0.0,
        clock: Clock | None = None,
        log: TrafficLog | None = None,
    ) -> None:
        """Open the port.

        address: a port (``COM3``, ``/dev/ttyUSB0``), the same as a VISA resource (``ASRLCOM3::INSTR``, ``ASRL3::INSTR``
        for the third port), or a URL of pyserial's (``socket://host:port``).
        parity: none, odd, even, mark or space; timeout: of one answer [s]; pause: how long the instrument is left
        alone after each exchange [s]; clock: by which, the wall's by default.
        Raises NotConnected, Occupied, OutOfRange.
        """
        self.address, self.timeout, self.pause = address, timeout, pause
        self._clock: Clock = clock or WallClock()
        if parity not in PARITIES:
            raise OutOfRange(address, "parity", parity, "one of " + ", ".join(PARITIES))
        self._options: dict[str, Any] = {
            "baudrate": baud_rate,
            "bytesize": data_bits,
            "parity": PARITIES[parity],
            "stopbits": stop_bits,
        }
        self._log = log
        self._out_of_step = self._locked = self._closed = False
        self._identities_due = 0  # answers to *IDN? that were not received, and may still come
        self._received = bytearray()
        self._rested_at = -math.inf
        self._lost = False
        self._port: Any = self._open()

    def _open(self) -> Any:
        import serial

        port = port_name(self.address)
        try:
            return _at_once(
                serial.serial_for_url(port, timeout=self.timeout, write_timeout=self.timeout, **self._options)
            )
        except Exception as error:  # pyserial lets termios.error and ValueError through
            raise self._not_opened(port, error) from error

    def _not_opened(self, port: str, error: Exception) -> NotConnected:
        number = getattr(error, "errno", None)
        refused = number == errno.EACCES or "PermissionError" in str(error)
        # Windows gives a port to one program only, and says that access is denied to the others
        if number in _IN_USE or (refused and sys.platform == "win32"):
            return Occupied(self.address)
        if refused:
            return NotConnected(self.address, f"you may not use this port: {_permission_hint(port)}")
        return NotConnected(self.address, f"cannot be opened ({_one_line(error)}): {_ports_hint(port)}")

    # --- messages ---

    def write(self, message: str) -> None:
        """Send one message; see :class:`instruments.links.transport.Transport`."""
        if self._lost:  # a converter that hung up, a plug that was pulled: it may be there again
            self.reopen()
        with self._translated_errors(message, self.timeout):
            if self._out_of_step:
                self._resynchronise()
            self._send(message)

    def query(self, message: str, *, patience: float = 0.0) -> str:
        """Ask; see :class:`instruments.links.transport.Transport`."""
        self.write(message)
        within = self.timeout + patience
        with self._translated_errors(message, within):
            line = self._line(message, within)
        self._record("<", line)
        return line.decode("ascii").strip()

    def query_block(self, message: str, *, patience: float = 0.0, form: BlockForm = PLAIN_BLOCK) -> bytes:
        """Ask for a block; see :class:`instruments.links.transport.Transport`.

        A block may take longer than the time-out, but not be silent for so long.
        """
        self.write(message)
        within = self.timeout + patience
        with self._translated_errors(message, within):
            self._wait_at_most(within)
            head = self._exactly(len(b"#n"))
            if not head:
                raise SilentLine(self.address, message, within)
            first = iter((head,))
            block = read_block(lambda count: next(first, b"") or self._exactly(count), form)
            self._rest()
        self._record("<", b"(%d bytes)" % len(block))
        return block

    def _send(self, message: str) -> None:
        if (rest := self._rested_at - self._clock.now()) > 0:
            self._clock.sleep(rest)
        self._port.reset_input_buffer()  # an answer that came unasked is no answer to this
        self._received.clear()
        line = message.encode("ascii", errors="replace")
        self._record(">", line)
        self._port.write(line + b"\n")
        self._rest()

    def _line(self, question: str, within: float) -> bytes:
        """The next line without its end.  Raises SilentLine, or _Garbled when it is no text."""
        self._wait_at_most(within)
        deadline = time.monotonic() + within
        while b"\n" not in self._received:
            chunk = self._port.read(min(_CHUNK, max(1, self._port.in_waiting)))
            self._received += chunk
            if not chunk or len(self._received) > _LONGEST_ANSWER or time.monotonic() > deadline:
                break
        self._rest()
        line, end, rest = bytes(self._received).partition(b"\n")
        self._received = bytearray(rest)
        if not _PLAIN.fullmatch(line):
            raise _Garbled(line)
        if not end:
            raise SilentLine(self.address, question, within)
        return line.rstrip(b"\r")

    def _exactly(self, count: int) -> bytes:
        """So many bytes, or fewer if no more come."""
        seen = bytearray()
        while len(seen) < count:
            chunk = self._port.read(min(_CHUNK, count - len(seen)))
            if not chunk:
                break
            seen += chunk
        return bytes(seen)

    # --- the line ---

    def clear(self) -> None:
        """Drop what is under way; the line is resynchronised before the next message."""
        self._out_of_step = True
        with self._translated_errors("", self.timeout):
            self._port.reset_output_buffer()
            self._port.reset_input_buffer()

    def _resynchronise(self) -> None:
        """Ask who is there until the last answer to that has come; all before it is old.  Raises SilentLine."""
        self._send("")  # ends what may have been sent in part
        self._identities_due += 1
        self._send(_WHO)
        deadline = time.monotonic() + self.timeout
        garbled: _Garbled | None = None
        seen = 0
        while seen < self._identities_due:
            try:
                seen += bool(_IDENTITY.fullmatch(self._line(_WHO, self.timeout)))
            except _Garbled as error:
                garbled = error
            except SilentLine:
                if seen:  # the others were never sent
                    break
                raise garbled or SilentLine(self.address, _WHO, self.timeout) from None
            if time.monotonic() > deadline:  # it talks on and on
                if not seen:
                    raise garbled or SilentLine(self.address, _WHO, self.timeout)
                break
        self._identities_due = 0
        self._out_of_step = False

    def reopen(self) -> None:
        """Open the port anew; see :class:`instruments.links.transport.Transport`."""
        self._check_open()
        self._close_port()
        self._port = self._open()
        self._lost = False
        self._out_of_step = True  # the instrument was not told, and may still be answering
        if self._locked:
            self.lock()

    def lock(self) -> None:
        """Keep other programs that ask for it from the port (POSIX); on Windows a port has one user at any time."""
        import serial

        self._check_open()
        try:
            self._port.exclusive = True
        except serial.SerialException as error:
            raise Occupied(self.address) from error
        self._locked = True

    def close(self) -> None:
        """Give the port back; see :class:`instruments.links.transport.Transport`."""
        self._closed = True
        self._close_port()

    def _check_open(self) -> None:
        if self._closed:
            raise NotConnected(self.address, CLOSED)

    def _close_port(self) -> None:
        link = _tcp_link(self._port)
        with contextlib.suppress(Exception):  # it may be gone for good
            self._port.close()
        if link is not None:  # pyserial leaves it open if the other side has hung up
            link.close()

    def _wait_at_most(self, within: float) -> None:
        if self._port.timeout != within:  # setting it configures the port anew
            self._port.timeout = within

    def _rest(self) -> None:
        if self.pause:
            self._rested_at = self._clock.now() + self.pause

    def _record(self, direction: str, message: bytes) -> None:
        if self._log:
            self._log(self.address, direction, message + b"\n")

    @contextlib.contextmanager
    def _translated_errors(self, question: str, within: float) -> Iterator[None]:
        """What pyserial raises, as ours; afterwards the next exchange starts with a clean line."""
        try:
            yield
        except BaseException as error:
            # whatever it was, an interruption included: the answer may still come
            self._out_of_step = True
            self._identities_due += question == _WHO
            if isinstance(error, _Garbled):
                raise BadAnswer(self.address, question, repr(error.seen[:40]), _WRONG_SETTINGS) from None
            if isinstance(error, BrokenBlock):
                raise BadAnswer(self.address, question, error.seen, "a definite-length block") from error
            if isinstance(error, InstrumentError) or not isinstance(error, Exception):
                raise
            # SerialException, OSError, termios.error
            self._check_open()
            if getattr(error, "errno", None) in _IN_USE:
                raise Occupied(self.address) from error
            self._lost = True
            told = f"no link at {question!r} ({_one_line(error)}): check the cable, and that it is on"
            raise NotConnected(self.address, told) from error


class _Garbled(Exception):
    """What came is no text."""

    def __init__(self, seen: bytes) -> None:
        self.seen = seen
        super().__init__(seen)


def _at_once(port: Any) -> Any:
    """The port; over TCP a message that follows one without an answer does not wait for that one's acknowledgement."""
    link = _tcp_link(port)
    if link is not None:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return port


def _tcp_link(port: Any) -> socket.socket | None:
    """The connection behind a port that is a URL ``socket://``."""
    link = getattr(port, "_socket", None)
    return link if isinstance(link, socket.socket) else None


def port_name(address: str) -> str:
    """What pyserial calls this port.

    A number alone is VISA's: the third port is COM3, or /dev/ttyS2 elsewhere than on Windows.

    >>> port_name("ASRLCOM3::INSTR"), port_name("/dev/ttyUSB0"), port_name("asrlsocket://127.0.0.1:4001::instr")
    ('COM3', '/dev/ttyUSB0', 'socket://127.0.0.1:4001')
    """
    found = re.fullmatch(r"ASRL(.+?)(?:::INSTR)?", address, re.IGNORECASE)
    name = found[1] if found else address
    if not name.isdecimal():
        return name
    return f"COM{name}" if sys.platform == "win32" else f"/dev/ttyS{int(name) - 1}"


def _permission_hint(port: str) -> str:
    """Which group uses this port, where there are groups."""
    try:
        import grp

        group = grp.getgrgid(Path(port).stat().st_gid).gr_name
    except (ImportError, OSError, KeyError):
        return "ask whoever runs this computer for the right to use serial ports"
    return f"its group is {group}; join it with `sudo usermod -aG {group} $USER`, then log in again"


def _ports_hint(port: str) -> str:
    """Which ports there are, for a name that is none of them."""
    if "://" in port:
        return "check the address, and that it is on"
    if re.fullmatch(r"[\d.]+|[\w-]+(\.[\w-]+)+", port):
        return f"an instrument on the network has a resource name, as TCPIP0::{port}::5025::SOCKET"
    from serial.tools.list_ports import comports

    present = ", ".join(sorted(found.device for found in comports()))
    return (
        f"the serial ports of this computer are {present}" if present else "this computer has no serial port: plug in?"
    )


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
