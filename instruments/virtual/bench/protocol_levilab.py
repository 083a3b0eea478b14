"""The virtual instruments for pyserial: ``serial.serial_for_url("levilab://magnetometer")``.

pyserial imports this module by its name; :func:`plug_in` registers this package with pyserial, and the bench that the
URL means.  pyvisa-py takes the same URL as ``ASRLlevilab://magnetometer::INSTR``.
"""

import contextlib
import errno
import math
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import serial
from serial.serialutil import PortNotOpenError, SerialBase, SerialException

from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.serial_line import SerialLine
from instruments.virtual.bench.session import LinkLost, Session
from instruments.virtual.core.line import LineSettings

#: Where pyserial looks for the module of a URL's scheme: the package that this one is in.
_PACKAGE = __name__.rpartition(".")[0]
#: The bench that was plugged in last, which is found; none before.
plugged: list[VirtualBench] = []


def plug_in(bench: VirtualBench) -> None:
    """Let pyserial find this bench from now on, its magnetometer as ``levilab://magnetometer``."""
    if _PACKAGE not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(_PACKAGE)
    plugged[:] = [bench]


class Serial(SerialBase):
    """A pyserial port whose other end is a virtual instrument; a wait takes time of the bench's clock."""

    def __init__(self, *args: Any, **options: Any) -> None:
        self._line: SerialLine | None = None
        super().__init__(*args, **options)

    def open(self) -> None:
        """Open the port.  Raises SerialException where there is no such instrument, or another program locks it."""
        if self.is_open:
            raise SerialException("the port is already open")
        line = SerialLine(_open_session(str(self.port)))
        if line.client_lock.excludes(line):
            raise SerialException(errno.EBUSY, f"could not open port {self.port}: another program has it")
        self._line = line
        try:
            self._reconfigure_port()
        except SerialException:
            self._line = None
            raise
        self.is_open = True

    def close(self) -> None:
        """Close the port; closing twice does no harm."""
        if self._line:
            self._line.close()
        self._line, self.is_open = None, False

    def _reconfigure_port(self) -> None:
        line = self._open_line()
        line.settings = LineSettings(int(self.baudrate), int(self.bytesize), str(self.parity), float(self.stopbits))
        if not self.exclusive:
            line.client_lock.release(line)
        elif not line.client_lock.acquire(line, None):
            raise SerialException(errno.EAGAIN, f"could not exclusively lock port {self.port}")

    def _open_line(self) -> SerialLine:
        if self._line is None:
            raise PortNotOpenError
        return self._line

    @property
    def in_waiting(self) -> int:
        """How many received bytes wait to be read."""
        with _use(self._open_line()) as line:
            return line.waiting()

    def read(self, size: int = 1, /) -> bytes:
        """Read bytes, fewer when the time-out is over; without one (None) wait for an answer under way.

        Raises SerialException where a real port would wait for ever.
        """
        with _use(self._open_line()) as line:
            got = line.receive(size, math.inf if self.timeout is None else float(self.timeout))
        if not got and size and self.timeout is None:
            raise SerialException("nothing is under way and there is no time-out: this would wait for ever")
        return got

    def write(self, data: Any, /) -> int:
        """Send bytes."""
        sent = bytes(data)
        with _use(self._open_line()) as line:
            line.write(sent)
        return len(sent)

    def flush(self) -> None:
        """Do nothing: `write` returns when all bytes have left."""
        self._open_line()

    def reset_input_buffer(self) -> None:
        """Drop the received bytes."""
        with _use(self._open_line()) as line:
            line.discard()

    reset_output_buffer = flush

    # --- the other wires: three-wire lines have none ---

    def _update_break_state(self) -> None: ...
    def _update_rts_state(self) -> None: ...
    def _update_dtr_state(self) -> None: ...

    #: Clear to send, data set ready and carrier: always; ring: never.
    cts = dsr = cd = True
    ri = False


@contextlib.contextmanager
def _use(line: SerialLine) -> Iterator[SerialLine]:
    """Give the line to the block.  Raises SerialException when another program has locked it, or the link is lost."""
    if line.client_lock.excludes(line):
        raise SerialException(errno.EBUSY, "another program has taken the port")
    try:
        yield line
    except LinkLost:
        raise SerialException(errno.EIO, "the device has been disconnected") from None


def _open_session(url: str) -> Session:
    """Open a session with the instrument that the URL names.  Raises SerialException."""
    if not plugged:
        raise SerialException(errno.ENOENT, "no virtual bench is plugged in: plug_in(bench) comes first")
    (bench,), name = plugged, urlsplit(url).netloc
    plain = name.upper().removeprefix("ASRL")
    for address in (f"ASRLlevilab://{name}::INSTR", f"ASRL{plain}.levilab::INSTR", f"ASRL{plain}::INSTR"):
        if session := bench.open(address):
            return session
    lines = [address for address in bench.instruments if address.upper().startswith("ASRL")]
    raise SerialException(errno.ENOENT, f"the bench has no {name!r} on a serial line: it has {', '.join(lines) or '-'}")
