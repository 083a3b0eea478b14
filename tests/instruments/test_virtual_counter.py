"""The virtual counter against light whose frequency is known."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from wire import received, send

from instruments.virtual.counter import Virtual53230A, crossings
from levilab.clock import VirtualClock

DARK, BRIGHT, DUTY = 0.1, 1.2, 0.03
NO_READING = 9.91e37
#: What the counter needs at 20 to 60 Hz (INSTRUMENTS.md, 1): a fixed level half way up, direct coupling.
FIXED_LEVEL = "INP1:COUP DC;LEV:AUTO OFF;:INP1:LEV1 0.65"


def pulses(frequency, *, noise=0.0):
    """Light of a top that keeps its spin: Gaussian pulses of 3 % of a turn, FWHM, evenly spaced."""

    def light(start, step, n):
        turns = frequency * (start + step * np.arange(n))
        place = turns % 1.0 - 0.5
        sigma = DUTY / math.sqrt(8 * math.log(2))
        random = np.random.default_rng(round(start * 1e6)).standard_normal(n) * noise
        return DARK + (BRIGHT - DARK) * np.exp(-0.5 * (place / sigma) ** 2) + random

    return light


def counter(signal, *messages, start=0.0):
    clock = VirtualClock()
    clock.sleep(start)
    device = Virtual53230A(clock, signal=signal)
    for message in (*messages, "*OPC?"):
        send(device, message.encode() + b"\n")
    assert received(device, 1.0) == b"1\n"
    return device


def reading(device, timeout=100.0):
    """The answer to ``READ?``, None if none comes, and how long it took [s]."""
    before = device.clock.now()
    send(device, b"READ?\n")
    answer = received(device, timeout)
    return None if answer is None else float(answer), device.clock.now() - before


def interpolation_error(frequency):
    """The most by which a straight line between two samples misplaces an edge [s].

    A chord leaves a curve by up to h²/8·max|v″|; a Gaussian of width s has |v″| ≤ A/s², and within a sample of
    its half height, here less than a quarter of s away, it is steeper than 0.52·A/s.
    """
    h, s = 1 / 20_000, DUTY / frequency / math.sqrt(8 * math.log(2))
    return h**2 / (8 * 0.52 * s)


@pytest.mark.parametrize("gate", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("frequency", [20.0, 21.86, 33.333, 47.11, 60.0])
def test_a_known_frequency_is_read_within_the_error_of_interpolation(frequency, gate):
    device = counter(pulses(frequency), FIXED_LEVEL, f"SENS:FREQ:GATE:TIME {gate}", f"SYST:TIM {2 * gate + 1}")
    got, took = reading(device)
    # both ends of the gate may be misplaced; 1e-14: the digits that are printed
    assert got == pytest.approx(frequency, rel=2 * interpolation_error(frequency) / gate + 1e-14)
    # the gate waits for its first edge and ends with one: up to two periods, and the time for a message
    assert gate <= took <= gate + 2 / frequency + device.pace


@pytest.mark.parametrize("slope", ["POS", "NEG"])
def test_falling_edges_give_the_same_frequency(slope):
    device = counter(pulses(40.0), FIXED_LEVEL, f"INP1:SLOP1 {slope}", "SYST:TIM 2")
    assert reading(device)[0] == pytest.approx(40.0, rel=2 * interpolation_error(40.0) / 0.1)


def test_configure_restores_the_gate():
    device = counter(pulses(40.0), FIXED_LEVEL, "SENS:FREQ:GATE:TIME 1", "CONF:FREQ (@1)")
    send(device, b"SENS:FREQ:GATE:TIME?\n")
    assert float(received(device, 1.0)) == 0.1


def test_two_readings_in_one_message_take_two_gates():
    device = counter(pulses(40.0), FIXED_LEVEL, "SENS:FREQ:GATE:TIME 1", "SYST:TIM 3")
    before = device.clock.now()
    send(device, b"READ?;READ?\n")
    first, second = received(device, 10.0).split(b";")
    assert float(first) == pytest.approx(40.0, rel=1e-4)
    assert float(second) == pytest.approx(40.0, rel=1e-4)
    assert device.clock.now() - before >= 2.0


# --- what must be set for a slow signal of short pulses ---

#: A 25 Hz signal of 3 % duty, met at twenty places of its 40 ms period.
PLACES = [0.002 * k for k in range(20)]


def right(got):
    return got is not None and abs(got - 25.0) < 0.1


def readings_at_all_places(*messages, noise=0.01):
    return [
        reading(counter(pulses(25.0, noise=noise), *messages, "SENS:FREQ:GATE:TIME 0.5", "SYST:TIM 2", start=start))[0]
        for start in PLACES
    ]


def test_fixed_level_and_direct_coupling_count_right_at_25_hz():
    assert all(map(right, readings_at_all_places(FIXED_LEVEL)))


def test_automatic_level_fails_at_25_hz_where_no_pulse_falls_into_its_window():
    got = readings_at_all_places("INP1:COUP DC;LEV:AUTO ON")
    # its window of 20 ms is half a period: a pulse falls into it in half of the places, more or less its width
    assert 8 <= sum(map(right, got)) <= 12
    assert any(value == NO_READING or value > 50.0 for value in got)


def test_alternating_coupling_and_level_nought_find_nothing_or_count_noise_at_25_hz():
    # the mean of such pulses lies 35 mV above the dark: less than the hysteresis, so that noise does the counting
    messages = "INP1:COUP AC;LEV:AUTO OFF;:INP1:LEV1 0"
    assert set(readings_at_all_places(messages, noise=0.0)) == {NO_READING}
    assert sum(map(right, readings_at_all_places(messages))) <= 4  # by chance


@pytest.mark.parametrize(("coupling", "seen"), [("DC", True), ("AC", False)])
def test_alternating_coupling_takes_the_mean_away(coupling, seen):
    # dark 0.1 V and a mean of 1.1 V·0.03·1.064 on it: without them the pulses reach 1.065 V
    device = counter(pulses(40.0), f"INP1:COUP {coupling};LEV:AUTO OFF;:INP1:LEV1 1.1", "SYST:TIM 2")
    assert (reading(device)[0] != NO_READING) is seen


def test_the_state_after_power_on_is_the_one_that_fails():
    device = counter(pulses(25.0))
    send(device, b"INP:COUP?;LEV:AUTO?\n")
    assert received(device, 1.0) == b"AC;1\n"


# --- time-outs ---


def test_a_level_above_the_pulses_ends_without_a_reading_after_the_counters_time_out():
    device = counter(pulses(40.0), "INP1:COUP DC;LEV:AUTO OFF;:INP1:LEV1 1.25", "SYST:TIM 7")
    got, took = reading(device)
    assert got == NO_READING
    # seven seconds after the message was understood
    assert took == pytest.approx(7.0 + device.pace, abs=1e-9)


@pytest.mark.parametrize(
    ("timeout", "gives_up_after"),
    [
        (0.5, 2.0),  # below the gate counts as twice the gate
        (1.0, 1.0),  # the gate itself does not
        (5.0, 5.0),
    ],
)
def test_a_time_out_below_the_gate_counts_as_twice_the_gate(timeout, gives_up_after):
    device = counter(pulses(40.0), FIXED_LEVEL, "INP1:LEV1 2", "SENS:FREQ:GATE:TIME 1", f"SYST:TIM {timeout}")
    assert reading(device)[1] == pytest.approx(gives_up_after + device.pace, abs=1e-9)


@pytest.mark.parametrize(("timeout", "seen"), [(0.5, True), (1.0, False), (1.1, True)])
def test_a_time_out_that_just_holds_the_gate_is_too_short_for_whole_periods(timeout, seen):
    device = counter(pulses(40.0), FIXED_LEVEL, "SENS:FREQ:GATE:TIME 1", f"SYST:TIM {timeout}")
    assert (reading(device)[0] != NO_READING) is seen


def test_without_a_time_out_the_counter_waits_until_it_is_aborted():
    device = counter(pulses(40.0), FIXED_LEVEL, "INP1:LEV1 2", "SYST:TIM INF")
    assert reading(device, timeout=1e6)[0] is None
    send(device, b"*OPC?\n")
    assert received(device, 1e6) is None  # busy with the reading still
    send(device, b"ABOR\n*OPC?\n")
    assert received(device, 1.0) == b"1\n"


def test_what_follows_an_abort_in_the_same_bytes_is_not_lost():
    device = counter(pulses(40.0), FIXED_LEVEL)
    send(device, b"ABOR\nINP1:LEV1 0.5\nINP1:LE")
    send(device, b"V1?\n")
    assert float(received(device, 1.0)) == 0.5


# --- the Schmitt trigger ---


def brute_force(voltage, level, hysteresis):
    """One sample after the other: armed below level − hysteresis, fires at the level."""
    found, armed = [], False
    for k, (before, after) in enumerate(itertools.pairwise(voltage)):
        armed = armed or before < level - hysteresis
        if armed and after >= level:
            found.append(k + (level - before) / (after - before))
            armed = False
    return found


#: Few different voltages, so that samples meet the level and the lower threshold exactly.
VOLTAGES = st.lists(st.integers(-4, 4).map(lambda k: k / 4), min_size=1, max_size=60)


@given(
    voltage=VOLTAGES, level=st.sampled_from([-0.25, 0.0, 0.3, 0.5]), hysteresis=st.sampled_from([0.0, 0.1, 0.25, 0.6])
)
def test_crossings_are_those_of_a_schmitt_trigger(voltage, level, hysteresis):
    got = crossings(np.array(voltage), level, hysteresis)
    # both divide the same small numbers; a crossing's place is of order 60 and rounded there
    np.testing.assert_allclose(got, brute_force(voltage, level, hysteresis), rtol=1e-14, atol=1e-14)


@given(voltage=VOLTAGES, level=st.sampled_from([-0.25, 0.0, 0.3]), hysteresis=st.sampled_from([0.0, 0.1, 0.6]))
def test_crossings_lie_between_samples_and_one_turn_back_apart(voltage, level, hysteresis):
    got = crossings(np.array(voltage), level, hysteresis)
    assert np.all((got >= 0) & (got <= len(voltage) - 1))
    assert np.all(np.diff(got) > 0)
