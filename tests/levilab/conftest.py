"""What the tests of the application share."""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
from typing import TYPE_CHECKING
from unittest import mock

import pytest

from levilab.cli.main import main
from support.paths import SAMPLE_DATA
from support.waiting import HANG_GUARD_S

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Command = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def sample_data() -> Path:
    return SAMPLE_DATA


@pytest.fixture
def levilab(tmp_path: Path) -> Command:
    """Runs the command in an empty folder, with streams like pipes, in this process: heavy imports cost once."""

    def run(*words: str | Path, cwd: Path = tmp_path, check: int | None = 0) -> subprocess.CompletedProcess[str]:
        streams = [io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2)]
        command = ["levilab", *map(str, words)]
        status: object = 0
        with (
            contextlib.chdir(cwd),
            contextlib.redirect_stdout(streams[0]),
            contextlib.redirect_stderr(streams[1]),
            mock.patch.object(sys, "argv", command),
        ):
            try:
                main()
            except SystemExit as end:
                status = end.code or 0
        for stream in streams:
            stream.flush()
        told, said = (stream.buffer.getvalue().decode("utf-8") for stream in streams)
        assert check is None or status == check, said
        return subprocess.CompletedProcess(command, int(str(status)), told, said)

    return run


@pytest.fixture
def levilab_process(tmp_path: Path) -> Command:
    """Runs the command as a user does: a process of its own, in an empty folder."""

    def run(*words: str | Path, cwd: Path = tmp_path, check: int | None = 0) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "levilab", *map(str, words)]
        done = subprocess.run(
            command, cwd=cwd, capture_output=True, text=True, encoding="utf-8", timeout=HANG_GUARD_S, check=False
        )
        assert check is None or done.returncode == check, done.stderr
        assert "Traceback" not in done.stderr
        return done

    return run
