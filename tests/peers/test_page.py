"""The scripts of the pages for users of other programs print what they say; other blocks are run by make test."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec

import pytest

from support.paths import DOCS
from support.waiting import HANG_GUARD_S

pytest.importorskip("pymeasure")

#: Program → the page with its scripts, and what it warns of itself.
PAGES = {
    # of each driver that does not declare its dialect
    "pymeasure": ("pymeasure.md", ["ignore:It is not known whether this device support SCPI:FutureWarning"]),
    "bluesky": ("bluesky.md", []),
    "qcodes": ("bluesky.md", ["ignore"]),
}
SCRIPTS = [
    (program, script)
    for program, (page, _) in PAGES.items()
    for script in re.findall(rf"```python {program}\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)
]


def test_each_program_has_a_script():
    assert {program for program, _ in SCRIPTS} == set(PAGES)


@pytest.mark.parametrize(("program", "script"), SCRIPTS)
def test_a_script_of_a_page_prints_what_it_says(program, script, tmp_path):
    if not find_spec(program):
        pytest.skip(f"{program} is not installed: make peers")
    warnings = [word for text in ("error", *PAGES[program][1]) for word in ("-W", text)]
    command = [sys.executable, *warnings, "-c", script]
    home = os.environ | {"HOME": str(tmp_path), "USERPROFILE": str(tmp_path)}  # QCoDeS keeps settings there
    done = subprocess.run(
        command, cwd=tmp_path, env=home, capture_output=True, text=True, timeout=HANG_GUARD_S, check=False
    )
    assert done.returncode == 0, done.stderr
    said = re.findall(r"print\(.*\)  # (.*)", script)
    assert [line for line in done.stdout.splitlines() if line in said] == said, done.stdout
