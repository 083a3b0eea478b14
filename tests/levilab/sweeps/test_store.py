"""A store keeps what was computed, and any reader of Zarr can read it."""

import json
import shutil
import signal

import numpy as np
import pytest
import zarr

from levilab.errors import DataError
from levilab.files import CannotWrite
from levilab.sweeps.run import run, tasks_of
from levilab.sweeps.store import Store
from support.maps import cheap_values, expected, plan


def test_a_store_that_is_opened_again_has_the_plan_and_the_values(tmp_path):
    made = Store.create(tmp_path / "map.zarr", plan())
    assert made.plan.chunk_count > 2
    *tasks, last = tasks_of(made)
    for task in tasks:
        made.write(task.part, cheap_values(task))
    again = Store.open(tmp_path / "map.zarr")
    assert again.plan.as_table() == made.plan.as_table()
    assert [chunk.number for chunk in again.missing()] == [last.part.number]
    found = again.load()
    assert np.array_equal(found.values["lifetime_s"][found.computed], expected()[found.computed])
    assert np.all(np.isnan(found.values["lifetime_s"][~found.computed]))
    assert np.count_nonzero(~found.computed) == np.prod(last.part.shape)


def test_a_store_is_made_whole_before_an_interruption_counts(tmp_path):
    begun = []

    def begin(store):
        signal.raise_signal(signal.SIGINT)
        begun.append(store)

    with pytest.raises(KeyboardInterrupt):
        Store.create(tmp_path / "map.zarr", plan(), begin)
    assert begun
    assert Store.open(tmp_path / "map.zarr").done == 0


def test_plain_zarr_reads_arrays_coordinates_and_units(tmp_path):
    run(Store.create(tmp_path / "map.zarr", plan()))
    group = zarr.open_group(tmp_path / "map.zarr", mode="r")
    assert group.metadata.zarr_format == 3
    assert group["lifetime_s"].metadata.dimension_names == ("start.spin_hz", "top.mass_kg")
    assert group["lifetime_s"].attrs["unit"] == "s"
    assert np.array_equal(group["top.mass_kg"][:], plan().axes[1].values)
    assert group["top.mass_kg"].attrs["units"] == "kg"
    assert json.loads(group.attrs["plan"])["scene"]["base"]["inner_radius_m"] == 0.03
    attributes = [*group.attrs.items(), *(item for _, array in group.arrays() for item in array.attrs.items())]
    assert all(type(value) in {str, int, float} for _, value in attributes)  # which NetCDF has


def test_a_store_of_an_earlier_version_is_read(tmp_path):
    made = Store.create(tmp_path / "map.zarr", plan())
    run(made)
    group = zarr.open_group(tmp_path / "map.zarr", mode="r+")
    nested = ("plan", "software", "processor", "command_line")
    group.attrs.update({name: json.loads(group.attrs[name]) for name in nested} | {"synthetic": True})
    again = Store.open(tmp_path / "map.zarr")
    assert again.plan.as_table() == made.plan.as_table()
    assert again.notes() == []


def test_two_processes_cannot_write_into_one_store(tmp_path):
    made = Store.create(tmp_path / "map.zarr", plan())
    second = Store.open(tmp_path / "map.zarr", writable=True)
    with made.lock(), pytest.raises(CannotWrite, match="another process is computing it"), second.lock():
        pass
    with second.lock():
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["map.zarr"]


def test_a_store_that_is_damaged_is_an_error_that_names_it(tmp_path):
    made = Store.create(tmp_path / "map.zarr", plan())
    task = next(tasks_of(made))
    made.write(task.part, cheap_values(task))
    (file,) = (tmp_path / "map.zarr" / "lifetime_s" / "c").glob("*/*")
    file.write_bytes(b"torn")
    with pytest.raises(DataError, match=r"map\.zarr: a file of lifetime_s is damaged"):
        Store.open(tmp_path / "map.zarr").load()
    (tmp_path / "map.zarr" / "zarr.json").write_text("{", encoding="utf-8")
    with pytest.raises(DataError, match="no store of a sweep"):
        Store.open(tmp_path / "map.zarr")
    for writable in (False, True):
        with pytest.raises(DataError, match=r"no store of a sweep .*No such file"):
            Store.open(tmp_path / "nothing", writable=writable)
    assert not (tmp_path / "nothing").exists()


def test_a_store_that_is_moved_while_it_is_written_is_an_error_that_names_it(tmp_path):
    made = Store.create(tmp_path / "map.zarr", plan())
    (tmp_path / "map.zarr").rename(tmp_path / "elsewhere.zarr")
    task = next(tasks_of(made))
    with pytest.raises(CannotWrite, match=r"map\.zarr: it was moved or removed meanwhile"):
        made.write(task.part, cheap_values(task))


def test_a_store_whose_marks_are_torn_is_an_error(tmp_path):
    run(Store.create(tmp_path / "map.zarr", plan()))
    (tmp_path / "map.zarr" / "done" / "c" / "0").write_bytes(b"")  # as a damaged disk may leave a file
    with pytest.raises(DataError, match="no store of a sweep"):
        Store.open(tmp_path / "map.zarr")


def test_the_slower_of_two_sweeps_is_refused_as_if_it_had_come_later(tmp_path):
    path, other = tmp_path / "map.zarr", tmp_path / "other.zarr"
    Store.create(other, plan())
    refused = []
    for begin in (lambda _: other.rename(path), lambda _: None):
        with pytest.raises(CannotWrite, match="is there already") as error:
            Store.create(path, plan(), begin)
        refused.append(str(error.value))
    assert refused[0] == refused[1]
    assert [one.name for one in tmp_path.iterdir()] == ["map.zarr"]


def test_a_store_is_there_whole_or_not_at_all(tmp_path):
    def killed(store):
        assert not (tmp_path / "map.zarr").exists()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Store.create(tmp_path / "map.zarr", plan(), killed)
    assert list(tmp_path.iterdir()) == []
    Store.create(tmp_path / "map.zarr", plan())
    assert [path.name for path in tmp_path.iterdir()] == ["map.zarr"]


def test_a_store_that_has_lost_a_column_is_not_gone_on_with(tmp_path):
    Store.create(tmp_path / "map.zarr", plan())
    shutil.rmtree(tmp_path / "map.zarr" / "lifetime_s")
    with pytest.raises(DataError, match="no whole store of a sweep, 'lifetime_s' is missing"):
        Store.open(tmp_path / "map.zarr", writable=True)
