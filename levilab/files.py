"""A file is replaced whole or not at all."""

from __future__ import annotations

import contextlib
import os
import time
from typing import TYPE_CHECKING

from levilab.errors import LevilabError

if TYPE_CHECKING:
    from pathlib import Path


class CannotWrite(LevilabError):
    """A file cannot be written (any more)."""


def replace_atomically(path: Path, content: str | bytes) -> None:
    """Write a file so that a reader sees the old one or the new one, whole, whatever happens meanwhile.

    Text is written as UTF-8 with line feeds.  Raises OSError.
    """
    data = content.encode() if isinstance(content, str) else content
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        _replace(part, path)
        sync_folder(path.parent)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def sync_folder(folder: Path) -> None:
    """A new name is on the disk only with its folder; Windows keeps names without being asked."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _replace(part: Path, path: Path) -> None:
    """os.replace; Windows refuses for as long as another program reads the old file."""
    for attempt in range(10):
        try:
            part.replace(path)
        except PermissionError:
            if os.name != "nt" or attempt == 9:
                raise
            time.sleep(0.02)
        else:
            return
