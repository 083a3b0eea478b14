"""What an animation says beside its pictures."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from levilab.present.numbers import with_decimals

if TYPE_CHECKING:
    from levilab.animation.poses import Poses


#: The space between a number and its unit, or within a unit.
_BEFORE_A_UNIT = re.compile(r"(?<=\d) (?=(?:A m²|[mckµ]?m|s|Hz|m?T|k?g|rad|turns|MB)(?:\W|$))|(?<=\d[ \u00a0]A) (?=m²)")


def speed_text(speed: float) -> str:
    """Return a film's speed, as a part of the real one.

    >>> [speed_text(x) for x in (0.05, 1.0, 0.3, 2.0)]
    ['1/20 of real speed', 'real speed', '0.3 of real speed', '2 times real speed']
    """
    if speed == 1:
        return "real speed"
    if speed > 1:
        return f"{speed:g} times real speed"
    whole = round(1 / speed)
    return f"1/{whole} of real speed" if math.isclose(whole * speed, 1, rel_tol=1e-6) else f"{speed:g} of real speed"


def short_speed(speed: float) -> str:
    """Return a film's speed for a list of speeds.

    >>> [short_speed(x) for x in (0.05, 1.0, 0.3)]
    ['1/20', '1', '0.3']
    """
    return speed_text(speed).removesuffix(" of real speed") if speed < 1 else f"{speed:g}"


def span_text(poses: Poses) -> str:
    """Return the seconds of the motion that are shown."""
    last = ", where it is lost" if poses.fell else ""
    return f"from {poses.times[0]:.4g} s to {poses.times[-1]:.4g} s{last}"


def readout(poses: Poses, k: int) -> list[tuple[str, str]]:
    """Return names and values of the numbers on display at the k-th pose."""
    rows = [
        ("time", f"{poses.times[k]:.3f} s"),
        ("height", f"{with_decimals(100 * poses.positions[k, 2], 2)} cm"),
        ("tilt", f"{math.degrees(poses.tilts[k]):.1f}°"),
        ("spin", f"{with_decimals(poses.spins[k], 2)} Hz"),
    ]
    if poses.scene.washers.inertia_kg_m2 > 0:
        rows.append(("slip", f"{with_decimals(poses.slips[k] / (2 * math.pi), 2)} turns"))
    if poses.scene.drive.waveform != "off":
        rows.append(("drive", f"{with_decimals(1000 * poses.scene.drive.amplitude_t * poses.drive[k], 2)} mT"))
    return rows


def bind_units(text: str) -> str:
    r"""Put no-break spaces between numbers and their units, and within compound units.

    >>> bind_units("from 0.5 s to 2 cm radius, 0.71 A m², 1/20 of real speed, 3 parts")
    'from 0.5\xa0s to 2\xa0cm radius, 0.71\xa0A\xa0m², 1/20 of real speed, 3 parts'
    """
    return _BEFORE_A_UNIT.sub("\u00a0", text)
