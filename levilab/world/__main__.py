"""Compile the kernels of the scenes that levilab brings, as an installer does: ``python -m levilab.world``.

A wheel cannot hold machine code, which is made for one processor.
"""

from levilab.simulator.ensemble import simulate_many
from levilab.simulator.scene import preset, presets
from levilab.simulator.single import simulate
from levilab.world.motion_world import prepare

#: Duration of each motion [s].
DURATION_S = 0.01


def compile_kernels() -> None:
    """Compile those of one top, of several, and of the bench; what lies on the disk is left."""
    for scene in map(preset, presets()):
        simulate(scene, DURATION_S)
        simulate_many(scene, {"start.spin_hz": [scene.start.spin_hz]}, DURATION_S)
        prepare(scene)


if __name__ == "__main__":
    compile_kernels()
