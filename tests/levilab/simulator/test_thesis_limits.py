"""The thesis's simulated limits of the spin, from maps of survival: tables of IC1 to IC4, with and without drag.

The thesis prints m = 25.5 g, which its own field cannot lift; 25.27 g gives its heights and its limits to 0.2 Hz.
It prints x(0) = 0.50 cm for IC3, a misprint: with 0.30 cm and 25.28 g its figures come out to 0.02 Hz.  Scan step:
0.02 Hz below, 0.01 Hz above, unless a test says otherwise.  Near the upper edge survival is not monotone: there are
islands of survival and of escape.
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
    "IC3": ([0.003, 0, 0.0725], [-0.002, 0, 0.0005], 0.01, 22.27, 70.50, 21.81),
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


def survival(start, spins, mass=0.02527):
    return simulate_many(scene("undriven", start, mass), {"start.spin_hz": spins}, 30.0, errors=False).survived


def lower_limit(start):
    """The lowest spin from which on every one of the scan survives."""
    spins = np.arange(20.5, 25.0, 0.02)
    return float(spins[np.flatnonzero(~survival(start, spins))[-1] + 1])


@pytest.mark.parametrize("start", STARTS)
def test_the_lower_limits_are_those_of_the_thesis(start):
    assert lower_limit(start) == pytest.approx(STARTS[start][3], abs=CLOSE)


@pytest.mark.parametrize("start", STARTS)
def test_an_edge_of_survival_lies_where_the_thesis_has_its_upper_limit(start):
    # islands: what a search calls the limit depends on its steps, but it ends between a survivor and a loss
    published = STARTS[start][4]
    alive = survival(start, np.arange(published - CLOSE, published + CLOSE, 0.01))
    assert alive.any()
    assert not alive.all()
    assert survival(start, np.arange(published - 20.0, published - 11.0, 0.25)).all()
    assert not survival(start, np.arange(published + 11.0, published + 20.0, 0.25)).any()


@pytest.mark.parametrize("start", STARTS)
def test_with_drag_the_top_comes_down_at_the_spin_of_the_thesis(start):
    motion = simulate(scene("friction", start).changed({"escape.height_m": 0.06}), 200.0, rate=None, tolerance=1e-6)
    assert motion.fell.name == "height"
    assert motion.spin_hz[-1] == pytest.approx(STARTS[start][5], abs=CLOSE)


def test_the_third_start_at_3_mm_has_all_three_figures_of_the_thesis():
    # scan steps: 0.01 Hz below; 0.5 Hz above, where 70.50 Hz is the last to survive (by 0.01 Hz islands reach 71.12)
    below, above = 22.0 + 0.01 * np.arange(61), 60.0 + 0.5 * np.arange(41)
    lost = below[~survival("IC3", below, 0.02528)]
    assert lost[-1] + 0.01 == pytest.approx(22.27, abs=0.03)
    assert above[survival("IC3", above, 0.02528)][-1] == 70.50
    slowing = scene("friction", "IC3", 0.02528).changed({"escape.height_m": 0.06})
    motion = simulate(slowing, 200.0, rate=None, tolerance=1e-6)
    assert motion.spin_hz[-1] == pytest.approx(21.81, abs=0.01)


def test_the_third_start_as_printed_is_lost_earlier_whatever_the_mass():
    # at 5 mm off the axis, a misprint of 3 mm, the top is lost about 2 Hz earlier than the thesis says
    for mass in (0.0250, 0.0252, 0.0254):
        printed = scene("undriven", "IC3", mass).changed({"start.position_m.0": 0.005})
        spins = np.arange(22.0, 22.6, 0.05)
        assert not simulate_many(printed, {"start.spin_hz": spins}, 30.0, errors=False).survived.any(), mass


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
