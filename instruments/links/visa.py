"""The way to an instrument by PyVISA: a resource as a port of bytes.

A driver sees a :class:`instruments.links.transport.Transport`: for it real and virtual instruments are alike.
"""

from __future__ import annotations

import select
import socket
import warnings
from typing import TYPE_CHECKING, Any

from instruments.errors import NoAnswer, NotConnected, Occupied, SilentLine
from instruments.links.advice import advice, one_line
from instruments.links.transport import LONGEST_ANSWER, Failure, Resynchronising

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pyvisa.highlevel import VisaLibraryBase

#: How the names of bare TCP connections end, and those of serial lines begin.
_BARE_SOCKET, _LINE = "::SOCKET", "ASRL"

#: Bytes of one read of a block and of a text: pyvisa-py's HiSLIP clears as much memory for each answer.
_CHUNK, _TEXT_CHUNK = 1 << 20, 1 << 16

#: VISA's numbers for: locked, busy; and for: no such operation, not implemented.
_HELD_BY_ANOTHER = {-1073807345, -1073807246}
_HAS_NO_LOCKS = {-1073807257, -1073807231}


class VisaPort:
    """A message-based VISA resource: GPIB, USB, TCP socket, VXI-11, HiSLIP, serial, or a virtual one.

    See :class:`instruments.links.transport.Port`.  resource: PyVISA's own, once it is open.
    """

    text = "plain text"

    def __init__(self, address: str, library: str | VisaLibraryBase, line: Mapping[str, Any]) -> None:
        """Take a resource name; line: settings of a serial resource, baud_rate, data_bits, parity, stop_bits."""
        self.resource: Any = None
        self.silence: type[NoAnswer] = NoAnswer
        self.resynchronising = Resynchronising.DEVICE_CLEAR
        if address.upper().endswith(_BARE_SOCKET):
            self.resynchronising = Resynchronising.NEW_LINK
        elif address.upper().startswith(_LINE):
            self.resynchronising, self.silence = Resynchronising.QUESTION, SilentLine
        self._address, self._library, self._line = address, library, line

    def open(self) -> None:
        """See :class:`instruments.links.transport.Port`."""
        import pyvisa

        try:
            # pyvisa annotates neither a library instance here nor the message-based result
            manager = pyvisa.ResourceManager(self._library)  # type: ignore[arg-type, unused-ignore]
            self.resource = manager.open_resource(self._address)
        except Exception as error:  # pyvisa-py raises plain Exception when a host is unknown or unreachable
            hint = advice(error, self._address, self._library)
            raise NotConnected(self._address, f"cannot be opened ({one_line(error)}){hint}") from error
        # the resource's time-out [s], and whether a line feed ends a read; None until they are set
        self._allowed: float | None = None
        self._by_line: bool | None = None
        if self.resynchronising is Resynchronising.NEW_LINK:
            self._send_at_once()
        if self.resynchronising is Resynchronising.QUESTION:
            self._set_line()

    def _set_line(self) -> None:
        from pyvisa.constants import Parity, StopBits

        given, resource = self._line, self.resource
        resource.baud_rate, resource.data_bits = given.get("baud_rate", 9600), given.get("data_bits", 8)
        resource.parity = Parity[given.get("parity", "none")]
        resource.stop_bits = {1: StopBits.one, 1.5: StopBits.one_and_a_half, 2: StopBits.two}[given.get("stop_bits", 1)]

    def _send_at_once(self) -> None:
        """Disable Nagle's algorithm, as VISA does by default (VPP-4.3, VI_ATTR_TCPIP_NODELAY) and pyvisa-py does not.

        Without it a message that follows one without an answer waits until that one is acknowledged: 0.04 s.
        """
        if interface := self._bare_socket():
            interface.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def close(self) -> None:
        """See :class:`instruments.links.transport.Port`."""
        self.resource.close()

    # --- bytes ---

    def send(self, data: bytes, within: float) -> None:
        """See :class:`instruments.links.transport.Port`."""
        self._wait_at_most(within)
        self.resource.write_raw(data)

    def line(self, within: float) -> bytes:
        """See :class:`instruments.links.transport.Port`."""
        self._wait_at_most(within)
        self._end_at_line_feed(yes=True)
        return bytes(self.resource.read_bytes(LONGEST_ANSWER, chunk_size=_TEXT_CHUNK, break_on_termchar=True))

    def exactly(self, count: int, within: float) -> bytes:
        """See :class:`instruments.links.transport.Port`."""
        self._wait_at_most(within)
        self._end_at_line_feed(yes=False)
        return bytes(self.resource.read_bytes(count, chunk_size=_CHUNK))

    def message(self, within: float) -> bytes:
        """See :class:`instruments.links.transport.Port`."""
        self._wait_at_most(within)
        self._end_at_line_feed(yes=False)
        return bytes(self.resource.read_raw(_CHUNK))

    def discard(self) -> None:
        """Empty the pipe without waiting.

        At a bare socket pyvisa-py's own flush waits 0.1 s, and for ever where the other side has left, so this reads
        its socket directly.  Other libraries flush well.
        """
        import pyvisa

        interface = self._bare_socket()
        if interface is None:
            self.resource.flush(pyvisa.constants.BufferOperation.discard_read_buffer)
            return
        self._session()._pending_buffer.clear()
        while select.select([interface], [], [], 0)[0]:
            if not interface.recv(_CHUNK):
                raise ConnectionResetError("the other side has closed the connection")

    def clear(self, within: float) -> None:
        """See :class:`instruments.links.transport.Port`."""
        if self.resynchronising is Resynchronising.QUESTION:
            self.discard()
            return
        self._wait_at_most(within)
        self.resource.clear()

    def lock(self, within: float) -> None:
        """See :class:`instruments.links.transport.Port`."""
        import pyvisa

        try:
            self.resource.lock_excl(timeout=1000 * within)
        except pyvisa.VisaIOError as error:
            if error.error_code in _HELD_BY_ANOTHER:
                raise Occupied(self._address) from error
            # interfaces without locks are no trouble: bare sockets, serial lines, and what pyvisa-py does not lock
            if error.error_code not in _HAS_NO_LOCKS:
                raise NotConnected(self._address, f"it could not be locked ({error.description})") from error
        except NotImplementedError:
            pass
        except (EOFError, OSError, RuntimeError, KeyError) as error:  # of pyvisa-py's VXI-11, when the link breaks
            raise NotConnected(self._address, f"it could not be locked ({error!r})") from error

    def failure(self, error: Exception) -> Failure:
        """Return what an error means; a time-out has VISA's number, pyvisa-py's protocols raise OSError, too."""
        import pyvisa

        time_out = pyvisa.constants.StatusCode.error_timeout
        silent = isinstance(error, pyvisa.VisaIOError) and error.error_code == time_out
        return Failure.SILENCE if silent else Failure.LOST

    def _wait_at_most(self, within: float) -> None:
        """Set the resource's time-out [s]."""
        if self._allowed != within:
            self.resource.timeout = 1000 * within
            self._allowed = within

    def _end_at_line_feed(self, *, yes: bool) -> None:
        """Set whether a line feed ends a read; in a block it is a byte like any other."""
        if self._by_line != yes:
            self.resource.read_termination = "\n" if yes else None
            self._by_line = yes

    def _session(self) -> Any:
        """Return pyvisa-py's session with the resource; None in any other library."""
        return getattr(self.resource.visalib, "sessions", {}).get(self.resource.session)

    def _bare_socket(self) -> socket.socket | None:
        """Return the socket behind a bare TCP connection of pyvisa-py's; None from any other library."""
        interface = getattr(self._session(), "interface", None)
        return interface if isinstance(interface, socket.socket) else None


def addresses(library: str | VisaLibraryBase) -> tuple[str, ...]:
    """Return the resource names that a PyVISA library finds by itself, serial ports included.  Raises NotConnected."""
    import pyvisa

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pyvisa-py recommends packages; the documentation does it here
            names = pyvisa.ResourceManager(library).list_resources("?*")  # type: ignore[arg-type, unused-ignore]
        return tuple(name for name in names if name.upper().endswith(("::INSTR", _BARE_SOCKET)))
    except Exception as error:  # whatever a vendor's library raises
        raise NotConnected(
            str(library), f"nothing can be listed ({one_line(error)}){advice(error, library=library)}"
        ) from error
