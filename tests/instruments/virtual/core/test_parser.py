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
from support.wire import ask, cable, errors, received, send

NO_ERROR = '+0,"No error"'


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


@pytest.fixture
def counter():
    return Virtual53230A(VirtualClock(), signal=no_light)


# --- headers ---


@pytest.mark.parametrize(
    "message",
    [
        "FREQ 40",
        "freq 40",
        "Frequency 40",
        ":FREQ 40",
        "FREQ:CW 40",
        "FREQ:FIX 40",
        "FREQuency:FIXed 40",
        "SOUR:FREQ 40",
        "SOUR1:FREQ 40",
        "source1:frequency:cw 40",
        ":SOURCE:FREQ:FIXED 40",
        "FREQ\t40",
        "FREQ   40  ",
        "FREQ 40\r",
    ],
)
def test_a_header_is_understood_in_every_form_that_the_manual_allows(generator, message):
    send(generator, message.encode() + b"\n")
    assert float(ask(generator, "FREQ?")) == 40.0
    assert errors(generator) == []


@pytest.mark.parametrize(
    "message", ["FREQU 40", "FRE 40", "FREQ2 40", "SOUR3:FREQ 40", "FREQ:CW:FIX 40", "FREQ40", "*RSTT", "::FREQ 40"]
)
def test_a_header_that_is_neither_the_long_nor_the_short_form_is_undefined(generator, message):
    assert ask(generator, message) is None
    assert errors(generator) == [-113]
    assert float(ask(generator, "FREQ?")) == 1000.0


def test_an_unknown_question_gets_no_reply_and_an_entry(generator):
    assert ask(generator, "FOO?") is None
    assert ask(generator, "SYST:ERR?") == '-113,"Undefined header;FOO"'


def test_what_can_only_be_done_cannot_be_asked_and_the_reverse(counter):
    for message in ("ABOR?", "*RST?", "READ", "*IDN"):
        assert ask(counter, message) is None
    assert errors(counter) == [-113] * 4


# --- compounds ---


def test_a_compound_stays_in_the_branch_that_it_entered(counter):
    assert ask(counter, "INP1:COUP DC;IMP 50;LEV1 0.6;:INP1:COUP?;IMP?;LEV1?") == (
        "DC;+5.000000000000000E+01;+6.000000000000000E-01"
    )
    assert errors(counter) == []


def test_a_colon_takes_a_compound_back_to_the_root(generator):
    assert ask(generator, "SOUR:FREQ 40;:OUTP ON;:FREQ?;:OUTP?") == "+4.000000000000000E+01;1"
    assert ask(generator, "SOUR:FREQ 40;OUTP OFF") is None  # there is no SOURce:OUTPut
    assert errors(generator) == [-113]
    assert ask(generator, "OUTP?") == "1"


def test_a_common_command_leaves_the_branch_as_it_is(generator):
    assert ask(generator, "SOUR:FREQ 40;*OPC?;FREQ?") == "1;+4.000000000000000E+01"


def test_every_line_starts_at_the_root(generator):
    send(generator, b"SOUR:FREQ 40\nOUTP ON\n")
    assert errors(generator) == []


def test_the_first_error_ends_a_compound(generator):
    assert ask(generator, "FREQ 40;FOO 1;FREQ 50") is None
    assert errors(generator) == [-113]
    assert float(ask(generator, "FREQ?")) == 40.0


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


def test_an_endless_line_is_dropped_and_the_next_one_understood(generator):
    for _ in range(3):
        send(generator, b"x" * (LONGEST_LINE // 2))
    assert ask(generator, "") is None
    assert errors(generator) == [-363]


# --- parameters ---


@pytest.mark.parametrize(
    ("message", "hertz"),
    [
        ("FREQ 1 kHz", 1e3),
        ("FREQ 40HZ", 40.0),
        ("FREQ 1 MHZ", 1e6),  # SCPI-1999, vol. 1, 7.1: with Hz an M means mega
        ("FREQ 1 mahz", 1e6),
        ("FREQ 500 uHz", 500e-6),
        ("FREQ 2.5e1", 25.0),
        ("FREQ +.5E+2", 50.0),
        ("FREQ 25.", 25.0),
        ("FREQ MIN", 1e-6),
        ("FREQ maximum", 30e6),
        ("FREQ DEF", 1e3),
        ("FREQ 40,(@1)", 40.0),
    ],
)
def test_a_number_is_understood_with_its_unit(generator, message, hertz):
    send(generator, message.encode() + b"\n")
    # products as 500 × 1e-6 are rounded once
    assert float(ask(generator, "FREQ?")) == pytest.approx(hertz, rel=1e-15)
    assert errors(generator) == []


def test_elsewhere_an_m_means_milli(counter):
    send(counter, b"SENS:FREQ:GATE:TIME 100 ms\nINP:LEV 250mV\n")
    assert float(ask(counter, "SENS:FREQ:GATE:TIME?")) == pytest.approx(0.1, rel=1e-15)
    assert float(ask(counter, "INP:LEV?")) == pytest.approx(0.25, rel=1e-15)


@pytest.mark.parametrize(
    ("message", "number"),
    [
        ("FREQ", -109),
        ("FREQ (@1)", -109),
        ("FREQ 1,2", -108),
        ("FREQ INF", -104),
        ("FREQ NAN", -104),
        ("FREQ ON", -104),
        ('FREQ "40"', -104),
        ("FREQ 4 0", -104),
        ("FREQ 40 V", -131),
        ("FREQ 40 M", -131),
        ("FREQ 40 XHZ", -131),
        ("FUNC", -109),
        ("FUNC SINE", -224),
        ("FUNC SIN,SQU", -108),
        ("OUTP 2", -224),
        ("OUTP", -109),
        ("*RST 1", -108),
        ("*CLS 1", -108),
    ],
)
def test_a_bad_parameter_changes_nothing_and_queues_its_number(generator, message, number):
    before = dict(generator.settings)
    assert ask(generator, message) is None
    assert errors(generator) == [number]
    assert generator.settings == before


@pytest.mark.parametrize(
    ("message", "number"),
    [
        ("FREQ? FOO", -224),
        ("FREQ? 40", -224),
        ("FREQ? MIN,MAX", -108),
        ("FUNC? SIN", -108),
        ("OUTP? 1", -108),
        ("*IDN? 1", -108),
        ("SYST:ERR? 1", -108),
    ],
)
def test_a_bad_parameter_in_a_query_gets_no_reply(generator, message, number):
    assert ask(generator, message) is None
    assert errors(generator) == [number]


def test_a_query_can_ask_for_the_limits_and_the_default(generator):
    send(generator, b"FREQ 40\n")
    assert [float(ask(generator, f"FREQ? {word}")) for word in ("MIN", "MAX", "DEF")] == [1e-6, 30e6, 1e3]
    assert float(ask(generator, "FREQ?")) == 40.0


@pytest.mark.parametrize("word", ["SQU", "square", "Square"])
def test_a_choice_is_taken_in_both_forms_and_answered_in_the_short_one(generator, word):
    assert ask(generator, f"FUNC {word};FUNC?") == "SQU"


@pytest.mark.parametrize(("word", "answer"), [("ON", "1"), ("on", "1"), ("1", "1"), ("OFF", "0"), ("0", "0")])
def test_a_switch_is_answered_with_one_or_nought(generator, word, answer):
    assert ask(generator, f"OUTP1 {word};:OUTP1?") == answer


def test_an_infinite_load_is_understood_and_printed_as_scpi_prints_infinity(generator):
    assert ask(generator, "OUTP:LOAD INF;LOAD?") == "+9.900000000000000E+37"


# --- the error queue and the common commands ---


def test_a_full_queue_says_so_in_its_last_entry(generator):
    for k in range(25):
        send(generator, b"FOO%d\n" % k)
    queue = errors(generator)
    assert len(queue) == 20
    assert queue == [-113] * 19 + [-350]


def test_an_entry_is_a_string_in_ascii_whatever_was_sent(generator):
    assert ask(generator, 'F"O"Ö\x7f') is None
    assert ask(generator, "SYST:ERR?") == '-113,"Undefined header;F""O""??"'


def test_cls_empties_the_queue_and_keeps_the_settings(generator):
    send(generator, b"FREQ 40\nFOO\n*CLS\n")
    assert errors(generator) == []
    assert float(ask(generator, "FREQ?")) == 40.0


def test_rst_restores_the_settings_and_keeps_the_queue(generator):
    send(generator, b"FREQ 40\nOUTP ON\nFUNC SQU\nFOO\n*RST\n")
    assert ask(generator, "FREQ?;OUTP?;FUNC?") == "+1.000000000000000E+03;0;SIN"
    assert errors(generator) == [-113]


def test_opc_answers_one_when_everything_before_it_is_done(generator):
    assert ask(generator, "*OPC?") == "1"
    assert ask(generator, "FREQ 40;*WAI;*OPC?") == "1"


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


def test_an_answer_takes_its_time_on_the_clock_of_the_bench(generator):
    assert ask(generator, "*OPC?") == "1"
    assert generator.clock.now() == pytest.approx(generator.pace, abs=1e-12)


def test_a_counters_questions_in_one_message_take_as_long_as_one_after_the_other(counter):
    assert ask(counter, "INP1:COUP?;:INP1:IMP?;*OPC?").count(";") == 2
    assert counter.clock.now() == pytest.approx(3 * counter.pace, abs=1e-12)
