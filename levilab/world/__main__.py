"""Compile the kernels of the scenes that levilab brings, as an installer does: ``python -m levilab.world``.

A wheel cannot hold machine code, which is made for one processor.
"""

from collections.abc import Iterable

from levilab.simulator.ensemble import simulate_many
from levilab.simulator.scene import preset, presets
from levilab.simulator.single import simulate
from levilab.world.motion_world import prepare

#: Duration of each motion [s].
DURATION_S = 0.01


def compile_kernels(names: Iterable[str]) -> None:
    """Compile the kernels of scenes for one top, for several, and for the bench, where none lie on the disk."""
    for scene in map(preset, names):
        simulate(scene, DURATION_S)
        simulate_many(scene, {"start.spin_hz": [scene.start.spin_hz]}, DURATION_S)
        prepare(scene)


if __name__ == "__main__":
    compile_kernels(presets())
