"""Poses → one HTML file that plays them: interactive, self-contained, at most 1.5 MB.

three.js comes out of the installed nicegui (extra ``live``), compressed, since a browser unpacks it: 0.27 instead of
1.1 MB.  The scripts and styles are allowed by their hashes, and nothing else is: a page that a scene's name or
description tries to break stays text.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import io
import json
import math
import re
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.numbers import digits
from levilab.animation.film import Film, millimetres, nice_length, still, table_of_colours
from levilab.animation.parts import COLOURS, parts_of
from levilab.animation.poses import Poses, height_for_camera
from levilab.animation.three import MissingThree, three_js
from levilab.animation.words import bind_units, short_speed, span_text, speed_text
from levilab.errors import UsageError
from levilab.present.numbers import plain, with_decimals
from levilab.software import software_versions

if TYPE_CHECKING:
    from pathlib import Path

    from PIL.Image import Image

    from levilab.motion.summary import Summary

#: The largest page [bytes].
LARGEST = 1_500_000
#: What a page holds beside its poses, at most [bytes].
_REST = 470_000
#: Bytes that a pose takes in the page: float32 as base64.
_BYTES_PER_NUMBER = 4 * 4 / 3
#: Speeds to choose from.
_SPEEDS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
#: Poses a turn with which a slerp between two is as good as the motion, and the fewest.
POSES_A_TURN, FEWEST_A_TURN = 16, 12
#: Length of the axis' path that is drawn [s of the motion].
_TRAIL_S = 0.5


def most_poses(columns: int) -> int:
    """Return the number of poses, each of `columns` numbers, that a page holds."""
    return int((LARGEST - _REST) / (columns * _BYTES_PER_NUMBER))


def columns_of(poses_or_scene: Any) -> list[str]:
    """Return the names of the numbers of a pose: of a scene without washers or drive these are left out."""
    scene = getattr(poses_or_scene, "scene", poses_or_scene)
    slips = ["slip"] if scene.washers.inertia_kg_m2 > 0 else []
    drive = ["drive"] if parts_of(scene)["drive"] else []
    return ["x", "y", "z", "qx", "qy", "qz", "qw", "spin", *slips, *drive]


def three_for_page() -> Path:
    """Return the module that a page holds.  Raises MissingThree."""
    return three_js("an animation as .html", ", or name a file that ends in .gif")


def as_page(poses: Poses, summary: Summary, speed: float) -> bytes:
    """Make the page.

    Args:
        poses: to be played.
        summary: of the motion that they are a span of.
        speed: at which it plays at first, as a part of the real one.

    Raises:
        MissingThree: three.js is not there.
        UsageError: the page would be larger than LARGEST.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    three = three_for_page().read_bytes()
    files = {name: _text(name) for name in ("page.css", "player.js", "top.js")}
    folder = str(resources.files("levilab.animation"))
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["bind_units"] = bind_units
    title = poses.scene.name or "A scene without a name"
    alt = _alt(poses)
    middle = len(poses.times) // 2
    stills = {
        theme: still(Film(poses, None, 20.0, (800, 550), trail_s=_TRAIL_S, theme=theme), middle)
        for theme in ("light", "dark")
    }
    readings = _readings(poses)
    text = environment.get_template("page.html.j2").render(
        title=title,
        lead=f"A Levitron as computed by levilab, {span_text(poses)}, at first at {speed_text(speed)}.",
        alt=alt,
        still_light=_data_address(stills["light"], "light"),
        still_dark=_data_address(stills["dark"], "dark"),
        readings=readings,
        speeds=[(short_speed(speed), speed) for speed in sorted({*_SPEEDS, speed}, reverse=True)],
        speed=speed,
        legend=_legend(poses),
        numbers=_numbers(poses, summary),
        version=software_versions().get("levilab", ""),
        licence=_licence(three),
        style=files["page.css"] + _swatches(poses),
        style_hash=_hash(files["page.css"] + _swatches(poses)),
        script=files["player.js"],
        script_hash=_hash(files["player.js"]),
        data=_json(_data(poses, alt, readings)),
        poses=_numbers_as_text(poses),
        three=base64.b64encode(gzip.compress(three, 9, mtime=0)).decode("ascii"),
        top=files["top.js"],
    )
    content = text.encode("utf-8")
    if len(content) > LARGEST:
        raise UsageError(
            "animate",
            f"the page would have {len(content) / 1e6:.2f} MB, at most {LARGEST / 1e6:g} are written: choose a shorter "
            "span with `animate_from` and `animate_to`",
        )
    return content


def _text(name: str) -> str:
    return resources.files("levilab.animation").joinpath(name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii")


def _json(document: Any) -> str:
    """Return JSON in which no text can end a script of the page."""
    return json.dumps(document, sort_keys=True, separators=(",", ":")).replace("<", "\\u003c")


def _numbers_as_text(poses: Poses) -> str:
    table = {
        "x": poses.positions[:, 0], "y": poses.positions[:, 1], "z": poses.positions[:, 2],
        "qx": poses.quaternions[:, 0], "qy": poses.quaternions[:, 1], "qz": poses.quaternions[:, 2],
        "qw": poses.quaternions[:, 3], "spin": poses.spins, "slip": poses.slips, "drive": poses.drive,
    }  # fmt: skip
    numbers = np.stack([table[name] for name in columns_of(poses)], axis=1).astype("<f4")
    return base64.b64encode(numbers.tobytes()).decode("ascii")


def _data(poses: Poses, alt: str, readings: list[tuple[str, str, int]]) -> dict[str, Any]:
    span = max(float(np.ptp(poses.positions[:, :2], axis=0).max()), 1e-6)
    bar = nice_length(0.45 * span)
    return {
        "alt": alt,
        "bar": {"length": bar, "text": bind_units(millimetres(bar))},
        "columns": columns_of(poses),
        "count": len(poses.times),
        "drive_mt": 1000 * poses.scene.drive.amplitude_t,
        "parts": parts_of(poses.scene, height_for_camera(poses)),
        "readings": [(name, digits) for name, _, digits in readings],
        "start": float(poses.times[0]),
        "step": float(poses.times[1] - poses.times[0]),
        "trail_s": _TRAIL_S,
    }


def _readings(poses: Poses) -> list[tuple[str, str, int]]:
    found = [("time", "\u00a0s", 3), ("height", "\u00a0cm", 2), ("tilt", "°", 1), ("spin", "\u00a0Hz", 2)]
    columns = columns_of(poses)
    if "slip" in columns:
        found.append(("slip", "\u00a0turns", 2))
    if "drive" in columns:
        found.append(("drive", "\u00a0mT", 2))
    return found


def _alt(poses: Poses) -> str:
    height, tilt = 100 * poses.positions[:, 2].mean(), math.degrees(poses.tilts.max())
    return (
        f"A spinning top with a magnet, a disc and a stem, on average {height:.1f} cm above a ring magnet, "
        f"{span_text(poses)}; its axis leans by up to {tilt:.1f} degrees"
    )


def _legend(poses: Poses) -> list[tuple[str, str]]:
    """Return colours, by their names in `parts.COLOURS`, and their meanings."""
    found = [
        ("magnet", "the top's magnet"),
        ("disc", "its disc, with a mark"),
        ("washers", "washers, " + ("loose: they turn at their own rate" if poses.slips.any() else "held by an O-ring")),
        ("stem", "the stem"),
        ("tape", "white tape, once a turn before the lamp"),
        ("path", f"path of the axis' end over the last {_TRAIL_S:g} s"),
        ("axis", "the axis of the top"),
        ("spin", "sense of the spin"),
        ("base", "the base, a ring magnet"),
        ("faint", "straight down to the top's shadow"),
    ]
    return (
        [*found, ("drive", "the drive's field, as an arrow over the base")] if "drive" in columns_of(poses) else found
    )


def _swatches(poses: Poses) -> str:
    names = [name for name, _ in _legend(poses)]
    rules = {
        theme: "".join(f".colour-{name} span{{background:{COLOURS[theme][name]}}}" for name in names)
        for theme in COLOURS
    }
    return f"{rules['light']}\n@media (prefers-color-scheme: dark){{{rules['dark']}}}\n"


def _numbers(poses: Poses, summary: Summary) -> list[tuple[str, str]]:
    scene, motion = poses.scene, summary.motion
    accuracy = motion.accuracy
    tilts, heights = np.degrees(poses.tilts), 100 * poses.positions[:, 2]
    found = [
        ("scene", scene.description or "no description"),
        ("shown", f"{span_text(poses)}, of {float(motion.time[-1]):.4g} s that were simulated"),
        ("end", summary.ending),
        ("height", f"{heights.min():.2f} to {heights.max():.2f} cm above the base's centre"),
        ("tilt", f"{tilts.min():.1f} to {tilts.max():.1f}° of the axis against the base's"),
        ("spin", f"{with_decimals(poses.spins.min(), 2)} to {with_decimals(poses.spins.max(), 2)} Hz"),
        ("mass", f"{1000 * scene.top.mass_kg:.4g} g"),
        ("moment", f"{digits(scene.top.moment_a_m2, 4)} A m²"),
        ("base", f"{100 * scene.base.inner_radius_m:.3g} to {100 * scene.base.outer_radius_m:.3g} cm radius"),
    ]
    if "drive" in columns_of(poses):
        drive = scene.drive
        found.append(("drive", f"{drive.waveform}, {1000 * drive.amplitude_t:.3g} mT, {drive.frequency_hz:.6g} Hz"))
    error = max(accuracy.position, accuracy.axis)
    return [
        *found,
        ("error", f"estimated at most {plain(error, 1)} (place in m, axis in rad) at the end of the simulation"),
        ("poses", f"{len(poses.times)}, {1 / (poses.times[1] - poses.times[0]):.0f} a second"),
        ("sizes", "magnet and base as in the scene; the other parts in the proportions of such a top"),
    ]


def _licence(three: bytes) -> str:
    head = re.match(rb"/\*\*?(.*?)\*/", three, re.DOTALL)
    if head is None:
        raise MissingThree("three.js out of nicegui has no licence at its head: install nicegui 3.18 or a later one")
    lines = [line.strip(" *") for line in head[1].decode("utf-8", "replace").splitlines()]
    return ". ".join(line for line in lines if line and not line.startswith("@")) + "."


def _data_address(picture: Image, theme: str) -> str:
    buffer = io.BytesIO()
    picture.quantize(palette=table_of_colours([picture], theme)).save(buffer, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
