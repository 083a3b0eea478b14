"""What every link does, whatever is behind it: VISA by messages and as a stream, a line by VISA and by pyserial."""

import contextlib
from unittest.mock import Mock

import pytest
import serial

from instruments.errors import BadAnswer, NoAnswer, NotConnected
from instruments.links.opening import open_link
from instruments.virtual.bench import protocol_levilab
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from support.slow import ANY_BYTES, IDENTITY, Slow

#: The address at the bench, and the one that a program uses where it is another.
WAYS = {
    "messages": ("TCPIP0::slow.levilab::inst0::INSTR", ""),
    "stream": ("TCPIP0::slow.levilab::5025::SOCKET", ""),
    "line": ("ASRLslow.levilab::INSTR", ""),
    "pyserial": ("ASRLslow::INSTR", "levilab://slow"),
}


@pytest.fixture(params=WAYS)
def link(request, clock, monkeypatch):
    address, port = WAYS[request.param]
    bench = VirtualBench({address: Slow(clock)})
    monkeypatch.setattr(
        serial, "protocol_handler_packages", [*serial.protocol_handler_packages, "instruments.virtual.bench"]
    )
    monkeypatch.setattr(protocol_levilab, "plugged", [bench])
    with contextlib.closing(open_link(port) if port else open_link(address, library=library_for(bench))) as link:
        yield link


def test_silence_raises_with_its_question_and_costs_virtual_time_only(link, clock):
    link.timeout = 3600.0
    with pytest.raises(NoAnswer) as silence:
        link.query("FOO?")
    assert (silence.value.question, silence.value.timeout) == ("FOO?", 3600.0)
    # an hour, in a test that takes none; a line takes a moment for a byte
    assert clock.now() == pytest.approx(3600.0, abs=0.1)


def test_an_answer_that_takes_its_time_needs_patience_each_time(link, clock):
    assert link.query("SLOW?", patience=4.0) == "slow"
    assert clock.now() == pytest.approx(5.0, abs=0.1)  # not the six seconds that it might have taken
    with pytest.raises(NoAnswer) as silence:
        link.query("SLOW?", patience=2.5)
    assert silence.value.timeout == 4.5
    clock.sleep(10.0)
    assert link.query("SLOW?", patience=4.0) == "slow"
    with pytest.raises(NoAnswer):
        link.query("SLOW?")


@pytest.mark.parametrize("later", [0.0, 0.5, 2.999, 3.0, 10.0])
@pytest.mark.parametrize("late", ["SLOW?", "*IDN?;SLOW?", "SLOW?;*IDN?"])
def test_a_late_answer_never_reaches_the_next_question(link, clock, late, later):
    link.timeout = 4.0
    with pytest.raises(NoAnswer):
        link.query(late)
    clock.sleep(later)
    assert [link.query(question) for question in ("LIST?", "*IDN?", "LIST?")] == ["1,2,1,1,1", IDENTITY, "1,2,1,1,1"]


def test_an_answer_without_a_question_is_dropped_before_the_next_question(link, clock):
    link.write("LIST?")
    clock.sleep(1.0)
    assert link.query("*IDN?") == IDENTITY


def test_an_interrupted_wait_leaves_no_answer_for_the_next_question(link, clock, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(clock, "sleep", Mock(side_effect=KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            link.query("SLOW?")
    clock.sleep(10.0)
    assert link.query("LIST?") == "1,2,1,1,1"


def test_an_answer_that_is_no_text_raises_and_is_forgotten(link):
    with pytest.raises(BadAnswer, match="expected plain text") as bad:
        link.query("BIN?")
    assert bad.value.question == "BIN?"
    assert link.query("*IDN?") == IDENTITY


def test_a_block_of_any_bytes_comes_whole(link):
    assert link.query_block("DATA?") == ANY_BYTES
    assert link.query("LIST?") == "1,2,1,1,1"


@pytest.mark.parametrize(("question", "error"), [("LIST?", BadAnswer), ("CUT?", BadAnswer), ("FOO?", NoAnswer)])
def test_what_is_no_block_raises_and_is_forgotten(link, question, error):
    with pytest.raises(error) as bad:
        link.query_block(question)
    assert bad.value.question == question
    assert link.query("LIST?") == "1,2,1,1,1"


def test_clearing_drops_what_is_under_way(link, clock):
    link.write("SLOW?")
    link.clear()
    clock.sleep(4.0)
    assert link.query("LIST?") == "1,2,1,1,1"


@pytest.mark.parametrize("act", ["query", "write", "query_block", "clear", "reopen", "lock"])
def test_a_closed_link_says_that_it_was_closed_whatever_it_is_used_for(link, act):
    link.close()
    link.close()
    with pytest.raises(NotConnected, match="this session was closed: open another one"):
        getattr(link, act)(*(["*IDN?"] if act in {"query", "write", "query_block"} else []))
