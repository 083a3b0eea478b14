"""Trajectories against heyoka's in extended precision (tests/golden); estimated errors against the true ones."""

import json

import numpy as np
import pytest

from levilab.simulator.scene import preset
from levilab.simulator.single import simulate
from support.paths import GOLDEN

CASES = json.loads((GOLDEN / "trajectories.json").read_text(encoding="utf-8"))
NAMED = {case["name"]: case for case in CASES if case["name"] != "random"}
RANDOM = [case for case in CASES if case["name"] == "random"]


def errors(case, **settings):
    """True errors of place [m] and axis, and the trajectory."""
    scene = preset("undriven").changed(case["scene"])
    motion = simulate(scene, case["duration_s"], rate=None, **settings)
    assert motion.survived
    place = np.linalg.norm(motion.position[-1] - case["position_m"])
    axis = np.linalg.norm(motion.axis[-1] - case["axis"])
    return place, axis, motion


@pytest.mark.parametrize("name", NAMED)
def test_a_motion_ends_where_heyoka_ends_it(name):
    place, axis, motion = errors(NAMED[name], tolerance=1e-11)
    assert place < 1e-12, name  # a tenth of 1e-9 cm; measured below 1e-13 m
    assert axis < 1e-10
    momentum = np.array(NAMED[name]["angular_momentum"])
    assert motion.angular_momentum[-1] == pytest.approx(momentum, abs=1e-10 * np.linalg.norm(momentum))
    assert motion.velocity[-1] == pytest.approx(NAMED[name]["velocity_m_s"], abs=1e-11)


def test_there_are_cases_of_every_kind():
    assert {"IC1", "IC2", "IC3", "IC4", "stokes", "newton", "disc", "mixed", "tilted", "driven"} <= set(NAMED)
    assert len(RANDOM) == 200


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_estimated_errors_bound_the_true_ones_and_are_not_far_above(tolerance):
    seen = []
    for case in RANDOM:
        place, axis, motion = errors(case, tolerance=tolerance)
        floor = 1e-15 + case["apart"]  # the reference itself is rounded to doubles
        seen.append(
            [motion.accuracy.position / max(place - floor, 1e-18), motion.accuracy.axis / max(axis - floor, 1e-18)]
        )
        assert motion.accuracy.reached
    ratio = np.array(seen)
    assert np.mean(ratio >= 1, axis=0).min() >= 0.95
    assert np.median(ratio, axis=0).max() < 100
