"""Signals of a detector that a mark passes once per turn, by closed forms."""

import wave

import numpy as np

#: C of the disc law [(rad/s)^-1/2/s], and where a top is released [Hz].
C32, RELEASE_HZ = 2.34e-4, 40.0


def coasting_turns(t):
    """Turns of a top that coasts from RELEASE_HZ by the disc law: the integral of (ω₀^-½ + C t/2)^-2, over 2π."""
    root = (2 * np.pi * RELEASE_HZ) ** -0.5
    return (2 / C32) * (1 / root - 1 / (root + C32 * t / 2)) / (2 * np.pi)


def pulses(turns, *, noise=0.02, seed=1):
    """A pulse of 1 V and 3 % of a turn each turn, on 0.1 V, with noise [V]."""
    off = (turns + 0.5) % 1 - 0.5
    signal = 0.1 + np.exp(-0.5 * (off / (0.03 / 2.3548)) ** 2)
    return signal + np.random.default_rng(seed).normal(0, noise, turns.size)


def write_wav(path, signal, rate):
    """A WAV of 16 bits, 2 V at full scale."""
    with wave.open(str(path), "wb") as sound:
        sound.setparams((1, 2, rate, len(signal), "NONE", ""))
        sound.writeframes(np.round(signal / 2 * 32767).astype("<i2").tobytes())
    return path


def coasting_wav(path, *, seconds=30.0, rate=1000):
    """A record of a top that coasts."""
    t = np.arange(round(seconds * rate)) / rate
    return write_wav(path, pulses(coasting_turns(t)), rate)
