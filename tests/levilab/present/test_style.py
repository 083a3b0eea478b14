"""Pictures on the disk."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest
from matplotlib.figure import Figure

from levilab.present.style import save_png

if TYPE_CHECKING:
    from pathlib import Path


def test_a_picture_that_cannot_be_written_leaves_the_older_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "picture.png"
    save_png(Figure(), path)
    older = path.read_bytes()

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        save_png(Figure(), path)
    assert path.read_bytes() == older
    assert [found.name for found in tmp_path.iterdir()] == ["picture.png"]


def test_a_picture_is_never_written_through_a_link(tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("not a picture", encoding="utf-8")
    try:
        (tmp_path / "picture.png").symlink_to(precious)
    except OSError:
        pytest.skip("this system makes no links")
    save_png(Figure(), tmp_path / "picture.png")
    assert precious.read_text(encoding="utf-8") == "not a picture"
