"""A top in full motion that a phone films from above: its spin and its place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.uncertainty import Estimate
from levilab.animation.camera import RIM, Camera, film, flight_of, phone_times
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.crosscheck.subjects.sway import draw_scene
from levilab.pipelines.catalogue import ANALYSES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from levilab.animation.camera import Array
    from levilab.pipelines.video.analysis import Video

#: Least and greatest length of a film [s].
SECONDS = (0.8, 4.0)
#: Half of the second of which a reading of the spin is the mean [s].
_HALF_S = 0.5


def draw_camera(by: np.random.Generator) -> Camera:
    """Draw a camera: how near and sharp, how long it exposes, how it reads its rows."""
    return Camera(
        width=192,
        height=192,
        scale=float(by.uniform(4.6e-4, 5.4e-4)),
        exposure=float(by.uniform(3e-4, 1.5e-3)),
        line_time=float(by.uniform(5e-6, 25e-6)),
        blur=float(by.uniform(1.0, 3.0)),
        noise=float(by.uniform(1.0, 4.0)),
        away=tuple(by.uniform(-4, 4, 2).tolist()),
    )


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one film of a drawn top; of its pictures one, since neighbours share their errors."""
    by = np.random.default_rng((seed, 25))
    scene = draw_scene(seed).changed({"start.spin_hz": float(by.uniform(26, 42))})
    camera = draw_camera(by)
    seconds = float(by.uniform(*SECONDS))
    flight = flight_of(scene, seconds)
    path = film(folder / "top.mp4", camera, flight, phone_times(seconds), seed=seed)
    analysis = ANALYSES["video"]
    known = {"line_time_s": camera.line_time} if by.random() < 0.5 else {}
    late = 0.0 if known else camera.line_time * camera.middle[1]  # of the rows of the top, after the first row
    (found,) = analysis.analyze([path], analysis.options_from({"rim_m": 2 * RIM, **known})).runs
    if found.turning is None or found.scale.value is None:
        raise TrialFailed("no spin is found")
    turns = np.abs(flight.yaw) / (2 * np.pi)
    one, picture = (int(by.integers(of.time.size)) for of in (found.turning, found))
    of_second = found.turning.time[one], abs(found.turning.spin[one]), found.turning.u[one]
    time, second, u = (float(value) for value in of_second)
    return [
        pull_of("spin", found.spin, _slope(flight.times, turns, found.turning.middle + late, seconds / 2)),
        pull_of("spin of a second", Estimate(second, u, "Hz"), _slope(flight.times, turns, time + late, _HALF_S)),
        *_places(found, picture, flight.at(found.time[picture : picture + 1] + late), camera),
    ]


def _slope(times: Array, turns: Array, middle: float, half: float) -> float:
    """Return the spin in the middle of some seconds [Hz]; drag bends its slope, by 0.1 mHz in 3 s."""
    near = np.abs(times - middle) <= half
    return float(np.polyfit(times[near] - middle, turns[near], 4)[3])


def _places(found: Video, picture: int, true: Sequence[Array], camera: Camera) -> Iterator[Pull]:
    """Yield the pulls of both coordinates in a picture, in metres by the true scale."""
    factor = camera.scale / (found.scale.value or 1.0)
    (left, up), (x0, y0) = found.origin, camera.middle
    for middle, seen, at in zip((left - x0, y0 - up), (found.x, found.y), true, strict=False):
        place = Estimate(middle * camera.scale + factor * float(seen[picture]), factor * float(found.u[picture]), "m")
        yield pull_of("place", place, float(at[0]))


SUBJECT = Subject("video", "a film of a top in full motion from above: spin and place", trial, trials=24)
