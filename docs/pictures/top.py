"""Make docs/pictures/top.png: one picture of a film of the preset `driven`, at 840 × 640.

python docs/pictures/top.py
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT)]

from levilab.animation.film import Film, still  # noqa: E402
from levilab.animation.poses import poses_of  # noqa: E402
from levilab.simulator.scene import preset  # noqa: E402
from levilab.simulator.single import simulate  # noqa: E402

#: The picture shows this time, and the path of the axis before it [s].
TIME_S, BEFORE_S = 4.503, 0.6


def main() -> None:
    """Simulate, and draw the last picture of the film."""
    motion = simulate(preset("driven"), 5.0, tolerance=1e-8, rate=1000.0)
    poses = poses_of(motion, TIME_S - BEFORE_S, TIME_S, 1080)
    picture = still(Film(poses, None, 30.0, (840, 640)), len(poses.times) - 1)
    picture.save(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"), optimize=True)


if __name__ == "__main__":
    main()
