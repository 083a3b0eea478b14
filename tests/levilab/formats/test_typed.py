"""Numbers as people type them, with and without units."""

import pytest

from levilab.formats.titles import plain_unit
from levilab.formats.typed import OF_KEYS, TYPED, ratio, read_number, unit_of_key
from levilab.present.units import UNITS


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("10s", "s", 10.0), ("2 min", "s", 120.0), ("1.5h", "s", 5400.0), ("25.4 g", "kg", 0.0254),
        ("30Hz", "Hz", 30.0), ("1800 rpm", "Hz", 30.0), ("360°/s", "Hz", 1.0), ("10 µs", "us", 10.0),
        ("7.5cm", "mm", 75.0), ("19 mT", "T", 0.019), ("90°", "rad", 1.5707963267949), ("900 mT cm", "T m", 0.009),
        ("1e-7", "", 1e-7), ("−3", "m", -3.0),
    ],
)  # fmt: skip
def test_a_number_is_read_with_any_unit_of_its_quantity(text, unit, value):
    assert read_number(text, unit) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("25cm", "kg", "'25cm': a number in kg, g or mg is expected"),
        ("0,03", "Hz", "write a decimal point, not a comma"),
        ("long", "s", "'long': a number is expected, which may have its unit, as 5 s"),
        ("30 mhz", "Hz", "'30 mhz': a number in Hz, kHz, MHz, mHz"),  # which of the two is not known
        ("5kg", "", "'5kg': a plain number is expected"),
    ],
)
def test_another_unit_is_refused_with_those_that_are_read(text, unit, said):
    with pytest.raises(ValueError, match=said):
        read_number(text, unit)


def test_endings_of_keys_have_the_units_of_results():
    """The endings are those of levilab.present.units, which stands on the same floor as the reader."""
    rows = {one.ending: one.si for one in UNITS}
    assert {ending: rows[ending] for ending in OF_KEYS} == OF_KEYS
    assert all(any(plain_unit(unit) in one for one in TYPED) for unit in OF_KEYS.values())
    assert unit_of_key("drive.ramp_hz_per_s") == "Hz/s"


@pytest.mark.parametrize(("typed", "unit"), [("25Mg", "kg"), ("5 MT", "T"), ("5 MM", "m")])
def test_mega_is_not_taken_for_milli(typed, unit):
    assert ratio(unit, typed.strip("25 ")) is None
    with pytest.raises(ValueError, match="is expected"):
        read_number(typed, unit)
