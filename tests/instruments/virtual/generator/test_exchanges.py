"""What the virtual generators answer and refuse: an exchange a row.

Sources: Agilent/Keysight 33500 Series Operating and Service Guide; Agilent 33220A User's Guide, chapter 4; entries of
the error queue as in the device tests of a public driver (Fixate, 33500B).
"""

import math
import struct

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.arbitrary import samples
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.conversation import CLEAR
from support.exchanges import carry_out, exchanges
from support.wire import ask, errors, send

NEW, OLD = (Virtual33500B,), (Virtual33220A,)
BOTH = NEW + OLD


def conflict(text):
    return f'-221,"Settings conflict;{text}"'


FIRST_ARB = '"INT:\\BUILTIN\\EXP_RISE.ARB"'

APPLY = {
    "APPLy sets the signal and switches it on": (
        *(BOTH, "BURS:STAT ON", "APPL:SQU 5 KHZ, 3.0 VPP, -2.5 V", ("OUTP?;:BURS:STAT?", "1;0")),
        ("FREQ?;VOLT?;VOLT:OFFS?", [5e3, 3, -2.5]),
    ),
    "sixteen digits": (
        *(NEW, "APPL:SQU 5 KHZ,3,-2.5"),
        ("APPL?", '"SQU +5.000000000000000E+03,+3.000000000000000E+00,-2.500000000000000E+00"'),
    ),
    "fourteen digits": (
        *(OLD, "APPL:SQU 5 KHZ,3,-2.5"),
        ("APPL?", '"SQU +5.0000000000000E+03,+3.0000000000000E+00,-2.5000000000000E+00"'),
    ),
    "what it leaves out is the default": (BOTH, "FREQ 40;VOLT 3", "APPL:SIN", ("FREQ?;VOLT?", [1e3, 0.1])),
    "a direct voltage": (BOTH, "APPL:DC DEF,DEF,2", ("VOLT:OFFS?", 2)),
    "a fourth number": (BOTH, ("APPL:SIN 1,2,3,4", None), [-108]),
    "it keeps within the limits": (
        *(BOTH, "APPL:RAMP 1 MHZ,8,4", ("FREQ?;VOLT?;VOLT:OFFS?", [200e3, 8, 1]), [-222, -222]),
    ),
}

PULSES = {
    "period and frequency are one setting": (
        *(BOTH, "PULS:PER 0.02", ("FREQ?", 50), "FREQ 40", ("FUNC:PULS:PER?", 0.025)),
    ),
    "width and duty cycle are one setting, and one of them is held": (
        *(BOTH, "FUNC PULS;FREQ 100;FUNC:PULS:WIDT 2 ms", ("FUNC:PULS:DCYC?", 20)),
        *("FREQ 200", ("PULS:WIDT?;DCYC?", [2e-3, 40]), "FUNC:PULS:HOLD DCYC", "FREQ 100"),
        ("PULS:WIDT?;DCYC?", [4e-3, 40]),
    ),
    "a pulse gives way to its period, and its edges to the pulse": (
        *(NEW, "FUNC PULS;FUNC:PULS:TRAN 1 us;:FREQ 1 MHZ"),
        [conflict("pulse width decreased due to period"), conflict("edge time decreased due to pulse width")],
        ("PULS:WIDT?;:FUNC:PULS:TRAN?", [1e-6 - 16e-9, 10e-9]),  # 0.625 of the gap
    ),
    "both edges are set together": (NEW, ("FUNC:PULS:TRAN:BOTH 20 ns;BOTH?;:FUNC:PULS:TRAN?", [2e-8, 2e-8])),
    "a fast square has less room for its duty cycle": (  # 16 ns of 50 ns
        *(NEW, "FUNC SQU;FUNC:SQU:DCYC 10;:FREQ 20 MHZ", ("FUNC:SQU:DCYC?", 32), [-221]),
    ),
    "so has the older one's": (OLD, "FUNC SQU;FUNC:SQU:DCYC 80;:FREQ 15 MHZ", ("FUNC:SQU:DCYC?", 60), [-221]),
    "after a reset a pulse lasts a tenth of its period": (
        *(NEW, ("FUNC:PULS:DCYC? DEF", 10), ("FUNC:PULS:DCYC?", 10), ("FUNC PRBS;FREQ? MIN", 1e-3)),
    ),
}

VOLTAGES = {
    "an amplitude that leaves no room takes it from the offset": (
        *(BOTH, "VOLT:OFFS 4", "VOLT 8", ("VOLT?;VOLT:OFFS?", [8, 1])),
        [conflict("offset changed due to amplitude")],
    ),
    "an offset that leaves no room is clipped": (
        *(BOTH, "VOLT 8", "VOLT:OFFS -4", ("VOLT?;VOLT:OFFS?", [8, -1]), [-222]),
    ),
    "high and low are amplitude and offset in other words": (
        *(BOTH, "VOLT:HIGH 2", "VOLT:LOW -3", ("VOLT?;VOLT:OFFS?", [5, -0.5])),
        *("VOLT 1", ("VOLT:HIGH?;LOW?", [0, -1])),
    ),
    "a high level below the low one pushes it down": (
        *(NEW, "VOLT:HIGH 2;LOW 1;:VOLT:HIGH -1", ("VOLT:HIGH?;LOW?", [-1, -1.001])),
        *("VOLT:LOW 3", ("VOLT:HIGH?;LOW?", [3.001, 3]), [-221, -221]),
    ),
    "a direct voltage may use the whole range, and another waveform takes it back": (
        *(BOTH, "FUNC DC", "VOLT:OFFS 5", [], "VOLT 2;:FUNC SIN", ("VOLT:OFFS?", 4)),
        [conflict("offset changed on exit from dc function")],
    ),
    "an unknown load has no power": (
        *(BOTH, "VOLT:UNIT DBM", "OUTP:LOAD INF", ("VOLT:UNIT?", "VPP"), "VOLT:UNIT DBM", ("VOLT:UNIT?", "VPP")),
        *(("VOLT 1 DBM", None), [-221] * 3),
    ),
    "the load changes what is displayed, and the limits": (
        *(BOTH, "VOLT 10;:OUTP:LOAD INF", ("VOLT?", 20), ("VOLT? MAX", 20), "OUTP:LOAD 100", ("VOLT?", 20 * 100 / 150)),
        *("OUTP:LOAD 9.9e37", ("OUTP:LOAD?", 9.9e37)),
        ("OUTP:LOAD? MIN;LOAD? MAX;LOAD? DEF", [1, 1e4, 50]),
    ),
    **{
        f"2 V of {word} in each unit": (
            *(BOTH, f"FUNC {word};VOLT 2;VOLT:UNIT VRMS", ("VOLT?", vrms)),
            *(("VOLT:UNIT DBM;:VOLT?", 10 * math.log10(vrms**2 / 50 / 1e-3)), ("VOLT:UNIT VPP;:VOLT?", 2)),
        )
        for word, vrms in (("SIN", 2 / math.sqrt(8)), ("SQU", 1.0), ("RAMP", 1 / math.sqrt(3)), ("PULS", 1.0))
    },
    **{
        f"an amplitude of {sent}": (BOTH, f"VOLT {sent}", ("VOLT?", vpp), ("VOLT:UNIT?", "VPP"))
        for sent, vpp in (
            *(("2 VPP", 2.0), ("500 mVpp", 0.5), ("1 VRMS", math.sqrt(8)), ("10 DBM", 2.0), ("250 mV", 0.25)),
        )
    },
}

#: What is sent, the setting that is then asked for, the limit that it has, and which one that is.
CLIPPED = [
    ("FREQ 31 MHZ", "FREQ?", 30e6, "upper"), ("FREQ 0", "FREQ?", 1e-6, "lower"), ("FREQ 1e999", "FREQ?", 30e6, "upper"),
    ("VOLT 11", "VOLT?", 10.0, "upper"), ("VOLT 0.1 mV", "VOLT?", 1e-3, "lower"),
    ("VOLT:OFFS 5", "VOLT:OFFS?", 4.95, "upper"),  # 100 mVpp are there too
    ("PHAS 362", "PHAS?", 360.0, "upper"), ("PHAS -363", "PHAS?", -360.0, "lower"),
    ("FUNC:SQU:DCYC 100", "FUNC:SQU:DCYC?", 99.99, "upper"), ("OUTP:LOAD 0", "OUTP:LOAD?", 1.0, "lower"),
    ("BURS:INT:PER 9000", "BURS:INT:PER?", 8000.0, "upper"), ("BURS:NCYC 0", "BURS:NCYC?", 1.0, "lower"),
]  # fmt: skip
#: Waveform → its highest frequency [Hz].
TOPS = {
    NEW: {"SIN": 30e6, "SQU": 30e6, "TRI": 200e3, "RAMP": 200e3, "PULS": 30e6},
    OLD: {"SIN": 20e6, "SQU": 20e6, "RAMP": 200e3, "PULS": 5e6, "USER": 6e6},
}
LIMITS = {
    **{
        f"{sent} is clipped": (
            *(NEW, (sent, None), [f'-222,"Data out of range;value clipped to {which} limit"'], (asked, limit)),
        )
        for sent, asked, limit, which in CLIPPED
    },
    **{
        f"{word} has its highest frequency": (models, f"FUNC {word}", ("FREQ? MAX", top))
        for models, tops in TOPS.items()
        for word, top in tops.items()
    },
    "a waveform that cannot be so fast is slowed": (
        *(BOTH, "FREQ 19 MHZ", "FUNC RAMP", ("FREQ?", 200e3)),
        [conflict("frequency reduced for ramp function")],
    ),
    "every waveform is answered in its short form": (
        NEW,
        *((f"FUNC {w};FUNC?", w) for w in ("SIN", "SQU", "TRI", "RAMP", "PULS", "PRBS", "NOIS", "ARB", "DC")),
    ),
    "so it is by the older one, which has no triangle": (
        *(OLD, *((f"FUNC {w};FUNC?", w) for w in ("SIN", "SQU", "RAMP", "PULS", "NOIS", "DC", "USER"))),
        *(("FUNC TRI", None), [-224]),
    ),
}

MODES = {
    "a trigger that nothing waits for": (BOTH, "*TRG", [-211]),
    "immediate bursts have a period that fits them": (
        *(BOTH, "FREQ 100;BURS:NCYC 10;INT:PER 1 ms", "BURS:STAT ON"),
        ("BURS:INT:PER?", pytest.approx(0.1, rel=1e-4)),  # and a pause
        [conflict("burst period increased to fit entire burst")],
    ),
    "a voltage without a frequency has no burst and no sweep": (
        *(BOTH, "FUNC DC;BURS:STAT ON", "SWE:STAT ON", ("BURS:STAT?;:SWE:STAT?", "0;0")),
        [conflict(f"not able to {what} this function") for what in ("burst", "sweep")],
    ),
    "only one mode is on": (
        *(BOTH, "BURS:STAT ON;:SWE:STAT ON", ("BURS:STAT?;:SWE:STAT?", "0;1"), [-221]),
        *(("AM:STAT ON", None), [-113]),  # modulation is missing
    ),
    "a sweep takes its time": (
        *(BOTH, "SWE:TIME 5;:SWE:SPAC LOG;:TRIG:SOUR BUS;:SWE:STAT ON", "*TRG", ("*OPC?", "1")),
        lambda device: device.clock.now() == pytest.approx(5.0, abs=0.02),
    ),
    "an endless burst is never complete until it is aborted": (
        *(NEW, "BURS:NCYC INF;:TRIG:SOUR BUS;:BURS:STAT ON;:OUTP ON", "*TRG", ("*OPC?", None), CLEAR),
        *(("BURS:NCYC?", 9.9e37), "ABOR", ("*OPC?", "1")),
    ),
    "a trigger command needs no source": (
        *(NEW, "FREQ 10;:TRIG:SOUR EXT;:BURS:STAT ON;:OUTP ON", "TRIG", lambda device: device.signal().amplitude > 0),
        *(0.2, lambda device: device.signal().amplitude == 0.0),
    ),
    "a closed gate keeps the signal in": (
        *(NEW, "BURS:MODE GAT;:BURS:STAT ON;:OUTP ON", lambda device: device.signal().amplitude == 0.0),
        *("BURS:GATE:POL INV", lambda device: device.signal().amplitude > 0),
    ),
}

KEPT = {
    "a text is displayed until it is cleared": (
        *(BOTH, ("DISP:TEXT 'coil on; do not touch';:DISP:TEXT?", '"coil on; do not touch"')),
        *(("DISP:TEXT:CLE;:DISP:TEXT?", '""'), ("DISP:TEXT 'it''s on';:DISP:TEXT?", '"it\'s on"')),
        *('DISP:TEXT "a" "b"', [-103]),
    ),
    **{
        f"a text without its quotes: {text}": (BOTH, (f"DISP:TEXT {text}", None), [-104], ("DISP:TEXT?", '""'))
        for text in ("hello", "x", "'half", "\"other'")
    },
    "the channels can be brought into phase": (NEW, "PHAS:SYNC", "SOUR2:PHAS:SYNC", "PHAS:REF"),
    **{
        f"{header} is in degrees": (
            BOTH,
            f"{header} -90 DEG",
            (f"{header}?", -90),
            (f"{header} 45;:{header}? MAX", 360),
        )
        for header in ("PHAS", "BURS:PHAS")
    },
    "a sample rate has a unit with a slash": (
        *(NEW, ("FUNC:ARB:SRAT 2 KSA/S;SRAT?", 2000), ("FREQ 1000 SA/S", None), [-131]),
    ),
}

_EIGHT = "DATA:ARB a,0,0,0,0,0,0,0"
#: A waveform that is none, and the number of its error.
NO_WAVEFORMS = {
    "DATA:ARB a,0,0,0": -222,  # fewer than eight
    f"{_EIGHT},1.5": -222, f"{_EIGHT},x": -104, "DATA:ARB a": -109, "DATA:ARB": -109,
    'DATA:ARB "a b",0,0,0,0,0,0,0,0': -224, "DATA:ARB:DAC a,#19" + "\0" * 9: 800, "DATA:ARB:DAC a,#Q17": -102,
    'FUNC:ARB "nowhere"': 785,
}  # fmt: skip
WAVEFORMS = {
    "the older one has one, which is built in": (OLD, ("FUNC:USER?", "EXP_RISE"), ("DATA VOLATILE,1,0", None), [-113]),
    "after a reset a built-in waveform is selected": (  # 250 samples at 40 kSa/s, as a public driver lists the state
        *(NEW, ("FUNC:ARB?", FIRST_ARB), ("FUNC:ARB:SRAT?;:FREQ?;:FUNC ARB;FREQ?", [40e3, 1e3, 160])),
    ),
    "each channel has its own waveforms": (
        *(NEW, "SOUR2:DATA:ARB mine,0,0,0,0,0,0,0,1", ("SOUR2:DATA:VOL:CAT?", f'{FIRST_ARB},"MINE"')),
        *(("SOUR1:DATA:VOL:CAT?", FIRST_ARB), ("FUNC:ARB mine", None), [785]),
    ),
    "a waveform is not overwritten, but can be cleared": (
        *(NEW, ("DATA:VOL:FREE?", 999_750), f"{_EIGHT},1", "DATA:ARB a,1,1,1,1,1,1,1,1"),
        *(['+786,"Specified arb waveform already exists"'], ("DATA:VOL:FREE?", 999_742)),
        *("FUNC:ARB a;:DATA:VOL:CLE", ("DATA:VOL:FREE?", 999_750), ("FUNC:ARB?", FIRST_ARB)),
    ),
    "the frequency of an arbitrary waveform is that of its samples": (
        *(NEW, f"{_EIGHT},1", "FUNC:ARB a;:FUNC ARB;:FREQ 50", ("FUNC:ARB:SRAT?", 400), ("FREQ? MAX", 250e6 / 8)),
        ("FUNC SIN;FREQ?", 1e3),
    ),
    **{
        f"{message} is refused": (NEW, message, [number], ("DATA:VOL:CAT?", FIRST_ARB))
        for message, number in NO_WAVEFORMS.items()
    },
}


@exchanges(APPLY | PULSES | VOLTAGES | LIMITS | MODES | KEPT | WAVEFORMS)
def test_an_exchange_goes_as_the_manual_says(make, steps):
    carry_out(make, steps)


@pytest.mark.parametrize("wrong", ["APPL:SQU 2000,x", "APPL:RAMP 5,1,1 HZ", "APPL:SQU 1,2,3,4"])
def test_apply_with_a_parameter_that_is_wrong_changes_nothing(either, wrong):
    send(either, b"FREQ 40;VOLT 3;:BURS:STAT ON\n")
    errors(either)
    before = dict(either.settings)
    send(either, f"{wrong}\n".encode())
    assert len(errors(either)) == 1
    assert either.settings == before


def test_a_limit_is_taken_as_it_is_printed(either):
    send(either, b"FUNC SQU\n")
    shortest = ask(either, "FUNC:PULS:PER? MIN")  # a third of 10 ns, at 30 MHz
    send(either, f"FUNC:PULS:PER {shortest}\n".encode())
    assert (ask(either, "FUNC:PULS:PER?"), errors(either)) == (shortest, [])


def test_reset_leaves_no_entry_and_what_stood_before(either):
    send(either, b"FUNC PULS;FREQ 1 MHZ;VOLT 10;:OUTP:LOAD INF;:BURS:STAT ON\n*CLS\n*RST\n")
    assert errors(either) == []
    assert either.settings == type(either)(VirtualClock()).settings


_DAC = (-32767, -16384, 0, 16384, 32767, 16384, 0, -16384)
FORMS = [
    ("DATA:ARB ramp,", b"-1,-0.5,0,0.5,1,0.5,0,-0.5"),
    ("DATA:ARB:DAC ramp,", ",".join(map(str, _DAC)).encode()),
    ("DATA:ARB ramp,", b"#232" + struct.pack(">8f", -1, -0.5, 0, 0.5, 1, 0.5, 0, -0.5)),
    ("DATA:ARB:DAC ramp,", b"#216" + struct.pack(">8h", *_DAC)),
    ("FORM:BORD SWAP;:DATA:ARB:DAC ramp,", b"#216" + struct.pack("<8h", *_DAC)),
]


@pytest.mark.parametrize(("head", "data"), FORMS)
def test_a_waveform_is_sent_as_numbers_or_as_a_block(generator, head, data):
    send(generator, head.encode() + data + b"\n")
    send(generator, b'FUNC:ARB "ramp";:FUNC ARB;:FUNC:ARB:SRAT 400;:VOLT 2;:OUTP:LOAD INF;:OUTP ON\n')
    assert errors(generator) == []
    assert ask(generator, "FUNC:ARB?;:DATA:VOL:CAT?") == f'"RAMP";{FIRST_ARB},"RAMP"'
    output = generator.signal()
    assert (output.waveform, output.frequency) == ("ARB", 50.0)  # eight samples at 400 Sa/s
    assert np.allclose(output.samples, [-1, -0.5, 0, 0.5, 1, 0.5, 0, -0.5], atol=1e-4)


@pytest.mark.parametrize(("sent", "error"), [(["#13ab"], "-102"), (["0"] * 9, "781")], ids=["cut", "no room"])
def test_samples_that_are_cut_short_or_too_many_are_refused(sent, error):
    with pytest.raises(ScpiError, match=error):
        samples(sent, full_scale=1.0, block=">i2", most=8)


#: The state after *RST as a public driver of the family lists it (without the edges, which are the 33600's there).
AFTER_RESET = """\
SOUR1:BURS:GATE:POL NORM|SOUR1:BURS:INT:PER +1.000000000000000E-02|SOUR1:BURS:MODE TRIG
SOUR1:BURS:NCYC +1.000000000000000E+00|SOUR1:BURS:STAT 0|DISP 1|FORM:BORD NORM|INIT1:CONT 1
OUTP1:LOAD +5.000000000000000E+01|OUTP1:POL NORM|OUTP:SYNC 1|OUTP:SYNC:SOUR CH1|OUTP:TRIG 0|OUTP:TRIG:SLOP POS|OUTP 0
SOUR1:FREQ +1.000000000000000E+03|SOUR1:FREQ:MODE CW|SOUR1:FREQ:STAR +1.000000000000000E+02
SOUR1:FREQ:STOP +1.000000000000000E+03|SOUR1:FUNC SIN|SOUR1:FUNC:ARB "INT:\\BUILTIN\\EXP_RISE.ARB"
SOUR1:FUNC:ARB:ADV SRAT|SOUR1:FUNC:ARB:FILT STEP|SOUR1:FUNC:ARB:SRAT +4.000000000000000E+04
SOUR1:FUNC:PRBS:BRAT +1.000000000000000E+03|SOUR1:FUNC:PULS:HOLD WIDT|SOUR1:FUNC:PULS:PER +1.000000000000000E-03
SOUR1:FUNC:PULS:WIDT +1.000000000000000E-04|SOUR1:FUNC:RAMP:SYMM +1.000000000000000E+02
SOUR1:FUNC:SQU:DCYC +5.000000000000000E+01|SOUR1:SWE:SPAC LIN|SOUR1:SWE:STAT 0|SOUR1:SWE:TIME +1.000000000000000E+00
SOUR1:VOLT:HIGH +5.000000000000000E-02|SOUR1:VOLT:LOW -5.000000000000000E-02|SOUR1:VOLT:RANG:AUTO 1
SOUR1:VOLT:UNIT VPP|TRIG1:COUN +1.000000000000000E+00|TRIG1:DEL +0.000000000000000E+00|TRIG1:SLOP POS|TRIG1:SOUR IMM
TRIG1:TIM +1.000000000000000E+00"""


def test_the_state_after_reset_is_that_of_the_family(generator):
    for entry in AFTER_RESET.replace("\n", "|").split("|"):
        header, _, value = entry.partition(" ")
        assert ask(generator, header + "?") == value
        send(generator, entry.encode() + b"\n")
    assert errors(generator) == []
    assert dict(generator.settings) == Virtual33500B(VirtualClock()).settings
