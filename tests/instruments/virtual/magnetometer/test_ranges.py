"""Ranges, resolution, noise and rate of the virtual gaussmeters."""

import math

import pytest

from instruments.virtual.magnetometer.lakeshore_425 import Virtual425
from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from support.gaussmeters import EACH, meter, value
from support.wire import ask, send


@pytest.mark.parametrize(
    ("kind", "probe", "ranges_g"),
    [
        (Virtual425, "HSE", [35, 350, 3500, 35_000]),
        (Virtual425, "HST", [350, 3500, 35_000, 350_000]),
        (Virtual425, "UHS", [0.35, 3.5, 35]),
        (Virtual475, "HSE", [3.5, 35, 350, 3500, 35_000]),
        (Virtual475, "HST", [35, 350, 3500, 35_000, 350_000]),
        (Virtual475, "UHS", [0.035, 0.35, 3.5, 35]),
    ],
)
def test_each_range_holds_what_it_says_and_no_more(kind, probe, ranges_g):
    field = [0.0]
    device = meter(kind, lambda _: field[0], probe=probe)
    for number, full in enumerate(ranges_g, start=1):
        send(device, f"RANGE {number}\n".encode())
        for factor, beyond in ((0.99, False), (1.01, True), (-1.01, True)):
            field[0] = factor * full * 1e-4
            device.clock.sleep(2.0)
            assert (ask(device, "RDGFIELD?") == "OL") is beyond
            assert bool(int(ask(device, "OPST?")) & 2) is beyond
    send(device, f"RANGE {len(ranges_g) + 1}\n".encode())
    assert ask(device, "RANGE?") == str(len(ranges_g))


@EACH
def test_the_automatic_range_follows_the_field_and_does_not_flutter(kind):
    field = [0.0]
    device = meter(kind, lambda _: field[0])
    lowest = {Virtual425: 3.5e-3, Virtual475: 350e-6}[kind]
    seen = []
    for size in (0.5, 0.95, 1.05, 0.95, 0.85, 20.0):
        field[0] = size * lowest
        device.clock.sleep(2.0)
        seen.append((int(ask(device, "RANGE?")), ask(device, "RDGFIELD?") == "OL"))
    assert seen == [(1, False), (1, False), (2, False), (2, False), (1, False), (3, False)]


@pytest.mark.parametrize(
    ("kind", "mode", "step_t"),
    [
        (Virtual425, "1,1,1", 35e-3 / 35_000),
        (Virtual425, "1,0,1", 35e-3 / 3500),
        (Virtual475, "1,1,1,1,1", 35e-3 / 3500),
        (Virtual475, "1,2,1,1,1", 35e-3 / 35_000),
        (Virtual475, "1,3,1,1,1", 35e-3 / 350_000),
    ],
)
def test_the_last_digit_and_the_noise_in_it(kind, mode, step_t):
    device = meter(kind)
    ask(device, f"UNIT 2;RDGMODE {mode};RDGMODE?")
    readings = []
    for _ in range(200):
        device.clock.sleep(0.2)
        readings.append(value(ask(device, "RDGFIELD?")))
    steps = [reading / step_t for reading in readings]
    # six digits on the wire are no finer than the display
    assert all(step == pytest.approx(round(step), abs=0.06 if "1,3" in mode else 2e-3) for step in steps)
    mean = sum(steps) / len(steps)
    spread = math.sqrt(sum((step - mean) ** 2 for step in steps) / len(steps))
    assert mean == pytest.approx(0.0123 / step_t, abs=0.2)
    assert 0.4 < spread < 0.8  # half a step, and the rounding


def test_the_same_seed_makes_the_same_noise_and_another_another():
    def some(seed):
        device = meter(seed=seed)
        return [ask(device, "RDGFIELD?") for _ in range(50)]

    assert some(1) == some(1) != some(2)


@pytest.mark.parametrize(
    ("kind", "mode", "rate"), [(Virtual425, "1,1,1", 30), (Virtual475, "1,1,1,1,1", 30), (Virtual475, "1,3,1,1,1", 10)]
)
def test_there_are_so_many_readings_a_second_and_asking_more_often_gives_the_same_again(kind, mode, rate):
    device = meter(kind, lambda time: 1e-4 * time)
    ask(device, f"RDGMODE {mode};RDGMODE?")
    start = device.clock.now()
    answers = [ask(device, "RDGFIELD?") for _ in range(1000)]
    assert len(set(answers)) == pytest.approx(rate * (device.clock.now() - start), abs=2)


def test_a_new_reading_sets_its_bit_of_the_operation_status():
    device = meter()
    device.clock.sleep(1.0)
    assert int(ask(device, "OPST?")) & 4
    ask(device, "RDGFIELD?")
    # the next reading is due within a thirtieth of a second
    seen = [int(ask(device, "OPST?")) & 4 for _ in range(4)]
    assert seen == sorted(seen)
    assert seen[-1] == 4
