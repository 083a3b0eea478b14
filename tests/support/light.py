"""The light of a top that keeps its spin, as a signal of a virtual instrument."""

import math

import numpy as np

#: Light at the mark and beside it [V], and how much of a turn the mark takes, FWHM.
DARK, BRIGHT, DUTY = 0.1, 1.2, 0.03


def pulses(frequency, *, noise=0.0):
    """Gaussian pulses, evenly spaced, with noise [V] that is the same each time."""
    sigma = DUTY / math.sqrt(8 * math.log(2))

    def light(start, step, n):
        place = (frequency * (start + step * np.arange(n))) % 1.0 - 0.5
        random = np.random.default_rng(round(start * 1e6)).standard_normal(n) * noise
        return DARK + (BRIGHT - DARK) * np.exp(-0.5 * (place / sigma) ** 2) + random

    return light
