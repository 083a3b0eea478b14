"""Edges of a sampled voltage: the Schmitt trigger, and light that is looked at in pieces."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from instruments.virtual.core.signal import crossings
from instruments.virtual.counter.edges import RATE, EdgeFinder, TriggerInput


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


@given(
    voltage=VOLTAGES,
    level=st.sampled_from([-0.25, 0.0, 0.3]),
    hysteresis=st.sampled_from([0.0, 0.1, 0.6]),
    falling=st.booleans(),
    steps=st.lists(st.integers(1, 9), min_size=60, max_size=60),
)
def test_edges_found_in_pieces_are_those_of_the_whole(voltage, level, hysteresis, falling, steps):
    def signal(start, step, n):
        first = round(start * RATE)
        return np.array((voltage + [voltage[-1]] * 100)[first : first + n])

    finder = EdgeFinder(signal, TriggerInput(level, hysteresis, 0.02, falling=falling), 0.0)
    for reached in itertools.accumulate(steps):
        finder.look(reached / RATE, min(reached, len(voltage) - 1 + 1e-6) / RATE)
    sign = -1 if falling else 1
    whole = crossings(sign * np.array(voltage), sign * level, hysteresis)
    found = []
    while edge := finder.find(found[-1][1] + 1e-12 if found else 0.0):
        found.append((edge.count, edge.time))
    assert [count for count, _ in found] == list(range(len(whole)))
    np.testing.assert_allclose([time * RATE for _, time in found], whole, rtol=1e-12, atol=1e-9)


def test_a_signal_that_knows_its_edges_is_not_sampled_while_it_does():
    edges = np.arange(0.01, 4.0, 0.04)

    class Known:
        sampled = 0

        def __call__(self, start, step, n):
            self.sampled += n
            return np.sin(2 * np.pi * ((start + step * np.arange(n) - 0.01) / 0.04))

        def crossings(self, start, stop, triggers):
            return edges[(edges >= start) & (edges < stop)] if stop < 2.0 else None

    signal = Known()
    finder = EdgeFinder(signal, TriggerInput(0.0, 0.1, 0.02), 0.0)
    found, at = [], 0.0
    while at < 3.0:
        if (edge := finder.find(at)) is None:
            assert signal.sampled == 0 or finder.reached > 1.9
            finder.look(at, 4.0)
        else:
            found.append(edge)
            at = edge.time + 1e-6
    assert signal.sampled > 0
    assert [edge.count for edge in found] == list(range(len(found)))
    # straight between samples
    np.testing.assert_allclose([edge.time for edge in found], edges[: len(found)], atol=2e-6)
