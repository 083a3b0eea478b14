"""Spin frequency of traces, against the Cramér–Rao bound; hard traces; traps."""

import numpy as np
import pytest

from analysis.errors import NotPositive, ShapesDiffer, TimesNotIncreasing
from analysis.pulses import Finding, spin_of_trace
from analysis.pulses.clean import clean
from analysis.pulses.errors import OnlyHum, TooFewPulses
from analysis.pulses.regression import fit_turns
from analysis.pulses.search import shorten
from analysis.pulses.synthetic import DURATION, DUTY, HARD, RATE, Case, bound, make
from analysis.pulses.trace import Trace, _without_trap

SIGMA = DUTY / np.sqrt(8 * np.log(2))
TIME = np.arange(round(4 * RATE)) / RATE
PHASE = 0.2 + 30 * TIME - 0.05 * TIME**2


def light(phase, at=0.5):
    away = phase - at
    return np.exp(-0.5 * ((away - np.rint(away)) / SIGMA) ** 2)


def noise(sigma=0.1, seed=1):
    return sigma * np.random.default_rng(seed).standard_normal(TIME.size)


def names(found):
    return {note.name for note in found.notes}


def estimates(case, trials, seed, method="auto"):
    """Errors [Hz], uncertainties [Hz], stated bounds [Hz]."""
    random, rows = np.random.default_rng(seed), []
    for _ in range(trials):
        trace = make(case, random)
        found = spin_of_trace(trace.samples, RATE, method=method, degree=2)  # the slope stays
        error = found.frequency.value - trace.truth(found.reference_time)
        rows.append((error, found.frequency.u, found.bound))
    return np.array(rows).T


def test_the_bound_is_the_one_of_physics_and_of_fisher_information():
    assert bound(20) == pytest.approx(9.29e-6, rel=1e-3)  # the example of PHYSICS §5
    time = np.arange(round(RATE * DURATION)) / RATE - DURATION / 2

    def model(frequency, chirp, phase):
        return light(phase + frequency * time + 0.5 * chirp * time**2)

    step = np.array([1e-5, 1e-6, 1e-5])
    slopes = [(model(*(at + e)) - model(*(at - e))) / (2 * e.sum()) for e in np.diag(step) for at in [(30, -0.1, 0.3)]]
    covariance = 0.1**2 * np.linalg.inv(np.array(slopes) @ np.array(slopes).T)
    # the turns of 10 s are 300: their places in it, and the slope, make 1 part in 300 of the form with an integral
    assert np.sqrt(covariance[0, 0]) == pytest.approx(bound(20), rel=0.01)


@pytest.mark.parametrize(
    ("method", "snr", "ratio"), [("auto", 5, 1.1), ("auto", 40, 1.1), ("likelihood", 0, 1.1), ("edges", 10, 1.25)]
)
def test_the_error_stays_near_the_bound(method, snr, ratio):
    errors, _, stated = estimates(Case(snr=snr), 12, [7, snr], method)
    # three standard errors of a root mean square from 12 trials are 61 %; docs/pulses.md has 400 trials
    assert np.sqrt(np.mean(errors**2)) < ratio * 1.61 * bound(snr)
    assert np.abs(errors).max() < 10 * bound(snr)
    assert np.mean(stated) == pytest.approx(bound(snr), rel=0.12)  # the fast method learns no pulse shape


def test_hard_traces_are_stood_and_their_uncertainties_hold():
    pulls = []
    for i, (name, case) in enumerate(HARD.items()):
        if not case.bounces:
            errors, u, _ = estimates(case, 2, [8, i])
            assert np.abs(errors / u).max() < 10, name
            pulls += list(errors / u)
    assert np.mean(np.abs(pulls) < 1) == pytest.approx(0.683, abs=0.21)  # 3 standard errors from 46
    assert np.std(pulls) == pytest.approx(1, abs=0.31)  # likewise


def test_what_disturbs_is_named():
    wanted = {
        "40 % of the pulses missing": "missing", "hum, 1.0 at 50 Hz": "hum", "wandering baseline": "wander",
        "clipped at half height": "clipped", "a gap of 20 %": "gap", "NaN samples": "not-finite",
    }  # fmt: skip
    for name, finding in wanted.items():
        found = spin_of_trace(make(HARD[name], np.random.default_rng(9)).samples, RATE)
        assert finding in names(found), name
        assert found.method == "matched"
    clean = spin_of_trace(make(HARD["none of them"], np.random.default_rng(9)).samples, RATE)
    assert clean.notes == ()


def test_a_weak_trace_with_most_pulses_missing_falls_back_and_says_so():
    there = np.random.default_rng(2).uniform(size=130) < 0.35
    samples = light(PHASE) * there[np.floor(PHASE).astype(int)] + noise(0.2)
    found = spin_of_trace(samples, RATE)
    assert found.method == "likelihood"
    assert found.notes[0].name == "fell-back"
    assert abs(found.frequency.value - (30 - 0.1 * found.reference_time)) < 5 * found.frequency.u


@pytest.mark.parametrize("method", ["auto", "likelihood"])
def test_two_unlike_marks_are_no_double_frequency(method):
    higher = spin_of_trace(light(PHASE) + 0.6 * light(PHASE, 0.0) + noise(), RATE, method=method)
    beside = spin_of_trace(light(PHASE) + light(PHASE, 0.03) + noise(), RATE, method=method)
    assert higher.frequency.value == pytest.approx(29.8, abs=0.01)
    assert beside.frequency.value == pytest.approx(29.8, abs=0.01)
    if method == "auto":
        assert "double" in names(higher)
        assert "double" in names(beside)


def test_what_runs_with_the_mains_or_too_fast_for_a_hand_is_named_and_hum_is_no_top():
    locked = spin_of_trace(light(50 * TIME) + noise(), RATE)
    assert locked.frequency.value == pytest.approx(50, abs=1e-4)
    assert names(locked) & {"mains", "fast"} == {"mains"}
    assert "fast" in names(spin_of_trace(light(39.4 * TIME) + light(39.4 * TIME + 0.5) + noise(), RATE))
    with pytest.raises(OnlyHum, match="hum of the mains"):
        spin_of_trace(np.sin(2 * np.pi * 50 * TIME) + noise(), RATE)


def test_two_equal_marks_that_are_not_opposite_are_one_top():
    found = spin_of_trace(light(PHASE) + light(PHASE, 0.1) + noise(), RATE)
    assert found.frequency.value == pytest.approx(29.8, abs=0.01)
    assert Finding("double", "place") in found.notes
    opposite = spin_of_trace(light(PHASE) + light(PHASE, 0.0) + noise(), RATE)
    assert opposite.frequency.value == pytest.approx(59.6, abs=0.02)  # nothing in the trace tells it from one mark
    assert opposite.notes == ()


@pytest.mark.parametrize("apart", [0.3, 1 / 3, 0.35])
@pytest.mark.parametrize("method", ["auto", "edges"])
def test_two_marks_a_third_of_a_turn_apart_are_no_top_of_three_times_the_spin(apart, method):
    found = spin_of_trace(light(PHASE) + 0.6 * light(PHASE, 0.5 + apart) + noise(), RATE, method=method)
    assert found.frequency.value == pytest.approx(29.8, abs=0.01)
    assert found.missing == 0


def test_a_dozen_pulses_that_miss_a_third_of_the_turns_by_chance_are_no_two_marks():
    seen = np.isin(np.floor(30 * TIME), [1, 2, 5, 8, 10, 11, 14, 16, 20, 23, 26, 29])
    samples = (seen * light(30 * TIME) + noise(0.02))[: round(RATE)]
    assert spin_of_trace(samples, RATE, method="edges").frequency.value == pytest.approx(30, abs=0.05)


@pytest.mark.parametrize("part", [0.5, 0.25])
def test_half_the_frequency_of_a_weak_trace_is_seen_and_named(part):
    """A phase that starts at half or a quarter of the frequency, as a weak trace with missing pulses can have it."""
    samples = light(PHASE) + noise(0.3)
    trace = Trace(clean(samples, RATE, shorten(samples, 8), None), RATE)
    fit = fit_turns(TIME[::400], part * PHASE[::400])
    found, notes = _without_trap(trace, trace.match(fit))
    assert found.fit.frequency(np.array([2.0]))[0] == pytest.approx(29.8, abs=0.001)
    assert notes == (Finding("half"),)


@pytest.mark.parametrize(("spin", "reflection"), [(29.935, 0.6), (20.0, 0.6), (24.99, 0.0), (33.333, 0.6)])
@pytest.mark.parametrize("method", ["auto", "edges"])
def test_the_pulses_own_harmonics_are_no_hum(spin, reflection, method):
    turns = spin * TIME  # held: 4 or 5 times the spin is a multiple of the mains, or nearly
    samples = light(turns) + reflection * light(turns, 0.6) + noise()
    found = spin_of_trace(samples, RATE, method=method)
    assert "hum" not in names(found)
    assert abs(found.frequency.value - spin) < 5 * found.frequency.u
    hum = spin_of_trace(samples + 0.3 * np.sin(2 * np.pi * 100 * TIME + 1), RATE, method=method)
    assert next(note.values[0] for note in hum.notes if note.name == "hum") == pytest.approx(100, abs=0.1)
    assert abs(hum.frequency.value - spin) < 5 * hum.frequency.u


@pytest.mark.parametrize("spin", [15.174, 20.152, 16.85])
def test_a_line_beside_a_multiple_of_the_mains_is_no_hum(spin):
    turns = (spin * TIME)[:10_000]  # 2 s: 8, 3 and 3 times the spin lie 0.5 to 1.4 Hz beside one
    samples = light(turns) + 0.6 * light(turns, 0.1) + noise()[: turns.size]
    assert "hum" not in names(spin_of_trace(samples, RATE))


def coil(spin, rate, seed, duration=2.0):
    """Sound of a coil with hum; frequency in the middle."""
    random = np.random.default_rng(seed)
    away = np.arange(round(duration * rate)) / rate - duration / 2
    turns = 2 * np.pi * (spin * away - 0.05 * away**2 + random.uniform())
    hum = 0.05 * np.sin(2 * np.pi * 50.01 * away + random.uniform(0, 6))
    return 0.3 * np.sin(turns) + 0.05 * np.sin(2 * turns + 1) + hum + 0.02 * random.standard_normal(away.size)


def test_a_spin_beside_the_mains_that_is_taken_off_as_hum_is_a_doubt():
    for spin, own in ((49.8, True), (49.0, False), (33.3, False)):
        notes = spin_of_trace(coil(spin, 8000.0, 1), 8000.0).notes
        assert (("hum", "spin") in {(note.name, note.of) for note in notes}) == own


@pytest.mark.parametrize("spin", [16.6, 24.8, 24.9, 25.2])
@pytest.mark.parametrize("duration", [1.0, 2.0])
def test_hum_beside_a_harmonic_of_the_spin_does_not_move_it(spin, duration):
    pulls = []
    for seed in range(12):
        found = spin_of_trace(coil(spin, RATE, seed, duration), RATE).at(duration / 2)
        pulls.append((found.value - spin) / found.u)
    assert np.sqrt(np.mean(np.square(pulls))) < 1.61  # 3 standard errors of it from 12


def test_hum_at_three_halves_of_the_spin_makes_no_second_mark():
    for spin in (32.9, 33.1, 33.3, 33.5):  # at 32.9 Hz what is left of hum turns against the half spin
        for seed in range(4):
            assert spin_of_trace(coil(spin, 8000, seed), 8000).frequency.value == pytest.approx(spin, abs=0.01)


@pytest.mark.parametrize(("size", "of"), [(0.2, "harmonic"), (1.0, "spin")])
def test_a_line_at_a_harmonic_of_the_spin_may_be_that_harmonic_or_the_spin(size, of):
    samples = light(50.02 * TIME) + size * np.sin(2 * np.pi * 50.02 * TIME)
    assert of in {note.of for note in spin_of_trace(samples + noise(), RATE).notes if note.name == "hum"}


def test_a_trace_without_noise_holds_no_hum_and_no_wandering_baseline():
    for spin in (29.4, 99.9, 100.39):
        found = spin_of_trace(light(spin * TIME), RATE)
        assert found.frequency.value == pytest.approx(spin, abs=1e-5)
        assert not {"hum", "wander"} & names(found)


@pytest.mark.parametrize("method", ["auto", "edges"])
@pytest.mark.parametrize("spin", [20.0, 25.0, 29.8507, 31.25])
def test_flanks_between_samples_are_in_the_uncertainty(spin, method):
    """Turns of a whole number of samples, or nearly: roundings do not average out, and no residual shows them."""
    for part in (1e-6, 3e-6, 1e-5, 3e-5):  # of the frequency beside it: 0.08 to 2.4 samples in four seconds
        turns = spin * (1 + part) * TIME
        # with 0.015 flanks would lie on a sample, and the last bit of a product would put them on either side
        samples = np.where(np.abs(turns % 1 - 0.5) < 0.0151, 1.0, 0.0)
        found = spin_of_trace(samples, RATE, method=method)
        assert abs(found.frequency.value - spin * (1 + part)) < 4 * found.frequency.u
        # one sample more or less in all of the record; a little more where roundings look like a third degree
        assert found.frequency.u < 1.1 * spin / (TIME[-1] * RATE)


def test_pulses_of_three_samples_that_show_their_flanks_have_no_u_of_whole_samples():
    """A sample is the mean light of its interval, and shows where in it a flank lies: u was 28 times the scatter."""
    random, errors, rate = np.random.default_rng(20261128), [], 1000
    time = np.arange(2 * rate) / rate
    for _ in range(80):
        spin = random.uniform(29, 31)
        away = ((spin * time + random.uniform()) % 1 - 0.5) * rate / spin  # [samples]
        samples = np.clip(2.0 - np.abs(away), 0, 1) + 0.01 * random.standard_normal(time.size)
        found = spin_of_trace(samples, rate, degree=2).frequency
        errors.append((found.value - spin, found.u))
    error, u = np.array(errors).T
    assert np.median(u) < 3 * 1.4826 * np.median(np.abs(error))  # 2.0; at turns of nearly whole samples 28 are right
    assert np.std(error / u) < 1.24  # three standard errors


@pytest.mark.parametrize("method", ["auto", "edges"])
@pytest.mark.parametrize("spin", [20.0, 25.0, 29.8507])
def test_few_sharp_pulses_without_noise_have_the_samples_in_their_uncertainty(spin, method):
    """A logic signal of 0.6 s: residuals of no size at all left a u of 1e-15 Hz beside an error of 1e-3 Hz.

    At 29.8507 Hz a turn has 167½ samples, and flanks lie on either side of a sample by turns: no second mark.
    """
    time, random, pulls = np.arange(3200) / 5000, np.random.default_rng(1), []
    for part in random.uniform(-2e-4, 2e-4, 25):
        turns = spin * (1 + part) * time
        samples = np.where(np.abs(turns % 1 - 0.5) < 0.0151, 1.0, 0.0)
        found = spin_of_trace(samples, 5000, method=method)
        pulls.append((found.frequency.value - spin * (1 + part)) / found.frequency.u)
    assert np.std(pulls) < 1.4  # 1, its standard error 0.14; a drift without a jump may be any: often less
    assert np.std(pulls) > 0.3


@pytest.mark.parametrize("shape", ["half a turn", "sine", "dark", "logic"])
def test_pulses_of_any_shape(shape):
    samples = {
        "half a turn": (PHASE % 1 < 0.5) + noise(0.01),
        "sine": np.sin(2 * np.pi * PHASE) + noise(),
        "dark": 1 - light(PHASE) + noise(),
        "logic": (light(PHASE) > 0.5).astype(np.uint8),
    }[shape]
    found = spin_of_trace(samples, RATE)
    assert abs(found.frequency.value - (30 - 0.1 * found.reference_time)) < 6 * max(found.frequency.u, 1e-5)


def test_the_start_moves_the_reference_time_alone():
    samples = light(PHASE) + noise()
    a, b = spin_of_trace(samples, RATE), spin_of_trace(samples, RATE, start=100.0)
    assert b.reference_time == a.reference_time + 100
    assert (a.frequency, a.chirp, a.phase) == (b.frequency, b.chirp, b.phase)
    assert a.at(a.reference_time + 1).value == pytest.approx(a.frequency.value + a.chirp.value + a.bend.value / 2)
    assert a.snr_db == pytest.approx(20, abs=0.5)


@pytest.mark.parametrize("rate", [60.0, 100.0, 101.0, 430.0])
def test_slow_records_have_a_frequency(rate):
    """As of a phone's magnetometer: multiples of the mains lie beyond half the rate."""
    time = np.arange(int(12 * rate)) / rate
    samples = np.exp(1.5 * np.cos(2 * np.pi * 7.3 * time)) + noise(0.05)[: time.size]
    found = spin_of_trace(samples, rate)
    assert abs(found.frequency.value - 7.3) < 4 * found.frequency.u
    assert found.frequency.u < 2e-3
    assert ("coarse" in names(found)) == (rate < 12 * 7.3)


@pytest.mark.parametrize("sigma", [0.02, 0.3])
def test_a_lost_or_repeated_buffer_is_found_and_costs_no_truth(sigma):
    """Records of 10 s of a sound card; a fit without the jump is off by 4 to 60 mHz."""
    rate, pulls, places = 8000.0, [], []
    time, random = np.arange(round(10.1 * rate)) / rate, np.random.default_rng(1)
    for lost in 4 * [-0.01, -0.002, 0.002, 0.005, 0.01]:
        spin, at = random.uniform(25, 34), random.uniform(0.8, 9.2)
        samples = light(spin * time - 0.05 * time**2 + random.uniform()) + random.normal(0, sigma, time.size)
        cut, many = round(at * rate), round(abs(lost) * rate)
        rest = samples[cut + many :] if lost > 0 else samples[cut - many :]
        found = spin_of_trace(np.concatenate([samples[:cut], rest])[: round(10 * rate)], rate)
        pulls.append((found.frequency.value - spin + 0.1 * found.reference_time) / found.frequency.u)
        assert "jump" in names(found)
        assert abs(found.jump.lost - lost) < 5 * found.jump.u
        places.append(found.jump.at - at)
    assert np.abs(places).max() < 0.05  # a turn and a half
    assert np.mean(pulls) == pytest.approx(0, abs=0.67)  # 3 standard errors
    assert np.std(pulls) < 1.47  # likewise


def test_traces_without_pulses_are_refused():
    for samples in (np.zeros(5000), noise(), np.full(5000, np.nan), np.zeros(3)):
        with pytest.raises(TooFewPulses):
            spin_of_trace(samples, RATE)
    with pytest.raises(NotPositive, match="sample rate"):
        spin_of_trace(noise(), 0.0)
    with pytest.raises(ShapesDiffer):
        spin_of_trace(np.zeros((100, 2)), RATE)


@pytest.mark.parametrize("method", ["auto", "edges", "matched", "likelihood"])
@pytest.mark.parametrize("level", [0.0, 0.1, 10 * 0.01])
def test_a_constant_trace_has_no_pulses_however_its_sums_are_rounded(level, method):
    with pytest.raises(TooFewPulses, match=r"0 pulses in 0\.4 s"):
        spin_of_trace(np.full(1600, level), 4000, method=method)


@pytest.mark.parametrize("method", ["auto", "edges", "matched", "likelihood"])
@pytest.mark.parametrize("scatter", [0.01, 0.0212])
def test_the_scatter_of_a_wobbling_tops_pulses_is_in_the_uncertainty(scatter, method):
    """Records of 0.6 s: the mean pulse of 15 to 18 turns fits each of them where it happens to be."""
    rate, pulls = 10_000.0, []
    time = np.arange(6000) / rate - 0.3
    for seed in range(60, 100):
        random = np.random.default_rng(seed)
        spin, phase = random.uniform(23, 30), random.uniform(0, 1)
        turns = phase + spin * time - 0.08 * time**2 / 2
        late = random.normal(0, scatter, 40)[np.floor(turns).astype(int) + 20]
        found = spin_of_trace(light(turns - late) + random.normal(0, 0.01, time.size), rate, method=method)
        pulls.append((found.frequency.value - spin + 0.08 * (found.reference_time - 0.3)) / found.frequency.u)
        assert method in {"auto", found.method}
    assert np.std(pulls) < 1.35  # 1, and 3 standard errors from 40; 1.8 and more by the mean pulse
    assert np.max(np.abs(pulls)) < 6


def test_few_pulses_that_scatter_are_no_two_marks_by_chance():
    """Seventeen turns: every second one's mean profile differs from the others' as their places do."""
    time = np.arange(6000) / 10_000
    for seed in range(120, 130):  # 124 took every second pulse for a mark of its own
        random = np.random.default_rng(seed)
        late = random.normal(0, 0.01, 20)[np.floor(29.6 * time + 0.3).astype(int)]
        found = spin_of_trace(light(29.6 * time + 0.3 - late) + random.normal(0, 0.01, time.size), 10_000)
        assert found.frequency.value == pytest.approx(29.6, abs=0.2)


@pytest.mark.parametrize(("seed", "number"), [((2026, 123), 10), ((21, 23), 40)])
def test_hum_that_was_cut_off_with_the_pulses_is_not_the_top(seed, number):
    """Trials of "all together": clipped hum was numbered as pulses, and pulses with their reflection."""
    random = np.random.default_rng(seed)
    for _ in range(number + 1):
        trace = make(HARD["all together"], random)
    found = spin_of_trace(trace.samples, RATE, degree=2)
    assert abs(found.frequency.value - trace.truth(found.reference_time)) < 5 * found.frequency.u
    assert found.frequency.u < 5e-5


@pytest.mark.parametrize(
    ("rate", "hum", "gap", "method"),
    [(1000, 0.0, 0.0, "auto"), (1000, 0.0, 0.0, "edges"), (2000, 0.4, 0.2, "auto"), (20_000, 0.0, 0.1, "auto")],
)
def test_samples_at_uneven_times_are_taken_at_the_times_given(rate, hum, gap, method):
    pulls, even = [], []
    for seed in range(12):
        random = np.random.default_rng([11, seed])
        time = (np.arange(5 * rate) + random.uniform(-0.4, 0.4, 5 * rate)) / rate
        time = 100 + np.delete(time, slice(2 * rate, int((2 + 5 * gap) * rate)))
        turns = 30 * (time - 102.5) - 0.05 * (time - 102.5) ** 2 + random.uniform()
        away = turns - np.rint(turns)
        samples = np.exp(-0.5 * (away / (2 * SIGMA)) ** 2) + hum * np.sin(2 * np.pi * 50 * time)
        samples += 0.05 * random.standard_normal(time.size)
        found = spin_of_trace(samples, rate, times=time, method=method, degree=2)
        pulls.append((found.at(102.5).value - 30) / found.frequency.u)
        even.append(spin_of_trace(samples, rate, start=100, degree=2, method=method).at(102.5).value - 30)
        assert not {"jump", "fell-back"} & names(found)
    assert np.std(pulls) == pytest.approx(1, abs=0.65)  # 3 standard errors of a standard deviation from 12 are 0.61
    assert np.abs(np.mean(pulls)) < 1.0  # 3 of 0.29, and the hum's removal
    if gap:  # the gap taken for nothing puts the turns at wrong times
        assert np.abs(even).min() > 0.01


def test_times_of_samples_are_as_many_as_they_and_do_not_go_back():
    with pytest.raises(ShapesDiffer):
        spin_of_trace(light(PHASE), RATE, times=TIME[1:])
    with pytest.raises(TimesNotIncreasing):
        spin_of_trace(light(PHASE), RATE, times=TIME[::-1])


def test_a_pulse_whose_edges_lie_between_two_samples_is_not_missing():
    """Pulses of three samples at 33.7 Hz: about one in three has no sample on an edge."""
    times, random = np.arange(6000) / 1000.0, np.random.default_rng(0)
    turns = 33.7 * times + random.uniform()
    found = spin_of_trace(3.1 * (turns % 1 < 0.003 * 33.7) + random.normal(0, 0.05, times.size), 1000.0)
    assert found.frequency.value == pytest.approx(33.7, abs=3 * found.frequency.u)
    assert found.missing == 0
    assert not [note for note in found.notes if note.kind == "missing"]
