"""A place of a Zarr store whose files are whole and on the disk before they have their names.

Zarr's own gives a file its name before its bytes are on the disk: a loss of power may leave marks that cannot be read.
"""

import asyncio

from zarr.core.buffer import Buffer
from zarr.storage import LocalStore

from levilab.files import make_folder, replacing


class DurableStore(LocalStore):
    """A folder of files, each of which is the old or the new one, whatever happens meanwhile."""

    async def set(self, key: str, value: Buffer) -> None:
        """Write a file.  Raises OSError."""
        await asyncio.to_thread(self.set_sync, key, value)

    async def set_if_not_exists(self, key: str, value: Buffer) -> None:
        """Write a file unless it is there.  Raises OSError."""
        if not (self.root / key).exists():
            await self.set(key, value)

    def set_sync(self, key: str, value: Buffer) -> None:
        """Write a file.  Raises OSError."""
        self._check_writable()
        path = self.root / key
        make_folder(path.parent)
        with replacing(path, among_many=True) as file:
            file.write(value.to_bytes())
