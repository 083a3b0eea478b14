"""Links: what a driver needs of one, and the one implementation, messages over a port of bytes."""

import contextlib
import math
import re
from collections.abc import Callable, Iterator
from enum import Enum, auto
from typing import Protocol

from instruments.clock import Clock, WallClock
from instruments.errors import BadAnswer, InstrumentError, NoAnswer, NotConnected, Occupied
from instruments.ieee488 import PLAIN_BLOCK, BlockForm, BrokenBlock, block_of, read_block
from instruments.links.advice import CLOSED, one_line

#: Called with the address, ">" or "<", and the bytes that were sent or received.
TrafficLog = Callable[[str, str, bytes], None]

#: The longest answer that is text, and how many bytes of a block the traffic log has at most [bytes].
LONGEST_ANSWER, _LONGEST_LOGGED = 1 << 22, 64

#: The bytes of text on a wire.
_PLAIN = re.compile(rb"[\t\r\n -~]*")

#: The question that every instrument knows, and its answer: four fields, the first no number.
_WHO, _IDENTITY = "*IDN?", re.compile(rb"[A-Za-z][^,]*,[^,]*,[^,]*,[^,]*")


class Transport(Protocol):
    """Messages to and from one instrument.

    Attributes:
        address: of the instrument.
        timeout: how long to wait for an answer [s].
    """

    address: str
    timeout: float

    def write(self, message: str) -> None:
        """Send one message."""

    def query(self, message: str, *, patience: float = 0.0) -> str:
        """Send a question and return the answer without its line end.

        Args:
            message: the question.
            patience: how long the instrument works on its answer [s], in addition to the timeout.

        Raises:
            NoAnswer: nothing came in time.
        """

    def query_block(self, message: str, *, patience: float = 0.0, form: BlockForm = PLAIN_BLOCK) -> bytes:
        """Send a question and return the bytes of the definite-length block that answers it (IEEE 488.2, 8.7.9).

        A block may take longer than the time-out, but no pause within it may.

        Args:
            message: the question.
            patience: as in `query` [s].
            form: what surrounds the block.

        Raises:
            NoAnswer: nothing came in time.
            BadAnswer: the answer is no block, or one that breaks off.
        """

    def clear(self) -> None:
        """Drop what is under way in either direction."""

    def reopen(self) -> None:
        """Close the link and open it again.  Raises NotConnected, also after close()."""

    def lock(self) -> None:
        """Lock the instrument against other programs, where the interface can.  Raises Occupied where one has it."""

    def close(self) -> None:
        """Close the link for good.  Then all other methods raise NotConnected; closing twice does no harm."""


class Resynchronising(Enum):
    """How a link gets rid of late answers to old questions.

    Attributes:
        DEVICE_CLEAR: by the interface's own command (GPIB, USB, VXI-11, HiSLIP).
        NEW_LINK: by a new connection, as late answers are lost with the old one (bare sockets).
        QUESTION: by asking ``*IDN?`` and dropping all that comes before its answer, as instruments answer in the order
            of the questions (serial lines).
    """

    DEVICE_CLEAR = auto()
    NEW_LINK = auto()
    QUESTION = auto()


class Failure(Enum):
    """The meaning of an error of a port's library."""

    SILENCE = auto()
    OCCUPIED = auto()
    LOST = auto()


class Port(Protocol):
    """Bytes to and from one instrument, by some library.  `failure` gives the meaning of the library's errors.

    Attributes:
        resynchronising: how to get rid of late answers.
        text: the expected answer, as text.
        silence: the error of a question without an answer.
    """

    resynchronising: Resynchronising
    text: str
    silence: type[NoAnswer]

    def open(self) -> None:
        """Open the link.  Raises NotConnected, Occupied."""

    def close(self) -> None:
        """Close the link."""

    def send(self, data: bytes, within: float) -> None:
        """Send one message with its line end, in this time [s]."""

    def line(self, within: float) -> bytes:
        """Read an answer with its line end, up to LONGEST_ANSWER bytes; less, or an error, after this time [s]."""

    def exactly(self, count: int, within: float) -> bytes:
        """Read `count` bytes; fewer, or an error, where none come within this time [s]."""

    def message(self, within: float) -> bytes:
        """Read an answer of any bytes, where the interface marks its end."""

    def discard(self) -> None:
        """Drop what has come, without waiting."""

    def clear(self, within: float) -> None:
        """Clear the device, or else drop what is under way.  Raises NotImplementedError where neither is possible."""

    def lock(self, within: float) -> None:
        """Lock the instrument against other programs, where that is possible.  Raises Occupied, NotConnected."""

    def failure(self, error: Exception) -> Failure:
        """Return the meaning of an error of the library."""


class MessageLink:
    """Messages to and from one instrument over a port: they end with LF, answers with LF or CR LF.

    After a time-out, an answer that makes no sense or an interruption the link resynchronises before the next message,
    so that it takes no late answer for that to the next question; see :class:`Resynchronising`.  A lost link is opened
    again before the next message, as the plug may be in again.
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

        Args:
            port: to open.
            address: of the instrument, for messages.
            timeout: of one answer [s].
            pause: after each message and each answer, before the next message [s].
            clock: for the pause; by default the wall clock.
            log: called with all bytes.

        Raises:
            NotConnected: the port cannot be opened.
            Occupied: another program has it.
        """
        self.port, self.address, self.timeout, self.pause = port, address, timeout, pause
        self._clock: Clock = clock or WallClock()
        self._log = log
        self._out_of_step = self._lost = self._locked = self._closed = False
        self._identities_due = 0  # answers to *IDN? that may still come
        self._rested_at = -math.inf
        self._streams = port.resynchronising is not Resynchronising.DEVICE_CLEAR
        port.open()

    # --- messages ---

    def write(self, message: str) -> None:
        """Send one message; see :class:`Transport`."""
        self._begin(message)
        with self._translating_errors(message, self.timeout):
            self._send(message)

    def query(self, message: str, *, patience: float = 0.0) -> str:
        """Ask; see :class:`Transport`."""
        self._begin(message)
        within = self.timeout + patience
        with self._translating_errors(message, within):
            self._send(message)
            return self._line(message, within).decode("ascii").strip()

    def query_block(self, message: str, *, patience: float = 0.0, form: BlockForm = PLAIN_BLOCK) -> bytes:
        """Ask for a block; see :class:`Transport`."""
        self._begin(message)
        within = self.timeout + patience
        with self._translating_errors(message, within):
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
            with self._translating_errors(message, self.timeout):
                self._resynchronise()

    def _send(self, message: str) -> None:
        """Send one message, within the link's own time-out: patience is for answers only."""
        if self.pause and (rest := self._rested_at - self._clock.now()) > 0:
            self._clock.sleep(rest)
        if self._streams:  # what came before is no answer to this
            self.port.discard()
        line = message.encode("ascii", errors="replace") + b"\n"
        self._record(">", line)
        self.port.send(line, self.timeout)
        self._rest()

    def _line(self, question: str, within: float) -> bytes:
        """Read a line, without its end.  Raises NoAnswer, or _Garbled when it is no text."""
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
        with self._translating_errors("a clear", self.timeout):
            self.port.clear(self.timeout)

    def _resynchronise(self) -> None:
        """Remove the late answers; see :class:`Resynchronising`.  Raises NotConnected, NoAnswer."""
        if self.port.resynchronising is Resynchronising.QUESTION:
            self._ask_identity()
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

    def _ask_identity(self) -> None:
        """Ask ``*IDN?``, and read until its last answer has come; all before it is old.  Raises NoAnswer, _Garbled."""
        self._send("")  # ends a message that may have been sent in part
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
                if seen:  # the other answers were never sent
                    return
                raise missing or error from None
            if self._clock.now() > deadline:  # the instrument does not stop talking
                if not seen:
                    raise missing or self.port.silence(self.address, _WHO, self.timeout)
                return

    def _is_silence(self, error: Exception) -> bool:
        return isinstance(error, NoAnswer) or self.port.failure(error) is Failure.SILENCE

    # --- the link ---

    def reopen(self) -> None:
        """Open the link again; see :class:`Transport`."""
        self._check_open()
        self._lost = True  # if it cannot be opened, or locked again, now, then perhaps at the next message
        with contextlib.suppress(Exception):  # the link may be lost
            self.port.close()
        self.port.open()
        if self._locked:
            self.lock()
        self._lost = False
        # at a serial line the instrument may still be answering
        self._out_of_step = self.port.resynchronising is Resynchronising.QUESTION

    def lock(self) -> None:
        """Lock the instrument until close(); reopen() locks it again; see :class:`Transport`."""
        self._check_open()
        self.port.lock(self.timeout)
        self._locked = True

    def close(self) -> None:
        """Close the link; see :class:`Transport`."""
        self._closed = True
        with contextlib.suppress(Exception):  # the link may be lost
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
    def _translating_errors(self, question: str, within: float) -> Iterator[None]:
        """Translate what the port's library raises into our errors, and resynchronise before the next message."""
        try:
            yield
        except BaseException as error:
            # after any error, an interruption included, the answer may still come
            self._out_of_step = True
            self._identities_due += question == _WHO
            if isinstance(error, InstrumentError) or not isinstance(error, Exception):
                raise
            raise self._translate(error, question, within) from error

    def _translate(self, error: Exception, question: str, within: float) -> InstrumentError:
        if isinstance(error, _Garbled):
            return BadAnswer(self.address, question, repr(error.seen[:40]), self.port.text)
        if isinstance(error, BrokenBlock):
            return BadAnswer(self.address, question, error.seen, "a definite-length block")
        failure = self.port.failure(error)
        if failure is Failure.SILENCE:
            return self.port.silence(self.address, question, within)
        if failure is Failure.OCCUPIED:
            return Occupied(self.address)
        # a device clear or a new link notices by itself that the old link is lost
        self._lost = self.port.resynchronising is Resynchronising.QUESTION
        what = f"no link at {question!r} ({one_line(error)})"
        return NotConnected(self.address, f"{what}: check the address and the cable, and that it is on")


class _Garbled(Exception):
    """The bytes of an answer are no text."""

    def __init__(self, seen: bytes) -> None:
        self.seen = seen
        super().__init__(seen)
