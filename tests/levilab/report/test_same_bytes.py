"""The same input gives the same bytes, in another process, with other hashes, at another time."""

from __future__ import annotations

import os
import subprocess
import sys
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from support.paths import SAMPLE_DATA
from support.waiting import HANG_GUARD_S

if TYPE_CHECKING:
    from pathlib import Path


def test_two_processes_write_the_same_page(tmp_path: Path) -> None:
    pages = []
    for hashes in ("1", "2"):
        output = tmp_path / f"{hashes}.html"
        subprocess.run(
            [sys.executable, "-m", "levilab", "report", str(SAMPLE_DATA / "upper-limits"), "-o", str(output)],
            env=os.environ | {"PYTHONHASHSEED": hashes}, check=True, capture_output=True, timeout=HANG_GUARD_S,
        )  # fmt: skip
        pages.append(output.read_bytes())
    assert pages[0] == pages[1]
    assert f"{datetime.now(UTC):%Y-%m-%d}" not in pages[0].decode()
