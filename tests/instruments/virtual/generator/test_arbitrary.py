"""Arbitrary waveforms of the virtual generators.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import struct

import numpy as np
import pytest

from instruments.virtual.core.parser import ScpiError
from instruments.virtual.generator.arbitrary import samples
from support.generators import entries, number
from support.wire import ask, errors, send


def test_after_reset_a_built_in_waveform_is_selected(generator, older):
    assert ask(generator, "FUNC:ARB?") == '"INT:\\BUILTIN\\EXP_RISE.ARB"'
    # 250 samples at 40 kSa/s, as a public driver lists the state after *RST
    assert ask(generator, "FUNC:ARB:SRAT?;FREQ?") == "+4.000000000000000E+04;+1.600000000000000E+02"
    assert ask(older, "FUNC:USER?") == "EXP_RISE"


FORMS = [
    ("DATA:ARB ramp,", b"-1,-0.5,0,0.5,1,0.5,0,-0.5"),
    ("DATA:ARB:DAC ramp,", b"-32767,-16384,0,16384,32767,16384,0,-16384"),
    ("DATA:ARB ramp,", b"#232" + struct.pack(">8f", -1, -0.5, 0, 0.5, 1, 0.5, 0, -0.5)),
    ("DATA:ARB:DAC ramp,", b"#216" + struct.pack(">8h", -32767, -16384, 0, 16384, 32767, 16384, 0, -16384)),
    (
        "FORM:BORD SWAP;:DATA:ARB:DAC ramp,",
        b"#216" + struct.pack("<8h", -32767, -16384, 0, 16384, 32767, 16384, 0, -16384),
    ),
]


@pytest.mark.parametrize(("head", "data"), FORMS)
def test_a_waveform_is_sent_as_numbers_or_as_a_block(generator, head, data):
    send(generator, head.encode() + data + b"\n")
    send(generator, b'FUNC:ARB "ramp";:FUNC ARB;:FUNC:ARB:SRAT 400;:VOLT 2;:OUTP:LOAD INF;:OUTP ON\n')
    assert errors(generator) == []
    assert ask(generator, "FUNC:ARB?;:DATA:VOL:CAT?") == '"RAMP";"INT:\\BUILTIN\\EXP_RISE.ARB","RAMP"'
    output = generator.signal()
    assert (output.waveform, output.frequency) == ("ARB", 50.0)  # eight samples at 400 Sa/s
    assert np.allclose(output.samples, [-1, -0.5, 0, 0.5, 1, 0.5, 0, -0.5], atol=1e-4)


def test_each_channel_has_its_own_waveforms(generator):
    send(generator, b"SOUR2:DATA:ARB mine,0,0,0,0,0,0,0,1\n")
    assert ask(generator, "SOUR2:DATA:VOL:CAT?").endswith('"MINE"')
    assert "MINE" not in ask(generator, "SOUR1:DATA:VOL:CAT?")
    assert ask(generator, "FUNC:ARB mine") is None
    assert errors(generator) == [785]


@pytest.mark.parametrize(
    ("message", "number"),
    [
        (b"DATA:ARB a,0,0,0", -222),  # fewer than eight
        (b"DATA:ARB a,0,0,0,0,0,0,0,1.5", -222),
        (b"DATA:ARB a,0,0,0,0,0,0,0,x", -104),
        (b"DATA:ARB a", -109),
        (b"DATA:ARB", -109),
        (b'DATA:ARB "a b",0,0,0,0,0,0,0,0', -224),
        (b"DATA:ARB:DAC a,#19" + bytes(9), 800),
        (b"DATA:ARB:DAC a,#Q17", -102),
        (b'FUNC:ARB "nowhere"', 785),
        (b'MMEM:LOAD:DATA "INT:\\NOWHERE.ARB"', -256),
    ],
)
def test_a_waveform_that_is_none_is_refused(generator, message, number):
    send(generator, message + b"\n")
    assert errors(generator) == [number]
    assert ask(generator, "DATA:VOL:CAT?") == '"INT:\\BUILTIN\\EXP_RISE.ARB"'


def test_a_block_that_breaks_off_is_no_waveform():
    with pytest.raises(ScpiError, match="-102"):
        samples(["#13ab"], full_scale=1.0, block=">i2", least=1, most=8)


def test_there_is_no_room_for_more_than_the_memory_holds():
    with pytest.raises(ScpiError, match="781"):
        samples(["0"] * 9, full_scale=1.0, block=">i2", least=1, most=8)


def test_a_waveform_is_not_overwritten_but_can_be_cleared(generator):
    send(generator, b"DATA:ARB a,0,0,0,0,0,0,0,1\nDATA:ARB a,1,1,1,1,1,1,1,1\n")
    assert entries(generator) == ['+786,"Specified arb waveform already exists"']
    assert number(generator, "DATA:ATTR:AVER? a") == 0.125
    free = number(generator, "DATA:VOL:FREE?")
    send(generator, b"FUNC:ARB a;:DATA:VOL:CLE\n")
    assert number(generator, "DATA:VOL:FREE?") == free + 8
    assert ask(generator, "FUNC:ARB?") == '"INT:\\BUILTIN\\EXP_RISE.ARB"'


def test_a_waveform_has_the_attributes_of_its_samples(generator):
    """Root mean square of 1 in 4 samples: a half."""
    send(generator, b"DATA:ARB a,0,0,0,-1,0,0,0,-1\nDATA:ARB none,0,0,0,0,0,0,0,0\nFUNC:ARB none\n")
    attributes = {which: number(generator, f"DATA:ATTR:{which}? a") for which in ("AVER", "CFAC", "POIN", "PTP")}
    assert attributes == {"AVER": -0.25, "CFAC": 2.0, "POIN": 8.0, "PTP": 0.5}
    assert number(generator, "DATA:ATTR:CFAC?") == 0.0  # of the selected one, which has no crest


def test_a_built_in_waveform_is_loaded_first(generator):
    send(generator, b'MMEM:LOAD:DATA "INT:\\BUILTIN\\SINC.ARB"\nFUNC:ARB "INT:\\BUILTIN\\SINC.ARB"\n')
    assert errors(generator) == []
    assert number(generator, "DATA:ATTR:POIN?") == 250


def test_the_frequency_of_an_arbitrary_waveform_is_that_of_its_samples(generator):
    send(generator, b"DATA:ARB a,0,0,0,0,0,0,0,1\nFUNC:ARB a;:FUNC ARB;:FREQ 50\n")
    assert number(generator, "FUNC:ARB:SRAT?") == 400
    assert number(generator, "FREQ? MAX") == 250e6 / 8
    assert number(generator, "FUNC:ARB:PER?") == 0.02
    send(generator, b"FUNC SIN\n")
    assert number(generator, "FREQ?") == 1e3


def test_the_older_one_has_one_volatile_waveform_and_copies_of_it(older):
    send(older, b"DATA VOLATILE,-1,0,1,0\nDATA:COPY mine\nFUNC:USER VOLATILE;:FUNC USER\n")
    assert ask(older, "DATA:CAT?") == '"VOLATILE","MINE","EXP_RISE","EXP_FALL","NEG_RAMP","SINC","CARDIAC"'
    assert ask(older, "DATA:NVOL:CAT?;:DATA:NVOL:FREE?;:FUNC:USER?") == '"MINE";+3;VOLATILE'
    assert list(older.signal().samples) == [-1, 0, 1, 0]
    send(older, b"DATA:DAC VOLATILE,#18" + struct.pack(">4h", -8191, 0, 8191, 0) + b"\n")
    assert errors(older) == []
    assert number(older, "DATA:ATTR:PTP? VOLATILE") == 1.0


@pytest.mark.parametrize(
    ("message", "number"),
    [
        ("DATA mine,1,0", -224),
        ("DATA VOLATILE", -109),
        ("DATA:COPY", -109),
        ("DATA:COPY mine", 785),
        ("DATA VOLATILE,1;:DATA:COPY SINC", 782),
        ("DATA VOLATILE,1;:DATA:COPY mine,SINC", 784),
        ("DATA:DEL SINC", 786),
        ("DATA:DEL mine", 785),
        ("DATA VOLATILE,1;:FUNC:USER VOLATILE;:DATA:DEL VOLATILE", 787),
        ("FUNC:USER mine", 785),
        ("DATA:ATTR:POIN? mine", 785),
    ],
)
def test_what_the_older_one_refuses(older, message, number):
    assert ask(older, message) is None
    assert errors(older) == [number]


def test_the_older_one_keeps_four_copies_and_forgets_what_is_not_selected(older):
    send(older, b"DATA VOLATILE,1,0\n")
    for name in (b"A", b"B", b"C", b"D", b"E"):
        send(older, b"DATA:COPY " + name + b"\n")
    assert errors(older) == [781]
    send(older, b"FUNC:USER A\nDATA:DEL B\nDATA:DEL:ALL\n")
    assert ask(older, "DATA:NVOL:CAT?") == '"A"'


def test_a_waveform_that_is_refused_leaves_the_one_before(older):
    send(older, b"DATA VOLATILE,-1,0,1,0\nFUNC:USER VOLATILE;:FUNC USER\nDATA VOLATILE,5\n")
    assert errors(older) == [-222]
    assert list(older.signal().samples) == [-1, 0, 1, 0]
    # 40 000 points fit twice into the memory only in the place of each other
    for _ in range(2):
        send(older, b"DATA VOLATILE," + b",".join([b"0"] * 40_000) + b"\n")
    assert errors(older) == []
