"""Many tops at once: each is the one that `simulate` would give, and early escapes cost nothing."""

import numpy as np
import pytest

from levilab.simulator import SimulationError
from levilab.simulator.accuracy import SAFETY_FACTOR, estimate
from levilab.simulator.ensemble import _pilots, grid, simulate_many, step_share_of
from levilab.simulator.kernels.motion import TIME, R
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


@pytest.mark.parametrize("order", [4, 6, 8])
@pytest.mark.parametrize("longer", [2.5, 3.1, 4.0])
def test_an_error_of_the_schemes_order_is_known_from_runs_at_any_length(order, longer):
    # results c·lengthᵖ: the error at length 1 is c, the estimate SAFETY_FACTOR times the last difference over 2ᵖ
    ends = [np.array([2e-9 * length**order, 0.0, 0.0]) for length in (1.0, 2.0, longer)]
    found = estimate(*ends, order, longer)
    assert found == pytest.approx(SAFETY_FACTOR * 2e-9 * (1 - 2.0**-order))
    unsettled = estimate(ends[0], ends[1], ends[1] + ends[1] - ends[0], order, longer)  # the differences do not shrink
    assert unsettled == pytest.approx(SAFETY_FACTOR * np.linalg.norm(ends[1] - ends[0]))


def test_where_rounding_is_the_error_the_estimate_is_no_smaller():
    over = {"start.spin_hz": np.linspace(26, 34, 32)}
    tight, other = (simulate_many(UNDRIVEN, over, 2.0, step_share=share) for share in (0.02, 0.025))
    apart = np.linalg.norm(tight.axis - other.axis, axis=-1)
    assert np.median(apart) < 1e-12  # the composition's own error is below 1e-15
    assert np.mean(apart <= np.hypot(tight.axis_error, other.axis_error)) >= 0.9


def test_errors_are_within_the_tolerance_and_bound_the_true_ones():
    spins = np.linspace(25, 35, 40)
    many = simulate_many(UNDRIVEN, {"start.spin_hz": spins}, 5.0, tolerance=1e-8)
    fine = simulate_many(UNDRIVEN, {"start.spin_hz": spins}, 5.0, step=2e-4, errors=False)
    assert np.all(np.isnan(fine.position_error))
    for error, values, true in (
        (many.position_error, many.position, fine.position),
        (many.axis_error, many.axis, fine.axis),
    ):
        found = np.linalg.norm(values - true, axis=-1)
        assert found.max() < 1e-8
        assert np.mean(found <= error) >= 0.95
        # where the two coarser runs agree by chance the estimate is far too large, never too small
        assert np.mean(error < 1e-8) >= 0.95


FALLS = {
    "slow": ({}, {"start.spin_hz": [10.0, 15.0, 18.0, 21.0]}),
    "heavy": ({}, {"top.mass_kg": [0.0258, 0.027, 0.030]}),
    "inwards": (
        {"start.position_m": [0.01, 0.0, 0.071], "start.velocity_m_s": [-0.02, 0.0, 0.0], "escape.height_m": 0.0695},
        {"top.mass_kg": [0.028, 0.030]},
    ),
    "upwards, out of the light": (
        {"start.velocity_m_s": [0.3, 0.0, 0.5]}, {"start.position_m.2": [0.08, 0.085]}
    ),
}  # fmt: skip


@pytest.mark.parametrize("fall", FALLS)
def test_an_escape_is_located_as_simulate_does(fall):
    changes, over = FALLS[fall]
    many = simulate_many(UNDRIVEN.changed(changes), over, 5.0)
    ((key, values),) = over.items()
    assert not many.survived.any()
    for i, value in enumerate(values):
        alone = simulate(UNDRIVEN.changed(changes | {key: value}), 5.0, tolerance=1e-10, rate=None)
        # the limit is crossed at some cm/s: an error of the place is one of the moment, ten times larger
        assert many.time[i] == pytest.approx(alone.time[-1], abs=1e-8)
        assert np.linalg.norm(many.position[i] - alone.position[-1]) <= many.position_error[i] + 1e-10
        assert np.linalg.norm(many.axis[i] - alone.axis[-1]) <= many.axis_error[i] + 1e-10


DRIVES = {
    "off from the start": {"drive.off_s": 0.0},
    "a triangle slower than the run": {"drive.waveform": "triangle", "drive.frequency_hz": 1e-3, "drive.phase_rad": 0},
    "a square that begins below zero": {"drive.waveform": "square", "drive.frequency_hz": 0.01, "drive.phase_rad": 3.3},
}


@pytest.mark.parametrize("drive", DRIVES)
def test_a_drive_without_a_kink_in_the_run_keeps_its_shape(drive):
    scene = preset("driven").changed({"drive.amplitude_t": 1e-3} | DRIVES[drive])
    many = simulate_many(scene, {"start.spin_hz": [30.03]}, 1.0)
    alone = simulate(scene.changed({"start.spin_hz": 30.03}), 1.0, rate=None)
    assert many.survived[0] == alone.survived
    assert np.linalg.norm(many.position[0] - alone.position[-1]) < 1e-8


def test_a_fixed_step_is_that_of_every_top():
    spins = np.array([10.0, 100.0])
    there = simulate_many(UNDRIVEN, {"start.spin_hz": spins}, 0.1, step=1e-3)
    back = simulate_many(UNDRIVEN, {"start.spin_hz": spins[::-1]}, 0.1, step=1e-3)
    assert np.array_equal(there.states, back.states[::-1])
    for i, spin in enumerate(spins):
        alone = simulate(UNDRIVEN.changed({"start.spin_hz": spin}), 0.1, step=1e-3, rate=None)
        assert there.position[i] == pytest.approx(alone.position[-1], abs=1e-15)


CUT = {
    "aligned": (KINDS["aligned"], {"start.spin_hz": [12.0, 19.0, 24.0], "top.mass_kg": np.linspace(0.0251, 0.027, 9)}),
    "square": (KINDS["square"], {"drive.frequency_hz": np.linspace(28, 32, 4), "drive.amplitude_t": [0.0, 1e-4, 4e-4]}),
}  # fmt: skip


@pytest.mark.parametrize("kind", CUT)
def test_a_map_has_the_same_bits_however_it_is_cut(kind):
    scene, axes = CUT[kind]
    over = grid(axes)
    share = step_share_of(scene, over, 1.0, tolerance=1e-8)
    whole = simulate_many(scene, over, 1.0, step_share=share, cores=1)
    shape = whole.survived.shape

    def same(part, where):
        for name in ("states", "survived", "position_error", "axis_error"):
            assert getattr(part, name).tobytes() == getattr(whole, name)[where].tobytes(), name

    same(simulate_many(scene, over, 1.0, step_share=share, cores=2), ...)
    for i in range(shape[0]):
        row = {key: np.broadcast_to(values, shape)[i] for key, values in over.items()}
        same(simulate_many(scene, row, 1.0, step_share=share), i)
    shuffled = np.random.default_rng(0).permutation(np.array(list(np.ndindex(shape)))).T
    points = {key: np.broadcast_to(values, shape)[*shuffled] for key, values in over.items()}
    same(simulate_many(scene, points, 1.0, step_share=share, cores=2), tuple(shuffled))
    for i, j in ((0, 0), (1, 2), (shape[0] - 1, shape[1] - 1)):
        point = {key: np.broadcast_to(values, shape)[i, j] for key, values in over.items()}
        same(simulate_many(scene, point, 1.0, step_share=share), (i, j))


SAMPLED = {
    "aligned": (KINDS["aligned"], {"start.spin_hz": [12.0, 24.0, 31.0]}),
    "square": (KINDS["square"], {"drive.frequency_hz": [29.0, 31.7], "drive.off_s": [0.83, 9.0]}),
    "triangle": (KINDS["square"], {"drive.waveform": "triangle", "drive.phase_rad": [0.3, 4.0]}),
    "unipolar": (KINDS["square"], {"drive.waveform": "unipolar", "drive.phase_rad": [0.0, np.pi, 5.0]}),
    "corners at samples": (KINDS["square"], {"drive.frequency_hz": [25.0, 50.0], "drive.phase_rad": 0.0}),
    "a sine that ends": (KINDS["driven"], {"drive.off_s": [0.0, 0.5]}),
}


@pytest.mark.parametrize("kind", SAMPLED)
def test_samples_are_those_of_each_top_alone(kind):
    scene, over = SAMPLED[kind]
    many = simulate_many(scene, over, 1.005, tolerance=1e-9, rate=100.0)
    assert many.sample_times.tolist() == [i / 100 for i in range(101)]
    assert many.samples.shape == (*many.survived.shape, 101, 18)
    for i, row in enumerate(many.samples):
        one = {key: np.broadcast_to(values, many.survived.shape)[i].item() for key, values in over.items()}
        alone = simulate(scene.changed(one), 1.005, tolerance=1e-10, rate=100.0)
        assert np.linalg.norm(many.position[i] - alone.position[-1]) <= many.position_error[i] + 1e-10
        # the last one is the end, or the fall: nothing is known after it
        n = len(alone.states) - 1
        assert np.abs(row[:n, :12] - alone.states[:n, :12]).max() < 2e-9
        assert row[:n, TIME] == pytest.approx(alone.time[:n], abs=1e-12)
        assert np.all(np.isnan(row[n:]))
    place = simulate_many(scene, over, 1.005, tolerance=1e-9, rate=100.0, columns=R, errors=False).samples
    assert np.array_equal(place, many.samples[..., R], equal_nan=True)
    assert simulate_many(scene, over, 0.1, errors=False).samples.shape == (*many.survived.shape, 0, 0)


def test_the_spin_is_that_of_each_tops_own_washers():
    inertias = [1.5e-7, 6e-7]
    many = simulate_many(preset("loose-washers"), {"washers.inertia_kg_m2": inertias}, 0.5)
    for i, inertia in enumerate(inertias):
        alone = simulate(preset("loose-washers").changed({"washers.inertia_kg_m2": inertia}), 0.5, rate=None)
        assert many.spin_hz[i] == pytest.approx(alone.spin_hz[-1], abs=1e-7)


def test_no_tops_at_all_are_no_error():
    empty = simulate_many(UNDRIVEN, {"start.spin_hz": []}, 1.0)
    assert empty.survived.shape == (0,)
    assert empty.states.shape == (0, 18)


def test_values_that_do_not_fit_together_are_named():
    with pytest.raises(SimulationError, match=r"start\.spin_hz \(2,\), top\.mass_kg \(3,\)"):
        simulate_many(UNDRIVEN, {"start.spin_hz": [20, 30], "top.mass_kg": [0.025] * 3}, 1.0)


@pytest.mark.parametrize(("shape", "corners"), [((3, 13), {0, 12, 26, 38}), ((5,), {0, 4}), ((), {0}), ((1, 1), {0})])
def test_the_corners_of_a_map_are_among_those_that_choose_the_step(shape, corners):
    assert corners <= _pilots(shape)


def test_a_map_that_is_lost_along_its_edges_has_the_step_of_tops_inside():
    # evenly spaced points of these axes lie all at the lowest mass or height: 145 spins are 5 times 29
    axes = {
        "start.spin_hz": np.linspace(18, 90, 145),
        "top.mass_kg": np.linspace(0.02418, 0.0255, 23),
        "start.position_m.2": np.linspace(0.067, 0.085, 37),
    }
    share = step_share_of(UNDRIVEN, grid(axes), 30.0, tolerance=1e-6, survivors_only=True)
    assert share > 3 * step_share_of(UNDRIVEN, grid(axes), 30.0, tolerance=1e-6)


def test_lanes_are_filled_again_so_that_many_early_escapes_cost_little():
    # a thousand tops that fall within 0.3 s around sixteen that stay for 5 s: every one has its own answer
    spins = np.where(np.arange(1016) % 64 == 5, 30.0, 12.0)
    many = simulate_many(UNDRIVEN, {"start.spin_hz": spins}, 5.0, errors=False, cores=1)
    assert np.array_equal(many.survived, spins == 30.0)
    assert np.all(many.time[spins == 12.0] < 0.5)
    assert np.ptp(many.position[spins == 30.0], axis=0) == pytest.approx([0, 0, 0], abs=0)


def test_tops_of_different_kinds_go_together():
    many = simulate_many(UNDRIVEN, {"drag.law": np.array(["none", "stokes"])}, 1.0)
    for law, place in zip(("none", "stokes"), many.position, strict=True):
        alone = simulate(UNDRIVEN.changed({"drag.law": law}), 1.0, tolerance=1e-10, rate=None)
        assert place == pytest.approx(alone.position[-1], abs=1e-9)


@pytest.mark.parametrize(
    ("name", "value"),
    [("duration", np.nan), ("duration", -1.0), ("tolerance", 0.0), ("step_share", -1.0), ("cores", 0)],
)
def test_numbers_that_make_no_sense_are_refused_by_name(name, value):
    with pytest.raises(SimulationError, match=name):
        simulate_many(UNDRIVEN, {"start.spin_hz": np.array([30.0])}, **({"duration": 1.0} | {name: value}))


def test_progress_runs_to_the_whole():
    shares = []
    simulate_many(UNDRIVEN, {"start.spin_hz": np.linspace(20, 30, 600)}, 0.1, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
