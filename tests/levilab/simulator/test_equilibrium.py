"""Where the top of a scene floats: with any field, with a magnet of finite size, and by the command."""

import json

import numpy as np
import pytest

from levilab.errors import UsageError
from levilab.files import CannotWrite
from levilab.simulator.ensemble import simulate_many
from levilab.simulator.equilibrium import advice, axial_field, floating_height, stability_of
from levilab.simulator.field import flux_density
from levilab.simulator.model import base_field
from levilab.simulator.scene import SceneError, preset
from levilab.simulator.single import simulate
from levilab.stability.figure import map_figure
from levilab.stability.map import span_of, survival, survival_map
from levilab.stability.table import as_document, place_for_map, print_stability, remarks, write_map

UNDRIVEN = preset("undriven")
DISC = UNDRIVEN.changed({"base.field": "exact", "top.magnet": "disc"})


def test_a_magnet_of_finite_size_moves_the_window_as_computed_elsewhere():
    point, disc = (axial_field(scene)(np.array([0.073]))[:, 0] for scene in (UNDRIVEN, DISC))
    assert disc[1] / point[1] == pytest.approx(1.037, abs=0.0005)
    assert disc[2] / point[2] == pytest.approx(1.82, abs=0.005)
    assert stability_of(UNDRIVEN).windows[-1].low == pytest.approx(0.07004, abs=5e-6)
    assert stability_of(DISC).windows[-1].low == pytest.approx(0.06704, abs=5e-6)


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


def test_a_mass_that_cannot_float_is_told_the_nearest_that_can():
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


def test_the_table_has_the_figures_of_the_thesis_beside(capsys):
    print_stability(stability_of(UNDRIVEN))
    shown = capsys.readouterr().out
    for figure in ("7.0035 – 7.5683", "24.742 – 25.485", "21.65", "80.60", "14.005, lacks it", "21.86 ± 0.08"):
        assert figure in shown
    print_stability(stability_of(UNDRIVEN.changed({"top.moment_a_m2": -0.715})))
    assert "thesis's estimate" in (other := capsys.readouterr().out)
    assert "lacks the factor 2√(I₁/I₃)" in other
    assert "21.86" not in other


def test_the_document_has_no_number_that_json_has_not():
    for scene in (UNDRIVEN, UNDRIVEN.changed({"top.mass_kg": 0.03}), DISC):
        json.dumps(as_document(stability_of(scene)), allow_nan=False)


def test_survival_is_found_over_spin_and_mass():
    alive = survival(UNDRIVEN, np.array([20.0, 30.0]), np.array([0.0252, 0.0253, 0.0260]), 5.0)
    assert alive.tolist() == [[False, True], [False, True], [False, False]]


def test_a_map_is_written_as_a_table_and_a_picture(tmp_path):
    found = survival_map(UNDRIVEN, spins=(20.0, 32.0, 4), masses=(0.0252, 0.0256, 3), duration=2.0)
    assert found.spin_step == 4.0
    table, picture = write_map(found, tmp_path / "new")
    lines = table.read_text(encoding="utf-8").splitlines()
    assert lines[:3] == ["mass_kg,spin_hz,survived", "0.0252,20,0", "0.0252,24,1"]
    assert len(lines) == 1 + 12
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert np.isnan(found.slowest[-1])  # nothing of 25.6 g floats


def test_masses_of_a_map_in_grams_are_refused_with_the_same_in_kilograms():
    with pytest.raises(UsageError, match=r"Were grams meant\?  They are 0\.0252:0\.0256:0\.0002"):
        survival_map(UNDRIVEN, spins=(20.0, 32.0, 4), masses=(25.2, 25.6, 3), duration=2.0)


def test_a_map_has_a_legend_and_marks_the_masses_at_which_the_theory_ends():
    found = survival_map(UNDRIVEN, spins=(20.0, 32.0, 4), masses=(0.0245, 0.0256, 3), duration=2.0)
    assert found.floating == ((pytest.approx(0.024742, abs=1e-6), pytest.approx(0.025485, abs=1e-6)),)
    figure = map_figure(found)
    (axes,) = figure.axes
    marked = [line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--"]
    assert marked == pytest.approx([24.742, 25.485], abs=1e-3)
    (legend,) = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert said[:2] == ["still up after 2 s", "lost before"]
    assert said[3] == "no stable equilibrium beyond 24.74 and 25.48 g: theory ends there"
    assert "may only last a while" in " ".join(text.get_text() for text in figure.texts)
    inside = survival_map(UNDRIVEN, spins=(20.0, 32.0, 2), masses=(0.0250, 0.0252, 2), duration=10.0)
    assert inside.notes == ()
    assert len(map_figure(inside).legends[0].get_texts()) == 3


def test_a_map_of_spins_the_other_way_round_has_its_edges_there():
    found = survival_map(UNDRIVEN, spins=(-32.0, -20.0, 4), masses=(0.0250, 0.0254, 2), duration=0.1)
    drawn = np.concatenate([line.get_xdata() for line in map_figure(found).axes[0].lines if len(line.get_xdata()) == 2])
    assert set(-found.slowest) <= set(drawn)


def test_spans_are_read_and_what_is_none_is_told():
    assert span_of("spins", "20:23:0.5") == (20.0, 23.0, 7)
    assert span_of("spins", "-30:-20:4") == (-30.0, -22.0, 3)
    low, high, count = span_of("masses", "0.0245:0.0256:0.0001")
    assert (low, high, count) == (0.0245, pytest.approx(0.0256, rel=1e-12), 12)


@pytest.mark.parametrize(
    "text", ["20", "20:30", "20:30:x", "30:20:1", "20:30:0", "20:30:-1", "20:20:1", "0:inf:1", "0:nan:1"]
)
def test_a_span_that_is_none_is_refused_with_what_one_looks_like(text):
    with pytest.raises(UsageError, match=r"spins = .*: LOW:HIGH:STEP is expected, such as 20:30:0\.5"):
        span_of("spins", text)


def test_a_map_of_too_many_tops_or_of_no_masses_is_refused():
    with pytest.raises(UsageError, match="at most 250000 values"):
        span_of("spins", "0:1:1e-9")
    with pytest.raises(UsageError, match="1000 spins and 1000 masses are 1000000 tops"):
        survival_map(UNDRIVEN, spins=(20.0, 30.0, 1000), masses=(0.0250, 0.0254, 1000))
    with pytest.raises(UsageError, match="masses = from 0 kg: masses above 0"):
        survival_map(UNDRIVEN, masses=(0.0, 0.03, 2))


def test_the_command_maps_the_spins_and_masses_that_it_is_given(levilab, tmp_path):
    words = ["stability", "undriven", "--spins", "20:32:4", "--masses", "0.0252:0.0254:1e-4", "--duration", "2"]
    refused = levilab(*words, check=2)
    assert "give --map, too" in refused.stderr
    assert refused.stdout == ""
    done = levilab(*words, "--map", "--out", "there", "--json")
    assert "note: 2 s are short" in done.stderr
    found = json.loads(done.stdout)["map"]
    assert found["spins_hz"] == [20.0, 24.0, 28.0, 32.0]
    assert found["masses_kg"] == pytest.approx([0.0252, 0.0253, 0.0254])
    assert len((tmp_path / "there" / "survival.csv").read_text(encoding="utf-8").splitlines()) == 1 + 12


def test_the_help_of_the_benchmark_names_the_extra(levilab):
    told = " ".join(levilab("benchmark", "simulator", "--help").stdout.split())
    assert "pip install 'levilab[peers]'" in told
    assert "pip install -e '.[peers]'" in told


def test_what_the_theory_leaves_out_of_a_scene_is_told():
    assert remarks(stability_of(UNDRIVEN)) == []
    (drag,) = remarks(stability_of(preset("friction")))
    assert "drag is left out" in drag
    assert "lost" in drag
    loose = " ".join(remarks(stability_of(preset("loose-washers"))))
    assert all(f"{word} left out" in loose for word in ("the drag is", "the drive is", "the loose washers are"))


def test_a_mass_that_cannot_float_is_named_in_grams():
    assert advice(stability_of(UNDRIVEN.changed({"top.mass_kg": 0.0255}))).startswith("a top of 25.5 g does not float")
    asked = advice(stability_of(UNDRIVEN.changed({"top.mass_kg": 25.26})))
    assert asked.endswith("Were grams meant?  25.26 g are top.mass_kg = 0.02526")
    other = advice(stability_of(UNDRIVEN.changed({"top.moment_a_m2": 1e-9, "top.mass_kg": 0.0255})))
    assert "grams" not in other


def test_a_map_that_is_there_is_not_written_over(tmp_path):
    (tmp_path / "survival.csv").write_text("precious", encoding="utf-8")
    with pytest.raises(CannotWrite, match="there already"):
        place_for_map(tmp_path)
    with pytest.raises(CannotWrite, match="another folder"):
        place_for_map(tmp_path / "survival.csv" / "inside")


def test_a_map_is_of_the_masses_that_are_lifted():
    # the lower region would pull this moment down, though its masses are nearer to 300 g
    found = survival_map(UNDRIVEN.changed({"top.mass_kg": 0.3}), spins=(28.0, 32.0, 2), duration=0.1)
    assert 0.024 < found.masses[0] < found.masses[-1] < 0.027


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
    around = simulate_many(
        small.changed({"start.tilt_rad": 1e-4}), {"start.spin_hz": slowest + np.array([-0.1, 0.1])}, 10.0, errors=False
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
