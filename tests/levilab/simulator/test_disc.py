"""A magnet of finite size against the integral over its volume, which is done otherwise here and by magpylib."""

import functools

import magpylib
import numpy as np
import pytest

from levilab.motion.summary import summarise
from levilab.simulator import disc
from levilab.simulator.ensemble import simulate_many
from levilab.simulator.field import field_of, flux_density, flux_gradient
from levilab.simulator.kernels.loads import Disc
from levilab.simulator.model import model_of
from levilab.simulator.problem import Problem, integrate_to_end, scheme_for
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate
from levilab.simulator.start import start_of
from levilab.simulator.stops import stops_between

DISC = preset("undriven").changed({"top.magnet": "disc"})
THICK = {"top.magnet_height_m": 0.010, "top.magnet_radius_m": 0.016, "start.position_m.2": 0.070}
SCENES = {
    "thesis": DISC,
    "thesis, exact": DISC.changed({"base.field": "exact"}),
    "10 mm high": DISC.changed(THICK),
    "10 mm high, exact, leaning": DISC.changed({**THICK, "base.field": "exact", "top.moment_tilt": [0.03, 0.97]}),
    "near the base": DISC.changed({"start.position_m": [0.001, 0, 0.035], "base.field": "exact"}),
}


def volume(radius, height, rings=8, layers=6, angles=20):
    """Nodes over the volume, shape (n, 4): Gauss–Legendre in r itself and in z, angles that begin elsewhere."""
    x, wx = np.polynomial.legendre.leggauss(rings)
    z, wz = np.polynomial.legendre.leggauss(layers)
    phi = 2 * np.pi * (np.arange(angles) + 0.3) / angles
    r = radius * (x + 1) / 2
    r, z, phi = (part.ravel() for part in np.meshgrid(r, z * height / 2, phi, indexing="ij"))
    weight = (wx * (x + 1) / 2)[:, None, None] * (wz / 2)[None, :, None] * np.full(angles, 1 / angles)
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), z, weight.ravel()])


@functools.cache
def true_end(scene, duration, step=1 / 600):
    """The state at the end with the integral over the volume, whose place 1.5 times the steps change by 1e-14 m.

    Twice the nodes change it by less.
    """
    model, top = model_of(scene), scene.top
    whole = Disc(model.magnet.axial, model.magnet.transverse, volume(top.magnet_radius_m, top.magnet_height_m))
    problem = Problem(scene, model._replace(magnet=whole), start_of(scene), scheme_for("kahan-li-8", model))
    return integrate_to_end(problem, stops_between(0.0, duration, step, scene.drive))


def errors(motion, end):
    return np.linalg.norm(motion.position[-1] - end[:3]), np.linalg.norm(motion.axis[-1] - end[6:9])


def force_and_torque(field, nodes, r, n, arm):
    offset = nodes[:, :1] * arm + nodes[:, 1:2] * np.cross(n, arm) + nodes[:, 2:3] * n
    moment = 0.97 * n + 0.03 * arm
    force = flux_gradient(field, r + offset) @ moment
    torque = np.cross(moment, flux_density(field, r + offset)) + np.cross(offset, force)
    return nodes[:, 3] @ force, nodes[:, 3] @ torque


def poses():
    """Places up to 8 mm off the axis and leans up to 0.15 rad, with the body's x axis anywhere."""
    random = np.random.default_rng(5)
    for _ in range(6):
        lean, phi, psi, away = random.uniform([0, 0, 0, 0], [0.15, 7, 7, 0.008])
        n = np.array([np.sin(lean) * np.cos(phi), np.sin(lean) * np.sin(phi), np.cos(lean)])
        e = np.cross(n, [0.3, 1, 0.1])
        e /= np.linalg.norm(e)
        yield np.array([away, 0, 0]), n, np.cos(psi) * e + np.sin(psi) * np.cross(n, e)


@pytest.mark.parametrize("name", SCENES)
def test_force_and_torque_are_those_of_the_volume(name):
    scene = SCENES[name]
    nodes, top, base = model_of(scene).magnet.nodes, scene.top, scene.base
    field = field_of(base.inner_radius_m, base.outer_radius_m, base.strength_t_m, base.field)
    whole = volume(top.magnet_radius_m, top.magnet_height_m, 14, 12, 40)
    for place, n, arm in poses():
        r = place + np.array([0, 0, scene.start.position_m[2]])
        for seen, true in zip(
            force_and_torque(field, nodes, r, n, arm), force_and_torque(field, whole, r, n, arm), strict=True
        ):
            assert np.linalg.norm(seen - true) < 1e-10 * np.linalg.norm(true)


def test_the_mean_field_over_the_disc_is_that_of_magpylib():
    current = 4 * np.pi * 1.40e-3 / magpylib.mu_0
    loops = [
        magpylib.current.Circle(diameter=2 * r, current=s * current, position=(0, 0, 0))
        for r, s in ((0.055, 1), (0.030, -1))
    ]
    nodes, whole = model_of(SCENES["thesis, exact"]).magnet.nodes, volume(0.0144, 0.0033)
    field = field_of(0.030, 0.055, 1.40e-3, "exact")
    for place, n, arm in poses():
        r = place + np.array([0, 0, 0.073])
        seen, true = (
            rule[:, 3] @ at(r + rule[:, :1] * arm + rule[:, 1:2] * np.cross(n, arm) + rule[:, 2:3] * n)
            for rule, at in (
                (nodes, lambda places: flux_density(field, places)),
                (whole, lambda places: sum(loop.getB(places) for loop in loops)),
            )
        )
        assert np.linalg.norm(seen - true) < 1e-11 * np.linalg.norm(true)


@pytest.mark.parametrize("name", SCENES)
def test_the_estimate_bounds_the_error_against_the_volume(name):
    scene, (duration, rate) = SCENES[name], (0.02, 4000) if name == "near the base" else (0.5, 600)
    motion = simulate(scene, duration, tolerance=1e-10, rate=None)
    place, axis = errors(motion, true_end(scene, duration, 1 / rate))
    assert motion.accuracy.reached
    assert place < 2e-11
    assert place <= motion.accuracy.position
    assert axis <= motion.accuracy.axis


@pytest.mark.parametrize("target", [1e-3, 1e-6])
def test_the_estimate_bounds_the_error_of_too_few_nodes(target, monkeypatch):
    # so few that what they leave out is far above what the steps do
    monkeypatch.setattr(disc, "TARGET", target)
    for scene in (SCENES["thesis"], SCENES["10 mm high"]):
        motion = simulate(scene, 1.0, step=1 / 500, rate=None, tolerance=1.0)
        many = simulate_many(scene, {}, 1.0, step=1 / 500, tolerance=1.0)
        end = true_end(scene, 1.0)
        place, axis = errors(motion, end)
        assert 1e-12 < place <= motion.accuracy.position
        assert axis <= motion.accuracy.axis
        assert np.linalg.norm(many.position[0] - end[:3]) <= many.position_error[0]


def test_near_the_base_the_estimate_has_the_error_of_the_nodes_in_it():
    # chosen for the start, they are too few at the end; shorter steps would not help, and none are tried
    scene = SCENES["thesis, exact"].changed({"start.spin_hz": 20.0})
    motion = simulate(scene, 1.0, rate=None)
    assert motion.fell.name == "height"
    place, axis = errors(motion, true_end(scene, motion.time[-1], 1 / 1000))
    assert place <= motion.accuracy.position < 1e-4
    assert axis <= motion.accuracy.axis
    assert not motion.accuracy.reached
    assert motion.accuracy.nodes > 0.9 * motion.accuracy.axis
    (note,) = summarise(motion, 1.0, 100.0, 0.0).notes[:1]
    assert "the magnet came so near to the base that the nodes" in note
