"""The store of the results of a sweep: a group of Zarr v3, in a folder or in memory.

Each column is an array whose chunks are those of the plan, each axis a coordinate, and `done` marks the chunks that are
written.  Only one process writes: a chunk's values first, then its mark.  If the process is killed, only chunks
without a mark are lost.
"""

from __future__ import annotations

import contextlib
import json
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levilab.computer import computer, utc_now
from levilab.errors import DataError
from levilab.files import CannotWrite, locked, make_folder, writing
from levilab.interruption import interruption_postponed
from levilab.simulator.keys import short_text
from levilab.software import software_versions
from levilab.sweeps.plan import Axis, Chunk, Plan, unit_of
from levilab.sweeps.quantities import columns_of, quantity_of

SCHEMA = "levilab-sweep/1"
DONE = "done"
#: Of an adaptive map: an array with a mark for each point.
STATUS, COMPUTED, FILLED = "status", 1, 2
#: Number of marks in one file.
MARKS = 4096


def as_text(value: Any) -> str:
    """Return an attribute that has parts as JSON: netCDF, which others export a store to, knows numbers and texts."""
    return json.dumps(value, ensure_ascii=False)


def as_value(attribute: Any) -> Any:
    """Return the value of such an attribute; an older store has it as it is."""
    return json.loads(attribute) if isinstance(attribute, str) else attribute


@dataclass(frozen=True)
class Map:
    """What a sweep has found so far.

    Attributes:
        plan: of the sweep.
        values: column → values, in the shape of the plan; what is not computed is NaN, False or 0.
        computed: whether a point is computed, in the shape of the plan.
        filled: whether a point of an adaptive map is filled in from points around it; None of a map that is not.
    """

    plan: Plan
    values: dict[str, NDArray[Any]]
    computed: NDArray[np.bool_]
    filled: NDArray[np.bool_] | None = None

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return a row for each point: its place on the axes, and what was observed."""
        axes = {axis.key: axis.values for axis in self.plan.axes}
        if not self.plan.is_table:
            axes = dict(zip(axes, np.meshgrid(*axes.values(), indexing="ij"), strict=True))
        return {name: values.ravel() for name, values in {**axes, **self.values}.items()}


@dataclass(frozen=True)
class Store:
    """The results of a sweep.

    Attributes:
        plan: what is to be computed.
        group: of Zarr.
        path: of its folder; None in memory.
        marks: 1 where a chunk is done, shape (chunks,).
    """

    plan: Plan
    group: Any
    path: Path | None
    marks: NDArray[np.uint8] = field(repr=False)
    _arrays: dict[str, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def create(cls, path: Path | None, plan: Plan, begin: Callable[[Store], None] | None = None) -> Store:
        """Make a store for a plan.

        Args:
            path: of a folder that does not exist; None: in memory.
            plan: what is to be computed.
            begin: adds to the store what else it must have.  An interruption counts once the store is whole; where the
                process is killed meanwhile, there is none.

        Raises:
            CannotWrite: something is there already, or the folder cannot be made.
        """
        import zarr

        from levilab.sweeps.durable import DurableStore

        if path is None:
            return cls._in(zarr.storage.MemoryStore(), None, plan, begin)
        taken = f"{path} is there already: give another place with `out`, or go on with it by `resume`"
        if path.exists():
            raise CannotWrite(taken)
        part = path.with_name(f".{path.name}.{computer().process}.part")
        with interruption_postponed(), writing(f"{path} cannot be made"):  # its tasks outlive an interruption
            try:
                make_folder(path.parent)
                cls._in(DurableStore(part), part, plan, begin)
                computer().move(part, path)
            except OSError as error:
                if path.exists():  # another process was quicker
                    raise CannotWrite(taken) from error
                raise
            finally:
                shutil.rmtree(part, ignore_errors=True)
            computer().sync_folder(path.parent)
        return cls.open(path, writable=True)

    @classmethod
    def _in(cls, place: Any, path: Path | None, plan: Plan, begin: Callable[[Store], None] | None) -> Store:
        import zarr

        group = zarr.create_group(
            place,
            attributes={
                "schema": SCHEMA,
                "plan": as_text(plan.as_table()),
                "scene_toml": plan.scene.as_toml(),
                "synthetic": "true",
                "software": as_text(software_versions()),
                "processor": as_text(processor()),
                "created_utc": utc_now(),
                "command_line": as_text(sys.argv),
            },
        )
        for axis in plan.axes:
            _add_coordinate(group, axis, plan.dimensions[0] if plan.is_table else axis.key)
        for column in columns_of(plan.observables):
            group.create_array(
                column.name,
                shape=plan.shape,
                chunks=plan.chunk,
                dtype=column.dtype,
                fill_value=np.nan if column.dtype.startswith("float") else 0,
                dimension_names=plan.dimensions,
                attributes=_unit_and_meaning(column.unit, column.meaning),
            )
        group.create_array(
            DONE,
            shape=(plan.chunk_count,),
            chunks=(min(MARKS, plan.chunk_count),),
            dtype="uint8",
            fill_value=0,
            dimension_names=("chunk",),
            attributes=_unit_and_meaning("1", "whether a chunk is written, in the order of their numbers"),
        )
        store = cls(plan, group, path, np.zeros(plan.chunk_count, dtype=np.uint8))
        if begin is not None:
            begin(store)
        return store

    @classmethod
    def open(cls, path: Path, *, writable: bool = False) -> Store:
        """Open a store.  Raises DataError where there is none."""
        import zarr

        from levilab.sweeps.durable import DurableStore

        try:
            path.stat()  # where it is missing, a place that can be written to would make it
            place = DurableStore(path, read_only=not writable)
            return cls._of(zarr.open_group(place, mode="r+" if writable else "r"), path)
        except DataError:
            raise
        except KeyError as error:
            raise DataError(f"{path}: no whole store of a sweep, {error} is missing; compute the map again") from error
        except Exception as error:  # what is damaged shows in errors of many kinds
            raise DataError(
                f"{path}: no store of a sweep ({error}); give a folder that `levilab sweep` wrote"
            ) from error

    @classmethod
    def _of(cls, group: Any, path: Path) -> Store:
        if group.attrs.get("schema") != SCHEMA:
            raise DataError(f"{path}: its schema is {group.attrs.get('schema')!r}, and {SCHEMA!r} is expected")
        table: Any = as_value(group.attrs["plan"])
        plan = Plan.from_table(table, {axis["key"]: _coordinate(group, axis["key"]) for axis in table["axes"]})
        for column in columns_of(plan.observables):
            if group[column.name].shape != plan.shape or group[column.name].chunks != plan.chunk:
                raise DataError(f"{path}: its {column.name} has not the shape of its plan; compute the map again")
        return cls(plan, group, path, np.asarray(group[DONE][:]))

    @contextlib.contextmanager
    def lock(self) -> Iterator[None]:
        """Keep other processes from writing into the store.  Raises CannotWrite where one does already."""
        if self.path is None:
            yield
            return
        with (
            writing(f"{self.path}: its lock cannot be made", "go on where its folder can be written, or in a copy"),
            locked(self.path, "another process is computing it; wait for its end"),
        ):
            yield

    def attribute(self, name: str) -> Any:
        """Return an attribute that has parts, such as the processor; None where the store does not have it."""
        return as_value(self.group.attrs.get(name))

    def notes(self) -> list[str]:
        """Return the differences in software and processor since the store was begun that may change the last bits."""
        begun, there, software = self.attribute("software"), self.attribute("processor"), software_versions()
        versions = [(name, begun.get(name), software[name]) for name in ("levilab", "numpy", "numba")]
        other = [f"{name} {now} instead of {then}" for name, then, now in versions if now != then]
        if there != processor():
            other.append(f"the processor {processor()['name']} instead of {there['name']}")
        if not other:
            return []
        return [f"the sweep was begun elsewhere, here is {', '.join(other)}: chunks may differ in their last bits"]

    @property
    def done(self) -> int:
        """How many chunks are done."""
        return int(np.count_nonzero(self.marks))

    def missing(self) -> Iterator[Chunk]:
        """Yield the chunks that are not done, one after another."""
        return (self.plan.chunk_of(number) for number in range(self.plan.chunk_count) if not self.marks[number])

    def array(self, name: str) -> Any:
        """Return an array to write into.  Raises CannotWrite where the folder is no longer there."""
        if self.path is not None and not self.path.exists():
            text = f"{self.path}: it was moved or removed meanwhile; where it is now, go on with `resume`"
            raise CannotWrite(text)
        if name not in self._arrays:  # the group reads the description of an array each time
            self._arrays[name] = self.group[name]
        return self._arrays[name]

    def write(self, chunk: Chunk, values: Mapping[str, NDArray[Any]]) -> None:
        """Write a chunk's values, and when they are on the disk its mark.  Raises CannotWrite."""
        with writing(f"{self.path}: cannot be written", "free space, then go on with `resume`"):
            for column in columns_of(self.plan.observables):
                self.array(column.name)[chunk.box] = np.asarray(values[column.name], dtype=column.dtype)
            self.array(DONE)[chunk.number] = 1
        self.marks[chunk.number] = 1

    def known_points(self, chunk: Chunk) -> NDArray[np.bool_]:
        """Return which points of a chunk are computed, or filled in."""
        if STATUS not in self.group:
            return np.full(chunk.shape, bool(self.marks[chunk.number]))
        return self._array(STATUS, chunk.box) > 0

    def read(self, chunk: Chunk) -> dict[str, NDArray[Any]]:
        """Return column → values of a chunk."""
        return {column.name: self._array(column.name, chunk.box) for column in columns_of(self.plan.observables)}

    def load(self) -> Map:
        """Return all values, and which are computed."""
        plan = self.plan
        computed = np.zeros(plan.shape, dtype=np.bool_)
        for number in np.flatnonzero(self.marks):
            computed[plan.chunk_of(int(number)).box] = True
        values = {column.name: self._array(column.name, ...) for column in columns_of(plan.observables)}
        if STATUS not in self.group:
            return Map(plan, values, computed)
        status = self._array(STATUS, ...)
        return Map(plan, values, status == COMPUTED, status == FILLED)

    def _array(self, name: str, box: Any) -> NDArray[Any]:
        """Return part of an array.  Raises DataError where its files are damaged or missing."""
        try:
            return np.asarray(self.group[name][box])
        except Exception as error:  # libraries that decompress have errors of many kinds
            raise DataError(
                f"{self.path}: a file of {name} is damaged or missing ({error}); take a copy, or compute it again"
            ) from error


def processor() -> dict[str, str]:
    """Return the processor for which the kernels are compiled: where it is the same, results have the same bits."""
    from llvmlite import binding
    from numba.core import config

    name, features = getattr(config, "CPU_NAME", None), getattr(config, "CPU_FEATURES", None)
    return {
        "name": binding.get_host_cpu_name() if name is None else name,
        "features": binding.get_host_cpu_features().flatten() if features is None else features,
    }


def differences(there: Plan, asked: Plan) -> list[str]:
    """Return the differences between the plan of a store and the one of a request, a sentence for each."""
    own, other = (dict(_leaves(plan)) for plan in (there, asked))
    return [
        f"{key} is {short_text(own.get(key, 'missing'))} there and {short_text(other.get(key, 'missing'))} here"
        for key in {**own, **other}
        if own.get(key) != other.get(key)
    ]


def _leaves(plan: Plan) -> Iterator[tuple[str, Any]]:
    """Yield the independent parts of a plan, by name; its chunks and its step follow from them."""
    table = plan.as_table()
    for axis in table["axes"]:
        yield f"the axis {axis['key']}", ", ".join(str(value) for key, value in axis.items() if key != "key")
    yield "the order of the axes", ", ".join(axis["key"] for axis in table["axes"])
    for name in ("observables", "duration_s", "tolerance", "seed"):
        yield name, table[name]
    for name, part in table["scene"].items():
        inner = {f"{name}.{key}": value for key, value in part.items()} if isinstance(part, dict) else {name: part}
        yield from inner.items()


def _unit_and_meaning(unit: str, meaning: str) -> dict[str, Any]:
    """Return the attributes of an array, also with the names of the CF conventions that xarray and others use."""
    return {"unit": unit, "meaning": meaning, "units": unit, "long_name": meaning}


def _add_coordinate(group: Any, axis: Axis, dimension: str) -> None:
    """Add an axis's values; words are numbered, and the attribute `words` has them in the order of their numbers."""
    values, words = axis.values, None
    if values.dtype.kind == "U":
        words, values = np.unique(values, return_inverse=True)
    attributes = _unit_and_meaning(unit_of(axis.key), quantity_of(axis.key).name) | {"scale": axis.scale}
    coordinate = group.create_array(
        axis.key,
        shape=values.shape,
        chunks=(min(len(values), MARKS),),
        dtype="float64" if words is None else "int64",
        dimension_names=(dimension,),
        attributes=attributes | ({} if words is None else {"words": words.tolist()}),
    )
    coordinate[...] = values


def _coordinate(group: Any, key: str) -> NDArray[Any]:
    array = group[key]
    values, words = np.asarray(array[...]), array.attrs.get("words")
    return values if words is None else np.array(words)[values]
