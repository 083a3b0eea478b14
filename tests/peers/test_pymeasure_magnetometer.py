"""PyMeasure's LakeShore425 class, unmodified, on the virtual gaussmeter: by @levilab, by pyserial's URL, over TCP."""

import pytest

pytest.importorskip("pymeasure")

from pymeasure.instruments.lakeshore import LakeShore425

from instruments.clock import VirtualClock
from instruments.virtual.magnetometer.lakeshore_425 import Virtual425

pytestmark = pytest.mark.parametrize("way", ["@levilab", "socket", "pyserial"])

FIELD_T = 0.0123
FIELD_G = FIELD_T * 1e4
#: Half a last digit with 3¾ digits and the noise of it.
DIGITS = 1e-3


@pytest.fixture
def device():
    return Virtual425(VirtualClock(), flux_density=lambda _: FIELD_T, zero_error=0.0)


@pytest.fixture
def meter(opened, device):
    return opened(LakeShore425, device)


@pytest.mark.parametrize(("unit", "reads"), [("G", FIELD_G), ("T", FIELD_T), ("Oe", FIELD_G), ("A/m", 9788.0)])
def test_the_field_in_every_unit(meter, unit, reads):
    meter.unit = unit
    assert meter.unit == unit
    assert meter.field == pytest.approx(reads, rel=DIGITS)


@pytest.mark.parametrize("gauss", [350, 3500, 35000])
def test_a_range_that_holds_the_field(meter, gauss):
    meter.range = gauss
    assert meter.range == gauss
    assert meter.field == pytest.approx(FIELD_G, rel=DIGITS, abs=1e-3 * gauss)


def test_a_field_beyond_the_range_is_no_number(meter):
    meter.range = 35
    assert meter.values("RDGFIELD?") == ["OL"]


def test_the_instrument_chooses_its_range(meter):
    meter.range = 35000
    meter.auto_range()
    assert meter.range == 350


@pytest.mark.parametrize(("wideband", "band"), [(True, 1), (False, 2)])
def test_steady_and_alternating_fields(meter, wideband, band):
    meter.dc_mode(wideband)
    assert meter.mode == (1, 0, band)
    meter.ac_mode(wideband)
    assert meter.mode == (2, 1, band)
    assert meter.field == pytest.approx(0, abs=DIGITS * 350)


def test_a_mean_of_many_readings(meter):
    mean, deviation = meter.measure(20, delay=0)
    assert mean == pytest.approx(FIELD_G, rel=DIGITS)
    assert deviation < DIGITS * 350


def test_what_is_there_is_taken_for_zero(meter, device):
    meter.zero_probe()
    assert meter.unit == "G"  # answered: it has begun
    device.clock.sleep(6.0)
    assert meter.field == pytest.approx(0, abs=DIGITS * 350)
