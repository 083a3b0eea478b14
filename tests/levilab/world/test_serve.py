"""``levilab bench serve``: a process that other programs talk to, and that ends when it is asked to."""

import contextlib
import errno
import json
import os
import signal
import socket
import subprocess
import sys
import threading

import pytest
import pyvisa
from typer.testing import CliRunner

from instruments.clock import WallClock
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.servers.server import LOOPBACK, BenchServer
from levilab.cli.bench import bench_app
from levilab.errors import UsageError
from levilab.world.bench import practice_world, virtual_bus
from levilab.world.serve import CannotServe, Service, chosen_models, serve
from support.waiting import HANG_GUARD_S as AT_MOST


@contextlib.contextmanager
def serving(*words, stdin=None):
    """The process and what it said when it was ready."""
    command = [sys.executable, "-m", "levilab", "bench", "serve", "--json", *words]
    process = subprocess.Popen(command, stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        line = process.stdout.readline()
        assert line, process.stderr.read()
        yield process, json.loads(line)
    finally:
        process.kill()
        process.communicate()


STARTER = """
import subprocess, sys
server = subprocess.Popen(sys.argv[1:], stdin=subprocess.PIPE)
server.wait()
"""


def test_a_bench_ends_with_the_program_that_started_it_however_that_dies():
    bench = [sys.executable, "-m", "levilab", "bench", "serve", "--json"]
    starter = subprocess.Popen([sys.executable, "-c", STARTER, *bench], stdout=subprocess.PIPE, text=True)
    assert json.loads(starter.stdout.readline())["ready"]
    starter.kill()
    # its standard output ends with the last process that has it: the bench
    assert starter.communicate(timeout=AT_MOST) == ("", None)


def test_a_pipe_that_had_ended_before_does_not_end_the_bench():
    end, beginning = os.pipe()
    os.close(beginning)
    with os.fdopen(end) as nothing, serving("--speed", "100", stdin=nothing) as (_, said):
        assert "53230A" in ask(said["instruments"]["counter"]["resources"]["hislip"], "*IDN?")


def ended(process, number):
    """The exit status after a signal, and what was said from then on."""
    process.send_signal(number)
    out, errors = process.communicate(timeout=AT_MOST)
    return process.returncode, out, errors


def ask(resource, question):
    with pyvisa.ResourceManager("@py").open_resource(resource, timeout=1000 * AT_MOST) as client:
        client.read_termination = client.write_termination = "\n"
        return client.query(question).strip()


@pytest.mark.skipif(os.name == "nt", reason="Windows ends a process, it does not ask")
def test_the_line_names_every_instrument_each_answers_and_sigterm_ends_it():
    with serving("--speed", "100") as (process, said):
        assert said["ready"] is True
        counter, generator = said["instruments"]["counter"], said["instruments"]["generator"]
        assert (counter["model"], generator["model"]) == ("53230A", "33500B")
        assert set(counter["resources"]) == {"socket", "hislip", "vxi11"}
        for resource in counter["resources"].values():
            assert "53230A" in ask(resource, "*IDN?")
        assert "33522B" in ask(generator["resources"]["hislip"], "*IDN?")
        # ten seconds of the bench
        name = counter["resources"]["hislip"]
        with pyvisa.ResourceManager("@py").open_resource(name, timeout=1000 * AT_MOST) as client:
            client.write("INP1:COUP DC;:INP1:LEV:AUTO OFF;:INP1:LEV 0.6;:SENS:FREQ:GATE:TIME 10;:SYST:TIM 20")
            assert float(client.query("READ?")) > 0  # how far the top has spun down depends on how busy the machine is
            assert ended(process, signal.SIGTERM) == (0, "", "")
            with contextlib.suppress(pyvisa.VisaIOError):
                client.close()


def test_a_served_top_begins_to_spin_down_with_the_first_message():
    world = practice_world(WallClock(waits=True))
    bench = virtual_bus(world)
    bench.on_message = world.clock.begin
    with BenchServer(bench) as server:
        assert world.clock.now() == 0.0
        (counter,) = (offer for offer in server.endpoints if "counter" in offer.address)
        assert "53230A" in ask(counter.resources["socket"], "*IDN?")
        assert world.clock.now() > 0.0


def answer_to(client, monkeypatch, *words):
    """What a client has to say of the instruments' resources, in a thread, while `levilab bench serve` runs here."""
    said = []

    def use(instruments):
        try:
            said.append(client({served.kind: served.resources for served in instruments}))
        finally:
            signal.raise_signal(signal.SIGTERM)

    def serve_the_client(service, _, tell):
        return serve(service, lambda instruments: threading.Thread(target=use, args=(instruments,)).start(), tell)

    monkeypatch.setattr("levilab.world.serve.serve", serve_the_client)
    shown = CliRunner().invoke(bench_app, ["serve", *words], catch_exceptions=False)
    assert shown.exit_code == 0, shown.output
    return said[0]


@pytest.mark.parametrize(("speed", "low", "high"), [(0.0, 20, 31), (-3.0, 9e37, 1e38)], ids=["up", "fallen"])
def test_a_top_in_full_motion_can_be_served(speed, low, high, tmp_path, monkeypatch):
    scene = tmp_path / "mine.toml"
    # at 3 m/s downwards it has fallen within a hundredth of a second
    scene.write_text(f"[start]\nspin_hz = 30\nvelocity_m_s = [0, 0, {speed}]\n", encoding="utf-8")

    def frequency(resources):
        name = resources["counter"]["hislip"]
        with pyvisa.ResourceManager("@py").open_resource(name, timeout=1000 * AT_MOST) as counter:
            counter.write("INP1:COUP DC;:INP1:LEV:AUTO OFF;:INP1:LEV 0.6;:SENS:FREQ:GATE:TIME 0.05;:SYST:TIM 0.1")
            return float(counter.query("READ?"))

    # so slow that it spins, or lies there, for longer than this waits
    answer = answer_to(frequency, monkeypatch, "--scene", str(scene), "--speed", "0.1")
    assert low < answer < high


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for one process")
def test_ctrl_c_ends_it_in_the_middle_of_an_answer():
    with serving() as (process, said):
        port = int(said["instruments"]["counter"]["resources"]["socket"].split("::")[2])
        with socket.create_connection((LOOPBACK, port), timeout=AT_MOST) as client:
            client.sendall(b"SENS:FREQ:GATE:TIME 100;:SYST:TIM 1000;:READ?\n")
            assert ended(process, signal.SIGINT) == (130, "", "")
            with contextlib.suppress(ConnectionError):
                assert client.recv(10) == b""


def interrupt_when(said, name="SIGTERM"):
    """A `ready` that keeps its argument and asks for the end."""

    def ready(instruments):
        said.extend(instruments)
        signal.raise_signal(getattr(signal, name))

    return ready


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_ends_it_and_threads_and_handlers_are_as_before(name):
    before, threads = signal.getsignal(signal.SIGINT), set(threading.enumerate())
    said = []
    assert serve(Service(), interrupt_when(said, name)) == name
    assert {served.kind for served in said} >= {"counter", "generator"}
    assert signal.getsignal(signal.SIGINT) is before
    assert set(threading.enumerate()) <= threads


def test_models_are_chosen_by_kind_in_any_case():
    assert chosen_models(["counter=53230a", "generator=33500B"]) == {"counter": "53230A", "generator": "33500B"}
    said = []
    serve(Service(models=chosen_models(["counter=CNT-91"])), interrupt_when(said))
    assert {served.kind: served.model for served in said}["counter"] == "CNT-91"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["counter=DVM"], "no such counter, known are "),
        (["piano=1"], "'piano' is no kind of instrument"),
        (["counter"], "no such counter"),
        (["oscilloscope=sound"], "other programs cannot reach a virtual sound; `levilab acquire --mock` has one"),
    ],
)
def test_a_model_that_there_is_not_is_wrong_usage(words, says):
    with pytest.raises(UsageError, match=says):
        chosen_models(words)


@pytest.mark.parametrize(
    ("service", "says"),
    [
        (Service(speed=0), "speed = 0"),
        (Service(speed=float("nan")), "speed = nan"),
        (Service(speed=float("inf")), "speed = inf"),
        (Service(port_base=65535), "the ports end at 65535"),
        (Service(host="nowhere.invalid"), "try another `host` or `port_base`"),
        (Service(host="::1"), "host = ::1: IPv6 has no place in VISA resource names, give an IPv4 address"),
    ],
    ids=["0", "nan", "inf", "ports", "host", "IPv6"],
)
def test_what_cannot_be_served_is_reported(service, says):
    with pytest.raises(Exception, match=says):
        serve(service, lambda _: pytest.fail("it was served"))


def test_people_see_a_table_of_names(monkeypatch):
    def serve_and_end(service, ready, tell):
        return serve(service, lambda instruments: (ready(instruments), signal.raise_signal(signal.SIGINT)), tell)

    monkeypatch.setattr("levilab.world.serve.serve", serve_and_end)
    shown = CliRunner().invoke(bench_app, ["serve"])
    assert shown.exit_code == 130
    assert "counter 53230A" in shown.stdout
    assert "::SOCKET" in shown.stdout
    assert "a line feed ends every message" in shown.stdout
    assert "Ctrl-C ends the bench" not in shown.stdout


def test_other_addresses_only_when_told_to():
    said = []
    serve(Service(), interrupt_when(said))
    assert all(LOOPBACK in name for served in said for way, name in served.resources.items() if way != "pty")
    said.clear()
    serve(Service(host="0.0.0.0"), interrupt_when(said))
    assert socket.gethostname() in said[0].resources["socket"]


@pytest.mark.parametrize("line", [b"*RST;" * 50_000, b"*RST\n" * 50_000], ids=["one line", "many lines"])
def test_a_signal_ends_it_in_the_middle_of_a_flood(line, monkeypatch):
    monkeypatch.setattr("instruments.virtual.bench.session.SLICE", -1.0)  # a slice is one step
    resets = 0

    def reset(_):
        nonlocal resets
        resets += 1
        if resets == 10:
            signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(Virtual53230A, "reset", reset)

    def flood(instruments):
        counter = next(served for served in instruments if served.kind == "counter")
        port = int(counter.resources["socket"].split("::")[2])

        def send():
            with contextlib.suppress(ConnectionError), socket.create_connection((LOOPBACK, port)) as client:
                client.sendall(line + b"\n")
                client.recv(1)

        flooding.append(threading.Thread(target=send))
        flooding[0].start()

    flooding = []
    assert serve(Service(), flood) == "SIGTERM"
    flooding[0].join()
    assert 10 <= resets < 100


# --- the port mapper ---


@pytest.mark.parametrize(
    ("error", "platform", "words"),
    [
        (PermissionError(errno.EACCES, "denied"), "linux", r"sysctl net.ipv4.ip_unprivileged_port_start=111.*setcap"),
        (PermissionError(errno.EACCES, "denied"), "darwin", "start it with sudo"),
        (OSError(errno.EADDRINUSE, "in use"), "linux", r"another port mapper \(rpcbind\) is there"),
        (OSError(errno.EADDRNOTAVAIL, "no such address"), "darwin", r"`sudo ifconfig lo0 alias 127.0.0.2 up`"),
    ],
)
def test_a_port_mapper_that_cannot_be_had_says_what_to_do(monkeypatch, error, platform, words):
    @contextlib.asynccontextmanager
    async def refused(*_):
        raise error
        yield

    monkeypatch.setattr("levilab.world.serve.serve_bench", refused)
    monkeypatch.setattr("levilab.world.serve.sys.platform", platform)
    with pytest.raises(CannotServe, match=words) as refused:
        serve(Service(port_mapper=111), lambda _: None)
    assert "\n" not in str(refused.value)


def test_a_host_that_cannot_be_one_is_wrong_usage():
    with pytest.raises(UsageError, match="no host can have this name"):
        serve(Service(host="é" * 80), lambda _: None)


def test_a_port_mapper_goes_with_loopback_addresses_alone():
    with pytest.raises(UsageError, match="does not go with `portmapper`"):
        serve(Service(host="192.168.1.5", port_mapper=111), lambda _: None)
