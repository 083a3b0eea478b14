"""The magnetometers' drivers: the manuals' bytes.

Source: Lake Shore Model 425 User's Manual, chapter 6; Model 475 User's Manual, chapter 6; public drivers.
"""

import math

import pytest

from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.drivers.magnetometer.lakeshore_475 import LakeShore475
from instruments.errors import BadAnswer, CommandRefused, NoAnswer, OutOfRange, WrongInstrument
from support.conversation import CLEAR, SILENCE, conversation

#: RDGMODE for steady fields: the 425 with its filter, the 475 with four digits.
STEADY = {LakeShore425: "1,1,1", LakeShore475: "1,2,1,1,1"}
BOTH = pytest.mark.parametrize("driver", [LakeShore425, LakeShore475])


def kept(message, answer=None):
    """A setting that stays as it was set."""
    header, _, value = message.partition(" ")
    return (f"{message};{header}?", answer or value)


#: After an answer that makes no sense: it may have been another question's.
CLEARED = (CLEAR, None)


def steady(driver):
    return [kept("UNIT 2"), kept(f"RDGMODE {STEADY[driver]}")]


#: One message: the unit before and after the field, and the status.
READING = "UNIT?;RDGFIELD?;UNIT?;OPST?"


def reading(field, unit="2", status="004", after=None):
    return (READING, f"{unit};{field};{after or unit};{status}")


@pytest.mark.parametrize(
    ("driver", "identity"),
    [
        (LakeShore425, "LSCI,MODEL425,VIRTUAL,1.0"),
        (LakeShore475, "LSCI,MODEL475,VIRTUAL,01012020"),
        (LakeShore475, "LSCI,MODEL455,4550001,01012020"),
    ],
)
def test_the_models_know_themselves(driver, identity):
    with conversation(driver, ("*IDN?", identity)) as magnetometer:
        assert magnetometer.identity() == identity


@pytest.mark.parametrize(
    ("driver", "identity"), [(LakeShore425, "LSCI,MODEL475,1,1"), (LakeShore475, "LSCI,MODEL425,VIRTUAL,1.0")]
)
def test_another_model_raises(driver, identity):
    with conversation(driver, ("*IDN?", identity)) as magnetometer, pytest.raises(WrongInstrument, match="MODEL4"):
        magnetometer.identity()


@BOTH
def test_without_a_range_the_instrument_chooses(driver):
    with conversation(driver, *steady(driver), kept("AUTO 1")) as magnetometer:
        magnetometer.prepare(range_t=None)


@pytest.mark.parametrize(
    ("driver", "probe", "range_t", "number"),
    [
        (LakeShore425, "40", 3.5e-3, 1),  # 35 G
        (LakeShore425, "40", 3.6e-3, 2),
        (LakeShore425, "50", 1.0, 4),  # 35 kG, at a cable of the user's
        (LakeShore425, "42", 1e-3, 3),
        (LakeShore475, "41", 1e-3, 1),
        (LakeShore475, "40", 1e-3, 2),
        (LakeShore475, "42", 3.5e-6, 1),  # 35 mG
    ],
)
def test_the_smallest_range_that_holds_the_field_depends_on_the_probe(driver, probe, range_t, number):
    lines = [*steady(driver), ("TYPE?", probe), kept("AUTO 0"), kept(f"RANGE {number}")]
    with conversation(driver, *lines) as magnetometer:
        magnetometer.prepare(range_t=range_t)


@pytest.mark.parametrize("range_t", [3.6, 0.0, -1.0, math.inf, math.nan])
def test_a_field_that_the_probe_does_not_measure_is_refused_and_nothing_is_set_for_it(range_t):
    lines = [*steady(LakeShore425), ("TYPE?", "40")]
    with conversation(LakeShore425, *lines) as magnetometer, pytest.raises(OutOfRange, match="range_t"):
        magnetometer.prepare(range_t=range_t)


@pytest.mark.parametrize("answer", ["1", "02,1", "", "OL"])
def test_a_setting_that_did_not_stay_raises(answer):
    lines = [("UNIT 2;UNIT?", answer), CLEARED]
    with conversation(LakeShore425, *lines) as magnetometer, pytest.raises(CommandRefused, match="UNIT 2"):
        magnetometer.prepare(range_t=None)


def test_a_setting_may_come_back_with_leading_zeros():
    lines = [kept("UNIT 2", "02"), kept("RDGMODE 1,1,1", "01,01,01"), kept("AUTO 1", "+1")]
    with conversation(LakeShore425, *lines) as magnetometer:
        magnetometer.prepare(range_t=None)


@BOTH
@pytest.mark.parametrize(
    ("answer", "unit", "tesla"),
    [
        ("+123.456E-04", "2", 0.0123456),
        ("+123.456E+00", "1", 0.0123456),
        ("-123.456E+00", "3", -0.0123456),
        ("+100.000E+01", "4", 4e-4 * math.pi),
        ("+000.000E+00", "2", 0.0),
    ],
)
def test_a_reading_is_in_tesla_whatever_the_unit_at_the_front_panel(driver, answer, unit, tesla):
    with conversation(driver, reading(answer, unit)) as magnetometer:
        assert magnetometer.flux_density() == pytest.approx(tesla, rel=1e-12)


def test_a_reading_is_one_exchange():
    lines = [*steady(LakeShore425), kept("AUTO 1"), *[reading("+100.000E-05")] * 2]
    with conversation(LakeShore425, *lines) as magnetometer:
        magnetometer.prepare(range_t=None)
        assert [magnetometer.flux_density() for _ in range(2)] == [1e-3, 1e-3]


def test_a_reading_during_which_the_unit_changed_is_taken_again():
    # tesla or gauss: who knows
    lines = [reading("+100.000E-05", unit="2", after="1"), reading("+100.000E-01", unit="1")]
    with conversation(LakeShore425, *lines) as magnetometer:
        assert magnetometer.flux_density() == pytest.approx(1e-3, rel=1e-12)


def test_a_unit_that_changes_all_the_time_raises():
    lines = [reading("+100.000E-05", unit=unit, after=after) for unit, after in ("21", "12", "24")]
    with conversation(LakeShore425, *lines) as magnetometer, pytest.raises(BadAnswer):
        magnetometer.flux_density()


@pytest.mark.parametrize(("answer", "status"), [("OL", "002"), ("OL", "000"), ("+350.000E-04", "006")])
def test_a_field_beyond_the_range_is_no_reading(answer, status):
    with conversation(LakeShore425, reading(answer, status=status)) as magnetometer:
        assert magnetometer.flux_density() is None


@pytest.mark.parametrize(("answer", "status"), [("NO PROBE", "001"), ("+000.000E+00", "001"), ("+100.000E+00", "016")])
def test_no_probe_is_an_error_and_no_field(answer, status):
    with (
        conversation(LakeShore475, reading(answer, status=status), CLEARED) as magnetometer,
        pytest.raises(BadAnswer, match="plugged in") as bad,
    ):
        magnetometer.flux_density()
    assert bad.value.answer == f"2;{answer};2;{status}"


@pytest.mark.parametrize(
    "garbage",
    [
        *("", "x", "1,2", "nan", "inf", "+123.4.5E+00", "1_0", "1e400", "+9.91E+37", "-360.000E-01"),
        *("4", "+1.0", "123.456E-04", "+123.456E-0", "+123.456E", "+23.456E-04", "+123.46E-04", "+12\u0663.456E-04"),
    ],
)
def test_garbage_is_no_reading_but_an_error(garbage):
    with conversation(LakeShore425, reading(garbage), CLEARED) as magnetometer, pytest.raises(BadAnswer) as bad:
        magnetometer.flux_density()
    assert (bad.value.question, bad.value.answer) == (READING, f"2;{garbage};2;004")


@pytest.mark.parametrize(
    "answer",
    [
        "5;+100.000E-04;5;004",
        "0;+100.000E-04;0;004",
        "2;+100.000E-04;T;004",
        "2;+100.000E-04;2;?",
        "2;+100.000E-04;2;4",
        "2;+100.000E-04;2",
        "+100.000E-04;2;004",
        "2;+100.000E-04;2;004;004",
        # a late answer to another question: RANGE?, UNIT?, RDGMODE?, OPST?, TYPE?, *IDN?
        *("4", "2", "1,1,1", "004", "40", "LSCI,MODEL425,VIRTUAL,1.0"),
    ],
)
@BOTH
def test_the_answer_to_another_question_is_never_taken_for_a_field(driver, answer):
    with conversation(driver, (READING, answer), CLEARED) as magnetometer, pytest.raises(BadAnswer) as bad:
        magnetometer.flux_density()
    assert bad.value.answer == answer
    assert "as 2;+123.456E-04;2;004" in bad.value.expected


@pytest.mark.parametrize("probe", ["00", "43", "60", "HSE", "4", "2", "040", "4\u0660"])
def test_an_unknown_probe_raises(probe):
    lines = [*steady(LakeShore425), ("TYPE?", probe), CLEARED]
    with conversation(LakeShore425, *lines) as magnetometer, pytest.raises(BadAnswer, match=r"TYPE\?"):
        magnetometer.prepare(range_t=0.1)


def test_the_425_says_itself_when_it_is_zeroed():
    lines = [("ZPROBE", None), ("OPST?", "004"), ("OPST?", "000"), ("OPST?", "132")]
    with conversation(LakeShore425, *lines) as magnetometer:
        magnetometer.zero()


def test_a_zero_that_never_comes_raises():
    lines = [("ZPROBE", None), *[("OPST?", "004")] * 600]
    with conversation(LakeShore425, *lines) as magnetometer, pytest.raises(NoAnswer, match="ZPROBE"):
        magnetometer.zero()


def test_the_475_answers_when_it_is_zeroed():
    with conversation(LakeShore475, ("ZPROBE;*OPC?", "1")) as magnetometer:
        magnetometer.zero()
        assert magnetometer.transport.waited == [20.0]


def test_a_475_that_answers_something_else_is_not_zeroed():
    with conversation(LakeShore475, ("ZPROBE;*OPC?", "004"), CLEARED) as magnetometer, pytest.raises(BadAnswer):
        magnetometer.zero()


@pytest.mark.parametrize("answer", ["", "4", "04", "+4", "1_0", "2;004"])
def test_a_status_is_three_digits(answer):
    lines = [("ZPROBE", None), ("OPST?", answer), CLEARED]
    with conversation(LakeShore425, *lines) as magnetometer, pytest.raises(BadAnswer, match="three digits"):
        magnetometer.zero()


@pytest.mark.parametrize("answer", ["0", "5", "+2", "1_", "+190.050E-04", ""])
def test_a_range_that_the_probe_does_not_have_is_refused(answer):
    lines = [("TYPE?", "40"), ("UNIT?", "2"), ("AUTO?", "0"), ("RDGMODE?", "1,1,1"), ("RANGE?", answer), CLEARED]
    with conversation(LakeShore425, *lines) as magnetometer, pytest.raises(BadAnswer) as bad:
        magnetometer.settings()
    assert (bad.value.question, bad.value.answer) == ("RANGE?", answer)


def test_a_475_that_is_silent_after_a_zero_raises():
    with conversation(LakeShore475, ("ZPROBE;*OPC?", SILENCE)) as magnetometer, pytest.raises(NoAnswer):
        magnetometer.zero()


def test_the_settings_have_their_units():
    lines = [("TYPE?", "40"), ("UNIT?", "2"), ("AUTO?", "0"), ("RDGMODE?", "1,1,1"), ("RANGE?", "2")]
    with conversation(LakeShore425, *lines) as magnetometer:
        assert magnetometer.settings() == {
            "unit": "TESLA",
            "automatic_range": "OFF",
            "mode": "1,1,1",
            "probe": "HSE",
            "range_t": 35e-3,
        }


def test_there_is_no_error_queue_to_read():
    with conversation(LakeShore425) as magnetometer:
        magnetometer.forget_errors()
        magnetometer.raise_errors("UNIT 2")
        magnetometer.close()
        assert magnetometer.transport.closed


def test_a_word_that_is_no_unit_is_refused():
    with conversation(LakeShore425) as magnetometer, pytest.raises(OutOfRange) as refused:
        magnetometer.unit = "FURLONG"
    assert (refused.value.name, refused.value.value) == ("unit", "FURLONG")
