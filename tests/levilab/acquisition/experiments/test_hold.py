"""A held spin on the virtual bench: its scatter, and the drag that the amplitude balances."""

import math

import numpy as np
import pytest

from analysis.uncertainty import Estimate
from levilab.acquisition.experiments.hold import drag_of
from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.errors import UsageError
from levilab.world.spin_world import random_scene
from support.acquisitions import Impatient, Silent


def held(out, seed, *settings, show=None, **more):
    options = AcquisitionOptions(mock=True, out=out, seed=seed, settings=settings, **more)
    return acquire(request_for("hold", options), show or Silent())


def drag_at(seed, spin):
    """The deceleration of the top of this seed by the disc law [Hz/s]."""
    (c,) = random_scene(seed).constants
    return c * (2 * math.pi * spin) ** 1.5 / (2 * math.pi)


def test_a_spin_is_held_and_its_amplitude_gives_the_drag(tmp_path):
    pulls = []
    for seed in range(4):
        run = held(tmp_path, seed, "hold.longest_s=200")
        spins = run.readings().column("spin_frequency_hz")
        assert spins.size >= 15
        assert np.abs(spins - 45.0).max() < 0.06  # 0.01 Hz is the scatter of a reading
        assert np.median(run.readings().column("spin_frequency_u_hz")) < 0.015  # 0.03 Hz of a count, ten counts
        (text,) = (event for event in run.events() if event["kind"] == "held")
        assert text["scatter_hz"] == pytest.approx(spins.std(ddof=1))
        assert text["drag_u_hz_per_s"] < 0.006
        pulls.append((text["drag_hz_per_s"] - drag_at(seed, 45.0)) / text["drag_u_hz_per_s"])
        assert run.record.instruments["generator"]["settings_end"]["output"] is False
    assert abs(np.mean(pulls)) < 2.0  # 16 seeds of 300 s: mean -0.2, s.d. 1.3, which is that of 10 counts' scatter
    assert np.abs(pulls).max() < 5.0


def test_an_interrupted_hold_goes_on(tmp_path):
    first = held(tmp_path, 3, "hold.longest_s=120", show=Impatient(3))
    assert (first.status, first.count()) == ("interrupted", 3)
    assert first.record.instruments["generator"]["settings_end"]["output"] is False
    whole = held(tmp_path, None, resume=first.folder)
    assert whole.status == "finished"
    assert np.all(np.diff(whole.readings().column("time_s")) > 0)
    assert whole.readings().column("spin_frequency_hz")[-1] == pytest.approx(45.0, abs=0.1)


def test_a_hold_is_triggered_and_nothing_else(tmp_path):
    with pytest.raises(UsageError, match="triggered is expected"):
        held(tmp_path, 1, "hold.drive=ramp")


def test_a_share_that_shows_no_drag_gives_none():
    assert drag_of(1.0, 0.01, Estimate(0.2, 0.01, "Hz/s")) is None
    assert drag_of(0.5, 0.01, None) is None
    assert drag_of(0.5, 0.0, Estimate(0.2, 0.01, "Hz/s")).value == pytest.approx(0.2)
