"""The words of the house: code and pages name the thing that acts."""

from __future__ import annotations

import re
import shutil
import subprocess
from typing import TYPE_CHECKING

import pytest

from support.paths import ROOT

if TYPE_CHECKING:
    from pathlib import Path

#: Words that hide what acts, in lower case: in sentences and names, also over the end of a line or a comment's sign.
MANNERED = re.compile(
    r"(?<![a-z])(?:somebody|nobody|everybody|whoever|so[\s#:_]+long[\s#:_]+as|of[\s#:_]+old|all[\s#:_]+the[\s#:_]+same)"
    r"(?![a-z])|\b(?:is|was)[\s#:]+told\b|\bwhat[\s#:]+there[\s#:]+is\b"
)

#: Files that may have such words, and why.
EXCEPTIONS = {
    "tests/test_words.py": "they are listed here",
    "instruments/errors.py": "to be mended",
    "instruments/links/serial_port.py": "to be mended",
    "instruments/virtual/bench/session.py": "to be mended",
    "instruments/virtual/generator/voltage.py": "to be mended",
    "instruments/virtual/oscilloscope/record.py": "to be mended",
    "instruments/virtual/servers/hislip.py": "to be mended",
    "instruments/virtual/servers/serial_port.py": "to be mended",
    "instruments/virtual/servers/station.py": "to be mended",
    "instruments/virtual/servers/vxi11.py": "to be mended",
    "tests/instruments/drivers/generator/test_manuals_bytes.py": "to be mended",
    "tests/instruments/drivers/oscilloscope/test_manuals_bytes.py": "to be mended",
    "tests/instruments/links/test_faults.py": "to be mended",
    "tests/instruments/links/test_serial_port.py": "to be mended",
    "tests/instruments/links/test_socket.py": "to be mended",
    "tests/instruments/links/test_visa.py": "to be mended",
    "tests/instruments/virtual/bench/test_fuzz.py": "to be mended",
    "tests/instruments/virtual/bench/test_visa_library.py": "to be mended",
    "tests/instruments/virtual/counter/test_keysight_53230a.py": "to be mended",
    "tests/instruments/virtual/generator/test_listener.py": "to be mended",
    "tests/instruments/virtual/servers/test_pseudo_terminals.py": "to be mended",
}


def mannered(text: str) -> list[str]:
    """The mannered words of a text, in their order.

    >>> mannered("It waits so long\\n    #: as nobody_listens. # What was\\n# told?  A disbeliever is toldyou.")
    ['so long as', 'nobody', 'was told']
    """
    return [" ".join(re.split(r"[\s#:_]+", found)) for found in MANNERED.findall(text.lower())]


def files() -> list[Path]:
    """All tracked .py, .md, .toml and .j2 files but the exceptions."""
    endings = ("*.py", "*.md", "*.toml", "*.j2")
    git = shutil.which("git")
    if git is None or not (ROOT / ".git").exists():
        pytest.skip("the files that git tracks are not known")
    names = subprocess.run([git, "ls-files", *endings], cwd=ROOT, capture_output=True, encoding="utf-8", check=True)
    return [ROOT / name for name in names.stdout.splitlines() if name not in EXCEPTIONS and (ROOT / name).is_file()]


def test_no_file_has_a_word_that_hides_what_acts() -> None:
    texts = {str(file.relative_to(ROOT)): file.read_text(encoding="utf-8") for file in files()}
    assert {name: words for name, text in texts.items() if (words := mannered(text))} == {}
