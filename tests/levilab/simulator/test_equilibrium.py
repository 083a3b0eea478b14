"""Where the top of a scene floats: with any field, and with a magnet of finite size."""

import numpy as np
import pytest

from levilab.simulator.ensemble import simulate_many
from levilab.simulator.equilibrium import _disc_stiffnesses, axial_field, floating_height, stability_of, windows_over
from levilab.simulator.field import flux_density
from levilab.simulator.model import base_field
from levilab.simulator.scene import SceneError, preset
from levilab.simulator.single import simulate

UNDRIVEN = preset("undriven")
DISC = UNDRIVEN.changed({"base.field": "exact", "top.magnet": "disc"})


def test_a_magnet_of_finite_size_moves_the_window_as_computed_elsewhere():
    point, disc = (axial_field(scene)(np.array([0.073]))[:, 0] for scene in (UNDRIVEN, DISC))
    assert disc[1] / point[1] == pytest.approx(1.037, abs=0.0005)
    assert disc[2] / point[2] == pytest.approx(1.82, abs=0.005)
    assert stability_of(UNDRIVEN).windows[-1].low == pytest.approx(0.07004, abs=5e-6)
    assert stability_of(DISC).windows[-1].low == pytest.approx(0.06704, abs=5e-6)


def test_warmth_weakens_base_and_top_and_with_both_the_masses_that_float():
    warm = UNDRIVEN.changed({"temperature_rise_k": 5.0})
    weak = UNDRIVEN.changed({"base.strength_t_m": 1.40e-3 * 0.99, "top.moment_a_m2": -0.714 * 0.99})
    window, by_hand, cold = (stability_of(scene).windows[-1] for scene in (warm, weak, UNDRIVEN))
    assert (window.light, window.heavy) == pytest.approx((by_hand.light, by_hand.heavy), rel=1e-12)
    # both are proportional to strength times moment; the heights are those of the field's shape
    assert window.heavy / cold.heavy == pytest.approx(0.99**2, rel=1e-9)
    assert window.low == pytest.approx(cold.low, abs=1e-9)
    moved = [simulate(scene.changed({"top.mass_kg": 0.0247}), 0.5).states for scene in (warm, weak)]
    assert moved[0] == pytest.approx(moved[1], rel=1e-9, abs=1e-12)


def test_every_field_gives_the_same_axis():
    heights = [
        floating_height(UNDRIVEN.changed({"base.field": field})) for field in ("paraxial-2", "paraxial-8", "exact")
    ]
    assert heights == pytest.approx([heights[0]] * 3, abs=1e-12)


def test_a_top_started_at_rest_where_it_floats_stays_there():
    scene = UNDRIVEN.changed({"start.place": "equilibrium", "start.tilt_rad": 0.0})
    motion = simulate(scene, 10.0)
    assert np.abs(motion.position - motion.position[0]).max() < 1e-12
    assert motion.position[0, 2] == floating_height(scene)


def test_a_steady_precession_keeps_its_tilt():
    scene = UNDRIVEN.changed(
        {"start.place": "equilibrium", "start.tilt_rad": 0.001, "start.precession": "steady", "start.spin_hz": 40.0}
    )
    # two nutations long: the sideways swing that the tilt sets off, of 0.8 Hz, has hardly begun
    steady = simulate(scene, 0.04, rate=1000)
    other = simulate(scene.changed({"start.precession": "thesis"}), 0.04, rate=1000)
    assert np.ptp(other.tilt) > 4e-4
    assert np.ptp(steady.tilt) < 2e-5


def test_a_mass_that_cannot_float_is_reported_the_nearest_that_can():
    heavy = UNDRIVEN.changed({"top.mass_kg": 0.0255, "start.place": "equilibrium"})
    with pytest.raises(SceneError, match=r"does not float over this base; the nearest that does has 25\.48 g"):
        floating_height(heavy)
    light = UNDRIVEN.changed({"top.mass_kg": 0.010})
    assert stability_of(light).nearest == pytest.approx(0.02474, abs=1e-5)
    nearest = UNDRIVEN.changed({"top.mass_kg": stability_of(heavy).nearest})
    assert stability_of(nearest).floating is not None


def test_the_linear_window_agrees_with_simulated_small_motions():
    # at rest where it floats and tilted by 1e-4; above the upper edge the motion grows slowly at first
    calm = UNDRIVEN.changed({"start.place": "equilibrium", "start.tilt_rad": 1e-4})
    ((low, high),) = stability_of(calm).floating.spins
    alive = [
        simulate(calm.changed({"start.spin_hz": spin}), 30.0, rate=None, tolerance=1e-6).survived
        for spin in (low - 0.1, low + 0.1, high - 0.5, high + 2.0)
    ]
    assert alive == [False, True, True, False]


def test_a_moment_across_the_axis_lifts_nothing():
    across = UNDRIVEN.changed({"top.moment_tilt": [0.1, 0.0], "start.place": "equilibrium"})
    with pytest.raises(SceneError, match=r"top\.moment_tilt\.1 = 0: a field lifts"):
        floating_height(across)
    found, over_masses = stability_of(across), windows_over(across, [0.025])
    assert (found.windows, found.equilibria, over_masses.adiabatic) == ((), (), ())
    assert np.isnan(over_masses.heights).all()


def test_without_weight_nothing_floats_and_that_is_said():
    with pytest.raises(SceneError, match="gravity_m_s2 = 0"):
        stability_of(UNDRIVEN.changed({"gravity_m_s2": 0.0}))


def test_a_tiny_disc_is_a_point():
    tiny = UNDRIVEN.changed({"base.field": "exact", "top.magnet": "disc", "top.magnet_radius_m": 1e-4})
    disc = stability_of(tiny.changed({"top.magnet_height_m": 1e-4})).floating
    point = stability_of(UNDRIVEN.changed({"base.field": "exact"})).floating
    # (radius/field's length)² of the magnet is 1e-5
    assert disc.spins[0] == pytest.approx(point.spins[0], rel=2e-5)
    assert disc.radial == pytest.approx(point.radial, rel=3e-4)


def test_the_window_of_a_disc_magnet_is_that_of_its_simulated_motion():
    scene = UNDRIVEN.changed({"base.field": "exact", "top.magnet": "disc", "top.mass_kg": 0.02628})
    floating = stability_of(scene).floating
    slowest = floating.spins[0][0]
    small = scene.changed({"start.position_m": [1e-5, 0, floating.height], "start.velocity_m_s": [0, 0, 0]})
    # the slower one is gone after 0.8 s
    around = simulate_many(
        small.changed({"start.tilt_rad": 1e-4}), {"start.spin_hz": slowest + np.array([-0.1, 0.1])}, 1.5, errors=False
    )
    # a point in the averaged field would have it at 21.68 Hz
    assert slowest == pytest.approx(21.43, abs=0.01)
    assert around.survived.tolist() == [False, True]


def test_the_stiffnesses_of_an_equilibrium_are_those_of_the_field_strength_over_the_mass():
    # U = mgz + |mu||B| of a moment that follows the field, by second differences over 0.1 mm, good to 1e-5
    found, h = stability_of(UNDRIVEN), 1e-4
    z, field = found.floating.height, base_field(UNDRIVEN)
    strength = [
        np.linalg.norm(flux_density(field, [x * h, 0.0, z + dz * h]))
        for x, dz in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    middle, *sides, up, down = strength
    scale = abs(UNDRIVEN.top.moment_a_m2) / UNDRIVEN.top.mass_kg / h**2
    assert found.floating.radial == pytest.approx(scale * (sum(sides) - 2 * middle), rel=1e-4)
    assert found.floating.axial == pytest.approx(scale * (up + down - 2 * middle), rel=1e-4)


def test_of_a_moment_that_leans_in_a_disc_its_part_along_the_axis_counts():
    leaning = DISC.changed({"top.moment_tilt": [0.0, 0.8], "top.moment_a_m2": DISC.top.moment_a_m2 / 0.8})
    one, other = (_disc_stiffnesses(scene)(np.array([0.07, 0.073])) for scene in (DISC, leaning))
    np.testing.assert_allclose(one, other, rtol=1e-6)


@pytest.mark.parametrize("changes", [{}, {"base.field": "paraxial-4", "top.moment_a_m2": -0.70}])
def test_the_windows_of_many_masses_are_those_of_each(changes):
    scene = preset("undriven").changed(changes)
    masses = np.linspace(0.0240, 0.0256, 9)
    found = windows_over(scene, masses)
    assert 2 < np.isfinite(found.heights).sum() < 9
    for i, mass in enumerate(masses):
        one = stability_of(scene.changed({"top.mass_kg": mass}))
        spins = one.floating.spins[0] if one.floating and one.floating.spins else (np.nan, np.nan)
        assert found.heights[i] == pytest.approx(
            one.floating.height if one.floating else np.nan, rel=1e-12, nan_ok=True
        )
        # the discriminant of the quartic loses digits as its sums do
        assert (found.slowest[i], found.fastest[i]) == pytest.approx(spins, rel=1e-11, nan_ok=True)
    (window,) = found.adiabatic
    assert [window.light < mass < window.heavy for mass in masses] == np.isfinite(found.heights).tolist()
