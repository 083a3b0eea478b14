"""The same input gives the same bytes, in another process, with other hashes, at another time."""

from __future__ import annotations

import os
import subprocess
import sys
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from support.commands import command
from support.paths import SAMPLE_DATA
from support.waiting import HANG_GUARD_S

if TYPE_CHECKING:
    from pathlib import Path


def test_two_processes_write_the_same_page(tmp_path: Path) -> None:
    words = ["report", str(SAMPLE_DATA / "upper-limits"), "-o"]
    assert command(*words, tmp_path / "here.html", cwd=tmp_path).status == 0
    subprocess.run(
        [sys.executable, "-m", "levilab", *words, str(tmp_path / "there.html")],
        env=os.environ | {"PYTHONHASHSEED": "7"}, check=True, capture_output=True, timeout=HANG_GUARD_S, cwd=tmp_path,
    )  # fmt: skip
    here, there = ((tmp_path / name).read_bytes() for name in ("here.html", "there.html"))
    assert here == there
    assert f"{datetime.now(UTC):%Y-%m-%d}" not in here.decode()
