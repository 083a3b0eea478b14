"""Text on streams that cannot carry all of Unicode."""

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from levilab.present.characters import SPELLED_OUT, for_encoding

ENCODINGS = ["ascii", "cp1252", "cp437", "latin-1", "utf-8"]


@pytest.mark.parametrize(
    ("text", "ascii_text"),
    [
        ("2.26(10)×10⁻⁴ (rad/s)^(1−n)/s", "2.26(10)e-4 (rad/s)^(1-n)/s"),
        ("1.760(16)×10⁻⁵", "1.760(16)e-5"),
        ("1.3×10⁴", "1.3e4"),
        ("< 10⁻⁶", "< 10^-6"),
        ("s⁻¹", "s^-1"),
        ("C₃/₂", "C3/2"),
        ("ω^−½", "omega^-1/2"),
        ("χ²/dof", "chi2/dof"),
        ("0.0 … 190.0", "0.0 ... 190.0"),
        ("39.93 → 21.75", "39.93 -> 21.75"),
        ("1 MΩ", "1 MOhm"),
    ],
)
def test_what_the_tables_show_is_spelled_in_ascii(text, ascii_text):
    assert for_encoding(text, "ascii") == ascii_text


def test_a_code_page_keeps_what_it_has():
    assert for_encoding("größe: 3 µs, ν²", "cp1252") == "größe: 3 µs, nu²"


@given(st.text(), st.sampled_from(ENCODINGS))
def test_any_text_can_be_written_afterwards(text, encoding):
    spelled = for_encoding(text, encoding)
    if encoding != "utf-8":
        spelled.encode(encoding)
        assert for_encoding(spelled, encoding) == spelled


@given(st.text(alphabet="0123456789e+-.() abcnu/^\n", max_size=50), st.sampled_from(ENCODINGS))
def test_plain_text_stays_as_it_is(text, encoding):
    assert for_encoding(text, encoding) == text


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_a_stream_spells_what_reaches_it_otherwise(encoding):
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding, errors=SPELLED_OUT)
    stream.write("levilab: 3.2×10⁻³ s⁻¹")
    stream.flush()
    assert raw.getvalue().decode(encoding).replace("×", "x") == "levilab: 3.2x10^-3 s^-1"
