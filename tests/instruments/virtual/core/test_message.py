"""Where a message ends: streams cut anywhere give the same messages, blocks may hold any byte, nothing grows."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.virtual.core.message import LONGEST_LINE, Framer, Overrun, split_parameters, split_units


def block(data):
    return b"#%d%d%s" % (len(str(len(data))), len(data), data)


WORDS = st.sampled_from([b"FREQ 40", b"*IDN?", b'TEXT "a #12b;c"', b"DATA (@1,2)", b"", b"X #H1F", b"X #0abc"])
MESSAGES = st.one_of(
    WORDS, st.binary(max_size=40).map(lambda data: b"DATA " + block(data)),
    st.binary(max_size=9).map(lambda data: b"DATA name, " + block(data) + b" ;*OPC?"),
)  # fmt: skip


@given(messages=st.lists(MESSAGES, max_size=6), cuts=st.lists(st.integers(0, 300), max_size=12))
def test_a_stream_gives_the_same_messages_wherever_it_is_cut(messages, cuts):
    stream = b"".join(message + b"\n" for message in messages)
    framer, got = Framer(), []
    at = 0
    for cut in [*sorted(c for c in cuts if c < len(stream)), len(stream)]:
        got += framer.feed(stream[at:cut])
        at = max(at, cut)
    assert got == [message.decode("latin-1") for message in messages]


@given(data=st.binary(max_size=60))
def test_a_block_reaches_its_command_byte_for_byte(data):
    (message,) = Framer().feed(b"DATA:ARB name," + block(data) + b";*OPC? \r\n")
    first, second = split_units(message)
    assert second == "*OPC?"
    assert list(split_parameters(first.partition(" ")[2])) == ["name", block(data).decode("latin-1")]


@given(pieces=st.lists(st.binary(max_size=60), max_size=30))
def test_after_whatever_noise_and_a_clear_a_message_is_a_message(pieces):
    framer = Framer()
    for piece in pieces:
        framer.feed(piece)
    framer.clear()
    assert framer.feed(b"*IDN?\n") == ["*IDN?"]


def test_a_line_without_end_is_dropped_with_one_overrun():
    framer, results = Framer(), []
    for _ in range(8):
        results += framer.feed(b"x" * (LONGEST_LINE // 2))
        assert len(framer._buffer) <= 2 * LONGEST_LINE
    assert [type(one) for one in results] == [Overrun]
    assert framer.feed(b"x\n*IDN?\n") == ["*IDN?"]


@pytest.mark.parametrize(
    ("sent", "message"),
    [(b"*IDN?", "*IDN?"), (b"*IDN?\r\n", "*IDN?"), (b"D #12ab", "D #12ab"), (b"D #12a\n", "D #12a\n")],
)
def test_a_mark_of_the_interface_ends_a_message_as_a_line_feed_does(sent, message):
    framer = Framer()
    assert framer.feed(sent, marked=True) == [message]
    assert not framer.begun


def test_a_block_that_says_that_it_is_endless_is_a_line():
    assert Framer().feed(b"DATA #9999999999x\n*IDN?\n") == ["DATA #9999999999x", "*IDN?"]
