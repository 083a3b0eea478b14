"""When the virtual oscilloscopes trigger, and when not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.virtual.oscilloscope.record import Edge
from support.scopes import RIGOL_READY, constant, pulses, ramp, rigol, rigol_stopped, rigol_volts, slow
from support.wire import ask


@pytest.mark.parametrize("level", [-0.5, 0.0, 0.37])
@pytest.mark.parametrize(("slope", "sign"), [("POS", 1), ("NEG", -1)])
def test_the_trigger_stands_at_time_nought_to_a_sample(level, slope, sign):
    device = rigol_stopped(ramp, "CHAN1:OFFS 0", f":TRIG:EDGE:LEV {level};SLOP {slope}")
    times, volts = rigol_volts(device)
    middle = np.searchsorted(times, 0.0)
    # the triangle goes 200 V/s: a code of 8 mV is four samples of 10 µs wide
    nearest = volts[middle - 1 : middle + 2]
    assert np.abs(nearest - level).max() <= 0.004 + 200 * 2e-6
    assert sign * (volts[middle + 100] - volts[middle - 100]) > 0


@pytest.mark.parametrize("scale", [1e-7, 1e-5, 1e-3, 0.01, 0.1])
def test_the_edge_is_found_as_well_at_every_time_base(scale):
    device = rigol_stopped(ramp, "CHAN1:OFFS 0;SCAL 0.001", ":TRIG:EDGE:LEV 0.002;SLOP POS", f":TIM:SCAL {scale}")
    record = device.record()
    # the triangle rises through 2 mV 10 µs after each of its zeros at 0, 20, 40 … ms
    assert (record.trigger % 0.02) == pytest.approx(1e-5, abs=0.02 / record.rate)


@given(level=st.floats(-0.9, 0.9), start=st.floats(0.0, 1.0), step=st.sampled_from([1e-6, 5e-5]), rising=st.booleans())
def test_the_first_edge_behind_the_start_is_found(level, start, step, rising):
    edge = Edge(ramp, level, 0.05, (1.0 if rising else -1.0,), step, 1e-9, start)
    found = edge.until(start + 0.1)
    # where the triangle crosses the level, in every period of 20 ms
    place = (level / 200 if rising else 0.01 - level / 200) % 0.02
    assert (found - place) % 0.02 == pytest.approx(0.0, abs=1e-8) or (found - place) % 0.02 == pytest.approx(0.02)
    # armed on the way: never more than two periods
    assert start <= found <= start + 0.04


def test_looking_on_gives_the_same_edge_as_looking_once():
    once = Edge(pulses, 0.65, 0.1, (1.0,), 5e-5, 1e-9, 0.0).until(1.0)
    again = Edge(pulses, 0.65, 0.1, (1.0,), 5e-5, 1e-9, 0.0)
    stops = np.arange(0.0005, 0.1, 0.0005)
    found = [again.until(stop) for stop in stops]
    assert [f is not None for f in found] == [stop > once for stop in stops]
    assert next(f for f in found if f is not None) == pytest.approx(once, abs=1e-8)


def test_an_edge_of_either_slope_is_found_first_come_first_served():
    both = Edge(pulses, 0.65, 0.1, (1.0, -1.0), 5e-5, 1e-9, 0.0185)
    up = Edge(pulses, 0.65, 0.1, (1.0,), 5e-5, 1e-9, 0.0)
    falling = Edge(pulses, 0.65, 0.1, (-1.0,), 5e-5, 1e-9, 0.0)
    assert up.until(1.0) < falling.until(1.0)
    assert both.until(1.0) == pytest.approx(up.until(1.0), abs=1e-8)


def test_the_part_before_the_trigger_is_filled_first():
    device = rigol(ramp, *RIGOL_READY, "CHAN1:OFFS 0", ":TRIG:EDGE:LEV 0", ":TIM:SCAL 0.1", ":SING")
    assert ask(device, ":TRIG:STAT?") == "RUN"
    armed = device.acquisition.armed
    device.clock.sleep(2.0)
    assert device.record().trigger >= armed + 0.6


def test_sweep_auto_loses_pulses_that_come_more_rarely_than_it_waits():
    """The trap for a slow top: below 1/AUTO_AFTER the trace runs away although the level is right."""
    device = rigol(slow, *RIGOL_READY, ":TRIG:SWE AUTO", ":TIM:SCAL 0.0001")
    forced = []
    for _ in range(20):
        device.clock.sleep(0.517)
        forced.append(device.record().forced)
    assert any(forced)


def test_alternating_coupling_takes_the_mean_away_so_that_a_fixed_level_finds_nothing():
    device = rigol(constant(0.9), *RIGOL_READY, "CHAN1:COUP AC", ":TRIG:SWE AUTO", ":STOP")
    assert abs(rigol_volts(device)[1]).max() <= 0.004


def test_grounded_shows_nothing_and_inverted_the_negative():
    for setting, expected in (("COUP GND", 0.0), ("INV ON", -0.3)):
        device = rigol(constant(0.3), "CHAN1:PROB 1;SCAL 0.2;OFFS 0", f"CHAN1:{setting}", ":STOP")
        assert rigol_volts(device)[1] == pytest.approx(expected, abs=0.0041)
