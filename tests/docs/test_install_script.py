"""The script that installs on Windows, as far as it can be checked elsewhere."""

import re
import tomllib

from support.paths import ROOT

SCRIPT = (ROOT / "docs" / "install-levilab.cmd").read_bytes()
TEXT = SCRIPT.decode("ascii")  # cmd.exe reads it in the code page of the computer
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_its_lines_end_as_the_shell_of_windows_wants_them():
    assert SCRIPT.count(b"\n") == SCRIPT.count(b"\r\n") > 50
    assert SCRIPT.endswith(b"\r\n")


def test_it_jumps_to_labels_that_are_there():
    labels = set(re.findall(r"^:(\w+)\r$", TEXT, re.MULTILINE))
    assert set(re.findall(r"goto (\w+)", TEXT)) | set(re.findall(r"call :(\w+)", TEXT)) == labels


def test_each_way_out_says_whether_it_went_well_and_leaves_the_folder():
    for label, body in re.findall(r"^:(no_\w+|failed|prepare)\r\n(.*?exit /b \d)", TEXT, re.MULTILINE | re.DOTALL):
        assert body.endswith("exit /b 0" if label == "prepare" else "exit /b 1")
        assert ("popd" in body) == (label != "no_folder")


def test_it_asks_for_the_python_and_the_extras_that_there_are():
    major, minor = re.search(r"version_info < \((\d+), (\d+)\)", TEXT).groups()
    assert PROJECT["requires-python"] == f">={major}.{minor}"
    for extras in re.findall(r"%WHEEL%\[([\w,]+)\]", TEXT):
        assert set(extras.split(",")) <= PROJECT["optional-dependencies"].keys()
