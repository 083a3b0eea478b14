"""Long records in windows, and their phases."""

import numpy as np
import pytest

from analysis.errors import NotPositive
from analysis.pulses import Finding, phases, track_of_blocks, track_of_samples, track_of_times
from analysis.pulses.errors import OnlyHum, TooFewPulses
from analysis.pulses.track import collect_findings

RATE = 5000.0
TIME = np.arange(round(70 * RATE)) / RATE
#: Up from 20 to 30 Hz in 20 s, held with a swing of 0.02 Hz for 12 s, coasting for 28 s, nothing.
FREQUENCY = np.where(
    TIME < 20,
    20 + 0.5 * TIME,
    np.where(TIME < 32, 30 + 0.02 * np.sin(2 * np.pi * 0.33 * TIME), 30 * np.exp(-0.0032 * (TIME - 32))),
)
PHASE = np.cumsum(FREQUENCY) / RATE
SIGMA = 0.03 / 2.3548


def blocks(size=7777):
    """The record in pieces of an odd size."""
    light = np.exp(-0.5 * ((PHASE - np.floor(PHASE) - 0.5) / SIGMA) ** 2) * (TIME < 60)
    light += 0.05 * np.random.default_rng(1).standard_normal(TIME.size)
    return (light[i : i + size] for i in range(0, light.size, size))


@pytest.fixture(scope="module")
def track():
    return track_of_blocks(blocks(), RATE)


def test_the_turns_of_a_record_in_blocks_are_counted_through(track):
    truth = np.interp(track.time, TIME, PHASE)
    assert track.connected[1:].all()
    assert np.abs(track.turns - track.turns[0] - (truth - truth[0])).max() < 0.003  # a tenth of the pulse
    assert track.empty == ((60.0, 70.0),)


def test_frequencies_of_windows_hold_their_uncertainties(track):
    steady = (track.time < 20) | (track.time > 33)  # the swing is no parabola within a window
    pulls = (track.frequency - np.interp(track.time, TIME, FREQUENCY))[steady] / track.u[steady]
    assert np.std(pulls) == pytest.approx(1, abs=0.45)  # 3 standard errors from 24
    assert track.u.max() < 2e-3


def test_a_record_with_uneven_times_is_followed_across_its_gaps():
    random = np.random.default_rng(5)
    times = np.sort(random.choice(TIME[TIME < 60], 120_000, replace=False))
    times = times[(times < 40.3) | (times > 45.1)]
    turns = np.interp(times, TIME, PHASE)
    light = np.exp(-0.5 * ((turns - np.floor(turns) - 0.5) / SIGMA) ** 2) + 0.05 * random.standard_normal(times.size)
    found = track_of_samples(light, times)
    assert [(round(start), round(end)) for start, end in found.empty] == [(42, 44)]
    steady = (found.time < 20) | (found.time > 33)
    pulls = (found.frequency - np.interp(found.time, TIME, FREQUENCY))[steady] / found.u[steady]
    assert 0.45 < np.std(pulls) < 1.45  # 3 standard errors from 24; u of flanks between samples is for even ones: 0.64


def test_a_record_is_cut_into_its_phases(track):
    found = phases(track)
    assert [phase.kind for phase in found] == ["speeding-up", "held", "coasting", "nothing"]
    edges = [phase.end for phase in found]
    assert edges[:2] == pytest.approx([20, 32], abs=4)  # two windows
    assert edges[2:] == [60, 70]
    assert found[0].windows[1] == found[1].windows[0]


def test_times_of_a_switch_up_and_down_are_cut_as_well():
    random = np.random.default_rng(3)
    times = np.interp(np.arange(1, int(PHASE[round(60 * RATE)])), PHASE, TIME)
    bounce = times[random.uniform(size=times.size) < 0.4]
    bounce = bounce + 2e-4 + random.exponential(0.004, bounce.size)
    found = track_of_times(np.unique(np.concatenate([times[random.uniform(size=times.size) > 0.08], bounce])))
    assert [phase.kind for phase in phases(found)] == ["speeding-up", "held", "coasting"]
    assert np.abs(found.frequency - np.interp(found.time, TIME, FREQUENCY)).max() < 0.02
    truth = np.interp(found.time, TIME, PHASE)
    assert found.connected[1:].all()
    assert np.abs(found.turns - found.turns[0] - (truth - truth[0])).max() < 0.03
    assert {"doubled", "missing"} <= {note.name for note in found.notes}


@pytest.mark.parametrize("pattern", [(1, 2), (2, 3), (3, 2, 2), (1, 3), (3, 4), (3, 5)])
def test_pulses_that_come_in_a_pattern_of_turns_have_the_rate_of_the_turns(pattern):
    turns = np.cumsum(np.tile(pattern, 300))
    times = (26.83 - np.sqrt(26.83**2 - 2 * 0.05 * turns)) / 0.05
    times = times[times < 30] + 1e-4 * np.random.default_rng(1).standard_normal(np.count_nonzero(times < 30))
    found = track_of_times(times)
    pulls = (found.frequency - 26.83 + 0.05 * found.time) / found.u
    assert np.abs(pulls).max() < 4
    assert [note.name for note in found.notes] == ["missing"]


def test_windows_that_contradict_each_other_are_named():
    times = np.arange(600) / 30.0
    halves = np.concatenate([times[times < 10], times[times >= 10][::2]])
    assert "unlike" in {note.name for note in track_of_times(halves).notes}
    assert "unlike" not in {note.name for note in track_of_times(times).notes}


def test_blocks_are_not_all_held():
    held = []

    def watched():
        for i, block in enumerate(blocks(size=5000)):
            held.append(i)
            yield block

    track_of_blocks(watched(), RATE, window=1.0, method="edges")
    assert len(held) == 70


def test_records_without_pulses_and_wrong_windows_are_refused():
    with pytest.raises(TooFewPulses):
        track_of_blocks([np.zeros(20000)], RATE)
    with pytest.raises(NotPositive, match="window"):
        track_of_times(np.arange(100) / 30, window=0.0)


def test_findings_of_windows_are_counted_by_window_and_kind():
    hum, harmonic, missing = Finding("hum"), Finding("hum", "harmonic"), Finding("missing")
    found = collect_findings({1: [hum, harmonic, hum], 2: [missing], 3: [hum]}, 3)
    assert {(one.name, one.of): one.where for one in found} == {
        ("hum", ""): (1, 2, 3),
        ("hum", "harmonic"): (1, 1, 3),
        ("missing", ""): (2, 1, 3),
    }
    assert [one.of for one in collect_findings({1: [hum, harmonic]}, 1)] == ["", "harmonic"]


def test_a_record_of_hum_alone_is_said_to_be_hum():
    time = np.arange(8 * RATE) / RATE
    hum = np.sin(2 * np.pi * 50 * time) + np.random.default_rng(1).normal(0, 0.05, time.size)
    with pytest.raises(OnlyHum, match="hum of the mains"):
        track_of_blocks([hum], RATE)
