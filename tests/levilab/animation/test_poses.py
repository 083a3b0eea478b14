"""The poses of an animation: where the top is, and how far it has turned."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from levilab.animation.parts import COLOURS, parts_of
from levilab.animation.poses import drive_share, matrices, poses_of, quaternions_of, turn_rate
from levilab.simulator.parts import Drive
from levilab.simulator.scene import preset, presets
from levilab.simulator.single import simulate

UNDRIVEN = preset("undriven")
SCENES = {
    "aligned": UNDRIVEN,
    "aligned, with drag": UNDRIVEN.changed({"drag.law": "disc"}),
    "driven": preset("driven"),
    "loose washers": preset("loose-washers"),
}


@pytest.mark.parametrize("name", SCENES)
def test_poses_are_those_of_the_trajectory_within_the_simulators_error(name):
    motion = simulate(SCENES[name], 1.5, rate=480.0)
    poses = poses_of(motion, 0.5, 1.25, 360)
    rows = slice(240, 601)
    assert poses.times == pytest.approx(motion.time[rows], abs=1e-12)
    # what was asked for is 1e-7; both motions are one and the same but for rounding and the steps
    assert np.abs(poses.positions - motion.position[rows]).max() < 1e-9
    assert np.abs(poses.axes - motion.axis[rows]).max() < 1e-9
    assert np.abs(poses.spins - motion.spin_hz[rows]).max() < 1e-9
    assert poses.tilts == pytest.approx(motion.tilt[rows], abs=1e-9)


@pytest.mark.parametrize("name", SCENES)
def test_the_turn_between_two_poses_is_the_spin_about_the_axis(name):
    motion = simulate(SCENES[name], 0.3, rate=None)
    poses = poses_of(motion, 0.05, 0.3, 4000)
    turns = Rotation.from_quat(poses.quaternions)
    steps = (turns[1:] * turns[:-1].inv()).as_rotvec()
    middle = poses.axes[1:] + poses.axes[:-1]
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    about = np.einsum("ij,ij->i", steps, middle) / (2 * np.pi) / np.diff(poses.times)
    # a turn of 0.012 rad a step: what the mean axis misses is of its square
    assert about == pytest.approx((poses.spins[1:] + poses.spins[:-1]) / 2, rel=1e-5)


def test_a_span_between_two_samples_begins_where_it_should():
    motion = simulate(UNDRIVEN, 1.0, rate=10.0)
    exact = simulate(UNDRIVEN, 0.537, rate=None)
    poses = poses_of(motion, 0.537, 0.6, 20)
    assert poses.positions[0] == pytest.approx(exact.position[-1], abs=1e-9)
    assert poses.times[[0, -1]] == pytest.approx([0.537, 0.6])


def test_poses_go_up_to_the_fall():
    motion = simulate(UNDRIVEN.changed({"start.spin_hz": 20.0}), 2.0, rate=480.0)
    poses = poses_of(motion, 0.0, float(motion.time[-1]), 200)
    assert poses.fell
    assert poses.times[-1] > motion.fell.time - 2 * np.diff(poses.times)[0]
    assert poses.positions[-1, 2] == pytest.approx(0.0, abs=0.004)  # it falls at some m/s


def test_loose_washers_turn_at_their_own_rate():
    motion = simulate(preset("loose-washers"), 0.5, rate=480.0)
    poses = poses_of(motion, 0.0, 0.5, 240)
    behind = np.trapezoid(motion.spin_hz - motion.washer_spin_hz, motion.time)
    assert poses.slips[0] == 0
    assert poses.slips[-1] == pytest.approx(-2 * math.pi * behind, rel=1e-6)
    assert turn_rate(motion) == pytest.approx(motion.spin_hz.max())


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: math.hypot(*q) > 0.1))
def test_quaternions_are_scipys(numbers):
    turn = Rotation.from_quat(numbers)
    matrix = turn.as_matrix()
    (found,) = quaternions_of(matrix[None, :, 0], matrix[None, :, 2])
    assert abs(found @ turn.as_quat()) == pytest.approx(1, abs=1e-12)
    assert matrices(found[None])[0] == pytest.approx(matrix, abs=1e-12)


@pytest.mark.parametrize(
    ("waveform", "values"),
    [("off", [0, 0, 0]), ("sine", [0, 1, -1]), ("triangle", [0, 1, -1]), ("square", [1, 1, -1]),
     ("unipolar", [1, 1, 0])],
)  # fmt: skip
def test_the_drives_arrow_has_the_drives_waveform(waveform, values):
    drive = Drive.model_validate({"waveform": waveform, "frequency_hz": 10.0, "phase_rad": 0.0, "off_s": 0.09})
    assert drive_share(drive, np.array([0.0, 0.025, 0.075])) == pytest.approx(values, abs=1e-12)
    assert drive_share(drive, np.array([0.125])) == 0


def test_the_drives_arrow_shows_bursts_where_the_top_has_set_them_off():
    scene = preset("motor").changed({"drive.cycle_turns": 0.0, "drive.frequency_hz": 60.0, "drive.phase_rad": 0.0})
    drive = poses_of(simulate(scene, 0.5), 0.0, 0.5, 480).drive
    assert np.mean(drive == 0) == pytest.approx(0.5, abs=0.06)  # half of each turn, and until the first pulse
    assert [drive.min(), drive.max()] == pytest.approx([-1, 1], abs=0.03)


@pytest.mark.parametrize("name", presets())
def test_parts_stand_one_after_another_are_convex_and_go_into_json(name):
    parts = json.loads(json.dumps(parts_of(preset(name)), allow_nan=False))
    heights = [[z for _, z in part["outline"]] for part in parts["parts"]]
    assert all(max(lower) <= min(upper) + 1e-12 for lower, upper in pairwise(heights))
    for part in parts["parts"]:
        steps = np.diff(np.array(part["outline"]), axis=0)
        assert (
            np.cross(np.pad(steps[:-1], ((0, 0), (0, 1))), np.pad(steps[1:], ((0, 0), (0, 1))))[:, 2] >= -1e-12
        ).all()
        assert part["outline"][0][0] == part["outline"][-1][0] == 0
    named = {part["colour"] for part in parts["parts"]} | {mark["colour"] for mark in parts["marks"]}
    assert named <= set(COLOURS["light"]) == set(COLOURS["dark"])
    assert {mark["part"] for mark in parts["marks"]} <= {part["name"] for part in parts["parts"]}


def test_the_tape_is_on_washers_that_slip_and_else_on_the_rim():
    (tape, mark), (loose_tape, loose_mark) = (parts_of(preset(name))["marks"] for name in ("driven", "loose-washers"))
    assert (tape["turns"], mark["turns"], tape["part"]) == ("top", "top", "magnet")
    assert (loose_tape["turns"], loose_mark["turns"]) == ("washers", "top")
