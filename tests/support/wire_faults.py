"""Faults of a wire, one scripted fault at a time: what becomes of the bytes between a program and an instrument.

A :class:`Wire` decides, for each answer of the instrument and for each message to it, what arrives;
:class:`FaultyBench` applies it to the links within the process.
"""

import threading
from dataclasses import dataclass, field

from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.faults import LATE


@dataclass(frozen=True)
class Fault:
    """One fault, which strikes once.

    what: a name in ANSWERS or MESSAGES; at: so many answers (or messages) pass unharmed first; place: where in it, as a
    share of its length; junk: bytes to put there, at least one; marked: where an interface marks the end of a message,
    whether that mark still comes.
    """

    what: str
    at: int = 0
    place: float = 0.0
    junk: bytes = b"\xff"
    marked: bool = True

    @property
    def toward(self):
        """Whether it strikes what goes to the instrument."""
        return self.what in MESSAGES


@dataclass
class Delivery:
    """What arrives of an answer.

    now: the bytes, None: nothing; later: bytes that come ahead of the next answer; marked: as in Fault; ended: the
    connection ends after them.
    """

    now: bytes | None
    later: bytes | None = None
    marked: bool = True
    ended: bool = False


@dataclass(frozen=True)
class Blow:
    """What a fault strikes.  data: the answer or the message; before: the answer before it."""

    data: bytes
    fault: Fault
    before: bytes = b""


def _place(blow, length):
    return int(blow.fault.place * length)


def _cut(blow):
    return blow.data[: _place(blow, len(blow.data))]


def _gap(blow):
    """Bytes are lost within it, as many as there is junk; its end is there."""
    lost = len(blow.fault.junk)
    start = _place(blow, max(0, len(blow.data.rstrip(b"\r\n")) - lost))
    return blow.data[:start] + blow.data[start + lost :]


def _garbled(blow):
    data, junk = blow.data, blow.fault.junk
    start = _place(blow, len(data))
    return data[:start] + junk[: len(data) - start] + data[start + len(junk) :]


def _digit(blow):
    """One digit of it is another one."""
    data = blow.data
    places = [n for n, byte in enumerate(data) if byte in b"0123456789"]
    if not places:
        return _garbled(blow)
    where = places[_place(blow, len(places))]
    other = ord("0") + (data[where] - ord("0") + 1 + blow.fault.junk[0] % 9) % 10
    return data[:where] + bytes([other]) + data[where + 1 :]


#: What arrives of an answer.
ANSWERS = {
    "withheld": lambda _: Delivery(None),
    "late": lambda blow: Delivery(None, later=blow.data),
    "cut": lambda blow: Delivery(_cut(blow), marked=blow.fault.marked),
    "gap": lambda blow: Delivery(_gap(blow)),
    "ended": lambda blow: Delivery(_cut(blow), marked=False, ended=True),
    "doubled": lambda blow: Delivery(blow.data * 2),
    "doubled later": lambda blow: Delivery(blow.data, later=blow.data),
    "garbled": lambda blow: Delivery(_garbled(blow)),
    "another digit": lambda blow: Delivery(_digit(blow)),
    "another answer": lambda blow: Delivery(blow.fault.junk, marked=blow.fault.marked),
    "merged": lambda blow: Delivery((blow.before if blow.fault.marked else blow.fault.junk + b"\n") + blow.data),
    "rubbish before": lambda blow: Delivery(blow.fault.junk + blow.data),
    "rubbish behind": lambda blow: Delivery(blow.data + blow.fault.junk),
}
#: The messages that arrive instead of one to the instrument.
MESSAGES = {
    "message lost": lambda _: (),
    "message cut": lambda blow: (_cut(blow),),
    "message garbled": lambda blow: (_garbled(blow),),
    "message doubled": lambda blow: (blow.data, blow.data),
}


@dataclass
class Struck:
    """What a fault has struck.  question: the message; honest: the answer; arrived: of it, or of the message."""

    what: str
    question: bytes
    honest: bytes
    arrived: bytes


@dataclass
class Wire:
    """The wire of one instrument: at most one fault is on it.

    heard: what the instrument heard and answered, as Tapped keeps it; answers, messages: so many.  All since a fault
    was armed.
    """

    heard: list = field(default_factory=list)
    fault: Fault | None = None
    struck: list[Struck] = field(default_factory=list)
    answers: int = 0
    messages: int = 0
    _before: bytes = b""
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def arm(self, fault):
        """Let this fault strike; None: no more."""
        with self._lock:
            self.fault, self.answers, self.messages, self.struck = fault, 0, 0, []
            self.heard.clear()

    def answer(self, question, answer):
        """What arrives of an answer to this question."""
        with self._lock:
            fault, before, seen = self.fault, self._before, self.answers
            self._before, self.answers = answer, seen + 1
            if fault is None or fault.toward or seen != fault.at:
                return Delivery(answer)
            delivery = ANSWERS[fault.what](Blow(answer, fault, before))
            self.note(question, answer, delivery.now or b"")
            return delivery

    def note(self, question, honest, arrived):
        """Remember what was struck."""
        with self._lock:
            self.struck.append(Struck(self.fault.what if self.fault else "", question, honest, arrived))

    def message(self, message):
        """The messages that arrive instead of this one."""
        with self._lock:
            fault, seen = self.fault, self.messages
            self.messages = seen + 1
            if fault is None or not fault.toward or seen != fault.at:
                return (message,)
            arriving = MESSAGES[fault.what](Blow(message, fault))
            self.note(message, b"", b"".join(arriving))
            return arriving


class FaultyBench(VirtualBench):
    """A bench whose links have the faults of a wire.

    Time is the bench's: a late answer comes after `LATE` seconds; on a stream one that comes twice comes again with the
    next.
    """

    def __init__(self, instruments, wire):
        super().__init__(instruments)
        self.wire = wire
        self.faults.append(_OnTheBus(wire))

    def session(self, device, *, stream):
        """A link on which messages suffer, too."""
        session = super().session(device, stream=stream)
        sound = session.write

        def write(data, *, end=True):
            # the end of a message is no byte of it, but on a stream it is
            for line in data.splitlines(keepends=True) if stream else [data]:
                for arriving in self.wire.message(line):
                    sound(arriving, end=end)

        session.write = write
        return session


@dataclass
class _OnTheBus:
    """The faults of answers, as :class:`instruments.virtual.bench.session.AnswerFault`."""

    wire: Wire
    _question: bytes = b""
    _held: tuple = ()

    def strikes(self, message):
        """Every answer goes over the wire."""
        self._question = message.encode("latin-1")
        return True

    def act(self, session, answer):
        """What becomes of the answer."""
        delivery = self.wire.answer(self._question, answer.data)
        held = self._held[1] if self._held and self._held[0] is session else b""
        self._held = ()
        if delivery.now is None:
            return answer._replace(ready=answer.ready + LATE) if delivery.later is not None else None
        if delivery.later is not None and session.stream:
            self._held = (session, delivery.later)
        if held:
            self.wire.note(self._question, answer.data, held + delivery.now)
        if delivery.ended:
            session.lost_after = len(delivery.now)
        # on a stream nothing but a line feed is an end
        complete = answer.complete and delivery.marked and (delivery.now == answer.data or not session.stream)
        return answer._replace(data=held + delivery.now, complete=complete)


class Tapped:
    """A virtual instrument, and what it was asked and has answered: message, answer, whether it reported an error."""

    def __init__(self, device, heard):
        self.device, self.heard = device, heard

    def __getattr__(self, name):
        return getattr(self.device, name)

    def steps(self, message):
        """Run a message, in steps; see VirtualInstrument."""
        before = len(self.device.parser.errors)
        answer = yield from self.device.steps(message)
        complained = len(self.device.parser.errors) > before
        self.heard.append((message, answer.data if answer else b"", complained))
        return answer
