"""Varied numbers: checked as a scene checks them, and the same bits as scene by scene."""

import numpy as np
import pytest

from levilab.errors import SimulationError
from levilab.simulator import SceneError
from levilab.simulator.accuracy import longest_step
from levilab.simulator.field import flux_density
from levilab.simulator.kernels.motion import R
from levilab.simulator.kernels.pieces import HEIGHT, RADIUS
from levilab.simulator.model import base_field, model_of
from levilab.simulator.numbers import numbers, numbers_of, split, uniform
from levilab.simulator.problem import scheme_for
from levilab.simulator.scene import Scene, preset
from levilab.simulator.start import start_of
from levilab.simulator.varied import batches

RANDOM = np.random.default_rng(5)
FULL = preset("driven").changed({"drag.law": "mixed", "start.precession": "steady"})
VARIED = {
    "the start": (FULL, {
        "start.spin_hz": RANDOM.uniform(-40, 40, 20), "start.tilt_rad": RANDOM.uniform(0.001, 0.3, 20),
        "start.position_m.0": RANDOM.uniform(-0.01, 0.01, 20), "start.position_m.2": RANDOM.uniform(0.06, 0.08, 20),
        "start.velocity_m_s.1": RANDOM.uniform(-0.1, 0.1, 20),
    }),
    "the top": (FULL, {
        "top.mass_kg": RANDOM.uniform(0.02, 0.03, 20), "top.moment_a_m2": RANDOM.uniform(-1, -0.5, 20),
        "top.inertia_axial_kg_m2": RANDOM.uniform(1.5e-6, 2e-6, 20), "top.moment_tilt.0": np.repeat([0.0, 0.03], 10),
    }),
    "what acts on it": (FULL, {
        "drag.coefficient": np.repeat([0.0, 1e-3, 4e-3, 2e-2], 5), "drag.law": np.tile(["newton", "disc"], 10),
        "drive.frequency_hz": RANDOM.uniform(20, 40, 20), "drive.amplitude_t": np.tile([0, 1e-4, 2e-4, 5e-4], 5),
        "drive.phase_rad": RANDOM.uniform(0, 6, 20), "gravity_m_s2": RANDOM.uniform(9, 10, 20),
        "drive.direction.0": np.repeat([0.0, -1e-3, 3.0, 1e200], 5), "drive.direction.2": RANDOM.uniform(-2, 2, 20),
    }),
    "the base": (preset("undriven"), {
        "base.strength_t_m": RANDOM.uniform(1e-3, 2e-3, 20), "base.inner_radius_m": RANDOM.uniform(0.02, 0.03, 20),
        "base.tilt_rad": np.tile([0.0, 0.01], 10), "base.tilt_azimuth_rad": RANDOM.uniform(0, 6, 20),
        "base.thickness_m": np.repeat([0.0, 0.01], 10), "base.field": np.tile(["paraxial-2", "paraxial-4"], 10),
        "escape.radius_m": RANDOM.uniform(0.01, 0.03, 20),
    }),
    "loose washers": (preset("loose-washers"), {
        "washers.inertia_kg_m2": RANDOM.uniform(1e-7, 5e-7, 20), "washers.drag_share": RANDOM.uniform(0, 1, 20),
        "washers.coupling_n_m_s": np.tile([0.0, 1e-7], 10), "start.spin_hz": RANDOM.uniform(20, 40, 20),
    }),
    "where it floats": (preset("undriven").changed({"start.place": "equilibrium"}), {
        "top.mass_kg": RANDOM.uniform(0.0249, 0.0254, 20), "start.spin_hz": RANDOM.uniform(20, 40, 20),
        "base.strength_t_m": np.repeat([1.40e-3, 1.41e-3], 10),
    }),
    "the temperature": (preset("undriven").changed({"start.precession": "steady"}), {
        "temperature_rise_k": RANDOM.uniform(-20, 20, 20),
        "base.temperature_coefficient_per_k": np.tile([-2e-3, 0], 10),
        "top.temperature_coefficient_per_k": RANDOM.uniform(-3e-3, -1e-3, 20),
    }),
    "a disc": (preset("undriven").changed({"top.magnet": "disc"}), {
        "start.position_m.2": np.linspace(0.05, 0.2, 20), "top.magnet_radius_m": np.tile([0.01, 0.014], 10),
    }),
}  # fmt: skip


@pytest.mark.parametrize("case", VARIED)
def test_many_tops_have_the_numbers_of_each_scene_to_the_bit(case):
    scene, over = VARIED[case]
    found = batches(scene, over)
    assert sorted(int(i) for batch in found for i in batch.where) == list(range(20))
    for batch in found:
        for j, where in enumerate(batch.where):
            one = scene.changed({key: values[where].item() for key, values in over.items()})
            start = start_of(one)
            model = model_of(one, tuple(start[R]))
            assert batch.starts[j].tobytes() == start.tobytes()
            assert batch.numbers[j].tolist() == numbers_of(model)
            assert type(batch.model.drag) is type(model.drag)
            assert type(batch.model.drive) is type(model.drive)
            assert type(batch.model.body.gravity) is type(model.body.gravity)
            assert batch.scheme is scheme_for(None, model)
            assert batch.longest[j] == longest_step(one, model, start, batch.scheme)
            assert (batch.runs[j, RADIUS], batch.runs[j, HEIGHT]) == (one.escape.radius_m, one.escape.height_m)


def test_a_field_at_many_places_has_the_bits_of_each():
    places = np.random.default_rng(1).uniform([-0.02, -0.02, 0.05], [0.02, 0.02, 0.1], (33, 3))
    for kind in ("paraxial-2", "paraxial-4"):
        field = base_field(Scene().changed({"base.field": kind}))
        together = flux_density(field, places)
        assert all(
            flux_density(field, place).tobytes() == b.tobytes() for place, b in zip(places, together, strict=True)
        )


@pytest.mark.parametrize(
    ("over", "message"),
    [
        ({"top.mass_kg": [0.025, -0.1]}, r"top\.mass_kg = '-0\.1': .*greater than.* \(index 1 of the values\)"),
        ({"start.spin_hz": [[30.0, 31.0, np.nan]]}, r"start\.spin_hz = 'nan': .*finite.* \(index 0, 2 of the values\)"),
        ({"start.position_m.2": [0.07, -0.07]}, r"start\.position_m = .*-0\.07.*height.* \(index 1 of the values\)"),
        ({"start.position_m.0": [0.0, 0.03]}, r"start\.position_m = .*escape\.radius_m.* \(index 1 of the values\)"),
        ({"top.inertia_axial_kg_m2": [1.7e-6, 1.8e-6, 3e-6]}, r"inertia_axial.*at most twice.* \(index 2 of the"),
        ({"drag.coefficient": [0.0, -1.0], "drag.law": "stokes"}, r"drag\.coefficient = '-1\.0'.* \(index 1 of the"),
        ({"base.field": ["exact", "paraxial-3"]}, r"base\.field = 'paraxial-3'.* \(index 1 of the values\)"),
        ({"top.mass_kg": [True, False]}, r"top\.mass_kg = 'False': .*number"),
        ({"start.place": "equilibrium", "top.mass_kg": [0.025, 0.05]}, r"= 0\.05: .*does not float.* \(index 1 of"),
        ({"base.thickness_m": [0.01, 1e-7]}, r"^thickness = 1e-07 m: .*at least 1e-05 m, .* \(index 1 of the values\)"),
        ({"top.mas_kg": [0.025, 0.05]}, r"there is no key top\.mas_kg"),
        ({"top": [1.0, 2.0]}, r"top = 1\.0: a table is expected"),
        ({"observed": ["motion", "spin"]}, r"observed = spin: .*need observed = motion \(index 1 of the values\)"),
    ],
)
def test_a_value_that_a_scene_does_not_allow_is_named_with_its_place(over, message):
    with pytest.raises(SceneError, match=message):
        batches(preset("undriven"), over)


def test_tops_of_one_kind_are_in_the_order_of_the_map():
    (batch,) = batches(preset("undriven"), {"name": np.tile(["one", "other"], 3), "start.spin_hz": np.arange(20, 26)})
    assert batch.where.tolist() == [0, 1, 2, 3, 4, 5]
    assert (np.diff(batch.starts[:, 15]) > 0).all()


def test_lists_of_unequal_lengths_are_refused():
    with pytest.raises(SimulationError, match=r"start\.spin_hz: lists of unequal lengths"):
        batches(preset("undriven"), {"start.spin_hz": [[30.0, 31.0], [32.0]]})


def test_a_thousand_tops_are_not_a_thousand_scenes(monkeypatch):
    made = []
    monkeypatch.setattr(Scene, "changed", lambda *arguments, change=Scene.changed: made.append(1) or change(*arguments))
    over = {"start.spin_hz": np.linspace(20, 40, 1000)[:, None], "top.mass_kg": [0.0252, 0.0253]}
    (batch,) = batches(preset("undriven"), over)
    assert batch.where.tolist() == list(range(2000))
    assert len(made) == 1


def test_numbers_take_a_branch_together_or_in_groups():
    several = numbers([1.0, -2.0, 3.0, -4.0])
    groups = {what: which.tolist() for which, what in split(np.arange(4), lambda w: "up" if several[w] > 0 else "down")}
    assert groups == {"up": [0, 2], "down": [1, 3]}
    found = {value: which.tolist() for which, value in split(np.arange(4), lambda w: uniform(abs(several[w]) // 2))}
    assert found == {0.0: [0], 1.0: [1, 2], 2.0: [3]}
