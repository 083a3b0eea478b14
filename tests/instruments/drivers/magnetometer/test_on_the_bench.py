"""The drivers of the gaussmeters at the virtual ones."""

import pytest

from instruments.clock import VirtualClock
from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.drivers.magnetometer.lakeshore_475 import LakeShore475
from instruments.virtual.magnetometer.lakeshore_425 import Virtual425
from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from support.talks import connected

DRIVERS = [(LakeShore425, Virtual425, "425"), (LakeShore475, Virtual475, "475"), (LakeShore475, Virtual475, "455")]


@pytest.mark.parametrize(("driver", "kind", "model"), DRIVERS)
def test_the_drivers_measure_zero_and_notice_an_overload(driver, kind, model):
    field = [0.0]
    options = {} if kind is Virtual425 else {"identity": f"LSCI,MODEL{model},VIRTUAL,01012020"}
    device = kind(VirtualClock(), flux_density=lambda _: field[0], zero_error=5e-6, **options)
    magnetometer = connected(driver, device, "GPIB0::12::INSTR")  # it has no line settings to get wrong
    assert f"MODEL{model}" in magnetometer.identity()
    magnetometer.forget_errors()
    magnetometer.prepare(range_t=None)
    magnetometer.zero()
    field[0] = 0.02
    device.clock.sleep(2.0)
    assert magnetometer.flux_density() == pytest.approx(0.02, rel=2e-4)
    magnetometer.prepare(range_t=0.01)
    assert magnetometer.settings()["range_t"] == pytest.approx(0.035)
    field[0] = 0.04
    device.clock.sleep(2.0)
    assert magnetometer.flux_density() is None
    field[0] = -0.03
    device.clock.sleep(2.0)
    assert magnetometer.flux_density() == pytest.approx(-0.03, rel=2e-4)
