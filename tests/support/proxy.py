"""A proxy between a program and the servers of the virtual bench, which does to the bytes what a wire may do.

One thread moves all bytes, so the order in which they arrive does not depend on the machine's load: what belongs
together is sent in one segment.
"""

import contextlib
import re
import selectors
import socket
import struct
import threading

LOOPBACK = "127.0.0.1"
_MOST = 1 << 20


class Lines:
    """Bare sockets: a line feed ends a message and an answer, or the length of a block does."""

    def __init__(self, wire):
        self.wire = wire
        self._near, self._far, self._held = b"", b"", b""
        self._due, self._gathered = 1, b""

    def toward(self, data):
        """What goes to the instrument of these bytes."""
        self._near += data
        while end := self._near.find(b"\n") + 1:
            message, self._near = self._near[:end], self._near[end:]
            arriving = self.wire.message(message)
            self._due, self._gathered = max(1, len(arriving)), b""
            yield b"".join(arriving)

    def back(self, data):
        """What comes back to the program of these bytes, and whether the connection ends then."""
        self._far += data
        while (end := self._end()) is not None:
            answer, self._far = self._far[:end], self._far[end:]
            self._gathered += answer
            self._due -= 1
            if self._due <= 0:  # else the message was doubled: both answers come in one segment
                whole, self._gathered = self._gathered, b""
                yield self._delivered(self.wire.question(answer), whole)

    def _delivered(self, question, answer):
        delivery = self.wire.answer(question, answer)
        held, self._held = self._held, delivery.later or b""
        if delivery.now is None:
            return held, False
        now = delivery.now
        if delivery.spoil:
            now = delivery.spoil(now)
            self.wire.struck[-1].arrived = now
        if held:
            self.wire.note(question, answer, held + now)
        return held + now, delivery.ended

    def _end(self):
        head = re.match(rb"([^#\n]{0,16})#([1-9])", self._far)
        if head:
            data = head.end() + int(head[2])
            if len(self._far) < data:
                return None
            end = data + int(self._far[head.end() : data])
            # behind a header, as Siglent has it, two line feeds end a block
            feed = self._far.find(b"\n\n" if head[1] else b"\n", end) + 1
            return feed + bool(head[1]) if feed else None
        return (self._far.find(b"\n") + 1) or None


class _Frames:
    """Protocols whose bytes come in frames."""

    def __init__(self, wire):
        self.wire = wire
        self._near, self._far, self._held = b"", b"", b""

    def _split(self, buffer):
        """The first frame and the rest, or None."""
        raise NotImplementedError

    def toward(self, data):
        """See Lines."""
        self._near += data
        while found := self._split(self._near):
            frame, self._near = found
            message = self.message_in(frame)
            if message is None:
                yield frame
                continue
            yield b"".join(self.framed_message(frame, sent) for sent in self.wire.message(message))

    def back(self, data):
        """See Lines."""
        self._far += data
        while found := self._split(self._far):
            frame, self._far = found
            answer = self.answer_in(frame)
            if answer is None:
                held, self._held = self._held, b""
                yield held + frame, False
            else:
                yield self._delivered(frame, answer)

    def _delivered(self, frame, answer):
        delivery = self.wire.answer(self.wire.question(answer), answer)
        held, self._held = self._held, b""
        if delivery.later is not None:
            self._held = self.framed_answer(frame, delivery.later, marked=True)
        if delivery.now is None:
            return held, False
        now = self.framed_answer(frame, delivery.now, marked=delivery.marked)
        if delivery.spoil:
            now = delivery.spoil(now)
            with contextlib.suppress(struct.error, IndexError):
                self.wire.struck[-1].arrived = self.answer_in(now) or b""
        return held + now, delivery.ended


class Hislip(_Frames):
    """HiSLIP: 16 bytes of header, the payload's length among them (IVI-6.1, 2.4)."""

    _DATA, _DATA_END = 6, 7

    def _split(self, buffer):
        if len(buffer) < 16:
            return None
        end = 16 + int.from_bytes(buffer[8:16])
        return (buffer[:end], buffer[end:]) if len(buffer) >= end else None

    def message_in(self, frame):
        """The message in a frame to the instrument, None if there is none."""
        return frame[16:] if frame[2] in {self._DATA, self._DATA_END} else None

    def answer_in(self, frame):
        """The answer in a frame to the program, None if there is none."""
        return frame[16 : 16 + int.from_bytes(frame[8:16])] if frame[2] in {self._DATA, self._DATA_END} else None

    def framed_message(self, frame, message):
        """The same frame around another message."""
        return frame[:8] + len(message).to_bytes(8) + message

    def framed_answer(self, frame, answer, *, marked):
        """The same frame around another answer; marked: as its end."""
        kind = frame[2:3] if marked else bytes([self._DATA])
        return frame[:2] + kind + frame[3:8] + len(answer).to_bytes(8) + answer


class Vxi11(_Frames):
    """VXI-11's core channel: records of remote procedure calls, one fragment each (RFC 5531, 11)."""

    _WRITE, _READ = 11, 12
    #: Header of the record, of the call without credentials, and of the reply [bytes].
    _MARK, _CALL, _REPLY = 4, 40, 24
    _END = 4

    def __init__(self, wire):
        super().__init__(wire)
        self._calls = {}

    def _split(self, buffer):
        if len(buffer) < self._MARK:
            return None
        end = self._MARK + (int.from_bytes(buffer[:4]) & 0x7FFFFFFF)
        return (buffer[:end], buffer[end:]) if len(buffer) >= end else None

    def message_in(self, frame):
        """See Hislip."""
        number, procedure = (int.from_bytes(frame[start : start + 4]) for start in (4, 24))
        self._calls[number] = procedure
        if procedure != self._WRITE:
            return None
        start = self._MARK + self._CALL + 16
        size = int.from_bytes(frame[start : start + 4])
        return frame[start + 4 : start + 4 + size]

    def answer_in(self, frame):
        """See Hislip."""
        if self._calls.get(int.from_bytes(frame[4:8])) != self._READ:
            return None
        start = self._MARK + self._REPLY
        error, _, size = struct.unpack("!III", frame[start : start + 12])
        return frame[start + 12 : start + 12 + size] if error == 0 and size else None

    def framed_message(self, frame, message):
        """See Hislip."""
        start = self._MARK + self._CALL + 16
        return self._record(frame[self._MARK : start] + _opaque(message))

    def framed_answer(self, frame, answer, *, marked):
        """See Hislip."""
        start = self._MARK + self._REPLY
        reason = int.from_bytes(frame[start + 4 : start + 8]) if marked else 0
        return self._record(frame[self._MARK : start + 4] + struct.pack("!I", reason) + _opaque(answer))

    def _record(self, body):
        return struct.pack("!I", 1 << 31 | len(body)) + body


def _opaque(data):
    return struct.pack("!I", len(data)) + data + b"\0" * (-len(data) % 4)


FRAMINGS = {"socket": Lines, "hislip": Hislip, "vxi11": Vxi11}


class Proxy:
    """Stands before a server at a port of loopback, from ``with`` to its end.

    wire: what happens to the bytes; framing: a name in FRAMINGS; port: where programs connect.
    """

    def __init__(self, far_port, wire, framing):
        self._far_port, self._wire, self._framing = far_port, wire, FRAMINGS[framing]
        self._selector = selectors.DefaultSelector()
        self._pairs = {}
        self._woken, self._wake = socket.socketpair()
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._listening = socket.create_server((LOOPBACK, 0))
        self.port = self._listening.getsockname()[1]
        self._selector.register(self._listening, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._run, name="proxy")

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._wake.send(b"end")
        self._thread.join()
        for end in list(self._pairs):
            self._part(end)
        for each in (self._listening, self._woken, self._wake):
            each.close()
        self._selector.close()

    def _join(self, near):
        far = socket.create_connection((LOOPBACK, self._far_port))
        for end in (near, far):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._selector.register(end, selectors.EVENT_READ)
        link = self._framing(self._wire)
        self._pairs[near], self._pairs[far] = (far, link.toward), (near, link.back)

    def _part(self, end):
        if end not in self._pairs:
            return
        other, _ = self._pairs[end]
        for each in (end, other):
            self._selector.unregister(each)
            del self._pairs[each]
            each.close()

    def _run(self):
        while True:
            for key, _ in self._selector.select():
                if key.fileobj is self._woken:
                    return
                if key.fileobj is self._listening:
                    near, _ = self._listening.accept()
                    self._join(near)
                elif key.fileobj in self._pairs:
                    self._move(key.fileobj)

    def _move(self, end):
        other, through = self._pairs[end]
        try:
            data = end.recv(_MOST)
            if not data:
                self._part(end)
                return
            for item in through(data):
                segment, ended = item if isinstance(item, tuple) else (item, False)
                if segment:
                    other.sendall(segment)
                if ended:
                    self._part(end)
                    return
        except OSError:
            self._part(end)
