"""Where the virtual instruments are plugged in: addresses, and the links that programs open to them."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from instruments.virtual.framing import Framer, Overrun
from instruments.virtual.scpi import ScpiError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from instruments.virtual.device import Answer, VirtualInstrument


@dataclass
class Bus:
    """The instruments of one virtual bench by resource name.

    lock: whoever lets an instrument work holds it; servers do so from several threads.
    """

    instruments: Mapping[str, VirtualInstrument]
    lock: threading.RLock = field(default_factory=threading.RLock)

    def open(self, address: str) -> Session | None:
        """A session with the instrument at this address (any case), or None if there is none."""
        wanted = address.upper()
        found = (device for name, device in self.instruments.items() if name.upper() == wanted)
        device = next(found, None)
        if device is None:
            return None
        return self.session(device, stream=wanted.startswith("ASRL") or wanted.endswith("::SOCKET"))

    def session(self, device: VirtualInstrument, *, stream: bool) -> Session:
        """A link to one of the instruments."""
        return Session(device, stream=stream, lock=self.lock)


@dataclass
class Session:
    """One program's link to one instrument.

    stream: bytes without ends, as over a serial line or a bare socket: a line feed ends a message, and answers follow
    each other.  Else the interface marks the end of a message (GPIB, USBTMC, VXI-11, HiSLIP), and a question that is
    sent before the last answer was read interrupts that one (IEEE 488.2, 6.3.2.3).
    """

    device: VirtualInstrument
    stream: bool = False
    lock: threading.RLock = field(default_factory=threading.RLock)
    _framer: Framer = field(default_factory=Framer)
    _answers: deque[Answer] = field(default_factory=deque)
    _rest: bytes = b""
    _asked: bool = False  # something was sent since the last answer was read

    def write(self, data: bytes, *, end: bool = True) -> None:
        """Bytes for the instrument; it works on every message that they complete.  end: marked by the interface."""
        with self.lock:
            # END takes the place of a line feed if there is none (IEEE 488.2, 7.5)
            for message in self._framer.feed(data + b"\n" if end and not self.stream else data):
                if isinstance(message, Overrun):
                    self.device.parser.report(ScpiError(-363))
                elif message:
                    self._run(message)

    def _run(self, message: str) -> None:
        self._drop_what_is_abandoned()
        if not self.stream and (self._answers or self._rest):
            self.device.parser.report(ScpiError(-410))
            self._answers.clear()
            self._rest = b""
        self._asked = True
        answer = self.device.execute(message)
        self._drop_what_is_abandoned()
        if answer is not None:
            self._answers.append(answer)

    def _drop_what_is_abandoned(self) -> None:
        while self._answers and self._answers[0].epoch != self.device.epoch:
            self._answers.popleft()

    def ready(self) -> float | None:
        """When the next bytes are there [s], or None if none are under way."""
        with self.lock:
            self._drop_what_is_abandoned()
            if self._rest:
                return self.device.clock.now()
            return self._answers[0].ready if self._answers else None

    def read(self, count: int, timeout: float) -> tuple[bytes, bool] | None:
        """At most count bytes of the answer and whether that was its end; None after the timeout [s]."""
        clock = self.device.clock
        ready = self.ready()
        if ready is None or ready > clock.now() + timeout:
            self._note_silence(ready)
            clock.sleep(timeout)
            return None
        clock.sleep(max(0.0, ready - clock.now()))
        return self.take(count)

    def take(self, count: int) -> tuple[bytes, bool]:
        """At most count bytes of what is ready, and whether the answer ends with them."""
        with self.lock:
            if not self._rest and self._answers:
                self._rest = self._answers.popleft().data
            self._asked = False
            chunk, self._rest = self._rest[:count], self._rest[count:]
            return chunk, not self._rest

    def _note_silence(self, ready: float | None) -> None:
        """A reader who waits for what nobody asked: IEEE 488.2, 6.3.2.2."""
        with self.lock:
            if ready is None and not self.stream and not self._asked:
                self.device.parser.report(ScpiError(-420))

    def clear(self) -> None:
        """Device clear: what is under way in either direction is dropped, settings stay."""
        with self.lock:
            self._framer.clear()
            self._answers.clear()
            self._rest = b""
            self.device.abandon()

    def status_byte(self) -> int:
        """What a serial poll gives."""
        with self.lock:
            ready = self.ready()
            there = ready is not None and ready <= self.device.clock.now()
            return self.device.status_byte(message_available=there)
