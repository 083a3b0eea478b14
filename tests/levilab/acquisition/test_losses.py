"""An instrument that fails in the middle of a run: events, reached again, set up again; a gap, and no made-up value."""

from dataclasses import replace

import numpy as np
import pytest

from instruments.errors import InstrumentError
from instruments.virtual.bench.faults import FAULTS, Fault
from levilab.acquisition.counting import prepare_counter
from levilab.acquisition.grip import GRIP_GATE_S
from levilab.acquisition.loop import acquire
from levilab.acquisition.session import MOST_LOSSES
from levilab.acquisition.table import settings_of, with_settings
from levilab.runs.run import Run
from levilab.world import bench as benches
from levilab.world.bench import VIRTUAL, virtual_bus
from support.acquisitions import BEFORE, Silent, events, kinds, mock


def acquired(folder, monkeypatch, *faults):
    def with_faults(*given):
        bus = virtual_bus(*given)
        bus.faults.extend(faults)
        return bus

    monkeypatch.setattr(benches, "virtual_bus", with_faults)
    return acquire(mock(folder), Silent())


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return acquire(mock(tmp_path_factory.mktemp("whole")), Silent())


#: What a fault of the counter's eighth reading costs: nothing, or that reading.
COSTS = {
    "no answer": "instrument lost",
    "late answer": "instrument lost",
    "single bytes": "",
    "two answers at once": "instrument lost",  # the rest of the message interrupts the next question: −410
    "garbage before": "instrument lost",
    "bytes that are no text before": "instrument lost",
    "garbage after": "instrument lost",
    "block longer than it says": "",
    "block shorter than it says": "",
    "cut in the middle": "instrument lost",
    "disconnected": "instrument lost",
    "away for 5 s": "instrument lost",
    "error queue overflow": "instrument lost",
    "reset": "instrument lost",
    "9.91E37": "asked again",
}


def test_every_fault_is_tried():
    assert set(COSTS) | {"taken by another"} == set(FAULTS)


#: Once, and again each time that it is asked once more; but a counter that says twice that it is dark is believed.
OFTEN = [(what, times) for what in COSTS for times in (1, 3) if what != "9.91E37" or times == 1]


@pytest.mark.parametrize(("what", "times"), OFTEN)
def test_a_fault_of_a_reading_is_reported_and_the_run_goes_on(what, times, whole, tmp_path, monkeypatch):
    # two readings come before the drive is off
    run = acquired(tmp_path, monkeypatch, Fault(what, question=r"READ\?", after=BEFORE + 6, times=times))
    before, frame = whole.readings().frame, run.readings().frame
    assert run.status == "finished"
    assert kinds(run)[-1] == "fell"
    assert kinds(run).count("instrument lost") == (times if COSTS[what] == "instrument lost" else 0)
    # at the end of every run the counter is asked twice whether it is dark
    assert kinds(run).count("asked again") == 1 + (COSTS[what] == "asked again")
    assert len(before) - 2 * times <= len(frame) <= len(before)
    # each reading is of the same top at its time: nothing is made up
    expected = np.interp(frame["time_s"], before["time_s"], before["spin_frequency_hz"])
    inside = frame["time_s"] < before["time_s"].max() - 1
    assert frame["spin_frequency_hz"][inside].to_numpy() == pytest.approx(expected[inside], abs=0.2)
    if COSTS[what] == "instrument lost":
        assert "found again" in kinds(run)


def test_an_instrument_that_is_gone_for_a_while_is_tried_until_it_is_back(tmp_path, monkeypatch):
    run = acquired(tmp_path, monkeypatch, Fault("away for 5 s", question=r"READ\?", after=BEFORE + 6))
    tries = events(run, "not reached")
    assert len(tries) == 3  # at once, and 1 s and 3 s later; 7 s later it is back
    assert "try 3 of 6" in tries[-1]["text"]
    gaps = np.diff(run.readings().frame["time_s"])
    assert gaps.max() == pytest.approx(20.0, abs=1.0)  # one reading of every 10 s is missing


def test_an_instrument_that_another_program_keeps_ends_the_run_and_keeps_its_readings(tmp_path, monkeypatch):
    with pytest.raises(InstrumentError, match="locked"):
        acquired(tmp_path, monkeypatch, Fault("taken by another", question=r"READ\?", after=BEFORE + 6))
    (run,) = [Run.load(path) for path in tmp_path.iterdir()]
    assert run.status == "failed"
    assert len(run.readings().frame) == 6
    assert kinds(run).count("not reached") == 6


def test_an_instrument_that_is_lost_again_and_again_is_given_up(tmp_path, monkeypatch):
    with pytest.raises(InstrumentError):
        acquired(tmp_path, monkeypatch, Fault("disconnected", question=r"READ\?", after=BEFORE + 6, times=1000))
    (run,) = [Run.load(path) for path in tmp_path.iterdir()]
    assert kinds(run).count("instrument lost") == MOST_LOSSES + 1


def test_settings_changed_by_hand_are_reported_by_name_and_set_again(tmp_path, monkeypatch):
    run = acquired(tmp_path, monkeypatch, Fault("reset", question=r"READ\?", after=BEFORE + 6))
    (lost,) = events(run, "instrument lost")
    assert "gate_s = 0.1 instead of 1.0" in lost["text"]
    assert run.record.instruments["counter"]["settings_end"]["gate_s"] == 1.0


def test_a_drive_whose_link_is_lost_is_switched_off_over_a_new_one(tmp_path, monkeypatch):
    # the first question after the ramp of 25 steps is whether the output is off
    run = acquired(tmp_path, monkeypatch, Fault("disconnected", question=r"OUTP1\?", after=2))
    assert run.status == "finished"
    assert run.record.instruments["generator"]["settings_end"]["output"] is False


@pytest.mark.parametrize("when", range(2, 10))
def test_a_reset_while_it_is_set_up_is_found_before_anything_is_measured(when, tmp_path, monkeypatch):
    # each command of the setting up is followed by a look into the error queue
    with pytest.raises(InstrumentError, match=r"_s = |_v = |coupling|automatic_level|impedance"):
        acquired(tmp_path, monkeypatch, Fault("reset", question=r"SYST:ERR\?", after=when))


@pytest.mark.parametrize("after", [0, 1])
@pytest.mark.parametrize("what", ["no answer", "disconnected", "reset"])
def test_a_counter_that_fails_before_the_first_reading_is_reached_again(what, after, tmp_path, monkeypatch):
    run = acquired(tmp_path, monkeypatch, Fault(what, question=r"READ\?", after=after))
    assert run.status == "finished"
    assert kinds(run)[:3].count("found again") == 1
    assert kinds(run).count("drive on") == 1


def test_a_counter_that_is_reset_while_the_drive_takes_hold_counts_on_with_short_gates(tmp_path, monkeypatch):
    gates = []

    def prepare(session, gate_s=None):
        gates.append(gate_s)
        prepare_counter(session, gate_s)

    monkeypatch.setattr("levilab.acquisition.counting.prepare_counter", prepare)
    run = acquired(tmp_path, monkeypatch, Fault("reset", question=r"READ\?", after=5))
    assert kinds(run)[:3] == ["drive on", "instrument lost", "found again"]
    assert gates == [GRIP_GATE_S, GRIP_GATE_S, None]


def test_a_generator_that_fails_on_the_way_up_is_off_and_the_way_is_gone_again(tmp_path, monkeypatch):
    # at the generator's address only the ramp asks for its error queue so often
    cut = Fault("disconnected", question=r"SYST:ERR\?", after=110)
    run = acquired(tmp_path, monkeypatch, cut)
    order = kinds(run)
    assert run.status == "finished"
    assert order.count("drive on") == 2
    assert order.index("drive on") < order.index("instrument lost") < order.index("found again") < order.index("locked")
    assert 30 < run.readings().frame["spin_frequency_hz"].iloc[0] < 36


def test_what_was_missed_is_not_caught_up_with(tmp_path, monkeypatch):
    order = mock(tmp_path)
    often = settings_of(order.config, "spin").model_copy(update={"interval_s": 2.0})

    def with_faults(*given):
        bus = virtual_bus(*given)
        bus.faults.append(Fault("away for 5 s", question=r"READ\?", after=BEFORE + 6))
        return bus

    monkeypatch.setattr(benches, "virtual_bus", with_faults)
    changed = replace(order, config=with_settings(order.config, "spin", often))
    gaps = np.diff(acquire(changed, Silent()).readings().frame["time_s"])
    assert gaps.max() > 5
    assert gaps.min() > 1.9


def test_a_drive_that_was_left_on_goes_off_even_if_the_counter_is_not_there(tmp_path, monkeypatch):
    left = []

    def left_on(*given):
        bus = virtual_bus(*given)
        generator, counter = (bus.instruments[VIRTUAL[kind].address] for kind in ("generator", "counter"))
        generator.execute("OUTP1 ON")
        bus.unreachable_until[id(counter)] = 1e9
        left.append(bus)
        return bus

    monkeypatch.setattr(benches, "virtual_bus", left_on)
    with pytest.raises(InstrumentError, match="counter"):
        acquire(mock(tmp_path), Silent())
    answer = left[0].instruments[VIRTUAL["generator"].address].execute("OUTP1?")
    assert answer.data == b"0\n"
