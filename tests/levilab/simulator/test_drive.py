"""What a drive does: its impulse on a top that nothing else acts on."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.signal import sawtooth, square

from levilab.simulator.scene import preset
from levilab.simulator.single import simulate

FREQUENCY, PHASE = 20.0, 1.0
#: Neither weight nor base: the drive alone turns the top, and so little that its axis stays where it is (1e-9).
ALONE = preset("driven").changed(
    {
        "base.strength_t_m": 0.0,
        "gravity_m_s2": 0.0,
        "start.position_m": [0.0, 0.0, 0.07],
        "start.velocity_m_s": [0.0, 0.0, 0.0],
        "start.precession": "none",
        "start.tilt_rad": 0.0,
        "drive.amplitude_t": 1e-12,
        "drive.frequency_hz": FREQUENCY,
        "drive.phase_rad": PHASE,
        "drive.direction": [1.0, 0.0, 0.0],
    }
)
SHAPES = {
    "sine": np.sin,
    "triangle": lambda phase: sawtooth(phase + np.pi / 2, 0.5),
    "square": square,
    "unipolar": lambda phase: (square(phase) + 1) / 2,
}


@pytest.mark.parametrize("waveform", SHAPES)
def test_the_drives_impulse_is_the_integral_of_its_waveform(waveform):
    motion = simulate(ALONE.changed({"drive.waveform": waveform}), 0.12, rate=100)
    across = motion.scene.top.moment_a_m2 * motion.scene.top.moment_tilt[1] * 1e-12  # axial moment: torque along y
    fine = np.linspace(0.0, 0.12, 120_001)
    impulse = cumulative_trapezoid(SHAPES[waveform](2 * np.pi * FREQUENCY * fine + PHASE), fine, initial=0.0)
    # a jump lies within a microsecond of the grid's points
    assert motion.angular_momentum[:, 1] == pytest.approx(across * impulse[::10_000], abs=abs(across) * 2e-6)
