"""Definite-length blocks, as a stream and as a whole message: what is whole is read, what is broken is named."""

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.ieee488 import BrokenBlock, block_of, read_block

#: How instruments write the same block: the length with more digits than it needs, with one line end or another.
ENDS = st.sampled_from([b"\n", b"\r\n"])


def head(size, digits):
    return b"#%d%0*d" % (digits, digits, size)


@given(data=st.binary(max_size=200), digits=st.integers(3, 9), end=ENDS)
def test_a_block_comes_back_whole_and_nothing_behind_it_is_read(data, digits, end):
    stream = io.BytesIO(head(len(data), digits) + data + end + b"next\n")
    assert read_block(stream.read) == data
    assert stream.read() == b"next\n"
    assert block_of(head(len(data), digits) + data + end) == data


@given(data=st.binary(min_size=1, max_size=50), cut=st.integers(1, 60))
def test_a_block_that_breaks_off_is_named(data, cut):
    whole = head(len(data), 3) + data
    broken = whole[: max(0, len(whole) - cut)]
    with pytest.raises(BrokenBlock):
        read_block(io.BytesIO(broken).read)
    with pytest.raises(BrokenBlock):
        block_of(broken)


@pytest.mark.parametrize(
    ("message", "seen"),
    [
        (b"", "b''"),
        (b"+1.0\n", r"b'\+1"),
        (b"#0abc\n", "b'#0"),
        (b"#3a12xyz\n", "b'#3a12'"),
        (b"#12abc\n", "a block of 2 bytes that goes on with b'c"),
        (b"#13a\n", "2 bytes of a block of 3"),
        (b"#9999999999", "announces 999999999 bytes"),
    ],
)
def test_the_error_of_a_broken_block_quotes_what_was_seen(message, seen):
    for read in (block_of, lambda bytes_: read_block(io.BytesIO(bytes_).read)):
        with pytest.raises(BrokenBlock, match=seen):
            read(message)


@given(noise=st.binary(max_size=300))
def test_noise_is_a_block_or_is_refused(noise):
    for read in (block_of, lambda bytes_: read_block(io.BytesIO(bytes_).read)):
        try:
            data = read(noise)
        except BrokenBlock:
            continue
        assert data in noise


def test_a_block_that_lost_a_byte_is_not_completed_by_its_line_feed():
    with pytest.raises(BrokenBlock, match="goes on with b''"):
        block_of(b"#13\x00\x0a\n")
