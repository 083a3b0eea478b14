"""Which mass floats today: against closed forms, a hobbyist's numbers, and simulated owners."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from analysis import tuning
from analysis.tuning import Outcome, Prior, Trial, combinations, learn
from analysis.uncertainty import Estimate

G = 1e-3
#: A window of exactly 0.4 g about an unknown middle, at one temperature.
NARROW = Prior(23 * G, 27 * G, width=0.016, width_log_u=1e-4, per_k=-0.004, per_k_u=1e-6)
WASHERS = np.arange(0.0, 1.2, 0.06) * G


@pytest.fixture
def exact(monkeypatch):
    """No lapses, and edges that are sharp."""
    monkeypatch.setattr(tuning, "LAPSE", 0.0)
    monkeypatch.setattr(tuning, "TEMPERATURE_U", 0.0)


def middle(posterior, temperature=20.0):
    return posterior.values(temperature)["mass_to_set"]


@pytest.mark.usefixtures("exact")
def test_one_that_floats_leaves_the_middle_evenly_within_the_window():
    found = middle(learn([Trial(25 * G, 20.0, Outcome.FLOATS)], NARROW))
    # mass = middle (1 ± 0.008): a uniform distribution; 2 %: the grid's step against its width
    assert found.value == pytest.approx(25 * G, rel=1e-4)
    assert found.u == pytest.approx(0.016 * 25 * G / math.sqrt(12), rel=0.02)


@pytest.mark.usefixtures("exact")
def test_one_that_rises_cuts_a_scans_gaussian():
    prior = replace(NARROW, middle=Estimate(25 * G, 0.3 * G, "kg"))
    found = middle(learn([Trial(25 * G, 20.0, Outcome.RISES)], prior))
    # rises ⇔ middle (1 − 0.008) > mass: the mean and variance of a Gaussian above a bound
    z = (25 * G / 0.992 - 25 * G) / (0.3 * G)
    hazard = norm.pdf(z) / norm.sf(z)
    assert found.value == pytest.approx((25 + 0.3 * hazard) * G, rel=1e-4)
    assert found.u == pytest.approx(0.3 * G * math.sqrt(1 + z * hazard - hazard**2), rel=0.02)


def test_without_trials_the_scan_alone_says_it_at_its_temperature():
    prior = Prior.of_scan(Estimate(25 * G, 0.05 * G, "kg"), 24.7 * G, 25.3 * G, 20.0)
    warm = learn([], prior).values(30.0)
    assert warm["mass_to_set"].value == pytest.approx(25 * G * math.exp(-0.04), rel=1e-4)
    # 10 K times 0.1 %/K, and that of the scan
    assert warm["mass_to_set"].u == pytest.approx(math.hypot(24 * 0.01, 0.113) * G, rel=0.05)
    assert warm["relative_change"].u == pytest.approx(prior.per_k_u, rel=0.02)


def test_a_hobbyists_trials_over_21_kelvin_give_his_coefficient():
    """7 tops that floated, at −0.058 g/K about 22 g at 16 °C, and two 0.12 g too heavy and too light there."""
    trials = [Trial((22 - 0.058 * (t - 16)) * G, t, Outcome.FLOATS) for t in np.linspace(5, 26, 7)]
    trials += [Trial(22.12 * G, 16, Outcome.SINKS), Trial(21.88 * G, 16, Outcome.RISES)]
    posterior = learn(trials, Prior(20 * G, 24 * G))
    values = posterior.values(16.0)
    slope = values["mass_per_kelvin"]
    assert abs(slope.value + 0.058 * G) < slope.u
    assert slope.u < 0.01 * G  # the prior's is 0.022
    assert abs(values["mass_to_set"].value - 22 * G) < values["mass_to_set"].u
    (within,) = posterior.chances(np.array([22 * G]), 16.0)
    assert within > 0.85


def test_outcomes_are_probabilities_that_add_up():
    posterior = learn([Trial(25 * G, 20, Outcome.FLOATS)], Prior(24 * G, 26 * G))
    outcomes = posterior.outcomes(np.linspace(24, 26, 9) * G, 22.0)
    assert (outcomes >= 0).all()
    assert outcomes.sum(axis=0) == pytest.approx(1.0)
    mean = outcomes @ posterior.weight
    assert (np.diff(mean[0]) <= 0).all()  # a heavier one rises less
    assert (np.diff(mean[2]) >= 0).all()


def test_a_top_that_slides_sideways_says_nothing_of_its_mass():
    prior = Prior(24 * G, 26 * G)
    assert middle(learn([Trial(25 * G, 20, Outcome.SIDEWAYS)], prior)) == middle(learn([], prior))


def test_the_chance_by_others_is_that_of_a_posterior_without_the_trial():
    trials = [
        Trial(24.9 * G, 21, Outcome.SINKS),
        Trial(25.06 * G, 21, Outcome.RISES),
        Trial(25.2 * G, 23, Outcome.RISES),
    ]
    prior = Prior(24.5 * G, 26 * G)
    for k, one in enumerate(trials):
        others = learn([*trials[:k], *trials[k + 1 :]], prior)
        outcomes = others.outcomes(np.array([one.mass]), one.temperature)[:, 0] @ others.weight
        chance = outcomes[list(Outcome).index(one.outcome)]
        assert learn(trials, prior).chance_by_others(one) == pytest.approx(chance, rel=0.05)  # two grids


def test_the_promise_counts_the_best_trial_after_each_outcome():
    prior, masses = Prior(24.5 * G, 26 * G), np.linspace(24.6, 25.9, 7) * G
    posterior = learn([], prior)
    rises, floats, sinks = posterior.outcomes(masses[2:3], 20.0)[:, 0] @ posterior.weight
    after = [learn([Trial(masses[2], 20, one)], prior).chances(masses, 20.0) for one in (Outcome.RISES, Outcome.SINKS)]
    expected = 2 * floats + rises * after[0].max() + sinks * after[1].max()
    assert posterior.promise(masses, 20.0)[2] == pytest.approx(expected, rel=0.02)  # two grids


@pytest.mark.parametrize(("outcome", "sign"), [(Outcome.RISES, 1), (Outcome.SINKS, -1)])
def test_what_rises_is_made_heavier_and_what_sinks_lighter(outcome, sign):
    masses = 24.4 * G + WASHERS
    posterior = learn([Trial(25 * G, 20, outcome)], Prior(24 * G, 26 * G))
    assert sign * (masses[posterior.promise(masses, 20.0).argmax()] - 25 * G) > 0


def test_washers_combine_to_masses_that_a_balance_distinguishes():
    assert combinations([]) == [()]
    assert len(combinations([0.06e-3] * 6 + [0.2e-3] * 2)) == 21
    many = [1e-5 * 1.3**k for k in range(20)]  # 2^20 choices
    sums = [sum(one) for one in combinations(many)]
    assert len(sums) < 1002
    assert max(np.diff(sums)) < 3 * max(tuning.MASS_U, sum(many) / 1000)


# --- simulated owners ---


class Owner:
    """A base and a top that nature chose, a hand that errs, a thermometer that is off by a day's constant."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.top, self.span = 24.4 * G, 1.2 * G
        self.middle = self.top + self.rng.uniform(0.2, 1.0) * self.span
        self.width = min(math.exp(self.rng.normal(math.log(0.012), 0.7)), tuning.THEORY_WIDTH)
        self.per_k = self.rng.normal(-0.0036, 0.0009)

    def middle_at(self, temperature):
        return self.middle * math.exp(self.per_k * (temperature - 20))

    def lets_go(self, mass, temperature):
        middle = self.middle_at(temperature)
        if self.rng.random() < tuning.LAPSE:
            return Outcome.RISES
        if abs(mass / middle - 1) < self.width / 2:
            return Outcome.FLOATS
        return Outcome.RISES if mass < middle else Outcome.SINKS

    def days(self, temperatures, most=6):
        """Follow the proposals until the top floats, day after day.  Returns all trials, and the number of each day."""
        prior, trials, numbers = Prior(self.top * 0.99, self.top * 1.01 + self.span), list[Trial](), list[int]()
        masses = self.top + WASHERS
        for shown in temperatures:
            real = shown + self.rng.normal(0, tuning.TEMPERATURE_U)
            before = len(trials)
            while len(trials) < before + most:
                mass = float(masses[learn(trials, prior).promise(masses, shown).argmax()])
                trials.append(Trial(mass, shown, self.lets_go(mass, real)))
                if trials[-1].outcome is Outcome.FLOATS:
                    break
            numbers.append(len(trials) - before)
        return trials, numbers


@pytest.mark.slow
def test_owners_who_follow_the_proposals_float_and_learn_the_truth():
    days, pulls, slopes = list[list[int]](), list[float](), list[float]()
    for seed in range(10):
        owner = Owner(seed)
        trials, numbers = owner.days([19.0, 23.0])
        days.append(numbers)
        values = learn(trials, Prior(owner.top * 0.99, owner.top * 1.01 + owner.span)).values(21.0)
        pulls.append((values["mass_to_set"].value - owner.middle_at(21.0)) / values["mass_to_set"].u)
        slopes.append((values["relative_change"].value - owner.per_k) / values["relative_change"].u)
    second = np.array(days)[:, 1]
    assert np.mean(second <= 2) > 0.57  # of 120 owners 0.88; 3 standard errors of 10 less
    for one in (pulls, slopes):
        # 3 standard errors of a mean and of a standard deviation of 10; coefficients are drawn 0.4 u off the prior's
        assert abs(np.mean(one) + 0.4 * (one is slopes)) < 0.95
        assert 0.33 < np.std(one) < 1.67
    assert np.mean(np.abs(pulls) < 2) > 0.85
