"""A clock for all links."""

import pytest

from instruments.clock import VirtualClock


@pytest.fixture
def clock():
    return VirtualClock()
