"""The drag at a held spin: its uncertainty against the scatter of trials, and the laws through several spins."""

import numpy as np
import pytest

from analysis.held import fit_held, hold_of
from analysis.spindown.drag import LAWS, spin
from analysis.spindown.tilt import THESIS_TOP, count_of, slowing_by_tilt

C, PULL, NOISE = 2.34e-4, 0.36, 0.03


def drag_at(frequency):
    return C * (2 * np.pi * frequency) ** 1.5 / (2 * np.pi)


def trial(random, held=40.0, wander=0.0):
    """A hold of 12 readings whose share wanders, and two gains at the full amplitude, integrated with the drag."""
    step = 0.01
    time = np.arange(0, 120, step)
    share = drag_at(held) / PULL + wander * np.sin(2 * np.pi * time / 50)
    moved = held + np.cumsum((share * PULL - drag_at(held)) * step)  # the drag's change within 0.1 Hz is 1e-3 of it
    spins, shares, times = (x.reshape(12, -1).mean(axis=1) for x in (moved, share, time))
    u = np.full(12, NOISE / np.sqrt(10))
    gains = []
    for _ in range(2):
        late = np.arange(10.0) - 4.5
        counts = held + (PULL - drag_at(held)) * late
        gains.append((late, counts + NOISE * random.standard_normal(10)))
    return hold_of(times, spins + u * random.standard_normal(12), u, shares, gains)


def test_u_of_the_drag_predicts_the_scatter():
    random = np.random.default_rng(1)
    pulls = [(one.drag.value - drag_at(40.0)) / one.drag.u for one in (trial(random) for _ in range(600))]
    assert abs(np.mean(pulls)) < 0.13  # 3 standard errors
    assert np.std(pulls) == pytest.approx(1.04, abs=0.1)  # Student's 16 degrees of freedom, widened: 1.07/1.03


def test_a_spin_that_moves_meanwhile_does_not_bias_the_drag():
    random = np.random.default_rng(2)
    found = [trial(random, wander=0.02).drag for _ in range(40)]
    mean = np.mean([one.value for one in found])
    assert mean == pytest.approx(drag_at(40.0), abs=3 * found[0].u / np.sqrt(40))


@pytest.mark.parametrize("leans", [False, True])
def test_a_gain_seen_beside_the_held_spin_is_brought_there(leans):
    held, step, spins = 28.0, 0.01, [27.5]

    def pull(spin):
        return PULL / (1 - (21.6 / spin) ** 2) if leans else PULL

    for _ in range(300):
        spins.append(spins[-1] + (pull(spins[-1]) - drag_at(spins[-1])) * step)
    gain = np.arange(301) * step, np.array(spins)
    ones = np.ones(12)
    found = hold_of(10 * np.arange(12.0), held * ones, 1e-4 * ones, drag_at(held) / pull(held) * ones, [gain])
    off = found.drag.value - drag_at(held)
    assert abs(np.mean(spins) - held) > 0.05
    assert abs(off) < 2.0 * found.parts["lean"]  # from the middle of an even distribution √3 at most, and its bend


def test_without_a_gain_there_is_no_drag():
    ones = np.ones(4)
    found = hold_of(np.arange(4.0), 40 * ones + [0, 0.01, 0, 0.01], 0.01 * ones, 0.95 * ones, [])
    assert found.drag is None
    assert found.share == pytest.approx(0.95)


CONSTANTS = {"stokes": (3.2e-3,), "newton": (1.7e-5,), "disc": (C,), "mixed": (1.6e-3, 8e-6), "power": (C, 1.5)}


@pytest.mark.parametrize("law", LAWS)
def test_the_drag_along_a_closed_form_gives_its_constants_back(law):
    constants = CONSTANTS[law]
    time = np.linspace(0, 150, 7)
    spins = spin(law, time, 45.0, *constants)
    drag = (spin(law, time - 0.01, 45.0, *constants) - spin(law, time + 0.01, 45.0, *constants)) / 0.02
    fits = {one.name: one for one in fit_held(spins, drag, 1e-3 * drag).laws}
    assert [one.value for one in fits[law].constants.values()] == pytest.approx(constants, rel=1e-4)  # differences
    assert fits[law].drag(spins) == pytest.approx(drag, rel=1e-5)


def test_a_common_error_of_the_drag_does_not_average_out():
    spins = np.linspace(25, 45, 30)
    own, common = 0.001 * np.ones(30), 0.02 * drag_at(spins)
    (alike,) = (one for one in fit_held(spins, drag_at(spins), own, common).laws if one.name == "disc")
    assert alike.constants["c32"].u == pytest.approx(0.02 * C, rel=0.02)  # own errors add 1e-3


def test_laws_are_not_compared_at_one_spin_and_u_has_the_scatter_of_the_tops():
    tops, random, pulls = 12, np.random.default_rng(3), []
    for _ in range(100):
        spins = 45 + 1e-3 * random.standard_normal(tops)
        true = drag_at(spins)
        drag = true * (1 + random.normal(0, 0.03, tops)) + random.normal(0, 0.01 * true)
        laws, between, compared = fit_held(spins, drag, 0.01 * true)
        assert not compared
        assert {law.name for law in laws} == {"stokes", "newton", "disc"}
        assert 0.01 < between < 0.06
        (c32,) = (law.constants["c32"] for law in laws if law.name == "disc")
        pulls.append((c32.value - C) / c32.u)
    assert np.std(pulls) == pytest.approx(1.03, abs=0.25)  # Student's 11 degrees of freedom and more; 3 standard errors


def fit_tops(random, spins, scatter, u):
    """Fit the laws to the drag of tops that differ."""
    true = drag_at(spins)
    drag = true * (1 + random.normal(0, scatter, len(spins)) + random.normal(0, u, len(spins)))
    return fit_held(spins, drag, u * true)


@pytest.mark.parametrize("spread", [1e-3, 20.0])
@pytest.mark.parametrize("tops", [3, 4])
def test_u_of_a_constant_covers_the_truth_with_few_tops_that_differ(tops, spread):
    random, near = np.random.default_rng(4), []
    for _ in range(200):
        found = fit_tops(random, 46 - spread * random.uniform(0, 1, tops), 0.03, 0.01)
        (c32,) = (law.constants["c32"] for law in found.laws if law.name == "disc")
        near.append(abs(c32.value - C) < c32.u)
    assert np.mean(near) == pytest.approx(0.68, abs=0.1)  # 3 standard errors


@pytest.mark.parametrize("tops", [2, 3, 4])
def test_tops_that_agree_by_chance_do_not_compare_laws(tops):
    """3 % from top to top gives an exponent to 0.3 at best with spins that differ by 4 Hz."""
    random = np.random.default_rng(5)
    found = [fit_tops(random, np.linspace(43, 47, tops), 0.03, 0.003).compared for _ in range(200)]
    assert np.mean(found) < 0.2


def test_constants_are_the_same_whether_laws_are_compared_or_not():
    """Between the two u of the drag the exponent is just known well enough."""
    spins = np.array([43.0, 44.0, 46.0, 47.0])
    less, more = (fit_held(spins, drag_at(spins), u * drag_at(spins)) for u in (0.009, 0.0095))
    assert (less.compared, more.compared) == (True, False)
    small, large = (next(law for law in one.laws if law.name == "disc").constants["c32"] for one in (less, more))
    assert large.u / small.u == pytest.approx(0.0095 / 0.009, rel=1e-3)


def test_the_tilt_changes_the_drag_as_the_count_of_a_spin_down_does():
    delta, resonance, start = 0.03, 22.0, 40.0
    law = LAWS["disc"]
    q = law.dimensionless([start, C], start, 100.0)
    tau = np.linspace(0, 1.9, 2000)
    count = start * count_of(law, tau, np.array([*q, delta**2, resonance / start, 0.0]), THESIS_TOP)
    drag = -np.gradient(count, tau * 100.0)
    factor = drag / drag_at(count)
    high = slice(10, np.argmax(count < 25.5))  # below, the fall is near
    assert slowing_by_tilt(count, resonance, delta)[high] == pytest.approx(factor[high], abs=2e-4)  # by differences
