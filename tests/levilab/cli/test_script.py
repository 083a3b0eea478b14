"""The console script that pyproject.toml names."""

import os
import signal
import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import pytest

from levilab.cli.exit_codes import INTERRUPTED
from levilab.cli.later import Later
from levilab.cli.start import main
from levilab.interruption import End, ignore_all_signals
from support.commands import command
from support.paths import ROOT


def interrupt(*_):
    raise KeyboardInterrupt


def test_the_console_script_starts_the_application():
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
    assert EntryPoint("levilab", scripts["levilab"], "console_scripts").load() is main


#: Prints the number of threads when numpy begins to be loaded, and ends there.
AT_NUMPY = """
import os, sys
from levilab.cli.start import main

class Finder:
    def find_spec(self, name, *_):
        if name == "numpy":
            print(os.environ.get("OPENBLAS_NUM_THREADS"))
            raise SystemExit

sys.meta_path.insert(0, Finder())
sys.argv = ["levilab", "runs", "."]
main()
"""


@pytest.mark.parametrize(("given", "taken"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")])
def test_numpy_is_loaded_with_one_thread_for_its_matrices(given, taken):
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"} | given
    ended = subprocess.run(
        [sys.executable, "-c", AT_NUMPY], env=environment, capture_output=True, text=True, check=True
    )
    assert ended.stdout.split() == [taken]


def test_ctrl_c_at_the_start_ends_in_one_line(monkeypatch, capsys):
    afterwards = []  # one more Ctrl-C while Python ends changes nothing
    monkeypatch.setattr("levilab.cli.start.end_process_at_interruption", afterwards.append)
    monkeypatch.setattr("atexit.register", afterwards.append)
    monkeypatch.setattr("levilab.cli.main.main", interrupt)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == INTERRUPTED
    assert afterwards == [ignore_all_signals, INTERRUPTED]
    assert capsys.readouterr().err == "levilab: interrupted\n"


def test_ctrl_c_in_an_exec_of_a_library_does_not_end_the_process_by_the_signal():
    """Python notes that one passed an exec() of text, here as of a dataclass, and would end with −2."""
    program = """
import levilab.cli.main
from levilab.cli.start import main

levilab.cli.main.main = lambda: exec("raise KeyboardInterrupt")
main()
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (INTERRUPTED, "levilab: interrupted\n")


def test_ctrl_c_while_a_command_is_imported_ends_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr(Later, "command", property(interrupt))
    ended = command("report", "x", cwd=tmp_path)
    assert (ended.status, ended.err) == (INTERRUPTED, "levilab: interrupted\n")


def test_ctrl_c_ends_the_process_while_a_command_is_imported():
    handlers = []

    def made():
        handlers.append(signal.getsignal(signal.SIGINT))
        return lambda: None

    before = signal.getsignal(signal.SIGINT)
    assert Later("some", callback=made).command.name == "some"
    assert "end_process_at_interruption" in handlers[0].__qualname__
    assert signal.getsignal(signal.SIGINT) is before


def test_a_signal_after_the_run_changes_nothing(tmp_path, monkeypatch):
    handlers = []

    def count():
        handlers.append(signal.getsignal(signal.SIGTERM))
        return 3

    kept = SimpleNamespace(status="finished", folder="somewhere", count=count)
    monkeypatch.setattr("levilab.acquisition.loop.acquire", lambda *_: kept)
    assert command("acquire", "spin", "--mock", cwd=tmp_path).status == 0
    assert isinstance(handlers[0], End)
