"""Many tops from one scene: varied numbers checked against the scene's own limits, and made ready for the kernels.

The scene is validated once for all tops.  Varied numbers are checked as arrays by the very types of its fields and by
its rules, and go through the formulas of one top as `Numbers`.  Words, lists and other values are few:
each of them gets a scene of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from analysis.arrays import Array
from levilab.errors import LevilabError, SimulationError
from levilab.settings import in_one_line
from levilab.simulator.accuracy import longest_step
from levilab.simulator.field import FieldError
from levilab.simulator.kernels.loads import Disc
from levilab.simulator.kernels.motion import R
from levilab.simulator.kernels.pieces import FIRST, HEIGHT, JOB_SIZE, OFF, OFFSET, RADIUS, RATE, SECOND, STEEP, TURNS
from levilab.simulator.keys import SceneError, plain
from levilab.simulator.model import model_of
from levilab.simulator.numbers import Indices, Numbers, T, numbers, numbers_of, split, template_of
from levilab.simulator.problem import scheme_for
from levilab.simulator.scene import RULES, Scene
from levilab.simulator.schemes import Scheme
from levilab.simulator.start import start_of

#: Keys with their values, broadcast to one shape.
Values = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Batch:
    """Tops of one kind, which one kernel advances.

    Attributes:
        where: their places in the flat map, shape (n,).
        model: types and shared arrays, with numbers of one of them.
        fewer: models with one and with two nodes fewer in a magnet of finite size; empty for others.
        scheme: that integrates them.
        starts: shape (n, 18).
        numbers: of each one's model, shape (n, k).
        runs: what `kernels.pieces` names but for duration and step, shape (n, 11).
        longest: the longest step of each [s], shape (n,).
        inertias: axial ones of the whole and of loose washers, shape (n, 2) [kg m²].
        transverse: inverse of the transverse inertia, shape (n,) [1/(kg m²)].
    """

    where: Indices
    model: Any
    fewer: tuple[Any, ...]
    scheme: Scheme
    starts: Array
    numbers: Array
    runs: Array
    longest: Array
    inertias: Array
    transverse: Array

    def part(self, which: Any) -> Batch:
        """Return some of the tops."""
        return replace(self, **{name: getattr(self, name)[which] for name in _COLUMNS})


_COLUMNS = ("where", "starts", "numbers", "runs", "longest", "inertias", "transverse")


def broadcast(over: Mapping[str, ArrayLike]) -> Values:
    """Broadcast the values of all keys to one shape, without copies.  Raises SimulationError."""
    arrays = {key: _array(key, values) for key, values in over.items()}
    try:
        return dict(zip(arrays, np.broadcast_arrays(*arrays.values()), strict=True))
    except ValueError:
        shapes = ", ".join(f"{key} {array.shape}" for key, array in arrays.items())
        raise SimulationError(
            f"these values do not fit together: {shapes}; shapes that broadcast are expected"
        ) from None


def _array(key: str, values: ArrayLike) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except ValueError:
        raise SimulationError(f"{key}: lists of unequal lengths; an array of any one shape is expected") from None


def scene_at(scene: Scene, values: Values, where: int) -> Scene:
    """Return the scene of one top of a map, by its place in the flat map.  Raises SceneError."""
    return scene.changed({key: plain(column.flat[where]) for key, column in values.items()})


def batches(scene: Scene, over: Mapping[str, ArrayLike]) -> list[Batch]:
    """Return the tops of a map, grouped by kind.

    Args:
        scene: what they have in common.
        over: dotted keys with their values, which broadcast.

    Raises:
        SceneError: a scene does not allow these keys or values; it names key, value and index.
        SimulationError: the values do not fit together.
    """
    values = broadcast(over)
    varied = _varied_keys(values)
    for key in varied:
        _check(scene, key, np.asarray(over[key]))
    found: dict[Any, list[Batch]] = {}
    for group, view in _views(scene, values, varied):
        for batch in _of_one_scene(scene, values, group, view):
            found.setdefault((_kind(batch.model), batch.scheme.name), []).append(batch)
    return [_join(several) for several in found.values()]


def for_each(scene: Scene, values: Values, formula: Callable[[Scene, Indices], T]) -> Iterator[tuple[Indices, T]]:
    """Yield what a formula of one top gives, for the tops of a map that take the same branches of it.

    Args:
        scene: what they have in common.
        values: what differs, checked by `batches` before.
        formula: takes a scene with `Numbers` for those tops, and their places in the flat map.

    Yields:
        Their places in the flat map, shape (n,), and what the formula gives.
    """
    for group, view in _views(scene, values, _varied_keys(values)):

        def of_some(
            which: Indices, group: Indices = group, view: Callable[[Indices], Scene] = view
        ) -> tuple[Indices, T]:
            return group[which], formula(view(which), group[which])

        yield from (found for _, found in split(np.arange(group.size), of_some))


def _varied_keys(values: Values) -> list[str]:
    """Return the keys whose values can be checked, and put into formulas, as arrays of numbers."""
    return [key for key, column in values.items() if column.dtype.kind in "iuf" and _checker(key) is not None]


def _views(scene: Scene, values: Values, varied: list[str]) -> Iterator[tuple[Indices, Callable[[Indices], Scene]]]:
    """Yield the tops whose words and lists are the same, and what makes a scene with `Numbers` of some of them."""
    size = next(iter(values.values())).size if values else 1
    for group in _alike([column for key, column in values.items() if key not in varied], size):
        sample = _scene_with_index(scene, values, int(group[0]))
        columns = {key: numbers(values[key].ravel()[group]) for key in varied}

        def view(which: Indices, sample: Scene = sample, columns: dict[str, Numbers] = columns) -> Scene:
            changed = sample
            for key, column in columns.items():
                changed = _with_leaf(changed, key.split("."), column[which])
            return changed

        yield group, view


# --- values against the scene's limits ---


@cache
def _checker(key: str) -> TypeAdapter[Any] | None:
    """Return what validates a list of values of a key that holds a number; None if the key holds none."""
    kind: Any = Scene
    for name in key.split("."):
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            if name not in kind.model_fields:
                return None
            field = kind.model_fields[name]
            kind, limits = field.annotation, tuple(field.metadata)
        elif get_origin(kind) is tuple and name.isdecimal() and int(name) < len(get_args(kind)):
            kind, limits = get_args(kind)[int(name)], ()
        elif not name.isdecimal() or all(
            get_origin(one) is not tuple for one in get_args(kind)
        ):  # one number, or several
            return None
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return None
    checked: Any = Annotated[(kind, *limits)] if limits else kind
    several: Any = list.__class_getitem__(checked)
    return TypeAdapter(several, config=ConfigDict(strict=True, allow_inf_nan=False))


def _check(scene: Scene, key: str, column: NDArray[Any]) -> None:
    checker = _checker(key)
    assert checker is not None
    try:
        checker.validate_python(column.ravel().tolist())
    except ValidationError as error:
        where = int(error.errors()[0]["loc"][0])
        _scene_with_index(scene, {key: column}, where)
        raise SceneError(f"{key}: {in_one_line(error)}") from error  # pragma: no cover - the scene says it first


def _scene_with_index(scene: Scene, values: Values, where: int) -> Scene:
    """Return the scene of one top; a message names the top's index, if there are several.  Raises SceneError."""
    try:
        return scene_at(scene, values, where)
    except SceneError as error:
        raise SceneError(f"{error}{_index(values, where)}") from error


def _index(values: Values, where: int) -> str:
    """Return where a top is in a map, as the end of a message; empty if it is the only one."""
    shape = next(iter(values.values())).shape if values else ()
    if math.prod(shape) == 1:
        return ""
    return f" (index {', '.join(str(int(i)) for i in np.unravel_index(where, shape))} of the values)"


def _alike(columns: list[NDArray[Any]], size: int) -> Iterator[Indices]:
    """Yield the tops, as places in the flat map, whose words and lists are the same."""
    if size == 0:
        return
    codes = np.zeros(size, dtype=np.int64)
    for column in columns:
        texts = np.array([repr(plain(value)) for value in column.ravel()])
        _, code = np.unique(texts, return_inverse=True)
        _, codes = np.unique(codes * (code.max() + 1) + code, return_inverse=True)
    order = np.argsort(codes, kind="stable")
    yield from np.split(order, np.flatnonzero(np.diff(codes[order])) + 1)


def _of_one_scene(scene: Scene, values: Values, group: Indices, view: Callable[[Indices], Scene]) -> Iterator[Batch]:
    """Yield the tops of one scene with varied numbers, in batches; checked by the scene's rules.

    Args:
        scene: as it was given, for messages.
        values: of all tops.
        group: which of them these are, shape (n,).
        view: makes the scene of some of them.
    """
    if broken := list(_broken(view, group.size)):
        _scene_with_index(scene, values, int(group[min(broken)]))

    def ready(which: Indices) -> tuple[Any, ...]:
        try:
            return _ready(view(which))
        except (SceneError, FieldError):  # a top that floats nowhere, a base that is too thin: said by its own scene
            where = int(group[which[0]])
            try:
                _ready(scene_at(scene, values, where))
            except LevilabError as error:
                raise SceneError(f"{error}{_index(values, where)}") from error
            raise  # pragma: no cover - its own scene says it first

    for which, (model, fewer, start, scheme, runs, longest, other) in split(np.arange(group.size), ready):
        n = which.size
        yield Batch(
            group[which],
            template_of(model),
            tuple(template_of(less) for less in fewer),
            scheme,
            _rows(n, list(np.moveaxis(np.asarray(start), -1, 0))),
            _rows(n, numbers_of(model)),
            _rows(n, runs),
            _rows(n, [longest])[:, 0],
            _rows(n, other[:2]),
            _rows(n, other[2:])[:, 0],
        )


def _broken(view: Callable[[Indices], Scene], size: int) -> Iterator[int]:
    for rule in RULES:
        for which, holds in split(np.arange(size), lambda which, rule=rule: rule.holds(view(which))):  # type: ignore[misc]
            if not np.all(holds):
                yield int(which[np.argmin(np.broadcast_to(holds, which.shape))])


def _with_leaf(part: Any, path: list[str], leaf: Any) -> Any:
    """Return a part of a scene with other numbers at the end of a path, unchecked."""
    if not path:
        return leaf
    name, *rest = path
    if isinstance(part, tuple):
        return tuple(_with_leaf(inner, rest, leaf) if i == int(name) else inner for i, inner in enumerate(part))
    return part.model_copy(update={name: _with_leaf(getattr(part, name), rest, leaf)})


def _rows(n: int, columns: list[Any]) -> Array:
    """Return columns of n numbers each, or of one that all share, as an array of shape (n, k)."""
    rows = np.empty((n, len(columns)))
    for i, column in enumerate(columns):
        rows[:, i] = column
    return rows


def _ready(scene: Scene) -> tuple[Any, ...]:
    """Return what a kernel needs of a scene whose numbers may be those of many tops.  Raises SceneError."""
    if scene.observed == "spin":
        raise SceneError("observed = spin: the spin alone has a closed form; many at once need observed = motion")
    start = start_of(scene)
    place = tuple(start[..., i] for i in range(R.stop))
    model = model_of(scene, place)
    scheme = scheme_for(None, model)
    fewer = [model_of(scene, place, -less) for less in (1, 2)] if isinstance(model.magnet, Disc) else []
    return (
        model, fewer, start, scheme, _runs(scene, model), longest_step(scene, model, start, scheme),
        [scene.top.inertia_axial_kg_m2, scene.washers.inertia_kg_m2, model.body.inverse_transverse],
    )  # fmt: skip


def _runs(scene: Scene, model: Any) -> list[Any]:
    """Return the columns that `kernels.pieces` names, of a scene whose numbers may be those of many tops."""
    drive = scene.drive
    runs: list[Any] = [0.0] * JOB_SIZE
    runs[RADIUS], runs[HEIGHT], runs[OFF], runs[FIRST] = scene.escape.radius_m, scene.escape.height_m, math.inf, 1.0
    if model.drive is None:
        return runs
    if drive.off_s is not None:
        runs[OFF] = drive.off_s
    if drive.waveform != "sine":
        runs[RATE], runs[TURNS] = drive.frequency_hz, drive.phase_rad / (2 * math.pi)
        runs[SECOND] = -1.0 if drive.waveform == "square" else 0.0
    if drive.waveform == "triangle":
        runs[OFFSET], runs[STEEP] = 0.25, 4 * drive.frequency_hz
    return runs


# --- kinds ---


def _kind(model: Any) -> Any:
    """Return a key that differs where models need different kernels: their types, and arrays that all lanes share."""
    if isinstance(model, np.ndarray):
        return model.tobytes()
    if isinstance(model, tuple):
        return (type(model).__name__, *(_kind(inner) for inner in model))
    return type(model).__name__


def _join(several: list[Batch]) -> Batch:
    """Return batches of one kind as one, its tops in the order of the map."""
    if len(several) == 1:
        return several[0]
    columns: Any = {name: np.concatenate([getattr(batch, name) for batch in several]) for name in _COLUMNS}
    whole = replace(several[0], **columns)
    return whole.part(np.argsort(whole.where))
