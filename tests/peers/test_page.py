"""The PyMeasure scripts of docs/practise.md print what they say; the other blocks of the pages are run by make test."""

import re
import subprocess
import sys

import pytest

from support.paths import DOCS

pytest.importorskip("pymeasure")

PAGE = DOCS / "practise.md"
SCRIPTS = re.findall(r"```python pymeasure\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
#: PyMeasure says so of each driver that does not declare its dialect.
ALLOWED = "ignore:It is not known whether this device support SCPI:FutureWarning"


def test_there_is_a_script():
    assert SCRIPTS


@pytest.mark.parametrize("script", SCRIPTS)
def test_a_script_of_the_page_prints_what_it_says(script, tmp_path):
    command = [sys.executable, "-W", "error", "-W", ALLOWED, "-c", script]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == re.findall(r"print\(.*\)  # (.*)", script)
