"""The thesis's simulated limits of the spin, from maps of survival: tables of IC1 to IC4, with and without drag.

The thesis prints m = 25.5 g, which its own field cannot lift; 25.27 g gives its heights and its limits.  Scan step:
0.02 Hz below, 0.01 Hz above.  Near the upper edge survival is not monotone: islands of survival and of escape.
"""

import numpy as np
import pytest

from levilab.simulator.ensemble import simulate_many
from levilab.simulator.kernels.motion import ARM
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate

#: (position, velocity, tilt), and the published limits: lower, upper, spin at a height of 6 cm with drag [Hz].
STARTS = {
    "IC1": ([0.001, 0, 0.071], [-0.0007, 0, 0.002], 0.01, 22.06, 70.90, 21.86),
    "IC2": ([0.0001, 0, 0.073], [0, 0, 0], 0.01, 21.78, 81.73, 21.65),
    "IC3": ([0.005, 0, 0.0725], [-0.002, 0, 0.0005], 0.01, 22.27, 70.50, 21.81),
    "IC4": ([0.001, 0, 0.071], [-0.0007, 0, 0.002], 0.10, 23.02, 65.01, 22.90),
}
#: What a limit published to 0.01 Hz may differ by: the mass, which is known to 0.01 g, moves it by so much.
CLOSE = 0.2


def scene(name, start, mass=0.02527):
    position, velocity, tilt = STARTS[start][:3]
    return preset(name).changed(
        {
            "start.position_m": position,
            "start.velocity_m_s": velocity,
            "start.tilt_rad": tilt,
            "top.mass_kg": mass,
        }
    )


def survival(start, spins):
    return simulate_many(scene("undriven", start), {"start.spin_hz": spins}, 30.0, errors=False).survived


def lower_limit(start):
    """The lowest spin from which on every one of the scan survives."""
    spins = np.arange(20.5, 25.0, 0.02)
    return float(spins[np.flatnonzero(~survival(start, spins))[-1] + 1])


@pytest.mark.parametrize("start", ["IC1", "IC2", "IC4"])
def test_the_lower_limits_are_those_of_the_thesis(start):
    assert lower_limit(start) == pytest.approx(STARTS[start][3], abs=CLOSE)


@pytest.mark.parametrize("start", ["IC1", "IC2", "IC4"])
def test_an_edge_of_survival_lies_where_the_thesis_has_its_upper_limit(start):
    # islands: what a search calls the limit depends on its steps, but it ends between a survivor and a loss
    published = STARTS[start][4]
    alive = survival(start, np.arange(published - CLOSE, published + CLOSE, 0.01))
    assert alive.any()
    assert not alive.all()
    assert survival(start, np.arange(published - 20.0, published - 11.0, 0.25)).all()
    assert not survival(start, np.arange(published + 11.0, published + 20.0, 0.25)).any()


@pytest.mark.parametrize("start", ["IC1", "IC2", "IC4"])
def test_with_drag_the_top_comes_down_at_the_spin_of_the_thesis(start):
    motion = simulate(scene("friction", start).changed({"escape.height_m": 0.06}), 200.0, rate=None, tolerance=1e-6)
    assert motion.fell.name == "height"
    assert motion.spin_hz[-1] == pytest.approx(STARTS[start][5], abs=CLOSE)


def test_the_third_start_as_printed_comes_out_otherwise_whatever_the_mass():
    # at 5 mm off the axis and −2 mm/s the top is lost about 1.7 Hz earlier than the thesis says
    assert lower_limit("IC3") == pytest.approx(24.4, abs=0.3)
    for mass in (0.0250, 0.0252, 0.0254):
        spins = np.arange(22.0, 22.6, 0.05)
        lost = ~simulate_many(scene("undriven", "IC3", mass), {"start.spin_hz": spins}, 30.0, errors=False).survived
        assert lost.all(), mass


def test_a_top_slower_than_the_quartic_allows_is_lost_from_every_start():
    # the linear window's lower edge at 7.30 cm is 21.65 Hz; no start does better
    for start in STARTS:
        assert not survival(start, np.array([20.8, 21.2, 21.4])).any()


def test_the_driven_top_stays_locked_for_five_minutes_with_its_line_at_the_drive():
    motion = simulate(preset("driven"), 300.0, rate=200.0, tolerance=1e-6)
    assert motion.survived
    # the body's x axis, where the dipole leans to, follows the drive's field and never slips by a turn
    arm = motion.states[:, ARM]
    behind = np.unwrap(np.arctan2(arm[:, 1], arm[:, 0])) / (2 * np.pi) - 30.0 * motion.time
    assert np.ptp(behind) < 0.75
    # the spin hunts; its mean lies below ν_d, because a wobbling axis adds to the turn: (1 − cos θ) of each
    assert motion.spin_hz.min() > 29.3
    assert motion.spin_hz.max() < 30.6
    # n_x + i n_y has a line at ν_d: 3.3 mHz wide with a window over 300 s
    wobble = (motion.axis[:, 0] + 1j * motion.axis[:, 1])[:-1] * np.hanning(motion.time.size - 1)
    lines = np.abs(np.fft.fft(wobble))
    frequency = np.fft.fftfreq(wobble.size, 1 / 200.0)
    near = np.abs(frequency - 30.0) < 0.15
    assert frequency[near][np.argmax(lines[near])] == pytest.approx(30.0, abs=1 / 300.0)
