"""The person at a virtual bench: carries out tasks in the world."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.bench.person import FloatTop, PlaceProbe, ShieldProbe

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.bench.person import Task
    from levilab.world.spin_world import World


class VirtualPerson:
    """Carries out, at once, the tasks that change something in the world; all others are answered with nothing."""

    def __init__(self, world: World) -> None:
        self.world = world

    def __call__(self, task: Task) -> str:
        """Carry out a task; returns the answer."""
        carry_out = _DEEDS.get(type(task))
        return carry_out(self.world, task) if carry_out else ""


def _float_top(world: World, task: Task) -> str:
    assert isinstance(task, FloatTop)
    world.float_top(task.number)
    return ""


def _place_probe(world: World, task: Task) -> str:
    assert isinstance(task, PlaceProbe)
    world.place_probe(task.height_m)
    return ""


def _shield_probe(world: World, task: Task) -> str:  # noqa: ARG001 - as all deeds are done
    world.place_probe(None)
    return ""


#: Kind of task → what is done in the world; returns the answer.
_DEEDS: dict[type[Task], Callable[[World, Task], str]] = {
    FloatTop: _float_top,
    PlaceProbe: _place_probe,
    ShieldProbe: _shield_probe,
}
