"""The virtual CNT-91 against light whose frequency is known.

Sources of what is expected: Programmer's Handbook of the CNT-90 series, pages as cited; the messages that public
drivers send (PyMeasure's CNT91, QMI's Tektronix_FCA3000, QCoDeS's FCA3100).
"""

import struct

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.counter.pendulum_cnt91 import PendulumCNT91
from instruments.errors import OutOfRange
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.counter.pendulum_cnt91 import VirtualCNT91
from support.conversation import CLEAR
from support.exchanges import carry_out, exchanges, took
from support.light import pulses
from support.wire import ask, errors, numbers, received, send

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


LIGHT = pulses(40.0)


def of(*messages, signal=LIGHT):
    """What makes a counter that looks at this light, after these messages."""

    def make(clock):
        device = VirtualCNT91(clock, signal=signal)
        for message in messages:
            send(device, message.encode() + b"\n")
        return device

    return make


def gives(least, question, most=None):
    """A question is answered with this number of numbers."""
    return lambda device: least <= len(numbers(ask(device, question))) <= (most or least)


READY, CLOSE = (of(FIXED_LEVEL, "ACQ:APER 0.1"),), pytest.approx(40.0, rel=1e-4)
HIGH = "INP:LEV 3;:SYST:TOUT ON;:SYST:TOUT:TIME 2"
ROWS = {
    "its name": (READY, lambda device: ask(device, "*IDN?").split(",")[1].strip() == "CNT-91"),
    "an empty queue has no sign": (READY, ("SYST:ERR?", '0,"No error"')),
    **{
        f"a reading takes its gate of {gate} s": (
            *((of(FIXED_LEVEL, signal=pulses(25.0)),), f"ACQ:APER {gate}"),
            *(("READ?", pytest.approx(25.0, rel=1e-5 / gate)), took(gate, gate + 2 / 25.0 + 0.02)),
        )
        for gate in (0.01, 0.1, 1.0, 10.0)
    },
    "a number has fourteen digits": (READY, ("ACQ:APER 2e-8;APER?", "+2.0000000000000E-08")),  # PyMeasure's test
    "numbers for switches are understood as programs write them": (  # PyMeasure sends 1.0 and 0.0
        *(READY, ("FORM:TINF 1.0;TINF?;TINF 0.0;TINF?;TINF ON;TINF?", "1;0;1")),
    ),
    "setting a level turns the automatic one off": (  # handbook, 8-49
        *(READY, "INP:LEV:AUTO ON", ("INP:LEV:AUTO?;:INP:LEV 0.5;LEV:AUTO?", "1;0")),
    ),
    **{
        f"an array of {size} is measured and fetched as PyMeasure does": (  # without dead time
            *(READY, f":CONF:ARR:FREQ:BTB {size},(@1)", "INIT:CONT 0.0", ":ACQ:APER 0.1", ":INIT", ("*OPC?", "1")),
            *(took(0.97, 1.08), (":FETC:ARR? MAX", pytest.approx([40.0] * 10, rel=1e-4))),
        )
        for size in ("10", "(10)")
    },
    "more than there will be is an error without an answer": (
        *(READY, "ARM:COUN 6;:INIT", ("FETC:ARR? 7", None), [-230]),
    ),
    "readings can be fetched while it measures": (  # handbook, 8-36: no new ones is "data corrupt or stale"
        *(READY, "CONF:ARR:FREQ:BTB 100,(@1);:ACQ:APER 0.09;:INIT", 0.5, gives(4, "FETC:ARR? MAX", 5)),
        *(lambda device: ask(device, "FETC:ARR? MAX", 0.0) is None, [-230], gives(5, "FETC:ARR? 5"), took(0.85, 1.1)),
    ),
    "a measurement that is under way is not begun again": (READY, "ARM:COUN 5;:INIT;:INIT", [-213]),
    "running freely it always has something new": (
        *(READY, "INIT:CONT 1", 1.0, gives(6, "FETC:ARR? MAX", 10), 0.5, gives(3, "FETC:ARR? MAX", 5)),
        ("INIT:CONT 0;CONT?", "0"),
    ),
    "READ? ends the free run": (READY, "INIT:CONT 1", 0.3, ("READ?", CLOSE), ("INIT:CONT?", "0")),
    "READ:ARRay? brings all readings that are measured": (  # QCoDeS's FCA3100
        *(READY, gives(7, "CALC:AVER:STAT 0;:ARM:COUN 7;:READ:ARR? 7"), ("READ:ARR? 8", None), [-221]),
    ),
    "arming waits for the bus": (
        *(READY, "ARM:SOUR BUS;:INIT", 5.0, ("STAT:OPER:COND?", "16"), "*TRG", ("FETC?", CLOSE)),
    ),
    "packed of unknown size has six digits of length": (
        *(READY, "FORM PACK;:FORM:TINF 1;:ARM:COUN 1;:INIT;*WAI"),
        lambda device: ask(device, "FETC:ARR? MAX").startswith("#6000016"),
    ),
    "the greatest fetch is ten thousand unless set": (
        *(READY, ("FORM:SMAX?", "10000"), gives(4, "FORM:SMAX 4;:ARM:COUN 9;:INIT;*WAI;:FETC:ARR? MAX")),
    ),
    "without a time-out it waits until it is cleared": (*(READY, "INP:LEV 3", ("READ?", None), CLEAR, ("*OPC?", "1")),),
    "with a time-out it says that there was nothing": (
        *((of(FIXED_LEVEL, HIGH),), ("READ?", "+9.9100000000000E+37"), took(2.0, 2.03)),
    ),
    "a time-out shorter than the gate cuts it off": (READY, ("SYST:TOUT 1;TOUT:TIME 0.05;:READ?", 9.91e37)),
    "the automatic level is right at 200 Hz": (
        *((of(signal=pulses(200.0)),), "INP:COUP DC", "ACQ:APER 0.5", ("READ?", pytest.approx(200.0, rel=1e-3))),
    ),
    "what is out of reach is not worked out": (
        *(READY, ("ACQ:APER 1000;:ARM:COUN INF;:READ:ARR? 10000", None), ("*OPC?", None), CLEAR, ("*OPC?", "1")),
    ),
}


@exchanges(ROWS)
def test_an_exchange_goes_as_the_handbook_says(make, steps):
    carry_out(make, steps)


def test_fetching_goes_on_where_it_ended_and_begins_again_at_the_end(ready):
    send(ready, b"ARM:COUN 6;:FORM:TINF ON;:INIT;*WAI\n")
    parts = [numbers(ask(ready, "FETC:ARR? 3"))[1::2] for _ in range(3)]
    assert parts[0] != parts[1]
    assert parts[2] == parts[0]


def test_the_last_results_can_be_had_without_moving_on(ready):
    send(ready, b"ARM:COUN 6;:FORM:TINF ON;:INIT;*WAI\n")
    everything = ask(ready, "FETC:ARR? 6").split(",")
    assert ask(ready, "FETC:ARR? -2").split(",") == everything[-4:]


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


def test_the_automatic_level_fails_where_no_pulse_falls_into_its_window():
    # 100 Hz or more are needed (user's manual, chapter 3): ten milliseconds are a quarter of a period at 25 Hz
    right = 0
    for place in range(20):
        device = VirtualCNT91(VirtualClock(), signal=pulses(25.0, noise=0.01))
        device.clock.sleep(0.002 * place)
        answer = ask(device, "INP:COUP DC;:SYST:TOUT 1;TOUT:TIME 2;:ACQ:APER 0.5;:READ?")
        right += abs(float(answer) - 25.0) < 0.1
    assert 3 <= right <= 8


def test_readings_that_could_take_longer_than_visa_waits_are_refused_before_anything_is_sent():
    address = "GPIB0::10::INSTR"
    bench = VirtualBench({address: VirtualCNT91(VirtualClock(), signal=pulses(25.0))})
    sent = []
    transport = open_link(address, library=library_for(bench), log=lambda *what: sent.append(what))
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
