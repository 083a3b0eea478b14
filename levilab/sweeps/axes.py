"""The axes of a sweep from KEY=FROM:TO:N, values or a table of points, checked in the scene before any simulation."""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levilab.errors import SimulationError, UsageError
from levilab.formats.dialect import Dialect
from levilab.formats.typed import read_number, unit_of_key
from levilab.settings import hint_about
from levilab.simulator.keys import SceneError, short_text
from levilab.simulator.scene import SWITCHES, Scene
from levilab.simulator.start import start_of
from levilab.simulator.varied import broadcast
from levilab.sweeps.keys import value_at
from levilab.sweeps.plan import Axis, Scale, unit_of
from levilab.texts.text import Text

#: Dimensions of a map: one with more can neither be drawn nor computed in reasonable time.
MOST_AXES = 3
#: Greatest number of values of one key, which are kept in memory.
MOST_VALUES = 10_000_000
#: Number of values of an axis, or rows of a table, that are tried in the scene before the work, besides the corners.
TRIED = 200
_EXPECTED = "KEY=FROM:TO:N is expected, such as start.spin_hz=18:40:23, or KEY=FROM:TO:N:log"


def parse_axis(text: str) -> Axis:
    """Return the axis of KEY=FROM:TO:N or KEY=FROM:TO:N:log.

    Raises:
        UsageError: it has another form, or its numbers make no axis.

    >>> axis = parse_axis("start.tilt_rad=0.001:0.1:3:log")
    >>> axis.key, axis.values.tolist(), axis.scale
    ('start.tilt_rad', [0.001, 0.01, 0.1], 'log')
    """
    key, equals, spaced = (part.strip() for part in text.partition("="))
    parts = [part.strip() for part in spaced.split(":")]
    if not (key and equals and len(parts) in {3, 4}):
        raise UsageError("sweep", _EXPECTED, value=text)
    first, last = (_number(part, unit_of_key(key), text) for part in parts[:2])
    count = _count(parts[2], text)
    scale = _scale(parts[3:], text)
    _check_span(key, (first, last, count), scale, text)
    values = np.geomspace(first, last, count) if scale == "log" else np.linspace(first, last, count)
    return Axis(key, values, scale)


def axis_of(key: str, values: Iterable[Any] | float) -> Axis:
    """Return the axis of a key with any values that increase: numbers in its unit, or texts with their units.

    Raises:
        UsageError: they make no axis.

    >>> axis = axis_of("top.mass_kg", ["24.9 g", 0.025, "25.3g"])
    >>> axis.values.tolist(), axis.scale, axis_of("start.spin_hz", range(18, 41, 2)).scale
    ([0.0249, 0.025, 0.0253], 'list', 'linear')
    """
    try:
        unit = unit_of_key(key)
        each = [values] if isinstance(values, int | float) else values
        numbers = np.array([read_number(one, unit) if isinstance(one, str) else float(one) for one in each])
    except (TypeError, ValueError) as error:
        expected = f"numbers are expected, or texts with units; {error}"
        raise UsageError("sweep", expected, value=f"{key} = {short_text(values)}") from None
    given = f"{key} = {short_text(numbers)}"
    if not (len(numbers) and np.isfinite(numbers).all()):
        raise UsageError("sweep", "finite numbers are expected, two or more", value=given)
    if len(numbers) == 1:
        raise UsageError("sweep", f"one value is no axis: set it by `settings` = {key}={numbers[0]:g}", value=given)
    if len(numbers) > MOST_VALUES:
        raise UsageError("sweep", f"at most {MOST_VALUES:.0e} values of a key are possible", value=given)
    if not (np.diff(numbers) > 0).all():
        raise UsageError(
            "sweep", "values that increase are expected: numpy.unique sorts them; or FROM:TO:N, a text", value=given
        )
    return Axis(key, numbers, _spacing(numbers))


def _spacing(numbers: NDArray[Any]) -> Scale:
    """Return the scale on which values are spaced evenly but for rounding, else "list"."""
    first, last, count = numbers[0], numbers[-1], len(numbers)
    spaced: dict[Scale, NDArray[Any]] = {"linear": np.linspace(first, last, count)}
    spaced |= {"log": np.geomspace(first, last, count)} if first > 0 else {}
    return next((scale for scale, even in spaced.items() if np.allclose(numbers, even, rtol=1e-9, atol=0)), "list")


def _number(part: str, unit: str, text: str) -> float:
    try:
        number = read_number(part, unit)
    except ValueError:
        hint = hint_about(part) or f"; {part!r} is no number, and words are swept by a table of `points`"
        raise UsageError("sweep", f"{_EXPECTED}{hint}", value=text) from None
    if not math.isfinite(number):
        raise UsageError("sweep", f"{_EXPECTED}, with finite numbers", value=text)
    return number


def _count(part: str, text: str) -> int:
    if not part.isdecimal():
        raise UsageError("sweep", f"{_EXPECTED}; N, the number of values, is {part!r} here", value=text)
    return int(part)


def _scale(rest: Sequence[str], text: str) -> Scale:
    if not rest or rest == ["linear"]:
        return "linear"
    if rest != ["log"]:
        raise UsageError("sweep", f"{_EXPECTED}; after N stands log or nothing, not {rest[0]!r}", value=text)
    return "log"


#: Ends that differ so much have a slip in a unit.
_SLIP = 100.0


def _check_span(key: str, span: tuple[float, float, int], scale: Scale, text: str) -> None:
    first, last, count = span
    ending = ":log" if scale == "log" else ""
    if first == last or count == 1:
        raise UsageError("sweep", f"one value is no axis: set it by `settings` = {key}={first:g}", value=text)
    if first > last:
        if first > _SLIP * abs(last):
            raise UsageError(
                "sweep", f"FROM is {first:g} and TO {last:g}, in SI: is the unit of one wrong?", value=text
            )
        turned = f"{key}={last:g}:{first:g}:{count}{ending}"
        raise UsageError("sweep", f"FROM is above TO: take {turned}, the map is the same", value=text)
    if count < 2:
        raise UsageError("sweep", f"{_EXPECTED}; N is the number of values, 2 or more", value=text)
    if count > MOST_VALUES:
        raise UsageError("sweep", f"at most {MOST_VALUES:.0e} values of a key are possible", value=text)
    if scale == "log" and first <= 0:
        raise UsageError("sweep", f"a logarithmic axis needs FROM above 0, not {first:g}; leave log out", value=text)
    if (last - first) / count < 4 * max(math.ulp(first), math.ulp(last)):
        raise UsageError("sweep", "its values lie so close that numbers cannot tell them apart", value=text)


# --- a table of points ---


def read_points(path: Path) -> tuple[Axis, ...]:
    """Return the axes of a CSV table: its columns are named by keys of the scene, its rows are points.

    Separators are commas, semicolons or tabs; with semicolons or tabs numbers may have decimal commas.

    Raises:
        UsageError: the file cannot be read, or holds no such table; with the line.
    """
    lines = _lines(path)
    number, head = next(lines, (0, ""))
    if not head:
        raise UsageError("points", "it is empty; a first row with keys of the scene is expected", value=path)
    separator = next((mark for mark in ";\t" if mark in head), ",")
    dialect = Dialect(separator, ".")
    keys = dialect.split(head)
    if not all(keys) or len(set(keys)) < len(keys):
        raise UsageError("points", f"line {number}: a key above each column is expected, each once", value=path)
    rows = []
    for number, line in lines:
        cells = dialect.split(line)
        if len(cells) != len(keys) or not all(cells):
            raise UsageError("points", f"line {number}: {len(keys)} values are expected", value=path)
        rows.append(cells)
    if not rows:
        raise UsageError("points", "it has no row below its keys", value=path)
    columns = zip(*rows, strict=True)
    return tuple(
        Axis(key, _column(cells, decimal_comma=separator != ","), "table")
        for key, cells in zip(keys, columns, strict=True)
    )


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the lines that are neither blank nor comments, with their numbers.  Raises UsageError."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            for number, line in enumerate(file, 1):
                if line.strip(" \t\n,;") and not line.lstrip().startswith("#"):
                    yield number, line.rstrip("\n")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text in UTF-8"
        raise UsageError("points", f"cannot be read ({reason}); a table of text is expected", value=path) from error


def _column(cells: Sequence[str], *, decimal_comma: bool) -> np.ndarray[Any, np.dtype[Any]]:
    """Return a column as numbers, or as words where one is no number."""
    dialect = Dialect(None, "," if decimal_comma and any("," in cell for cell in cells) else ".")
    try:
        return np.array([dialect.number(cell) for cell in cells])
    except ValueError:
        return np.array(cells)


# --- checks in the scene ---


def check_axes(scene: Scene, axes: Sequence[Axis], settings: Iterable[str] = ()) -> None:
    """Raise UsageError for axes that the scene does not have, that are invalid in it, or that change nothing anywhere.

    Args:
        scene: with its settings.
        axes: of the sweep.
        settings: keys that are set for all points.
    """
    name = "points" if axes and axes[0].scale == "table" else "sweep"
    if not axes:
        raise UsageError("sweep", "no axis is given: at least one is needed, such as start.spin_hz=18:40:23")
    if name == "sweep" and len(axes) > MOST_AXES:
        expected = f"a map has at most {MOST_AXES}; sweep the others one by one, or give a table of `points`"
        raise UsageError("sweep", expected, value=", ".join(axis.key for axis in axes))
    for at, axis in enumerate(axes):
        if axis.key in {other.key for other in axes[:at]}:
            raise UsageError(name, "each key is swept once", value=axis.key)
        if axis.key in settings:
            raise UsageError(name, "`settings` has this key, too: leave one of them out", value=axis.key)
        _check_key(scene, axis, name)
    idle = [_idle_keys(_try(scene, values, name), values) for values in _points_to_try(axes)]
    for key, why in idle[0].items():
        if all(key in keys for keys in idle):
            raise UsageError(name, f"it changes nothing, since {why}", value=key)


def _check_key(scene: Scene, axis: Axis, name: str) -> None:
    """Raise UsageError for a key that the scene does not have, or that takes other values than those of an axis."""
    now = value_at(scene, axis.key, _plain(axis.values[0]), name)
    if isinstance(now, list):
        parts = ", ".join(f"{axis.key}.{k}" for k in range(len(now)))
        raise UsageError(name, f"it has {len(now)} numbers: sweep one of them, {parts}", value=axis.key)
    if axis.key in {"name", "description", "observed"}:
        raise UsageError(name, "it is the same for a whole map: set it by `settings`", value=axis.key)
    if isinstance(now, str) and axis.values.dtype.kind == "f":
        expected = f"it takes words, now {now}: give a table of `points` with a column {axis.key}, or a map for each"
        raise UsageError(name, expected, value=axis.key)
    if isinstance(now, float) and axis.values.dtype.kind == "U":
        word = next(word for word in axis.values.tolist() if not _is_number(word))
        raise UsageError(name, f"numbers are expected in its column, not {word!r}{hint_about(word)}", value=axis.key)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _points_to_try(axes: Sequence[Axis]) -> Iterator[dict[str, Any]]:
    """Yield points at which the scene is tried: the corners, and some on the way along each axis."""
    if axes[0].scale == "table":
        count = len(axes[0].values)
        rows = set(np.linspace(0, count - 1, min(count, TRIED)).round().astype(int).tolist())
        for axis in axes:
            if axis.values.dtype.kind == "f":
                rows |= {int(np.argmin(axis.values)), int(np.argmax(axis.values))}
        for row in sorted(rows):
            yield {axis.key: _plain(axis.values[row]) for axis in axes}
        return
    for corner in itertools.product((0, -1), repeat=len(axes)):
        yield {axis.key: float(axis.values[k]) for axis, k in zip(axes, corner, strict=True)}
    for axis in axes:
        for k in np.linspace(0, len(axis.values) - 1, min(len(axis.values), TRIED)).round().astype(int):
            yield {other.key: float(other.values[0]) for other in axes} | {axis.key: float(axis.values[k])}


def _try(scene: Scene, values: dict[str, Any], name: str) -> Scene:
    if error := error_at(scene, values):
        raise UsageError(name, error)
    return scene.changed(values)


def _idle_keys(scene: Scene, keys: Iterable[str]) -> dict[str, str]:
    """Return which of the keys have no effect in a scene, and why."""
    idle = {}
    for key in keys:
        table, _, part = key.partition(".")
        for switch in SWITCHES:
            if table == switch.table and part.split(".")[0] in switch.keys and switch.is_off(scene):
                idle[key] = switch.why
        if scene.start.place == "equilibrium" and key.startswith(("start.position_m", "start.velocity_m_s")):
            idle[key] = "start.place = equilibrium"
    return idle


def error_at(scene: Scene, values: Mapping[str, Any]) -> str:
    """Return why the values of a point are invalid in the scene, in a sentence that names them; empty where valid."""
    try:
        start_of(scene.changed(dict(values)))
    except (SceneError, SimulationError) as error:
        place = ", ".join(f"{key} = {short_text(value)}" for key, value in values.items())
        return f"at {place} the scene is invalid: {error}"
    return ""


def first_error(scene: Scene, values: Mapping[str, NDArray[Any]]) -> str:
    """Return why the first invalid one of some points is invalid in the scene; empty if none is."""
    arrays = broadcast(values)
    points = zip(*(array.ravel().tolist() for array in arrays.values()), strict=True)
    return next(filter(None, (error_at(scene, dict(zip(arrays, point, strict=True))) for point in points)), "")


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def in_words(axis: Axis) -> str:
    """Return an axis as a line: its key, its ends with the unit, how many values.

    >>> in_words(parse_axis("top.mass_kg=0.025:0.0255:11"))
    'top.mass_kg from 0.025 to 0.0255 kg, 11 values'
    """
    count = Text("{n} values", n=len(axis.values)) if len(axis.values) > 1 else "1 value"
    if axis.values.dtype.kind != "f":
        names = ", ".join(sorted(set(axis.values.tolist())))
        return Text("{key:s}: {names:s}; {count}", key=axis.key, names=names, count=count)
    unit = unit_of(axis.key)
    spaced = Text("{count}, logarithmic", count=count) if axis.scale == "log" else count
    least, most = axis.values.min(), axis.values.max()
    ends = Text("from {least:g} to {most:g}", least=least, most=most) if most > least else f"{least:g}"
    return Text("{key:s} {ends:n}{unit}, {count}", axis.key, ends, "" if unit == "1" else f" {unit}", spaced)
