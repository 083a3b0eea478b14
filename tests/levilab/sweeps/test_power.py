"""A computer that loses its power while a store is written leaves no mark without its values."""

from random import Random

import numpy as np
import pytest

from levilab.computer import at_another_computer
from levilab.laboratory.disk import Node, SimulatedComputer
from levilab.laboratory.fate import Event, Fate, Killed
from levilab.sweeps.run import tasks_of
from levilab.sweeps.store import Store
from support.maps import cheap_values, expected, plan


def write_missing(store):
    for task in tasks_of(store):
        store.write(task.part, cheap_values(task))


@pytest.fixture
def laboratory(tmp_path):
    """A function: write a new store until the power is lost at a step; returns its path and the steps."""

    def write(seed, at):
        path = tmp_path / f"{seed}.zarr"
        Store.create(path, plan())
        fate = Fate(lambda _: fate.die(power=True))
        there = SimulatedComputer(fate, Random(seed))
        for one in [path, *path.rglob("*")]:  # it is on the disk
            there.names[one] = Node(one.is_dir(), 0 if one.is_dir() else one.stat().st_size)
        there.kept = dict(there.names)
        fate.begin([("step", Event("power", 0, at))])
        with at_another_computer(there):
            try:
                write_missing(Store.open(path, writable=True))
            except Killed:
                there.end_process(power=True)
        return path, fate.counts["step"]

    return write


def test_no_chunk_is_marked_whose_values_are_lost(laboratory):
    _, steps = laboratory("whole", -1)
    for seed in range(20):
        path, _ = laboratory(seed, 1 + (7 * seed) % steps)
        store = Store.open(path, writable=True)
        found = store.load()
        assert np.array_equal(found.values["lifetime_s"][found.computed], expected()[found.computed]), seed
        write_missing(store)
        assert np.array_equal(Store.open(path).load().values["lifetime_s"], expected()), seed
