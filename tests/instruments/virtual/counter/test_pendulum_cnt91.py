"""The virtual CNT-91 against light whose frequency is known.

Sources of what is expected: Programmer's Handbook of the CNT-90 series, pages as cited; the messages that public
drivers send (PyMeasure's CNT91, QMI's Tektronix_FCA3000, QCoDeS's FCA3100).
"""

import struct
import tracemalloc

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.counter.pendulum_cnt91 import PendulumCNT91
from instruments.errors import OutOfRange
from instruments.links.visa import VisaTransport
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.counter.pendulum_cnt91 import VirtualCNT91
from support.light import pulses
from support.wire import ask, cable, errors, numbers, received, send

FIXED_LEVEL = "INP:COUP DC;LEV 0.65"


def counter(signal, *messages, **settings):
    device = VirtualCNT91(VirtualClock(), signal=signal, **settings)
    for message in messages:
        send(device, message.encode() + b"\n")
    assert errors(device) == []
    return device


@pytest.fixture
def ready():
    return counter(pulses(40.0), FIXED_LEVEL, "ACQ:APER 0.1")


def test_it_answers_its_name_and_an_empty_queue_without_a_sign(ready):
    assert ask(ready, "*IDN?").split(",")[1].strip() == "CNT-91"
    assert ask(ready, "SYST:ERR?") == '0,"No error"'


@pytest.mark.parametrize("gate", [0.01, 0.1, 1.0, 10.0])
def test_one_reading_takes_its_gate_and_is_right(gate):
    device = counter(pulses(25.0), FIXED_LEVEL, f"ACQ:APER {gate}")
    before = device.clock.now()
    assert float(ask(device, "READ?", 30.0)) == pytest.approx(25.0, rel=1e-5 / gate)
    assert gate <= device.clock.now() - before <= gate + 2 / 25.0 + 0.01


def test_a_number_has_fourteen_digits(ready):
    # PyMeasure's test of CNT91.gate_time
    assert ask(ready, "ACQ:APER 2e-8;APER?") == "+2.0000000000000E-08"


def test_numbers_for_switches_are_understood_as_programs_write_them(ready):
    # PyMeasure sends 1.0 and 0.0
    assert ask(ready, "FORM:TINF 1.0;TINF?;TINF 0.0;TINF?;TINF ON;TINF?") == "1;0;1"


def test_setting_a_level_turns_the_automatic_one_off(ready):
    send(ready, b"INP:LEV:AUTO ON\n")
    assert ask(ready, "INP:LEV:AUTO?;:INP:LEV 0.5;LEV:AUTO?") == "1;0"  # handbook, 8-49


# --- blocks of readings ---


@pytest.mark.parametrize("size", ["10", "(10)"])
def test_an_array_is_measured_and_fetched_as_pymeasure_does(ready, size):
    for message in (f":CONF:ARR:FREQ:BTB {size},(@1)", "INIT:CONT 0.0", ":ACQ:APER 0.1", ":INIT"):
        send(ready, message.encode() + b"\n")
    before = ready.clock.now()
    assert ask(ready, "*OPC?") == "1"
    # ten gates without dead time, and less than two periods until the first edge
    assert ready.clock.now() - before == pytest.approx(1.0, abs=0.05 + 0.01)
    found = numbers(ask(ready, ":FETC:ARR? MAX"))
    np.testing.assert_allclose(found, [40.0] * 10, rtol=1e-4)


def test_fetching_goes_on_where_it_ended_and_begins_again_at_the_end(ready):
    send(ready, b"ARM:COUN 6;:FORM:TINF ON;:INIT;*WAI\n")
    parts = [numbers(ask(ready, "FETC:ARR? 3"))[1::2] for _ in range(3)]
    assert parts[0] != parts[1]
    assert parts[2] == parts[0]


def test_the_last_results_can_be_had_without_moving_on(ready):
    send(ready, b"ARM:COUN 6;:FORM:TINF ON;:INIT;*WAI\n")
    everything = ask(ready, "FETC:ARR? 6").split(",")
    assert ask(ready, "FETC:ARR? -2").split(",") == everything[-4:]


def test_more_than_there_will_be_is_an_error_without_an_answer(ready):
    send(ready, b"ARM:COUN 6;:INIT\n")
    assert ask(ready, "FETC:ARR? 7") is None
    assert errors(ready) == [-230]


def test_back_to_back_no_pulse_is_lost(ready):
    send(ready, b"CONF:ARR:FREQ:BTB 50,(@1);:FORM:TINF ON;:ACQ:APER 0.07;:INIT;*WAI\n")
    found = np.array(numbers(ask(ready, "FETC:ARR? 50"))).reshape(50, 2)
    values, stamps = found.T
    # each gate ends where the next one opens: periods are whole, and the stamps keep the pace
    counts = values[:-1] * np.diff(stamps)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    assert stamps[-1] - stamps[0] == pytest.approx(49 * 0.07, abs=1 / 40.0)


def test_otherwise_there_is_a_dead_time(ready):
    send(ready, b"CONF:ARR:FREQ 3,(@1);:FORM:TINF ON;:ACQ:APER 0.09;:INIT;*WAI\n")
    stamps = numbers(ask(ready, "FETC:ARR? 3"))[1::2]
    np.testing.assert_allclose(np.diff(stamps), 5 / 40.0, rtol=1e-3)  # four periods, and the next edge


def test_readings_can_be_fetched_while_it_measures(ready):
    send(ready, b"CONF:ARR:FREQ:BTB 100,(@1);:ACQ:APER 0.09;:INIT\n")
    ready.clock.sleep(0.5)
    assert 4 <= len(numbers(ask(ready, "FETC:ARR? MAX"))) <= 5
    assert ask(ready, "FETC:ARR? MAX", 0.0) is None  # handbook, 8-36: no new ones is "data corrupt or stale"
    assert errors(ready) == [-230]
    before = ready.clock.now()
    assert len(numbers(ask(ready, "FETC:ARR? 5"))) == 5
    assert ready.clock.now() - before == pytest.approx(0.45, abs=0.1)


def test_a_measurement_that_is_under_way_is_not_begun_again(ready):
    send(ready, b"ARM:COUN 5;:INIT;:INIT\n")
    assert errors(ready) == [-213]


def test_running_freely_it_always_has_something_new(ready):
    send(ready, b"INIT:CONT 1\n")
    ready.clock.sleep(1.0)
    first = numbers(ask(ready, "FETC:ARR? MAX"))
    ready.clock.sleep(0.5)
    second = numbers(ask(ready, "FETC:ARR? MAX"))
    assert len(first) >= 6
    assert 3 <= len(second) <= 5
    assert ask(ready, "INIT:CONT 0;CONT?") == "0"


def test_read_ends_the_free_run(ready):
    send(ready, b"INIT:CONT 1\n")
    ready.clock.sleep(0.3)
    assert float(ask(ready, "READ?")) == pytest.approx(40.0, rel=1e-4)
    assert ask(ready, "INIT:CONT?") == "0"


def test_read_array_brings_as_many_as_are_measured(ready):
    # QCoDeS's FCA3100
    assert len(numbers(ask(ready, "CALC:AVER:STAT 0;:ARM:COUN 7;:READ:ARR? 7"))) == 7
    assert ask(ready, "READ:ARR? 8") is None
    assert errors(ready) == [-221]


def test_arming_waits_for_the_bus(ready):
    send(ready, b"ARM:SOUR BUS;:INIT\n")
    ready.clock.sleep(5.0)
    assert ask(ready, "STAT:OPER:COND?") == "16"
    send(ready, b"*TRG\n")
    assert float(ask(ready, "FETC?")) == pytest.approx(40.0, rel=1e-4)


# --- formats (handbook, 8-36 and 8-39) ---


def sizes_of_blocks(data):
    """The bytes in each of several definite-length blocks between commas."""
    found = []
    while data not in {b"", b"\n"}:
        data = data.removeprefix(b",")
        digits = int(data[1:2])
        size = int(data[2 : 2 + digits])
        found.append(data[2 + digits : 2 + digits + size])
        data = data[2 + digits + size :]
    return found


@pytest.mark.parametrize(("border", "order"), [("NORM", ">"), ("SWAP", "<")])
def test_real_is_a_block_for_each_number(ready, border, order):
    send(ready, f"FORM REAL;:FORM:BORD {border};TINF 1;:ARM:COUN 3;:READ:ARR? 3\n".encode())
    found = [struct.unpack(order + "d", data)[0] for data in sizes_of_blocks(received(ready, 5.0))]
    assert found[::2] == pytest.approx([40.0] * 3, rel=1e-4)
    assert np.all(np.diff(found[1::2]) > 0.1)


@pytest.mark.parametrize(("border", "order"), [("NORM", ">"), ("SWAP", "<")])
def test_packed_is_one_block_with_whole_picoseconds(ready, border, order):
    send(ready, f"FORM PACK;:FORM:BORD {border};TINF 1;:ARM:COUN 3;:READ:ARR? 3\n".encode())
    (data,) = sizes_of_blocks(received(ready, 5.0))
    found = struct.unpack(order + "dq" * 3, data)
    assert found[::2] == pytest.approx([40.0] * 3, rel=1e-4)
    send(ready, b"FORM ASC;:FETC:ARR? 3\n")
    stamps = numbers(received(ready, 5.0).decode())[1::2]
    np.testing.assert_allclose(np.array(found[1::2]) * 1e-12, stamps, atol=0.6e-12)


def test_packed_of_unknown_size_has_six_digits_of_length(ready):
    send(ready, b"FORM PACK;:FORM:TINF 1;:ARM:COUN 1;:INIT;*WAI;:FETC:ARR? MAX\n")
    assert received(ready, 5.0).startswith(b"#6000016")


def test_the_greatest_fetch_is_ten_thousand_unless_set(ready):
    assert ask(ready, "FORM:SMAX?") == "10000"
    assert len(numbers(ask(ready, "FORM:SMAX 4;:ARM:COUN 9;:INIT;*WAI;:FETC:ARR? MAX"))) == 4


# --- statistics ---


def test_statistics_are_mean_deviation_extremes_and_range(ready):
    for message in ("CALC:AVER:STAT 1", "CALC:AVER:COUN 20", "INIT"):
        send(ready, message.encode() + b"\n")
    assert ask(ready, "*OPC?", 10.0) == "1"
    mean, deviation, least, greatest, spread = numbers(ask(ready, "CALC:AVER:ALL?"))
    assert mean == pytest.approx(40.0, rel=1e-4)
    assert least <= mean <= greatest
    assert spread == pytest.approx(greatest - least, abs=1e-9)
    assert 0 <= deviation <= spread
    assert float(ask(ready, "READ?", 10.0)) == pytest.approx(mean, rel=1e-9)


# --- no signal ---


def test_without_a_time_out_it_waits_until_it_is_cleared(ready):
    send(ready, b"INP:LEV 3\n")
    assert ask(ready, "READ?", 1e4) is None
    cable(ready).clear()
    assert ask(ready, "*OPC?") == "1"


@pytest.mark.parametrize(("native", "answer"), [(False, "+9.9100000000000E+37"), (True, "")])
def test_with_a_time_out_it_says_that_there_was_nothing(native, answer):
    device = counter(pulses(40.0), FIXED_LEVEL, "INP:LEV 3;:SYST:TOUT ON;:SYST:TOUT:TIME 2")
    device.native = native
    before = device.clock.now()
    assert ask(device, "READ?") == answer
    assert device.clock.now() - before == pytest.approx(2.0, abs=0.01)


def test_a_time_out_shorter_than_the_gate_cuts_it_off(ready):
    assert numbers(ask(ready, "SYST:TOUT 1;TOUT:TIME 0.05;:READ?")) == [9.91e37]


def test_the_automatic_level_fails_where_no_pulse_falls_into_its_window():
    # 100 Hz or more are needed (user's manual, chapter 3): ten milliseconds are a quarter of a period at 25 Hz
    right = 0
    for place in range(20):
        device = VirtualCNT91(VirtualClock(), signal=pulses(25.0, noise=0.01))
        device.clock.sleep(0.002 * place)
        answer = ask(device, "INP:COUP DC;:SYST:TOUT 1;TOUT:TIME 2;:ACQ:APER 0.5;:READ?")
        right += abs(float(answer) - 25.0) < 0.1
    assert 3 <= right <= 8


def test_the_automatic_level_is_right_at_200_hz():
    device = counter(pulses(200.0), "INP:COUP DC", "ACQ:APER 0.5")
    assert float(ask(device, "READ?")) == pytest.approx(200.0, rel=1e-3)


# --- bounds ---


def test_a_gate_of_a_thousand_seconds_needs_little_memory():
    def slope(start, step, n):  # no edge, no work
        return np.full(n, 0.0)

    device = counter(slope, FIXED_LEVEL, "ACQ:APER 1000;:SYST:TOUT 1;TOUT:TIME 1000")
    tracemalloc.start()
    assert ask(device, "READ?", 1e4) == "+9.9100000000000E+37"
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()


def test_what_is_out_of_reach_is_not_worked_out(ready):
    assert ask(ready, "ACQ:APER 1000;:ARM:COUN INF;:READ:ARR? 10000", 10.0) is None
    assert ask(ready, "*OPC?", 10.0) is None  # busy still
    cable(ready).clear()
    assert ask(ready, "*OPC?") == "1"


def test_readings_that_could_take_longer_than_visa_waits_are_refused_before_anything_is_sent():
    address = "GPIB0::10::INSTR"
    bench = VirtualBench({address: VirtualCNT91(VirtualClock(), signal=pulses(25.0))})
    sent = []
    transport = VisaTransport(address, library=library_for(bench), log=lambda *what: sent.append(what))
    driver = PendulumCNT91(transport)
    driver.prepare(gate_s=100.0, trigger_level_v=0.6)
    sent.clear()
    for readings in (driver.readings, driver.timed_readings):
        with pytest.raises(OutOfRange) as refused:
            readings(22_000)
        assert (refused.value.name, refused.value.value) == ("count", 22_000)
        assert "12895" in refused.value.allowed
    assert not sent
    assert driver.readings(3) == pytest.approx(25.0)
