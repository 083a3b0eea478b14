"""The counter's driver: the manual's bytes.

Source: Keysight 53220A/53230A Programmer's Reference; public drivers of the family.
"""

import pytest
from conversation import CLEAR, NO_ERROR, SILENCE, accepted, conversation

from instruments.counter import Keysight53230A
from instruments.errors import BadAnswer, CommandRefused, NoAnswer, OutOfRange


def preparation(gate, level, timeout):
    return accepted(
        "CONF:FREQ (@1)",
        "SENS:FREQ:GATE:SOUR TIME",
        f"SENS:FREQ:GATE:TIME {gate}",
        "INP1:COUP DC",
        "INP1:IMP 1000000.0",
        "INP1:PROB 1.0",
        "INP1:RANG 5.0",
        "INP1:LEV:AUTO OFF",
        f"INP1:LEV1 {level}",
        "INP1:SLOP1 POS",
        f"SYST:TIM {timeout}",
    )


def test_the_counter_is_prepared_with_direct_coupling_and_a_fixed_level():
    with conversation(Keysight53230A, *preparation("1.0", "0.6", "3.0")) as counter:
        counter.prepare(gate_s=1.0, trigger_level_v=0.6)


@pytest.mark.parametrize(("gate", "patience"), [(0.1, 1.2), (1.0, 3.0), (10.0, 21.0)])
def test_the_answer_is_waited_for_beyond_the_time_at_which_the_counter_itself_gives_up(gate, patience):
    lines = [*preparation(f"{gate}", "0.6", f"{patience}"), NO_ERROR, ("READ?", "+9.91E+37")]
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
        pytest.raises(OutOfRange, match=r"gate = 0\.0 is refused"),
    ):
        counter.prepare(gate_s=0.0, trigger_level_v=0.6)


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
    assert silence.value.question == "SYST:ERR?"


@pytest.mark.parametrize("garbage", ["", "DC", "+2.3E+01,+2.4E+01", '-230,"Data corrupt or stale"'])
def test_garbage_is_no_reading_but_an_error(garbage):
    with conversation(Keysight53230A, NO_ERROR, ("READ?", garbage)) as counter, pytest.raises(BadAnswer) as bad:
        counter.frequency()
    assert (bad.value.question, bad.value.answer) == ("READ?", garbage)


def test_a_refused_step_of_the_preparation_ends_it():
    refused = [("CONF:FREQ (@1)", None), ("SYST:ERR?", '-221,"Settings conflict"'), NO_ERROR]
    with conversation(Keysight53230A, *refused) as counter, pytest.raises(CommandRefused, match="CONF:FREQ"):
        counter.prepare(gate_s=1.0, trigger_level_v=0.6)
