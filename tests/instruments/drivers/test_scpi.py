"""What the drivers have in common: settings, the error queue, identity."""

import math

import pytest

from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.drivers.generator.agilent_33220a import Agilent33220A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.drivers.generator.siglent_sdg1000x import SiglentSDG1000X
from instruments.drivers.scpi import ScpiInstrument, parse_reading
from instruments.drivers.setting import Setting
from instruments.errors import BadAnswer, CommandRefused, NoAnswer, OutOfRange, WrongInstrument
from support.conversation import CLEAR, NO_ERROR, SILENCE, accepted, conversation

#: Headers as in the programmer's references, numbers as the instruments print them (INSTRUMENTS: 15 digits, NR3).
WIRE = [
    (Keysight53230A, "gate", 0.1, "SENS:FREQ:GATE:TIME 0.1", "+1.000000000000000E-01"),
    (Keysight53230A, "coupling", "DC", "INP1:COUP DC", "DC"),
    (Keysight53230A, "impedance", 1e6, "INP1:IMP 1000000.0", "+1.000000000000000E+06"),
    (Keysight53230A, "probe_factor", 10.0, "INP1:PROB 10.0", "+1.000000000000000E+01"),
    (Keysight53230A, "input_range", 50.0, "INP1:RANG 50.0", "+5.000000000000000E+01"),
    (Keysight53230A, "trigger_level", -0.25, "INP1:LEV1 -0.25", "-2.500000000000000E-01"),
    (Keysight53230A, "automatic_level", False, "INP1:LEV:AUTO OFF", "0"),
    (Keysight53230A, "slope", "NEG", "INP1:SLOP1 NEG", "NEG"),
    (Keysight53230A, "measurement_timeout", 3.0, "SYST:TIM 3.0", "+3.000000000000000E+00"),
    (Keysight33500B, "waveform", "SQU", "FUNC SQU", "SQU"),
    (Keysight33500B, "frequency", 38.25, "FREQ 38.25", "+3.825000000000000E+01"),
    (Keysight33500B, "amplitude", 10.0, "VOLT 10.0", "+1.000000000000000E+01"),
    (Keysight33500B, "offset", 0.5, "VOLT:OFFS 0.5", "+5.000000000000000E-01"),
    (Keysight33500B, "load", 50.0, "OUTP1:LOAD 50.0", "+5.000000000000000E+01"),
    (Keysight33500B, "output", True, "OUTP1 ON", "1"),
    (Keysight33500B, "burst_cycles", 3.0, "BURS:NCYC 3.0", "+3.000000000000000E+00"),
    (Keysight33500B, "trigger_source", "EXT", "TRIG:SOUR EXT", "EXT"),
    (Keysight33500B, "trigger_slope", "NEG", "TRIG:SLOP NEG", "NEG"),
    (Keysight33500B, "trigger_delay", 0.001, "TRIG:DEL 0.001", "+1.000000000000000E-03"),
]

SETTINGS = [
    (driver, setting)
    for driver in (Keysight53230A, Keysight33500B)
    for setting in vars(driver).values()
    if isinstance(setting, Setting)
]


def test_the_wire_table_names_every_setting():
    assert {(driver, setting.name) for driver, setting in SETTINGS} == {row[:2] for row in WIRE}


@pytest.mark.parametrize(("driver", "name", "value", "sent", "answer"), WIRE)
def test_a_setting_is_sent_and_the_error_queue_read(driver, name, value, sent, answer):
    with conversation(driver, *accepted(sent)) as instrument:
        setattr(instrument, name, value)


@pytest.mark.parametrize(("driver", "name", "value", "sent", "answer"), WIRE)
def test_a_setting_is_asked_for_with_the_same_header(driver, name, value, sent, answer):
    with conversation(driver, (sent.split()[0] + "?", answer)) as instrument:
        got = getattr(instrument, name)
    assert got == value
    assert type(got) is type(value)


def _beyond(setting):
    """Numbers that a setting does not take; between two of its values there is none that it takes."""
    if setting.values:
        return [setting.values[0] - 1, sum(setting.values) / 2, math.nan, -math.inf]
    return [setting.low - 1, setting.high * 1.01, math.nan, -math.inf]


REFUSED = [
    pytest.param(driver, setting, value, id=f"{driver.__name__}-{setting.name}-{value}")
    for driver, setting in SETTINGS
    if setting.kind is not bool
    for value in (["FOO", ""] if setting.choices else _beyond(setting))
]


@pytest.mark.parametrize(("driver", "setting", "value"), REFUSED)
def test_a_value_out_of_range_is_refused_before_a_byte_is_sent(driver, setting, value):
    with (
        conversation(driver) as instrument,  # an empty script: anything sent would fail
        pytest.raises(OutOfRange) as refusal,
    ):
        setattr(instrument, setting.name, value)
    assert refusal.value.name == setting.name
    assert setting.name in str(refusal.value)
    largest = f"{setting.values[-1] if setting.values else setting.high:g}"
    assert (setting.choices[0] if setting.choices else largest) in refusal.value.allowed


def test_choices_are_taken_in_any_case_and_sent_in_capitals():
    with conversation(Keysight33500B, *accepted("FUNC SIN")) as generator:
        generator.waveform = "sin"


def test_the_text_of_the_error_queue_ends_up_in_the_error():
    refused = [("FREQ 20.0", None), ("SYST:ERR?", '-221,"Settings conflict;frequency reduced"'), NO_ERROR]
    with conversation(Keysight33500B, *refused) as generator, pytest.raises(CommandRefused) as refusal:
        generator.frequency = 20.0
    assert refusal.value.command == "FREQ 20.0"
    assert "Settings conflict;frequency reduced" in str(refusal.value)
    assert "-221" in str(refusal.value)


def test_the_whole_queue_is_read_oldest_first():
    queue = [("SYST:ERR?", '-113,"Undefined header"'), ("SYST:ERR?", '-222,"Data out of range"'), NO_ERROR]
    with conversation(ScpiInstrument, ("FOO", None), *queue) as instrument, pytest.raises(CommandRefused) as refusal:
        instrument.command("FOO")
    assert refusal.value.entries == ('-113 "Undefined header"', '-222 "Data out of range"')


def test_a_queue_that_never_ends_raises_with_a_short_line():
    endless = [("SYST:ERR?", '-310,"System error"')] * 64
    with conversation(ScpiInstrument, ("FOO", None), *endless) as instrument, pytest.raises(CommandRefused) as refusal:
        instrument.command("FOO")
    assert len(refusal.value.entries) == 64
    assert "and 60 more" in str(refusal.value)
    assert len(str(refusal.value)) < 250  # a line or two of a terminal


@pytest.mark.parametrize(
    ("driver", "identity"),
    [
        (Keysight53230A, "Agilent Technologies,53230A,MY50000484,02.05-1519.666-1.19-4.15-127-155-35"),
        (Keysight53230A, "Keysight Technologies,53220A,MY12345678,03.09-2037.776-1.28-4.15-127-156-36"),
        (Keysight33500B, "Agilent Technologies,33522B,MY52812345,3.05-1.19-2.00-52-00"),
        (Keysight33500B, "Keysight Technologies, 33509B ,MY59000123,5.03-3.15-2.00-58-00"),
        (ScpiInstrument, "maker,anything,,"),
    ],
)
def test_the_expected_instrument_is_welcome(driver, identity):
    with conversation(driver, ("*IDN?", identity)) as instrument:
        assert instrument.identity() == identity


@pytest.mark.parametrize(
    ("driver", "identity"),
    [
        (Keysight53230A, "Agilent Technologies,33522B,MY52812345,3.05-1.19-2.00-52-00"),
        (Keysight53230A, "Agilent Technologies,53131A,0,3944"),  # the counter before it, another language
        (Keysight53230A, "Keysight Technologies,53230AX,MY12345678,1"),
        (Keysight33500B, "Agilent Technologies,33220A,MY44000001,2.02-2.02-22-2"),
    ],
)
def test_another_instrument_raises_with_its_identity(driver, identity):
    with conversation(driver, ("*IDN?", identity)) as instrument, pytest.raises(WrongInstrument) as wrong:
        instrument.identity()
    assert wrong.value.identity == identity
    assert "check the address" in str(wrong.value)


#: The one message that asks for all settings, and its answer.
ALL_OF_A_COUNTER = (
    ";:".join(sent.split()[0] + "?" for driver, *_, sent, _ in WIRE if driver is Keysight53230A),
    ";".join(answer for driver, *_, answer in WIRE if driver is Keysight53230A),
)


def test_the_snapshot_names_settings_with_their_units():
    with conversation(Keysight53230A, ALL_OF_A_COUNTER) as counter:
        snapshot = counter.settings()
    assert snapshot == {
        "gate_s": 0.1,
        "coupling": "DC",
        "impedance_ohm": 1e6,
        "probe_factor": 10.0,
        "input_range_v": 50.0,
        "trigger_level_v": -0.25,
        "automatic_level": False,
        "slope": "NEG",
        "measurement_timeout_s": 3.0,
    }


#: The same, one by one.
EACH_OF_A_COUNTER = [(sent.split()[0] + "?", answer) for driver, *_, sent, answer in WIRE if driver is Keysight53230A]


@pytest.mark.parametrize("wrong", [";DC", ";NEG", ";", "last", SILENCE])
def test_after_an_answer_too_few_or_too_many_each_setting_is_asked_for(wrong):
    """The link is cleared before, as the others may still come, and the joined question is not tried again."""
    message, answers = ALL_OF_A_COUNTER
    with conversation(Keysight53230A, ALL_OF_A_COUNTER) as counter:
        snapshot = counter.settings()
    if wrong == "last":
        wrong = answers.rpartition(";")[2]
    elif wrong != SILENCE:
        wrong = answers.replace(";DC", "") if wrong == ";DC" else answers + wrong
    lines = [(message, wrong), (CLEAR, None), ("*CLS", None), *EACH_OF_A_COUNTER, *EACH_OF_A_COUNTER]
    with conversation(Keysight53230A, *lines) as counter:
        assert counter.settings() == snapshot
        assert counter.settings() == snapshot


def test_a_silence_after_joined_answers_is_a_fault_of_the_link():
    message, _ = ALL_OF_A_COUNTER
    with conversation(Keysight53230A, ALL_OF_A_COUNTER, (message, SILENCE), ALL_OF_A_COUNTER) as counter:
        counter.settings()
        with pytest.raises(NoAnswer):
            counter.settings()
        counter.settings()


def test_a_snapshot_with_an_answer_of_another_form_names_its_question():
    message, answers = ALL_OF_A_COUNTER
    wrong = answers.replace(";NEG;", ";NG;")
    with conversation(Keysight53230A, (message, wrong), (CLEAR, None)) as counter, pytest.raises(BadAnswer) as bad:
        counter.settings()
    assert bad.value.question == "INP1:SLOP1?"


def test_a_variant_of_a_driver_keeps_the_settings_of_its_model():
    class Variant(Keysight33500B):
        MODELS = "33220A"
        phase = Setting("PHAS", float, unit="deg")

    always = {setting.name for _, setting in SETTINGS if not setting.on_demand}
    rows = [row for row in WIRE if row[0] is Keysight33500B and row[1] in always]
    questions = [(sent.split()[0] + "?", answer) for *_, sent, answer in rows]
    with conversation(Variant, *questions, ("PHAS?", "+0.000000000000000E+00")) as generator:
        assert list(generator.settings()) == [
            *("waveform", "frequency_hz", "amplitude_vpp", "offset_v", "load_ohm", "output", "phase_deg")
        ]


@pytest.mark.parametrize(
    ("answer", "reading"),
    [
        ("+2.345678900000000E+01", 23.4567890),
        ("0", 0.0),
        ("+9.91000000000000E+037", None),  # not a number
        ("+9.9E+37", None),  # and infinity (SCPI-1999, vol. 1, 7.2.1)
        ("-9.9E+37", None),
    ],
)
def test_what_stands_for_no_reading_is_none(answer, reading):
    assert parse_reading("A", "READ?", answer) == reading


#: The value that was set and the present one: another value in whatever unit it is; or what the instrument rounds.
CHANGED = [
    (Keysight53230A, "gate", 1e-3, 5e-3),
    (Keysight53230A, "gate", 1.0, 1.011),
    (Keysight53230A, "trigger_level", 0.0, 2.6e-3),
    (Keysight53230A, "trigger_level", 0.6, 0.62),
    (Keysight53230A, "coupling", "DC", "AC"),
    (Keysight53230A, "automatic_level", False, True),
    (Keysight33500B, "amplitude", 2e-3, 6e-3),
    (Keysight33500B, "amplitude", 10.0, 9.98),
    (Keysight33500B, "amplitude", 1.0, 1.002),
    (Keysight33500B, "frequency", 1e-3, 5e-3),
    (Keysight33500B, "frequency", 30.0, 30.000002),
    (Agilent33220A, "frequency", 2e7, 2e7 + 2e-6),
    (Keysight33500B, "offset", 0.0, -1.1e-3),
    (Keysight33500B, "offset", 9.0, 9.0011),
    (Keysight33500B, "load", 9.9e37, 50.0),
    (SiglentSDG1000X, "frequency", 1234.56789, 1234.56791),
    (SiglentSDG1000X, "amplitude", 3.0, 3.0001),
    (SiglentSDG1000X, "offset", 0.5, 0.500011),
    (SiglentSDG1000X, "load", 75.0, 50.0),
    (Keysight33500B, "waveform", "SIN", "SQU"),
]
ROUNDED = [
    (Keysight53230A, "gate", 1e-3, 1.0099e-3),
    (Keysight53230A, "trigger_level", 0.0, 2.4e-3),
    (Keysight53230A, "trigger_level", 0.6, 0.5975),
    (Keysight53230A, "slope", "pos", "POS"),
    (Keysight33500B, "amplitude", 1.23456, 1.235),  # four digits
    (SiglentSDG1000X, "frequency", 1234.56789012, 1234.56789),  # ten
    (SiglentSDG1000X, "amplitude", 2 / 0.7070, 2.82885),  # six
    (SiglentSDG1000X, "load", 1234.5, 1234.0),
]


@pytest.mark.parametrize(
    ("driver", "name", "asked", "now", "differs"),
    [*((*row, True) for row in CHANGED), *((*row, False) for row in ROUNDED)],
)
def test_a_changed_setting_is_noticed_and_what_the_instrument_rounds_is_no_change(driver, name, asked, now, differs):
    assert getattr(driver, name).differs(asked, now) is differs
    assert not getattr(driver, name).differs(now, now)


def test_closing_the_driver_closes_its_transport():
    with conversation(ScpiInstrument) as instrument:
        instrument.close()
    assert instrument.transport.closed
