"""The counters' drivers: the manuals' bytes, and the same drivers on the virtual instruments.

Sources: Keysight 53220A/53230A Programmer's Reference; Programmer's Handbook of the CNT-90 series; public drivers of
both families.
"""

import numpy as np
import pytest
import pyvisa

from instruments.clock import VirtualClock
from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.drivers.counter.pendulum_cnt91 import PendulumCNT91
from instruments.errors import BadAnswer, CommandRefused, NoAnswer, OutOfRange
from instruments.links.visa import VisaTransport
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.counter.pendulum_cnt91 import VirtualCNT91
from support.conversation import CLEAR, NO_ERROR, SILENCE, accepted, conversation
from support.light import DARK, pulses


def preparation(gate, level, timeout, channel=1):
    return accepted(
        f"CONF:FREQ (@{channel})",
        "SENS:FREQ:GATE:SOUR TIME",
        f"SENS:FREQ:GATE:TIME {gate}",
        f"INP{channel}:COUP DC",
        f"INP{channel}:IMP 1000000.0",
        f"INP{channel}:PROB 1.0",
        f"INP{channel}:RANG 5.0",
        f"INP{channel}:LEV:AUTO OFF",
        f"INP{channel}:LEV1 {level}",
        f"INP{channel}:SLOP1 POS",
        f"SYST:TIM {timeout}",
        "FORM ASC,15",
    )


def test_the_counter_is_prepared_with_direct_coupling_and_a_fixed_level():
    with conversation(Keysight53230A, *preparation("1.0", "0.6", "3.0")) as counter:
        counter.prepare(gate_s=1.0, trigger_level_v=0.6)


def test_the_other_input_is_set_up_with_its_own_suffix():
    # Programmer's Reference, INPut[{1|2}]:..., CONFigure:FREQuency (@2)
    asked = [("INP2:LEV1?", "+6.00000000000000E-001")]
    with conversation(Keysight53230A, *preparation("1.0", "0.6", "3.0", channel=2), *asked) as counter:
        counter.prepare(gate_s=1.0, trigger_level_v=0.6, channel=2)
        assert counter.trigger_level == 0.6


@pytest.mark.parametrize("driver", [Keysight53230A, PendulumCNT91])
def test_an_input_that_counts_no_slow_pulses_is_refused(driver):
    with conversation(driver) as counter, pytest.raises(OutOfRange) as refused:
        counter.prepare(gate_s=1.0, trigger_level_v=0.6, channel=3)
    assert (refused.value.name, refused.value.value) == ("channel", 3)


@pytest.mark.parametrize(("gate", "patience"), [(0.1, 1.2), (1.0, 3.0), (10.0, 21.0)])
def test_the_answer_is_waited_for_beyond_the_time_at_which_the_counter_itself_gives_up(gate, patience):
    lines = [*preparation(f"{gate}", "0.6", f"{patience}"), NO_ERROR, ("READ?", "+9.91000000000000E+037")]
    with conversation(Keysight53230A, *lines) as counter:
        counter.prepare(gate_s=gate, trigger_level_v=0.6)
        counter.frequency()
    # on top of the transport's own timeout, that is for the way
    assert counter.transport.waited[-1] == pytest.approx(patience)


def test_the_longest_gate_meets_the_longest_time_out():
    with conversation(Keysight53230A, *preparation("1000.0", "0.6", "2000.0")) as counter:
        counter.prepare(gate_s=1000.0, trigger_level_v=0.6)


def test_a_gate_that_the_counter_does_not_have_is_refused_by_name():
    with (
        conversation(Keysight53230A, *accepted("CONF:FREQ (@1)", "SENS:FREQ:GATE:SOUR TIME")) as counter,
        pytest.raises(OutOfRange) as refused,
    ):
        counter.prepare(gate_s=0.0, trigger_level_v=0.6)
    assert (refused.value.name, refused.value.value) == ("gate", 0.0)


def test_a_reading_is_a_number_in_hertz():
    with conversation(Keysight53230A, NO_ERROR, ("READ?", "+2.345678900000000E+01")) as counter:
        assert counter.frequency() == 23.4567890


def test_the_counters_own_time_out_is_no_reading():
    with conversation(Keysight53230A, NO_ERROR, ("READ?", "+9.91000000000000E+037")) as counter:
        assert counter.frequency() is None


def test_a_counter_that_waits_for_ever_is_cleared_and_aborted_and_gives_no_reading():
    lines = [NO_ERROR, ("READ?", SILENCE), (CLEAR, None), ("*CLS", None), ("ABOR", None), NO_ERROR]
    with conversation(Keysight53230A, *lines) as counter:
        assert counter.frequency() is None


def test_a_link_that_is_dead_is_not_taken_for_a_missing_signal():
    lines = [NO_ERROR, ("READ?", SILENCE), (CLEAR, None), ("*CLS", None), ("ABOR", None), ("SYST:ERR?", SILENCE)]
    with conversation(Keysight53230A, *lines) as counter, pytest.raises(NoAnswer) as silence:
        counter.frequency()
    assert silence.value.question == "READ?"


@pytest.mark.parametrize("garbage", ["", "DC", "+2.3E+01,+2.4E+01", '-230,"Data corrupt or stale"'])
def test_garbage_is_no_reading_but_an_error(garbage):
    lines = [NO_ERROR, ("READ?", garbage), (CLEAR, None)]  # it may have been the answer to something else
    with conversation(Keysight53230A, *lines) as counter, pytest.raises(BadAnswer) as bad:
        counter.frequency()
    assert (bad.value.question, bad.value.answer) == ("READ?", garbage)


def test_an_error_that_waits_is_raised_before_a_number_is_believed():
    waiting = [("SYST:ERR?", '-222,"Data out of range"'), NO_ERROR]
    with conversation(Keysight53230A, *waiting) as counter, pytest.raises(CommandRefused, match=r"READ\?.*-222"):
        counter.frequency()


# --- series of readings ---


def test_a_series_is_fetched_as_it_comes_and_the_counter_is_left_as_it_was():
    lines = [
        *accepted("SAMP:COUN 1002", "INIT"),
        NO_ERROR,
        ("DATA:REM? 1000,WAIT", ",".join(["+2.50000000000000E+001"] * 1000)),
        NO_ERROR,
        ("DATA:REM? 2,WAIT", "+2.60000000000000E+001,+9.91000000000000E+037"),
        *accepted("SAMP:COUN 1"),
    ]
    with conversation(Keysight53230A, *lines) as counter:
        found = counter.readings(1002)
    np.testing.assert_array_equal(found, [25.0] * 1000 + [26.0, np.nan])
    assert counter.transport.waited[-2:] == [6.0, 0.0]  # two readings, then the queue


def test_a_series_that_stops_is_filled_up_with_missing_readings():
    lines = [
        *accepted("SAMP:COUN 3", "INIT"),
        NO_ERROR,
        ("DATA:REM? 3,WAIT", SILENCE),
        (CLEAR, None),
        ("*CLS", None),
        *accepted("ABOR", "SAMP:COUN 1"),
    ]
    with conversation(Keysight53230A, *lines) as counter:
        assert np.isnan(counter.readings(3)).tolist() == [True] * 3


def test_a_series_of_the_wrong_length_is_none():
    lines = [
        *accepted("SAMP:COUN 3", "INIT"),
        NO_ERROR,
        ("DATA:REM? 3,WAIT", "+2.5E+01,+2.5E+01"),
        (CLEAR, None),
        ("*CLS", None),
        *accepted("ABOR", "SAMP:COUN 1"),
    ]
    with conversation(Keysight53230A, *lines) as counter, pytest.raises(BadAnswer) as bad:
        counter.readings(3)
    assert bad.value.answer == "+2.5E+01,+2.5E+01"


@pytest.mark.parametrize("driver", [Keysight53230A, PendulumCNT91])
@pytest.mark.parametrize("count", [0, -1, 1_000_001])
def test_a_series_longer_than_the_memory_is_refused(driver, count):
    with conversation(driver) as counter, pytest.raises(OutOfRange, match="count"):
        counter.readings(count)


# --- CNT-91 ---

NONE_WRONG = ("SYST:ERR?", '0,"No error"')


@pytest.mark.parametrize("channel", [1, 2])
def test_the_cnt91_is_prepared_with_direct_coupling_a_fixed_level_and_a_time_out(channel):
    lines = accepted(
        f"CONF:FREQ (@{channel})",
        "INIT:CONT OFF",
        "CALC:AVER:STAT OFF",
        "FORM ASC",
        "FORM:TINF OFF",
        "ACQ:APER 10.0",
        f"INP{channel}:COUP DC",
        f"INP{channel}:IMP 1000000.0",
        f"INP{channel}:ATT 1.0",
        f"INP{channel}:FILT OFF",
        f"INP{channel}:LEV:AUTO OFF",
        f"INP{channel}:LEV 0.6",
        f"INP{channel}:SLOP POS",
        "ARM:SOUR IMM",
        "TRIG:COUN 1",
        "ARM:COUN 1",
        "SYST:TOUT:TIME 21.0",
        "SYST:TOUT ON",
    )
    with conversation(PendulumCNT91, *lines, NONE_WRONG, ("READ?", "+2.5000000000000E+01")) as counter:
        counter.prepare(gate_s=10.0, trigger_level_v=0.6, channel=channel)
        assert counter.frequency() == 25.0
    assert counter.transport.waited[-1] == 21.0


@pytest.mark.parametrize("nothing", ["+9.9100000000000E+37", ""])
def test_the_cnt91_has_two_ways_to_say_that_there_was_nothing(nothing):
    # compatible and native mode: handbook, 8-36
    with conversation(PendulumCNT91, NONE_WRONG, ("READ?", nothing)) as counter:
        assert counter.frequency() is None


def test_the_cnt91_gives_time_stamps_beside_the_readings():
    lines = [
        *accepted("FORM:TINF ON", "ARM:COUN 2", "INIT"),
        NONE_WRONG,
        ("*OPC?", "1"),
        NONE_WRONG,
        ("FETC:ARR? 2", "+2.5E+01,+7.0E+02,+9.91E+37,+7.1E+02"),
        *accepted("ARM:COUN 1", "FORM:TINF OFF"),
    ]
    with conversation(PendulumCNT91, *lines) as counter:
        np.testing.assert_array_equal(counter.timed_readings(2), [[25.0, 700.0], [np.nan, 710.0]])


def test_time_stamps_of_more_readings_than_an_answer_holds_come_in_parts():
    lines = [
        *accepted("FORM:TINF ON", "ARM:COUN 1002", "INIT"),
        NONE_WRONG,
        ("*OPC?", "1"),
        NONE_WRONG,
        ("FETC:ARR? 1000", ",".join(["+2.5E+01,+7.0E+02"] * 1000)),
        NONE_WRONG,
        ("FETC:ARR? 2", "+2.6E+01,+7.1E+02,+2.7E+01,+7.2E+02"),
        *accepted("ARM:COUN 1", "FORM:TINF OFF"),
    ]
    with conversation(PendulumCNT91, *lines) as counter:
        found = counter.timed_readings(1002)
    np.testing.assert_array_equal(found[-3:], [[25.0, 700.0], [26.0, 710.0], [27.0, 720.0]])


@pytest.mark.parametrize(
    "identity", ["PENDULUM, CNT-91, 123456, V1.28 7 Jan 2012", "TEKTRONIX,FCA3000,579249,V1.32 26 May 2022 09:54"]
)
def test_the_cnt91_is_known_under_the_names_of_both_makers(identity):
    with conversation(PendulumCNT91, ("*IDN?", identity)) as counter:
        assert counter.identity() == identity


# --- the drivers on the virtual instruments ---

ADDRESS = "TCPIP0::counter::inst0::INSTR"
PAIRS = [(Keysight53230A, Virtual53230A), (PendulumCNT91, VirtualCNT91)]


def light(start, step, n):
    """25 Hz, pulses of 3 % of a turn between 0.1 V and 1.2 V; from 1000 s on it is dark."""
    return np.where(start + step * np.arange(n) < 1000.0, pulses(25.0)(start, step, n), DARK)


def faster_light(start, step, n):
    """The same at 40 Hz."""
    return light(1.6 * start, 1.6 * step, n)


@pytest.fixture(params=PAIRS, ids=["53230A", "CNT-91"])
def bench(request):
    """A driver, and the clock of its virtual instrument."""
    driver, virtual = request.param
    clock = VirtualClock()
    library = library_for(VirtualBench({ADDRESS: virtual(clock, signal=light, second=faster_light)}))
    counter = driver(VisaTransport(ADDRESS, library=library))
    yield counter, clock
    counter.close()
    pyvisa.ResourceManager(library).close()


@pytest.mark.parametrize("gate", [0.1, 1.0, 10.0, 100.0])
def test_a_gate_longer_than_the_transports_time_out_is_waited_for(bench, gate):
    counter, clock = bench
    assert counter.transport.timeout == 2.0
    counter.identity()
    counter.prepare(gate_s=gate, trigger_level_v=0.6)
    before = clock.now()
    # at each end of the gate an edge may be misplaced by interpolation, by microseconds
    assert counter.frequency() == pytest.approx(25.0, rel=1e-5 / gate)
    assert gate <= clock.now() - before <= gate + 0.2


def test_each_input_counts_its_own_signal(bench):
    counter, _ = bench
    for channel, hertz in ((2, 40.0), (1, 25.0), (2, 40.0)):
        counter.prepare(gate_s=0.1, trigger_level_v=0.6, channel=channel)
        assert counter.frequency() == pytest.approx(hertz, rel=1e-4)
        np.testing.assert_allclose(counter.readings(3), hertz, rtol=1e-4)
        assert counter.settings()["trigger_level_v"] == 0.6
        assert not counter.changed_settings(counter.settings())


def test_a_dark_room_is_no_reading_and_no_error(bench):
    counter, clock = bench
    counter.prepare(gate_s=1.0, trigger_level_v=0.6)
    clock.sleep(1000.0)
    assert counter.frequency() is None
    assert counter.frequency() is None


def test_a_series_into_the_dark_ends_with_missing_readings(bench):
    counter, clock = bench
    counter.prepare(gate_s=0.1, trigger_level_v=0.6)
    clock.sleep(999.0 - clock.now())
    found = counter.readings(20)
    missing = np.isnan(found)
    assert 5 <= np.argmax(missing) <= 9
    assert missing[np.argmax(missing) :].all()


#: What becomes of joined answers in counters that IEEE 488.2, 8.4.1, does not describe; None: no answer at all.
JOINS = {
    "one answer a line": lambda text: text.replace(";", "\n"),
    "the last answer only": lambda text: text.rpartition(";")[2],
    "a blank behind the semicolon": lambda text: text.replace(";", "; "),
    "no answer": lambda text: None if ";" in text else text,
}


@pytest.mark.parametrize("address", [ADDRESS, "TCPIP0::counter::5025::SOCKET", "ASRLcounter::INSTR"])
@pytest.mark.parametrize("join", JOINS)
@pytest.mark.parametrize(("driver", "virtual"), PAIRS, ids=["53230A", "CNT-91"])
def test_a_counter_that_joins_answers_in_another_way_counts_as_well(driver, virtual, join, address):
    class Other(virtual):
        def _answer(self, text):
            return super()._answer(text if text is None else JOINS[join](text))

    def record(where, direction, data):
        if direction == ">" and b";:" in data:
            joined.append(data)

    joined, found = [], []
    for model in (virtual, Other):
        library = library_for(VirtualBench({address: model(VirtualClock(), signal=light)}))
        counter = driver(VisaTransport(address, library=library, log=record))
        counter.prepare(gate_s=0.1, trigger_level_v=0.6)
        found.append(counter.settings())
        assert not counter.changed_settings(counter.settings())
        assert counter.frequency() == pytest.approx(25.0, rel=1e-4)
        counter.raise_errors("a test")
        counter.close()
    assert found[0] == found[1]
    assert len(joined) == (4 if join == "a blank behind the semicolon" else 3)  # the other one is asked once


def interrupted(clock, monkeypatch, act, after):
    """Ctrl-C in the middle of a wait, after so many others."""
    sleep, waits = clock.sleep, iter(range(after))

    def ctrl_c(duration):
        if next(waits, None) is not None:
            return sleep(duration)
        monkeypatch.undo()
        raise KeyboardInterrupt

    monkeypatch.setattr(clock, "sleep", ctrl_c)
    with pytest.raises(KeyboardInterrupt):
        act()


@pytest.mark.parametrize("after", range(5))
@pytest.mark.parametrize("stamps", [False, True])
def test_after_an_interrupted_series_the_next_reading_works(bench, monkeypatch, stamps, after):
    counter, clock = bench
    counter.prepare(gate_s=0.1, trigger_level_v=0.6)
    take = getattr(counter, "timed_readings", counter.readings) if stamps else counter.readings
    interrupted(clock, monkeypatch, lambda: take(50), after)
    for _ in range(2):
        assert counter.frequency() == pytest.approx(25.0, rel=1e-4)
    np.testing.assert_allclose(counter.readings(3), 25.0, rtol=1e-4)


def test_a_series_whose_end_could_not_be_sent_is_ended_before_the_next_reading():
    dead = [NO_ERROR, ("DATA:REM? 3,WAIT", SILENCE), (CLEAR, None), ("*CLS", None), ("ABOR", None)]
    dead += [("SYST:ERR?", SILENCE), (CLEAR, None), ("*CLS", None), ("ABOR", None), ("SYST:ERR?", SILENCE)]
    back = [(CLEAR, None), ("*CLS", None), *accepted("ABOR", "SAMP:COUN 1")]
    reading = [NO_ERROR, ("READ?", "+2.50000000000000E+001")]
    lines = [*accepted("SAMP:COUN 3", "INIT"), *dead, *back, *reading, *reading]
    with conversation(Keysight53230A, *lines) as counter:
        with pytest.raises(NoAnswer) as silence:
            counter.readings(3)
        assert silence.value.question == "DATA:REM? 3,WAIT"
        assert [counter.frequency(), counter.frequency()] == [25.0, 25.0]


def test_time_stamps_are_the_gates_openings():
    clock = VirtualClock()
    counter = PendulumCNT91(
        VisaTransport(ADDRESS, library=library_for(VirtualBench({ADDRESS: VirtualCNT91(clock, signal=light)})))
    )
    counter.prepare(gate_s=0.09, trigger_level_v=0.6)
    values, times = counter.timed_readings(5).T
    np.testing.assert_allclose(values, 25.0, rtol=1e-4)
    # three periods of 40 ms hold the gate, and the next edge opens the next one
    np.testing.assert_allclose(np.diff(times), 0.16, atol=1e-5)
    assert counter.frequency() == pytest.approx(25.0, rel=1e-4)
    counter.close()
