"""The faults of a wire themselves: they do what they say, and what a link cannot show is shown here."""

import pytest

from instruments.errors import InstrumentError
from support.wire_faults import ANSWERS, MESSAGES, Fault
from support.wire_pairs import KINDS, STREAMS, WAYS, Pair, attempt, levilab_protocol

CELLS = [(way, name) for way, names in WAYS.items() for name in names]


@pytest.fixture(scope="module", autouse=True)
def clients():
    with levilab_protocol():
        yield


@pytest.fixture(scope="module")
def pair_over():
    """The pair of the test before, where it is of this way and model: each test leaves it sound."""
    last = {}

    def made(way, name):
        if (way, name) not in last:
            while last:
                last.popitem()[1].close()
            last[way, name] = Pair(way, name)
        return last[way, name]

    yield made
    for pair in last.values():
        pair.close()


@pytest.mark.parametrize(("way", "name"), CELLS)
def test_without_a_fault_every_operation_gives_the_right_value(pair_over, way, name):
    pair = pair_over(way, name)
    for wanted, operation in KINDS[name].operations.items():
        value, error = attempt(pair, operation)
        assert error is None, wanted
        assert operation.right(pair, value), wanted
        if operation.remakes:
            pair.recover(anew=True, reset=False)


@pytest.mark.parametrize("what", [*ANSWERS, *MESSAGES])
@pytest.mark.parametrize("way", WAYS)
def test_every_fault_strikes_on_every_way(pair_over, way, what):
    pair = pair_over(way, WAYS[way][-1])
    pair.wire.arm(Fault(what, at=1, place=0.5, junk=b"~"))
    operation = pair.kind.operations["settings"]
    value, error = attempt(pair, operation)
    assert pair.wire.struck
    assert error or operation.right(pair, value) or what == "another digit"
    silent = {"withheld", "late", "ended", "message lost"} | ({"cut"} if way in STREAMS else set())
    if what in silent:
        assert error
    pair.recover(anew=False, reset=False)
    value, error = attempt(pair, operation)
    assert error is None
    assert operation.right(pair, value)


# --- what a link cannot show: see docs/bench.md ---


def struck(pair, fault, act):
    """What this gives while the fault is on the wire."""
    pair.wire.arm(fault)
    value = act(pair.driver)
    assert pair.wire.struck
    return value


@pytest.mark.parametrize("way", WAYS)
def test_a_command_that_is_lost_is_noticed_where_it_is_asked_back(pair_over, way):
    pair = pair_over(way, "475")
    for at in range(2):  # unit, mode
        with pytest.raises(InstrumentError):
            struck(pair, Fault("message lost", at=at), KINDS["475"].prepare)
        pair.recover(anew=True, reset=False)


@pytest.mark.parametrize("way", ["messages", "stream"])
def test_a_command_that_is_lost_without_a_trace_is_found_by_its_setting(pair_over, way):
    pair = pair_over(way, "53230A")
    pair.driver.gate = 0.5
    struck(pair, Fault("message lost"), lambda driver: setattr(driver, "gate", 0.25))
    assert pair.driver.changed_settings(pair.driver.settings()) == {"gate_s": (0.25, 0.5)}
