"""Tops that a drive holds and tops that slip, by the angle of the body behind the drive."""

import numpy as np
import pytest

from levilab.motion.lock import RATE_HZ, body_angle, can_lock, is_locked, turns_behind
from levilab.simulator.kernels.motion import ARM, N
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate

DRIVEN = preset("driven")


def driven(frequency, duration=12.0, rate=RATE_HZ, **values):
    scene = DRIVEN.changed({"drive.frequency_hz": frequency} | {key.replace("__", "."): v for key, v in values.items()})
    return simulate(scene, duration, tolerance=1e-6, rate=rate)


def locked(motion, scene=None):
    return is_locked(scene or motion.scene, motion.states, survived=motion.survived)


@pytest.mark.parametrize("frequency", [29.7, 30.0, 30.3])
def test_a_top_that_swings_about_the_drive_is_locked(frequency):
    motion = driven(frequency)
    assert locked(motion)
    last = motion.states[motion.time >= 6.0]
    assert 0.3 < np.ptp(turns_behind(motion.scene, last)) < 1


@pytest.mark.parametrize("frequency", [25.0, 29.5, 30.6, 35.0])
def test_a_top_that_slips_is_not_locked_however_near_its_mean_spin_is(frequency):
    motion = driven(frequency)
    assert locked(motion) is False
    if frequency in {29.5, 30.6}:  # by its mean spin alone it might be taken for locked
        assert abs(motion.spin_hz[motion.time >= 6.0].mean() - frequency) < 0.5


def test_a_top_that_turns_the_other_way_round_locks_as_well():
    motion = driven(30.0, start__spin_hz=-30.03)
    assert locked(motion)
    assert locked(driven(31.0, start__spin_hz=-30.03)) is False


@pytest.mark.parametrize("frequency", [30.0, 33.0])
def test_few_samples_follow_the_body_as_many_do(frequency):
    # the authority: the azimuth of the body's x axis from samples so dense that it turns by a thirteenth of a turn
    dense, few = driven(frequency, 8.0, 400.0), driven(frequency, 8.0, 25.0)
    arm = dense.states[:, ARM]
    behind = np.unwrap(np.arctan2(arm[:, 1], arm[:, 0])) / (2 * np.pi) - frequency * dense.time
    apart = np.interp(few.time, dense.time, behind) - turns_behind(few.scene, few.states)
    assert np.abs(apart).max() < 0.01  # the axis leans by up to 0.05 rad, the azimuth of the arm is half its square off
    assert np.ptp(behind) > (0.4 if frequency == 30.0 else 20.0)


def test_the_angle_of_the_body_is_that_of_a_turn_about_the_vertical():
    states = np.zeros((7, 18))
    angles = np.linspace(-3, 3, 7)
    states[:, ARM] = np.stack([np.cos(angles), np.sin(angles), np.zeros(7)], axis=-1)
    states[:, N] = [0.0, 0.0, 1.0]
    assert body_angle(states) == pytest.approx(angles, abs=1e-15)


def test_a_lost_top_a_short_motion_and_no_drive_are_not_locked():
    motion = driven(30.0)
    assert is_locked(motion.scene, motion.states, survived=False) is False
    assert locked(driven(30.0, duration=9.0)) is None
    assert locked(motion, DRIVEN.changed({"drive.waveform": "off"})) is None
    assert locked(motion, DRIVEN.changed({"drive.amplitude_t": 0.0})) is None
    assert locked(motion, DRIVEN.changed({"top.moment_tilt": [0.0, 1.0]})) is None
    assert is_locked(motion.scene, motion.states[::10], survived=True) is None


def test_a_drive_that_ends_earlier_cannot_lock_the_top():
    assert can_lock(DRIVEN.changed({"drive.off_s": 10.0}), until=9.0)
    assert not can_lock(DRIVEN.changed({"drive.off_s": 10.0}), until=12.0)
