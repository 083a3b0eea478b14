"""Many tops at once: each is the one that `simulate` would give, and early escapes cost nothing."""

import numpy as np
import pytest

from levilab.simulator import SceneError, SimulationError
from levilab.simulator.ensemble import simulate_many
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate

UNDRIVEN = preset("undriven")
KINDS = {
    "aligned": UNDRIVEN,
    "friction": preset("friction"),
    "tilted": preset("tilted"),
    "driven": preset("driven"),
    "square": preset("driven").changed({"drive.waveform": "square"}),
    "washers": preset("loose-washers"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_top_moves_as_it_does_alone(kind):
    scene, duration = KINDS[kind], 2.0
    spins, heights = np.linspace(26, 34, 5)[:, None], np.array([0.0712, 0.0722, 0.0732, 0.0742])
    many = simulate_many(scene, {"start.spin_hz": spins, "start.position_m.2": heights}, duration, cores=2)
    assert many.survived.shape == (5, 4)
    assert many.states.shape == (5, 4, 18)
    for i, j in ((0, 0), (2, 3), (4, 1)):
        one = scene.changed({"start.spin_hz": spins[i, 0], "start.position_m.2": heights[j]})
        alone = simulate(one, duration, tolerance=1e-11, rate=None)
        assert many.survived[i, j] == alone.survived
        bound = many.position_error[i, j] + alone.accuracy.position
        assert np.linalg.norm(many.position[i, j] - alone.position[-1]) <= bound
        assert many.spin_hz[i, j] == pytest.approx(alone.spin_hz[-1], abs=1e-7)


def test_errors_are_within_the_tolerance_and_bound_the_true_ones():
    spins = np.linspace(25, 35, 40)
    many = simulate_many(UNDRIVEN, {"start.spin_hz": spins}, 5.0, tolerance=1e-8)
    fine = simulate_many(UNDRIVEN, {"start.spin_hz": spins}, 5.0, step=2e-4, errors=False)
    assert np.all(np.isnan(fine.position_error))
    true = np.linalg.norm(many.position - fine.position, axis=-1)
    assert np.mean(true <= many.position_error) >= 0.95
    assert many.axis_error.max() < 1e-8


def test_an_escape_is_told_with_its_moment():
    spins = np.array([10.0, 15.0, 30.0, 18.0])
    many = simulate_many(UNDRIVEN, {"start.spin_hz": spins}, 5.0)
    assert many.survived.tolist() == [False, False, True, False]
    for spin, time in zip(spins, many.time, strict=True):
        alone = simulate(UNDRIVEN.changed({"start.spin_hz": spin}), 5.0)
        assert time == pytest.approx(alone.time[-1], abs=1e-4)  # along the velocity within a step of some ms


def test_lanes_are_filled_again_so_that_many_early_escapes_cost_little():
    # a thousand tops that fall within 0.3 s around sixteen that stay for 5 s: every one has its own answer
    spins = np.where(np.arange(1016) % 64 == 5, 30.0, 12.0)
    many = simulate_many(UNDRIVEN, {"start.spin_hz": spins}, 5.0, errors=False, cores=1)
    assert np.array_equal(many.survived, spins == 30.0)
    assert np.all(many.time[spins == 12.0] < 0.5)
    assert np.ptp(many.position[spins == 30.0], axis=0) == pytest.approx([0, 0, 0], abs=0)


def test_tops_of_different_kinds_go_together():
    many = simulate_many(UNDRIVEN, {"base.field": np.array(["paraxial-2", "paraxial-4"])}, 1.0)
    for field, place in zip(("paraxial-2", "paraxial-4"), many.position, strict=True):
        alone = simulate(UNDRIVEN.changed({"base.field": field}), 1.0, tolerance=1e-10, rate=None)
        assert place == pytest.approx(alone.position[-1], abs=1e-9)


def test_a_wrong_key_is_named():
    with pytest.raises(SceneError, match=r"top\.mass"):
        simulate_many(UNDRIVEN, {"top.mass": np.array([0.025])}, 1.0)


@pytest.mark.parametrize(("name", "value"), [("duration", np.nan), ("duration", -1.0), ("tolerance", 0.0)])
def test_numbers_that_make_no_sense_are_refused_by_name(name, value):
    with pytest.raises(SimulationError, match=name):
        simulate_many(UNDRIVEN, {"start.spin_hz": np.array([30.0])}, **({"duration": 1.0} | {name: value}))


def test_progress_runs_to_the_whole():
    shares = []
    simulate_many(UNDRIVEN, {"start.spin_hz": np.linspace(20, 30, 600)}, 0.1, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
