"""What an animation says beside its pictures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from levilab.motion.animation.poses import Poses


def speed_in_words(speed: float) -> str:
    """A film's speed, as a part of the real one.

    >>> [speed_in_words(x) for x in (0.05, 1.0, 0.3, 2.0)]
    ['1/20 of real speed', 'real speed', '0.3 of real speed', '2 times real speed']
    """
    if speed == 1:
        return "real speed"
    if speed > 1:
        return f"{speed:g} times real speed"
    whole = round(1 / speed)
    return f"1/{whole} of real speed" if math.isclose(whole * speed, 1, rel_tol=1e-6) else f"{speed:g} of real speed"


def short_speed(speed: float) -> str:
    """A film's speed in a list of them.

    >>> [short_speed(x) for x in (0.05, 1.0, 0.3)]
    ['1/20', '1', '0.3']
    """
    return speed_in_words(speed).removesuffix(" of real speed") if speed < 1 else f"{speed:g}"


def readout(poses: Poses, k: int) -> list[tuple[str, str]]:
    """Names and values of what is read at the k-th pose."""
    rows = [
        ("time", f"{poses.times[k]:.3f} s"),
        ("height", f"{100 * poses.positions[k, 2]:.2f} cm"),
        ("tilt", f"{math.degrees(poses.tilts[k]):.1f}°"),
        ("spin", f"{poses.spins[k]:.2f} Hz".replace("-", "−")),
    ]
    if poses.scene.washers.inertia_kg_m2 > 0:
        rows.append(("slip", f"{poses.slips[k] / (2 * math.pi):.2f} turns".replace("-", "−")))
    return rows
