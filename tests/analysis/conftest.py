"""Random numbers for all analyses."""

import numpy as np
import pytest


@pytest.fixture
def fresh():
    """Random numbers that no constant was chosen with."""
    return np.random.default_rng(20261124)
