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
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.counter.pendulum_cnt91 import VirtualCNT91
from support.conversation import CLEAR, NO_ERROR, SILENCE, accepted, conversation
from support.light import DARK, pulses
from support.talks import Raises, connected, talk, talks

ENDED = [(CLEAR, None), ("*CLS", None)]
NONE_WRONG = ("SYST:ERR?", '0,"No error"')


def preparation(gate, level, timeout, channel=1):
    return accepted(
        *(
            f"CONF:FREQ (@{channel})",
            "SENS:FREQ:GATE:SOUR TIME",
            f"SENS:FREQ:GATE:TIME {gate}",
            f"INP{channel}:COUP DC",
        ),
        *(f"INP{channel}:IMP 1000000.0", f"INP{channel}:PROB 1.0", f"INP{channel}:RANG 5.0"),
        *(f"INP{channel}:LEV:AUTO OFF", f"INP{channel}:LEV1 {level}", f"INP{channel}:SLOP1 POS"),
        *(f"SYST:TIM {timeout}", "FORM ASC,15"),
    )


def preparation_of_cnt91(channel):
    return accepted(
        *(f"CONF:FREQ (@{channel})", "INIT:CONT OFF", "CALC:AVER:STAT OFF", "FORM ASC", "FORM:TINF OFF"),
        *("ACQ:APER 10.0", f"INP{channel}:COUP DC", f"INP{channel}:IMP 1000000.0", f"INP{channel}:ATT 1.0"),
        *(f"INP{channel}:FILT OFF", f"INP{channel}:LEV:AUTO OFF", f"INP{channel}:LEV 0.6", f"INP{channel}:SLOP POS"),
        *("ARM:SOUR IMM", "TRIG:COUN 1", "ARM:COUN 1", "SYST:TOUT:TIME 21.0", "SYST:TOUT ON"),
    )


def prepare(counter, gate_s=1.0, **options):
    counter.prepare(gate_s=gate_s, trigger_level_v=0.6, **options)


def frequency(counter):
    return counter.frequency()


def reading(answer, no_error=NO_ERROR):
    return [no_error, ("READ?", answer)]


def patience(gate_s, channel=1):
    """How long the answer is waited for, on top of the transport's own timeout, that is for the way."""

    def act(counter):
        prepare(counter, gate_s, channel=channel)
        return counter.frequency(), counter.transport.waited[-1]

    return act


def series(count):
    """A series of readings, its numbers or nan."""
    return lambda counter: counter.readings(count).tolist()


def stamped(count):
    return lambda counter: counter.timed_readings(count)[-3:].ravel().tolist()


def numbers(*wanted):
    return pytest.approx(list(wanted), rel=0, abs=0, nan_ok=True)


BEGUN, OVER = accepted("SAMP:COUN 3", "INIT"), accepted("ABOR", "SAMP:COUN 1")
READINGS = {
    "direct coupling and a fixed level": (Keysight53230A, preparation("1.0", "0.6", "3.0"), prepare, None),
    "the other input is set up with its own suffix": (  # INPut[{1|2}]:..., CONFigure:FREQuency (@2)
        *(Keysight53230A, [*preparation("1.0", "0.6", "3.0", 2), ("INP2:LEV1?", "+6.00000000000000E-001")]),
        *(lambda it: prepare(it, channel=2) or it.trigger_level, 0.6),
    ),
    **{
        f"the answer is waited for beyond the time at which the counter itself gives up, {gate} s": (
            Keysight53230A,
            [*preparation(f"{gate}", "0.6", f"{waited}"), *reading("+9.91000000000000E+037")],
            *(patience(gate), (None, pytest.approx(waited))),
        )
        for gate, waited in ((0.1, 1.2), (1.0, 3.0), (10.0, 21.0))
    },
    "the longest gate meets the longest time-out": (
        *(Keysight53230A, preparation("1000.0", "0.6", "2000.0"), lambda it: prepare(it, 1000.0), None),
    ),
    "a gate that the counter does not have is refused by name": (
        *(Keysight53230A, accepted("CONF:FREQ (@1)", "SENS:FREQ:GATE:SOUR TIME"), lambda it: prepare(it, 0.0)),
        Raises(OutOfRange, has={"name": "gate", "value": 0.0}),
    ),
    "a reading is a number in hertz": (Keysight53230A, reading("+2.345678900000000E+01"), frequency, 23.456789),
    "the counter's own time-out is no reading": (Keysight53230A, reading("+9.91000000000000E+037"), frequency, None),
    "a counter that waits for ever is cleared and aborted and gives no reading": (
        *(Keysight53230A, [*reading(SILENCE), *ENDED, *accepted("ABOR")], frequency, None),
    ),
    "a link that is dead is not taken for a missing signal": (
        *(Keysight53230A, [*reading(SILENCE), *ENDED, ("ABOR", None), ("SYST:ERR?", SILENCE)], frequency),
        Raises(NoAnswer, has={"question": "READ?"}),
    ),
    **{
        f"{garbage!r} is no reading but an error": (  # it may have been the answer to something else
            *(Keysight53230A, [*reading(garbage), (CLEAR, None)], frequency),
            Raises(BadAnswer, has={"question": "READ?", "answer": garbage}),
        )
        for garbage in ("", "DC", "+2.3E+01,+2.4E+01", '-230,"Data corrupt or stale"')
    },
    "an error that waits is raised before a number is believed": (
        *(Keysight53230A, [("SYST:ERR?", '-222,"Data out of range"'), NO_ERROR], frequency),
        Raises(CommandRefused, r"READ\?.*-222"),
    ),
    "a series is fetched as it comes, and the counter is left as it was": (
        Keysight53230A,
        [
            *(*accepted("SAMP:COUN 1002", "INIT"), NO_ERROR),
            *(("DATA:REM? 1000,WAIT", ",".join(["+2.50000000000000E+001"] * 1000)), NO_ERROR),
            *(("DATA:REM? 2,WAIT", "+2.60000000000000E+001,+9.91000000000000E+037"), *accepted("SAMP:COUN 1")),
        ],
        lambda it: [*it.readings(1002), *it.transport.waited[-2:]],  # two readings, then the queue
        numbers(*[25.0] * 1000, 26.0, np.nan, 6.0, 0.0),
    ),
    "a series that stops is filled up with missing readings": (
        *(Keysight53230A, [*BEGUN, NO_ERROR, ("DATA:REM? 3,WAIT", SILENCE), *ENDED, *OVER], series(3)),
        numbers(np.nan, np.nan, np.nan),
    ),
    "a series of the wrong length is none": (
        *(Keysight53230A, [*BEGUN, NO_ERROR, ("DATA:REM? 3,WAIT", "+2.5E+01,+2.5E+01"), *ENDED, *OVER], series(3)),
        Raises(BadAnswer, has={"answer": "+2.5E+01,+2.5E+01"}),
    ),
    **{
        f"the CNT-91 has direct coupling, a fixed level and a time-out, input {channel}": (
            *(PendulumCNT91, [*preparation_of_cnt91(channel), *reading("+2.5000000000000E+01", NONE_WRONG)]),
            *(patience(10.0, channel), (25.0, 21.0)),
        )
        for channel in (1, 2)
    },
    **{
        f"the CNT-91 says {nothing!r} when there was nothing": (  # compatible and native mode: handbook, 8-36
            *(PendulumCNT91, reading(nothing, NONE_WRONG), frequency, None),
        )
        for nothing in ("+9.9100000000000E+37", "")
    },
    "the CNT-91 gives time stamps beside the readings": (
        PendulumCNT91,
        [
            *(*accepted("FORM:TINF ON", "ARM:COUN 2", "INIT"), NONE_WRONG, ("*OPC?", "1"), NONE_WRONG),
            ("FETC:ARR? 2", "+2.5E+01,+7.0E+02,+9.91E+37,+7.1E+02"),
            *accepted("ARM:COUN 1", "FORM:TINF OFF"),
        ],
        *(stamped(2), numbers(25.0, 700.0, np.nan, 710.0)),
    ),
    "time stamps of more readings than an answer holds come in parts": (
        PendulumCNT91,
        [
            *(*accepted("FORM:TINF ON", "ARM:COUN 1002", "INIT"), NONE_WRONG, ("*OPC?", "1"), NONE_WRONG),
            *(("FETC:ARR? 1000", ",".join(["+2.5E+01,+7.0E+02"] * 1000)), NONE_WRONG),
            ("FETC:ARR? 2", "+2.6E+01,+7.1E+02,+2.7E+01,+7.2E+02"),
            *accepted("ARM:COUN 1", "FORM:TINF OFF"),
        ],
        *(stamped(1002), numbers(25.0, 700.0, 26.0, 710.0, 27.0, 720.0)),
    ),
    **{
        f"the CNT-91 is known as {identity.partition(',')[0]}": (
            *(PendulumCNT91, [("*IDN?", identity)], lambda it: it.identity(), identity),
        )
        for identity in (
            *("PENDULUM, CNT-91, 123456, V1.28 7 Jan 2012", "TEKTRONIX,FCA3000,579249,V1.32 26 May 2022 09:54"),
        )
    },
    **{
        f"an input of the {driver.__name__} that counts no slow pulses is refused": (
            *(driver, [], lambda it: prepare(it, channel=3), Raises(OutOfRange, has={"name": "channel", "value": 3})),
        )
        for driver in (Keysight53230A, PendulumCNT91)
    },
    **{
        f"a series of {count} is not in the memory of the {driver.__name__}": (
            *(driver, [], series(count), Raises(OutOfRange, "count")),
        )
        for driver in (Keysight53230A, PendulumCNT91)
        for count in (0, -1, 1_000_001)
    },
}


@talks(READINGS)
def test_a_counter_is_talked_to_as_its_manual_says(driver, lines, act, end):
    talk(driver, lines, act, end)


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
    counter = driver(open_link(ADDRESS, library=library))
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
        counter = driver(open_link(address, library=library, log=record))
        counter.prepare(gate_s=0.1, trigger_level_v=0.6)
        found.append(counter.settings())
        assert not counter.changed_settings(counter.settings())
        assert counter.frequency() == pytest.approx(25.0, rel=1e-4)
        counter.raise_errors("a test")
        counter.close()
    assert found[0] == found[1]
    assert len(joined) == (4 if join == "a blank behind the semicolon" else 3)  # the other one is asked once


def interrupted(clock, monkeypatch, act, after):
    """Ctrl-C in the middle of a wait, after many others."""
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
    counter = connected(PendulumCNT91, VirtualCNT91(VirtualClock(), signal=light))
    counter.prepare(gate_s=0.09, trigger_level_v=0.6)
    values, times = counter.timed_readings(5).T
    np.testing.assert_allclose(values, 25.0, rtol=1e-4)
    # three periods of 40 ms hold the gate, and the next edge opens the next one
    np.testing.assert_allclose(np.diff(times), 0.16, atol=1e-5)
    assert counter.frequency() == pytest.approx(25.0, rel=1e-4)
    counter.close()
