"""What the drivers take for an answer: every setting of every driver, and what is refused.

Sources of the forms: see NUMBER of each driver.
"""

import re
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.drivers.counter.pendulum_cnt91 import PendulumCNT91
from instruments.drivers.generator.agilent_33220a import Agilent33220A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.drivers.magnetometer.lakeshore_475 import LakeShore475
from instruments.drivers.oscilloscope.keysight_dsox import KeysightDSOX
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.drivers.oscilloscope.siglent_sds1000xe import SiglentSDS1000XE
from instruments.drivers.scpi import ScpiInstrument
from instruments.drivers.setting import Setting
from instruments.errors import BadAnswer
from instruments.ieee488 import NR1, NR2, NR3, NUMERIC
from support.conversation import CLEAR, conversation

DRIVERS = [
    *(Keysight53230A, PendulumCNT91, Keysight33500B, Agilent33220A),
    *(RigolDS1000Z, KeysightDSOX, LakeShore425, LakeShore475),
]


def first_input(driver):
    """The inputs of a scope have settings of their own."""
    return lambda script: driver.CHANNEL(driver(script), 1)


#: Name, what makes the driver, how its questions begin, its class.
PARTS = [(driver.__name__, driver, "", driver) for driver in DRIVERS]
PARTS += [(f"{d.__name__}.channel", first_input(d), "CHAN1:", d.CHANNEL) for d in (RigolDS1000Z, KeysightDSOX)]
SETTINGS = [
    pytest.param(
        SimpleNamespace(make=make, question=f"{head}{setting.header}?", setting=setting, driver=driver),
        id=f"{name}.{setting.name}",
    )
    for name, make, head, driver in PARTS
    for setting in driver.declared_settings()
]


def of_kind(kind):
    return [row for row in SETTINGS if row.values[0].setting.kind is kind]


WORDS = [row for row in of_kind(str) if row.values[0].setting.choices]


def read(row, answer):
    with conversation(row.make, (row.question, answer)) as part:
        return getattr(part, row.setting.name)


def refused(row, answer):
    """The error; the link is cleared, for the answer may have been another question's."""
    with conversation(row.make, (row.question, answer), (CLEAR, None)) as part, pytest.raises(BadAnswer) as bad:
        pytest.fail(f"{answer!r} was taken for {getattr(part, row.setting.name)!r}")
    assert (bad.value.question, bad.value.answer) == (row.question, answer)
    assert "ask again" in str(bad.value)
    return bad.value


#: Seen when faults were put onto the wire, and cuts of what could have been right.
NO_WORDS = ["", "+5.0E-02", "~xxz!yDC", "DC;DC", '"SIN', "SI", "SINU", "XPOS", "POS ITIVE", '+0,"No error"', "\u0660"]


@pytest.mark.parametrize("row", of_kind(str))
def test_a_word_that_is_none_of_the_choices_is_refused(row):
    for answer in NO_WORDS:
        refused(row, answer)


#: The gaussmeters print numbers for words.
@pytest.mark.parametrize("row", [row for row in WORDS if row.values[0].driver not in {LakeShore425, LakeShore475}])
def test_a_word_is_read_in_its_short_and_long_form_in_any_case(row):
    for choice in (*row.setting.choices, *row.setting.answers):
        short = re.sub("[a-z]", "", choice)
        for answer in (short, choice, choice.upper(), short.lower(), choice.lower(), f'"{short}"'):
            assert read(row, answer) == short


def test_the_error_of_a_refused_word_has_the_choices():
    for parameter in WORDS:
        (row,) = parameter.values
        assert refused(row, "BANANA").expected.startswith(("one of ", "a number from ")), parameter.id


@pytest.mark.parametrize("row", of_kind(bool))
def test_a_switch_is_0_or_1_and_nothing_else(row):
    assert [read(row, answer) for answer in "01"] == [False, True]
    for answer in ("", "2", "+1", "01", "1.0", "ON", "TRUE", "0,0", "\u0661", "+1.000E+00"):
        assert refused(row, answer).expected == "0 or 1"


NO_NUMBERS = ["", "DC", "3", "4", "nan", "inf", "1_0", "\u0662", "1e400", "2.5E+01,2.5E+01", "+2.5E", "--2.5E+01"]


@pytest.mark.parametrize("row", of_kind(float))
def test_what_is_no_number_of_the_instruments_form_is_refused(row):
    for answer in NO_NUMBERS:
        assert (row.setting.form or row.driver.NUMBER).example in refused(row, answer).expected


#: Settings of few values: how real instruments print them is not confirmed, so all these are taken.
FEW_VALUES = [
    (Keysight53230A, "", "INP1:PROB", {"1": 1, "+1": 1, "10": 10, "+1.000E+00": 1, "1.0E+01": 10}),
    (Keysight53230A, "", "INP1:IMP", {"50": 50, "1000000": 1e6, "+1000000": 1e6, "+1.000E+06": 1e6, "+5.0E+01": 50}),
    (Keysight53230A, "", "INP1:RANG", {"5": 5, "50": 50, "+5.000E+00": 5, "+5.0E+01": 50}),
    (PendulumCNT91, "", "INP1:IMP", {"50": 50, "+50": 50, "1000000": 1e6, "+1.000E+06": 1e6, "5.0E+01": 50}),
    (PendulumCNT91, "", "INP1:ATT", {"1": 1, "10": 10, "+1.000E+01": 10}),
    (first_input(RigolDS1000Z), "CHAN1:", "PROB", {"1": 1, "+1": 1, "10": 10, "0.1": 0.1, "+1.000E+00": 1, "20": 20}),
]


@pytest.mark.parametrize(("make", "head", "header", "answers"), FEW_VALUES)
def test_a_setting_of_few_values_is_read_in_any_form(make, head, header, answers):
    for answer, value in answers.items():
        with conversation(make, (f"{head}{header}?", answer)) as part:
            name = next(setting.name for setting in part.declared_settings() if setting.header.endswith(header))
            assert getattr(part, name) == value


@pytest.mark.parametrize("answer", ["100000", "+1.00000000000000E+00", "+1.000E+0", "5", "+", "1000", "1.000E+01"])
def test_an_impedance_that_no_counter_has_is_refused(answer):
    with conversation(Keysight53230A, ("INP1:IMP?", answer), (CLEAR, None)) as counter, pytest.raises(BadAnswer):
        _ = counter.impedance


#: Settings of few values have forms of their own.
@pytest.mark.parametrize("row", [row for row in of_kind(float) if not row.values[0].setting.form])
def test_a_number_that_was_cut_off_is_refused(row):
    example = re.sub(r"\d+$", lambda digits: "0" * len(digits[0]), row.driver.NUMBER.example)
    read(row, example)
    for length in range(len(example)):
        refused(row, example[:length])


def spell(row, value):
    """Return the number as this instrument prints it."""
    sign, digits, e, exponent = re.fullmatch(r"([+-]?)\d+\.(\d+)([Ee])[+-](\d+)", row.driver.NUMBER.example).groups()
    mantissa, _, power = f"{value:{'+' if sign else ''}.{len(digits)}E}".partition("E")
    return f"{mantissa}{e}{int(power):+0{len(exponent) + 1}d}"


@pytest.mark.parametrize("row", of_kind(float))
def test_a_number_that_the_instrument_cannot_have_is_refused(row):
    setting = row.setting
    values = setting.values or setting.span or (setting.low, setting.high)
    low, high = min(values), max(values)
    for limit in (low, high):
        assert read(row, spell(row, limit)) == limit
    for beyond in (low - high, 2 * high):
        error = refused(row, spell(row, beyond))
        assert f"{high:g}" in error.expected


@pytest.mark.parametrize("answer", ["1.00E+06V", "-1.02E+05V"])
def test_a_level_that_no_scope_has_is_refused(answer):
    with (
        conversation(SiglentSDS1000XE, ("C1:TRLV?", f"C1:TRLV {answer}"), (CLEAR, None)) as scope,
        pytest.raises(BadAnswer),
    ):
        _ = scope.trigger_level


#: The others print as many digits as they like: there only a number cut at its end is recognised.
FIXED = (Keysight53230A, Keysight33500B, Agilent33220A, RigolDS1000Z, RigolDS1000Z.CHANNEL)


@pytest.mark.parametrize("row", [row for row in of_kind(float) if row.values[0].driver in FIXED])
def test_a_number_that_lost_any_of_its_bytes_is_refused(row):
    example = row.driver.NUMBER.example
    for k in range(len(example)):
        refused(row, example[:k] + example[k + 1 :])


@pytest.mark.parametrize("driver", [LakeShore425, LakeShore475])
def test_the_numbers_of_a_mode_may_have_leading_zeros(driver):
    with conversation(driver, ("RDGMODE?", ",".join("0" + n for n in driver._STEADY.split(",")))) as meter:
        assert meter.mode == driver._STEADY


@pytest.mark.parametrize("answer", ["3,1,1", "1,2,1", "1,1", "1,1,1,1", "1,1,0", "UNIT"])
def test_a_mode_that_the_gaussmeter_does_not_have_is_refused(answer):
    with conversation(LakeShore425, ("RDGMODE?", answer), (CLEAR, None)) as meter, pytest.raises(BadAnswer):
        _ = meter.mode


def test_a_word_without_choices_cannot_be_declared():
    with pytest.raises(TypeError, match="SOUR: a word needs choices"):
        Setting("SOUR", str)


# --- identity, error queue ---


@pytest.mark.parametrize("driver", DRIVERS)
def test_an_identity_has_four_fields(driver):
    for answer in ("", "1", "53230A", "a,b", "a,b,c", "a,b,c,d,e", ",b,c,d", "a,,c,d", "a,b,c,\x07d"):
        with conversation(driver, ("*IDN?", answer), (CLEAR, None)) as instrument, pytest.raises(BadAnswer) as bad:
            pytest.fail(f"{answer!r} was taken for {instrument.identity()}")
        assert bad.value.answer == answer


NO_ENTRIES = ["", "+2.5E+01", "No error", "DC", "0", "+0", "0,", '+0,No error"', '+0,"No err', '0,"No error']


@pytest.mark.parametrize("answer", [*NO_ENTRIES, '\u0660,"No error"'])
def test_what_is_no_entry_of_the_error_queue_is_not_taken_for_no_error(answer):
    with (
        conversation(ScpiInstrument, ("FOO", None), ("SYST:ERR?", answer), (CLEAR, None)) as instrument,
        pytest.raises(BadAnswer, match="SYST:ERR"),
    ):
        instrument.command("FOO")


# --- counters ---


@pytest.mark.parametrize(
    ("driver", "answer"),
    [
        (Keysight53230A, ""),  # only the CNT-91 answers with an empty line
        (Keysight53230A, "+2.5E+01"),
        (Keysight53230A, "+2.50000000000000E+01"),  # lost its last digit
        (Keysight53230A, "-2.50000000000000E+001"),
        (Keysight53230A, "+2.50000000000000E+201"),
        (Keysight53230A, "+9.92000000000000E+037"),
        (PendulumCNT91, "25"),
        (PendulumCNT91, "2.5000000000000E+01"),
        (PendulumCNT91, "+2.5000000000000E+0"),
        (PendulumCNT91, "-2.5000000000000E+01"),
    ],
)
def test_a_reading_that_no_counter_prints_is_refused(driver, answer):
    lines = (("SYST:ERR?", '0,"No error"'), ("READ?", answer), (CLEAR, None))
    with conversation(driver, *lines) as counter, pytest.raises(BadAnswer) as bad:
        counter.frequency()
    assert bad.value.answer == answer


def test_an_empty_place_in_a_series_of_a_53230a_is_no_missing_reading():
    one = "+2.50000000000000E+001"
    with conversation(Keysight53230A) as counter, pytest.raises(BadAnswer):
        counter._split("DATA:REM? 3,WAIT", f"{one},,{one}", 3)


@pytest.mark.parametrize("answer", ["0", "", "+1", "+2.5E+01"])
def test_a_series_of_a_cnt91_is_complete_when_it_says_1(answer):
    taken = [line for command in ("ARM:COUN 2", "INIT") for line in ((command, None), ("SYST:ERR?", '0,"No error"'))]
    end = [(CLEAR, None), (CLEAR, None), ("*CLS", None)]
    end += [line for command in ("ABOR", "ARM:COUN 1") for line in ((command, None), ("SYST:ERR?", '0,"No error"'))]
    lines = [*taken, ("SYST:ERR?", '0,"No error"'), ("*OPC?", answer), *end]
    with conversation(PendulumCNT91, *lines) as counter, pytest.raises(BadAnswer, match="OPC"):
        counter.readings(2)


# --- the forms themselves ---


@given(st.integers(-(10**14), 10**14))
def test_whole_numbers_are_nr1(number):
    assert NR1.number(str(number)) == NUMERIC.number(f"{number:+d}") == number


@given(st.floats(-1e30, 1e30))
def test_numbers_with_an_exponent_are_nr3(number):
    text = f"{number:+.16E}"
    assert NR3.number(text) == NUMERIC.number(text) == number


@given(st.text(alphabet="0123456789.eE+-_naif \u0660", max_size=12))
def test_what_a_form_takes_is_a_number_in_ascii(text):
    for form in (NR1, NR2, NR3, NUMERIC):
        if form.matches(text):
            assert text.isascii()
            assert "_" not in text
            float(text)
