"""How fast the way to an instrument is, real protocols and virtual far ends, as ratios within one run.

``python benchmarks/wire.py`` (two minutes; needs the extra ``peers``) prints four tables and writes
benchmarks/results/instruments.json:

1. Round trips in process, against pyvisa-sim with a device that gives the same answers.
2. Round trips over loopback, against an echo of the same bytes by plain sockets.  Each server is a process of its own.
3. A trace of 24 million points fetched piece by piece, each time by a process of its own.
4. ``levilab acquire spin --mock``: what it spends outside of the world's physics.

Contenders take turns, the best of the rounds counts; "spread" is how much slower the median round was.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
import socket
import statistics
import tempfile
import threading
import time
import tracemalloc
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest import mock

import pyvisa

from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from instruments.virtual.oscilloscope.rigol_ds1000z import VirtualDS1000Z
from instruments.virtual.servers.server import BenchServer
from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.present.progress import Display
from levilab.world.bench import virtual_wiring
from levilab.world.spin_world import SpinScene, SpinWorld, random_scene

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from multiprocessing.connection import Connection

Contenders = dict[str, "Callable[[], object]"]

RESULTS = Path(__file__).with_name("results") / "instruments.json"
ADDRESS = "TCPIP0::bench.levilab::inst0::INSTR"
POINTS = 24_000_000
#: A number as a generator sends it, for those who only repeat.
NUMBER = "+1.000000000000000E+03"

# --- rounds ---


def measured(contenders: Contenders, *, rounds: int, duration: float) -> dict[str, dict[str, float]]:
    """Calls per second of each in its best round, and how much slower its median round was."""
    calls = {name: _calls(call, duration) for name, call in contenders.items()}
    times: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(rounds):
        for name, call in contenders.items():
            times[name].append(_time_of(call, calls[name]) / calls[name])
    return {
        name: {"per_second": 1 / min(all_), "spread": statistics.median(all_) / min(all_) - 1}
        for name, all_ in times.items()
    }


def _calls(call: Callable[[], object], duration: float) -> int:
    """How many of them take about so long."""
    _time_of(call, 50)
    return max(10, round(50 * duration / _time_of(call, 50)))


def _time_of(call: Callable[[], object], count: int) -> float:
    start = time.perf_counter()
    for _ in range(count):
        call()
    return time.perf_counter() - start


def opened(address: str, library: Any) -> Any:
    """Return a resource as a program that uses PyVISA alone opens it."""
    return pyvisa.ResourceManager(library).open_resource(address, read_termination="\n", write_termination="\n")


def generator() -> Virtual33500B:
    """Return the instrument that is asked: it takes no time of its own."""
    device = Virtual33500B(VirtualClock())
    device.pace = 0.0
    return device


# --- 1. in process ---

_SIMULATED = """
spec: "1.1"
devices:
  generator:
    eom: {{"TCPIP INSTR": {{q: "\\n", r: "\\n"}}}}
    error: ERROR
    dialogues:
      - {{q: "*IDN?", r: "{identity}"}}
    properties:
      frequency:
        default: 1000.0
        getter: {{q: "FREQ?", r: "{{:+.15E}}"}}
        setter: {{q: "FREQ {{}}"}}
        specs: {{type: float}}
resources:
  {address}: {{device: generator}}
"""


def in_process(rounds: int, duration: float) -> dict[str, Any]:
    """Round trips per second by question and contender."""
    device = generator()
    ours = library_for(VirtualBench({ADDRESS: device}))
    with tempfile.TemporaryDirectory() as folder:
        described = Path(folder) / "generator.yaml"
        described.write_text(_SIMULATED.format(identity=device.identity, address=ADDRESS), encoding="utf-8")
        simulated = f"{described}@sim"
        links: dict[str, Any] = {
            "PyVISA on @levilab": opened(ADDRESS, ours).query,
            "PyVISA on @sim": opened(ADDRESS, simulated).query,
            "our transport on @levilab": open_link(ADDRESS, library=ours).query,
            "our transport on @sim": open_link(ADDRESS, library=simulated).query,
        }
        found = {}
        for question in ("*IDN?", "FREQ?"):
            assert len({ask(question) for ask in links.values()}) == 1, "they must answer the same"
            asking: Contenders = {name: partial(ask, question) for name, ask in links.items()}
            found[question] = measured(asking, rounds=rounds, duration=duration)
    return found


# --- 2. over loopback ---


@contextmanager
def in_another_process(serve: Callable[..., None], *given: object) -> Iterator[Connection]:
    """Let it serve in a process of its own; its addresses come first, and it ends when any message reaches it."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=serve, args=(there, *given))
    process.start()
    there.close()  # so that its end is noticed
    try:
        yield here
    finally:
        with suppress(BrokenPipeError):
            here.send("end")
        process.join()


def serve_bench(parent: Connection) -> None:
    """The virtual generator by every protocol."""
    with BenchServer(VirtualBench({ADDRESS: generator()})) as server:
        parent.send(server.endpoints[0].resources)
        parent.recv()


def serve_plainly(parent: Connection) -> None:
    """The same number in answer to every line, with nothing but sockets: a thread for each of two connections."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        parent.send(server.getsockname()[1])
        threads = [threading.Thread(target=_repeat, args=server.accept()[:1]) for _ in range(2)]
        for thread in threads:
            thread.start()
        parent.recv()
        for thread in threads:
            thread.join()


def _repeat(link: socket.socket) -> None:
    with link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        while link.recv(4096):
            link.sendall(NUMBER.encode() + b"\n")


class PlainClient:
    """A question and its answer by a bare socket."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def query(self, question: str) -> str:
        """Ask."""
        self.socket.sendall(question.encode() + b"\n")
        answer = b""
        while not answer.endswith(b"\n"):
            answer += self.socket.recv(4096)
        return answer.decode()

    def close(self) -> None:
        """Go away."""
        self.socket.close()


def over_loopback(rounds: int, duration: float) -> dict[str, Any]:
    """Round trips per second of a number, by contender."""
    with in_another_process(serve_bench) as bench, in_another_process(serve_plainly) as alone:
        resources, port = bench.recv(), alone.recv()
        links: dict[str, Any] = {
            "plain sockets": PlainClient(port),
            "PyVISA to a plain socket server": opened(f"TCPIP0::127.0.0.1::{port}::SOCKET", "@py"),
        }
        for way, name in resources.items():
            links[f"PyVISA, {way}"] = opened(name, "@py")
            links[f"our transport, {way}"] = open_link(name, library="@py")
        asking: Contenders = {name: partial(link.query, "FREQ?") for name, link in links.items()}
        found = measured(asking, rounds=rounds, duration=duration)
        for link in links.values():
            link.close()
    return found


# --- 3. a long trace ---


class Stopwatch:
    """Calls a function and adds up the time that it takes.  seconds, calls: so far."""

    def __init__(self, call: Callable[..., Any]) -> None:
        self.call, self.seconds, self.calls = call, 0.0, 0

    def __call__(self, *given: object) -> Any:
        """Call it."""
        start = time.perf_counter()
        try:
            return self.call(*given)
        finally:
            self.seconds += time.perf_counter() - start
            self.calls += 1


def scope_bench() -> tuple[VirtualBench, Stopwatch]:
    """Return a virtual DS1000Z that looks at a spinning top, and the watch on the top's light."""
    clock = VirtualClock()
    light = Stopwatch(SpinWorld(SpinScene(), clock).light)
    return VirtualBench({ADDRESS: VirtualDS1000Z(clock, signals={1: light})}), light


def serve_scope(parent: Connection) -> None:
    """The virtual oscilloscope; it answers each message with the time that its light has taken."""
    bus, light = scope_bench()
    with BenchServer(bus) as server:
        parent.send(server.endpoints[0].resources["socket"])
        while parent.recv() != "end":
            parent.send(light.seconds)


def serve_blocks(parent: Connection) -> None:
    """Blocks as long as the scope's in answer to every line, with nothing but a socket."""
    block = b"#9000250000" + bytes(250_000) + b"\n"
    with socket.create_server(("127.0.0.1", 0)) as server:
        parent.send(server.getsockname()[1])
        link, _ = server.accept()
        with link:
            while link.recv(4096):
                link.sendall(block)
        parent.recv()


def fetch(parent: Connection, way: str, traced: bool) -> None:  # noqa: FBT001 - a process is started with it
    """Fetch a trace; send back time, the light's share and memory."""
    with ExitStack() as opened_:
        if way == "in process":
            bus, light = scope_bench()
            scope = RigolDS1000Z(open_link(ADDRESS, library=library_for(bus)), clock=bus.instruments[ADDRESS].clock)

            def physics() -> float:
                return light.seconds
        else:
            server = opened_.enter_context(in_another_process(serve_scope))
            scope = RigolDS1000Z(open_link(server.recv(), library="@py"), clock=VirtualClock())

            def physics() -> float:
                server.send("light")
                return float(server.recv())

        scope.prepare(duration_s=1.2, points=POINTS, volts_per_division=0.5, offset_v=0.5, trigger_level_v=0.6)
        # the far clock jumps to each answer, 2 ms a message: it is far behind the one that counts our naps
        scope.acquire(timeout_s=1000.0)
        if traced:
            tracemalloc.start()
        before, began, rss = physics(), time.perf_counter(), _peak_rss()
        points = sum(piece.size for piece in scope.blocks(1))
        seconds = time.perf_counter() - began
        assert points == POINTS
        parent.send(
            {
                "seconds": seconds,
                "light": physics() - before,
                "rss": _peak_rss(),
                "rss_growth": _peak_rss() - rss,
                "traced": tracemalloc.get_traced_memory()[1] if traced else 0,
            }
        )
        scope.close()
    parent.recv()


def fetch_plainly(parent: Connection, way: str, traced: bool) -> None:  # noqa: ARG001, FBT001 - as fetch
    """As many bytes in blocks as long, by a bare socket."""
    with in_another_process(serve_blocks) as server, socket.create_connection(("127.0.0.1", server.recv())) as link:
        room, began, rss = bytearray(1 << 18), time.perf_counter(), _peak_rss()
        for _ in range(POINTS // 250_000):
            link.sendall(b":WAV:DATA?\n")
            left = 250_012
            while left:
                left -= link.recv_into(room, left)
        seconds = time.perf_counter() - began
        link.close()
        parent.send(
            {"seconds": seconds, "light": 0.0, "rss": _peak_rss(), "rss_growth": _peak_rss() - rss, "traced": 0}
        )
    parent.recv()


def _peak_rss() -> int:
    """Return the most memory that this process has had [bytes].

    Linux knows it of the program itself; the C library's number begins with that of the process that started it.
    """
    status = Path("/proc/self/status")
    if status.exists():
        return 1024 * int(status.read_text(encoding="ascii").partition("VmHWM:")[2].split()[0])
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def long_trace(rounds: int) -> dict[str, Any]:
    """Time, rate and memory by way: the round with the least time beside the light."""
    ways = {"in process": fetch, "TCP socket": fetch, "plain sockets": fetch_plainly}
    found: dict[str, Any] = {}
    for way, how in ways.items():
        all_ = [_answer_of(how, way, traced=False) for _ in range(rounds)]
        best = min(all_, key=lambda answer: answer["seconds"] - answer["light"])
        wire = [answer["seconds"] - answer["light"] for answer in all_]
        found[way] = best | {
            "wire": min(wire),
            "spread": statistics.median(wire) / min(wire) - 1,
            "mb_per_second": POINTS / 1e6 / best["seconds"],
            "mb_per_second_of_wire": POINTS / 1e6 / min(wire),
            "traced": _answer_of(how, way, traced=True)["traced"],
        }
    return found


def _answer_of(how: Callable[..., None], way: str, *, traced: bool) -> dict[str, float]:
    with in_another_process(how, way, traced) as child:
        answer: dict[str, float] = child.recv()
        return answer


# --- 4. an acquisition ---


def acquisition(rounds: int) -> dict[str, float]:
    """`levilab acquire spin --mock` without its start: the round with the least time beside light and disk [s]."""
    _acquired()  # what is imported on the way is not counted
    all_ = [_acquired() for _ in range(rounds)]
    rest = [one["rest"] for one in all_]
    return min(all_, key=lambda one: one["rest"]) | {"spread": statistics.median(rest) / min(rest) - 1}


def _acquired() -> dict[str, float]:
    with tempfile.TemporaryDirectory() as folder, ExitStack() as patched:
        request = request_for("spin", AcquisitionOptions(mock=True, out=Path(folder), seed=1))
        world: Any = SpinWorld(random_scene(1), VirtualClock())
        light = world.crossings = Stopwatch(world.crossings)
        disk = Stopwatch(os.fsync)
        patched.enter_context(mock.patch("os.fsync", disk))
        start = time.perf_counter()
        run = acquire(replace(request, wiring=lambda: virtual_wiring(world)), mock.Mock(spec=Display))
        total, readings = time.perf_counter() - start, run.count()
    rest = total - light.seconds - disk.seconds
    return {
        "seconds": total,
        "light": light.seconds,
        "disk": disk.seconds,
        "rest": rest,
        "readings": readings,
        "rest_per_reading": rest / readings,
    }


# --- what is printed ---


def print_round_trips(title: str, found: dict[str, dict[str, float]], base: str) -> None:
    print(f"\n{title:40} {'per second':>11} {'ratio':>7} {'spread':>7}")
    for name, one in found.items():
        ratio = one["per_second"] / found[base]["per_second"]
        print(f"{name:40} {one['per_second']:11.0f} {ratio:7.2f} {one['spread']:7.0%}")


def print_trace(found: dict[str, dict[str, float]]) -> None:
    columns = ("seconds", "light [s]", "wire [s]", "wire MB/s", "peak MB", "RSS MB", "grown MB", "spread")
    print(f"\n{'24 million points':20}", *(f"{column:>10}" for column in columns))
    for way, one in found.items():
        memory = (one["traced"] / 1e6, one["rss"] / 1e6, one["rss_growth"] / 1e6)
        numbers = (one["seconds"], one["light"], one["wire"], one["mb_per_second_of_wire"], *memory)
        print(f"{way:20}", *(f"{number:10.2f}" for number in numbers), f"{one['spread']:10.0%}")


def print_acquisition(found: dict[str, float]) -> None:
    print(f"\nacquire spin --mock, {found['readings']:.0f} readings")
    for name in ("seconds", "light", "disk", "rest", "rest_per_reading"):
        print(f"{name:20} {1e3 * found[name]:8.2f} ms")
    print(f"{'spread':20} {found['spread']:8.0%}")


def main() -> None:
    parser = argparse.ArgumentParser(description="How fast the way to an instrument is.")
    parser.add_argument("--rounds", type=int, default=20, help="of each contender")
    parser.add_argument("--seconds", type=float, default=0.1, help="how long a contender's round lasts")
    given = parser.parse_args()
    inside = in_process(given.rounds, given.seconds)
    for question, one in inside.items():
        print_round_trips(f"{question} in process", one, "PyVISA on @sim")
    outside = over_loopback(given.rounds, given.seconds)
    print_round_trips("FREQ? over loopback", outside, "PyVISA to a plain socket server")
    trace = long_trace(max(2, given.rounds // 5))
    print_trace(trace)
    spin = acquisition(given.rounds)
    print_acquisition(spin)
    found = {"in_process": inside, "over_loopback": outside, "long_trace": trace, "acquisition": spin}
    RESULTS.write_text(json.dumps(_rounded(found), indent=1) + "\n", encoding="utf-8")


def _rounded(found: Any) -> Any:
    if isinstance(found, dict):
        return {name: _rounded(one) for name, one in found.items()}
    return float(f"{found:.4g}") if isinstance(found, float) else found


if __name__ == "__main__":
    main()
