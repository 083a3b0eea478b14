"""Make sample_data/video/: synthetic films of a top from above and from beside, as a phone's slow motion has them.

The virtual cameras film a top of 25.30 g that is simulated in full motion: pixels of 0.5 mm, at times 3.3 and 5 ms
apart, with an exposure of 1 ms, a rolling shutter of 10 µs a row, and noise.  Their bytes depend on the processor and
the version of FFmpeg.  Run it from anywhere: ``python sample_data/film.py``.
"""

from pathlib import Path

from make import TRACK_SCENE

from levilab.animation.camera import BESIDE, Camera, film, flight_of, phone_times
from levilab.simulator.scene import preset

HERE = Path(__file__).parent
SECONDS, SECONDS_BESIDE = 10.0, 4.0
CAMERA = Camera(width=208, height=208, line_time=10e-6, away=(2.3, -1.7))
SIDE = Camera(width=160, height=208, line_time=10e-6, pose=BESIDE, away=(2.3, -46.0), distance=0.4)

if __name__ == "__main__":
    (HERE / "video").mkdir(exist_ok=True)
    (HERE / "video" / ".levilab-skip").touch()
    flight = flight_of(preset("undriven").changed({**TRACK_SCENE, "start.spin_hz": 32.0}), SECONDS)
    film(HERE / "video" / "top.mp4", CAMERA, flight, phone_times(SECONDS))
    film(HERE / "video" / "side.mp4", SIDE, flight, phone_times(SECONDS_BESIDE))
