"""The clocks: which of them jumps, and how long an event loop waits until so much time has passed."""

import pytest

from instruments.clock import VirtualClock, WallClock


def test_a_wall_clock_at_a_multiple_is_waited_for_that_much_shorter():
    clock = WallClock(speed=1000.0)
    assert not clock.jumps
    assert clock.wall_duration(5.0) == 0.005
    assert clock.wall_duration(-1.0) == 0.0


def test_a_virtual_clock_jumps_and_is_not_waited_for():
    clock = VirtualClock()
    assert clock.jumps
    assert clock.wall_duration(1e6) == 0.0


def test_a_virtual_clock_in_real_time_is_waited_for_and_then_jumps(monkeypatch):
    wall = [100.0]
    monkeypatch.setattr("instruments.clock.time.monotonic", lambda: wall[0])
    monkeypatch.setattr("instruments.clock.time.sleep", lambda duration: pytest.fail("slept") if duration else None)
    clock = VirtualClock(realtime=True)
    assert clock.jumps
    assert clock.wall_duration(10.0) == 10.0
    wall[0] += 4.0
    assert clock.wall_duration(10.0) == pytest.approx(6.0)
    assert clock.now() == 0.0
    wall[0] += 6.0
    assert clock.wall_duration(10.0) == 0.0
    clock.sleep(10.0)
    assert clock.now() == 10.0
