"""Make sample_data/video/top.mp4: a synthetic film of a top from above, as a phone's slow motion has it.

The virtual camera films a top of 25.30 g that is simulated in full motion: 208 × 208 pixels of 0.5 mm, at times 3.3 and
5 ms apart, with an exposure of 1 ms, a rolling shutter of 10 µs a row, and noise.  Its bytes depend on the processor
and the version of FFmpeg.  Run it from anywhere: ``python sample_data/film.py``.
"""

from pathlib import Path

from make import TRACK_SCENE

from levilab.animation.camera import Camera, film, flight_of, phone_times
from levilab.simulator.scene import preset

HERE = Path(__file__).parent
SECONDS = 10.0
CAMERA = Camera(width=208, height=208, line_time=10e-6, away=(2.3, -1.7))

if __name__ == "__main__":
    (HERE / "video").mkdir(exist_ok=True)
    (HERE / "video" / ".levilab-skip").touch()
    flight = flight_of(preset("undriven").changed({**TRACK_SCENE, "start.spin_hz": 32.0}), SECONDS)
    film(HERE / "video" / "top.mp4", CAMERA, flight, phone_times(SECONDS))
