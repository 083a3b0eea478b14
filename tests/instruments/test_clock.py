"""The clocks: which of them jumps, and how long an event loop waits until so much time has passed."""

import math

import pytest

from instruments.clock import PART_S, PacedClock, VirtualClock, WallClock


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


@pytest.fixture
def wall(monkeypatch):
    """The wall's clock, which moves only when a program sleeps."""
    wall = [100.0]

    def sleep(duration):
        assert duration >= 0
        wall[0] += duration

    monkeypatch.setattr("instruments.clock.time.monotonic", lambda: wall[0])
    monkeypatch.setattr("instruments.clock.time.sleep", sleep)
    return wall


@pytest.mark.parametrize("make", [WallClock, lambda: VirtualClock(realtime=True), PacedClock])
def test_a_clock_calls_what_goes_on_meanwhile_twenty_times_a_second(wall, make):
    clock, seen = make(), []
    clock.meanwhile = lambda: seen.append(clock.now())
    clock.sleep(2.0)
    assert clock.now() == pytest.approx(2.0)
    assert 39 <= len(seen) <= 41
    assert max(b - a for a, b in zip([0.0, *seen], seen, strict=False)) < 1.01 * PART_S
    assert wall[0] == pytest.approx(102.0)


def test_a_clock_that_jumps_calls_it_once_after_each_jump():
    clock, seen = VirtualClock(), []
    clock.meanwhile = lambda: seen.append(clock.now())
    clock.sleep(190.0)
    clock.sleep(0.0)
    assert seen == [190.0, 190.0]


def test_what_goes_on_meanwhile_may_sleep_and_makes_no_sleep_longer(wall):
    clock = PacedClock()

    def look():
        if clock.now() < 0.5:
            clock.meanwhile = None
            clock.sleep(0.3)
            clock.meanwhile = look

    clock.meanwhile = look
    clock.sleep(1.0)
    assert clock.now() == 1.0


def test_the_speed_of_a_paced_clock_changes_at_once(wall):
    clock = PacedClock(speed=10.0)
    clock.meanwhile = lambda: setattr(clock, "speed", 0.1 if clock.now() >= 5.0 else 10.0)
    clock.sleep(5.0)
    assert wall[0] == pytest.approx(100.5)
    assert clock.wall_duration(1.0) == pytest.approx(10.0)
    clock.sleep(0.1)
    assert wall[0] == pytest.approx(101.5)


def test_a_paced_clock_stands_still_until_it_is_let_go_on(wall):
    clock, seen = PacedClock(), []

    def look():
        seen.append(clock.now())
        clock.paused = len(seen) < 10

    clock.paused, clock.meanwhile = True, look
    clock.sleep(1.0)
    assert seen[:10] == [0.0] * 10
    assert clock.now() == 1.0
    assert wall[0] == pytest.approx(101.5)


def test_what_a_paced_clock_is_late_by_is_not_caught_up_with(wall):
    clock = PacedClock()
    wall[0] += 60.0  # the machine was busy
    clock.sleep(1.0)
    assert 160.65 < wall[0] < 160.8  # a quarter of a second is
    fast, late = PacedClock(math.inf), wall[0]
    fast.sleep(1e6)
    assert (fast.now(), wall[0]) == (1e6, late)
