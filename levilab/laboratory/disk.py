"""A computer whose disk and clock do what the laboratory wants.

The files lie in a folder of their own, so that everything can read them; each write, sync and rename is a step.  What
is on the disk beyond a loss of power is kept account of: the bytes of a file that were synced, and the names in a
folder that was synced since they changed.  Of all else chance decides: a file keeps some first part of what was
written to it, a folder a name or not.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Self, cast

from filelock import Timeout

from levilab.computer import Computer

if TYPE_CHECKING:
    import io
    from collections.abc import Iterator
    from random import Random

    from levilab.laboratory.fate import Fate

#: When each laboratory begins.
_BEGIN = datetime(2026, 11, 20, 10, 15, tzinfo=UTC)


@dataclass(eq=False)
class Node:
    """A file or a folder, whatever its name is.

    Attributes:
        is_folder: whether it is one.
        synced: bytes that a loss of power cannot take.
        saved: these bytes, once another file has its name.
    """

    is_folder: bool = False
    synced: int = 0
    saved: bytes | None = None


class _File:
    """A file that is written to: what is not flushed is lost with the process."""

    def __init__(self, computer: SimulatedComputer, path: Path, mode: str) -> None:
        self.computer, self.name = computer, str(path)
        self.raw = cast("io.FileIO", path.open(mode, buffering=0))
        self.node = computer.names.setdefault(path, Node())
        self._pending = b""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __getattr__(self, name: str) -> Any:
        if name in {"read", "readline", "seek", "tell"}:
            self.flush()
        return getattr(self.raw, name)

    def write(self, data: Any) -> int:
        self._pending += bytes(data)
        return len(data)

    def flush(self) -> None:
        data, self._pending = self._pending, b""
        if data:
            self.computer.write(self, data)

    def truncate(self, size: int) -> int:
        self.flush()
        self.computer.step(f"cut {Path(self.name).name} to {size}")
        self.node.synced = min(self.node.synced, size)
        return self.raw.truncate(size)

    def close(self) -> None:
        try:
            if not self.raw.closed and not self.computer.fate.dead:
                self.flush()
        finally:
            self.raw.close()


@dataclass
class _Lock:
    """The lock of a file, as `filelock.FileLock` has it."""

    computer: SimulatedComputer
    path: Path
    mine: bool = False

    @property
    def lock_file(self) -> str:
        return str(self.path)

    def acquire(self, *, blocking: bool = True, timeout: float = 0.0) -> None:
        if self.path in self.computer.held and not self.mine:
            raise Timeout(self.lock_file)
        self.path.touch()
        self.computer.held.add(self.path)
        self.mine = True

    def release(self) -> None:
        if self.mine:
            self.computer.held.discard(self.path)
            self.mine = False


@dataclass
class SimulatedComputer(Computer):
    """A computer in a laboratory.

    Attributes:
        fate: of the process that runs on it.
        random: decides what a loss of power takes.
        room: bytes that still go onto the disk.
        fault: the error of the next write, sync or rename; 0: none.
        unread: number of files that are opened to be read until one cannot be; 0: all can.
        offset_s: by how much its clock is off [s].
        passed_s: time that has passed in the laboratory [s].
        names, kept: path → file or folder as processes see them, and as they are after a loss of power.
        held: paths that are locked.
    """

    fate: Fate
    random: Random
    room: float = float("inf")
    fault: int = 0
    unread: int = 0
    offset_s: float = 0.0
    passed_s: float = 0.0
    names: dict[Path, Node] = field(default_factory=dict)
    kept: dict[Path, Node] = field(default_factory=dict)
    held: set[Path] = field(default_factory=set)

    def step(self, what: str) -> None:
        """Let something happen on the disk.  Raises Killed, OSError."""
        self.fate.step(what)
        if self.fault:
            number, self.fault = self.fault, 0
            raise OSError(number, os.strerror(number))

    # --- what a process does ---

    def open(self, path: Path, mode: str) -> BinaryIO:
        """See `Computer`."""
        self.step(f"open {path.name}")
        return cast("BinaryIO", _File(self, path, mode))

    def write(self, file: _File, data: bytes) -> None:
        """Write bytes; those that find no room, or meet an error, are missing, and the first half is there."""
        name = Path(file.name).name
        try:
            self.step(f"write {len(data)} {name}")
        except OSError:
            file.raw.write(data[: len(data) // 2])
            raise
        part = data[: int(min(self.room, len(data)))]
        file.raw.write(part)
        self.room -= len(part)
        if len(part) < len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def sync(self, file: BinaryIO) -> None:
        """See `Computer`."""
        self.step(f"sync {Path(file.name).name}")
        ours = cast("_File", file)
        ours.node.synced = os.fstat(ours.raw.fileno()).st_size

    def sync_folder(self, folder: Path) -> None:
        """See `Computer`."""
        self.step(f"sync folder {folder.name}")
        for path in [path for path in self.kept if path.parent == folder]:
            del self.kept[path]
        self.kept |= {path: node for path, node in self.names.items() if path.parent == folder}

    def move(self, part: Path, path: Path) -> None:
        """See `Computer`."""
        self.step(f"move {part.name} to {path.name}")
        self._save(path)
        part.replace(path)
        if part in self.names:
            self.names[path] = self.names.pop(part)

    def make_folder(self, folder: Path) -> None:
        """See `Computer`."""
        self.step(f"make {folder.name}")
        folder.mkdir()
        self.names[folder] = Node(is_folder=True)

    def remove(self, path: Path) -> None:
        """See `Computer`."""
        if path.exists():
            self.step(f"remove {path.name}")
            self._save(path)
            path.unlink()
            self.names.pop(path, None)

    def remove_folder(self, folder: Path) -> None:
        """See `Computer`."""
        self.step(f"remove {folder.name}")
        self.forget(folder)

    def lock(self, path: Path) -> _Lock:
        """See `Computer`."""
        return _Lock(self, path)

    def utc(self) -> datetime:
        """See `Computer`."""
        return _BEGIN + timedelta(seconds=self.passed_s + self.offset_s)

    def token(self) -> str:
        """See `Computer`."""
        return f"{self.random.getrandbits(16):04x}"

    @property
    def process(self) -> int:
        """See `Computer`."""
        return 1000 + self.fate.life

    def is_alive(self, process: int) -> bool:
        """See `Computer`."""
        return process == self.process

    @contextlib.contextmanager
    def may_fail_to_read(self) -> Iterator[None]:
        """Let `unread` count the files that are opened to be read, by whatever function."""
        sound = Path.open

        def open_(path: Path, mode: str = "r", *more: Any, **named: Any) -> Any:
            if self.unread and mode in {"r", "rb", "rt"}:
                self.unread -= 1
                if not self.unread:
                    raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))
            return sound(path, mode, *more, **named)

        Path.open = open_  # type: ignore[method-assign, assignment]
        try:
            yield
        finally:
            Path.open = sound  # type: ignore[method-assign]

    # --- what happens to it ---

    def forget(self, folder: Path) -> None:
        """Remove a folder for good, as a person does with a file manager."""
        shutil.rmtree(folder, ignore_errors=True)
        for names in (self.names, self.kept):
            for path in [path for path in names if path == folder or folder in path.parents]:
                del names[path]

    def end_process(self, *, power: bool) -> None:
        """Let a process be gone; without power, what was not on the disk is lost, too."""
        self.held.clear()
        self.fault = self.unread = 0
        if power:
            self._lose_power()

    def _lose_power(self) -> None:
        left: dict[Path, tuple[Node, bytes]] = {}
        for path in sorted({*self.names, *self.kept}):
            now, before = self.names.get(path), self.kept.get(path)
            node = now if now is before or self.random.random() < 0.5 else before
            if node is not None and all(folder in left for folder in path.parents if folder in self.names):
                left[path] = node, self._content(path, node) if not node.is_folder else b""
        for path in sorted({*self.names, *self.kept}, reverse=True):
            if path not in left:
                shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        for path, (node, content) in left.items():
            if node.is_folder:
                path.mkdir(exist_ok=True)
            else:
                path.write_bytes(content)
        self.names = {path: Node(node.is_folder, len(content)) for path, (node, content) in left.items()}
        self.kept = dict(self.names)

    def _content(self, path: Path, node: Node) -> bytes:
        """Return what a loss of power leaves of a file."""
        if node.saved is not None:
            return node.saved
        data = next(name for name, one in self.names.items() if one is node).read_bytes()
        return data[: node.synced + int(self.random.random() * (len(data) - node.synced + 1))]

    def _save(self, path: Path) -> None:
        """Keep the bytes of a file whose name is about to name another one, or none."""
        node = self.names.get(path)
        if node is not None and node in self.kept.values():
            node.saved = path.read_bytes()[: node.synced]
