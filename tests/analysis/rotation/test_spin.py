"""The spin in a magnetometer's record: bias, scatter, bound, folds, and what is refused."""

import numpy as np
import pytest

from analysis.errors import ShapesDiffer, TimesNotIncreasing, TooFewReadings
from analysis.rotation import spin_of_field
from analysis.rotation.errors import NoLine
from phone_records import frequency_bounds, synthetic_field

TRIALS = 60


@pytest.mark.parametrize("snr_db", [6.0, 20.0])
def test_errors_are_as_large_as_the_bound_and_as_u_say(fresh, snr_db):
    errors, u, bound = [], [], []
    for _ in range(TRIALS):
        frequency = fresh.uniform(22, 45)
        chirp = -fresh.uniform(2e-3, 4e-3) * frequency
        times, field = synthetic_field(fresh, frequency=frequency, chirp=chirp, bend=fresh.uniform(1, 2), snr_db=snr_db)
        found = spin_of_field(times, field)
        errors += [(found.frequency - frequency, found.chirp - chirp)]
        u += [(found.u_frequency, found.u_chirp)]
        bound.append(frequency_bounds(times, frequency, chirp, snr_db)[1])
    pulls = np.array(errors) / np.array(u)
    # 4 standard errors of a standard deviation from 60
    assert pulls.std(axis=0) == pytest.approx([1, 1], abs=4 / np.sqrt(2 * TRIALS))
    ratio = np.sqrt(np.mean((np.array(errors)[:, 0] / np.array(bound)) ** 2))
    assert ratio < 1.1 + 3 / np.sqrt(2 * TRIALS)


def test_amplitude_noise_and_sense_are_those_of_the_record(fresh):
    found = spin_of_field(*synthetic_field(fresh, snr_db=12.0))
    truth = 0.5e-6 * 10 ** (12 / 20) * np.array([1, 0.5, 0.3])
    assert np.all(np.abs(np.array(found.amplitude) - truth) < 4.5 * np.array(found.u_amplitude))
    assert found.noise == pytest.approx([0.5e-6] * 3, rel=0.12)  # 5 standard errors of 1000 samples
    assert found.snr_db == pytest.approx(12, abs=0.7)
    assert found.sense == 1


def test_a_field_that_turns_the_other_way_has_the_other_sense(fresh):
    times, field = synthetic_field(fresh, snr_db=12.0)
    assert spin_of_field(times, field * [1, -1, 1]).sense == -1
    assert spin_of_field(times, field[:, 0]).sense == 0


@pytest.mark.parametrize(
    ("more", "kinds"), [({"snr_db": 9.0}, {"folded"}), ({"jitter": 0.0}, {"folded", "fold-by-slope"})]
)
def test_jitter_or_the_slope_tells_a_line_above_half_the_rate(fresh, more, kinds):
    found = spin_of_field(*synthetic_field(fresh, frequency=61.0, chirp=-0.2, **more))
    assert set(found.kinds) == kinds
    assert [fold.frequency for fold in found.folds] == pytest.approx([61.0, 39.0], abs=0.02)


def test_without_slope_and_jitter_the_folds_are_named(fresh):
    found = spin_of_field(*synthetic_field(fresh, frequency=61.0, chirp=0.0, jitter=0.0))
    assert found.doubtful
    assert sorted(fold.frequency for fold in found.folds) == pytest.approx([39.0, 61.0], abs=0.02)


def test_where_nothing_decides_a_spin_as_tops_have_it_leads():
    times = np.arange(1000) / 100.0
    turn = 2 * np.pi * 30.0 * times
    found = spin_of_field(times, 5e-6 * np.stack([4 + np.sin(turn), np.cos(turn) - 2], axis=1))
    assert found.doubtful
    assert [fold.frequency for fold in found.folds] == pytest.approx([30.0, 70.0], abs=1e-6)


def test_times_that_jitter_more_than_their_samples_tell_no_fold(fresh):
    times, field = synthetic_field(fresh, frequency=61.0, chirp=0.0, jitter=0.0, snr_db=12.0)
    found = spin_of_field(times + fresh.normal(0, 3e-4, times.size), field)
    assert found.doubtful
    assert "regular" in found.kinds


def test_a_frequency_that_is_known_about_leaves_no_doubt(fresh):
    times, field = synthetic_field(fresh, frequency=61.0, chirp=0.0, jitter=0.0)
    assert spin_of_field(times, field, near=60.0).frequency == pytest.approx(61.0, abs=0.02)
    assert spin_of_field(times, field, near=40.0).frequency == pytest.approx(39.0, abs=0.02)


def test_noise_has_no_line(fresh):
    times, field = synthetic_field(fresh, snr_db=-60.0, disturbed=False)
    with pytest.raises(NoLine, match="stands out"):
        spin_of_field(times, field)


def test_samples_without_a_number_are_left_out(fresh):
    times, field = synthetic_field(fresh, snr_db=12.0)
    field[fresh.integers(0, times.size, 30), 1] = np.nan
    found = spin_of_field(times, field)
    assert times.size - 30 <= found.samples < times.size - 20
    assert abs(found.frequency - 31.0) < 5 * found.u_frequency


def test_a_gap_of_a_second_does_no_harm(fresh):
    times, field = synthetic_field(fresh)
    kept = np.abs(times - 4) > 0.5
    found = spin_of_field(times[kept], field[kept])
    late = found.reference_time - times.mean()
    assert abs(found.frequency - (31.0 - 0.1 * late)) < 5 * found.u_frequency


def test_columns_of_unlike_length_or_order_are_refused(fresh):
    times, field = synthetic_field(fresh)
    with pytest.raises(ShapesDiffer):
        spin_of_field(times[:-1], field)
    with pytest.raises(TimesNotIncreasing):
        spin_of_field(times[::-1], field)
    with pytest.raises(TooFewReadings):
        spin_of_field(times[:20], field[:20])
