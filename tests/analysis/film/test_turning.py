"""Phase of a mark, and spin by the times of pictures: scatter, folds, and what a camera adds."""

import numpy as np
import pytest

from analysis.errors import TooFewReadings
from analysis.film.errors import NoMark
from analysis.film.mark import phases_of, without_pull
from analysis.film.turning import choices_of, spins_of_start, turning_of
from levilab.animation.camera import phone_times

NOISE = 1e-3  # of a phase [turns]


def seen(random, times, spin, chirp=0.0, more=0.0):
    """Phases of a top at some times."""
    return (0.3 + spin * times + 0.5 * chirp * times**2 + more + random.normal(0, NOISE, times.size)) % 1


def turning(times, phase, rows=0.0, aside=0.0):
    u = np.full(times.size, NOISE)
    (start, *_), _ = choices_of(spins_of_start(times, phase, u), None)
    return turning_of(times, phase, u, rows + 0 * times, aside + 0 * times, start=start)


def test_spin_and_slope_scatter_as_u_says():
    random = np.random.default_rng(11)
    times = phone_times(2.0)
    pulls = []
    for _ in range(100):
        spin, chirp = random.uniform(20, 60), random.uniform(-0.1, 0)
        found = turning(times, seen(random, times, spin, chirp))
        truth = spin + chirp * found.middle
        each = (found.spin - spin - chirp * found.time) / found.u
        pulls += [((found.frequency - truth) / found.u_frequency, (found.chirp - chirp) / found.u_chirp, each[0])]
    assert np.abs(np.mean(pulls, axis=0)).max() < 0.4  # 4 standard errors of a mean of 100
    assert np.std(pulls, axis=0) == pytest.approx([1, 1, 1], abs=0.3)  # 4 of a standard deviation


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("length", [0.8, 1.9, 2.1])
def test_the_bend_of_the_spin_by_drag_moves_no_spin_of_a_short_film(length, sense):
    times = phone_times(length)
    root = 35.0**-0.5 + 3.4e-4 * times  # of 1/spin, under the drag of a disc: 0.14 Hz/s
    phase, none = sense * -1 / (3.4e-4 * root) % 1, 0 * times
    found = turning_of(times, phase, none + NOISE, none, none, start=sense * 35)
    for time, spin, most in (  # a parabola through 1.9 s: 0.08, 0.02 and 0.32 mHz
        (found.middle, found.frequency, 1e-6),
        (found.time, found.spin, 1e-6),
        (times, found.smooth, 5e-6),
    ):
        assert sense * spin == pytest.approx(np.interp(time, times, root) ** -2, abs=most)
    assert found.u_frequency < 1.1 * NOISE * np.sqrt(12 / times.size) / length  # of a straight line


def swing(size, frequency):
    """Turns, and spin, of a top of 31 Hz whose spin swings by a size [Hz]."""
    rate = 2 * np.pi * frequency
    return lambda t: 31 * t - size / rate * np.cos(rate * t), lambda t: 31 + size * np.sin(rate * t)


@pytest.mark.parametrize(
    ("size", "frequency", "most_u"), [(0.3, 0.1, 0.48e-3), (0.02, 0.1, 0.14e-3), (0.3, 0.33, 1.5e-3)]
)
def test_u_of_a_driven_top_holds_its_swing(size, frequency, most_u):
    times, random = np.arange(0, 20, 1 / 60), np.random.default_rng(20)
    none, noise, (turns, spin) = 0 * times, random.normal(0, NOISE, times.size), swing(size, frequency)
    found = turning_of(times, (turns(times) + noise) % 1, none + NOISE, none, none, start=31.0)
    assert found.frequency == pytest.approx(spin(found.middle), abs=4 * found.u_frequency)
    assert found.u_frequency < most_u
    assert np.sqrt(np.mean(((found.spin - spin(found.time)) / found.u) ** 2)) < 1.6


@pytest.mark.parametrize("length", [10.0, 40.0])
@pytest.mark.parametrize("share", [0.5, 0.3])
def test_a_drive_that_is_switched_off_in_a_film_moves_neither_the_spin_nor_its_readings(length, share):
    times, pulls, of_readings = np.arange(0, length, 1 / 60), [], []
    after, fast, none = np.maximum(times - share * length, 0), 0.1 / 33.3, 0 * times  # 0.1 Hz/s of 33.3 Hz at first
    spin = 33.3 / (1 + 0.5 * fast * after) ** 2  # a drag in proportion to spin^1.5
    turns = 33.3 * (times - after + after / (1 + 0.5 * fast * after))
    for seed in range(4):
        noise = np.random.default_rng([25, seed]).normal(0, NOISE, times.size)
        found = turning_of(
            times, (turns + noise) % 1, none + NOISE, none, none, start=np.interp(length / 2, times, spin)
        )
        pulls.append((found.frequency - np.interp(found.middle, times, spin)) / found.u_frequency)
        of_readings += [*(found.spin - np.interp(found.time, times, spin)) / found.u]
        assert found.u_frequency < 0.6e-3
    assert np.sqrt(np.mean(np.square(pulls))) < 2.4  # 4 standard errors of 4; 4 to 63 without the kink
    assert np.abs(of_readings).max() < 4.5  # of up to 160; 5 to 30 without the kink


@pytest.mark.parametrize(("spin", "size"), [(30.0, 0.02), (29.99, 0.02), (29.99, 0.0)])
def test_the_swing_of_a_spin_of_half_an_even_rate_is_not_taken_for_a_harmonic(spin, size):
    times, random, pulls = np.arange(0, 20, 1 / 60), np.random.default_rng(24), []
    none, rate = 0 * times, 2 * np.pi * 0.1
    for start in np.arange(8.0):
        turns = spin * times - size / rate * np.cos(rate * times + start) + random.normal(0, NOISE, times.size)
        found = turning_of(times, turns % 1, none + NOISE, none, none, start=spin)
        pulls.append((found.frequency - spin - size * np.sin(rate * found.middle + start)) / found.u_frequency)
        assert found.u_frequency < 1e-3
    assert np.sqrt(np.mean(np.square(pulls))) < 2.1  # 4 standard errors of 8; 20 if noise is in the harmonics


def test_u_of_a_free_top_falls_with_the_length_without_a_step():
    u, random = [], np.random.default_rng(21)
    for length, rate in ((1.99, 240), (2.01, 240), (20, 60)):
        times = np.arange(0, length, 1 / rate)
        none, root = 0 * times, 35.0**-0.5 + 3.4e-4 * times
        phase = (random.normal(0, NOISE, times.size) - 1 / (3.4e-4 * root)) % 1
        middle = float(np.interp(length / 2, times, root)) ** -2
        u += [turning_of(times, phase, none + NOISE, none, none, start=middle).u_frequency]
    assert u[1] == pytest.approx(u[0], rel=0.2)
    assert u[2] < 2e-5


@pytest.mark.parametrize("sense", [1, -1])
def test_uneven_times_tell_a_spin_far_above_half_the_rate(sense):
    random = np.random.default_rng(12)
    times = np.arange(60) / 30 + random.uniform(-4e-3, 4e-3, 60)
    found = spins_of_start(times, seen(random, times, 47.0 * sense), np.full(60, NOISE))
    assert choices_of(found, None)[0] == [pytest.approx(47.0 * sense, abs=0.02)]


def test_even_times_leave_choices():
    random = np.random.default_rng(13)
    times = np.arange(120) / 60
    found = spins_of_start(times, seen(random, times, 25.0), np.full(times.size, NOISE))
    choices, slow = choices_of(found, None)
    assert sorted(choices) == [pytest.approx(-35.0, abs=0.02), pytest.approx(25.0, abs=0.02)]
    assert slow == []
    assert choices_of(found, 24.0)[0] == [pytest.approx(25.0, abs=0.02)]


def test_a_rolling_shutter_and_an_eccentric_mark_do_not_move_the_spin():
    random = np.random.default_rng(14)
    times, spin, line = phone_times(2.0), 31.3, 12e-6
    sway, angle = 10 * np.sin(2 * np.pi * 1.2 * times), 2 * np.pi * (0.3 + spin * times)
    rows = 120 + sway + 25 * np.sin(angle)
    more = spin * line * rows + 0.01 * np.cos(angle + 1) + 0.003 * np.cos(2 * angle)
    found = turning(times, seen(random, times, spin, more=more), rows)
    assert found.frequency == pytest.approx(spin, abs=4 * found.u_frequency)
    assert found.u_frequency < 1.5 * NOISE * np.sqrt(12 / times.size) / 2.0  # of a straight line through 2 s, nearly


def test_the_line_of_sight_of_a_camera_beside_the_top_moves_no_spin():
    random, times, found = np.random.default_rng(19), phone_times(2.0), []
    for nearness in np.linspace(1.0, 4.0, 60):  # of 0.25 to 1 m
        aside = 3e-3 * np.sin(2 * np.pi * (1.1 * times + random.uniform()))
        one = turning(times, seen(random, times, 31.0, more=-nearness * aside / (2 * np.pi)), aside=aside)
        found.append((one.frequency - 31.0, one.u_frequency))
    off, u = np.array(found).T
    assert np.std(off / u) == pytest.approx(1, abs=0.37)  # 4 of its standard errors
    assert np.std(off) < 1.4 * NOISE * np.sqrt(12 / times.size) / 2.0  # of a straight line; 3.8 without the sight


def test_phases_without_a_turn_and_few_pictures_are_refused():
    random = np.random.default_rng(15)
    times = phone_times(1.0)
    with pytest.raises(NoMark, match="no mark turns with the top"):
        spins_of_start(times, random.uniform(size=times.size), np.full(times.size, NOISE))
    with pytest.raises(TooFewReadings):
        spins_of_start(times[:5], times[:5], times[:5])


def test_the_phase_of_a_mark_scatters_as_its_u_says():
    random = np.random.default_rng(16)
    truth = random.uniform(size=300)
    turn = np.arange(128) / 128
    away = (turn - truth[:, None] + 0.5) % 1 - 0.5
    smooth = random.normal(0, 8.0, (300, 3, 128))
    # rays are closer than pixels, so that neighbours agree
    noise = np.mean([np.roll(smooth, by, axis=2) for by in (-1, 0, 1)], axis=0)
    profiles = 90 + 30 * np.cos(2 * np.pi * turn) + 80 * np.exp(-((away / 0.04) ** 2))[:, None] + noise
    found = phases_of(profiles)
    off = (found.phase - truth + 0.5) % 1
    off -= np.median(off)
    assert np.std(off / found.u) == pytest.approx(1, abs=0.3)
    assert np.abs(off).max() < 0.01


def test_what_neighbouring_pictures_share_is_in_the_u_of_the_spin():
    random = np.random.default_rng(17)
    times, pulls = phone_times(2.0), []
    for _ in range(60):
        shared = np.repeat(random.normal(0, 1.5 * NOISE, times.size // 10), 10)
        found = turning(times, seen(random, times, 31.0, more=shared))
        pulls += [(found.frequency - 31.0) / found.u_frequency]
    assert np.std(pulls) < 1.6  # 1, and 6 of its standard errors; 2.3 to 2.7 if each picture counts alone


def test_what_comes_with_each_turn_averages_out_of_the_u_of_the_spin():
    random = np.random.default_rng(22)
    times, pulls = phone_times(2.0), []
    for _ in range(60):
        beside = 5 * NOISE * np.cos(2 * np.pi * (31.7 * times + random.uniform()))  # the eccentricity sways
        found = turning(times, seen(random, times, 31.0, more=beside))
        pulls += [((found.frequency - 31.0) / found.u_frequency, (found.spin[0] - 31.0) / found.u[0])]
    assert np.std(pulls, axis=0) == pytest.approx([1, 1], abs=0.37)  # 4 standard errors; 0.3 if each picture counts


def test_u_changes_evenly_with_the_spin_and_holds_the_scatter_of_short_films():
    random, none, u = np.random.default_rng(23), np.zeros(180), []
    noise, start = random.normal(0, NOISE, 180), random.uniform()
    for spin in (34.3, 34.4, 34.5, 34.6):  # 3.5 pictures in a turn
        times = np.arange(180) / 120
        turns = spin * times + 5 * NOISE * np.cos(2 * np.pi * ((spin + 0.7) * times + start)) + noise
        u.append(turning_of(times, turns % 1, none + NOISE, none, none, start=spin).u_frequency)
    assert u == pytest.approx([u[0]] * 4, rel=0.1)  # blocks of whole pictures jump by 0.4
    pulls, none = [], np.zeros(120)
    for _ in range(150):
        turns = 20 * np.arange(120) / 240 + random.normal(0, 3 * NOISE, 120)
        found = turning_of(np.arange(120) / 240, turns % 1, none + NOISE, none, none, start=20.0)
        pulls.append((found.frequency - 20) / found.u_frequency)
    assert np.mean(np.abs(pulls) < 2) > 0.92  # 0.95 less two standard errors


def test_a_mark_that_pulls_the_rim_is_taken_out_of_the_places():
    random = np.random.default_rng(18)
    times = phone_times(1.0)
    sway = 2 * np.exp(2j * np.pi * 1.1 * times) + 0.3 * np.exp(2j * np.pi * 8 * times)
    noise = random.normal(0, 0.03, times.size) + 1j * random.normal(0, 0.03, times.size)
    for spin, left in ((31.0, 0.01), (301.0, 0.2)):  # 301 Hz looks like 0.6 Hz, so that nothing is taken out
        turn = np.exp(2j * np.pi * (0.3 + spin * times))
        found = without_pull(sway + noise + 0.2 * turn, (0.3 + spin * times + random.normal(0, NOISE, times.size)) % 1)
        pull = np.vdot(turn, found - sway) / times.size
        assert abs(pull) == pytest.approx(left, abs=0.012)  # 4 standard errors of noise in 240 pictures
