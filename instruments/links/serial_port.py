"""The way to an instrument on a serial port: pyserial's as a port of bytes."""

import contextlib
import errno
import re
import socket
import sys
from pathlib import Path
from typing import Any

from instruments.clock import Clock
from instruments.errors import NoAnswer, NotConnected, Occupied, OutOfRange, SilentLine
from instruments.links.advice import one_line
from instruments.links.transport import LONGEST_ANSWER, Failure, Resynchronising

#: pyserial's letters for the words of bench.toml.
PARITIES = {"none": "N", "odd": "O", "even": "E", "mark": "M", "space": "S"}

#: Bytes of one read, at most.
_CHUNK = 4096

_IN_USE = {errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK}


class SerialPort:
    """A pyserial port; see :class:`instruments.links.transport.Port`.

    Attributes:
        device: pyserial's own object, None until it is open.
        received: bytes that came behind the last line.
    """

    resynchronising = Resynchronising.QUESTION
    text = "plain text (wrong baud rate or parity?)"
    silence: type[NoAnswer] = SilentLine

    def __init__(
        self,
        address: str,
        *,
        timeout: float,
        clock: Clock,
        baud_rate: int = 9600,
        data_bits: int = 8,
        parity: str = "none",
        stop_bits: float = 1,
    ) -> None:
        """Take an address.

        Args:
            address: a port (``COM3``, ``/dev/ttyUSB0``), the same as a VISA resource (``ASRLCOM3::INSTR``,
                ``ASRL3::INSTR`` for the third port), or a URL of pyserial's (``socket://host:port``).
            timeout: of one answer [s].
            clock: of the bench.
            baud_rate: of the line [bit/s].
            data_bits: 5 to 8.
            parity: none, odd, even, mark or space.
            stop_bits: 1, 1.5 or 2.

        Raises:
            OutOfRange: no such parity.
        """
        if parity not in PARITIES:
            raise OutOfRange(address, "parity", parity, "one of " + ", ".join(PARITIES))
        self.device: Any = None
        self.received = bytearray()
        self._address, self._clock = address, clock
        self._options: dict[str, Any] = {
            "baudrate": baud_rate,
            "bytesize": data_bits,
            "parity": PARITIES[parity],
            "stopbits": stop_bits,
            "timeout": timeout,
            "write_timeout": timeout,
        }

    def open(self) -> None:
        """See :class:`instruments.links.transport.Port`."""
        import serial

        port = port_name(self._address)
        try:
            self.device = serial.serial_for_url(port, **self._options)
            if link := self.connection():
                # a message that follows one without an answer does not wait for that one's acknowledgement
                link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except Exception as error:  # pyserial lets termios.error and ValueError through
            raise self._explain(port, error) from error

    def _explain(self, port: str, error: Exception) -> NotConnected:
        number = getattr(error, "errno", None)
        refused = number == errno.EACCES or "PermissionError" in str(error)
        # Windows gives a port to one program only, and says that access is denied to the others
        if number in _IN_USE or (refused and sys.platform == "win32"):
            return Occupied(self._address)
        if refused:
            return NotConnected(self._address, f"you may not use this port: {_permission_hint(port)}")
        return NotConnected(self._address, f"cannot be opened ({one_line(error)}): {_ports_hint(port)}")

    def connection(self) -> socket.socket | None:
        """Return the connection behind a port that is a URL ``socket://``."""
        link = getattr(self.device, "_socket", None)
        return link if isinstance(link, socket.socket) else None

    def close(self) -> None:
        """See :class:`instruments.links.transport.Port`."""
        link = self.connection()
        with contextlib.suppress(Exception):  # the device may be unplugged
            self.device.close()
        if link is not None:  # pyserial leaves it open if the other side has hung up
            link.close()

    # --- bytes ---

    def send(self, data: bytes, within: float) -> None:
        """See :class:`instruments.links.transport.Port`.

        Within the time-out with which the port was opened: pyserial raises where a shorter one is over although all was
        written, as on a busy machine.
        """
        self.device.write(data)

    def line(self, within: float) -> bytes:
        """See :class:`instruments.links.transport.Port`."""
        self._wait_at_most(within)
        deadline = self._clock.now() + within
        while b"\n" not in self.received:
            chunk = self.device.read(min(_CHUNK, max(1, self.device.in_waiting)))
            self.received += chunk
            if not chunk or len(self.received) > LONGEST_ANSWER or self._clock.now() > deadline:
                break
        line, end, rest = self.received.partition(b"\n")
        self.received = rest
        return bytes(line + end)

    def exactly(self, count: int, within: float) -> bytes:
        """See :class:`instruments.links.transport.Port`."""
        self._wait_at_most(within)
        seen = self.received[:count]
        del self.received[:count]
        while len(seen) < count:
            chunk = self.device.read(min(_CHUNK, count - len(seen)))
            if not chunk:
                break
            seen += chunk
        return bytes(seen)

    def message(self, within: float) -> bytes:
        """Raise NotImplementedError: a serial line does not mark the ends of messages."""
        raise NotImplementedError

    def discard(self) -> None:
        """See :class:`instruments.links.transport.Port`."""
        self.device.reset_input_buffer()
        self.received.clear()

    def clear(self, within: float) -> None:
        """See :class:`instruments.links.transport.Port`."""
        self.device.reset_output_buffer()
        self.discard()

    def lock(self, within: float) -> None:
        """Lock the port against other programs that lock it, too (POSIX); on Windows a port always has one user."""
        import serial

        try:
            self.device.exclusive = True
        except serial.SerialException as error:
            raise Occupied(self._address) from error

    def failure(self, error: Exception) -> Failure:
        """Return the meaning of an error: SerialException and OSError have the system's number, a time-out none."""
        return Failure.OCCUPIED if getattr(error, "errno", None) in _IN_USE else Failure.LOST

    def _wait_at_most(self, within: float) -> None:
        if self.device.timeout != within:  # setting it configures the port again
            self.device.timeout = within


def port_name(address: str) -> str:
    """Return the name by which pyserial knows this port.

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
    """Return how to get the right to use this port: its group, on systems with groups."""
    try:
        import grp

        group = grp.getgrgid(Path(port).stat().st_gid).gr_name
    except (ImportError, OSError, KeyError):
        return "ask the administrator of this computer for the right to use serial ports"
    return f"its group is {group}; join it with `sudo usermod -aG {group} $USER`, then log in again"


def _ports_hint(port: str) -> str:
    """Return advice for a name that is no port of this computer: the ports that it has."""
    if "://" in port:
        return "check the address, and that it is on"
    if re.fullmatch(r"[\d.]+|[\w-]+(\.[\w-]+)+", port):
        return f"an instrument on the network has a resource name, as TCPIP0::{port}::5025::SOCKET"
    from serial.tools.list_ports import comports

    present = ", ".join(sorted(found.device for found in comports()))
    return (
        f"the serial ports of this computer are {present}" if present else "this computer has no serial port: plug in?"
    )
