"""Loose washers: each part's own spin by the law of drag, and the turn of the body by that of a free top."""

import math

import numpy as np
import pytest

from levilab.simulator.accuracy import longest_step
from levilab.simulator.kernels.motion import ARM
from levilab.simulator.model import model_of
from levilab.simulator.scene import preset
from levilab.simulator.schemes import SCHEMES
from levilab.simulator.single import simulate
from levilab.simulator.start import start_of
from support.scenes import KINDS

#: Nothing acts but drag, and friction too weak to be felt; the drive is there so that no kernel is compiled for this.
ALONE = {
    "base.strength_t_m": 0.0,
    "gravity_m_s2": 0.0,
    "start.place": "given",
    "start.position_m": [0.0, 0.0, 0.07],
    "start.velocity_m_s": [0.0, 0.0, 0.0],
    "start.precession": "none",
}
FREE = KINDS["loose washers"].changed(ALONE | {"drive.amplitude_t": 1e-30, "washers.coupling_n_m_s": 1e-20})


@pytest.mark.parametrize("share", [1.0, 0.25])
def test_washers_and_core_slow_by_their_shares_of_the_drag(share):
    c = 0.1
    scene = FREE.changed({"drag.coefficient": [c, 0.0], "washers.drag_share": share, "start.tilt_rad": 0.0})
    motion = simulate(scene, 0.2, rate=50)
    axial, washers = scene.top.inertia_axial_kg_m2, scene.washers.inertia_kg_m2
    # I_w dω_w/dt = −share c I₃ ω_w, and the core with the rest
    slowed = {"washers": share * c * axial / washers, "core": (1 - share) * c * axial / (axial - washers)}
    start = scene.start.spin_hz
    assert motion.washer_spin_hz == pytest.approx(start * np.exp(-slowed["washers"] * motion.time), rel=1e-12)
    assert core_spin_hz(motion) == pytest.approx(start * np.exp(-slowed["core"] * motion.time), rel=1e-12)


def core_spin_hz(motion):
    """By the momenta: all of it less the washers'."""
    top, washers = motion.scene.top, motion.scene.washers.inertia_kg_m2
    along = np.sum(motion.angular_momentum * motion.axis, axis=1)
    rest = along - 2 * np.pi * motion.washer_spin_hz * washers
    return rest / (top.inertia_axial_kg_m2 - washers) / (2 * np.pi)


@pytest.mark.parametrize("loose", [True, False])
def test_the_body_turns_about_its_axis_as_that_of_a_free_symmetric_top(loose):
    top = FREE.changed({"drag.coefficient": [0.0, 1e-30]}) if loose else preset("tilted").changed(ALONE)
    scene = top.changed({"start.tilt_rad": 0.3, "start.precession": "thesis"})
    motion = simulate(scene, 0.05, rate=2000)
    top, momentum = scene.top, motion.angular_momentum[0]
    size = float(np.linalg.norm(momentum))
    about, n, arm = momentum / size, motion.axis, motion.states[:, ARM]
    along = float(n[0] @ about)
    # Landau & Lifshitz § 35: the body turns against the line of nodes at L cosθ (1/I₃ − 1/I₁)
    nodes = np.cross(about, n)
    angle = np.unwrap(np.arctan2(np.sum(np.cross(nodes, arm) * n, axis=1), np.sum(nodes * arm, axis=1)))
    rate = size * along * (1 / top.inertia_axial_kg_m2 - 1 / top.inertia_transverse_kg_m2)
    assert angle - angle[0] == pytest.approx(rate * motion.time, abs=1e-9)


@pytest.mark.parametrize("constant", [1e2, 1e4])
def test_strong_drag_shortens_steps_until_the_decays_polynomial_is_exact(constant):
    scene = preset("undriven").changed({"drag.law": "stokes", "drag.coefficient": constant})
    for scheme in SCHEMES.values():
        step = longest_step(scene, model_of(scene), start_of(scene), scheme)
        most = constant * step * max(map(abs, (*scheme.drifts, *scheme.kicks)))
        assert most**12 / math.factorial(12) < np.finfo(float).eps  # the first term that exp's twelve leave out
