"""What the tests of the application share."""

import subprocess
import sys

import pytest

from support.commands import command
from support.figures import with_drawing, without_figures
from support.less_work import with_less_work
from support.paths import SAMPLE_DATA
from support.waiting import HANG_GUARD_S


@pytest.fixture
def sample_data():
    return SAMPLE_DATA


@pytest.fixture
def write(tmp_path):
    """Write a file for the test."""

    def file(content, name="data.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return file


@pytest.fixture(autouse=True, scope="session")
def less_work():
    """Few tests look at drawn figures, and none at the trials of a report, whose number has a test of its own."""
    with with_less_work():
        yield


@pytest.fixture
def drawn_figures():
    """For a test that looks at a drawn figure."""
    with with_drawing():
        yield


@pytest.fixture
def undrawn_figures():
    """For a test that looks at no figure; see `without_figures`."""
    with without_figures():
        yield


@pytest.fixture
def levilab(tmp_path):
    """Runs the command in an empty folder, with streams like pipes, in this process: heavy imports cost once."""

    def run(*words, cwd=tmp_path, check=0):
        ended = command(*words, cwd=cwd)
        assert check is None or ended.status == check, ended.err
        return subprocess.CompletedProcess(["levilab", *map(str, words)], ended.status, ended.out, ended.err)

    return run


@pytest.fixture
def levilab_process(tmp_path):
    """Runs the command as a user does: a process of its own, in an empty folder."""

    def run(*words, cwd=tmp_path, check=0):
        argv = [sys.executable, "-m", "levilab", *map(str, words)]
        done = subprocess.run(
            argv, cwd=cwd, capture_output=True, text=True, encoding="utf-8", timeout=HANG_GUARD_S, check=False
        )
        assert check is None or done.returncode == check, done.stderr
        assert "Traceback" not in done.stderr
        return done

    return run
