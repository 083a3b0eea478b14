"""The parser of the virtual instruments: SCPI as programs write it, and whatever else they send."""

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.virtual.bench.session import Session
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.message import LONGEST_LINE
from instruments.virtual.core.rows import Ask, Both, Do
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.exchanges import carry_out, exchanges
from support.wire import ask, cable, errors, received, send


class Display(VirtualInstrument):
    """Keeps what it is sent."""

    def __init__(self, clock):
        self.texts = []
        super().__init__(clock)

    ROWS = (
        Both("DISPlay:TEXT", lambda d, p: d.texts.append(p)),
        Do("DISPlay:TEXT:CLEar", lambda d: d.texts.clear()),
        Ask("TWO", lambda _d: "2"),
    )


def no_light(start, step, n):
    """A dark room, and no more of it than a test needs."""
    return np.zeros(min(n, 1000))


@pytest.fixture
def generator():
    return Virtual33500B(VirtualClock())


def counter(clock):
    return Virtual53230A(clock, signal=no_light)


DEFAULTS = Virtual33500B(VirtualClock()).settings
GENERATOR, COUNTER = (Virtual33500B,), (counter,)
FORTY = ("FREQ?", 40)


def is_unchanged(device):
    return device.settings == DEFAULTS


def took(messages):
    """The bench's time is that of this number of messages."""
    return lambda device: device.clock.now() == pytest.approx(messages * device.pace, abs=1e-12)


HEADERS = (
    *(
        "FREQ 40",
        "freq 40",
        "Frequency 40",
        ":FREQ 40",
        "FREQ:CW 40",
        "FREQ:FIX 40",
        "FREQuency:FIXed 40",
        "SOUR:FREQ 40",
    ),
    *("SOUR1:FREQ 40", "source1:frequency:cw 40", ":SOURCE:FREQ:FIXED 40", "FREQ\t40", "FREQ   40  ", "FREQ 40\r"),
)
NO_HEADERS = (*("FREQU 40", "FRE 40", "FREQ2 40", "SOUR3:FREQ 40", "FREQ:CW:FIX 40", "FREQ40", "*RSTT", "::FREQ 40"),)
#: What is set → the frequency [Hz].  SCPI-1999, vol. 1, 7.1: with Hz an M means mega.
NUMBERS = {
    "1 kHz": 1e3, "40HZ": 40.0, "1 MHZ": 1e6, "1 mahz": 1e6, "500 uHz": 500e-6, "2.5e1": 25.0, "+.5E+2": 50.0,
    "25.": 25.0, "MIN": 1e-6, "maximum": 30e6, "DEF": 1e3, "40,(@1)": 40.0,
}  # fmt: skip
#: What changes nothing → the number of its error.
BAD = {
    "FREQ": -109, "FREQ (@1)": -109, "FREQ 1,2": -108, "FREQ INF": -104, "FREQ NAN": -104, "FREQ ON": -104,
    'FREQ "40"': -104, "FREQ 4 0": -104, "FREQ 40 V": -131, "FREQ 40 M": -131, "FREQ 40 XHZ": -131, "FUNC": -109,
    "FUNC SINE": -224, "FUNC SIN,SQU": -108, "OUTP 2": -224, "OUTP": -109, "*RST 1": -108, "*CLS 1": -108,
    "FREQ? FOO": -224, "FREQ? 40": -224, "FREQ? MIN,MAX": -108, "FUNC? SIN": -108, "OUTP? 1": -108, "*IDN? 1": -108,
    "SYST:ERR? 1": -108,
}  # fmt: skip
ROWS = {
    **{f"{message!r} is understood": (GENERATOR, message, FORTY) for message in HEADERS},
    **{f"{message} is undefined": (GENERATOR, (message, None), [-113], is_unchanged) for message in NO_HEADERS},
    "an unknown question": (GENERATOR, ("FOO?", None), ['-113,"Undefined header;FOO"']),
    "what can only be done cannot be asked, and the reverse": (
        *(COUNTER, *((message, None) for message in ("ABOR?", "*RST?", "READ", "*IDN")), [-113] * 4),
    ),
    # compounds
    "a compound stays in the branch that it entered": (
        *(COUNTER, ("INP1:COUP DC;IMP 50;LEV1 0.6;:INP1:IMP?;LEV1?", [50, 0.6]), ("INP1:COUP?", "DC")),
    ),
    "a colon takes it back to the root": (
        *(GENERATOR, ("SOUR:FREQ 40;:OUTP ON;:FREQ?;:OUTP?", [40, 1])),
        *(("SOUR:FREQ 40;OUTP OFF", None), [-113], ("OUTP?", "1")),  # there is no SOURce:OUTPut
    ),
    "a common command leaves the branch as it is": (GENERATOR, ("SOUR:FREQ 40;*OPC?;FREQ?", [1, 40])),
    "every line starts at the root": (GENERATOR, "SOUR:FREQ 40", "OUTP ON"),
    "the first error ends a compound": (GENERATOR, ("FREQ 40;FOO 1;FREQ 50", None), [-113], FORTY),
    "an endless line is dropped, and the next one understood": (
        *(GENERATOR, ("x" * (LONGEST_LINE * 3 // 2), None), [-363], ("*OPC?", "1")),
    ),
    # parameters; products as 500 × 1e-6 are rounded once
    **{
        f"FREQ {text}": (GENERATOR, f"FREQ {text}", ("FREQ?", pytest.approx(hertz, rel=1e-15)))
        for text, hertz in NUMBERS.items()
    },
    "elsewhere an m means milli": (
        *(COUNTER, "SENS:FREQ:GATE:TIME 100 ms", "INP:LEV 250mV", ("SENS:FREQ:GATE:TIME?;:INP:LEV?", [0.1, 0.25])),
    ),
    **{
        f"{message} is refused": (GENERATOR, (message, None), [number], is_unchanged) for message, number in BAD.items()
    },
    "a query can ask for the limits and the default": (
        *(GENERATOR, "FREQ 40", ("FREQ? MIN;FREQ? MAX;FREQ? DEF", [1e-6, 30e6, 1e3]), FORTY),
    ),
    **{f"FUNC {word}": (GENERATOR, (f"FUNC {word};FUNC?", "SQU")) for word in ("SQU", "square", "Square")},
    **{
        f"OUTP1 {word}": (GENERATOR, (f"OUTP1 {word};:OUTP1?", answer))
        for word, answer in {"ON": "1", "on": "1", "1": "1", "OFF": "0", "0": "0"}.items()
    },
    "an infinite load": (GENERATOR, ("OUTP:LOAD INF;LOAD?", "+9.900000000000000E+37")),
    # the error queue and the common commands
    "a full queue says so in its last entry": (GENERATOR, *(f"FOO{k}" for k in range(25)), [-113] * 19 + [-350]),
    "an entry is a string in ASCII, whatever was sent": (
        *(GENERATOR, ('F"O"Ö\x7f', None), ['-113,"Undefined header;F""O""??"']),
    ),
    "*CLS empties the queue, and keeps the settings": (GENERATOR, "FREQ 40", "FOO", "*CLS", [], FORTY),
    "*RST restores the settings, and keeps the queue": (
        *(GENERATOR, "FREQ 40", "OUTP ON", "FUNC SQU", "FOO", "*RST", is_unchanged, [-113]),
    ),
    "*OPC? answers 1 when everything before it is done": (GENERATOR, ("*OPC?", "1"), ("FREQ 40;*WAI;*OPC?", "1")),
    "an answer takes its time on the clock of the bench": (GENERATOR, ("*OPC?", "1"), took(1)),
    "a counter's questions in one message take as long as one after the other": (
        *(COUNTER, ("INP1:IMP?;:INP2:IMP?;*OPC?", [1e6, 1e6, 1]), took(3)),
    ),
}


@exchanges(ROWS)
def test_an_exchange_goes_as_scpi_says(make, steps):
    carry_out(make, steps)


def test_semicolons_and_commas_inside_quotes_separate_nothing():
    device = Display(VirtualClock())
    send(device, b'DISP:TEXT "a;b,c"; TEXT \'d";e\',"f"\n')
    assert device.texts == [['"a;b,c"'], ["'d\";e'", '"f"']]
    assert errors(device) == []


def test_a_message_may_come_in_pieces_and_several_at_once(generator):
    for byte in b"FREQ 41\nVOLT 3;":
        send(generator, bytes([byte]))
    send(generator, b"VOLT?\nFREQ?\n")
    assert received(generator, 1.0) == b"+3.000000000000000E+00\n"
    assert received(generator, 1.0) == b"+4.100000000000000E+01\n"


def test_clear_drops_a_half_sent_message_and_unread_answers(generator):
    send(generator, b"*IDN?\nFREQ 4")
    cable(generator).clear()
    assert ask(generator, "FREQ?") == "+1.000000000000000E+03"
    assert errors(generator) == []


def test_a_program_that_reads_after_a_clear_must_have_asked(generator):
    link = Session(generator)
    link.write(b"*IDN?\n")
    link.clear()
    assert link.read(100, 1.0) is None
    assert errors(generator) == [-420]
