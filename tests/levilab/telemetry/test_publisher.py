"""A bench publishes, a view listens."""

from __future__ import annotations

import numpy as np

from levilab.telemetry.messages import Poses, Record, State
from levilab.telemetry.publisher import LEAST_PAUSE_S, Publisher
from levilab.telemetry.subscriber import Subscriber


class Wall:
    """A wall clock that a test moves."""

    def __init__(self) -> None:
        self.time = 100.0

    def __call__(self) -> float:
        return self.time


def received(view: Subscriber) -> list[object]:
    """What has come; the kernel hands a datagram over on loopback before `sendto` returns."""
    return list(view.receive())


def test_a_view_that_asks_gets_messages() -> None:
    wall = Wall()
    with Publisher(wall) as bench:
        assert bench.address
        with Subscriber(bench.address, wall) as view:
            assert not bench.is_due()
            wall.time += LEAST_PAUSE_S
            assert received(view) == []
            assert bench.is_due()
            state = State(1.0, text="<b>ü", last={"spin_frequency_hz": 25.0})
            n = 3000
            bench.send(state)
            bench.send(Record(1, "light", 1.0, 0.0, 1e-3, np.zeros(n, np.float32), np.ones(n, np.float32)))
            bench.send(
                Poses(1.0, 0.0025, np.ones((2, 3), np.float32), np.ones((2, 4), np.float32), np.array([True, False]))
            )
            got = received(view)
    assert got[0] == state
    assert isinstance(got[1], Record)
    assert got[1].high.sum() == n
    assert isinstance(got[2], Poses)
    assert got[2].up.tolist() == [True, False]
