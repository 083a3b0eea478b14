"""The line of the spin: a wave of its own amplitude and phase in each axis, with a slope and the slope's own change.

Amplitudes are eliminated in closed form; frequency and slope are those of greatest likelihood (Gauss–Newton from the
greatest of a search).  Noise is white, of its own variance in each axis.
"""

from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array
from analysis.drag import EXPONENT, EXPONENT_U
from analysis.rotation.record import PRIOR, Record

#: Steps of Gauss and Newton at most, and the part of u that the last one is: one more would be 1 % of that.
_STEPS, _NEAR = 12, 0.1


@dataclass(frozen=True, eq=False)
class LineFit:
    """The line of greatest likelihood near a start.

    Attributes:
        frequency, chirp: at the record's middle [Hz], [Hz/s].
        covariance: of both, shape (2, 2).
        u_of_noise: their standard uncertainties, had the bend been known.
        amplitudes: of cosine and sine in each axis, shape (2, k) [unit of the record].
        amplitude_u: standard uncertainty of each, shape (k,) [unit of the record].
        variance: of a sample in each axis, shape (k,) [unit²].
        likelihood: natural logarithm of its greatest value.
        gain: by how much the line raises it.
        columns: of the line's cosine and sine, shape (n, 2).
        shift: last step over u.
    """

    frequency: float
    chirp: float
    covariance: Array
    u_of_noise: tuple[float, float]
    amplitudes: Array
    amplitude_u: Array
    variance: Array
    likelihood: float
    gain: float
    columns: Array
    shift: float


def fit_line(record: Record, frequency: float, chirp: float, *, drags: bool = True) -> LineFit:
    """Return the line of greatest likelihood near a frequency [Hz] and a slope [Hz/s] at the record's middle.

    drags: whether a slope downwards has the bend of a drag; else it is even, as that of a drive.
    """
    x, half = record.late_of_half, record.half
    n = x.size
    freedom = max(n - record.parameters - 2.0, 1.0)
    for _ in range(_STEPS):
        bend_unit = chirp * abs(chirp) / frequency if drags and chirp < 0 else 0.0  # of an even drive there is none
        bend = EXPONENT * abs(bend_unit)
        turns = half * x * (frequency + half * x * (chirp / 2 + half * x * bend / 6))
        angle = 2 * np.pi * turns
        wave = (np.cos(angle) + 1j * np.sin(angle))[:, None]
        columns = (record.powers * wave).view(np.float64)  # cosine and sine for each power
        normal, product = record.project(columns)
        own = normal[:2, :2] + PRIOR * np.eye(2)
        inverse = np.linalg.inv(own)
        amplitudes = inverse @ product[:2]
        explained = np.einsum("ik,ik->k", product[:2], amplitudes)
        squares = np.maximum(np.diagonal(record.squares) - explained, 1e-12 * n)
        variance = squares / freedom
        # derivatives by frequency, slope and bend are scale·τ, scale·τ² and scale·τ³ times the line a quarter turn on;
        # the line's own amplitudes are eliminated
        scale = np.pi * np.array([2 * half, half**2, half**3 / 3])
        across = inverse @ normal[:2, 2:]
        beside = (normal[2:, 2:] - normal[2:, :2] @ across).reshape(3, 2, 3, 2)
        left = (product[2:] - normal[2:, :2] @ amplitudes).reshape(3, 2, -1)
        ahead = np.stack([amplitudes[1], -amplitudes[0]])
        information = np.einsum("ipjq,pq->ij", beside, (ahead / variance) @ ahead.T) * np.outer(scale, scale)
        gradient = scale * np.einsum("ipk,pk->i", left, ahead / variance)
        # the bend's prior: known but for the law of the drag
        information[2, 2] += 1 / max((EXPONENT_U * abs(bend_unit)) ** 2, 1e-24)
        information[[0, 1], [0, 1]] += 1e-12  # no line at all leaves nothing to divide by
        covariance = np.linalg.inv(information)
        step = covariance @ gradient
        u = np.sqrt(np.diagonal(covariance)[:2])
        # no further than a phase of half a turn at the ends
        shift = float(np.max(np.abs(step[:2]) / u))
        limit = max(abs(step[0]) * 2 * half, abs(step[1]) * 2 * half**2, 1.0)
        frequency += float(step[0] / limit)
        chirp += float(step[1] / limit)
        if shift < _NEAR:
            break
    known = np.linalg.inv(information[:2, :2])
    whole = np.maximum(np.diagonal(record.squares), 1e-12 * n)
    likelihood = -0.5 * n * float(np.sum(np.log(squares)))
    return LineFit(
        frequency=frequency,
        chirp=chirp,
        covariance=np.asarray(covariance[:2, :2], dtype=np.float64),
        u_of_noise=(float(known[0, 0]) ** 0.5, float(known[1, 1]) ** 0.5),
        amplitudes=amplitudes,
        amplitude_u=np.sqrt(variance * 0.5 * float(np.trace(inverse))),
        variance=variance,
        likelihood=likelihood,
        gain=0.5 * n * float(np.sum(np.log(whole / squares))),
        columns=wave.view(np.float64),
        shift=shift,
    )
