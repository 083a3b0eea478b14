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


def test_a_wall_clock_at_a_multiple_sleeps_that_much_shorter(monkeypatch):
    wall = [100.0]

    def sleep(duration):
        wall[0] += duration

    monkeypatch.setattr("instruments.clock.time.monotonic", lambda: wall[0])
    monkeypatch.setattr("instruments.clock.time.sleep", sleep)
    clock = WallClock(speed=1000.0)
    clock.sleep(5.0)
    assert wall[0] == pytest.approx(100.005)
    assert clock.now() == pytest.approx(5.0)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf")])
def test_the_speed_of_a_clock_is_a_number_above_0(speed):
    with pytest.raises(ValueError, match="a number above 0"):
        WallClock(speed=speed)


def test_a_clock_that_waits_stands_still_until_it_begins(monkeypatch):
    wall = [100.0]
    monkeypatch.setattr("instruments.clock.time.monotonic", lambda: wall[0])
    clock = WallClock(speed=2.0, waits=True)
    wall[0] += 4.0
    assert clock.now() == 0.0
    clock.begin()
    wall[0] += 3.0
    clock.begin()
    assert clock.now() == 6.0
