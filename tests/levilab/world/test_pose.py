"""Where a top is and how it is turned, against the simulator's trajectory and another library's rotations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from instruments.clock import VirtualClock
from instruments.virtual.generator.channel import Output
from levilab.simulator import preset, simulate
from levilab.simulator.kernels.motion import ARM, N
from levilab.world.motion_world import MotionWorld
from levilab.world.pose import FLOATS_M, quaternions
from levilab.world.spin_world import SpinScene, SpinWorld

#: Poses are single precision; between two states they change evenly, by up to a quarter of a turn's 400th squared.
SINGLE = 2e-6


def axes(quaternion):
    turned = Rotation.from_quat(quaternion)
    return turned.apply([0.0, 0.0, 1.0]), turned.apply([1.0, 0.0, 0.0])


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: sum(x * x for x in q) > 0.01))
def test_a_quaternion_turns_z_to_the_axis_and_x_to_the_arm(parts):
    wanted = Rotation.from_quat(parts)
    found = quaternions(wanted.apply([[0.0, 0.0, 2.0]]), wanted.apply([[0.5, 0.0, 0.0]]))
    assert np.linalg.norm(found) == pytest.approx(1.0)
    np.testing.assert_allclose(Rotation.from_quat(found[0]).as_matrix(), wanted.as_matrix(), atol=1e-9)


@pytest.fixture(scope="module")
def world():
    return MotionWorld(preset("practice"), VirtualClock())


def test_the_poses_of_a_top_in_motion_are_the_trajectory(world):
    motion = simulate(preset("practice"), 2.0, tolerance=1e-7, rate=400.0)
    poses = world.poses(0.0, 1 / 400, 801)
    axis, arm = axes(poses.quaternion)
    assert poses.up.all()
    np.testing.assert_allclose(poses.position, motion.position, atol=1e-6)
    np.testing.assert_allclose(axis, motion.states[:, N], atol=1e-5)
    np.testing.assert_allclose(arm, motion.states[:, ARM], atol=1e-4)  # two errors of 1e-7 a second, of a fast turn


def test_the_mark_points_where_the_light_sees_the_tape(world):
    times = np.arange(0.1, 1.9, 1e-3)
    poses = world.poses(0.1, 1e-3, times.size)
    _, arm = axes(poses.quaternion)
    turns, _, _ = world._flight.tape(times)
    spot = np.arctan2(-poses.position[:, 1], 0.0144 - poses.position[:, 0])
    seen = (np.arctan2(arm[:, 1], arm[:, 0]) - spot) / (2 * np.pi)
    # between two states the arm goes along a chord: 27° of a turn, half of whose sagitta is 0.2°
    assert np.abs((seen - turns + 0.5) % 1.0 - 0.5).max() < 1e-3


def test_looking_changes_nothing_of_the_motion():
    worlds = [MotionWorld(preset("practice"), VirtualClock()) for _ in range(2)]
    for k, at in enumerate((0.0, 0.35, 0.7, 1.6)):
        for number, world in enumerate(worlds):
            if number:
                world.poses(at, 0.01, 20)
            if k:
                world.drive(at, Output("SIN", 29.5 + k, 4e-4, 0.0))
    assert np.array_equal(*(world.light(0.0, 1e-4, 25_000) for world in worlds))


def test_where_the_drive_changes_the_poses_go_on_from_there():
    world = MotionWorld(preset("practice"), VirtualClock())
    world.poses(0.0, 0.0025, 400)
    world.drive(0.5, Output("SIN", 30.0, 4e-4, 0.0))
    before, after = world.poses(0.5 - 1e-6, 1e-6, 1), world.poses(0.5, 1e-6, 1)
    np.testing.assert_allclose(
        before.quaternion * np.sign(before.quaternion @ after.quaternion.T), after.quaternion, atol=1e-3
    )


def test_a_top_that_fell_is_not_up_until_it_is_put_back():
    # falls after 0.2 s
    world = MotionWorld(preset("practice").changed({"start.spin_hz": 15.0}), VirtualClock(), put_back_after_s=1.0)
    poses = world.poses(0.0, 0.01, 200)
    assert poses.up[0]
    assert not poses.up[60]
    assert poses.up[125]
    axis, _ = axes(poses.quaternion[60:61])
    assert axis[0, 2] == pytest.approx(math.cos(math.radians(118)), abs=1e-6)  # on the rim and the end of the stem
    ring = preset("practice").base
    x, y, z = poses.position[60]
    assert ring.inner_radius_m < math.hypot(x, y) < ring.outer_radius_m
    assert 0.1 * ring.outer_radius_m < z < 0.02
    # nothing jumps where the simulation ends, at a speed of 2.7 m/s; the axis turns at some 50 rad/s
    fine = world.poses(0.0, 0.001, 600)
    first = int(np.argmin(fine.up))
    steps = np.abs(np.diff(fine.position, axis=0)).max(axis=1)
    turns = np.abs(np.diff(axes(fine.quaternion)[0], axis=0)).max(axis=1)
    assert steps[first - 1 :].max() < 0.003
    assert turns[first - 1 :].max() < 0.1
    assert not steps[-200:].any()  # it lies


def test_a_top_that_lies_there_can_be_taken_away():
    world = MotionWorld(preset("practice").changed({"start.spin_hz": 15.0}), VirtualClock())
    world.clock.sleep(1.0)
    assert world.poses(0.99, 0.01, 1).position[0, 2] > 0
    world.take_top()
    taken = world.poses(0.99, 0.01, 3)
    assert taken.position[0, 2] > 0
    np.testing.assert_array_equal(taken.position[1:], 0)


def test_a_top_that_only_spins_stands_upright_and_turns_by_its_phase():
    world = SpinWorld(SpinScene(fall_hz=29.9), VirtualClock())
    poses = world.poses(0.0, 0.001, 500)
    axis, arm = axes(poses.quaternion)
    _, angle = world.motion(np.arange(500) * 0.001)
    np.testing.assert_allclose(axis, np.tile([0.0, 0.0, 1.0], (500, 1)), atol=SINGLE)
    np.testing.assert_allclose(arm[:, 0], np.cos(angle), atol=SINGLE)
    np.testing.assert_allclose(arm[:, 1], np.sin(angle), atol=SINGLE)
    assert poses.position[:, 2] == pytest.approx(FLOATS_M)
    assert not world.poses(1000.0, 1.0, 1).up.any()
