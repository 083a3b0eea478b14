"""Virtual generators for the tests of this folder."""

import pytest

from instruments.clock import VirtualClock
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.keysight_33500b import Virtual33500B


@pytest.fixture
def changes():
    return []


@pytest.fixture
def generator(changes):
    return Virtual33500B(VirtualClock(), listener=lambda time, output: changes.append((time, output)))


@pytest.fixture
def older():
    return Virtual33220A(VirtualClock())


@pytest.fixture(params=[Virtual33500B, Virtual33220A], ids=["33500B", "33220A"])
def either(request):
    return request.param(VirtualClock())
