"""Resident memory of `levilab bench serve` while clients come and go on all ways: flat or not.

``python benchmarks/soak.py --seconds 600 --speed 144`` prints a row for each tenth of the time and writes
benchmarks/results/soak.json; 600 s at 144 times the speed are 24 h of the bench.  Needs /proc, as Linux has it.
"""

import argparse
import contextlib
import json
import socket
import struct
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from random import Random

import pyvisa

from levilab.software import software_versions

HERE = Path(__file__).parent
#: What polite clients ask: an answer at once, a screenshot, a count.
ASKED = {
    "generator": ("*IDN?", "APPL?", "SYST:ERR?"),
    "oscilloscope": (":WAV:PRE?", ":TRIG:STAT?"),
    "counter": ("READ?",),
}
ROWS, CLIENTS = 20, 4
#: Rows from which on the memory is compared: before, caches fill.
SETTLED = 4


def resident(pid: int) -> float:
    """Return the resident memory of a process [MB]."""
    line = next(line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


def be_polite(resources: dict[str, dict[str, str]], random: Random, done: Counter[str]) -> None:
    """Open an instrument on some way, ask, and leave."""
    kind = random.choice([*ASKED])
    way = random.choice([*resources[kind]])
    instrument = pyvisa.ResourceManager("@py").open_resource(resources[kind][way], timeout=20_000)
    instrument.read_termination = instrument.write_termination = "\n"
    with contextlib.closing(instrument):
        for _ in range(random.randrange(1, 20)):
            instrument.query(random.choice(ASKED[kind]))
            done["answers"] += 1


def be_rude(resources: dict[str, dict[str, str]], random: Random, done: Counter[str]) -> None:
    """Send a part of something, or nonsense, and leave with a reset."""
    name = resources["generator"][random.choice(["socket", "hislip", "vxi11"])]
    port = int(name.replace("hislip0,", "").replace(",", "::").split("::")[2])
    with socket.create_connection(("127.0.0.1", port), timeout=20) as connection:
        connection.sendall(random.choice([b"*IDN?\nDATA #9", b"HS\0\0", b"\x80\0\0\x28", random.randbytes(5000)]))
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    done["left"] += 1


def come_and_go(resources: dict[str, dict[str, str]], seed: int, over: threading.Event, done: Counter[str]) -> None:
    random = Random(seed)
    while not over.is_set():
        try:
            (be_polite if random.random() < 0.7 else be_rude)(resources, random, done)
            done["clients"] += 1
        except Exception as error:  # noqa: BLE001 - counted, and shown
            done[type(error).__name__] += 1


def main() -> None:
    """Serve, let clients come and go, and write what was seen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--speed", type=float, default=144.0)
    given = parser.parse_args()
    command = [sys.executable, "-m", "levilab", "bench", "serve", "--json", "--speed", str(given.speed)]
    done: Counter[str] = Counter()
    rows = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True) as server:
        assert server.stdout
        found = json.loads(server.stdout.readline())["instruments"]
        resources = {
            kind: {way: name for way, name in found[kind]["resources"].items() if way in {"socket", "hislip", "vxi11"}}
            for kind in ASKED
        }
        over = threading.Event()
        threads = [threading.Thread(target=come_and_go, args=(resources, k, over, done)) for k in range(CLIENTS)]
        for thread in threads:
            thread.start()
        begun = time.monotonic()
        print("  time [s]  bench [h]  clients  answers  memory [MB]")
        for k in range(ROWS + 1):
            over.wait(max(0.0, begun + k * given.seconds / ROWS - time.monotonic()))
            passed = time.monotonic() - begun
            row = (
                round(passed, 1),
                passed * given.speed / 3600,
                done["clients"],
                done["answers"],
                resident(server.pid),
            )
            rows.append(row)
            print("{:10.1f} {:10.2f} {:8d} {:8d} {:12.1f}".format(*row), flush=True)
        over.set()
        for thread in threads:
            thread.join()
        server.terminate()
    settled = [row[-1] for row in rows[SETTLED:]]
    print(f"from row {SETTLED} on {min(settled):.1f} to {max(settled):.1f} MB; {dict(done)}")
    document = {"seconds": given.seconds, "speed": given.speed, "counts": dict(done), "software": software_versions()}
    document["rows"] = [dict(zip(("s", "bench_h", "clients", "answers", "mb"), row, strict=True)) for row in rows]
    (HERE / "results" / "soak.json").write_text(json.dumps(document, indent=1, sort_keys=True) + "\n", "utf-8")


if __name__ == "__main__":
    main()
