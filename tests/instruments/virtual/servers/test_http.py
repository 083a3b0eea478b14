"""The virtual phone over HTTP, as a browser or another program reaches it."""

import json
import socket
import urllib.error
import urllib.request

import pytest

from instruments.clock import WallClock
from instruments.drivers.counter.phyphox import Phyphox
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.counter.phyphox import VirtualPhyphox
from instruments.virtual.servers.server import BenchServer
from support.phones import ADDRESS, strongest_line, turning


@pytest.fixture
def served():
    """A phone whose seconds take a twentieth of one, and its address."""
    clock = WallClock(speed=20.0)
    phone = VirtualPhyphox(clock, magnetic_field=turning())
    with BenchServer(VirtualBench({ADDRESS: phone})) as server:
        (endpoints,) = server.endpoints
        yield phone, clock, endpoints.resources["phyphox"]


def open_url(address, path):
    return urllib.request.urlopen(address.replace("phyphox://", "http://") + path, timeout=10)


def test_a_browser_gets_documents_and_errors(served):
    _, _, address = served
    with open_url(address, "/config") as answer:
        assert answer.headers["Access-Control-Allow-Origin"] == "*"
        assert json.load(answer)["title"] == "Magnetometer"
    with pytest.raises(urllib.error.HTTPError, match="404"):
        open_url(address, "/favicon.ico")


def test_the_driver_reads_it_over_the_network(served):
    phone, clock, address = served
    driver = Phyphox(open_link(address, line={}), clock=clock, estimator=strongest_line)
    assert "VIRTUAL" in driver.identity()
    driver.prepare(gate_s=1.0, trigger_level_v=0.6)
    assert driver.frequency() == pytest.approx(30.0, abs=0.02)  # the step of the estimator
    driver.close()
    assert not phone.measuring


def test_clients_that_send_nonsense_or_nothing_disturb_no_other(served):
    _, _, address = served
    host, _, port = address.removeprefix("phyphox://").partition(":")
    for words in (b"", b"\x00\xff\r\n\r\n", b"GET /get?a HTTP/1.1\r\n" + b"A: b\r\n" * 20_000, b"*IDN?\n"):
        with socket.create_connection((host, int(port))) as client:
            client.sendall(words)
    with open_url(address, "/meta") as answer:
        assert json.load(answer)["deviceModel"] == "VIRTUAL"
