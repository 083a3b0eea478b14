"""Runs beside each other in the lanes of a register: each is the same as alone, however many there are."""

import math

import numpy as np
import pytest

from levilab.simulator import problem as problems
from levilab.simulator.kernels.motion import R
from levilab.simulator.model import model_of
from levilab.simulator.problem import Problem, Stretch, integrate, integrate_to_end, scheme_for
from levilab.simulator.start import start_of
from support.scenes import KINDS


def problem_of(scene):
    start = start_of(scene)
    model = model_of(scene, start[R])
    return Problem(scene, model, start, scheme_for(None, model))


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_beside_others_is_the_same_as_alone_to_the_last_bit(kind):
    problem = problem_of(KINDS[kind])
    samples = np.linspace(0.05, 0.35, 4)
    stretches = [
        Stretch(problem.start, problem.stops(until, step, samples))
        for until, step in ((0.4, 2e-3), (0.4, 4e-3), (0.2, 1e-3), (0.4, 3e-3))
    ]
    together = problem.advance_together(stretches)
    for one, (states, through) in zip(stretches, together, strict=True):
        ((alone, _),) = problem.advance_together([one])
        assert through
        assert states.shape == (one.stops.times.size, problem.start.size)
        np.testing.assert_array_equal(states, alone)


def test_the_others_end_with_the_first_one_that_escapes():
    problem = problem_of(KINDS["aligned"].changed({"start.spin_hz": 15.0}))  # it falls after 0.2 s
    (_, through), (others, to_the_end) = problem.advance_together(
        [
            Stretch(problem.start, problem.stops(30.0, 2e-3), problem.escape),
            Stretch(problem.start, problem.stops(30.0, 4e-3)),
        ]
    )
    assert not through
    assert not to_the_end
    assert len(others) < 3


@pytest.mark.parametrize("until", [3.0, -3.0])
@pytest.mark.parametrize("step", [8e-4, 2e-3, 5e-3])
def test_a_run_beside_is_the_same_in_short_calls(until, step, monkeypatch):
    problem = problem_of(KINDS["square"])
    stops, beside = problem.stops(until, 2e-3, np.sign(until) * np.arange(0.1, 3, 0.1)), problem.stops(until, step)
    alone = integrate_to_end(problem, stops), integrate_to_end(problem, beside)
    monkeypatch.setattr(problems, "STEPS_IN_A_CALL", 100)
    states, fell, steps, end = integrate(problem, stops, beside=beside)
    assert fell is None
    assert steps == stops.counts.sum()
    np.testing.assert_array_equal(states[-1], alone[0])
    np.testing.assert_array_equal(end, alone[1])


def test_a_run_beside_that_leaves_the_range_of_numbers_ends_in_no_number():
    problem = problem_of(KINDS["exact field"])
    stops = problem.stops(1.0, 2e-3)
    _, fell, _, end = integrate(problem, stops, beside=problem.stops(1.0, 0.5))  # steps of ten turns
    assert fell is None
    assert math.isnan(end[0])
