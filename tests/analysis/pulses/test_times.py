"""Spin frequency of lists of pulse times."""

import numpy as np

from analysis.pulses import spin_of_times


def pulse_times(frequency=30.3, chirp=-0.1, duration=10.0, phase=0.37):
    """Times at which phase + frequency t + chirp t²/2 is whole, by the closed form."""
    turn = np.arange(1, int((frequency + chirp * duration / 2) * duration))
    return (-frequency + np.sqrt(frequency**2 + 2 * chirp * (turn - phase))) / chirp


def test_exact_times_give_the_exact_frequency_and_slope():
    found = spin_of_times(pulse_times())
    assert abs(found.frequency.value - (30.3 - 0.1 * found.reference_time)) < 1e-9  # times are rounded to 1e-15 s
    assert abs(found.chirp.value + 0.1) < 1e-9
