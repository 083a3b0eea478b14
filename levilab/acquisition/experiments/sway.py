"""The sway: films of a free top from above and from the side, and its spin beside them, while it spins down.

Films of a real top are files, which `levilab analyze video` follows; the virtual bench has a camera.
"""

import math
from typing import Self

import numpy as np
from pydantic import Field, PositiveFloat

from levilab.acquisition.counting import free_top, prepare_counter
from levilab.acquisition.experiment import CounterSettings, Experiment, ModelOf
from levilab.acquisition.experiments.spin import time_left
from levilab.acquisition.session import Session
from levilab.bench.config import BenchConfig, ConfigError
from levilab.bench.person import FloatTop
from levilab.formats.table import read_run_readings
from levilab.runs.channel import Channel
from levilab.runs.events import RunEvent
from levilab.runs.run import STATES

#: Columns of the track.
_TRACK = ("time_s", "x_m", "y_m", "height_m")
NO_CAMERA = (
    "a bench has no camera: film the top from above, follow it with `levilab analyze video FILE`, and give "
    "NAME.tracks.csv to `levilab analyze sway`; `levilab acquire sway --mock` has a virtual camera"
)


class SwaySettings(CounterSettings):
    """Film a top that was pushed, and count its spin, until it falls."""

    interval_s: PositiveFloat = Field(default=2.0, description="time from one reading to the next")
    frames_hz: float = Field(default=120.0, ge=30.0, le=1000.0, description="frames per second of the film")
    longest_s: PositiveFloat = Field(default=300.0, description="how long is filmed if the top stays up")

    def for_bench(self, config: BenchConfig, model_of: ModelOf) -> Self:
        """See the base.  Raises ConfigError for a real bench."""
        if config.visa_library != "@levilab":
            raise ConfigError(NO_CAMERA)
        return super().for_bench(config, model_of)


def channels(_: SwaySettings) -> tuple[Channel, ...]:
    """Return the columns of the spin; the track stands in states.csv."""
    return (
        Channel("time_s", "s", "bench clock, from the first frame"),
        Channel("spin_frequency_hz", "Hz", "frequency counter on the phototransistor, one pulse a turn"),
    )


def run(session: Session[SwaySettings]) -> None:
    """Let a person float and push the top, and read spin and film until it falls or the time is over."""
    settings = session.settings
    prepare_counter(session)
    task = FloatTop("the virtual bench spins the top, lets it float, and pushes it sideways by half a millimetre")
    session.begin(lambda: session.ask(task), resumed="the film goes on")
    top, frame = free_top(session, session.rows[-3:]), _frames_kept(session)
    for _ in session.readings_every(settings.interval_s, settings.longest_s):
        reading = top.read()
        if reading:
            rows = session.rows or [reading]
            session.keep(reading, time_left(rows[0], rows[len(rows) // 2], reading, settings.longest_s))
            frame = _film(session, frame, reading["time_s"])
        elif end := top.fall():
            session.event(RunEvent.FELL, end)
            return


def _frames_kept(session: Session[SwaySettings]) -> int:
    """Return the number of frames in the track of a resumed run; a new one gets the head of its track."""
    path = session.writer.folder / STATES
    if not path.exists():
        session.writer.film([",".join(_TRACK)])
        return 0
    times = read_run_readings(path, _TRACK).columns.get("time_s", np.empty(0))
    return round(float(times[-1]) * session.settings.frames_hz) + 1 if times.size else 0


def _film(session: Session[SwaySettings], first: int, until: float) -> int:
    """Keep the frames from a number on up to a time [s], at which the top was still up; return the next number."""
    camera, rate = session.bench.camera, session.settings.frames_hz
    if camera is None:
        raise ConfigError(NO_CAMERA)
    end = max(math.floor(until * rate) + 1, first)
    times = np.arange(first, end) / rate
    places = camera((session.zero or 0.0) + first / rate, 1 / rate, end - first)
    rows = np.column_stack([times, places])[np.isfinite(places).all(axis=1)]
    if rows.size:
        session.writer.film([",".join(f"{value:.6f}" for value in row) for row in rows.tolist()])
    return end


EXPERIMENT = Experiment(
    name="sway",
    about="films of a top that was pushed, and its spin, until it falls; on the virtual bench",
    instruments=("counter",),
    settings=SwaySettings,
    channels=channels,
    run=run,
    mock_scene="sway",
)
