"""The record of a virtual oscilloscope as blocks, texts and preambles."""

import struct

import numpy as np
import pytest

from support.scopes import block, configure, constant, keysight, noisy, pulses, rigol, rigol_stopped, rigol_volts
from support.wire import ask, errors, received, send


def test_a_block_of_the_rigol_byte_for_byte():
    device = rigol(constant(-0.936), "CHAN1:PROB 1;SCAL 0.2;OFFS 0")  # code 10: a line feed
    configure(device, ":WAV:STAR 1", ":WAV:STOP 5")
    send(device, b":WAV:DATA?\n")
    assert received(device, 1.0) == b"#9000000005\n\n\n\n\n\n"


def test_words_of_the_rigol_have_an_empty_upper_byte():
    device = rigol(constant(0.0), "CHAN1:PROB 1;SCAL 0.2;OFFS 0", ":WAV:FORM WORD", ":WAV:STOP 2")
    assert block(device, ":WAV:DATA?") == (b"#9000000004", b"\x7f\x00\x7f\x00")


def test_text_of_the_rigol_has_a_head_too():
    device = rigol(constant(0.2), "CHAN1:PROB 1;SCAL 0.2;OFFS 0", ":WAV:FORM ASC", ":WAV:STOP 2")
    assert block(device, ":WAV:DATA?") == (b"#9000000025", b"2.000000e-01,2.000000e-01")


def test_the_preamble_of_the_rigol_is_the_one_of_the_guide():
    device = rigol(pulses, "CHAN1:PROB 1;SCAL 1;OFFS -3", ":TIM:SCAL 0.002;OFFS -0.00256")
    assert ask(device, ":WAV:PRE?") == "0,0,1200,1,2.000000e-05,-1.456000e-02,0,4.000000e-02,-75,127"
    parts = ["XINC", "XOR", "XREF", "YINC", "YOR", "YREF"]
    assert [ask(device, f":WAV:{p}?") for p in parts] == ask(device, ":WAV:PRE?").split(",")[4:]


def test_the_preamble_of_the_keysight_is_the_one_of_a_real_one_after_reset():
    device = keysight(pulses, "*RST", ":WAV:FORM ASC")
    got = [float(field) for field in ask(device, ":WAV:PRE?").split(",")]
    assert got == [4, 0, 62500, 1, 1.6e-8, -5e-4, 0, 0.0007851759, 0, 32768]


@pytest.mark.parametrize(
    ("unsigned", "order", "expected"),
    [(1, "MSBF", b"\x99\x00"), (1, "LSBF", b"\x00\x99"), (0, "MSBF", b"\x19\x00"), (0, "LSBF", b"\x00\x19")],
)
def test_words_of_the_keysight(unsigned, order, expected):
    device = keysight(constant(0.2), "CHAN1:PROB 1;RANG 1.6;OFFS 0", ":WAV:FORM WORD", ":WAV:POIN 100")
    configure(device, f":WAV:UNS {unsigned}", f":WAV:BYT {order}")
    head, data = block(device, ":WAV:DATA?")
    assert head == b"#800000200"
    assert data == 100 * expected
    assert float(ask(device, ":WAV:PRE?").split(",")[9]) == (32768 if unsigned else 0)


def test_signed_bytes_of_the_keysight():
    device = keysight(constant(-0.2), "CHAN1:PROB 1;RANG 1.6;OFFS 0", ":WAV:UNS 0", ":WAV:POIN 100")
    assert block(device, ":WAV:DATA?") == (b"#800000100", 100 * struct.pack("b", -25))


def test_text_of_the_keysight():
    device = keysight(constant(0.0), "CHAN1:PROB 1;RANG 1.6;OFFS 0", ":WAV:FORM ASC", ":WAV:POIN 100")
    head, data = block(device, ":WAV:DATA?")
    assert data.split(b",") == [b"+0.00000E+00"] * 100
    assert head == b"#800001299"


@pytest.mark.parametrize("points", [100, 250, 500, 1000, 2000, 5000, 10000, 20000, 50000, 62500])
@pytest.mark.parametrize("mode", ["NORM", "MAX", "RAW"])
def test_the_keysight_gives_as_many_points_as_it_was_asked_for(mode, points):
    device = keysight(pulses, f":WAV:POIN:MODE {mode}", f":WAV:POIN {points}")
    assert len(block(device, ":WAV:DATA?")[1]) == points == int(ask(device, ":WAV:POIN?"))


@pytest.mark.parametrize(("form", "most"), [("BYTE", 250_000), ("WORD", 125_000), ("ASC", 15_625)])
def test_a_block_of_the_rigol_has_a_limit(form, most):
    device = rigol_stopped(pulses, ":ACQ:MDEP 1200000")
    configure(device, ":WAV:MODE RAW", f":WAV:FORM {form}", ":WAV:STAR 1", f":WAV:STOP {most}")
    assert len(block(device, ":WAV:DATA?")[1]) > most - 1
    configure(device, f":WAV:STOP {most + 1}")
    assert ask(device, ":WAV:DATA?", 1.0) is None
    assert errors(device) == [-222]


def test_the_memory_of_the_rigol_cannot_be_read_while_it_runs():
    device = rigol(pulses, ":WAV:MODE RAW")
    assert ask(device, ":WAV:DATA?", 1.0) is None
    assert errors(device) == [-221]
    configure(device, ":STOP")
    assert ask(device, ":WAV:PRE?").split(",")[:3] == ["0", "2", "12000"]


def test_normal_reading_always_gives_1200_points():
    device = rigol_stopped(pulses)
    configure(device, ":WAV:MODE NORM")
    assert len(block(device, ":WAV:DATA?")[1]) == 1200
    assert ask(device, ":WAV:PRE?").split(",")[2] == "1200"


def test_a_record_reads_the_same_whichever_way_it_is_cut():
    device = rigol_stopped(noisy, "CHAN1:OFFS 0", ":TRIG:EDGE:LEV 0", ":ACQ:MDEP 1200000")
    whole = rigol_volts(device)[1]
    configure(device, ":WAV:STAR 249990", ":WAV:STOP 250020")
    _, across = block(device, ":WAV:DATA?")
    configure(device, ":WAV:STAR 1", ":WAV:STOP 10")
    _, first = block(device, ":WAV:DATA?")
    per_code = float(ask(device, ":WAV:YINC?"))
    np.testing.assert_allclose((np.frombuffer(across, np.uint8) - 127.0) * per_code, whole[249_989:250_020])
    np.testing.assert_allclose((np.frombuffer(first, np.uint8) - 127.0) * per_code, whole[:10])
