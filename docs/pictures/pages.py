"""Make class.png and report.png: the head of a class's page, and a report of one page.

python docs/pictures/pages.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from live import ROOT, take_picture
from support.browser import FLAGS, executable

#: Group → options of its run: the last two have something to find.
GROUPS = {
    **dict.fromkeys(("Group 1", "Group 2", "Group 3", "Group 4"), ()),
    "Group 5": ("--set", "spin.drive_frequency_hz=26"),
    "Group 6": ("--scene", "loose-washers"),
}
#: The report of docs/report.md.
REPORT = (
    "sample_data/spin-down-1", "--short", "--title", "Experiment 7", "--course", "Physics lab 2", "--author", "A. Kim",
    "--date", "28 November 2026",
)  # fmt: skip
#: Picture → its width, and what begins below it.
ENDS = {"class": (800, "details"), "report": (840, "h2:has-text('Notes')")}


def levilab(*words: str) -> None:
    """Carry out a command."""
    subprocess.run((sys.executable, "-m", "levilab", *words), cwd=ROOT, check=True)  # noqa: S603


def main() -> None:
    """Measure as docs/class.md says, and take pictures of the pages."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as out, sync_playwright() as playwright:
        for seed, (group, words) in enumerate(GROUPS.items(), 1):
            levilab("acquire", "spin", "--mock", "--group", group, "--seed", str(seed), *words, "--out", f"{out}/runs")
        levilab("class", f"{out}/runs", "-o", f"{out}/class.html")
        levilab("report", *REPORT, "-o", f"{out}/report.html")
        browser = playwright.chromium.launch(executable_path=executable(), args=list(FLAGS))
        for name, (width, below) in ENDS.items():
            page = browser.new_page(viewport={"width": width, "height": 2000})
            page.goto(Path(out, f"{name}.html").as_uri())
            end = page.locator(below).first.bounding_box()
            assert end is not None
            take_picture(page, name, {"x": 0, "y": 0, "width": width, "height": end["y"] - 8})
        browser.close()


if __name__ == "__main__":
    main()
