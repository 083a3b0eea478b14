"""The same input gives the same bytes, in another process, with other hashes, in another zone, at another time."""

import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

from levilab.report.pdf.renderer import as_pdf
from support.commands import command
from support.documents import of_all_blocks
from support.figures import with_drawing
from support.paths import ROOT, SAMPLE_DATA
from support.waiting import HANG_GUARD_S


def write_into(folder):
    """Write the page of a run with a heading, and a document with all kinds of blocks as PDF."""
    words = ("-o", folder / "page.html", "--no-crosscheck", "--course", "a", "--author", "b")
    assert command("report", SAMPLE_DATA / "upper-limits", *words, cwd=folder).status == 0
    (folder / "all.pdf").write_bytes(as_pdf(of_all_blocks("ν = 3.2(1)×10⁻³ s⁻¹")))


def test_two_processes_write_the_same_page_and_the_same_pdf(tmp_path):
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
    with with_drawing():
        write_into(here)
    paths = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
    environment = os.environ | {"PYTHONPATH": paths, "PYTHONHASHSEED": "7", "TZ": "Asia/Tokyo"}
    subprocess.run(
        [sys.executable, __file__, str(there)], env=environment, check=True, capture_output=True, timeout=HANG_GUARD_S
    )
    for name in ("page.html", "all.pdf"):
        assert (here / name).read_bytes() == (there / name).read_bytes(), name
    assert f"{datetime.now(UTC):%Y-%m-%d}" not in (here / "page.html").read_text(encoding="utf-8")


if __name__ == "__main__":
    write_into(Path(sys.argv[1]))
