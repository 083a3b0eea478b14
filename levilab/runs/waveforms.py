"""The oscilloscope's records of a run as waveforms, one at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from levilab.formats.waveforms.waveform import Signal, Waveform
from levilab.runs.traces import INDEX, is_arriving, load_traces

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from levilab.runs.run import Run
    from levilab.runs.traces import StoredTrace

    Array = NDArray[np.float64]


def has_traces(run: Run) -> bool:
    """Whether a run keeps records of an oscilloscope, or what had come of one when it was killed."""
    return (run.folder / INDEX).is_file() or is_arriving(run.folder)


def run_waveforms(run: Run) -> list[Waveform]:
    """Each record of a run, in the order in which they were kept.

    A record starts at the time when it was kept, on the clock of the readings, plus its own: the trigger came a little
    earlier, by the time that the record took on its way.  Raises DataError for one that is damaged.
    """
    return [_waveform(run, stored) for stored in load_traces(run.folder)]


def _waveform(run: Run, stored: StoredTrace) -> Waveform:
    trace = stored.trace

    def read(_: int) -> Iterator[Array]:
        yield np.asarray(trace.volts, dtype=np.float64)

    start = stored.time_s + trace.t0_s
    name = run.folder / INDEX
    return Waveform(
        name, f"record {stored.number}", start, trace.dt_s, len(trace.codes), (Signal(stored.channel),), read
    )
