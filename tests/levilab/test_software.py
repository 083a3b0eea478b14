"""How an extra is installed: as levilab itself was, out of its clone."""

from __future__ import annotations

import re
import tomllib
from typing import TYPE_CHECKING

from levilab.software import how_to_install
from support.paths import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    import pytest


def test_an_extra_is_installed_from_the_clone_as_levilab_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.prefix", str(tmp_path))
    assert how_to_install("video") == 'type pip install ".[video]" in the folder of levilab\'s clone'
    (tmp_path / "uv-receipt.toml").touch()
    assert how_to_install("video") == 'type uv tool install ".[live,pdf,video]" in the folder of levilab\'s clone'
    assert '".[live,pdf]"' in how_to_install("pdf")


def test_every_extra_that_a_message_names_is_declared() -> None:
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "levilab").rglob("*.py")]
    named = {name for text in texts for name in re.findall(r"how_to_install\([\'\"](\w+)", text)}
    assert named == {"cluster", "live", "parquet", "pdf", "peers", "scope", "video", "xarray"}
    assert named <= declared.keys()
    assert not [text for text in texts if re.search(r"pip install \S*levilab\\*\[", text)]
