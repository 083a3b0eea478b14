"""The oscilloscope's records of a run as waveforms, one at a time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from levilab.formats.waveforms.waveform import Signal, Waveform
from levilab.runs.traces import INDEX, StoredTrace, is_arriving, load_traces

if TYPE_CHECKING:
    from collections.abc import Iterator

    from analysis.arrays import Array
    from levilab.runs.run import Run


#: Interval at which the drivers ask an oscilloscope whether its record is complete [s].
SEEN_LATE_S = 0.02


def has_traces(run: Run) -> bool:
    """Return whether a run keeps records of an oscilloscope, or what had come of one when it was killed."""
    return (run.folder / INDEX).is_file() or is_arriving(run.folder)


def run_waveforms(run: Run) -> list[Waveform]:
    """Return each record of a run, in the order in which they were kept.

    A record ended when the oscilloscope said that it was complete, or up to SEEN_LATE_S before, and began so much
    earlier as it lasts.  Raises DataError for one that is damaged.
    """
    return [_waveform(run, stored) for stored in load_traces(run.folder)]


def _waveform(run: Run, stored: StoredTrace) -> Waveform:
    trace = stored.trace

    def read(_: int) -> Iterator[Array]:
        yield np.asarray(trace.volts, dtype=np.float64)

    return Waveform(
        path=run.folder / INDEX,
        format=f"record {stored.number}",
        start=stored.start_s,
        step=trace.dt_s,
        count=len(trace.codes),
        signals=(Signal(stored.channel),),
        read=read,
        warnings=(f"{run.folder.name}: record {stored.number} {stored.how_short}",) if stored.announced else (),
        start_u=SEEN_LATE_S / math.sqrt(3),  # the root mean square of what lies evenly between 0 and that
    )
