"""A phone's magnetometer beside the top: it counts over Wi-Fi, and records until the top has fallen."""

import math
from pathlib import Path

import numpy as np

from instruments.clock import VirtualClock
from instruments.virtual.counter.phyphox import Sensor
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.crosscheck.subjects import spindown
from levilab.pipelines.catalogue import ANALYSES
from levilab.simulator.spin import DECAYS
from levilab.world.bench import VIRTUAL_MODELS
from levilab.world.spin_world import SpinScene, SpinWorld

#: How long the phone records beyond the fall [s].
_AFTER_S = 20.0
#: The chirp's truth is a difference over twice this [s].
_APART_S = 0.05
#: A second of the phone's clock, which no analysis knows, in seconds.
_SECOND = 1 / (1 + Sensor().drift)


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one top twice: as the phone counts it over Wi-Fi, and as the app exports its samples."""
    pulls = spindown.trial(seed, folder, counter="phyphox")
    return [*pulls, *_of_export(spindown.draw_scene(seed), folder / "phyphox.zip")]


def _of_export(scene: SpinScene, path: Path) -> list[Pull]:
    """Record a top until it has fallen; return frequency and chirp in the middle, and the lower limit."""
    world = SpinWorld(scene, VirtualClock())
    phone = VIRTUAL_MODELS["counter"]["phyphox"](world)
    begin = world.clock.now()
    phone.execute("GET /control?cmd=start HTTP/1.1")
    from_, to = 2 * math.pi * scene.start_hz, 2 * math.pi * scene.fall_hz
    world.clock.sleep(float(DECAYS[scene.drag].elapsed(from_, to, *scene.constants)) + _AFTER_S)
    answer = phone.execute("GET /export?format=1 HTTP/1.1")
    path.write_bytes(answer.data.partition(b"\r\n\r\n")[2] if answer else b"")
    spin, limit = (ANALYSES[name].analyze([path]).runs[0] for name in ("spin", "limit"))
    if limit.which != "lower":
        raise TrialFailed(f"the limit is taken for the {limit.which} one")
    moment = begin + _SECOND * spin.spin.reference_time
    before, here, after = _SECOND * world.motion(moment + np.array([-_APART_S, 0, _APART_S]))[0] / (2 * math.pi)
    return [
        pull_of("frequency", spin.spin.frequency, float(here)),
        pull_of("chirp", spin.spin.chirp, _SECOND * float(after - before) / (2 * _APART_S)),
        pull_of("lower limit", limit.statistics.mean, _SECOND * scene.fall_hz),
    ]


#: Counted, its clock is 0.02 per mille off, which moves the constants by less than 0.1 u.
SUBJECT = Subject(
    "phone",
    "the same, counted by a phone's magnetometer; of its record frequency, chirp and lower limit",
    trial,
    trials=24,
)
