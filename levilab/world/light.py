"""What a phototransistor sees of a top: a strip of white tape that a lamp lights once a turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tape:
    """A strip of tape under a lamp.

    width: of its light pulse, FWHM in turns; dark, bright: voltage without and at the tape [V]; noise: of the voltage,
    1σ [V].
    """

    width: float = 0.03
    dark: float = 0.1
    bright: float = 1.2
    noise: float = 0.01

    def light(self, turns: Array, spinning: NDArray[np.bool_], start: float, seed: int) -> Array:
        """The phototransistor's voltage, shape (n,) [V]: a Gaussian pulse in the middle of every turn.

        turns: since the tape was opposite to the lamp; spinning: where there is a top; start: the time of the first
        [s], with the seed that of the noise.
        """
        sigma = self.width / np.sqrt(8 * np.log(2))
        place = turns - np.floor(turns) - 0.5
        pulse = np.exp(-0.5 * (place / sigma) ** 2) * spinning
        noise = np.random.default_rng((seed, round(start * 1e6) % (1 << 63))).standard_normal(turns.size) * self.noise
        return np.asarray(self.dark + (self.bright - self.dark) * pulse + noise)
