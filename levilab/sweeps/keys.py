"""The keys of a scene that a sweep can vary; light, so that the command refuses another one at once."""

from typing import Any

from levilab.errors import UsageError
from levilab.simulator.keys import SceneError, UnknownKey
from levilab.simulator.scene import Scene


def value_at(scene: Scene, key: str, tried: Any, option: str = "sweep") -> Any:
    """Return the scene's own value of a key, a number, a text or a list of numbers.

    Args:
        scene: with its settings.
        key: as "start.spin_hz".
        tried: a value of the axis.
        option: the name of the option, for messages.

    Raises:
        UsageError: it has none.
    """
    try:
        scene.changed({key: tried})
    except UnknownKey as error:
        raise UsageError(option, error.problem, value=key) from error
    except SceneError:
        pass  # of the value, which is looked at later
    at: Any = scene.as_table()
    for part in key.split("."):
        if isinstance(at, dict) and part in at:
            at = at[part]
        elif isinstance(at, list) and part.isdecimal() and int(part) < len(at):
            at = at[int(part)]
        elif isinstance(at, list):
            whole = key.rpartition(".")[0]
            parts = ", ".join(f"{whole}.{k}" for k in range(len(at)))
            raise UsageError(option, f"{whole} has {len(at)} numbers: sweep one of them, {parts}", value=key)
        else:
            raise UsageError(option, "there is no such number in the scene", value=key)
    if isinstance(at, dict):
        raise UsageError(option, f"it is a table: sweep one of its keys, {', '.join(at)}", value=key)
    return at
