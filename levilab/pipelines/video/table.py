"""A video → its tables: the track, the readings of the spin, the summary."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.uncertainty import Estimate
from levilab.errors import unquote
from levilab.files import replace_atomically, writing
from levilab.pipelines.document import values_of
from levilab.pipelines.video.still import draw_still
from levilab.present.numbers import with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from levilab.pipelines.video.analysis import Video


#: Titles of the track; the spin stands in the last column, where it is known.
_HEADS = ("time_s", "x_m", "x_u_m", "y_m", "y_u_m", "spin_frequency_hz")


def save_video(video: Video, folder: Path) -> list[Path]:
    """Write the track, the spin and a still into a folder, and return the files.  Raises CannotWrite."""
    name = video.film.path.stem
    columns = [video.times, video.x, video.u, video.y, video.u]
    columns += [np.abs(video.turning.smooth)] if video.turning else []
    contents: dict[str, str | bytes] = {f"{name}.tracks.csv": _csv(
        _HEADS[: len(columns)], zip(*columns, strict=True)
    )}  # fmt: skip
    if (found := video.turning) is not None:
        rows = zip(found.time, np.abs(found.spin), found.u, strict=True)
        contents[f"{name}.spin.csv"] = _csv(("time_s", "spin_frequency_hz", "spin_frequency_u_hz"), rows)
    contents[f"{name}.tracks.png"] = draw_still(video)
    with writing(f"the tables of {name}"):
        folder.mkdir(parents=True, exist_ok=True)
        for file, content in contents.items():
            replace_atomically(folder / file, content)
    return [folder / file for file in contents]


def _csv(heads: tuple[str, ...], rows: Iterable[Any]) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(heads)
    table.writerows([f"{value:.9g}" for value in row] for row in rows)
    return text.getvalue()


def summary(video: Video) -> list[tuple[str, str]]:
    """Return film, scale, place and spin, as pairs of name and value for people."""
    seen, film, turning = video.followed, video.film, video.turning
    span = float(video.times[-1] - video.times[0])
    steps = np.diff(seen.times) * 1e3
    even = (
        f"{np.median(steps):.2f} ms apart"
        if np.ptp(steps) < 0.2
        else f"{steps.min():.2f} to {steps.max():.2f} ms apart"
    )
    rows = [
        ("film", f"{film.width} × {film.height}, {film.codec}; {seen.times.size} pictures in {span:.2f} s, {even}"),
        ("scale", f"{with_uncertainty(_in_mm(video.scale))} a pixel"),
        ("place", f"x within {_span(video.x)}, y within {_span(video.y)}; u of one {1e3 * np.median(video.u):.3f} mm"),
    ]
    if turning is not None and video.spin is not None:
        sense = "clockwise" if turning.frequency > 0 else "counter-clockwise"
        rows.append(("spin", f"{with_uncertainty(video.spin)} in the middle of the film, {sense} seen from above"))
    return rows


def _in_mm(estimate: Estimate) -> Estimate:
    value, u = (None if one is None else 1e3 * one for one in (estimate.value, estimate.u))
    return replace(estimate, value=value, u=u, unit="mm")


def _span(place: Any) -> str:
    return f"{1e3 * np.ptp(place):.2f} mm"


def document(video: Video, files: list[Path]) -> dict[str, Any]:
    """Return scale, spin, its choices and the files, for programs."""
    found, spin = video.turning, video.spin
    values = {"scale": video.scale}
    if found is not None and spin is not None:
        sign = 1 if found.frequency > 0 else -1
        values["frequency"] = spin
        values["chirp"] = Estimate(sign * found.chirp, found.u_chirp, "Hz/s")
        values["reference_time"] = Estimate(found.middle, None, "s")
    return {
        "analysis": "video",
        "film": video.film.path.as_posix(),
        "pictures": int(video.times.size),
        "values": values_of(values),
        "choices_hz": [abs(f) for f in video.choices],
        "files": [path.as_posix() for path in files],
        "warnings": [unquote(note) for note in video.notes],
    }
