"""Messages and their bytes: what goes in comes out, and anything else is no message."""

import math
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levilab.telemetry.codec import MalformedMessage
from levilab.telemetry.messages import Counting, Drive, Poses, Record, State, decode, encode

numbers = st.floats(allow_nan=False, allow_infinity=False)
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
maybe = st.none() | numbers
drives = st.builds(Drive, texts, numbers, numbers, numbers, st.booleans())
states = st.builds(
    State,
    time_s=numbers,
    elapsed_s=maybe,
    experiment=texts,
    folder=texts,
    text=texts,
    share=maybe,
    time_left_s=maybe,
    least_left_s=maybe,
    readings=st.integers(0, 10**9),
    events=st.integers(0, 10**9),
    last=st.dictionaries(texts, numbers, max_size=5),
    drive=st.none() | drives,
    counting=st.none() | st.builds(Counting, numbers, numbers, st.integers(1, 2)),
    lost=st.lists(texts, max_size=3).map(tuple),
    virtual=st.booleans(),
    speed=maybe,
    paused=st.booleans(),
    probe_m=maybe,
    busy=st.booleans(),
)


#: A head of poses with shapes of its arrays, for 32 bytes of them.
POSES = (
    '{"kind":"poses","start_s":0,"step_s":1,"position":{"$array":["<f4",%s,0]},'
    '"quaternion":{"$array":["<f4",%s,12]},"up":{"$array":["|b1",%s,28]}}'
)


def floats(rows, width):
    return np.random.default_rng(rows).normal(size=(rows, width) if width > 1 else rows).astype(np.float32)


records = st.builds(
    lambda n, channel, time: Record(n, channel, time, -0.1, 1e-4, floats(n, 1), floats(n, 1) + 1),
    st.integers(0, 1200),
    texts,
    numbers,
)
poses = st.builds(
    lambda n, at: Poses(at, 0.0025, floats(n, 3), floats(n, 4), floats(n, 1) > 0), st.integers(0, 400), numbers
)
messages = st.one_of(states, records, poses)


def same(a, b):
    return type(a) is type(b) and all(
        np.array_equal(getattr(a, one.name), getattr(b, one.name))
        if isinstance(getattr(a, one.name), np.ndarray)
        else getattr(a, one.name) == getattr(b, one.name)
        for one in fields(a)
    )


@given(messages)
def test_a_message_comes_out_as_it_went_in(message):
    assert same(decode(encode(message)), message)


@given(messages, st.data())
def test_bytes_that_were_changed_are_a_message_or_none(message, data):
    sent = bytearray(encode(message))
    for _ in range(data.draw(st.integers(1, 4))):
        sent[data.draw(st.integers(0, len(sent) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(sent)))
    for bytes_ in (bytes(sent), bytes(sent[:cut])):
        try:
            decode(bytes_)
        except MalformedMessage:
            continue


@given(st.binary(max_size=300))
def test_any_bytes_are_no_message(data):
    with pytest.raises(MalformedMessage):
        decode(data)


@pytest.mark.parametrize(
    "head",
    [
        "[]", "null", '{"kind":"state"}', '{"kind":"other"}', '{"kind":"state","time_s":NaN}',
        '{"kind":"state","time_s":"<b>"}', '{"kind":["state"]}', "[" * 5000, POSES % ("[9,3]", "[9,4]", "[9]"),
        POSES % ("[1,3]", "[1,4]", "[2]"), POSES % ("[1]", "[1,4]", "[1]"), POSES % ("[-1,3]", "[1,4]", "[1]"),
        POSES % ("[1e3,3]", "[1,4]", "[1]"), POSES % ("7", "[1,4]", "[1]"), POSES % ("[0,3]", "[0,4]", "[0]") + "x",
    ],
)  # fmt: skip
def test_a_head_that_says_something_else_is_refused(head):
    with pytest.raises(MalformedMessage):
        decode(len(head).to_bytes(4, "little") + head.encode() + bytes(32))


def test_what_is_not_a_number_is_left_out_and_a_newer_key_ignored():
    sent = encode(State(1.0, share=math.nan, last={"a": math.inf, "b": 2.0}))
    assert decode(sent) == State(1.0, last={"b": 2.0})
    assert decode(sent.replace(b'"paused"', b'"newers"')) == State(1.0, last={"b": 2.0})
