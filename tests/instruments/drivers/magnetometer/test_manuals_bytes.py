"""The magnetometers' drivers: the manuals' bytes.

Source: Lake Shore Model 425 User's Manual, chapter 6; Model 475 User's Manual, chapter 6; public drivers.
"""

import math

import pytest

from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.drivers.magnetometer.lakeshore_475 import LakeShore475
from instruments.errors import BadAnswer, CommandRefused, NoAnswer, OutOfRange, WrongInstrument
from support.conversation import CLEAR, SILENCE, conversation
from support.talks import Raises, talk, talks

#: RDGMODE for steady fields: the 425 with its filter, the 475 with four digits.
STEADY = {LakeShore425: "1,1,1", LakeShore475: "1,2,1,1,1"}
#: After an answer that makes no sense: it may have been another question's.
CLEARED = (CLEAR, None)
#: One message: the unit before and after the field, and the status.
READING = "UNIT?;RDGFIELD?;UNIT?;OPST?"


def kept(message, answer=None):
    """A setting that stays as it was set."""
    header, _, value = message.partition(" ")
    return (f"{message};{header}?", answer or value)


def steady(driver):
    return [kept("UNIT 2"), kept(f"RDGMODE {STEADY[driver]}")]


def reading(field, unit="2", status="004", after=None):
    return (READING, f"{unit};{field};{after or unit};{status}")


def asked_for_range(answer):
    return [("TYPE?", "40"), ("UNIT?", "2"), ("AUTO?", "0"), ("RDGMODE?", "1,1,1"), ("RANGE?", answer)]


def identity(meter):
    return meter.identity()


def prepare(range_t):
    return lambda meter: meter.prepare(range_t=range_t)


def field(meter):
    return meter.flux_density()


def zero(meter):
    return meter.zero()


SETTINGS = {
    **{
        f"{said} is a model of its driver": (driver, [("*IDN?", said)], identity, said)
        for driver, said in (
            (LakeShore425, "LSCI,MODEL425,VIRTUAL,1.0"),
            (LakeShore475, "LSCI,MODEL475,VIRTUAL,01012020"),
            (LakeShore475, "LSCI,MODEL455,4550001,01012020"),
        )
    },
    **{
        f"{said} is another model": (driver, [("*IDN?", said)], identity, Raises(WrongInstrument, "MODEL4"))
        for driver, said in ((LakeShore425, "LSCI,MODEL475,1,1"), (LakeShore475, "LSCI,MODEL425,VIRTUAL,1.0"))
    },
    **{
        f"without a range the {driver.__name__} chooses": (
            driver,
            [*steady(driver), kept("AUTO 1")],
            prepare(None),
            None,
        )
        for driver in STEADY
    },
    **{
        f"{range_t} T at the probe {probe} are the range {number} of the {driver.__name__}": (
            *(driver, [*steady(driver), ("TYPE?", probe), kept("AUTO 0"), kept(f"RANGE {number}")]),
            *(prepare(range_t), None),
        )
        for driver, probe, range_t, number in (
            (LakeShore425, "40", 3.5e-3, 1),  # 35 G
            (LakeShore425, "40", 3.6e-3, 2),
            (LakeShore425, "50", 1.0, 4),  # 35 kG, at a cable of the user's
            (LakeShore425, "42", 1e-3, 3),
            (LakeShore475, "41", 1e-3, 1),
            (LakeShore475, "40", 1e-3, 2),
            (LakeShore475, "42", 3.5e-6, 1),  # 35 mG
        )
    },
    **{
        f"{range_t} T are not measured by the probe, and nothing is set for them": (
            *(LakeShore425, [*steady(LakeShore425), ("TYPE?", "40")]),
            *(prepare(range_t), Raises(OutOfRange, "range_t")),
        )
        for range_t in (3.6, 0.0, -1.0, math.inf, math.nan)
    },
    **{
        f"a setting that comes back as {answer!r} did not stay": (
            *(LakeShore425, [("UNIT 2;UNIT?", answer), CLEARED], prepare(None), Raises(CommandRefused, "UNIT 2")),
        )
        for answer in ("1", "02,1", "", "OL")
    },
    "a setting may come back with leading zeros": (
        LakeShore425,
        [kept("UNIT 2", "02"), kept("RDGMODE 1,1,1", "01,01,01"), kept("AUTO 1", "+1")],
        *(prepare(None), None),
    ),
    **{
        f"{probe!r} is an unknown probe": (
            *(LakeShore425, [*steady(LakeShore425), ("TYPE?", probe), CLEARED]),
            *(prepare(0.1), Raises(BadAnswer, r"TYPE\?")),
        )
        for probe in ("00", "43", "60", "HSE", "4", "2", "040", "4\u0660")
    },
    "the settings have their units": (
        *(LakeShore425, asked_for_range("2"), lambda it: it.settings()),
        {"unit": "TESLA", "automatic_range": "OFF", "mode": "1,1,1", "probe": "HSE", "range_t": 35e-3},
    ),
    **{
        f"{answer!r} is no range of the probe": (
            *(LakeShore425, [*asked_for_range(answer), CLEARED], lambda it: it.settings()),
            Raises(BadAnswer, has={"question": "RANGE?", "answer": answer}),
        )
        for answer in ("0", "5", "+2", "1_", "+190.050E-04", "")
    },
    "a word that is no unit is refused": (
        *(LakeShore425, [], lambda it: setattr(it, "unit", "FURLONG")),
        Raises(OutOfRange, has={"name": "unit", "value": "FURLONG"}),
    ),
}
READINGS = {
    **{
        f"{answer} in the unit {unit} of the {driver.__name__} is given in tesla": (
            *(driver, [reading(answer, unit)], field, pytest.approx(tesla, rel=1e-12)),
        )
        for driver in STEADY
        for answer, unit, tesla in (
            ("+123.456E-04", "2", 0.0123456),
            ("+123.456E+00", "1", 0.0123456),
            ("-123.456E+00", "3", -0.0123456),
            ("+100.000E+01", "4", 4e-4 * math.pi),
            ("+000.000E+00", "2", 0.0),
        )
    },
    "a reading is one exchange": (
        *(LakeShore425, [*steady(LakeShore425), kept("AUTO 1"), *[reading("+100.000E-05")] * 2]),
        *(lambda it: (it.prepare(range_t=None), it.flux_density(), it.flux_density()), (None, 1e-3, 1e-3)),
    ),
    "a reading during which the unit changed is taken again": (  # tesla or gauss: who knows
        *(LakeShore425, [reading("+100.000E-05", after="1"), reading("+100.000E-01", unit="1")]),
        *(field, pytest.approx(1e-3, rel=1e-12)),
    ),
    "a unit that changes all the time": (
        *(LakeShore425, [reading("+100.000E-05", unit=unit, after=after) for unit, after in ("21", "12", "24")]),
        *(field, Raises(BadAnswer)),
    ),
    **{
        f"{answer} with the status {status} is beyond the range": (
            *(LakeShore425, [reading(answer, status=status)], field, None),
        )
        for answer, status in (("OL", "002"), ("OL", "000"), ("+350.000E-04", "006"))
    },
    **{
        f"{answer} with the status {status} is no probe and no field": (
            *(LakeShore475, [reading(answer, status=status), CLEARED], field),
            Raises(BadAnswer, "plugged in", {"answer": f"2;{answer};2;{status}"}),
        )
        for answer, status in (("NO PROBE", "001"), ("+000.000E+00", "001"), ("+100.000E+00", "016"))
    },
    **{
        f"{garbage!r} is no field": (
            *(LakeShore425, [reading(garbage), CLEARED], field),
            Raises(BadAnswer, has={"question": READING, "answer": f"2;{garbage};2;004"}),
        )
        for garbage in (
            *("", "x", "1,2", "nan", "inf", "+123.4.5E+00", "1_0", "1e400", "+9.91E+37", "-360.000E-01"),
            *("4", "+1.0", "123.456E-04", "+123.456E-0", "+123.456E", "+23.456E-04", "+123.46E-04"),
            "+12\u0663.456E-04",
        )
    },
    **{
        f"{answer!r} of the {driver.__name__} is the answer to another question": (
            *(driver, [(READING, answer), CLEARED], field),
            Raises(BadAnswer, r"as 2;\+123\.456E-04;2;004", {"answer": answer}),
        )
        for driver in STEADY
        for answer in (
            *("5;+100.000E-04;5;004", "0;+100.000E-04;0;004", "2;+100.000E-04;T;004", "2;+100.000E-04;2;?"),
            *("2;+100.000E-04;2;4", "2;+100.000E-04;2", "+100.000E-04;2;004", "2;+100.000E-04;2;004;004"),
            # a late answer to another question: RANGE?, UNIT?, RDGMODE?, OPST?, TYPE?, *IDN?
            *("4", "2", "1,1,1", "004", "40", "LSCI,MODEL425,VIRTUAL,1.0"),
        )
    },
}
ZEROS = {
    "the 425 says itself when it is zeroed": (
        *(LakeShore425, [("ZPROBE", None), ("OPST?", "004"), ("OPST?", "000"), ("OPST?", "132")], zero, None),
    ),
    "a zero that never comes": (
        *(LakeShore425, [("ZPROBE", None), *[("OPST?", "004")] * 600], zero, Raises(NoAnswer, "ZPROBE")),
    ),
    **{
        f"{answer!r} is no status": (
            *(LakeShore425, [("ZPROBE", None), ("OPST?", answer), CLEARED], zero, Raises(BadAnswer, "three digits")),
        )
        for answer in ("", "4", "04", "+4", "1_0", "2;004")
    },
    "the 475 answers when it is zeroed": (
        *(LakeShore475, [("ZPROBE;*OPC?", "1")], lambda it: it.zero() or it.transport.waited, [20.0]),
    ),
    "a 475 that answers something else": (
        *(LakeShore475, [("ZPROBE;*OPC?", "004"), CLEARED], zero, Raises(BadAnswer)),
    ),
    "a 475 that is silent after a zero": (LakeShore475, [("ZPROBE;*OPC?", SILENCE)], zero, Raises(NoAnswer)),
}


@talks(SETTINGS | READINGS | ZEROS)
def test_a_magnetometer_is_talked_to_as_its_manual_says(driver, lines, act, end):
    talk(driver, lines, act, end)


def test_there_is_no_error_queue_to_read():
    with conversation(LakeShore425) as magnetometer:
        magnetometer.forget_errors()
        magnetometer.raise_errors("UNIT 2")
        magnetometer.close()
        assert magnetometer.transport.closed
