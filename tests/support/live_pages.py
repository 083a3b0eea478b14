"""The live view for tests: a server in a thread, and run folders that grow as a bench writes them."""

import asyncio
import contextlib
import http.client
import json
import socket
import threading
import time
from urllib.parse import urlsplit

import uvicorn

from levilab.live.doors import Doors, doors_for_guests
from levilab.live.serve import configuration
from levilab.live.server import Hall
from levilab.runs.run import lock_of
from support.commands import command

#: A page is waited for so long; one that works is not waited for [s].
PATIENCE_S = 90.0
CHANNELS = (("time_s", "s"), ("spin_frequency_hz", "Hz"), ("spin_frequency_u_hz", "Hz"))


@contextlib.contextmanager
def serving(root, shown="", desk=None):
    """A server of the runs in a folder, at two free ports, one for guests, in a thread of its own."""
    with socket.create_server(("127.0.0.1", 0)) as listening, socket.create_server(("127.0.0.1", 0)) as shared:
        guests = doors_for_guests("127.0.0.1", shared.getsockname()[1])
        hall = Hall(root, shown, Doors(listening.getsockname()[1]), desk, guests)
        run = hall.analyses.carry_out  # no test looks at a report's trials, of 2 s
        hall.analyses.carry_out = lambda words: run([*words, *["--no-crosscheck"] * (words[0] == "report")])
        server = uvicorn.Server(configuration(hall))
        thread = threading.Thread(target=lambda: asyncio.run(server.serve(sockets=[listening, shared])), daemon=True)
        thread.start()
        try:
            yield hall
        finally:
            server.should_exit = True
            thread.join(PATIENCE_S)
            hall.analyses.end()


def carry_out_here(words):
    """Carry out a command of the server in this process, where all is imported, and without a report's trials."""
    ended = command(*words, *["--no-crosscheck"] * (words[0] == "report"), cwd=".")
    return ended.status, ended.err


def address(hall, run="", *, token=False):
    """Where a page of the server is."""
    return f"http://127.0.0.1:{hall.doors.port}/" + (f"?run={run}" if run else "") + (f"#{hall.doors.token}" * token)


def address_for_guests(hall):
    """Where a guest's page of the server is."""
    return f"http://127.0.0.1:{hall.guests.port}/{hall.guests.token}/"


def request(there, path, body=None, *, method="", headers=None):
    """Status and text of the answer to a request as it stands, at the server of an address; a body is posted."""
    connection = http.client.HTTPConnection(urlsplit(there).netloc, timeout=PATIENCE_S)
    with contextlib.closing(connection):
        connection.request(method or ("GET" if body is None else "POST"), path, body, headers or {})
        answer = connection.getresponse()
        return answer.status, answer.read().decode("utf-8", "replace")


def until(page, expression):
    """Wait for something in a page.  The page's policy forbids Playwright's own way, which evaluates text."""
    end, pause_ms = time.monotonic() + PATIENCE_S, 20.0
    while not (found := page.evaluate(expression)):
        assert time.monotonic() < end, f"still not: {expression}; {page.evaluate('document.body.innerText')[:600]}"
        page.wait_for_timeout(pause_ms)
        pause_ms = min(1.5 * pause_ms, 250.0)  # a question costs milliseconds in three processes
    return found


def wait_for(condition):
    """Wait for something in this process."""
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def publish(watch, *messages):
    """Let a watch take in messages without a bench."""
    for message in messages:
        watch._take(message)


class GrowingRun:
    """A run folder as a bench writes it, without a bench."""

    def __init__(self, root, name="20261122T100000Z-spin-0000", **record):
        self.folder = root / name
        self.folder.mkdir(parents=True)
        self.record = {
            "schema": "levilab-run/1",
            "experiment": "spin",
            "status": "finished",
            "started_utc": "2026-11-22T10:00:00.000000Z",
            "time_zero_utc": "2026-11-22T10:01:00.000000Z",
            "channels": [{"name": name, "unit": unit, "source": ""} for name, unit in CHANNELS],
            "synthetic": True,
        } | record
        self.say()
        self.add(",".join(name for name, _ in CHANNELS) + "\n")

    def say(self, **changes):
        """Change the record."""
        self.record |= changes
        (self.folder / "run.json").write_text(json.dumps(self.record), encoding="utf-8")

    def add(self, text):
        """Append to readings.csv."""
        with (self.folder / "readings.csv").open("a", encoding="utf-8", newline="") as file:
            file.write(text)

    def readings(self, rows):
        """Append readings."""
        self.add("".join(",".join(map(repr, row)) + "\n" for row in rows))

    def event(self, text, kind="said", time_s=None, utc="2026-11-22T09:00:05.123456Z", **more):
        """Append an event."""
        with (self.folder / "events.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps({"utc": utc, "time_s": time_s, "kind": kind, "text": text} | more) + "\n")

    @contextlib.contextmanager
    def running(self):
        """Hold the lock of a process that writes."""
        with lock_of(self.folder):
            self.say(status="running")
            yield


def spin_down(count, step_s=10.0, first=0):
    """Readings of a top under the drag of a disc, from 40 Hz."""
    times = [step_s * k for k in range(first, first + count)]
    return [(t, (40.0**-0.5 + 2.93e-4 * t) ** -2 + 0.01 * (-1) ** k, 0.03) for k, t in enumerate(times)]
