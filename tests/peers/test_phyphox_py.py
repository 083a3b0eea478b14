"""phyphox-py, a client of the app that others wrote, reads the virtual phone as it reads a real one."""

import numpy as np
import pytest

from instruments.clock import WallClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.counter.phyphox import VirtualPhyphox
from instruments.virtual.servers.server import BenchServer

phyphox = pytest.importorskip("phyphox")


def turning(times):
    angle = 2 * np.pi * 30.0 * times
    return np.stack([1e-3 + 1e-5 * np.cos(angle), 1e-5 * np.sin(angle), 0 * times], axis=1)


@pytest.fixture
def served():
    """A phone whose seconds take a twentieth of one."""
    clock = WallClock(speed=20.0)
    bench = VirtualBench({"phyphox://counter.levilab": VirtualPhyphox(clock, magnetic_field=turning)})
    with BenchServer(bench) as server:
        yield clock, server.endpoints[0].resources["phyphox"].removeprefix("phyphox://")


def test_the_client_starts_the_phone_and_reads_its_buffers(served):
    clock, address = served
    host, _, port = address.partition(":")
    client = phyphox.Logger(host, int(port))
    client.get_meta()
    assert client.get_meta_key("deviceModel") == "VIRTUAL"
    client.get_config()
    assert client.buffer_needed()
    assert client.start() == {"result": True}
    clock.sleep(3.0)
    client.read_buffers(mode_data=phyphox.BufferMode.FULL)
    times, *axes = client.get_last_buffer_read()[0]
    assert len(times) > 250
    assert {len(axis) for axis in axes} == {len(times)}
    clock.sleep(1.0)
    client.read_buffers(mode_data=phyphox.BufferMode.UPDATE)
    newer = client.get_last_buffer_read()[0][0]
    assert newer[0] > times[-1]
    assert len(newer) < 200
    assert client.stop() == {"result": True}
