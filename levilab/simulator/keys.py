"""Dotted keys: nested tables, changed and checked by paths such as top.mass_kg or start.position_m.0."""

import difflib
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from levilab.errors import LevilabError, RequestError
from levilab.files import parse_toml, toml_value
from levilab.formats.typed import read_number, unit_of_key
from levilab.texts.text import Text, either, verbatim

Table = dict[str, Any]

#: Words that people use for a key whose own name is quite different.
SYNONYMS: dict[str, tuple[str, ...]] = {
    "kind": ("drive.waveform", "drag.law", "top.magnet"),
    "type": ("drive.waveform", "drag.law", "top.magnet"),
    "model": ("drag.law", "base.field"),
    "shape": ("drive.waveform", "top.magnet"),
    "form": ("drive.waveform",),
    "friction": ("drag.law",),
    "damping": ("drag.law",),
    "constant": ("drag.coefficient",),
    "weight": ("top.mass_kg",),
    "inertia": ("top.inertia_axial_kg_m2",),
    "dipole": ("top.moment_a_m2",),
    "magnetization": ("base.strength_t_m",),
    "order": ("base.field",),
    "rotation": ("start.spin_hz",),
    "rpm": ("start.spin_hz",),
    "omega": ("start.spin_hz",),
    "speed": ("start.spin_hz", "start.velocity_m_s"),
    "angle": ("start.tilt_rad", "base.tilt_rad"),
    "height": ("start.position_m", "escape.height_m"),
    "limit": ("escape.radius_m", "escape.height_m"),
    "g": ("gravity_m_s2",),
}
#: How similar a name must be to be suggested, from 0 to 1: in the same table, and in any table.
_ALIKE, _ALIKE_ANYWHERE = 0.6, 0.6


class SceneError(LevilabError):
    """A scene that cannot be simulated as it is described."""


class UnknownKey(SceneError):
    """A key that a scene lacks.

    Attributes:
        problem: the text without the setting.
    """

    def __init__(self, given: str, problem: str) -> None:
        self.problem = problem
        super().__init__("{given:s}: {problem}", given=given, problem=problem)


class UnknownScene(SceneError, RequestError):
    """A name that none of the scenes has that come with levilab."""


def parse_setting(setting: str) -> tuple[str, Any]:
    """Split KEY=VALUE into a dotted key and a value of TOML; a word without quotes is a string.

    A number may have a unit of the quantity with which the key ends.

    Raises:
        SceneError: it has another form, or no TOML value.

    >>> parse_setting("drag.law=stokes"), parse_setting("start.position_m = [0, 0, 7.2cm]")
    (('drag.law', 'stokes'), ('start.position_m', [0.0, 0.0, 0.072]))
    >>> parse_setting("top.mass_kg=25 g")
    ('top.mass_kg', 0.025)
    """
    key, equals, text = setting.partition("=")
    key, text = key.strip(), text.strip()
    if not (key and equals):
        raise SceneError(
            "'{seen:s}': KEY=VALUE is expected, such as top.mass_kg=0.025 or drag.law=stokes", seen=setting
        )
    return key, _value(key, text)


#: A number with letters behind it.
_WITH_UNIT = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)\s*[^\W\d_]+")


def _value(key: str, text: str) -> Any:
    try:
        table = parse_toml(f"value = {text}")
        if table.keys() == {"value"}:  # a line break in the text would begin another key
            return table["value"]
    except tomllib.TOMLDecodeError:
        pass
    except ValueError as error:
        raise SceneError("'{short_text:s}': {error}", short_text=short_text(text), error=error) from None
    unit = unit_of_key(key)
    listed = text.startswith("[") and text.endswith("]")
    try:  # .5 and 5. are numbers, too, but not in TOML
        return [read_number(one, unit) for one in text[1:-1].split(",")] if listed else read_number(text, unit)
    except ValueError as error:
        if unit and _WITH_UNIT.fullmatch(text):
            raise SceneError("{key} = {error}", key=key, error=error) from None
        return text


def set_key(table: Table, key: str, value: Any) -> None:
    """Set the value of a dotted key in a table of tables and lists.

    Args:
        table: is changed; it must have the key already.
        key: such as ``top.mass_kg`` or ``start.position_m.2``.
        value: a number, string or list; a table changes the keys that it holds and leaves the others.

    Raises:
        UnknownKey: there is no such key.
        SceneError: it is a table and the value is none.
    """
    given = f"{key} = {short_text(value)}"
    *way, last = key.split(".")
    at: Any = table
    for depth, part in enumerate(way):
        at = at[_step(table, at, [*way[:depth], part], given)]
    step = _step(table, at, [*way, last], given)
    if not isinstance(at[step], dict):
        at[step] = plain(value)
    elif isinstance(value, dict):
        for inner, item in value.items():
            set_key(table, f"{key}.{inner}", item)
    else:
        raise SceneError("{at}: a table is expected, with the keys {names:s}", at=given, names=", ".join(at[step]))


def _step(table: Table, at: Any, way: list[str], given: str) -> str | int:
    """Return the last part of a path into a table as a key or an index.

    Args:
        table: the whole table, for suggestions.
        at: what the path before its last part leads to.
        way: the path, part by part.
        given: the setting, for messages.

    Raises:
        SceneError: there is no such part.
    """
    *before, part = way
    if isinstance(at, dict) and part in at:
        return part
    if isinstance(at, dict):
        raise UnknownKey(given, _unknown_key(table, at, way))
    if not isinstance(at, list):
        what = "{given}: {key:s} = {seen:s} has no parts, give it as a whole"
        raise SceneError(what, given=given, key=".".join(before), seen=short_text(at))
    if not (part.isdecimal() and int(part) < len(at)):
        what = "{given}: {key:s} has {n} numbers, counted from 0 to {last}"
        raise SceneError(what, given=given, key=".".join(before), n=len(at), last=len(at) - 1)
    return int(part)


def _unknown_key(table: Table, at: Table, way: list[str]) -> str:
    """Return what to say about an unknown key: suggestions, and the keys that exist."""
    before = way[:-1]
    similar = [*map(verbatim, _suggestions(table, at, way))]
    where = Text(" in {name:s}", name=".".join(before)) if before else ""
    said = "there is no key {key:s}; known{where} are {names:s}"
    said = "there is no key {key:s}; did you mean {similar}? Known{where} are {names:s}" if similar else said
    return Text(said, key=".".join(way), similar=either(similar or [""]), where=where, names=", ".join(at))


def _suggestions(table: Table, at: Table, way: list[str]) -> list[str]:
    """Return keys to suggest for an unknown one: of the same name in another table, a synonym, a similar spelling."""
    *before, part = way
    leaves = [(f"{name}.{key}", key) for name, inner in table.items() if isinstance(inner, dict) for key in inner]
    same = [path for path, key in leaves if key == part]
    if same:
        return same
    near = nearest(part, at)
    beside = [".".join([*before, near])] if near else []
    named = _by_meaning(table, before, part)
    if named or (before and beside):  # a path that names its table most likely means one of its keys
        return named or beside
    likeness = {path: _likeness(part, key) for path, key in leaves}
    best = max(likeness.values(), default=0.0)
    if best < _ALIKE_ANYWHERE or (near and _likeness(part, near) >= best):
        return beside
    return [path for path, value in likeness.items() if value == best]


def similar_keys(table: Table, word: str) -> list[str]:
    """Return the dotted keys that a single word may mean."""
    return _suggestions(table, table, [word])


def _by_meaning(table: Table, before: list[str], part: str) -> list[str]:
    """Return the keys for which a word is a synonym: those of the named table if there are some, else all."""
    known = [path for path in SYNONYMS.get(part.lower(), ()) if _is_key(table, path)]
    own = [path for path in known if path.split(".")[:-1] == before]
    return own or known


def _is_key(table: Table, path: str) -> bool:
    name, _, key = path.partition(".")
    return name in table and (not key or key in table[name])


def _likeness(word: str, known: str) -> float:
    return difflib.SequenceMatcher(None, known, word.lower()).ratio()


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that is spelled most like this one; None if none is similar."""
    found = difflib.get_close_matches(word.lower(), list(known), n=1, cutoff=_ALIKE)
    return found[0] if found else None


def plain(value: Any) -> Any:
    """Return numbers and arrays of numpy as Python's own numbers and lists."""
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value.tolist() if hasattr(value, "tolist") else value


def short_text(value: Any) -> str:
    """Return a value as text of at most 60 characters."""
    text = str(plain(value))
    return text if len(text) <= 60 else f"{text[:59]}…"


def as_toml(table: Mapping[str, Any]) -> str:
    """Return a table of strings, numbers, lists and tables of these as TOML text, without keys that are None.

    >>> print(as_toml({"a": 1.5, "b": {"c": [1e-06, "x"], "d": None}}))
    a = 1.5
    <BLANKLINE>
    [b]
    c = [1e-06, "x"]
    """
    return "\n".join(_lines(table))


def _lines(table: Mapping[str, Any]) -> Iterator[str]:
    yield from _assignments(table)
    for name, inner in table.items():
        if isinstance(inner, dict):
            yield from ("", f"[{name}]", *_assignments(inner))


def _assignments(table: Mapping[str, Any]) -> Iterator[str]:
    for key, value in table.items():
        if value is not None and not isinstance(value, dict):
            yield f"{key} = {toml_value(value)}"
