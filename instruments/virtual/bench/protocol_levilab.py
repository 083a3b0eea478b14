"""pyserial finds the virtual instruments here: ``serial.serial_for_url("levilab://magnetometer")``.

For that, :func:`plug_in` names this package to pyserial, and the bench that the URL means, which then stands in
:data:`instruments.virtual.bench.serial_line.benches`.  pyvisa-py takes the same URL as
``ASRLlevilab://magnetometer::INSTR``.
"""

from __future__ import annotations

import contextlib
import errno
import math
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import serial
from serial.serialutil import PortNotOpenError, SerialBase, SerialException

from instruments.virtual.bench.serial_line import SerialLine, benches
from instruments.virtual.bench.session import LinkLost
from instruments.virtual.core.line import LineSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from instruments.virtual.bench.bus import Bus
    from instruments.virtual.bench.session import Session

#: Where pyserial looks for the module of a URL's scheme: the package that this one is in.
_PACKAGE = __name__.rpartition(".")[0]


def plug_in(bench: Callable[[], Bus], name: str = "") -> None:
    """Let pyserial find this bench from now on, as ``levilab://instrument?bench=name`` (no name: without the query)."""
    if _PACKAGE not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(_PACKAGE)
    benches[name] = bench


class Serial(SerialBase):
    """A port of pyserial's whose other end is a virtual instrument; waiting costs the bench's time."""

    def __init__(self, *args: Any, **options: Any) -> None:
        self._line: SerialLine | None = None
        super().__init__(*args, **options)

    def open(self) -> None:
        """Plug in.  Raises SerialException if there is no such instrument, or if another program keeps it."""
        if self.is_open:
            raise SerialException("the port is already open")
        line = SerialLine(_session(str(self.port)))
        if line.hold.keeps_out(line):
            raise SerialException(errno.EBUSY, f"could not open port {self.port}: another program has it")
        self._line = line
        try:
            self._reconfigure_port()
        except SerialException:
            self._line = None
            raise
        self.is_open = True

    def close(self) -> None:
        """Unplug; closing twice does no harm."""
        if self._line:
            self._line.close()
        self._line, self.is_open = None, False

    def _reconfigure_port(self) -> None:
        line = self._open_line()
        line.settings = LineSettings(int(self.baudrate), int(self.bytesize), str(self.parity), float(self.stopbits))
        if not self.exclusive:
            line.hold.let_go(line)
        elif not line.hold.take(line, None):
            raise SerialException(errno.EAGAIN, f"could not exclusively lock port {self.port}")

    def _open_line(self) -> SerialLine:
        if self._line is None:
            raise PortNotOpenError
        return self._line

    @property
    def in_waiting(self) -> int:
        """Bytes that have come."""
        with _link_of(self._open_line()) as line:
            return line.waiting()

    def read(self, size: int = 1, /) -> bytes:
        """So many bytes, or fewer when the time-out is over.  None for a time-out: for ever, if something is to come.

        Raises SerialException where a real port would wait for ever.
        """
        with _link_of(self._open_line()) as line:
            got = line.receive(size, math.inf if self.timeout is None else float(self.timeout))
        if not got and size and self.timeout is None:
            raise SerialException("nothing is under way and there is no time-out: this would wait for ever")
        return got

    def write(self, data: Any, /) -> int:
        """Send bytes."""
        sent = bytes(data)
        with _link_of(self._open_line()) as line:
            line.write(sent)
        return len(sent)

    def flush(self) -> None:
        """Everything has left already."""
        self._open_line()

    def reset_input_buffer(self) -> None:
        """Drop what has come."""
        with _link_of(self._open_line()) as line:
            line.discard()

    def reset_output_buffer(self) -> None:
        """Everything has left already."""
        self._open_line()

    # --- the other wires: three-wire lines have none ---

    def _update_break_state(self) -> None: ...
    def _update_rts_state(self) -> None: ...
    def _update_dtr_state(self) -> None: ...

    @property
    def cts(self) -> bool:
        """Clear to send: always."""
        return True

    @property
    def dsr(self) -> bool:
        """Data set ready: always."""
        return True

    @property
    def ri(self) -> bool:
        """Ring: never."""
        return False

    @property
    def cd(self) -> bool:
        """Carrier: always."""
        return True


@contextlib.contextmanager
def _link_of(line: SerialLine) -> Iterator[SerialLine]:
    """The line; raises SerialException when another program has taken it, or when the link is lost."""
    if line.hold.keeps_out(line):
        raise SerialException(errno.EBUSY, "another program has taken the port")
    try:
        yield line
    except LinkLost:
        raise SerialException(errno.EIO, "the device has been disconnected") from None


def _session(url: str) -> Session:
    """A session with the instrument that the URL names.  Raises SerialException."""
    parts = urlsplit(url)
    wanted = parse_qs(parts.query).get("bench", [""])[0]
    if wanted not in benches:
        raise SerialException(errno.ENOENT, f"no virtual bench is named {wanted!r}: known are {sorted(benches)}")
    bus = benches[wanted]()
    name = parts.netloc
    plain = name.upper().removeprefix("ASRL")
    for address in (f"ASRLlevilab://{name}::INSTR", f"ASRL{plain}.levilab::INSTR", f"ASRL{plain}::INSTR"):
        if session := bus.open(address):
            return session
    lines = [address for address in bus.instruments if address.upper().startswith("ASRL")]
    raise SerialException(errno.ENOENT, f"the bench has no {name!r} on a serial line: it has {', '.join(lines) or '-'}")
