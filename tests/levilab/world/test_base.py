"""The base of the virtual bench against the simulator's, and where its probe is put."""

import numpy as np
import pytest

from levilab.simulator.field import field_of, flux_density
from levilab.world.base import Base, Stand, random_base


@pytest.mark.parametrize("base", [Base(), random_base(3)])
def test_its_field_is_that_of_the_simulator(base):
    exact = field_of(
        base.inner_radius_m,
        base.outer_radius_m,
        base.strength_t_m,
        "exact",
        thickness=base.thickness_m,
        origin=base.origin_m,
    )
    heights = np.array([0.02, 0.045, 0.073, 0.11])
    expected = flux_density(exact, np.column_stack([0 * heights, 0 * heights, heights]))[:, 2] + base.background_t
    assert [base.flux_density(height) for height in heights] == pytest.approx(expected, abs=1e-14)


def test_bases_differ_by_what_a_calliper_leaves_open():
    bases = [random_base(seed) for seed in range(300)]
    for name, scatter in (("strength_t_m", 2.8e-5), ("origin_m", 1e-3), ("thickness_m", 2e-4), ("background_t", 4e-5)):
        seen = np.std([getattr(base, name) for base in bases])
        assert seen == pytest.approx(scatter, rel=0.13), name  # three standard errors of one from 300


def test_a_probe_misses_a_height_by_the_same_each_time():
    stand = Stand(scatter_m=2e-4, seed=1)
    once, again, other = (stand.at(height).height_m for height in (0.05, 0.05, 0.06))
    assert once == again
    assert once != 0.05
    assert abs(other - 0.06) < 1e-3
    assert stand.at(None).flux_density(Base(background_t=1e-4)) == 0.0
    assert Stand().at(0.05).height_m == 0.05
