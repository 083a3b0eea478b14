"""A top in full motion that phones film from above and from beside: its spin and its place."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from analysis.arrays import Array
from analysis.uncertainty import Estimate
from levilab.animation.camera import BESIDE, RIM, THICK, Camera, Flight, film, flight_of, phone_times
from levilab.crosscheck.priors import drawing
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.crosscheck.subjects.sway import draw_scene
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.video.analysis import Video
from levilab.pipelines.video.leaning import PRECESSION_HZ
from levilab.simulator.laws import LAWS

#: Height of the dot on the stem above the rim, and of the rim above the base [m].
STEM_M, RIM_M = 0.02, 0.07
#: Half of the second of which a reading of the spin is the mean, and how long the top floats before and after [s].
_HALF_S, _AROUND_S = 0.5, 1.0


def draw_camera(by: np.random.Generator) -> Camera:
    """Draw a camera: how near and sharp, how long it exposes, how it reads its rows."""
    draw = drawing("video", by)
    return Camera(
        width=192,
        height=192,
        scale=draw("scale"),
        exposure=draw("exposure"),
        line_time=draw("line_time"),
        blur=draw("blur"),
        noise=draw("noise"),
        away=(draw("away"), draw("away")),
        stem=STEM_M,
        distance=draw("distance"),
    )


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one film of a drawn top; of its pictures one, since neighbours share their errors."""
    by = np.random.default_rng((seed, 25))
    draw = drawing("video", by)
    scene = draw_scene(seed).changed({"start.spin_hz": draw("start.spin_hz"), **_drag(draw("share of newton"))})
    camera = draw_camera(by)
    seconds = draw("length")
    flight = flight_of(scene, seconds + 2 * _AROUND_S)
    flight = replace(flight, times=flight.times - _AROUND_S)  # the filter that finds the true precession bends its ends
    path = film(folder / "top.mp4", camera, flight, phone_times(seconds), seed=seed)
    analysis = ANALYSES["video"]
    known = {"line_time_s": camera.line_time} if by.random() < 0.5 else {}
    late = 0.0 if known else camera.line_time * camera.middle[1]  # of the rows of the top, after the first row
    seen = {"rim_m": 2 * RIM, "stem_m": STEM_M, "camera_m": camera.distance + RIM_M, "height_m": RIM_M}
    (found,) = analysis.analyze([path], analysis.options_from(seen | known)).runs
    if found.turning is None or found.scale.value is None:
        raise TrialFailed("no spin is found")
    turns = np.abs(flight.yaw) / (2 * np.pi)
    one, picture = (int(by.integers(of.time.size)) for of in (found.turning, found))
    time, second, u = (float(of[one]) for of in (found.turning.time, abs(found.turning.spin), found.turning.u))
    return [
        pull_of("spin", found.spin, _slope(flight.times, turns, found.turning.middle + late, seconds / 2)),
        pull_of("spin of a second", Estimate(second, u, "Hz"), _slope(flight.times, turns, time + late, _HALF_S)),
        *_places(found, picture, flight.at(found.time[picture : picture + 1] + late), camera),
        *_precession(found, flight, late),
        *_beside(flight, seconds, by, seed, folder),
    ]


def _drag(share: float) -> dict[str, object]:
    """Return the keys of a scene for a drag in proportion to the spin to the power of 1 + share, near 30 Hz."""
    (slow,), (fast,) = (LAWS[name].usual for name in ("stokes", "newton"))
    return {"drag.law": "mixed", "drag.coefficient": [(1 - share) * slow, share * fast]}


def _beside(flight: Flight, seconds: float, by: np.random.Generator, seed: int, folder: Path) -> Iterator[Pull]:
    """Yield the pulls of spin, place and height in a film of the same top from beside."""
    camera = draw_camera(by)
    low = (camera.away[0], camera.away[1] - 45)  # the top above the middle of the picture, so that the base is seen
    camera = replace(camera, pose=BESIDE, stem=0.0, height=224, away=low)
    path = film(folder / "side.mp4", camera, flight, phone_times(seconds), seed=seed)
    analysis = ANALYSES["video"]
    seen = {"rim_m": 2 * RIM, "beside": True, "line_time_s": camera.line_time}
    (found,) = analysis.analyze([path], analysis.options_from(seen)).runs
    if found.turning is None or found.scale.value is None:
        raise TrialFailed("no spin is found from beside")
    turns = np.abs(flight.yaw) / (2 * np.pi)
    yield pull_of("spin from beside", found.spin, _slope(flight.times, turns, found.turning.middle, seconds / 2))
    picture = int(by.integers(found.time.size))
    centre, body = flight.pose_at(found.time)
    middle = centre - THICK / 2 * body[:, :, 2]  # of the side
    factor = camera.scale / found.scale.value
    for name, place, of, true in (("place from beside", found.x, 0, 0), ("height from beside", found.y, 1, 2)):
        off = middle[:, true] - middle[:, true].mean()
        u = factor * float(found.u[picture, of])
        yield pull_of(name, Estimate(factor * float(place[picture]), u, "m"), float(off[picture]))


def _precession(found: Video, flight: Flight, late: float) -> Iterator[Pull]:
    """Yield the pull of the first reading of the precession, its mean over a second, where it stands out."""
    if (lean := found.leaning) is None or not lean.time.size:
        return
    middle = float(lean.time[0]) + late
    axis = flight.lean[:, 0] + 1j * flight.lean[:, 1]
    frequency = np.fft.fftfreq(axis.size, flight.times[1] - flight.times[0])
    kept = (frequency > PRECESSION_HZ[0]) & (frequency < PRECESSION_HZ[1])
    turning = np.fft.ifft(np.fft.fft((axis - axis.mean()) * np.hanning(axis.size)) * kept)
    turns = np.unwrap(np.angle(turning)) / (2 * np.pi)
    whole = float(np.ptp(found.time))
    near = np.abs(flight.times - middle) <= whole / max(round(whole), 1) / 2
    true = np.polyfit(flight.times[near] - middle, turns[near], 1)[0]
    yield pull_of("precession", Estimate(float(lean.precession[0]), float(lean.u[0]), "Hz"), float(true))


def _slope(times: Array, turns: Array, middle: float, half: float) -> float:
    """Return the spin in the middle of some seconds [Hz]; drag bends its slope, by 0.1 mHz in 3 s."""
    near = np.abs(times - middle) <= half
    return float(np.polyfit(times[near] - middle, turns[near], 4)[3])


def _places(found: Video, picture: int, true: Sequence[Array], camera: Camera) -> Iterator[Pull]:
    """Yield the pulls of both coordinates in a picture, in metres by the true scale."""
    factor = camera.scale / (found.scale.value or 1.0)
    (left, up), (x0, y0) = found.origin, camera.middle
    for middle, seen, at in zip((left - x0, y0 - up), (found.x, found.y), true, strict=False):
        place = Estimate(
            middle * camera.scale + factor * float(seen[picture]), factor * float(found.u[picture].mean()), "m"
        )
        yield pull_of("place", place, float(at[0]))


SUBJECT = Subject("video", "films of a top in full motion from above and from beside: spin and place", trial, trials=24)
