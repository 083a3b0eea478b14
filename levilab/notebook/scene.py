"""Scenes as scripts and notebooks name and change them."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from levilab.errors import UsageError
from levilab.formats.typed import read_number, unit_of_key
from levilab.simulator.keys import parse_setting
from levilab.simulator.scene import Scene, leaves, preset, presets, read_scene


def list_scenes() -> dict[str, str]:
    """Return the scenes that come with levilab: name → description."""
    return {name: preset(name).description for name in presets()}


def chosen_scene(scene: Scene | str | PathLike[str], settings: Mapping[str, Any], by_name: Mapping[str, Any]) -> Scene:
    """Return a scene with changes.

    Args:
        scene: itself, a name, or a TOML file.
        settings: changes by dotted keys.
        by_name: changes by the last parts of keys, as mass_kg.

    Raises:
        SceneError: there is no such scene, key or value.
    """
    read = scene if isinstance(scene, Scene) else read_scene(Path(scene))
    for name in by_name:
        if name in _OPTIONS:
            raise UsageError(name, f"is no key of a scene; take {_OPTIONS[name]}")
    whole = {**settings, **{whole_key(read, name): value for name, value in by_name.items()}}
    return read.changed({key: _with_unit(key, value) for key, value in whole.items()})


#: What others call an option of simulations, which no key of a scene is → what to type.
_OPTIONS = {
    **dict.fromkeys(("t", "time", "t_end", "tmax", "t_max", "t_span"), "duration=…, in seconds or as '2min'"),
    **dict.fromkeys(("dt", "step", "samples", "n", "t_eval", "fs"), "rate=…, the states per second"),
    **dict.fromkeys(("rtol", "atol", "tol"), "tolerance=…, of the end [m and rad]"),
}


def _with_unit(key: str, value: Any) -> Any:
    """Return a value that may be typed with its unit, as "25 g", where its key ends in one."""
    return parse_setting(f"{key}={value}")[1] if isinstance(value, str) and unit_of_key(key) else value


def in_seconds(duration: float | str) -> float:
    """Return a duration [s] that may be typed with its unit, as "2min".  Raises UsageError."""
    try:
        return read_number(duration, "s") if isinstance(duration, str) else duration
    except ValueError as error:
        raise UsageError("duration", str(error)) from None


def whole_key(scene: Scene, name: str) -> str:
    """Return the dotted key that ends in a name, or is it with underscores; the name where none or several do.

    >>> whole_key(preset("undriven"), "mass_kg"), whole_key(preset("undriven"), "start_spin_hz")
    ('top.mass_kg', 'start.spin_hz')
    """
    found = [key for key, _ in leaves(scene.as_table()) if name in {key.rpartition(".")[2], key.replace(".", "_")}]
    return found[0] if len(found) == 1 else name
