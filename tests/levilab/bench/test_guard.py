"""The process that switches the drive off when the one that measures is killed."""

import subprocess
import sys

import pyvisa

from instruments.clock import WallClock
from instruments.virtual.servers.server import BenchServer
from levilab.world.bench import practice_world, virtual_bus
from support.served import until
from support.waiting import HANG_GUARD_S


def test_the_drive_is_off_after_a_kill(tmp_path):
    with BenchServer(virtual_bus(practice_world(WallClock()))) as server:
        generator, counter = (
            next(offer.resources["socket"] for offer in server.endpoints if kind in offer.address)
            for kind in ("generator", "counter")
        )
        bench = tmp_path / "bench.toml"
        bench.write_text(
            f'generator = {{model = "33500B", address = "{generator}"}}\n'
            f'counter = {{model = "53230A", address = "{counter}"}}\n',
            encoding="utf-8",
        )
        with pyvisa.ResourceManager("@py").open_resource(generator, timeout=1000 * HANG_GUARD_S) as seen:
            seen.read_termination = seen.write_termination = "\n"
            command = [sys.executable, "-m", "levilab", "acquire", "spin", "--bench", bench]
            with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE) as measures:
                until(lambda: seen.query("OUTP1?") == "1" or measures.poll() is not None)
                measures.kill()
                assert b"drive on" in measures.communicate()[1]
            until(lambda: seen.query("OUTP1?") == "0")
