"""Who may look, and who may give commands."""

import json
import socket
import urllib.request

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from levilab.live.desk import Desk
from levilab.live.doors import Doors
from levilab.live.practice.commands import PracticeEvent
from support.live_pages import PATIENCE_S, GrowingRun, address, carry_out_here, request, serving, spin_down

HERE = b"127.0.0.1:8765"


@pytest.mark.parametrize(("host", "origin", "socket", "inside"), [
    (HERE, None, False, True),
    (b"localhost:8765", b"http://localhost:8765", True, True),
    (HERE, b"http://127.0.0.1:8765", True, True),
    (b"127.0.0.1", None, False, False),
    (b"evil.example:8765", b"http://evil.example:8765", True, False),
    (HERE, b"http://evil.example", True, False),
    (HERE, b"http://127.0.0.1:9999", True, False),
    (HERE, b"null", True, False),
])  # fmt: skip
def test_only_pages_of_this_server_come_in(host, origin, socket, inside):
    headers = [(b"Host", host), *([(b"Origin", origin)] if origin else [])]
    assert Doors(8765).lets_in(headers, is_socket=socket) is inside


@pytest.mark.parametrize("hosts", [[], [b"evil.example", HERE], [HERE, HERE]])
def test_a_request_without_one_host_stays_outside(hosts):
    assert not Doors(8765).lets_in([(b"host", host) for host in hosts], is_socket=False)


class Bench:
    """Stands for the bench for practice: keeps the commands."""

    def __init__(self):
        self.commands = []
        self.answers = []

    address = None

    def command(self, command):
        self.commands.append(command)
        kind = "refused" if command.do == "stop the run" else "done"
        self.answers.append(PracticeEvent(kind, "no run", len(self.commands)))
        return len(self.commands)

    def events(self):
        answers, self.answers = self.answers, []
        return answers


@pytest.fixture(scope="module")
def bench():
    return Bench()


@pytest.fixture(scope="module")
def hall(tmp_path_factory, bench):
    root = tmp_path_factory.mktemp("runs")
    GrowingRun(root, "one")
    (root / "one" / "report.html").write_text("<h1>report</h1>", encoding="utf-8")
    (root / "one" / "secret.txt").write_text("secret", encoding="utf-8")
    (root.parent / "run.json").write_text("{}", encoding="utf-8")
    (root / "one" / "linked.png").symlink_to(root / "one" / "secret.txt")
    with serving(root, desk=Desk(bench)) as hall:
        yield hall


def test_another_name_for_this_machine_is_turned_away(hall):
    assert request(address(hall), "/runs", headers={"Host": "evil.example"})[0] == 421


@pytest.mark.parametrize(
    "path",
    ["/run/one/secret.txt", "/run/one/run.json", "/run/../run.json", "/run/..%2f/run.json", "/run/one%2f../report.html",
     "/page/..%2fserver.py", "/page/none.js", "/run/two/report.html", "/run/one/linked.png",
     f"/run/{5000 * 'a'}/report.html"],
)  # fmt: skip
def test_nothing_but_figures_and_the_report_is_served(hall, path):
    status, text = request(address(hall), path)
    assert (status, "secret" in text) == (404, False)


def test_a_report_is_a_page_of_no_origin(hall):
    with urllib.request.urlopen(address(hall) + "run/one/report.html") as answer:
        policy = answer.headers["content-security-policy"]
    assert policy.startswith("sandbox allow-scripts")
    assert "allow-same-origin" not in policy


def test_a_run_is_saved_as_netcdf_by_who_may_give_commands(hall, monkeypatch):
    run = GrowingRun(hall.root, "measured")
    run.readings(spin_down(19))
    at, right = "/run/measured/export", {"X-Levilab-Token": hall.doors.token}
    assert request(address(hall), at, b"")[0] == 403
    with monkeypatch.context() as patch:
        patch.setattr(hall.analyses, "carry_out", carry_out_here)
        status, text = request(address(hall), at, b"", headers=right)
    assert (status, text[:3], "spin_frequency" in text) == (200, "CDF", True)
    assert not (run.folder / "run.nc").exists()
    (run.folder / "readings.csv").write_text("no table", encoding="utf-8")
    status, text = request(address(hall), at, b"", headers=right)
    assert (status, json.loads(text)["error"] != "") == (400, True)


def test_a_command_needs_the_token(hall, bench):
    wanted = b'{"do": "pause", "on": true}'
    for wrong in ({}, {"X-Levilab-Token": "guess"}):
        assert request(address(hall), "/do", wanted, headers=wrong)[0] == 403
    assert bench.commands == []
    right = {"X-Levilab-Token": hall.doors.token}
    assert request(address(hall), "/do", wanted, headers=right) == (200, '{"number":1}')
    assert [(one.do, one.on) for one in bench.commands] == [("pause", True)]


@pytest.mark.parametrize(
    "wanted",
    [{}, [], "x", {"do": "explode"}, {"do": "pause", "on": "yes"}, {"do": "analyze", "run": ".."},
     {"do": "tune the drive", "frequency_hz": "30"}],
)  # fmt: skip
def test_what_is_no_command_is_refused_in_words(hall, wanted):
    right = {"X-Levilab-Token": hall.doors.token}
    status, text = request(address(hall), "/do", json.dumps(wanted).encode(), headers=right)
    assert status in {400, 404}
    assert json.loads(text)["error"]


@pytest.mark.parametrize(("question", "code"), [(b"{}", 1003), (5000 * "x", 1009)])
def test_a_question_that_is_no_text_or_too_long_closes_the_socket(hall, question, code, caplog):
    with connect(f"ws://127.0.0.1:{hall.doors.port}/frames?run=one") as socket:
        socket.send(question)
        with pytest.raises(ConnectionClosed) as closed:
            socket.recv(timeout=PATIENCE_S)
    assert closed.value.rcvd.code == code
    assert not [record for record in caplog.records if record.name.startswith("uvicorn")]


def test_a_request_that_is_no_http_prints_nothing(hall, caplog):
    with socket.create_connection(("127.0.0.1", hall.doors.port), timeout=PATIENCE_S) as raw:
        raw.sendall(b"\x16\x03\x01 junk\r\n\r\n")
        assert raw.recv(100).startswith(b"HTTP/1.1 400")
    assert not caplog.records
