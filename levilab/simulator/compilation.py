"""The simulator's code is compiled when it is first used: people who wait for it are told."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@contextlib.contextmanager
def telling_of_compilation(message: Callable[[str], None]) -> Iterator[None]:
    """Say so when the kernel is compiled; one that lies on the disk is not."""
    from numba.core.event import Event, Listener, install_listener

    from levilab.simulator.kernels.splitting import advance

    class Compilation(Listener):
        told = False

        def on_start(self, event: Event) -> None:
            if event.data["dispatcher"] is advance and not self.told:
                self.told = True
                message("compiling for this kind of scene: a few seconds, once")

        def on_end(self, event: Event) -> None:
            """Nothing to say."""

    with install_listener("numba:compile", Compilation()):
        yield
