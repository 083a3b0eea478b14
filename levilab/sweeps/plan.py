"""A plan: at which values of a scene's keys motions are simulated, and how the work is cut into chunks.

The chunks follow from the plan alone, never from the machine.  The results of a chunk are a function of the plan and of
its own values, so that they do not depend on the process that computes it, on the time, or on other chunks.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from levilab.present.units import split
from levilab.simulator.scene import Scene, scene_of

Scale = Literal["linear", "log", "list", "table"]
#: The dimension of a plan whose points are the rows of a table.
ROWS = "point"
#: A chunk takes about this long on one core [s] ...
CHUNK_S = 2.0
#: ... unless it then had fewer points than fill the lanes, or more than fit into memory with a window of chunks.
FEWEST, MOST = 64, 65_536
#: Seconds of motion that one core simulates in a second, in lanes; the order of magnitude suffices.
QUICKLY = 7e4
#: A plan has at least about MANY_CHUNKS chunks, if each has ENOUGH points: then all cores end at about the same time.
MANY_CHUNKS, ENOUGH = 64, 256


@dataclass(frozen=True, eq=False)
class Axis:
    """The values of one key.

    Attributes:
        key: dotted key of the scene, such as ``start.spin_hz``.
        values: shape (n,), float64, or text where a table has words.
        scale: how they are spaced, "list" for any other way; all axes of a table have the scale "table" and one length,
            a point a row.
    """

    key: str
    values: NDArray[Any]
    scale: Scale = "linear"

    def as_table(self) -> dict[str, Any]:
        """Return what distinguishes it from another axis, in a size that does not grow with the values."""
        table = {"key": self.key, "unit": unit_of(self.key), "scale": self.scale, "points": len(self.values)}
        if self.scale in {"list", "table"}:
            return table | {"sha256": _digest(self.values)}
        return table | {"from": float(self.values[0]), "to": float(self.values[-1])}


def _digest(values: NDArray[Any]) -> str:
    plain = values.astype("<f8").tobytes() if values.dtype.kind == "f" else "\0".join(values.tolist()).encode()
    return hashlib.sha256(plain).hexdigest()


def unit_of(key: str) -> str:
    """Return the unit at the end of a key, "1" where there is none.

    >>> unit_of("start.spin_hz"), unit_of("start.position_m.2"), unit_of("base.strength_t_m"), unit_of("drag.law")
    ('Hz', 'm', 'T m', '1')
    """
    _, unit = split(key.rstrip(".0123456789"))
    return unit.si if unit else "1"


@dataclass(frozen=True)
class Chunk:
    """A box of points, one piece of work.

    Attributes:
        number: of the chunk in its plan, from 0.
        start, stop: first index and the one after the last, along each dimension.
    """

    number: int
    start: tuple[int, ...]
    stop: tuple[int, ...]

    @property
    def box(self) -> tuple[slice, ...]:
        """The slices that take it out of the plan's arrays."""
        return tuple(itertools.starmap(slice, zip(self.start, self.stop, strict=True)))

    @property
    def shape(self) -> tuple[int, ...]:
        """How many points it has along each dimension."""
        return tuple(b - a for a, b in zip(self.start, self.stop, strict=True))


@dataclass(frozen=True)
class Plan:
    """What is simulated, where, and what is observed.

    Attributes:
        scene: what all points have in common.
        axes: the keys that differ; each is a dimension, but the columns of a table share one.
        observables: names of what is observed, of `levilab.sweeps.observables`.
        duration_s: of each motion.
        tolerance: wanted error of place [m] and axis [rad] at the end.
        seed: of what is random.
        chunk: points of a chunk along each dimension; empty: those that suit ends of motions in lanes.
        step_share: part of its longest step that each motion takes; None: chosen in each chunk.
    """

    scene: Scene
    axes: tuple[Axis, ...]
    observables: tuple[str, ...]
    duration_s: float
    tolerance: float = 1e-6
    seed: int = 0
    chunk: tuple[int, ...] = ()
    step_share: float | None = None

    def __post_init__(self) -> None:
        """Choose chunks that suit ends of motions in lanes; `observables.cut` suits them to any plan."""
        if self.axes and not self.chunk:
            object.__setattr__(self, "chunk", chunk_shape(self.shape, QUICKLY / self.duration_s))

    @property
    def is_table(self) -> bool:
        """Whether its points are the rows of a table."""
        return any(axis.scale == "table" for axis in self.axes)

    @property
    def dimensions(self) -> tuple[str, ...]:
        """The names of the dimensions."""
        return (ROWS,) if self.is_table else tuple(axis.key for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Points along each dimension."""
        return (len(self.axes[0].values),) if self.is_table else tuple(len(axis.values) for axis in self.axes)

    @property
    def size(self) -> int:
        """Points in all."""
        return math.prod(self.shape)

    @property
    def grid(self) -> tuple[int, ...]:
        """Chunks along each dimension."""
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunk, strict=True))

    @property
    def chunk_count(self) -> int:
        """Chunks in all."""
        return math.prod(self.grid)

    def chunks(self) -> Iterator[Chunk]:
        """Yield the chunks in the order of their numbers."""
        return map(self.chunk_of, range(self.chunk_count))

    def chunk_of(self, number: int) -> Chunk:
        """Return the chunk of a number."""
        place = np.unravel_index(number, self.grid)
        start = tuple(int(i) * c for i, c in zip(place, self.chunk, strict=True))
        stop = tuple(min(a + c, n) for a, c, n in zip(start, self.chunk, self.shape, strict=True))
        return Chunk(number, start, stop)

    def point(self, index: tuple[int, ...]) -> dict[str, Any]:
        """Return key → value of one point."""
        places = (index[0],) * len(self.axes) if self.is_table else index
        return {axis.key: axis.values[k].item() for axis, k in zip(self.axes, places, strict=True)}

    def values_of(self, chunk: Chunk) -> dict[str, NDArray[Any]]:
        """Return key → values of a chunk; broadcast against each other they have its shape."""
        if self.is_table:
            return {axis.key: axis.values[chunk.box[0]] for axis in self.axes}
        shapes = np.eye(len(self.axes), dtype=int) * (np.array(chunk.shape) - 1) + 1
        return {
            axis.key: axis.values[part].reshape(shape)
            for axis, part, shape in zip(self.axes, chunk.box, shapes.tolist(), strict=True)
        }

    def without_values(self) -> Plan:
        """Return the plan without its axes: what every worker needs, in a size that does not grow with the map."""
        return replace(self, axes=())

    def as_table(self) -> dict[str, Any]:
        """Return all of it but the values of the axes, as JSON has it."""
        return {
            "scene": self.scene.as_table(),
            "axes": [axis.as_table() for axis in self.axes],
            "observables": list(self.observables),
            "duration_s": self.duration_s,
            "tolerance": self.tolerance,
            "seed": self.seed,
            "chunk": list(self.chunk),
            "step_share": self.step_share,
        }

    @classmethod
    def from_table(cls, table: Mapping[str, Any], values: Mapping[str, NDArray[Any]]) -> Plan:
        """Return the plan of a table and of the values of its axes.  Raises KeyError, SceneError."""
        return cls(
            scene=scene_of(table["scene"]),
            axes=tuple(Axis(axis["key"], values[axis["key"]], axis["scale"]) for axis in table["axes"]),
            observables=tuple(table["observables"]),
            duration_s=float(table["duration_s"]),
            tolerance=float(table["tolerance"]),
            seed=int(table["seed"]),
            chunk=tuple(table["chunk"]),
            step_share=None if table["step_share"] is None else float(table["step_share"]),
        )


def chunk_shape(shape: tuple[int, ...], points_per_second: float) -> tuple[int, ...]:
    """Return the points of a chunk along each dimension.

    Args:
        shape: of the plan.
        points_per_second: what one core simulates.

    The whole map is halved along its longest side until a chunk is short enough.

    >>> chunk_shape((23, 11), 1e5), chunk_shape((3163, 3163), 1e4)
    ((23, 11), (198, 99))
    """
    most = min(max(CHUNK_S * points_per_second, FEWEST), MOST)
    wanted = max(min(most, math.prod(shape) / MANY_CHUNKS), min(most, ENOUGH))
    chunk = list(shape)
    while math.prod(chunk) > wanted:
        longest = max(range(len(chunk)), key=lambda k: (chunk[k], k))
        chunk[longest] = -(-chunk[longest] // 2)
    return tuple(chunk)
