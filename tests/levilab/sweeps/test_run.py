"""A run that is interrupted goes on where it was, and ends with the same bits."""

import random
from dataclasses import replace

import numpy as np
import pytest

from levilab.errors import SimulationError
from levilab.simulator.scene import preset
from levilab.sweeps import run as run_module
from levilab.sweeps.axes import parse_axis, read_points
from levilab.sweeps.plan import Axis, Plan
from levilab.sweeps.run import ChunksFailed, compute, run, tasks_of, with_step
from levilab.sweeps.store import Store, differences


@pytest.fixture(scope="module")
def plan():
    axes = parse_axis("start.spin_hz=18:24:40"), parse_axis("top.mass_kg=0.0250:0.0254:20")
    return with_step(Plan(preset("undriven"), axes, ("survived", "lifetime_s"), 0.3), print)


@pytest.fixture(scope="module")
def whole(plan):
    store = Store.create(None, plan)
    run(store)
    return store.load()


def bits(found):
    return {name: values.tobytes() for name, values in found.values.items()}


@pytest.mark.parametrize("when", ["before the values", "between values and mark"])
def test_an_interrupted_run_goes_on_to_the_same_bits(when, plan, whole, tmp_path, monkeypatch):
    store = Store.create(tmp_path / "map.zarr", plan)
    assert plan.chunk_count == 4
    write, chunks = Store.write, []

    def interrupted(self, chunk, values):
        chunks.append(chunk.number)
        if len(chunks) == 3:
            if when == "between values and mark":
                self.group["lifetime_s"][chunk.box] = -1.0
            raise KeyboardInterrupt
        write(self, chunk, values)

    with monkeypatch.context() as patched:
        patched.setattr(Store, "write", interrupted)
        with pytest.raises(KeyboardInterrupt):
            run(store)
    again = Store.open(tmp_path / "map.zarr", writable=True)
    assert (again.done, [chunk.number for chunk in again.missing()]) == (2, [2, 3])
    shares = []
    run(again, progress=shares.append)
    assert shares == [0.75, 1.0]
    assert bits(Store.open(tmp_path / "map.zarr").load()) == bits(whole)


def test_the_order_of_the_chunks_and_what_is_beside_a_point_change_no_bit(plan, whole):
    store = Store.create(None, plan)
    tasks = list(tasks_of(store))
    random.Random(1).shuffle(tasks)
    for task in tasks:
        store.write(task.part, compute(task))
    assert bits(store.load()) == bits(whole)
    one = compute(next(task for task in tasks if task.part.number == 2))
    assert whole.values["lifetime_s"][tasks[0].part.box].shape == one["lifetime_s"].shape


def test_chunks_follow_from_the_plan_and_cover_it_once():
    axes = tuple(Axis(key, np.arange(n, dtype=float)) for key, n in (("a", 317), ("b", 91), ("c", 5)))
    plan = Plan(preset("undriven"), axes, ("survived",), 30.0)
    times = np.zeros(plan.shape, dtype=int)
    for chunk in plan.chunks():
        times[chunk.box] += 1
        values = np.broadcast_arrays(*plan.values_of(chunk).values())
        assert values[0].shape == chunk.shape
        corner = tuple(k - 1 for k in chunk.stop)
        assert [float(array[-1, -1, -1]) for array in values] == list(plan.point(corner).values())
    assert np.all(times == 1)
    assert plan.chunk_count >= 32


def test_a_plan_of_ten_million_points_has_small_attributes_and_tasks():
    axes = parse_axis("start.spin_hz=18:90:3200"), parse_axis("top.mass_kg=0.0247:0.0256:3200")
    plan = Plan(preset("undriven"), axes, ("survived", "lifetime_s"), 30.0)
    assert plan.size > 1e7
    assert len(str(plan.as_table())) < 5000
    assert 100 <= plan.chunk_count <= 10_000
    task = next(tasks_of(Store.create(None, plan)))
    assert task.plan.axes == ()
    assert sum(values.size for values in task.values.values()) <= 800


def test_a_table_is_swept_row_by_row_with_words_in_it(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("start.spin_hz,drive.waveform\n30.03,sine\n18,sine\n30.03,off\n", encoding="utf-8")
    plan = with_step(Plan(preset("driven"), read_points(path), ("survived",), 0.5), print)
    run(Store.create(tmp_path / "map.zarr", plan))
    found = Store.open(tmp_path / "map.zarr")
    assert found.plan.shape == (3,)
    assert found.plan.axes[1].values.tolist() == ["sine", "sine", "off"]
    assert found.load().values["survived"].tolist() == [True, False, True]


def test_a_chunk_that_fails_is_named_and_the_others_are_kept(plan, monkeypatch):
    def fails_once(task):
        if task.part.number == 1:
            raise SimulationError("a top was lost in numbers")
        return compute(task)

    monkeypatch.setattr(run_module, "compute", fails_once)
    store = Store.create(None, plan)
    with pytest.raises(ChunksFailed, match=r"a chunk could not be computed, .*a top was lost in numbers"):
        run(store)
    assert store.marks.tolist() == [1, 0, 1, 1]


def test_a_point_that_the_scene_refuses_is_named(tmp_path):
    scene, masses = (
        preset("undriven").changed({"start.place": "equilibrium"}),
        np.array([0.0250, 0.0251, 0.030, 0.0252]),
    )
    axes = Axis("top.mass_kg", masses), Axis("start.spin_hz", np.array([25.0, 30.0]))
    asked = replace(Plan(scene, axes, ("survived",), 0.01), chunk=(4, 1), step_share=0.1)
    with pytest.raises(
        ChunksFailed, match=r"2 of 2 chunks .*: at top\.mass_kg = 0\.03, start\.spin_hz = 25.* is invalid"
    ):
        run(Store.create(None, asked))


def test_what_differs_from_the_plan_of_a_store_is_named(plan):
    axes = parse_axis("start.spin_hz=18:24:41"), plan.axes[1]
    other = Plan(preset("undriven").changed({"top.moment_a_m2": -0.7}), axes, plan.observables, 0.4)
    assert differences(plan, plan) == []
    assert differences(plan, other) == [
        "the axis start.spin_hz is Hz, linear, 40, 18.0, 24.0 there and Hz, linear, 41, 18.0, 24.0 here",
        "duration_s is 0.3 there and 0.4 here",
        "top.moment_a_m2 is -0.714 there and -0.7 here",
    ]
