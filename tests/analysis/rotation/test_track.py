"""A long record of a magnetometer: frequency against time, where the top is put and falls, and folds."""

import numpy as np
import pytest

from analysis.rotation import track_of_field
from analysis.rotation.errors import NoLine
from phone_records import synthetic_flight


@pytest.fixture
def fresh():
    """Random numbers that no constant was chosen with."""
    return np.random.default_rng(20261125)


def follow(random, **how):
    """Return a track and the deviations from the truth over u."""
    times, field, spin = synthetic_flight(random, **how)
    track = track_of_field(times, field)
    return track, (track.frequency - np.interp(track.time, times, spin)) / track.u


def test_windows_are_as_exact_and_independent_as_their_u_say(fresh):
    pulls = np.concatenate([follow(fresh, duration=100.0)[1] for _ in range(6)])
    assert pulls.size == 60
    assert pulls.std() == pytest.approx(1, abs=4 / np.sqrt(2 * 60))  # 4 standard errors
    assert abs(np.mean(pulls[1:] * pulls[:-1])) < 4 / np.sqrt(60)


def test_a_top_is_followed_from_where_it_is_put_to_where_it_falls(fresh):
    track, pulls = follow(fresh, up=(22.0, 94.3))
    (flight,) = track.flights
    assert (flight.start, flight.end) == pytest.approx((22.0, 94.3), abs=1.6)  # three pieces of half a second
    assert flight.began
    assert flight.ended
    assert np.abs(pulls).max() < 4
    assert [end for _, end in track.empty] == pytest.approx([22.0, 120.0], abs=1.6)


def test_the_end_of_a_line_scatters_about_the_fall_as_its_u_says(fresh):
    errors, pulls = [], []
    for _ in range(40):
        end, amplitude = fresh.uniform(32, 38), fresh.uniform(0.25e-6, 0.6e-6)
        track, _ = follow(fresh, duration=42.0, up=(0.0, end), amplitude=amplitude)
        (flight,) = track.flights
        errors.append(flight.end - end)
        pulls.append(errors[-1] / flight.u_end)
    # 3 standard errors of a mean, 4 of a share of 40: the jolt of the fall is no part of the line
    assert np.mean(errors) == pytest.approx(0, abs=3 * np.std(errors) / np.sqrt(60))
    assert np.mean(np.abs(pulls) < 1) == pytest.approx(0.68, abs=4 * np.sqrt(0.68 * 0.32 / 40))
    assert np.mean(np.abs(pulls) < 2) > 0.95 - 4 * np.sqrt(0.95 * 0.05 / 40)


def test_a_jolt_at_the_fall_does_not_move_the_end_of_the_line(fresh):
    moved = []
    for _ in range(6):
        times, field, _ = synthetic_flight(fresh, duration=50.0, up=(0.0, 34.3))
        jolted = field + np.where(times < 34.3, 0, 6e-5)[:, None]
        moved.append(track_of_field(times, jolted).flights[0].end - track_of_field(times, field).flights[0].end)
    assert np.sqrt(np.mean(np.square(moved))) < 0.25  # half of a piece, in which a line keeps its phase


@pytest.mark.parametrize("rate", [100.0, 50.0])
def test_a_gap_longer_than_a_window_is_no_part_of_the_rate_and_of_the_track(fresh, rate):
    times, field, spin = synthetic_flight(fresh, rate=rate, jitter=0.0)
    there = (times < 55) | (times > 82)
    track = track_of_field(times[there], field[there])
    assert np.abs((track.frequency - np.interp(track.time, times, spin)) / track.u).max() < 4
    assert [one.rate for one in track.spins] == pytest.approx([rate] * len(track.spins), rel=1e-3)


def test_a_line_that_runs_through_half_the_rate_is_followed_there(fresh):
    track, pulls = follow(fresh, start_hz=57.0)
    assert np.abs(pulls).max() < 4
    assert track.kinds == ("folded",)


def test_at_even_times_the_fall_of_the_spin_tells_the_folds_of_a_slow_phone(fresh):
    track, pulls = follow(fresh, rate=50.0, jitter=0.0)
    assert np.abs(pulls).max() < 4
    assert set(track.kinds) == {"folded", "fold-by-slope"}


def test_an_even_slope_as_that_of_a_drive_tells_no_folds_at_even_times(fresh):
    times, random = np.arange(0, 20, 0.01), fresh
    turns = 30 * times - 0.04 * times**2
    waves = 20e-6 * np.stack([part(2 * np.pi * turns) for part in (np.cos, np.sin)], axis=1)
    track = track_of_field(times, waves + random.normal(0, 0.2e-6, waves.shape))
    assert track.frequency[0] == pytest.approx(29.58, abs=1e-2)
    assert [fold.frequency for fold in track.spins[0].folds] == pytest.approx([29.58, 70.42], abs=1e-2)
    assert track.spins[0].doubtful  # with the bend of a drag alone 70 Hz was certain, as a drag does not fall evenly


def test_two_tops_are_two_flights(fresh):
    first, second = (synthetic_flight(fresh, duration=60.0, up=(0, 48.0), start_hz=hz) for hz in (28.0, 36.0))
    times = np.concatenate([first[0], first[0][-1] + 0.01 + second[0] - second[0][0]])
    track = track_of_field(times, np.concatenate([first[1], second[1]]))
    assert [flight.ended for flight in track.flights] == [True, True]
    starts = [track.frequency[flight.first] for flight in track.flights]
    assert starts == pytest.approx([27.5, 35.4], abs=0.3)


def test_a_flight_begins_where_the_one_before_has_ended(fresh):
    rest, again = {"duration": 51.0, "up": (0, 48.0), "start_hz": 32.6}, {"duration": 50.0, "up": (0, 40.0)}
    first, second = synthetic_flight(fresh, **rest), synthetic_flight(fresh, **again, start_hz=28.3)
    times = np.concatenate([first[0], first[0][-1] + 0.01 + second[0] - second[0][0]])
    one, two = track_of_field(times, np.concatenate([first[1], second[1]])).flights
    assert one.end <= two.start  # their lines differ by 0.3 Hz there


def test_a_record_without_a_top_is_refused(fresh):
    times, field, _ = synthetic_flight(fresh, duration=30.0, amplitude=0.0)
    with pytest.raises(NoLine):
        track_of_field(times, field)
