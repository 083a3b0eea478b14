"""PyMeasure's CNT91 class, unmodified, on the virtual counter, by each of the ways that lead there."""

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.virtual.counter.pendulum_cnt91 import VirtualCNT91
from support.light import pulses

pytest.importorskip("pymeasure")

from pymeasure.instruments.pendulum import CNT91

SPIN = 27.3


@pytest.fixture
def bench(opened):
    """PyMeasure's class, and the virtual instrument that it talks to."""
    device = VirtualCNT91(VirtualClock(), signal=pulses(SPIN))
    counter = opened(CNT91, device)
    yield counter, device
    assert counter.check_errors() == []


def count_pulses(counter):
    """What PyMeasure's class has no property for: the fixed level that slow pulses need."""
    counter.write("INP1:COUP DC")
    counter.write("INP1:LEV 0.65")


def test_it_is_identified_and_its_queue_is_empty(bench):
    counter, _ = bench
    assert "CNT-91" in counter.id
    assert counter.options == "0"
    assert counter.check_errors() == []


def test_every_property_can_be_set_and_asked_for(bench):
    counter, _ = bench
    for source in ("A", "B", "E", "IMM"):
        counter.external_start_arming_source = source
        assert counter.external_start_arming_source == source
    for slope in ("NEG", "POS"):
        counter.external_arming_start_slope = slope
        assert counter.external_arming_start_slope == slope
    for switch in (True, False):
        counter.continuous = switch
        assert counter.continuous is switch
        counter.interpolator_autocalibrated = switch
        assert counter.interpolator_autocalibrated is switch
    for gate in (2e-8, 0.01, 1, 1000):
        counter.gate_time = gate
        assert counter.gate_time == gate
    for kind in ("REAL", "ASCII"):
        counter.format = kind
        assert counter.format == kind
    assert counter.batch_size == 10000


@pytest.mark.parametrize("back_to_back", [True, False])
@pytest.mark.parametrize(("samples", "gate"), [(4, 1.0), (25, 0.1), (300, 0.05)])
def test_a_buffered_time_series_of_frequencies(bench, samples, gate, back_to_back):
    counter, device = bench
    count_pulses(counter)
    before = device.clock.now()
    counter.buffer_frequency_time_series("A", samples, gate_time=gate, back_to_back=back_to_back)
    found = counter.read_buffer()
    assert len(found) == samples
    np.testing.assert_allclose(found, SPIN, rtol=1e-5 / gate)
    # back to back: nothing but the gates, and the first edge; else up to two periods more for each
    assert device.clock.now() - before >= samples * gate
    assert device.clock.now() - before <= (samples if back_to_back else samples * (1 + 2 / SPIN / gate)) * gate + 0.2


def test_a_part_of_the_buffer(bench):
    counter, _ = bench
    count_pulses(counter)
    counter.buffer_frequency_time_series("A", 20, gate_time=0.1)
    assert len(counter.read_buffer(8)) == 8
    assert len(counter.read_buffer(12)) == 12


def test_a_long_gate_is_waited_for(bench):
    counter, device = bench
    count_pulses(counter)
    counter.buffer_frequency_time_series("A", 4, gate_time=100)
    np.testing.assert_allclose(counter.read_buffer(), SPIN, rtol=1e-7)
    assert device.clock.now() > 400


def test_arming_by_the_signal_itself(bench):
    counter, _ = bench
    count_pulses(counter)
    counter.buffer_frequency_time_series("A", 5, gate_time=0.1, trigger_source="A")
    np.testing.assert_allclose(counter.read_buffer(), SPIN, rtol=1e-4)


def test_what_it_sends_without_a_fixed_level_miscounts(bench):
    """The automatic level needs 100 Hz: PyMeasure's class alone does not count a spin."""
    counter, _ = bench
    counter.write("SYST:TOUT 1;:SYST:TOUT:TIME 2")
    counter.write("INP1:COUP AC;LEV:AUTO OFF;:INP1:LEV 2")
    counter.buffer_frequency_time_series("A", 4, gate_time=0.1)
    assert counter.read_buffer() == [9.91e37] * 4


def test_reset_and_clear(bench):
    counter, _ = bench
    counter.gate_time = 1
    counter.reset()
    assert counter.gate_time == 0.01
    counter.write("FOO")
    counter.clear()
