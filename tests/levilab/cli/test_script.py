"""The console script that pyproject.toml names."""

from __future__ import annotations

import tomllib
from importlib.metadata import EntryPoint

from levilab.cli.main import main
from support.paths import ROOT


def test_the_console_script_starts_the_application() -> None:
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
    assert EntryPoint("levilab", scripts["levilab"], "console_scripts").load() is main
