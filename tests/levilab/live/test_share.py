"""Guests from the network look on, and can do nothing else."""

import contextlib
import json
import socket
from types import SimpleNamespace
from unittest.mock import Mock
from urllib.parse import urlsplit
from urllib.request import urlopen

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from levilab.interruption import End
from levilab.live.desk import Desk
from levilab.live.serve import LiveOptions, serve_live
from levilab.live.share import NoNetwork, address_in_network, code_of, who_may_look
from levilab.telemetry.messages import Drive, State
from support.browser import PHONE
from support.live_pages import (
    PATIENCE_S,
    GrowingRun,
    address,
    address_for_guests,
    publish,
    request,
    serving,
    spin_down,
    until,
)

COMMANDS = [{"do": "pause", "on": True}, {"do": "analyze", "run": "one"}, {"do": "switch the drive", "on": True}]


@pytest.fixture(scope="module")
def hall(tmp_path_factory):
    root = tmp_path_factory.mktemp("runs")
    run = GrowingRun(root, "one")
    run.readings(spin_down(19))
    (run.folder / "report.html").write_text("secret", encoding="utf-8")
    (run.folder / "spindown.png").write_text("secret", encoding="utf-8")
    commands = []
    bench = SimpleNamespace(address=None, may_record=False, events=list, command=commands.append, commands=commands)
    with serving(root, desk=Desk(bench)) as hall:
        yield hall


def inside(hall, path):
    return urlsplit(address_for_guests(hall)).path + path


@pytest.mark.parametrize("path", ["", "runs", "parts", "page/live.js"])
def test_a_guest_sees_what_the_view_shows(hall, path):
    there = address_for_guests(hall)
    assert request(there, inside(hall, path))[0] == 200
    for wrong in ("", "guess/", f"{hall.doors.token}/"):
        assert request(there, f"/{wrong}{path}")[0] == 421
    assert request(there, inside(hall, path), headers={"Host": "evil.example"})[0] == 421


def test_guests_who_ask_without_pause_share_a_list(hall, monkeypatch):
    listed = []
    monkeypatch.setattr("levilab.live.server.choices", lambda root: listed.append(root) or [])
    monkeypatch.setattr("levilab.live.server.LISTED_EVERY_S", 3600.0)
    for _ in range(3):
        request(address_for_guests(hall), inside(hall, "runs"))
    assert len(listed) <= 1  # none where another test has just asked


@pytest.mark.parametrize(
    "path",
    ["do", "run/one/analysis", "run/one/report.html", "run/one/spindown.png", "run/one/run.json", "file", "files",
     "page/..%2fserver.py", "page/..%2f..%2f..%2fpyproject.toml", "..%2fdo", "%2e%2e/do"],
)  # fmt: skip
@pytest.mark.parametrize("method", ["GET", "POST", "PUT", "DELETE"])
def test_nothing_else_is_there_for_a_guest(hall, path, method):
    for token in (hall.doors.token, urlsplit(address_for_guests(hall)).path.strip("/")):
        there, headers, body = address_for_guests(hall), {"X-Levilab-Token": token}, json.dumps(COMMANDS[0]).encode()
        status, text = request(there, inside(hall, path), body, method=method, headers=headers)
        assert status == 404
        assert "secret" not in text


def test_a_guest_without_the_token_gets_no_frames(hall):
    there = address_for_guests(hall).replace("http", "ws")
    for wrong in (there.rsplit("/", 2)[0] + "/frames", there + "do"):
        with pytest.raises(InvalidStatus) as refused, connect(wrong):
            pass
        assert refused.value.response.status_code == 403
    with pytest.raises(InvalidStatus), connect(there + "frames", origin="http://evil.example"):
        pass


def test_what_a_guest_says_commands_nothing(hall, monkeypatch):
    commands = []
    monkeypatch.setattr(Desk, "carry_out", lambda _, wanted: commands.append(wanted))
    monkeypatch.setattr(type(hall.analyses), "begin", lambda _, wanted: commands.append(wanted))
    with connect(address_for_guests(hall).replace("http", "ws") + "frames?run=one") as guest:
        for wanted in COMMANDS:
            guest.send(json.dumps(wanted | {"token": hall.doors.token, "tick": -1}))
            assert isinstance(guest.recv(timeout=PATIENCE_S), bytes)
    assert commands == []


def test_a_guest_is_not_told_where_the_runs_lie(hall, monkeypatch):
    said = [{"n": 1, "kind": "message", "text": f"writes {hall.root / 'one'}"}]
    monkeypatch.setattr(Desk, "events_after", lambda *_: said)
    with connect(address_for_guests(hall).replace("http", "ws") + "frames?run=one") as guest:
        guest.send("{}")
        frame = guest.recv(timeout=PATIENCE_S)
    assert isinstance(frame, bytes)
    assert b"writes one" in frame


def test_more_guests_than_are_let_in_wait(hall, monkeypatch):
    monkeypatch.setattr("levilab.live.server.MOST_GUESTS", 1)
    there = address_for_guests(hall).replace("http", "ws") + "frames?run=one"
    with connect(there) as first, connect(there) as second:
        first.send("{}")
        assert first.recv(timeout=PATIENCE_S)
        with pytest.raises(ConnectionClosed) as closed:
            second.recv(timeout=PATIENCE_S)
    assert closed.value.rcvd.code == 1013


def test_a_stranger_in_the_network_does_not_close_the_page_at_the_bench(hall, monkeypatch):
    monkeypatch.setattr("levilab.live.serve._MOST_OF_GUESTS", 3)
    there = urlsplit(address_for_guests(hall))
    with contextlib.ExitStack() as at_end:
        opened = [
            at_end.enter_context(socket.create_connection((there.hostname, there.port), timeout=PATIENCE_S))
            for _ in range(20)
        ]
        with contextlib.suppress(ConnectionResetError):
            assert opened[-1].recv(1) == b""
        with urlopen(address(hall)) as answer:
            assert answer.status == 200


def test_a_connection_without_a_request_is_closed(hall, monkeypatch):
    monkeypatch.setattr("levilab.live.serve._FIRST_REQUEST_S", 0.05)
    there = urlsplit(address_for_guests(hall))
    with socket.create_connection((there.hostname, there.port), timeout=PATIENCE_S) as slow:
        slow.sendall(b"GET / HTTP/1.1\r\nX-Slow: ")
        assert slow.recv(1) == b""


def test_a_phone_sees_the_practice_bench_without_its_controls(hall, watched):
    page = watched(viewport=PHONE, color_scheme="dark")
    page.goto(address_for_guests(hall))
    until(page, "levilab.frames > 0")
    for watch in hall.watches.values():
        publish(watch, State(2.0, last={"spin_frequency_hz": 30.0}, drive=Drive("SQU", 30.0, 10.0)))
    until(page, "levilab.data.bench && Number(document.getElementById('spin-value').textContent) > 20")
    of_bench = "[...document.querySelectorAll('#practice button, #practice input, #practice select')]"
    assert page.evaluate(f"{of_bench}.length > 5 && {of_bench}.every((one) => !one.offsetParent)")
    for key in "dfbpr.":
        page.keyboard.press(key)
    assert page.evaluate("document.getElementById('practice').hidden")
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    assert hall.desk.bench.commands == []


def test_the_code_is_a_square_with_its_three_marks():
    lines = code_of("http://192.168.1.7:8765/token-of-12/")
    rows = [[c not in light for c in line] for line in lines for light in ("█▀", "█▄")]  # two modules a character
    edge = [[True] * 7, *[[True, False, *[k in (2, 3, 4)] * 3, False, True] for k in range(1, 6)], [True] * 7]
    size = len(rows[0]) - 8
    for top, left in ((4, 4), (4, size - 3), (size - 3, 4)):
        assert [row[left : left + 7] for row in rows[top : top + 7]] == edge


def test_without_a_network_nothing_is_shared(monkeypatch):
    monkeypatch.setattr(socket.socket, "connect", Mock(side_effect=OSError(101, "Network is unreachable")))
    with pytest.raises(NoNetwork, match="is in no network"):
        address_in_network()


def test_a_public_address_is_said_to_be_one():
    assert "the address is public" in who_may_look("http://8.8.8.8:8765/token/")


def test_nothing_is_shared_unless_it_is_asked_for(tmp_path):
    end, said = End(), []

    def announce(own, shared):
        said.append((own, shared))
        end.wake()

    serve_live(LiveOptions(out=tmp_path, port=0), end, announce, pytest.fail)
    [(own, shared)] = said
    assert (own.startswith("http://127.0.0.1:"), shared) == (True, "")
