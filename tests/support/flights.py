"""Motions of a top without a simulation, for a camera."""

import numpy as np

from levilab.animation.camera import Flight


def level_flight(duration: float, spin: float, chirp: float = -0.05, swing: float = 1e-3) -> Flight:
    """Return a top that stays level and swings along a rosette: a motion without a simulation."""
    t = np.linspace(-0.02, duration + 0.02, round(2000 * (duration + 0.04)))
    x, y = swing * np.cos(2 * np.pi * 1.1 * t), 0.7 * swing * np.sin(2 * np.pi * 0.9 * t)
    yaw = 2 * np.pi * (0.123 + spin * t + 0.5 * chirp * t**2)
    level = np.broadcast_to(np.eye(2), (t.size, 2, 2))
    return Flight(t, x, y, yaw, level, np.zeros(t.size), np.zeros((t.size, 2)))
