"""Drag with |ω| in it is not smooth at ω = 0: a spin that passes zero takes the order away, and the estimate knows."""

import numpy as np
import pytest

from levilab.simulator.accuracy import has_kink
from levilab.simulator.ensemble import simulate_many
from levilab.simulator.kernels.motion import TIME
from levilab.simulator.model import model_of
from levilab.simulator.problem import Problem, integrate_each_step, scheme_for
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate
from levilab.simulator.start import start_of
from levilab.simulator.stops import Stops, stop_after_each_step

# far above the base, in its field alone, so that a tilted moment turns the spin back and forth through zero
SLOW = preset("tilted").changed(
    {
        "top.moment_tilt": [0.3, 0.95],
        "gravity_m_s2": 0.0,
        "start.position_m": [0.001, 0.0, 0.2],
        "start.velocity_m_s": [0.0, 0.0, 0.0],
        "start.precession": "none",
        "escape.radius_m": 0.5,
    }
)
DRAGS = {
    "newton": {"drag.law": "newton", "drag.coefficient": 2e-2},
    "strong newton": {"drag.law": "newton", "drag.coefficient": 2e-1},
    "disc": {"drag.law": "disc", "drag.coefficient": 2e-2},
    "washers": {
        "drag.law": "newton", "drag.coefficient": 2e-2,
        "washers.inertia_kg_m2": 3e-7, "washers.coupling_n_m_s": 1e-6, "washers.drag_share": 0.5,
    },
}  # fmt: skip


def starts(drag):
    random = np.random.default_rng(3)
    for _ in range(5):
        spin, tilt = random.uniform([-3, 0.01], [3, 1.0])
        yield SLOW.changed(DRAGS[drag]).changed({"start.spin_hz": float(spin), "start.tilt_rad": float(tilt)})


@pytest.mark.parametrize("drag", DRAGS)
def test_the_estimate_bounds_the_error_of_a_spin_that_passes_zero(drag):
    passed = 0
    for scene in starts(drag):
        # steps ten times shorter, whose error of third order is 1e-3 of the others'
        true = simulate(scene, 0.5, step=5e-5, rate=None)
        passed += np.any(np.diff(np.sign(simulate(scene, 0.5, rate=1000).spin_hz)))
        for step in (2e-3, 5e-4):
            for rate in (None, 100.0):
                motion = simulate(scene, 0.5, step=step, rate=rate)
                assert np.linalg.norm(motion.axis[-1] - true.axis[-1]) <= motion.accuracy.axis + 1e-13
                assert np.linalg.norm(motion.position[-1] - true.position[-1]) <= motion.accuracy.position + 1e-13
            many = simulate_many(scene, {}, 0.5, step=step)
            assert np.linalg.norm(many.axis[0] - true.axis[-1]) <= many.axis_error[0] + 1e-13
    assert passed >= 3


@pytest.mark.parametrize(("law", "kink"), [("stokes", False), ("mixed", True)])
def test_every_law_but_that_of_stokes_has_a_kink(law, kink):
    assert has_kink(model_of(SLOW.changed({"drag.law": law})).drag) is kink


def test_a_spin_that_stays_away_from_zero_has_its_order():
    # the smallest error at a step of 2 ms is far below what is assumed where the order is lost
    fast = preset("tilted").changed({"drag.law": "disc", "drag.coefficient": 2e-2})
    for rate in (None, 100.0):
        assert simulate(fast, 0.5, step=2e-3, rate=rate).accuracy.axis < 1e-8


def test_newton_drag_leaves_a_spin_of_zero_at_zero():
    still = SLOW.changed({"base.strength_t_m": 0.0, "start.spin_hz": 0.0, "start.tilt_rad": 0.3, **DRAGS["newton"]})
    assert np.all(simulate(still, 1.0).spin_hz == 0)


def test_there_is_a_state_after_each_step():
    scene = SLOW.changed(DRAGS["newton"])
    model, start = model_of(scene), start_of(scene)
    stops = Stops(np.array([0.0, 0.001, 0.003]), np.array([2, 4]), np.zeros(2), np.zeros(2))
    expected = [0.0, 0.0005, 0.001, 0.0015, 0.002, 0.0025, 0.003]
    each = stop_after_each_step(stops)
    assert each.times == pytest.approx(expected)
    assert each.counts.tolist() == 6 * [1]
    states = integrate_each_step(Problem(scene, model, start, scheme_for(None, model)), stops)
    assert states[:, TIME] == pytest.approx(expected)
