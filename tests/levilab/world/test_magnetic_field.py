"""The magnetic field beside the bench, against another library and what physics says of it."""

import numpy as np
import pytest

from instruments.clock import VirtualClock
from levilab.simulator import preset
from levilab.world.base import Base
from levilab.world.magnetic_field import base_beside, dipole_field
from levilab.world.motion_world import MotionWorld
from levilab.world.spin_world import SpinScene, SpinWorld

#: Beside the base, at the height of the top [m].
PLACE = np.array([0.2, 0.0, 0.072])


def test_dipoles_are_those_of_magpylib():
    magpylib = pytest.importorskip("magpylib")
    rng = np.random.default_rng(1)
    moments, places = rng.normal(0, 0.7, (5, 3)), rng.normal(0, 0.2, (5, 3))
    theirs = [magpylib.misc.Dipole(moment=m).getB(p) for m, p in zip(moments, places, strict=True)]
    np.testing.assert_allclose(dipole_field(moments, places), theirs, rtol=1e-9)  # μ₀/4π is 1e-7 to 6e-10


def test_the_base_beside_the_bench_is_that_of_two_loops():
    magpylib = pytest.importorskip("magpylib")
    current = 1.40e-3 / 1e-7  # 4πρ/μ₀: B on the axis is 2πρ a²/(a² + z²)^1.5 for each radius
    place = np.array([0.12, -0.16, 0.03])
    loops = [magpylib.current.Circle(current=sign * current, diameter=2 * r) for sign, r in ((1, 0.055), (-1, 0.030))]
    theirs = sum(loop.getB(place) for loop in loops)
    np.testing.assert_allclose(base_beside(tuple(place), Base()), theirs, rtol=1e-6)


def test_the_transverse_moment_turns_past_the_phone_once_a_turn():
    world = SpinWorld(SpinScene(drag="stokes", constants=(1e-9,), start_hz=30.0, jitter=0.0), VirtualClock())
    times = np.arange(900) / 900
    field = world.magnetic_field(times, PLACE)
    line = 2 * np.abs(np.mean(field * np.exp(-2j * np.pi * 30 * times)[:, None], axis=0))
    moment = 1e-7 * 0.03 * 0.714 / 0.2**3
    np.testing.assert_allclose(line, [2 * moment, moment, 0.0], atol=1e-3 * moment)


def test_in_full_motion_the_phone_sees_the_spin_beside_the_swings():
    world = MotionWorld(preset("tilted"), VirtualClock())
    times = np.sort(np.random.default_rng(2).uniform(0, 2, 1000))
    field = world.magnetic_field(times, PLACE)
    trial = np.arange(25, 35, 0.05)
    power = np.abs(np.exp(-2j * np.pi * np.outer(trial, times)) @ (field - field.mean(axis=0))) ** 2
    assert trial[power.sum(axis=1).argmax()] == pytest.approx(30, abs=0.1)  # a part of 1/2 s
    assert 0.2e-6 < np.abs(field - field.mean(axis=0)).max() < 5e-6  # the swings' mm, and 0.3 µT of the line


def test_where_no_top_is_up_only_the_base_is_left():
    world = SpinWorld(SpinScene(), VirtualClock())
    world.take_top()
    fallen = world.magnetic_field(np.array([0.5, 1.0]), PLACE)
    alone = base_beside(tuple(PLACE), world.scene.base)
    np.testing.assert_array_equal(fallen, [alone, alone])
