"""How long a run is said to take yet."""

import math

import pytest

from levilab.acquisition.experiments.precession import PrecessionSettings
from levilab.acquisition.experiments.precession import _time_left as of_a_sweep
from levilab.acquisition.experiments.spin import _FALL_HZ, _USUAL_DRAG, time_left
from levilab.simulator.spin import DECAYS


def test_the_time_to_the_fall_is_that_of_a_laminar_disc():
    start, fall = 2 * math.pi * 40, 2 * math.pi * _FALL_HZ
    usual = float(DECAYS["disc"].elapsed(start, fall, _USUAL_DRAG))
    first = {"time_s": 10.0, "spin_frequency_hz": 40.0}
    assert time_left(first, first) == pytest.approx(usual)


def test_the_time_of_a_sweep_is_that_of_its_way_and_of_its_holds():
    settings = PrecessionSettings(first_hz=34.0, last_hz=30.0, step_hz=2.0, ramp_hz_per_s=0.2)
    way = (34.0 - 30.0) / 0.2
    faster = settings.model_copy(update={"ramp_hz_per_s": 0.4})
    assert of_a_sweep(settings, 0) - of_a_sweep(faster, 0) == pytest.approx(way / 2)
    assert of_a_sweep(settings, 3) == 0.0
