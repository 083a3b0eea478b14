"""The compositions: their coefficients, and the order that they keep on every kind of scene."""

import numpy as np
import pytest

from levilab.simulator import SimulationError
from levilab.simulator.schemes import SCHEMES
from levilab.simulator.single import simulate
from order_conditions import residuals, trees
from support.scenes import KINDS

#: Steps [1/s] at which each scheme's error lies above rounding (1e-13) and its first term dominates; whole numbers
#: of them fit into a quarter of the drive's period.
RATES = {
    "strang": (1200, 2400, 4800),
    "suzuki-4": (600, 1200, 2400),
    "blanes-moan-4": (1200, 2400, 3600),  # its first term is so small that the next is seen at longer steps
    "kahan-li-6": (360, 720, 1440),
    "blanes-moan-6": (120, 240, 480),
    "levitron-6": (120, 240, 360),
    "kahan-li-8": (240, 360, 480),
}


def end(scene, scheme, rate):
    motion = simulate(scene, 0.6, rate=None, scheme=scheme, step=1 / rate)
    return np.concatenate([motion.position[-1] * 10, motion.axis[-1]])


@pytest.mark.parametrize("kind", KINDS)
def test_each_scheme_keeps_its_order_on_every_kind_of_scene(kind):
    scene = KINDS[kind]
    reference = end(scene, "kahan-li-8", 3000)
    for scheme in SCHEMES.values():
        if kind in {"tilted with drag", "loose washers"} and not scheme.any_split:
            continue
        errors = [np.linalg.norm(end(scene, scheme.name, rate) - reference) for rate in RATES[scheme.name]]
        slope = -np.polyfit(np.log(RATES[scheme.name]), np.log(errors), 1)[0]
        # the next term of the error is seen at the coarsest step: a higher slope is no fault, a lower one is
        assert slope > scheme.order - 0.5, (scheme.name, errors)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_a_composition_is_symmetric_and_adds_up_to_one_step(scheme):
    assert scheme.drifts == scheme.drifts[::-1]
    assert scheme.kicks == scheme.kicks[::-1]
    assert len(scheme.drifts) == scheme.stages + 1
    assert sum(scheme.drifts) == pytest.approx(1, abs=1e-15)
    assert sum(scheme.kicks) == pytest.approx(1, abs=1e-15)
    assert {type(number) for number in (*scheme.drifts, *scheme.kicks)} == {float}


def test_there_are_as_many_trees_of_an_order_as_the_literature_has():
    # Hairer, Nørsett, Wanner II.14: special Nyström trees
    assert [len(trees(order)) for order in range(1, 8)] == [1, 1, 2, 3, 6, 10, 20]


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_a_composition_meets_all_conditions_of_its_order_and_not_those_of_the_next(scheme):
    # Hairer, Nørsett, Wanner II.14: all trees of ÿ = f(y), so no term of the error is missed that one motion hides
    drifts, kicks = np.array(scheme.drifts), np.array(scheme.kicks)
    assert np.abs(residuals(drifts, kicks, scheme.order)).max() < 5e-15
    assert np.abs(residuals(drifts, kicks, scheme.order + 1)).max() > 1e-7


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_the_order_on_the_harmonic_oscillator_whose_step_is_a_matrix(scheme):
    # independent of our kernels: drift and kick of ẍ = −x are shears, and a step should be a rotation
    def error(h):
        step = np.eye(2)
        for a, b in zip(scheme.drifts, (*scheme.kicks, 0.0), strict=True):
            step = np.array([[1, 0], [-b * h, 1]]) @ np.array([[1, a * h], [0, 1]]) @ step
        return float(np.abs(step - [[np.cos(h), np.sin(h)], [-np.sin(h), np.cos(h)]]).max())

    h = {2: 0.02, 4: 0.2, 6: 0.4, 8: 0.4}[scheme.order]
    assert np.log2(error(h) / error(h / 2)) > scheme.order + 1 - 0.35  # of one step: one order more


def test_a_scheme_is_refused_where_it_would_lose_its_order():
    with pytest.raises(SimulationError, match=r"loses its order: take one of strang, suzuki-4, kahan-li-6, kahan-li-8"):
        simulate(KINDS["tilted with drag"], 0.1, scheme="blanes-moan-6")
    with pytest.raises(SimulationError, match="expected one of strang"):
        simulate(KINDS["aligned"], 0.1, scheme="rk4")
