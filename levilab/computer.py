"""The computer as runs use it: its disk, its clock, and what no other process has.

Everything that is to survive a crash is written through `computer()`.  The laboratory (`levilab.laboratory`) puts
another one in its place, whose disk fills up, whose clock jumps and which loses its power.
"""

import contextlib
import os
import secrets
import shutil
import sys
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, cast

if sys.platform == "darwin":
    import fcntl


class Computer:
    """This computer.  What concerns the disk raises OSError."""

    # --- the disk: reading needs no more than a path ---

    def open(self, path: Path, mode: str) -> BinaryIO:
        """Open a file to write to; a binary mode, as of `open`."""
        return cast("BinaryIO", path.open(mode))

    def sync(self, file: BinaryIO) -> None:
        """Wait until the content of a file is on the disk."""
        if sys.platform == "darwin":  # where fsync leaves it in the disk's own memory
            with contextlib.suppress(OSError):  # a disk of the network takes no such order
                fcntl.fcntl(file.fileno(), fcntl.F_FULLFSYNC)
                return
        os.fsync(file.fileno())

    def sync_folder(self, folder: Path) -> None:
        """Wait until a folder's new names are on the disk; Windows does so by itself."""
        if os.name != "posix":
            return
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def move(self, part: Path, path: Path) -> None:
        """Give a file or folder another name: os.replace, which Windows refuses while another program reads either."""
        for attempt in range(10):
            try:
                part.replace(path)
            except PermissionError:
                if os.name != "nt" or attempt == 9:
                    raise
                time.sleep(0.02)
            else:
                return

    def make_folder(self, folder: Path) -> None:
        """Make a folder.  Raises FileExistsError, too."""
        folder.mkdir()

    def remove(self, path: Path) -> None:
        """Remove a file, if it is there."""
        path.unlink(missing_ok=True)

    def remove_folder(self, folder: Path) -> None:
        """Remove a folder with all that is in it, as far as that is possible."""
        shutil.rmtree(folder, ignore_errors=True)

    def lock(self, path: Path) -> Any:
        """Return the lock of a file, a `filelock.FileLock`: a process that ends drops it, however it ends."""
        from filelock import FileLock

        return FileLock(path)

    # --- the clock, and what is this process's own ---

    def utc(self) -> datetime:
        """Return the time."""
        return datetime.now(UTC)

    def token(self) -> str:
        """Return four hexadecimal digits by chance."""
        return secrets.token_hex(2)

    @property
    def process(self) -> int:
        """The number of this process."""
        return os.getpid()

    def is_alive(self, process: int) -> bool:
        """Return whether a process may be alive; False on Windows, where asking by a signal would end it."""
        if os.name != "posix":
            return False
        try:
            os.kill(process, 0)
        except (ProcessLookupError, OverflowError):
            return False
        except PermissionError:
            pass
        return True


_in_use: list[Computer] = [Computer()]


def computer() -> Computer:
    """Return the computer that everything is written with."""
    return _in_use[-1]


@contextlib.contextmanager
def at_another_computer(other: Computer) -> Iterator[None]:
    """Let everything be written with another computer while the context lasts."""
    _in_use.append(other)
    try:
        yield
    finally:
        _in_use.remove(other)


def utc_now() -> str:
    """Return the time as it stands in run.json.

    >>> utc_now()[-1]
    'Z'
    """
    return computer().utc().strftime("%Y-%m-%dT%H:%M:%S.%fZ")
