"""A scene: what is simulated, from the magnets to the start, with the thesis's device as default.

The frame is the base's: origin at its centre, z up its axis.  If the base leans, gravity leans in this frame.
A scene is a preset, a TOML file, or either of them with some keys changed.  Values that contradict each other raise
SceneError with the key, its value and what is allowed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from operator import attrgetter
from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import NonNegativeFloat, ValidationError, model_validator

from levilab.files import read_toml
from levilab.settings import in_one_line
from levilab.simulator.keys import SceneError, Table, UnknownScene, as_toml, nearest, parse_setting, set_key, short_text
from levilab.simulator.laws import LAWS
from levilab.simulator.parts import Base, Drag, Drive, Escape, Part, Start, TemperatureRise, Top, Washers
from levilab.texts.text import Text

__all__ = [
    "Base", "Drag", "Drive", "Escape", "Scene", "SceneError", "Start", "Top", "Washers",
    "changes", "preset", "presets", "read_scene", "remarks", "scene_of", "with_settings",
]  # fmt: skip


class Scene(Part):
    """What is simulated; with observed "spin" only the spin is, in closed form.

    Base and top are warmer by temperature_rise_k [K] than where their strength and moment are given.

    Raises pydantic's ValidationError for a value that its key does not allow, SceneError for values that do not
    go together; `scene_of`, `read_scene`, `with_settings` and `changed` raise SceneError for both.
    """

    name: str = ""
    description: str = ""
    observed: Literal["motion", "spin"] = "motion"
    gravity_m_s2: NonNegativeFloat = 9.82
    temperature_rise_k: TemperatureRise = 0.0
    base: Base = Base()
    top: Top = Top()
    washers: Washers = Washers()
    drag: Drag = Drag()
    drive: Drive = Drive()
    start: Start = Start()
    escape: Escape = Escape()

    @model_validator(mode="after")
    def _check_rules(self) -> Scene:
        for rule in RULES:
            if not rule.holds(self):
                value = short_text(attrgetter(rule.key)(self))
                expected = Text(rule.expected, limit=rule.of and str(attrgetter(rule.of)(self)))
                raise SceneError("{key:s} = {value:s}: {expected}", key=rule.key, value=value, expected=expected)
        return self

    @property
    def strength(self) -> float:
        """The base's strength at this temperature [T m]."""
        return self.base.strength_t_m * (1 + self.base.temperature_coefficient_per_k * self.temperature_rise_k)

    @property
    def moment(self) -> float:
        """The top's moment at this temperature, signed [A m²]."""
        return self.top.moment_a_m2 * (1 + self.top.temperature_coefficient_per_k * self.temperature_rise_k)

    def changed(self, values: Mapping[str, Any]) -> Scene:
        """Return the scene with other values at dotted keys, checked.  Raises SceneError.

        >>> Scene().changed({"top.mass_kg": 0.025, "start.position_m.2": 0.072}).start.position_m
        (0.001, 0.0, 0.072)
        """
        table = self.as_table()
        for key, value in values.items():
            set_key(table, key, value)
        # a constant belongs to its law: another law brings its own, unless the values hold one
        given = any(key.startswith("drag.coefficient") for key in values) or "coefficient" in values.get("drag", ())
        if table["drag"]["law"] != self.drag.law and not given:
            table["drag"]["coefficient"] = None
        return scene_of(table)

    def as_table(self) -> Table:
        """Return all keys with their values, as TOML and JSON have them; None for a key without one."""
        return self.model_dump(mode="json")

    def as_toml(self) -> str:
        """Return the scene as the text of a TOML file."""
        return as_toml(self.as_table()) + "\n"


class Rule(NamedTuple):
    """A condition on the values of a scene.

    Attributes:
        key: of the value that the message shows.
        holds: whether the scene fulfils it.
        expected: what is allowed, a template in which limit is a value of the scene.
        of: the key of that value; None: there is none.
    """

    key: str
    holds: Callable[[Scene], bool]
    expected: str
    of: str | None = None


RULES: tuple[Rule, ...] = (
    Rule(
        "base.outer_radius_m",
        lambda s: s.base.outer_radius_m > s.base.inner_radius_m,
        "more than base.inner_radius_m = {limit} is expected",
        "base.inner_radius_m",
    ),
    Rule(
        "top.inertia_axial_kg_m2",
        # a flat body has just twice; the margin is for sums that were rounded
        lambda s: s.top.inertia_axial_kg_m2 <= 2 * s.top.inertia_transverse_kg_m2 * (1 + 1e-9),
        "at most twice top.inertia_transverse_kg_m2 = {limit} is expected; no symmetric body has more",
        "top.inertia_transverse_kg_m2",
    ),
    Rule("top.moment_a_m2", lambda s: s.top.moment_a_m2 != 0, "any number but 0 is expected, negative to float"),
    Rule(
        "top.moment_tilt",
        lambda s: any(s.top.moment_tilt),
        "[transverse, axial] parts are expected that are not both 0, such as [0.03, 0.97]",
    ),
    Rule(
        "washers.inertia_kg_m2",
        lambda s: s.washers.inertia_kg_m2 < s.top.inertia_axial_kg_m2,
        "less than top.inertia_axial_kg_m2 = {limit} is expected, of which it is a part",
        "top.inertia_axial_kg_m2",
    ),
    Rule(
        "drag.coefficient",
        lambda s: s.drag.law == "none" or len(s.drag.constants) == len(LAWS[s.drag.law].names),
        "two numbers, [c1, c2], are expected with drag.law = mixed and one with every other law (here: {limit:s})",
        "drag.law",
    ),
    Rule(
        "drive.direction",
        lambda s: any(s.drive.direction),
        "a direction is expected, such as [0, 1, 0]; for no drive set drive.waveform to off",
    ),
    Rule(
        "drive.ramp_hz_per_s",
        lambda s: (
            s.drive.ramp_hz_per_s == 0
            or s.drive.waveform == "off"
            or (s.drive.waveform == "sine" and s.drive.off_s is not None)
        ),
        "a drive with waveform = sine and an end, off_s, is expected with it: steps are made for the frequency there",
    ),
    Rule(
        "start.position_m",
        lambda s: s.start.place != "given" or s.start.position_m[2] > max(0.0, s.escape.height_m),
        "a height (the third number) above the base, 0, and above escape.height_m = {limit} is expected",
        "escape.height_m",
    ),
    Rule(
        "start.position_m",
        lambda s: s.start.place != "given" or s.start.away2 <= s.escape.radius_m * s.escape.radius_m,
        "a place within escape.radius_m = {limit} of the base's axis is expected",
        "escape.radius_m",
    ),
    Rule(
        "start.precession",
        lambda s: s.start.precession != "steady" or s.start.tilt_rad > 0,
        "start.tilt_rad above 0 is expected with it; an upright top does not precess: take none",
    ),
    Rule(
        "observed",
        lambda s: s.observed != "spin" or s.top.aligned,
        "motion is expected, since a transverse part of the moment, top.moment_tilt.0, couples the spin to it",
    ),
    Rule(
        "observed",
        lambda s: s.observed != "spin" or s.washers.inertia_kg_m2 == 0,
        "motion is expected, since washers.inertia_kg_m2 = {limit} are loose; spin goes with an inertia of 0",
        "washers.inertia_kg_m2",
    ),
)


class Remark(NamedTuple):
    """A setting that is allowed but has no effect.

    Attributes:
        applies: whether the scene has it.
        text: what to say.
    """

    applies: Callable[[Scene], bool]
    text: str


def _place_is_ignored(s: Scene) -> bool:
    usual = (Start().position_m, Start().velocity_m_s)
    return s.start.place == "equilibrium" and (s.start.position_m, s.start.velocity_m_s) != usual


REMARKS: tuple[Remark, ...] = (
    Remark(
        lambda s: s.drive.waveform != "off" and s.top.aligned,
        "the drive cannot change the spin: a uniform field does not turn a moment that lies along the axis "
        "(top.moment_tilt.0 = 0; the thesis's driven top has top.moment_tilt = [0.03, 0.97])",
    ),
    Remark(
        lambda s: s.drive.waveform != "off" and s.drive.amplitude_t == 0,
        "the drive does nothing: drive.amplitude_t = 0",
    ),
    Remark(_place_is_ignored, "start.position_m and start.velocity_m_s do nothing: start.place = equilibrium"),
)


class Switch(NamedTuple):
    """A part of the scene that can be off; then its other keys have no effect.

    Attributes:
        table: of the part.
        is_off: whether the scene has it switched off.
        keys: of the table, that have no effect then.
        why: the value that switches it off, and what switches it on; {value} is its value, {laws} are laws of drag.
        of: the key of that value; None: there is none.
    """

    table: str
    is_off: Callable[[Scene], bool]
    keys: tuple[str, ...]
    why: str
    of: str | None = None


SWITCHES: tuple[Switch, ...] = (
    Switch(
        "drive",
        lambda s: s.drive.waveform == "off",
        ("amplitude_t", "frequency_hz", "phase_rad", "direction", "off_s", "ramp_hz_per_s"),
        "drive.waveform = off; sine, triangle, square, unipolar or triggered switches the drive on",
    ),
    Switch(
        "drive",
        lambda s: s.drive.waveform != "triggered",
        ("light_rad", "latency_s", "cycle_turns"),
        "drive.waveform = {value:s}; triggered lets the tape set off bursts",
        "drive.waveform",
    ),
    Switch(
        "drive",
        lambda s: s.drive.waveform == "triggered" and s.drive.cycle_turns > 0,
        ("frequency_hz",),
        "drive.cycle_turns = {value:s} gives the bursts their length; 0 leaves it to the frequency",
        "drive.cycle_turns",
    ),
    Switch(
        "drag",
        lambda s: s.drag.law == "none",
        ("coefficient",),
        "drag.law = none; one of {laws:s} switches the drag on",
    ),
    Switch(
        "washers",
        lambda s: s.washers.inertia_kg_m2 == 0,
        ("coupling_n_m_s", "drag_share"),
        "washers.inertia_kg_m2 = 0; a number above 0 makes washers loose",
    ),
)


def remarks(scene: Scene) -> list[str]:
    """Return a sentence for each setting of a scene that has no effect."""
    texts = [remark.text for remark in REMARKS if remark.applies(scene)]
    return texts + [text for switch in SWITCHES if switch.is_off(scene) and (text := _without_effect(scene, switch))]


def _without_effect(scene: Scene, switch: Switch) -> str:
    """Return a sentence about the keys that differ from their defaults in a part that is off; empty if none does."""
    part, usual = getattr(scene, switch.table), getattr(Scene(), switch.table)
    keys = [key for key in switch.keys if getattr(part, key) != getattr(usual, key)]
    *first, last = [f"{switch.table}.{key} = {short_text(getattr(part, key))}" for key in keys] or [""]
    said = "{first:s} and {last:s} do nothing: {why}" if first else "{last:s} does nothing: {why}"
    why = Text(switch.why, value=switch.of and short_text(attrgetter(switch.of)(scene)), laws=", ".join(LAWS))
    return Text(said, first=(*first,), last=last, why=why) if keys else ""


def scene_of(table: Mapping[str, Any]) -> Scene:
    """Return the scene that a table of keys describes; other keys have their defaults.  Raises SceneError."""
    whole = Scene().as_table()
    whole["drag"] = {"law": "none", "coefficient": None}
    for key, value in table.items():
        set_key(whole, key, value)
    try:
        return Scene.model_validate(whole)
    except ValidationError as error:
        raise SceneError(in_one_line(error)) from error


def with_settings(scene: Scene, settings: Iterable[str]) -> Scene:
    """Return the scene with changes, each KEY=VALUE; it is checked after the last one.  Raises SceneError.

    >>> with_settings(preset("friction"), ["top.mass_kg=0.0255", "drag.law=newton"]).drag.constants
    (1.727e-05,)
    """
    return scene.changed(dict(map(parse_setting, settings)))


def presets() -> list[str]:
    """Return the names of the scenes that come with levilab."""
    return sorted(file.name.removesuffix(".toml") for file in _scenes_folder().iterdir() if file.name.endswith(".toml"))


def preset(name: str) -> Scene:
    """Return a scene that comes with levilab, by its name.  Raises SceneError."""
    if name in presets():
        return _read_file(_scenes_folder() / f"{name}.toml", name)
    near = nearest(name, presets())
    said = (
        "there is no scene {name:s}: did you mean {near:s}? Known are {known:s}; or give the path of a TOML file"
        if near
        else "there is no scene {name:s}: known are {known:s}; or give the path of a TOML file"
    )
    raise UnknownScene(said, name=repr(name), near=near, known=", ".join(presets()))


def changes(scene: Scene) -> dict[str, Any] | None:
    """Return dotted key → value where a scene differs from the preset of its name; None if that is no preset.

    >>> changes(preset("driven").changed({"top.mass_kg": 0.025, "drag.law": "disc"}))
    {'top.mass_kg': 0.025, 'drag.law': 'disc', 'drag.coefficient': 0.000234}
    """
    if scene.name not in presets():
        return None
    usual = dict(leaves(preset(scene.name).as_table()))
    return {key: value for key, value in leaves(scene.as_table()) if value != usual[key]}


def leaves(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys with their values."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{before}{key}.")
        else:
            yield before + key, value


def read_scene(name_or_path: str | Path) -> Scene:
    """Return the scene that a preset's name or the path of a TOML file stands for.  Raises SceneError."""
    name, path = str(name_or_path), Path(name_or_path)
    if name in presets() or not (path.suffix == ".toml" or len(path.parts) > 1 or path.exists()):
        return preset(name)
    return _read_file(path, path.stem)


def _scenes_folder() -> Traversable:
    return resources.files("levilab.simulator") / "scenes"


def _read_file(file: Traversable | Path, name: str) -> Scene:
    """Return the scene of a file; its name is `name` unless the file says another.  Raises SceneError."""
    text = "{file:s}: there is no such file; scenes that come with levilab are {names:s}, each a TOML file to copy"
    missing = Text(text, file=file, names=", ".join(presets()))
    table = read_toml(file, SceneError, missing, "a TOML file is expected, or the name of a scene")
    try:
        return scene_of({"name": name} | table)
    except SceneError as error:
        raise SceneError("{path:s}: {error}", path=file, error=error) from error
