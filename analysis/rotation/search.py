"""Where the line of the spin is, about: the greatest power over frequencies and slopes that a top may have."""

import numpy as np

from analysis.arrays import Array
from analysis.rotation.record import Line, Record, deviation

#: A top floats from 20 to 85 Hz [Hz]; other lines are searched from where the spline ends, too.
LOWEST, HIGHEST, SLOW = 15.0, 85.0, 3.0
#: The steepest slope of a top in air or under a drive [Hz/s].
STEEPEST = 0.6
#: Length of a piece [s]; cells of the raster in a sampling interval; blocks of the search with phases.
PIECE_S, CELLS, BLOCKS = 2.0, 4, 64
#: Width about a line that no other line is searched in [Hz], beside what the record's length resolves.
_APART = 0.7
#: Lines beside mains and spin: precession and nutation.
_OTHERS = 2


def _raster(record: Record, weighted: Array, pieces: int, cells: int) -> tuple[Array, float]:
    """Return powers of pieces, added over the axes, shape (pieces, m), and the distance of their frequencies [Hz].

    Samples go to the nearest cell of a raster, whatever their times; several cells in an interval show folds, too.
    """
    step = 1 / (record.rate * cells)
    place = np.rint((record.late - record.late[0]) / step).astype(np.int64)
    size = -(-int(place[-1] + 1) // pieces)
    padded = int(2 ** np.ceil(np.log2(2 * size)))
    raster = np.zeros((pieces, padded, weighted.shape[1]))
    np.add.at(raster, (place // size, place % size), weighted)
    power = np.sum(np.abs(np.fft.rfft(raster, axis=1)) ** 2, axis=2)
    return power, 1 / (padded * step)


def search(record: Record, low: float, high: float) -> Line:
    """Return the strongest line between two frequencies [Hz], to a part of 1/T.

    First powers of pieces are added along slopes, which forgives phases; then with phases on a fine grid.
    """
    rest = record.rest()
    weight = 1 / np.maximum(deviation(rest), 1e-12)
    pieces = max(round(2 * record.half / PIECE_S), 1)
    power, unit = _raster(record, rest * weight, pieces, CELLS)
    middle = (np.arange(pieces) + 0.5 - pieces / 2) * 2 * record.half / pieces
    slopes = np.arange(-STEEPEST, STEEPEST, 0.25 * unit / record.half) if pieces > 1 else np.zeros(1)
    high = min(high, (power.shape[1] - 1) * unit)
    trial = np.arange(int(low / unit), int(high / unit) + 1)
    at = trial[None, :, None] + np.rint(slopes[:, None, None] * middle / unit).astype(np.int64)
    total = power[np.arange(pieces), np.clip(at, 0, power.shape[1] - 1)].sum(axis=2)
    i, j = np.unravel_index(int(total.argmax()), total.shape)
    start = Line(float(trial[j] * unit), float(slopes[i]))
    length = 2 * record.half
    return refine(record, rest * weight, start, 1 / min(PIECE_S, length), 12 / length**2)


def refine(record: Record, rest: Array, start: Line, by: float, by_chirp: float) -> Line:
    """Return the line of greatest power near a start, with phases, to a part of 1/T.

    Args:
        record: of the times.
        rest: what is left of the samples by all else, in units of the noise, shape (n, k).
        start: the middle of what is searched.
        by: reach of the frequency to either side [Hz].
        by_chirp: that of the slope [Hz/s].
    """
    n, length = record.late.size, 2 * record.half
    blocks = min(BLOCKS, n // 2)
    starts = np.arange(blocks) * n // blocks
    wave = np.exp(-2j * np.pi * (start.frequency * record.late + 0.5 * start.chirp * record.late**2))
    sums = np.add.reduceat(rest * wave[:, None], starts)
    late = np.add.reduceat(record.late, starts) / np.diff(np.append(starts, n))
    frequencies = np.arange(-by, by + 1e-9, 0.25 / length)
    chirps = np.arange(-by_chirp, by_chirp + 1e-9, 0.75 / length**2)
    turned = np.exp(-1j * np.pi * chirps[:, None] * late**2)[:, :, None] * sums
    power = np.sum(np.abs(np.exp(-2j * np.pi * frequencies[:, None] * late) @ turned) ** 2, axis=2)
    i, j = np.unravel_index(int(power.argmax()), power.shape)
    return Line(start.frequency + float(frequencies[j]), start.chirp + float(chirps[i]))


def other_lines(record: Record, rest: Array, line: Line, moves: float = 0.0) -> list[Line]:
    """Return the strongest lines beside that of the spin, as precession, nutation, or a motor nearby.

    Precession is as slow as the spin is fast, nutation as fast as that: their slopes follow.

    Args:
        record: the samples.
        rest: what line and mains leave of them, shape (n, k).
        line: of the spin.
        moves: what the line may come to until these lines are used [Hz].
    """
    power, unit = _raster(record, rest / np.maximum(deviation(rest), 1e-12), 1, 1)
    frequency = np.arange(power.shape[1]) * unit
    allowed = (frequency > SLOW) & (frequency < record.rate / 2)
    spread = _APART + 1.5 / record.half + abs(line.chirp) * record.half + moves

    def forbid(where: float, width: float) -> None:
        folded = abs((where + record.rate / 2) % record.rate - record.rate / 2)
        allowed[np.abs(frequency - folded) < width] = False

    forbid(line.frequency, spread)
    for one in record.others:
        forbid(one.frequency, _APART)
    found = []
    for _ in range(_OTHERS):
        if not allowed.any():
            break
        at = float(frequency[np.where(allowed, power[0], -1).argmax()])
        share = line.chirp / line.frequency
        found.append(Line(at, at * share if at > LOWEST else -at * share))
        forbid(at, spread)
    return found
