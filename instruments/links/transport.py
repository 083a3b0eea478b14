"""What a driver needs of a link, and the one link that there is: messages over a port of bytes."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable
from enum import Enum, auto
from typing import TYPE_CHECKING, Protocol

from instruments.clock import WallClock
from instruments.errors import BadAnswer, InstrumentError, NoAnswer, NotConnected, Occupied
from instruments.ieee488 import PLAIN_BLOCK, BrokenBlock, block_of, read_block
from instruments.links.advice import CLOSED, one_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from instruments.clock import Clock
    from instruments.ieee488 import BlockForm

#: Called with the address, ">" or "<", and the bytes that were sent or received.
TrafficLog = Callable[[str, str, bytes], None]

#: The longest answer that is text [bytes]; of a block that is longer than the other the traffic log has so many bytes.
LONGEST_ANSWER, _LONGEST_LOGGED = 1 << 22, 64

#: What text on a wire consists of.
_PLAIN = re.compile(rb"[\t\r\n -~]*")

#: The question that every instrument knows, and its answer: four fields, the first no number.
_WHO, _IDENTITY = "*IDN?", re.compile(rb"[A-Za-z][^,]*,[^,]*,[^,]*,[^,]*")


class Transport(Protocol):
    """Messages to and from one instrument.  timeout: how long an answer is waited for [s]."""

    address: str
    timeout: float

    def write(self, message: str) -> None:
        """Send one message."""

    def query(self, message: str, *, patience: float = 0.0) -> str:
        """Send a question and return the answer without its line end.

        patience: how long the instrument works on this answer before it can send it [s]; added to the
        timeout.  Raises NoAnswer when nothing came in time.
        """

    def query_block(self, message: str, *, patience: float = 0.0, form: BlockForm = PLAIN_BLOCK) -> bytes:
        """Send a question and return the bytes of the definite-length block that answers it (IEEE 488.2, 8.7.9).

        form: what stands around the block.  A block may take longer than the time-out, but not be silent for so long.

        Raises NoAnswer as query does, BadAnswer when it is no block or one that breaks off.
        """

    def clear(self) -> None:
        """Drop whatever is under way in either direction."""

    def reopen(self) -> None:
        """Give the link up and make it anew.  Raises NotConnected, also after close()."""

    def lock(self) -> None:
        """Keep other programs from the instrument, where the interface can.  Raises Occupied if one has it."""

    def close(self) -> None:
        """Give the instrument back, for good.  Afterwards all else raises NotConnected; closing twice does no harm."""


class Resynchronising(Enum):
    """What removes the late answers to old questions from the way to an instrument.

    DEVICE_CLEAR: the interface's own command (GPIB, USB, VXI-11, HiSLIP).  NEW_LINK: a bare socket, where late answers
    are lost with their connection.  QUESTION: a serial line loses nothing, but instruments answer in the order in which
    they were asked: ``*IDN?`` is asked, and all is dropped that comes before its answer.
    """

    DEVICE_CLEAR = auto()
    NEW_LINK = auto()
    QUESTION = auto()


class Failure(Enum):
    """What an error of a port's library means."""

    SILENCE = auto()
    OCCUPIED = auto()
    LOST = auto()


class Port(Protocol):
    """Bytes to and from one instrument, by some library.  What that raises, `failure` explains.

    resynchronising: see there; text: what an answer is expected to be, in words; silence: the error of a question
    without an answer.
    """

    resynchronising: Resynchronising
    text: str
    silence: type[NoAnswer]

    def open(self) -> None:
        """Make the link.  Raises NotConnected, Occupied."""

    def close(self) -> None:
        """Give the link up."""

    def send(self, data: bytes, within: float) -> None:
        """Send one message with its line end, in this time [s]."""

    def line(self, within: float) -> bytes:
        """The next answer with its line end, at most LONGEST_ANSWER bytes; less, or an error, if time is up [s]."""

    def exactly(self, count: int, within: float) -> bytes:
        """So many bytes; fewer, or an error, if none come for so long [s]."""

    def message(self, within: float) -> bytes:
        """The next answer, of any bytes, where the interface marks its end."""

    def discard(self) -> None:
        """Drop, without waiting, what has come."""

    def clear(self, within: float) -> None:
        """Clear the device, or else drop what is under way.  Raises NotImplementedError where there is no such way."""

    def lock(self, within: float) -> None:
        """Keep other programs away, where that is possible.  Raises Occupied, NotConnected."""

    def failure(self, error: Exception) -> Failure:
        """What an error of the library means."""


class MessageLink:
    """Messages to and from one instrument over a port: they end with LF, answers with LF or CR LF.

    After a time-out, an answer that makes no sense or an interruption the link is resynchronised before the next
    message, so that no late answer is taken for that of the next question; see :class:`Resynchronising`.  A link that
    is lost is made anew before the next message: a plug may be in again.
    """

    def __init__(
        self,
        port: Port,
        address: str,
        *,
        timeout: float,
        pause: float = 0.0,
        clock: Clock | None = None,
        log: TrafficLog | None = None,
    ) -> None:
        """Open the port.

        timeout: of one answer [s]; pause: how long the instrument is left alone after each message and each answer [s];
        clock: by which, the wall's by default.  Raises NotConnected, Occupied.
        """
        self.port, self.address, self.timeout, self.pause = port, address, timeout, pause
        self._clock: Clock = clock or WallClock()
        self._log = log
        self._out_of_step = self._lost = self._locked = self._closed = False
        self._identities_due = 0  # answers to *IDN? that were not received, and may still come
        self._rested_at = -math.inf
        self._streams = port.resynchronising is not Resynchronising.DEVICE_CLEAR
        port.open()

    # --- messages ---

    def write(self, message: str) -> None:
        """Send one message; see :class:`Transport`."""
        self._begin(message)
        with self._translated_errors(message, self.timeout):
            self._send(message)

    def query(self, message: str, *, patience: float = 0.0) -> str:
        """Ask; see :class:`Transport`."""
        self._begin(message)
        within = self.timeout + patience
        with self._translated_errors(message, within):
            self._send(message)
            return self._line(message, within).decode("ascii").strip()

    def query_block(self, message: str, *, patience: float = 0.0, form: BlockForm = PLAIN_BLOCK) -> bytes:
        """Ask for a block; see :class:`Transport`."""
        self._begin(message)
        within = self.timeout + patience
        with self._translated_errors(message, within):
            self._send(message)
            block = self._block(message, within, form)
            self._rest()
            more = b"... (%d bytes)" % len(block) if len(block) > _LONGEST_LOGGED else b""
            self._record("<", block[:_LONGEST_LOGGED] + more)
        return block

    def _begin(self, message: str) -> None:
        self._check_open()
        if self._lost:
            self.reopen()
        if self._out_of_step:
            with self._translated_errors(message, self.timeout):
                self._resynchronise()

    def _send(self, message: str) -> None:
        """Send one message, within the link's own time-out: patience is for an answer."""
        if self.pause and (rest := self._rested_at - self._clock.now()) > 0:
            self._clock.sleep(rest)
        if self._streams:  # an answer that came unasked is no answer to this
            self.port.discard()
        line = message.encode("ascii", errors="replace") + b"\n"
        self._record(">", line)
        self.port.send(line, self.timeout)
        self._rest()

    def _line(self, question: str, within: float) -> bytes:
        """The next line without its end.  Raises NoAnswer, or _Garbled when it is no text."""
        line = self.port.line(within)
        self._rest()
        if line:
            self._record("<", line)
        if not _PLAIN.fullmatch(line) or len(line) >= LONGEST_ANSWER:
            raise _Garbled(line)
        if self._streams and not line.endswith(b"\n"):
            raise self.port.silence(self.address, question, within)
        return line.rstrip(b"\r\n")

    def _block(self, question: str, within: float, form: BlockForm) -> bytes:
        if not self._streams:
            return block_of(self.port.message(within), form)
        came = 0

        def read(count: int) -> bytes:
            nonlocal came
            data = self.port.exactly(count, within) if count else b""
            came += len(data)
            if not came:
                raise self.port.silence(self.address, question, within)
            return data

        return read_block(read, form)

    # --- late answers ---

    def clear(self) -> None:
        """Drop what is under way; see :class:`Transport`.  A serial line is resynchronised before the next message."""
        self._check_open()
        if self.port.resynchronising is not Resynchronising.QUESTION:
            self._resynchronise()
            return
        self._out_of_step = True
        with self._translated_errors("a clear", self.timeout):
            self.port.clear(self.timeout)

    def _resynchronise(self) -> None:
        """Remove the late answers; see :class:`Resynchronising`.  Raises NotConnected, NoAnswer."""
        if self.port.resynchronising is Resynchronising.QUESTION:
            self._ask_who_is_there()
        elif self.port.resynchronising is Resynchronising.NEW_LINK:
            self._record(">", b"(a new link)")
            self.reopen()
        else:
            self._record(">", b"(device clear)")
            try:
                self.port.clear(self.timeout)
            except NotImplementedError:
                pass
            except Exception:  # noqa: BLE001 - pyvisa-py's HiSLIP raises RuntimeError when an answer came meanwhile
                self.reopen()
        self._out_of_step, self._identities_due = False, 0

    def _ask_who_is_there(self) -> None:
        """Ask until the last answer to that has come; all before it is old.  Raises NoAnswer, _Garbled."""
        self._send("")  # ends what may have been sent in part
        self._identities_due += 1
        self._send(_WHO)
        deadline = self._clock.now() + self.timeout
        missing: Exception | None = None
        seen = 0
        while seen < self._identities_due:
            try:
                seen += bool(_IDENTITY.fullmatch(self._line(_WHO, self.timeout)))
            except _Garbled as error:
                missing = error
            except Exception as error:
                if not self._is_silence(error):
                    raise
                if seen:  # the others were never sent
                    return
                raise missing or error from None
            if self._clock.now() > deadline:  # it talks on and on
                if not seen:
                    raise missing or self.port.silence(self.address, _WHO, self.timeout)
                return

    def _is_silence(self, error: Exception) -> bool:
        return isinstance(error, NoAnswer) or self.port.failure(error) is Failure.SILENCE

    # --- the link ---

    def reopen(self) -> None:
        """Make the link anew; see :class:`Transport`."""
        self._check_open()
        self._lost = True  # if it cannot be opened, or locked again, now, then perhaps at the next message
        with contextlib.suppress(Exception):  # it may be gone for good
            self.port.close()
        self.port.open()
        if self._locked:
            self.lock()
        self._lost = False
        # at a serial line the instrument may still be answering
        self._out_of_step = self.port.resynchronising is Resynchronising.QUESTION

    def lock(self) -> None:
        """Keep other programs away until it is closed, over a link made anew, too; see :class:`Transport`."""
        self._check_open()
        self.port.lock(self.timeout)
        self._locked = True

    def close(self) -> None:
        """Give the instrument back; see :class:`Transport`."""
        self._closed = True
        with contextlib.suppress(Exception):  # it may be gone for good
            self.port.close()

    def _check_open(self) -> None:
        if self._closed:
            raise NotConnected(self.address, CLOSED)

    def _rest(self) -> None:
        if self.pause:
            self._rested_at = self._clock.now() + self.pause

    def _record(self, direction: str, data: bytes) -> None:
        if self._log:
            self._log(self.address, direction, data if data.endswith(b"\n") else data + b"\n")

    @contextlib.contextmanager
    def _translated_errors(self, question: str, within: float) -> Iterator[None]:
        """What the port's library raises, as ours; afterwards the next exchange starts from a clean link."""
        try:
            yield
        except BaseException as error:
            # whatever it was, an interruption included: the answer may still come
            self._out_of_step = True
            self._identities_due += question == _WHO
            if isinstance(error, InstrumentError) or not isinstance(error, Exception):
                raise
            raise self._translated(error, question, within) from error

    def _translated(self, error: Exception, question: str, within: float) -> InstrumentError:
        if isinstance(error, _Garbled):
            return BadAnswer(self.address, question, repr(error.seen[:40]), self.port.text)
        if isinstance(error, BrokenBlock):
            return BadAnswer(self.address, question, error.seen, "a definite-length block")
        failure = self.port.failure(error)
        if failure is Failure.SILENCE:
            return self.port.silence(self.address, question, within)
        if failure is Failure.OCCUPIED:
            return Occupied(self.address)
        # a device clear, or a new link, finds out by itself whether the old one is lost
        self._lost = self.port.resynchronising is Resynchronising.QUESTION
        what = f"no link at {question!r} ({one_line(error)})"
        return NotConnected(self.address, f"{what}: check the address and the cable, and that it is on")


class _Garbled(Exception):
    """What came is no text."""

    def __init__(self, seen: bytes) -> None:
        self.seen = seen
        super().__init__(seen)
