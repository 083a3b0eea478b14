"""Virtual gaussmeters in a known field."""

import pytest

from instruments.clock import VirtualClock
from instruments.virtual.magnetometer.lakeshore_425 import Virtual425
from instruments.virtual.magnetometer.lakeshore_475 import Virtual475

PORT = "ASRL1::INSTR"
EACH = pytest.mark.parametrize("kind", [Virtual425, Virtual475])


def meter(kind=Virtual425, field=0.0123, **options):
    """A meter without noise of its own probe; field: a number or a function of time [T]."""
    density = field if callable(field) else lambda _: field
    return kind(VirtualClock(), flux_density=density, **({"zero_error": 0.0} | options))


def value(answer):
    return float(answer)
