"""An adaptive map in its store: right where it is computed, marked where not, the same however it came about."""

import contextlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from levilab.errors import UsageError
from levilab.simulator.ensemble import grid, step_share_of
from levilab.simulator.scene import preset
from levilab.sweeps import adaptive
from levilab.sweeps.adaptive import FOUND, begin_adaptive, in_words, run_adaptive
from levilab.sweeps.observables import observe
from levilab.sweeps.plan import Axis, Plan
from levilab.sweeps.store import Store
from levilab.workers import Workers, this_process

SCENE = preset("undriven").changed({"start.place": "given"})


def plan(spins, masses, duration=3.0):
    """The upper edge, with its islands."""
    axes = (Axis("start.spin_hz", np.linspace(46, 94, spins)), Axis("top.mass_kg", np.linspace(0.0251, 0.0259, masses)))
    made = Plan(SCENE, axes, ("survived", "lifetime_s"), duration)
    share = step_share_of(SCENE, grid({axis.key: axis.values for axis in axes}), duration, tolerance=1e-6)
    return replace(made, step_share=share)


def made_up(task):
    """An edge and an island that cost nothing."""
    spin, mass = task.values["start.spin_hz"], 1e5 * task.values["top.mass_kg"]
    return {"survived": (spin < 65) | ((spin - 80) ** 2 + (mass - 2550) ** 2 < 9), "lifetime_s": spin + mass}


def test_a_map_with_islands_agrees_with_the_full_one_within_its_limit():
    asked = plan(61, 41)
    store = Store.create(None, asked)
    begin_adaptive(store, stride=4, audit=60)
    report = run_adaptive(store, this_process())
    found = store.load()
    full = observe(asked, grid({axis.key: axis.values for axis in asked.axes}))
    for name in ("survived", "lifetime_s"):  # to the last bit, in whatever company a point was computed
        assert found.values[name][found.computed].tobytes() == full[name][found.computed].tobytes()
    assert not np.any(found.computed & found.filled)
    assert np.all(found.computed | found.filled)
    wrong = np.count_nonzero(found.values["survived"] != full["survived"])
    assert wrong <= report["most_wrong"]
    assert report["saved"] == pytest.approx(found.filled.mean())
    assert report["saved"] > 0.2
    assert np.all(np.isnan(found.values["lifetime_s"][found.filled]))
    said = " ".join(in_words(report, asked))
    assert "With 95 % confidence at most" in said
    assert "a box of 3.2 Hz (spin at the start) × 0.08 g (mass) is sure to be seen" in said


def test_the_result_does_not_depend_on_the_workers(monkeypatch):
    monkeypatch.setattr(adaptive, "compute", made_up)
    asked, found = plan(41, 41, 0.01), []
    for workers in (this_process(), Workers(lambda: ThreadPoolExecutor(3), 3, elsewhere=False)):
        store = Store.create(None, asked)
        begin_adaptive(store, audit=100)
        report = run_adaptive(store, workers)
        found.append([report, *(store.group[name][...].tobytes() for name in ("survived", "lifetime_s", "status"))])
    assert found[0] == found[1]


def test_a_map_that_was_interrupted_goes_on_without_computing_anew(tmp_path, monkeypatch):
    asked, computed = plan(41, 41, 0.01), []

    class Cut(Exception):
        pass

    def counted(task):
        computed.extend(task.part.tolist())
        return made_up(task)

    def cut(share):
        if share > 0.5:
            raise Cut

    monkeypatch.setattr(adaptive, "compute", counted)
    monkeypatch.setattr(adaptive, "KEPT", 150)
    stores = [Store.create(tmp_path / name, asked) for name in ("whole.zarr", "cut.zarr")]
    for store in stores:
        begin_adaptive(store, audit=100)
    shares = []
    run_adaptive(stores[0], this_process(), shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    computed.clear()
    with contextlib.suppress(Cut):
        run_adaptive(stores[1], this_process(), cut)
    before = len(computed)
    assert before > 0
    again = Store.open(tmp_path / "cut.zarr", writable=True)
    assert again.done == 0
    run_adaptive(again, this_process())
    assert len(computed) > before
    assert len(computed) - len(set(computed)) < 150 < before  # what was in memory alone
    for name in ("survived", "lifetime_s", "status"):
        assert again.group[name][...].tobytes() == stores[0].group[name][...].tobytes()
    assert again.group.attrs[FOUND] == stores[0].group.attrs[FOUND]
    assert again.done == asked.chunk_count


def test_ctrl_c_costs_only_the_points_under_way(monkeypatch):
    tasks = []

    def interrupted(task):
        if len(tasks) == 5:
            raise KeyboardInterrupt
        tasks.append(task)
        return made_up(task)

    monkeypatch.setattr(adaptive, "compute", interrupted)
    store = Store.create(None, plan(161, 161, 0.01), begin_adaptive)
    with pytest.raises(KeyboardInterrupt):
        run_adaptive(store, this_process())
    assert np.count_nonzero(store.group["status"][...]) == sum(task.part.size for task in tasks) > 0


def test_what_has_no_boundary_cannot_be_refined():
    asked = plan(5, 5, 0.01)
    with pytest.raises(UsageError, match="adaptive = lifetime_s: a boundary lies between yes and no"):
        begin_adaptive(Store.create(None, asked), "lifetime_s")
    with pytest.raises(UsageError, match="this is neither: add survived or locked to `observe`"):
        begin_adaptive(Store.create(None, asked), "locked")
    with pytest.raises(UsageError, match="stride = 6: a power of 2"):
        begin_adaptive(Store.create(None, asked), stride=6)
    table = Plan(SCENE, (Axis("start.spin_hz", np.linspace(58, 82, 9), "table"),), ("survived",), 0.01)
    with pytest.raises(UsageError, match="rows of a table have no neighbours"):
        begin_adaptive(Store.create(None, table))
