"""A scene → what its animations show: the top's parts, marks and the base, as numbers and words that JSON can hold.

The same description is drawn by `top.js` (in the page of an animation, and in the live view) and by `paint` (pictures
without a browser).  A scene gives the magnet's radius R and height H, and the base's radii and thickness.  It has no
further lengths of the top, so the rest are those of the thesis's kind of top, in proportion to R; the centre of mass is
taken to lie in the middle of the magnet.  Nothing here enters the simulation.

Every part is a solid of revolution about the top's axis, convex, and no part reaches into the next: drawn one after
another along the axis they hide each other as real parts do.
"""

import math
from typing import Any

from levilab.simulator.scene import Scene

#: Colours by day and by night.  Path, axis and spin have those that the figures use (Okabe and Ito).
COLOURS: dict[str, dict[str, str]] = {
    "light": {
        "background": "#f4f6f8", "ground": "#e3e7ec", "shadow": "#3c4654", "text": "#1b2430", "faint": "#657081",
        "base": "#4b515b", "magnet": "#3a3f48", "disc": "#4d86b0", "washers": "#cfa955", "ring": "#23262b",
        "stem": "#ece8df", "tip": "#d9d4c8", "tape": "#ffffff", "mark": "#d55e00",
        "path": "#0072b2", "axis": "#3b4552", "spin": "#009e73", "drive": "#a0447f",
    },
    "dark": {
        "background": "#12161c", "ground": "#1d232c", "shadow": "#000000", "text": "#e8ecf1", "faint": "#97a2b1",
        "base": "#5a616d", "magnet": "#4a505b", "disc": "#5b97c4", "washers": "#d6b15e", "ring": "#2c3037",
        "stem": "#f0ece3", "tip": "#d9d4c8", "tape": "#ffffff", "mark": "#e8742a",
        "path": "#56b4e9", "axis": "#c7d0dc", "spin": "#22c296", "drive": "#e08cc0",
    },
}  # fmt: skip

#: A base without a thickness is drawn with this one, as a part of its outer radius.
_USUAL_THICKNESS = 0.2
#: The axis is drawn so far beyond the centre of mass, in radii of the magnet: up, and down.
_AXIS_UP, _AXIS_DOWN = 3.2, 0.9
#: Where a top floats unless more is known, in outer radii of the base.
_FLOATS = 1.33
#: Widths of the tape and of the mark on the disc [rad].
_TAPE_RAD, _MARK_RAD = 0.42, 0.20

Outline = list[list[float]]


def parts_of(scene: Scene, height: float | None = None) -> dict[str, Any]:
    """Describe the top and the base of a scene.

    Args:
        scene: with the magnet's and the base's sizes; whether washers are loose, and whether a drive is on.
        height: of the top, for the camera [m]; None: about where the scene's top starts.

    Returns:
        A table for JSON, lengths in [m], angles in [rad], in the top's frame (z along its axis, x along the transverse
        part of the moment, origin in the centre of mass) or the base's:

        - "parts": from the lowest to the highest, each with "name", "label", "colour" (a key of "colours"), "turns"
          ("top" or "washers") and "outline", points (radius, height) from the axis to the axis;
        - "marks": on a part's surface, each with "name", "label", "part", "colour", "turns", "outline", "azimuth" of
          its middle, and "width";
        - "base": "inner" and "outer" radius, "bottom" and "top" height, "edge", by which its edges are broken;
        - "axis": how far its line reaches "up" and "down"; "spin": "radius" and "height" of its arrow;
        - "drive": the unit vector along which the field swings, None without a drive;
        - "view": "reach" across and "top", to place a camera; "floats": where the top is at first;
        - "colours": for "light" and "dark".
    """
    radius, half = scene.top.magnet_radius_m, scene.top.magnet_height_m / 2
    loose = scene.washers.inertia_kg_m2 > 0
    parts = _parts(radius, half)
    base, height = _base(scene), _usual_height(scene) if height is None else height
    return {
        "parts": parts,
        "marks": _marks(radius, half, loose=loose),
        "base": base,
        "axis": {"up": _AXIS_UP * radius, "down": _AXIS_DOWN * radius + half},
        "spin": {"radius": 0.52 * radius, "height": half + 1.02 * radius},
        "drive": _direction(scene),
        "view": {
            "reach": max(base["outer"], 2 * radius),
            "top": height + _AXIS_UP * radius,
            "floats": [0.0, 0.0, height],
        },
        "colours": COLOURS,
    }


def _parts(radius: float, half: float) -> list[dict[str, Any]]:
    """Return the parts from tip to stem; lengths in radii of the magnet, heights from its upper face."""
    washers = [
        _part(
            f"washer {k + 1}", "washers" if k == 2 else "", "washers", _cylinder_outline(0.52, low, low + 0.075, 0.012)
        )
        for k, low in enumerate((0.300, 0.376, 0.452))
    ]
    for washer in washers:
        washer["turns"] = "washers"
    upper = [
        _part("disc", "disc", "disc", _cylinder_outline(0.87, 0.0, 0.30, 0.05)),
        *washers,
        _part("O-ring", "O-ring", "ring", _cylinder_outline(0.25, 0.528, 0.628, 0.045)),
        _part("stem", "stem", "stem", [[0.0, 0.629], [0.17, 0.629], [0.15, 1.36], [0.11, 1.42], [0.0, 1.44]]),
    ]
    for part in upper:
        part["outline"] = [[radius * r, half + radius * z] for r, z in part["outline"]]
    tip = [[0.0, -0.34], [0.05, -0.31], [0.15, -0.10], [0.15, 0.0], [0.0, 0.0]]
    lower = [
        _part("tip", "", "tip", [[radius * r, radius * z - half] for r, z in tip]),
        _part("magnet", "magnet", "magnet", _cylinder_outline(radius, -half, half, min(0.03 * radius, half / 2))),
    ]
    return lower + upper


def _part(name: str, label: str, colour: str, outline: Outline) -> dict[str, Any]:
    return {"name": name, "label": label, "colour": colour, "turns": "top", "outline": outline}


def _cylinder_outline(radius: float, low: float, high: float, edge: float) -> Outline:
    """Return the outline of a cylinder whose edges are broken."""
    rim = [[radius - edge, low], [radius, low + edge], [radius, high - edge], [radius - edge, high]]
    return [[0.0, low], *rim, [0.0, high]]


def _marks(radius: float, half: float, *, loose: bool) -> list[dict[str, Any]]:
    """Return white tape on the rim, or on washers that slip, as on the virtual bench; and a mark on the disc.

    The tape is where the transverse part of the moment points.  The mark is opposite, and with loose washers below the
    tape: both part as the washers slip.
    """
    upper = 0.03 * radius  # by so much the tape goes over an edge
    if loose:
        low, high, rim = half + 0.300 * radius, half + 0.527 * radius, 0.52 * radius
        tape = {"part": "washer 3", "turns": "washers", "outline": [[rim, low], [rim, high], [rim - 8 * upper, high]]}
    else:
        tape = {"part": "magnet", "turns": "top", "outline": [[radius, -half], [radius, half], [0.88 * radius, half]]}
    face, side = half + 0.30 * radius, 0.87 * radius
    mark = {"part": "disc", "turns": "top", "outline": [[side, half + upper], [side, face], [0.55 * radius, face]]}
    return [
        {"name": "tape", "label": "tape", "colour": "tape", "azimuth": 0.0, "width": _TAPE_RAD} | tape,
        {"name": "mark", "label": "mark on the disc", "colour": "mark", "azimuth": 0.0 if loose else math.pi,
         "width": _MARK_RAD} | mark,
    ]  # fmt: skip


def _base(scene: Scene) -> dict[str, float]:
    base = scene.base
    thickness = base.thickness_m or _USUAL_THICKNESS * base.outer_radius_m
    return {
        "inner": base.inner_radius_m,
        "outer": base.outer_radius_m,
        "bottom": base.origin_m - thickness / 2,
        "top": base.origin_m + thickness / 2,
        "edge": min(0.1 * thickness, 0.1 * (base.outer_radius_m - base.inner_radius_m)),
    }


def _direction(scene: Scene) -> list[float] | None:
    if scene.drive.waveform == "off" or scene.drive.amplitude_t == 0:
        return None
    length = math.hypot(*scene.drive.direction)
    return [part / length for part in scene.drive.direction]


def _usual_height(scene: Scene) -> float:
    """Return a height near the top's start [m]; where it floats depends on the base and need not be computed."""
    return scene.start.position_m[2] if scene.start.place == "given" else _FLOATS * scene.base.outer_radius_m
