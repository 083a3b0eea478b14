"""A drive that yields while it takes hold, on the pendulum that a top under a drive is."""

import math

import numpy as np
import pytest

from levilab.acquisition.grip import COUNTS, GRIP_GATE_S, Grip

#: Greatest pull of a square wave of 10 Vpp on the top of the scene `practice` [rad/s²], by
#: moment · 4/π · field/(2 · moment of inertia), and the air's drag on it at 30 Hz [rad/s²].
PULL, DRAG = 2.14, 0.60
STEP_S, BETWEEN_S = 0.005, 0.05


def slip_after(angle, *, yields):
    """How far the spin is from the drive in the last swing of a try at most [Hz].

    angle: from the drive to the moment when the drive comes on [rad].
    """
    spin, grip = 2 * math.pi * 30.0, Grip(30.0)
    drive, worst = grip.drive, 0.0
    while not grip.is_over:
        turned, steps = 0.0, 0
        for k in range(round((BETWEEN_S + GRIP_GATE_S) / STEP_S)):
            spin -= (DRAG + PULL * math.sin(angle)) * STEP_S
            angle += (spin - 2 * math.pi * drive) * STEP_S
            if k * STEP_S >= BETWEEN_S:
                turned, steps = turned + spin, steps + 1
        following = grip.follow(turned / steps / 2 / math.pi)
        drive = following if yields else drive
        if grip.counts > COUNTS - 8:
            worst = max(worst, abs(spin / 2 / math.pi - drive))
    return worst


def test_a_drive_that_yields_takes_hold_whatever_way_the_top_points():
    angles = np.linspace(-math.pi, math.pi, 24, endpoint=False).tolist()
    assert max(slip_after(angle, yields=True) for angle in angles) < 0.2
    lost = [angle for angle in angles if slip_after(angle, yields=False) > 0.6]
    assert len(lost) > 4  # they turn over and over


def test_a_spin_that_it_could_not_hold_moves_no_drive_and_ends_the_try():
    grip = Grip(30.0)
    assert [grip.follow(spin) for spin in (None, 60.0, 29.0, 31.5)] == [30.0, 30.0, 29.6, 29.6]
    assert (grip.missed, grip.is_lost) == (1, False)
    grip.follow(None)
    grip.follow(27.0)
    assert grip.is_lost


def test_a_drive_stays_within_its_limits():
    grip = Grip(30.0, lowest=29.9, highest=30.1)
    assert [grip.follow(spin) for spin in (29.5, 29.5, 30.5, 30.5)] == [29.9, 29.9, 30.1, 30.1]


@pytest.mark.parametrize("spin", [30.0, 29.9])
def test_a_drive_stands_still_after_its_counts(spin):
    grip = Grip(30.0)
    while not grip.is_over:
        grip.follow(spin)
    assert (grip.counts, grip.drive) == (COUNTS, pytest.approx(spin, abs=1e-3))
