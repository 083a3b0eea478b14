"""Numbers about the thesis's top that a scan gives."""

import numpy as np
import pytest

from levilab.simulator.ensemble import simulate_many
from levilab.simulator.scene import preset, with_settings
from levilab.stability.scan import all_up_until, last_up
from levilab.stability.thesis import ISLANDS_HZ, STARTS


def test_islands_lie_from_the_first_top_that_is_lost_to_the_last_one_up():
    spins = np.arange(45.0, 95.1, 0.5)
    up = np.array([
        simulate_many(
            with_settings(preset("undriven"), start), {"start.spin_hz": spins}, tolerance=1e-6, errors=False
        ).survived
        for start in STARTS.values()
    ])  # fmt: skip
    found = all_up_until(spins, up.all(axis=0)), last_up(spins, up.any(axis=0))
    assert found == pytest.approx(ISLANDS_HZ, abs=1.0)  # two steps: a tenfold tolerance moves the first by one or two
