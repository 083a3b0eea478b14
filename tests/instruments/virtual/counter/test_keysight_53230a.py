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
from support.conversation import CLEAR
from support.exchanges import carry_out, exchanges, took
from support.light import DUTY, pulses
from support.wire import ask, cable, numbers, received, send

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


# --- long gates ---


def test_a_gate_of_many_minutes_needs_little_memory():
    device = counter(pulses(40.0), FIXED_LEVEL, "SENS:FREQ:GATE:TIME 500", "SYST:TIM 1000")  # 80 MB of samples
    tracemalloc.start()
    got, took = reading(device, timeout=3000.0)
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()
    assert got == pytest.approx(40.0, rel=1e-8)
    assert took == pytest.approx(500.0, abs=0.1)


def test_it_looks_no_further_than_the_edge_that_ends_the_gate():
    looked = []

    def light(start, step, n):
        looked.append(start + step * n)
        return pulses(40.0)(start, step, n)

    reading(counter(light, FIXED_LEVEL, "SENS:FREQ:GATE:TIME 1", "SYST:TIM 2000"))
    assert max(looked) < 1.3


# --- an exchange a row ---


LIGHT = pulses(40.0)


def of(*messages, **more):
    """What makes a counter that looks at light of 40 Hz, after these messages."""
    return lambda clock: configured(Virtual53230A(clock, signal=LIGHT, **more), *messages)


def configured(device, *messages):
    for message in messages:
        send(device, message.encode() + b"\n")
    return device


def gives(count, question):
    """A question is answered with this number of readings, in a block perhaps."""
    return lambda device: len(numbers(ask(device, question).rpartition("#")[2][3 * ("#" in question) :])) == count


def holds(bit, *, on=True):
    """The status byte has a bit, or not."""
    return lambda device: bool(cable(device).status_byte() & bit) is on


def trigger(device):
    """The interface's own trigger message."""
    cable(device).trigger()
    return True


NONE, CLOSE = pytest.approx(NO_READING), pytest.approx(40.0, rel=1e-4)
FIXED = (of(FIXED_LEVEL),)
PLAIN = (of(),)
FIVE = (of(FIXED_LEVEL, "SAMP:COUN 5", "SYST:TIM 2"),)
LACKING = (lambda _: hostile.instrument("53210A"),)
#: Function → its value for pulses of 40 Hz.
FUNCTIONS = {"FREQ": 40.0, "PER": 0.025, "SPER": 0.025}

ONE_READING = {
    **{
        f"edges of the slope {slope}": (
            *(FIXED, f"INP1:SLOP1 {slope};:SYST:TIM 2"),
            ("READ?", pytest.approx(40.0, rel=2 * interpolation_error(40.0) / 0.1)),
        )
        for slope in ("POS", "NEG")
    },
    "CONFigure restores the gate": (FIXED, "SENS:FREQ:GATE:TIME 1", ("CONF:FREQ (@1);:SENS:FREQ:GATE:TIME?", 0.1)),
    "two readings in one message take two gates": (
        *(FIXED, "SENS:FREQ:GATE:TIME 1;:SYST:TIM 3", ("READ?;READ?", pytest.approx([40.0] * 2, rel=1e-4))),
        took(2.0, 2.2),
    ),
    # dark 0.1 V and a mean of 1.1 V·0.03·1.064 on it: without them the pulses reach 1.065 V
    **{
        f"a level of 1.1 V with the coupling {coupling}": (
            *(PLAIN, f"INP1:COUP {coupling};LEV:AUTO OFF;:INP1:LEV1 1.1;:SYST:TIM 2", ("READ?", answer)),
        )
        for coupling, answer in (("DC", CLOSE), ("AC", NONE))
    },
    "the state after power-on is the one that fails": (PLAIN, ("INP:COUP?;LEV:AUTO?", "AC;1")),
    "a level above the pulses ends after the counter's time-out": (
        *(PLAIN, "INP1:COUP DC;LEV:AUTO OFF;:INP1:LEV1 1.25;:SYST:TIM 7", ("READ?", NONE), took(7.0, 7.01)),
    ),
    **{
        f"a time-out of {timeout} s with a gate of 1 s ends after {ends} s": (  # below the gate it is twice the gate
            *(FIXED, f"INP1:LEV1 2;:SENS:FREQ:GATE:TIME 1;:SYST:TIM {timeout}", ("READ?", NONE)),
            took(ends, ends + 0.02),
        )
        for timeout, ends in ((0.5, 2.0), (1.0, 1.0), (5.0, 5.0))
    },
    **{
        f"in {timeout} s there are whole periods of 1 s: {seen}": (  # what just holds the gate is too short
            *(FIXED, f"SENS:FREQ:GATE:TIME 1;:SYST:TIM {timeout}", ("READ?", CLOSE if seen else NONE)),
        )
        for timeout, seen in ((0.5, True), (1.0, False), (1.1, True))
    },
    "without a time-out it waits until it is aborted": (
        *(FIXED, "INP1:LEV1 2;:SYST:TIM INF", ("READ?", None), ("*OPC?", None), "ABOR", ("*OPC?", "1")),
    ),
    "what follows an abort in the same bytes is not lost": (FIXED, "ABOR\nINP1:LEV1 0.5", ("INP1:LEV1?", 0.5)),
    "what is out of reach is not worked out": (
        *(FIXED, "SENS:FREQ:GATE:TIME 1000;:SAMP:COUN MAX;:TRIG:COUN MAX", ("READ?", None), CLEAR, ("*OPC?", "1")),
    ),
}
MEMORY = {
    "readings are samples times triggers": (
        *(FIVE, ("SAMP:COUN?", "+5"), gives(5, "READ?"), "TRIG:COUN 3", gives(15, "READ?")),
    ),
    "FETCh waits for what was begun, and leaves it in the memory": (
        *(FIVE, gives(5, "INIT;:FETC?"), took(0.5, 0.8), gives(5, "FETC?")),
    ),
    "nothing measured is nothing to fetch": (PLAIN, ("FETC?", None), ("R?", None), [-230, -230]),
    "the memory fills while no program asks": (
        *(FIVE, "INIT", 0.3, ("DATA:POIN?", "+2"), ("STAT:OPER:COND?", "+16"), 1.0),
        ("DATA:POIN?;:STAT:OPER:COND?", "+5;+0"),
    ),
    "R? takes what is there, as a block": (  # joewhalen/keysight_53230A polls so
        *(FIVE, "INIT", ("R?", "#10"), 0.3, lambda device: ask(device, "R?").startswith("#245+"), 1.0),
        *(lambda device: len(numbers(ask(device, "R? 2")[4:])) == 2, ("DATA:POIN?", "+1")),
    ),
    "DATA:REMove takes a number of readings, and waits with the word WAIT": (  # opronningen/53230A-Toolkit reads so
        *(FIVE, "INIT", ("DATA:REM? 2", None), [-230], gives(2, "DATA:REM? 2,WAIT"), gives(3, "DATA:REM? 3, WAIT")),
        *(("DATA:REM? 1,WAIT", None), [-230]),
    ),
    "two readings are waited for as long as two gates, their edges and a message": (
        *(FIVE, "INIT", gives(2, "DATA:REM? 2,WAIT"), took(0.2, 0.3)),
    ),
    "gap-free readings follow each other": (  # four periods hold the gate
        *(FIVE, "FREQ:MODE CONT;:FREQ:GATE:TIME 0.09;:SAMP:COUN 20", gives(20, "READ?"), took(1.96, 2.07)),
    ),
    "a second INIT is ignored while it measures": (FIVE, "INIT;:INIT", [-213]),
    "an abort ends a measurement, and keeps what it brought": (
        *(FIVE, "INIT", 0.3, "ABOR", gives(2, "FETC?"), ("*OPC?;:STAT:OPER:COND?", "1;+0")),
    ),
    "operation complete is noted when the last reading is there": (
        *(FIVE, "*CLS;*ESE 1;*SRE 32;:INIT;*OPC", holds(64, on=False), 1.0, holds(64)),
    ),
    "on the bus it waits for a trigger": (
        *(FIVE, "TRIG:SOUR BUS;COUN 2;:INIT", 3.0, ("STAT:OPER:COND?;:DATA:POIN?", "+32;+0"), "*TRG", 1.0),
        *(("DATA:POIN?", "+5"), trigger, gives(10, "FETC?")),
    ),
    "a trigger that no run waits for is ignored": (  # SCPI-1999, volume 2, 21.8.10
        *(FIVE, "*TRG", "TRIG:SOUR IMM;:INIT", trigger, [-211, -211]),
    ),
    "a trigger delay passes before the gate opens": (
        *(FIVE, "TRIG:DEL 2;:SAMP:COUN 1", ("READ?", CLOSE), took(2.04, 2.17)),
    ),
    "statistics that are off are no numbers": (FIVE, gives(5, "READ?"), ("CALC:AVER:ALL?", [NO_READING] * 4)),
    "the time-out outlives a reset": (  # programmer's reference, SYSTem:TIMeout: it is in non-volatile memory
        *(PLAIN, "SYST:TIM 7", "SENS:FREQ:GATE:TIME 5", "*RST", ("SYST:TIM?;:SENS:FREQ:GATE:TIME?", [7, 0.1])),
    ),
}
CONFIGURED = {
    **{
        f"{function} of pulses, slope {slope}": (  # half way up a pulse has its width; edges are misplaced by 3 µs
            *(PLAIN, f"INP:COUP DC;SLOP {slope};:SYST:TIM 2"),
            (f"CONF:{function} (@1);:INP:LEV 0.65;:READ?", pytest.approx(expected, rel=1e-2)),
        )
        for function, expected in FUNCTIONS.items()
        for slope in ("POS", "NEG")
    },
    **{
        f"an interval from {first} to {second}": (
            (of(second=lambda start, step, n: pulses(40.0)(start - 0.004, step, n)),),
            "INP1:COUP DC;:INP2:COUP DC;:SYST:TIM 2",
            (
                f"CONF:TINT (@{first}),(@{second});:INP1:LEV 0.65;:INP2:LEV 0.65;:READ?",
                pytest.approx(expected, rel=1e-2),
            ),
        )
        for first, second, expected in ((1, 2, 0.004), (2, 1, 0.021))
    },
    "the second input is counted when it is named": (
        *((of(second=pulses(30.0)),), "CONF:FREQ (@2);:INP2:COUP DC;LEV 0.65"),
        *(("READ?", pytest.approx(30.0, rel=1e-4)), ("CONF?", '"FREQ (@2)"')),
    ),
    **{
        f"{bad} changes nothing": (PLAIN, "SAMP:COUN 3", bad, [number], ("SAMP:COUN?", "+3"))
        for bad, number in {
            "CONF:FREQ (@3)": -224, "CONF:FREQ 1,2,3": -108, "CONF:FREQ (@1),(@2)": -108, "CONF:FREQ ten": -104,
        }.items()
    },
    # user's guide, Measuring Low Frequency Signals
    "CONFigure turns the automatic level on, and a level turns it off": (
        *(PLAIN, "CONF:FREQ 10,(@1)", ("INP:LEV:AUTO?;:INP:LEV 0.5;LEV:AUTO?", "1;0")),
    ),
    "a probe's factor is in the levels": (PLAIN, "INP:COUP DC;PROB 10;:SYST:TIM 2;:INP:LEV 6.5", ("READ?", CLOSE)),
    "a function is chosen by name": (
        *(FIXED, ('FUNC "PER 1";FUNC?', '"PER"'), ("READ?", pytest.approx(0.025, rel=1e-4)), 'FUNC "VOLT"', [-224]),
    ),
    **{
        f"{bad} is out of range": (PLAIN, bad, [-222])
        for bad in ("SYST:TIM 2001", "SYST:TIM 0.001", "SAMP:COUN 0", "INP:LEV 6", "TRIG:COUN 1e7")
    },
    # a member of the family with one input and two functions
    **{
        f"a 53210A does not know {message}": (LACKING, message, [number])
        for message, number in {
            "CONF:TINT (@1),(@2)": -113, "MEAS:SPER?": -113, "INP2:COUP DC": -113,
            'FUNC "TINT 1,2"': -224, 'FUNC "FREQ 2"': -224, "CONF:FREQ (@2)": -224,
        }.items()
    },
}  # fmt: skip


@exchanges(ONE_READING | MEMORY | CONFIGURED)
def test_an_exchange_goes_as_the_manual_says(make, steps):
    carry_out(make, steps)


# --- formats, levels, statistics ---


@pytest.fixture
def five():
    """A counter that takes five readings of 0.1 s."""
    return counter(pulses(40.0), FIXED_LEVEL, "SAMP:COUN 5", "SYST:TIM 2")


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


def test_a_53210a_counts_at_its_input_and_its_driver_refuses_another():
    address = "TCPIP0::box::inst0::INSTR"
    library = library_for(VirtualBench({address: hostile.instrument("53210A")}))
    with Keysight53230A.connect(address, library=library) as driver:
        with pytest.raises(OutOfRange) as refused:
            driver.prepare(gate_s=0.5, trigger_level_v=0.6, channel=2)
        assert (refused.value.value, refused.value.allowed) == (2, "1")
        driver.prepare(gate_s=0.5, trigger_level_v=0.6)
        assert driver.frequency() == pytest.approx(30.0, rel=1e-3)  # of the light in that room
