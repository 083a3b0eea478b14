"""The message link over a port that a test writes: what every link does, whatever library is behind it."""

from unittest.mock import Mock

import pytest

from instruments.errors import BadAnswer, NoAnswer, NotConnected, Occupied, SilentLine
from instruments.links.transport import LONGEST_ANSWER, Failure, MessageLink, Resynchronising

IDENTITY = b"levilab,port,0,0\r\n"


class Port:
    """Answers from a table; ``broken`` breaks the wire until it is opened again, ``away`` keeps it from opening."""

    text = "plain text"
    silence = SilentLine

    def __init__(self, resynchronising, clock, answers):
        self.resynchronising, self.clock, self.answers = resynchronising, clock, answers
        self.sent, self.came, self.opened = [], b"", 0
        self.broken = self.away = False

    def open(self):
        if self.away:
            raise NotConnected("port", "it is away")
        self.broken, self.opened, self.came = False, self.opened + 1, b""

    def send(self, data, within):
        if self.broken:
            raise ConnectionResetError("gone")
        self.sent.append(data)
        self.came += self.answers.get(data, b"")

    def line(self, within):
        line, end, rest = self.came.partition(b"\n")
        if not end:
            self.clock.sleep(within)
        self.came = rest
        return line + end

    def exactly(self, count, within):
        got, self.came = self.came[:count], self.came[count:]
        return got

    def message(self, within):
        return self.line(within)

    def discard(self): ...
    def close(self): ...
    def lock(self, within): ...

    def clear(self, within):
        if self.broken:
            raise ConnectionResetError("gone")
        self.came = b""

    def failure(self, error):
        return Failure.LOST


@pytest.fixture(params=list(Resynchronising), ids=lambda way: way.name)
def port(request, clock):
    return Port(request.param, clock, {b"*IDN?\n": IDENTITY, b"READ?\n": b"+1.0\r\n"})


def link(port):
    return MessageLink(port, "port", timeout=2.0, clock=port.clock)


def test_a_link_that_broke_is_made_anew_before_the_next_message(port):
    one = link(port)
    port.broken = True
    with pytest.raises(NotConnected, match="gone"):
        one.query("READ?")
    assert one.query("READ?") == "+1.0"
    assert port.opened == 2


def test_a_link_that_could_not_be_made_is_tried_at_each_message(port):
    one = link(port)
    one.query("READ?")
    port.broken = port.away = True
    for _ in range(2):
        with pytest.raises(NotConnected):
            one.reopen()
        with pytest.raises(NotConnected):
            one.query("READ?")
    port.away = False
    assert one.query("READ?") == "+1.0"


def test_a_serial_line_asks_who_is_there_after_each_new_start(clock):
    port = Port(Resynchronising.QUESTION, clock, {b"*IDN?\n": b"old\n" + IDENTITY, b"READ?\n": b"+1.0\n"})
    one = link(port)
    one.reopen()
    assert one.query("READ?") == "+1.0"
    assert port.sent == [b"\n", b"*IDN?\n", b"READ?\n"]


def test_a_name_that_comes_too_late_is_not_the_answer_to_the_next_question(clock):
    port = Port(Resynchronising.QUESTION, clock, {b"READ?\n": b"+1.0\n"})
    one = link(port)
    with pytest.raises(NoAnswer):
        one.query("*IDN?")
    port.answers[b"*IDN?\n"] = 2 * IDENTITY  # the late one, and the one that is asked for before the next message
    assert [one.query("READ?"), one.query("READ?")] == ["+1.0", "+1.0"]


def test_a_line_that_talks_on_without_a_name_is_silent_in_the_end(clock):
    port = Port(Resynchronising.QUESTION, clock, {})
    port.line = lambda _: clock.sleep(0.3) or b"+1.0\n"
    one = link(port)
    one.reopen()
    with pytest.raises(NoAnswer):
        one.query("READ?")
    assert clock.now() < 3.0


def test_an_answer_without_an_end_is_no_answer(port):
    one = link(port)
    port.answers[b"READ?\n"] = b"1" * LONGEST_ANSWER + b"\n"
    with pytest.raises(BadAnswer, match="expected plain text"):
        one.query("READ?")


def test_a_link_that_was_locked_is_locked_again_when_it_is_made_anew(port):
    locked = []
    port.lock = lambda _: locked.append(port.opened)
    one = link(port)
    one.lock()
    one.reopen()
    assert locked == [1, 2]


def test_nothing_is_sent_over_a_new_link_that_could_not_be_locked(port):
    one = link(port)
    one.lock()
    port.lock = Mock(side_effect=Occupied("port"))
    sent = list(port.sent)
    with pytest.raises(Occupied):
        one.reopen()
    with pytest.raises(Occupied):
        one.query("READ?")
    assert port.sent == sent
    port.lock = lambda _: None
    assert one.query("READ?") == "+1.0"
