"""A virtual sound card: the far end of the link of instruments/links/sound.py, which carries samples.

It answers ``*IDN?`` as every instrument of the bench does; samples come from :meth:`VirtualSoundCard.open_input`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.signal import Array, Signal

#: Samples of a block, and time that a sound card keeps blocks that are not read [s].
_BLOCK, _KEPT_S = 2400, 0.5
#: Scatter of clocks from one sound card to another, 1σ, and the corner frequencies of their inputs [Hz].
_CLOCK, _CORNERS_HZ = 5e-5, (5.0, 20.0)
#: Automatic gain brings the level to this part of full scale, within this time [s].
_WANTED_LEVEL, _GAIN_S = 0.25, 1.0


class VirtualSoundCard(VirtualInstrument):
    """A sound card whose two channels have a signal each.

    Attributes:
        clock_error: relative error of its clock, above 0 where it is fast.
        corner_hz: of its high-pass, first order [Hz].
        full_scale_v: greatest voltage of its converter [V]; a line input has about that.
        noise: of a sample, 1σ, in parts of full scale.
        hum: amplitude, in parts of full scale, at 50 Hz.
        automatic_gain: whether it changes its gain.
        gain: factor before the converter.
        unplugged_at: time from which on no sample comes [s].
        loses: times at which samples of some duration are lost: (time [s], duration [s], whether it says so).
        muted: whether its samples are zeros.
    """

    identity = "Virtual bench,sound,VIRTUAL,levilab"

    def __init__(self, clock: Clock, *, signals: Mapping[int, Signal], seed: int = 0) -> None:
        super().__init__(clock)
        random = np.random.default_rng((seed, 7))
        self.clock_error = _CLOCK * float(random.standard_normal())
        self.corner_hz = float(random.uniform(*_CORNERS_HZ))
        self.full_scale_v, self.noise, self.hum, self.gain = 1.5, 2e-4, 0.0, 1.0
        self.automatic_gain = self.muted = False
        self.unplugged_at = math.inf
        self.loses: list[tuple[float, float, bool]] = []
        self.signals = [signals[n] for n in sorted(signals)][:2]
        self.random = random

    def open_input(self) -> VirtualInput:
        """Return its input."""
        return VirtualInput(self)


class VirtualInput:
    """The input of a virtual sound card; see :class:`instruments.links.sound.SoundInput`."""

    def __init__(self, card: VirtualSoundCard) -> None:
        self._card = card
        self.identity, self.rate, self.channels = card.identity, 48_000.0, len(card.signals)

    def start(self) -> None:
        """Begin to sample, with the capacitors of the input uncharged."""
        self._time = self._card.clock.now()
        self._charge = np.zeros((self.channels, 1))
        self._level = _WANTED_LEVEL
        self._losses = [loss for loss in self._card.loses if loss[0] >= self._time]

    def read(self, within: float) -> tuple[NDArray[np.int16], float, bool] | None:
        """Return the next samples once they are there; None where the card is unplugged."""
        card, clock = self._card, self._card.clock
        step = 1 / (self.rate * (1 + card.clock_error))
        lost = clock.now() > self._time + _KEPT_S
        skipped = max(clock.now() - self._time - _KEPT_S, 0.0)
        if self._losses and self._time >= self._losses[0][0]:
            _, skipped, lost = self._losses.pop(0)
        self._time += skipped
        ready = self._time + _BLOCK * step
        if ready > card.unplugged_at:
            clock.sleep(within)
            return None
        volts = np.array([signal(self._time, step, _BLOCK) for signal in card.signals])
        volts += card.hum * card.full_scale_v * np.sin(2 * math.pi * 50 * (self._time + step * np.arange(_BLOCK)))
        samples = self._convert(self._coupled(volts, step) / card.full_scale_v, step)
        self._time = ready
        clock.sleep(ready - clock.now())
        return samples, clock.now(), lost

    def _coupled(self, volts: Array, step: float) -> Array:
        """Return voltages behind the high-pass, shape (channels, n) [V]: less the charge of its capacitor."""
        from scipy.signal import lfilter  # takes a moment to load

        share = -math.expm1(-2 * math.pi * self._card.corner_hz * step)
        charge, self._charge = lfilter([share], [1.0, share - 1], volts, zi=self._charge)
        return np.asarray(volts - charge)

    def _convert(self, shares: Array, step: float) -> NDArray[np.int16]:
        """Return codes of voltages in parts of full scale, shape (n, channels)."""
        card = self._card
        shares = shares * card.gain + card.noise * card.random.standard_normal(shares.shape)
        if card.automatic_gain:
            seen = math.sqrt(float(np.mean(shares**2)))
            card.gain *= (_WANTED_LEVEL / max(seen, 1e-3)) ** (_BLOCK * step / _GAIN_S)
        codes = np.clip(np.rint(shares * (1 << 15)), -(1 << 15), (1 << 15) - 1)
        return np.zeros(codes.T.shape, np.int16) if card.muted else np.ascontiguousarray(codes.T.astype(np.int16))

    def stop(self) -> None:
        """End sampling."""

    def close(self) -> None:
        """Give the input back."""
