"""What the tests of the application share."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from support.paths import SAMPLE_DATA
from support.waiting import HANG_GUARD_S

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


@pytest.fixture
def sample_data() -> Path:
    return SAMPLE_DATA


@pytest.fixture
def levilab(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
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
