"""The simulator's code is compiled when it is first used: a message says so to those who wait."""

from __future__ import annotations

import contextlib
import time
from typing import TYPE_CHECKING

from numba.core.event import Event, Listener, install_listener

from levilab.simulator.kernels.splitting import advance

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@contextlib.contextmanager
def announce_compilation(message: Callable[[str], None]) -> Iterator[None]:
    """Send a message when the kernel begins to be compiled, and one at the end; one that lies on the disk is not."""
    with install_listener("numba:compile", _Announcement(message)):
        yield


class _Announcement(Listener):
    """Sends its messages at the first compilation of the integrator's loop."""

    def __init__(self, message: Callable[[str], None]) -> None:
        self._message = message
        self._began: float | None = None
        self._ended = False

    def on_start(self, event: Event) -> None:
        if event.data["dispatcher"] is advance and self._began is None:
            self._began = time.monotonic()
            self._message("compiling for this kind of scene: a few seconds, once")

    def on_end(self, event: Event) -> None:
        if event.data["dispatcher"] is advance and self._began is not None and not self._ended:
            self._ended = True
            self._message(f"compiled in {time.monotonic() - self._began:.1f} s")
