"""The virtual counter against light whose frequency is known."""

import math
import struct
import tracemalloc

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.errors import OutOfRange
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from support import hostile
from support.light import DUTY, pulses
from support.wire import ask, cable, errors, numbers, received, send

NO_READING = 9.91e37
#: What the counter needs at 20 to 60 Hz (INSTRUMENTS.md, 1): a fixed level half way up, direct coupling.
FIXED_LEVEL = "INP1:COUP DC;LEV:AUTO OFF;:INP1:LEV1 0.65"


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


# --- long gates ---


def test_a_gate_of_a_thousand_seconds_needs_little_memory():
    device = counter(pulses(40.0), FIXED_LEVEL, "SENS:FREQ:GATE:TIME 1000", "SYST:TIM 2000")
    tracemalloc.start()
    got, took = reading(device, timeout=3000.0)
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()
    assert got == pytest.approx(40.0, rel=1e-8)
    assert took == pytest.approx(1000.0, abs=0.1)


def test_it_looks_no_further_than_the_edge_that_ends_the_gate():
    looked = []

    def light(start, step, n):
        looked.append(start + step * n)
        return pulses(40.0)(start, step, n)

    reading(counter(light, FIXED_LEVEL, "SENS:FREQ:GATE:TIME 1", "SYST:TIM 2000"))
    assert max(looked) < 1.3


def test_what_is_out_of_reach_is_not_worked_out():
    device = counter(pulses(40.0), FIXED_LEVEL, "SENS:FREQ:GATE:TIME 1000;:SAMP:COUN MAX;:TRIG:COUN MAX")
    assert ask(device, "READ?", 10.0) is None
    cable(device).clear()
    assert ask(device, "*OPC?") == "1"


# --- several readings, and the memory ---


@pytest.fixture
def five():
    """A counter that takes five readings of 0.1 s."""
    return counter(pulses(40.0), FIXED_LEVEL, "SAMP:COUN 5", "SYST:TIM 2")


def test_readings_are_samples_times_triggers(five):
    assert ask(five, "SAMP:COUN?") == "+5"
    assert len(numbers(ask(five, "READ?"))) == 5
    send(five, b"TRIG:COUN 3\n")
    assert len(numbers(ask(five, "READ?"))) == 15


def test_fetch_waits_for_what_was_begun_and_leaves_it_in_the_memory(five):
    before = five.clock.now()
    first = ask(five, "INIT;:FETC?")
    assert five.clock.now() - before >= 0.5
    assert ask(five, "FETC?") == first
    assert len(numbers(first)) == 5


def test_nothing_measured_is_nothing_to_fetch():
    device = counter(pulses(40.0))
    assert ask(device, "FETC?") is None
    assert ask(device, "R?") is None
    assert errors(device) == [-230, -230]


def test_the_memory_fills_while_no_program_asks(five):
    send(five, b"INIT\n")
    five.clock.sleep(0.3)
    assert ask(five, "DATA:POIN?") == "+2"
    assert ask(five, "STAT:OPER:COND?") == "+16"
    five.clock.sleep(1.0)
    assert ask(five, "DATA:POIN?;:STAT:OPER:COND?") == "+5;+0"


def test_r_takes_what_is_there_as_a_block(five):
    # joewhalen/keysight_53230A polls so
    send(five, b"INIT\n")
    assert ask(five, "R?") == "#10"
    five.clock.sleep(0.3)
    first = ask(five, "R?")
    assert first.startswith("#245+")
    assert len(numbers(first[4:])) == 2
    five.clock.sleep(1.0)
    assert len(numbers(ask(five, "R? 2")[4:])) == 2
    assert ask(five, "DATA:POIN?") == "+1"


def test_data_remove_takes_so_many_and_waits_with_the_word_wait(five):
    # opronningen/53230A-Toolkit reads so
    send(five, b"INIT\n")
    assert ask(five, "DATA:REM? 2", 0.0) is None
    assert errors(five) == [-230]
    before = five.clock.now()
    assert len(numbers(ask(five, "DATA:REM? 2,WAIT"))) == 2
    assert 0.2 <= five.clock.now() - before <= 0.3  # two gates, their edges, and a message
    assert len(numbers(ask(five, "DATA:REM? 3, WAIT"))) == 3
    assert ask(five, "DATA:REM? 1,WAIT", 0.0) is None
    assert errors(five) == [-230]


def test_gap_free_readings_follow_each_other(five):
    send(five, b"FREQ:MODE CONT;:FREQ:GATE:TIME 0.09;:SAMP:COUN 20\n")
    before = five.clock.now()
    assert len(numbers(ask(five, "READ?"))) == 20
    assert five.clock.now() - before == pytest.approx(20 * 0.1, abs=0.04)  # four periods hold the gate


def test_a_second_init_is_ignored_while_it_measures(five):
    send(five, b"INIT;:INIT\n")
    assert errors(five) == [-213]


def test_abort_ends_a_measurement_and_keeps_what_it_brought(five):
    send(five, b"INIT\n")
    five.clock.sleep(0.3)
    send(five, b"ABOR\n")
    assert len(numbers(ask(five, "FETC?"))) == 2
    assert ask(five, "*OPC?;:STAT:OPER:COND?") == "1;+0"


def test_operation_complete_is_noted_when_the_last_reading_is_there(five):
    send(five, b"*CLS;*ESE 1;*SRE 32;:INIT;*OPC\n")
    assert cable(five).status_byte() & 64 == 0
    five.clock.sleep(1.0)
    assert cable(five).status_byte() & 64


def test_on_the_bus_it_waits_for_a_trigger(five):
    send(five, b"TRIG:SOUR BUS;COUN 2;:INIT\n")
    five.clock.sleep(3.0)
    assert ask(five, "STAT:OPER:COND?;:DATA:POIN?") == "+32;+0"
    send(five, b"*TRG\n")
    five.clock.sleep(1.0)
    assert ask(five, "DATA:POIN?") == "+5"
    cable(five).trigger()
    assert len(numbers(ask(five, "FETC?"))) == 10


def test_a_trigger_that_no_run_waits_for_is_ignored(five):
    send(five, b"*TRG\nTRIG:SOUR IMM;:INIT\n")
    cable(five).trigger()
    assert errors(five) == [-211, -211]  # SCPI-1999, volume 2, 21.8.10


def test_a_trigger_delay_passes_before_the_gate_opens(five):
    send(five, b"TRIG:DEL 2;:SAMP:COUN 1\n")
    assert reading(five)[1] == pytest.approx(2.1, abs=0.06)


# --- formats ---


@pytest.mark.parametrize(("border", "order"), [("NORM", ">"), ("SWAP", "<")])
def test_real_readings_come_as_a_block(five, border, order):
    send(five, f"FORM REAL;:FORM:BORD {border};:READ?\n".encode())
    answer = received(five, 5.0)
    assert answer[:2] == b"#0"  # of indefinite length: programmer's reference, FORMat:DATA
    assert struct.unpack(order + "5d", answer[2:-1]) == pytest.approx([40.0] * 5, rel=1e-4)
    send(five, b"R? 2\n")
    answer = received(five, 5.0)
    assert answer[:4] == b"#216"
    assert struct.unpack(order + "2d", answer[4:-1]) == pytest.approx([40.0] * 2, rel=1e-4)
    assert ask(five, "FORM?") == "REAL,64"


# --- other functions, and both inputs ---


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        ("FREQ", 40.0),
        ("PER", 0.025),
        ("SPER", 0.025),
        ("PWID", 0.025 * DUTY),
        ("NWID", 0.025 * (1 - DUTY)),
        ("PDUT", DUTY),
        ("NDUT", 1 - DUTY),
        ("TOT:TIM", 4.0),
    ],
)
@pytest.mark.parametrize("slope", ["POS", "NEG"])
def test_every_function_gives_what_the_pulses_are(function, expected, slope):
    device = counter(pulses(40.0), "INP:COUP DC", f"INP:SLOP {slope}", "SYST:TIM 2")
    # the middle between dark and bright is where a pulse has its width; edges are misplaced by 3 µs
    answer = ask(device, f"CONF:{function} (@1);:INP:LEV 0.65;:READ?")
    assert float(answer) == pytest.approx(expected, rel=1e-2)


def test_an_interval_goes_from_one_input_to_the_other():
    def later(start, step, n):
        return pulses(40.0)(start - 0.004, step, n)

    device = Virtual53230A(VirtualClock(), signal=pulses(40.0), second=later)
    for message in ("INP1:COUP DC", "INP2:COUP DC", "SYST:TIM 2"):
        send(device, message.encode() + b"\n")
    levels = "INP1:LEV 0.65;:INP2:LEV 0.65"
    assert float(ask(device, f"CONF:TINT (@1),(@2);:{levels};:READ?")) == pytest.approx(0.004, rel=1e-2)
    assert float(ask(device, f"CONF:TINT (@2),(@1);:{levels};:READ?")) == pytest.approx(0.021, rel=1e-2)


def test_the_second_input_is_counted_when_it_is_named():
    device = Virtual53230A(VirtualClock(), signal=pulses(40.0), second=pulses(30.0))
    send(device, b"CONF:FREQ (@2);:INP2:COUP DC;LEV 0.65\n")
    assert float(ask(device, "READ?")) == pytest.approx(30.0, rel=1e-4)
    assert ask(device, "CONF?") == '"FREQ (@2)"'


@pytest.mark.parametrize("bad", ["CONF:FREQ (@3)", "CONF:FREQ 1,2,3", "CONF:FREQ (@1),(@2)", "CONF:FREQ ten"])
def test_a_configuration_that_makes_no_sense_changes_nothing(bad):
    device = counter(pulses(40.0), "SAMP:COUN 3")
    send(device, bad.encode() + b"\n")
    assert len(errors(device)) == 1
    assert ask(device, "SAMP:COUN?") == "+3"


def test_configure_turns_the_automatic_level_on_and_a_level_turns_it_off():
    # user's guide, Measuring Low Frequency Signals
    device = counter(pulses(40.0), "CONF:FREQ 10,(@1)")
    assert ask(device, "INP:LEV:AUTO?;:INP:LEV 1;LEV:AUTO?") == "1;0"


def test_measure_uses_the_automatic_level_and_so_fails_for_slow_signals():
    # user's guide: MEASure should not be used below 50 Hz
    # pulses are at 20 ms, 60 ms …: from 24 ms on there is none within 20 ms
    device = counter(pulses(25.0, noise=0.01), "INP:COUP DC", "SYST:TIM 2", start=0.024)
    assert not right(float(ask(device, "MEAS:FREQ? (@1)")))
    device = counter(pulses(200.0, noise=0.01), "INP:COUP DC", "SYST:TIM 2")
    assert float(ask(device, "MEAS:FREQ? 200,0.1,(@1)")) == pytest.approx(200.0, rel=0.05)


def test_the_level_found_once_stays():
    device = counter(pulses(200.0), "INP:COUP DC;LEV:AUTO ONCE")
    assert ask(device, "INP:LEV:AUTO?") == "0"
    assert float(ask(device, "INP:LEV?")) == pytest.approx(0.65, abs=0.05)
    assert float(ask(device, "INP:LEV:PTP?")) == pytest.approx(1.1, abs=0.05)


def test_a_probes_factor_is_in_the_levels():
    device = counter(pulses(40.0), "INP:COUP DC;PROB 10", "SYST:TIM 2", "INP:LEV 6.5")
    assert reading(device)[0] == pytest.approx(40.0, rel=1e-4)


def test_a_function_is_chosen_by_name():
    device = counter(pulses(40.0), FIXED_LEVEL)
    assert ask(device, 'FUNC "PER 1";FUNC?') == '"PER"'
    assert reading(device)[0] == pytest.approx(0.025, rel=1e-4)
    send(device, b'FUNC "VOLT"\n')
    assert errors(device) == [-224]


# --- statistics, and what keeps ---


def test_statistics_are_those_of_the_readings(five):
    send(five, b"CALC:AVER:STAT ON\n")
    values = np.array(numbers(ask(five, "READ?")))
    mean, deviation, least, greatest = numbers(ask(five, "CALC:AVER:ALL?"))
    assert mean == pytest.approx(values.mean(), rel=1e-14)
    assert deviation == pytest.approx(values.std(ddof=1), rel=1e-6, abs=1e-12)
    assert (least, greatest) == (values.min(), values.max())
    assert ask(five, "CALC:AVER:COUN?") == "+5"
    assert numbers(ask(five, "CALC:AVER:AVER?"))[0] == mean
    assert ask(five, "CALC:AVER:CLE;:CALC:AVER:COUN?") == "+0"
    assert float(ask(five, "CALC:AVER:AVER?")) == NO_READING


def test_statistics_that_are_off_are_no_numbers(five):
    ask(five, "READ?")
    assert numbers(ask(five, "CALC:AVER:ALL?")) == [NO_READING] * 4


def test_the_time_out_outlives_a_reset():
    # programmer's reference, SYSTem:TIMeout: it is in non-volatile memory
    device = counter(pulses(40.0), "SYST:TIM 7", "SENS:FREQ:GATE:TIME 5", "*RST")
    assert [float(ask(device, question)) for question in ("SYST:TIM?", "SENS:FREQ:GATE:TIME?")] == [7.0, 0.1]


@pytest.mark.parametrize("bad", ["SYST:TIM 2001", "SYST:TIM 0.001", "SAMP:COUN 0", "INP:LEV 6", "TRIG:COUN 1e7"])
def test_what_the_counter_does_not_take_is_out_of_range(bad):
    device = counter(pulses(40.0))
    send(device, bad.encode() + b"\n")
    assert errors(device) == [-222]


# --- a member of the family with one input and two functions ---


@pytest.mark.parametrize(
    ("message", "error"),
    [
        (b"CONF:TINT (@1),(@2)", -113),
        (b"MEAS:PWID?", -113),
        (b"SENS:TOT:GATE:TIME 1", -113),
        (b"INP2:COUP DC", -113),
        (b'FUNC "TINT 1,2"', -224),
        (b'FUNC "FREQ 2"', -224),
        (b"CONF:FREQ (@2)", -224),
    ],
)
def test_a_53210a_does_not_know_what_it_lacks(message, error):
    device = hostile.instrument("53210A")
    send(device, message + b"\n")
    assert errors(device) == [error]


def test_a_53210a_counts_at_its_input_and_its_driver_refuses_another():
    address = "TCPIP0::box::inst0::INSTR"
    library = library_for(VirtualBench({address: hostile.instrument("53210A")}))
    with Keysight53230A.connect(address, library=library) as driver:
        with pytest.raises(OutOfRange) as refused:
            driver.prepare(gate_s=0.5, trigger_level_v=0.6, channel=2)
        assert (refused.value.value, refused.value.allowed) == (2, "1")
        driver.prepare(gate_s=0.5, trigger_level_v=0.6)
        assert driver.frequency() == pytest.approx(30.0, rel=1e-3)  # of the light in that room
