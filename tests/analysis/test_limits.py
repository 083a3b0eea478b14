"""Limits: the published numbers, a fall's uncertainty against many drawn falls, Grubbs's own table."""

import math

import numpy as np
import pytest
from scipy import stats

from analysis.errors import NotPositive, TooFewReadings
from analysis.limits import Sample, combine, compare, outliers_of, spin_at_fall, spin_at_loss, summarize

THESIS = np.array([21.7, 21.4, 21.7, 21.9, 21.8, 22.3, 21.8, 22.0, 22.1, 21.9])


def test_an_error_that_all_limits_share_stays_in_the_mean_of_a_run_and_of_runs():
    """Of 400 means; √n would make u a third of the scatter."""
    random, pulls = np.random.default_rng(4), []
    for _ in range(400):
        common = 0.5 * random.standard_normal()
        samples = [
            Sample(68.0 + common + 0.3 * random.standard_normal(5), np.full(5, 0.6), common=np.full(5, 0.5))
            for _ in range(2)
        ]
        pulls.append([(mean.value - 68.0) / mean.u for mean in (summarize(samples[0]).mean, combine(samples).mean)])
    assert np.std(pulls, axis=0) == pytest.approx(1, abs=0.12)  # 3 standard errors of 400
    single = combine([Sample(np.array([x]), np.array([0.6]), common=np.array([0.5])) for x in (67.8, 68.2)])
    assert single.mean.u == pytest.approx(math.sqrt(0.5**2 + (0.6**2 - 0.5**2) / 2))


def test_the_published_limits_have_the_published_statistics():
    found = summarize(Sample(THESIS))
    assert found.scatter.value == pytest.approx(0.25, abs=0.005)
    assert (found.mean.value, found.mean.u) == pytest.approx((21.86, 0.08), abs=0.005)
    assert found.outliers == ()
    assert not found.drifts


def test_the_uncertainty_of_a_loss_on_the_way_up_is_its_scatter():
    """400 tops that gain 0.4 Hz/s less drag, which doubles on the way; a line through the counts would be 3 u high."""
    random, pulls = np.random.default_rng(2), []
    fine = np.arange(0.0, 120.0, 0.05)
    spins = [30.0]
    for _ in fine[1:]:
        spins.append(spins[-1] + 0.05 * (0.4 - 0.12 * (spins[-1] / 30) ** 1.5))
    for _ in range(400):
        lost = random.uniform(40, 100)
        times = np.arange(random.uniform(0, 0.5), lost, 0.5)
        counts = np.interp(times, fine, spins) + 0.06 * random.standard_normal(times.size)
        found = spin_at_loss(times, counts, (float(times[-1]), float(times[-1]) + 0.5))
        pulls.append((found.value - np.interp(lost, fine, spins)) / found.u)
    assert abs(np.mean(pulls)) < 0.15  # 3 standard errors of 400
    assert np.std(pulls) == pytest.approx(1, abs=0.12)


def test_the_uncertainty_of_a_fall_is_its_scatter():
    """400 tops slowed by the disc law, read each 2 s with 0.06 Hz of noise, falling at any moment between two looks."""
    random, pulls = np.random.default_rng(1), []
    start, c = 2 * math.pi * 24.0, 2.34e-4
    for _ in range(400):
        fall_hz = 21.86 + 0.25 * random.standard_normal()
        falls = 2 / c * ((2 * math.pi * fall_hz) ** -0.5 - start**-0.5)
        times = np.arange(random.uniform(0, 2), falls, 2.0)
        spins = (start**-0.5 + c * times / 2) ** -2 / (2 * math.pi) + 0.06 * random.standard_normal(times.size)
        found = spin_at_fall(times, spins, 0.06, (float(times[-1]), float(times[-1]) + 2.0))
        pulls.append((found.value - fall_hz) / found.u)
    assert np.mean(pulls) == pytest.approx(0, abs=0.15)  # 3 standard errors of the mean of 400
    assert np.std(pulls) == pytest.approx(1, abs=0.12)  # 3 of a standard deviation


@pytest.mark.parametrize("law", ["stokes", "newton"])
def test_the_uncertainty_of_a_fall_holds_the_law_of_the_drag(law):
    times, rate = np.array([-25.0, -15.0, -5.0]), 2.9e-3  # a phone's windows; loss a second
    spins = 22 * (np.exp(-rate * times) if law == "stokes" else 1 / (1 + rate * times))
    found = spin_at_fall(times, spins, 1e-9, (0.0, 0.0))
    # ends of an even distribution lie √3 u off; the spin changes by 7 % meanwhile, and with it the bend
    assert abs(found.value - 22) == pytest.approx(math.sqrt(3) * (found.u or 0.0), rel=0.15)


@pytest.mark.parametrize(("n", "critical"), [(5, 1.764), (10, 2.482), (20, 3.001)])
def test_outliers_are_those_of_grubbs_table(n, critical):
    """Two-sided, 1 %: the printed critical value, a hundredth less and a hundredth more."""

    def with_deviation(wanted):
        rest = np.linspace(-1, 1, n - 1)
        low, high = 1.0, 1e6
        for _ in range(200):
            middle = math.sqrt(low * high)
            values = np.append(rest, middle)
            deviation = (values[-1] - values.mean()) / values.std(ddof=1)
            low, high = (middle, high) if deviation < wanted else (low, middle)
        return np.append(rest, high) + 100

    assert outliers_of(with_deviation(critical - 0.01)) == ()
    assert outliers_of(with_deviation(critical + 0.01)) == (n - 1,)


@pytest.mark.parametrize("scatter", [0.0, 0.02, 0.05, 0.1, 0.4])
def test_the_standard_error_holds_the_steps_of_the_drive(scatter):
    """Eight tops, steps of 0.2 Hz, true limits anywhere in a step: u predicts how far the mean is from the truth."""
    random, pulls, naive = np.random.default_rng(7), [], []
    for _ in range(400):
        truth = 67.0 + random.uniform(0, 0.2)
        limits = truth + scatter * random.standard_normal(8)
        seen = (np.floor(limits / 0.2) + 0.5) * 0.2
        found = summarize(Sample(seen, np.full(8, 0.2 / math.sqrt(12)), np.full(8, 0.2)))
        pulls.append((found.mean.value - truth) / found.mean.u)
        naive.append(abs(found.mean.value - truth) > 2 * seen.std(ddof=1) / math.sqrt(8))
    # 3 standard errors of a standard deviation of 400, and what a scatter of 8 adds (Student's t: 1.18);
    # where the tops just leave a step, u is on the safe side
    assert 0.75 < np.sqrt(np.mean(np.square(pulls))) < 1.18 + 0.12
    if scatter < 0.05:
        assert np.mean(naive) > 0.5  # s/√n alone is far too small


def test_a_mean_of_runs_holds_the_scatter_between_them():
    """Four runs of five tops, which differ by 0.5 Hz from day to day and by 0.25 Hz from top to top."""
    random, wrong, pooled, betweens = np.random.default_rng(3), 0, 0, []
    for _ in range(400):
        runs = [67.0 + 0.5 * random.standard_normal() + 0.25 * random.standard_normal(5) for _ in range(4)]
        found = combine([Sample(run) for run in runs])
        wrong += not compare(found, "truth", 67.0).agrees
        pooled += not compare(summarize(Sample(np.concatenate(runs))), "truth", 67.0).agrees
        betweens.append(found.between.value)
    assert wrong / 400 == pytest.approx(0.05, abs=0.033)  # 3 standard errors
    assert pooled / 400 > 0.2  # as one sample of 20 they are not
    assert np.sqrt(np.mean(np.square(betweens))) == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(("runs", "most"), [(4, 2.5), (16, 1.0)])
@pytest.mark.parametrize("between", [0.0, 0.05, 0.2])
def test_u_of_the_scatter_between_runs_covers_it_where_it_is_zero_too(runs, most, between):
    """Runs of ten tops with 0.25 Hz from top to top, which gives their means 0.08 Hz.

    In these sets u is at most 2.2 times the scatter of the means with 4 runs, and 0.9 times with 16.
    """
    random, near, within = np.random.default_rng(5), 0, 0
    for _ in range(300):
        means = 22.0 + between * random.standard_normal(runs)
        found = combine([Sample(mean + 0.25 * random.standard_normal(10)) for mean in means]).between
        assert 0.01 < found.u < most * math.hypot(0.08, between)
        near += abs(found.value - between) <= found.u
        within += abs(found.value - between) <= 2 * found.u
    assert near >= 300 * 0.68 - 24  # 3 standard errors
    assert within >= 300 * 0.87  # with u the farther side of a skewed interval


def test_u_of_the_scatter_between_runs_is_continuous_where_their_means_are_equal():
    """Four runs of ten tops: with 3 degrees of freedom χ² is beyond 0.835 in 84 %."""
    tops = 0.25 * np.random.default_rng(6).standard_normal(10)
    equal, near = (combine([Sample(67.0 + tops + apart * k) for k in (0, 1, 2, 4)]).between for apart in (0.0, 1e-9))
    assert equal.value == near.value == 0
    expected = tops.std(ddof=1) / math.sqrt(10) * math.sqrt(3 / stats.chi2.ppf(stats.norm.sf(1), 3) - 1)
    assert equal.u == pytest.approx(expected, rel=1e-9)
    assert near.u == pytest.approx(expected, rel=1e-4)


def test_runs_that_agree_are_as_good_as_one():
    random = np.random.default_rng(4)
    ratios = []
    for _ in range(100):
        values = 67.0 + 0.25 * random.standard_normal(20)
        found, whole = combine([Sample(part) for part in np.split(values, [4, 9])]), summarize(Sample(values))
        ratios.append(found.mean.u / whole.mean.u)
    assert np.median(ratios) == pytest.approx(1, abs=0.15)  # three runs tell their own scatter to half of it


def test_runs_of_a_single_top_are_one_sample():
    found = combine([Sample(THESIS[k : k + 1]) for k in range(10)])
    assert found.mean == summarize(Sample(THESIS)).mean
    assert (found.runs, found.between, found.trend) == (10, None, None)


def test_limits_that_go_down_top_by_top_drift():
    limits = 22.0 - 0.1 * np.arange(8) + np.array([0.01, -0.02, 0.02, 0.0, -0.01, 0.01, -0.02, 0.01])
    found = summarize(Sample(limits))
    assert found.drifts
    assert found.trend.value == pytest.approx(-0.1, abs=0.01)


@pytest.mark.parametrize("first", [0.1, 21.3, 60.0, 21.86])
def test_an_even_series_has_a_trend_without_rounding_noise(first):
    found = summarize(Sample(first + 0.1 * np.arange(10)))
    assert found.trend.value == pytest.approx(0.1, rel=1e-12)
    assert (found.trend.u, found.trend_p, found.outliers) == (0.0, 0.0, ())


@pytest.mark.parametrize("limit", [0.1, 21.86, 67.1])
def test_equal_limits_have_no_scatter_however_their_mean_is_rounded(limit):
    found = summarize(Sample(np.full(10, limit)))
    assert (found.mean.u, found.scatter.value, found.trend, found.outliers) == (0.0, 0.0, None, ())
    several = combine([Sample(np.full(10, limit)), Sample(np.full(7, limit))])
    assert (several.mean.u, several.scatter.value, several.between.value) == (0.0, 0.0, 0.0)
    apart = combine([Sample(np.full(10, limit)), Sample(np.full(7, limit + 0.1))])
    assert apart.between.value == pytest.approx(0.1 / math.sqrt(2))


def test_a_scatter_just_above_rounding_counts():
    random = np.random.default_rng(1)
    found = summarize(Sample(21.86 * (1 + 1e-12 * random.standard_normal(10))))
    assert found.scatter.value == pytest.approx(21.86e-12, rel=0.6)  # ten tell a scatter to a quarter


def test_a_mean_two_standard_errors_off_of_ten_is_no_chance_by_students_t():
    """Student's table: of 9 degrees of freedom 2.262 has 5 %."""
    found = summarize(Sample(THESIS))
    at = compare(found, "theory", found.mean.value - 2.262 * found.mean.u)
    assert at.p == pytest.approx(0.05, abs=2e-4)
    assert compare(found, "theory", found.mean.value + 2.2 * found.mean.u).agrees
    assert not compare(found, "theory", found.mean.value + 2.3 * found.mean.u).agrees


def test_one_limit_has_no_scatter_and_none_is_no_statistic():
    single = summarize(Sample(np.array([21.9]), np.array([0.05])))
    assert (single.mean.u, single.scatter) == (0.05, None)
    assert compare(single, "theory", 21.0).agrees is None
    with pytest.raises(TooFewReadings):
        summarize(Sample(np.array([])))
    with pytest.raises(NotPositive):
        summarize(Sample(np.array([21.9, -1.0])))
    with pytest.raises(TooFewReadings):
        spin_at_fall(np.arange(2.0), np.array([23.0, 22.9]), 0.03, (1.0, 2.0))
