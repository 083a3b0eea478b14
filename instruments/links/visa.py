"""The way to an instrument: PyVISA behind one small protocol.

A driver sees a :class:`Transport` and cannot tell a real instrument
from a virtual one.
"""

from __future__ import annotations

import contextlib
import math
import re
import select
import socket
import time
import warnings
from typing import TYPE_CHECKING, Any

from instruments.clock import WallClock
from instruments.errors import BadAnswer, NoAnswer, NotConnected, Occupied, SilentLine
from instruments.ieee488 import PLAIN_BLOCK, BrokenBlock, block_of, read_block
from instruments.links.advice import CLOSED, advice, one_line

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pyvisa.highlevel import VisaLibraryBase
    from pyvisa.resources import MessageBasedResource

    from instruments.clock import Clock
    from instruments.ieee488 import BlockForm
    from instruments.links.transport import TrafficLog


#: PyVISA's own reading of a resource name that is a bare TCP connection: only reopening empties its pipe.
_BARE_SOCKET = "::SOCKET"

#: Bytes of a block and of a text read at a stretch, and the longest answer that is text.  pyvisa-py's HiSLIP clears so
#: much memory for each answer.
_CHUNK, _TEXT_CHUNK, _LONGEST_ANSWER = 1 << 20, 1 << 16, 1 << 22

#: Of a block that is longer the traffic log shows so many bytes.
_SHORT = 64

#: What an instrument is asked for its name, and the answer: four fields, the maker's first.
_WHO, _IDENTITY = "*IDN?", re.compile(rb"[A-Za-z][^,\n]*,[^,\n]*,[^,\n]*,[^\n]*\n?")

#: VISA's numbers for: locked, busy; and for: no such operation, not implemented.
_HELD_BY_ANOTHER = {-1073807345, -1073807246}
_HAS_NO_LOCKS = {-1073807257, -1073807231}


class VisaTransport:
    """A message-based VISA resource: GPIB, USB, TCP socket, VXI-11, HiSLIP, serial, or a virtual one."""

    def __init__(
        self,
        address: str,
        *,
        library: str | VisaLibraryBase = "@py",
        timeout: float = 2.0,
        line: Mapping[str, Any] | None = None,
        pause: float = 0.0,
        clock: Clock | None = None,
        log: TrafficLog | None = None,
    ) -> None:
        """Open the resource.

        library: a PyVISA library, ``"@py"`` needs nothing installed, ``""`` is the vendor's; timeout: of one answer
        [s]; line: of a serial resource, ``baud_rate``, ``data_bits``, ``parity`` (none, odd, …), ``stop_bits``;
        pause: how long the instrument is left alone after each message and each answer [s]; clock: by which, the
        wall's unless the instrument lives on another.  Raises NotConnected.
        """
        self.address, self.timeout, self._line = address, timeout, dict(line or {})
        self.pause, self._clock = pause, clock or WallClock()
        self._rested_at = -math.inf
        self._library, self._log = library, log
        self._out_of_step = self._closed = self._locked = False
        self._identities_due = 0  # answers to it that may still come
        self._stream = address.upper().endswith(_BARE_SOCKET) or address.upper().startswith("ASRL")
        self._resource = self._open()

    def _open(self) -> MessageBasedResource:
        import pyvisa

        try:
            # pyvisa annotates neither a library instance here nor the message-based result
            manager = pyvisa.ResourceManager(self._library)  # type: ignore[arg-type, unused-ignore]
            resource: Any = manager.open_resource(self.address)
        except Exception as error:  # pyvisa-py raises plain Exception when a host is unknown or unreachable
            raise NotConnected(
                self.address,
                f"cannot be opened ({one_line(error)}){advice(error, self.address, self._library)}",
            ) from error
        resource.write_termination = resource.read_termination = "\n"
        if self.address.upper().endswith(_BARE_SOCKET):
            _send_at_once(resource)
        if self.address.upper().startswith("ASRL"):
            self._set_line(resource)
        self._allowed: float | None = None  # the resource's time-out, as far as it was set [s]
        return resource  # type: ignore[no-any-return]

    def _set_line(self, resource: Any) -> None:
        from pyvisa.constants import Parity, StopBits

        given = self._line
        resource.baud_rate, resource.data_bits = given.get("baud_rate", 9600), given.get("data_bits", 8)
        resource.parity = Parity[given.get("parity", "none")]
        resource.stop_bits = {1: StopBits.one, 1.5: StopBits.one_and_a_half, 2: StopBits.two}[given.get("stop_bits", 1)]

    def write(self, message: str) -> None:
        """Send one message; see :class:`Transport`."""
        self._begin(message)
        with self._translated_errors(message, self.timeout):
            self._send(message)

    def _begin(self, message: str) -> None:
        if self._out_of_step:
            self.clear()
        self._record(">", message.encode(errors="replace"))

    def _send(self, message: str) -> None:
        """Send one message, within the link's own time-out: patience is for an answer."""
        self._wait_at_most(self.timeout)
        if self.pause and (rest := self._rested_at - self._clock.now()) > 0:
            self._clock.sleep(rest)
        if self._stream:  # an answer that came unasked is no answer to this
            self._discard_received()
        self._resource.write(message)
        self._rest()

    def _wait_at_most(self, within: float) -> None:
        """Set the resource's time-out [s]."""
        if self._allowed != within:
            self._resource.timeout = 1000 * within
            self._allowed = within

    def _rest(self) -> None:
        if self.pause:
            self._rested_at = self._clock.now() + self.pause

    def _discard_received(self) -> None:
        """Empty the pipe without waiting.

        pyvisa-py's own way waits 0.1 s at a bare socket, and for ever if the other side is gone: so its socket is
        looked at here.  Other libraries know how.
        """
        import pyvisa

        link, interface = _bare_socket(self._resource)
        if interface is None:
            self._resource.flush(pyvisa.constants.BufferOperation.discard_read_buffer)
            return
        link._pending_buffer.clear()
        while select.select([interface], [], [], 0)[0]:
            if not interface.recv(_CHUNK):
                raise ConnectionResetError("the other side has closed the connection")

    def query(self, message: str, *, patience: float = 0.0) -> str:
        """Ask; see :class:`Transport`."""
        self._begin(message)
        within = self.timeout + patience
        with self._translated_errors(message, within):
            self._send(message)
            self._wait_at_most(within)
            # more than the longest answer without an end is noise: it is left for the next resynchronisation
            answer = self._resource.read_bytes(_LONGEST_ANSWER, chunk_size=_TEXT_CHUNK, break_on_termchar=True)
            self._rest()
            self._record("<", answer)
            text = answer.decode("ascii")
        return text.strip()

    def query_block(self, message: str, *, patience: float = 0.0, form: BlockForm = PLAIN_BLOCK) -> bytes:
        """Ask for a block; see :class:`Transport`."""
        self._begin(message)
        within = self.timeout + patience
        with self._translated_errors(message, within):
            self._send(message)
            self._wait_at_most(within)
            block = self._block(form)
            self._rest()
            self._record("<", block if len(block) <= _SHORT else block[:_SHORT] + b"... (%d bytes)" % len(block))
        return block

    def _block(self, form: BlockForm) -> bytes:
        self._resource.read_termination = None  # a line feed in the block is a byte like any other
        try:
            if not self._stream:
                return block_of(self._resource.read_raw(_CHUNK), form)
            return read_block(lambda count: self._resource.read_bytes(count, chunk_size=_CHUNK) if count else b"", form)
        finally:
            self._resource.read_termination = "\n"

    def clear(self) -> None:
        """Resynchronise: a late answer to an old question never reaches the driver.  Raises NotConnected."""
        if self._log:
            self._record(">", b"(device clear)")
        if self.address.upper().endswith(_BARE_SOCKET):
            self.reopen()
        elif self._stream:
            self._drain_line()
        else:
            try:
                self._wait_at_most(self.timeout)
                self._resource.clear()
            except NotImplementedError:
                pass
            except Exception:  # noqa: BLE001 - pyvisa-py's HiSLIP raises RuntimeError when an answer came meanwhile
                self.reopen()
        self._out_of_step = False

    def _drain_line(self) -> None:
        """A serial line has no clear: ask who is there, and drop all that comes before the answer to that.

        Answers come in the order of the questions; one for each time that this was asked in vain is dropped, too.
        Raises NoAnswer when none comes: the line is still out of step then.
        """
        due, self._identities_due, self._out_of_step = self._identities_due + 1, 0, False
        with self._translated_errors(_WHO, self.timeout):
            self._send("")  # ends what may have been sent in part
            self._record(">", _WHO.encode())
            self._send(_WHO)
            self._read_identities(due)
            self._rest()

    def _read_identities(self, due: int) -> None:
        """Lines up to so many names; fewer where a time-out tells that the other questions were never heard."""
        import pyvisa

        seen, deadline = 0, time.monotonic() + 10 * self.timeout
        while seen < due:
            try:
                line = self._resource.read_bytes(_LONGEST_ANSWER, break_on_termchar=True)
            except pyvisa.VisaIOError:
                if seen:
                    return
                raise
            self._record("<", line)
            seen += bool(_IDENTITY.fullmatch(line))
            if time.monotonic() > deadline:
                raise BrokenBlock("one line after the other, and no name among them")

    def reopen(self) -> None:
        """Open the resource anew; see :class:`Transport`."""
        self._check_open()
        with contextlib.suppress(Exception):  # it may be gone for good
            self._resource.close()
        self._resource = self._open()
        self._out_of_step = False
        if self._locked:
            self.lock()

    def lock(self) -> None:
        """Exclusive access until it is closed, over a link made anew, too; see :class:`Transport`."""
        import pyvisa

        self._check_open()
        try:
            self._resource.lock_excl(timeout=1000 * self.timeout)
        except pyvisa.VisaIOError as error:
            if error.error_code in _HELD_BY_ANOTHER:
                raise Occupied(self.address) from error
            # interfaces without locks are no trouble: bare sockets, serial lines, and what pyvisa-py does not lock
            if error.error_code not in _HAS_NO_LOCKS:
                raise NotConnected(self.address, f"it could not be locked ({error.description})") from error
        except NotImplementedError:
            pass
        except (EOFError, OSError, RuntimeError, KeyError) as error:  # of pyvisa-py's VXI-11, when the link breaks
            raise NotConnected(self.address, f"it could not be locked ({error!r})") from error
        self._locked = True

    def _check_open(self) -> None:
        if self._closed:
            raise NotConnected(self.address, CLOSED)

    def close(self) -> None:
        """Close the resource; see :class:`Transport`."""
        self._closed = True
        self._resource.close()

    def _record(self, direction: str, data: bytes) -> None:
        if self._log:
            self._log(self.address, direction, data if data.endswith(b"\n") else data + b"\n")

    @contextlib.contextmanager
    def _translated_errors(self, question: str, within: float) -> Any:
        """PyVISA's errors as ours; afterwards the next exchange starts from a clean pipe."""
        import pyvisa

        try:
            yield
        except pyvisa.VisaIOError as error:
            self._out_of_step = True
            self._identities_due += question == _WHO
            if error.error_code == pyvisa.constants.StatusCode.error_timeout:
                silence = SilentLine if self.address.upper().startswith("ASRL") else NoAnswer
                raise silence(self.address, question, within) from error
            raise NotConnected(self.address, _broken(question, error)) from error
        except BrokenBlock as error:
            self._out_of_step = True
            raise BadAnswer(self.address, question, error.seen, "a definite-length block") from error
        except UnicodeDecodeError as error:
            self._out_of_step = True
            raise BadAnswer(self.address, question, repr(error.object[:40]), "plain text") from error
        except Exception as error:  # OSError, and whatever else pyvisa-py's protocols raise (EOFError, RPCError)
            self._out_of_step = True
            self._check_open()
            raise NotConnected(self.address, _broken(question, error)) from error
        except BaseException:
            # an interruption between question and answer leaves the answer in the pipe
            self._out_of_step = True
            raise


def _bare_socket(resource: Any) -> tuple[Any, socket.socket | None]:
    """pyvisa-py's session with a bare socket, and the socket; None from any other library."""
    link = getattr(resource.visalib, "sessions", {}).get(resource.session)
    interface = getattr(link, "interface", None)
    return link, interface if isinstance(interface, socket.socket) else None


def _send_at_once(resource: Any) -> None:
    """VISA's default (VPP-4.3, VI_ATTR_TCPIP_NODELAY), which pyvisa-py leaves out and has no switch for.

    Without it a message that follows one without an answer waits until that one is acknowledged: 0.04 s.
    """
    _, interface = _bare_socket(resource)
    if interface is not None:
        interface.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def addresses(library: str | VisaLibraryBase) -> tuple[str, ...]:
    """The resource names that a PyVISA library finds by itself, serial ports included.  Raises NotConnected."""
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


def _broken(question: str, error: BaseException) -> str:
    return f"no link at {question!r} ({one_line(error)}): check the address and the cable, and that it is on"
