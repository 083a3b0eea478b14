"""A file that grows line by line, read as it grows."""

import os
import stat
from pathlib import Path

#: Bytes that are read at a time.
PIECE_BYTES = 1 << 18
#: Longest line; a longer one is not ours, and is skipped [bytes].
_LONGEST = 1 << 20


class Tail:
    """The lines that a file has gained since the last look.

    The last line is left until its end is on the disk.  A file that was replaced or cut is read from its start, and
    `generation` grows by one, so that what was read before can be dropped.  It is opened for each look and closed
    again: nothing is locked, and the writer may move it at any time.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.generation = 0
        self._identity: tuple[int, int] | None = None
        self._at = 0
        self._torn = b""
        self._skipping = False

    def lines(self) -> list[bytes]:
        """Return the next complete lines without their ends, of at most PIECE_BYTES; none while there are no new ones.

        No failure to read raises: a file that is gone or cannot be opened has no new lines now.
        """
        try:
            if not stat.S_ISREG(self.path.stat().st_mode):  # a pipe would be waited for
                return []
            with self.path.open("rb") as file:
                about = os.fstat(file.fileno())
                self._restart_if_replaced((about.st_dev, about.st_ino), about.st_size)
                file.seek(self._at)
                while piece := file.read(PIECE_BYTES):
                    self._at += len(piece)
                    if found := self._complete(piece):
                        return found
        except OSError:
            pass
        return []

    def _complete(self, piece: bytes) -> list[bytes]:
        """Return the lines that end in a piece; what is left begins the next one."""
        complete, end, torn = piece.rpartition(b"\n")
        if not end:
            self._keep_torn(self._torn + torn)
            return []
        found = (self._torn + complete).split(b"\n")
        if self._skipping:
            found, self._skipping = found[1:], False
        self._torn = b""
        self._keep_torn(torn)
        return [line.removesuffix(b"\r") for line in found]

    def _keep_torn(self, torn: bytes) -> None:
        self._skipping = self._skipping or len(torn) > _LONGEST
        self._torn = b"" if self._skipping else torn

    def _restart_if_replaced(self, identity: tuple[int, int], size: int) -> None:
        if self._identity is not None and (identity != self._identity or size < self._at):
            self.generation += 1
            self._at, self._torn, self._skipping = 0, b"", False
        self._identity = identity
