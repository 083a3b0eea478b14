"""A run as pieces between the corners of its drive and its samples, made one after the other as they are needed.

A drive of 30 Hz has 3600 corners a minute: a list of them for each of a million tops would not fit into memory.
"""

import math
from typing import Any, NamedTuple

from levilab.simulator.kernels.compiled import aside, part

#: Columns of a job: what a lane needs to know of a run beside its model and its start.
#: duration [s] from the start on, step: the longest [s]; radius, height: of the escape [m];
#: rate, turns, offset: corners are at (m/2 + offset − turns)/rate, for all whole m; rate = 0: there are none [Hz];
#: off: when the drive ends [s], inf for never; first, second: its level in either half of a period;
#: steep: its slope [1/s], positive in the first half and negative in the second.
DURATION, STEP, RADIUS, HEIGHT, RATE, TURNS, OFFSET, OFF, FIRST, SECOND, STEEP = range(11)
JOB_SIZE = 11

#: A number of steps that no run has.
NEVER = float(1 << 60)
#: Times less than this share of the duration apart are the same.
_SAME = 1e-12


class Piece(NamedTuple):
    """A part of a run in which the drive's field has no corner, (level + slope·t) × its carrier.

    Attributes:
        begin, end: [s]; the last piece ends at the end of the run.
        h: length of a step [s].
        steps: how many, a whole number as a float.
        every: steps from sample to sample, the first one this number after the begin; NEVER: there is none.
        last: whether the run ends with it.
    """

    begin: float
    end: float
    h: float
    steps: float
    every: float
    level: float
    slope: float
    last: bool


@part
def _steps(length: float, step: float) -> float:
    return max(math.ceil(abs(length) / step * (1 - 1e-12)), 1.0)


@part
def _drive_at(run: Any, t: float) -> tuple[float, float]:
    """Return level and slope of the drive in the piece that holds this time [s]."""
    if t >= run[OFF]:
        return 0.0, 0.0
    if run[RATE] == 0:
        return run[FIRST], run[STEEP]
    phase = run[RATE] * t + run[TURNS] + (run[OFFSET] if run[STEEP] != 0 else 0.0)
    phase -= math.floor(phase)
    if run[STEEP] == 0:
        return (run[FIRST] if phase < 0.5 else run[SECOND]), 0.0
    slope = run[STEEP] if phase < 0.5 else -run[STEEP]
    return 1 - 4 * abs(phase - 0.5) - slope * t, slope


@aside
def next_piece(run: Any, start: float, begin: float, samples: int, sample_rate: float) -> Piece:
    """Return the piece of a run that begins at this time.

    run: the columns of a job; start: of the run [s]; begin: of the piece [s]; samples: taken before, the start counts;
    sample_rate: samples a second from the start on [1/s], 0 for none.
    """
    duration = run[DURATION]
    until, same = start + duration, _SAME * abs(duration)
    sample = start + samples / sample_rate if sample_rate > 0 else math.inf
    if run[RATE] == 0 and not (begin + same < run[OFF] < until):
        level, slope = _drive_at(run, begin + same)
        if not sample <= until + same:
            left = duration if begin == start else until - begin
            count, end_of_run = _steps(left, run[STEP]), True
            return Piece(begin, until, left / count, count, NEVER, level, slope, end_of_run)
        # all samples that are left, at equal distances: nothing happens at them but that they are kept
        left = math.floor((until + same - begin) * sample_rate * (1 + 1e-15))
        every = _steps(1 / sample_rate, run[STEP])
        end = start + (samples + left - 1) / sample_rate
        count = left * every
        return Piece(begin, end, (end - begin) / count, count, every, level, slope, end >= until - same)
    end = until
    if run[RATE] > 0 and begin + same < run[OFF]:
        m = math.floor(2 * (run[RATE] * begin + run[TURNS] - run[OFFSET])) + 1
        corner = (m / 2 + run[OFFSET] - run[TURNS]) / run[RATE]
        while corner <= begin + same:
            m += 1
            corner = (m / 2 + run[OFFSET] - run[TURNS]) / run[RATE]
        if corner < until - same:
            end = corner
    if begin + same < run[OFF] < end - same:
        end = run[OFF]
    kept = sample <= end + same
    if kept:
        end = sample
    count = _steps(end - begin, run[STEP])
    level, slope = _drive_at(run, (begin + end) / 2)
    return Piece(begin, end, (end - begin) / count, count, count if kept else NEVER, level, slope, end >= until - same)
