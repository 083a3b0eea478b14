"""The simulator's code is compiled when it is first used: a message says so to those who wait."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from numba.core.event import Event, Listener, install_listener

from levilab.simulator.kernels.splitting import advance

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@contextlib.contextmanager
def announce_compilation(message: Callable[[str], None]) -> Iterator[None]:
    """Send a message when the kernel is compiled; one that lies on the disk is not."""
    with install_listener("numba:compile", _Announcement(message)):
        yield


class _Announcement(Listener):
    """Sends its message at the first compilation of the integrator's loop."""

    def __init__(self, message: Callable[[str], None]) -> None:
        self._message, self._sent = message, False

    def on_start(self, event: Event) -> None:
        if event.data["dispatcher"] is advance and not self._sent:
            self._sent = True
            self._message("compiling for this kind of scene: a few seconds, once")

    def on_end(self, event: Event) -> None:
        """Nothing to say."""
