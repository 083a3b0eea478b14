"""The simulator's code is compiled when it is first used: a message says so to those who wait."""

import contextlib
import time

import levilab.simulator.kernels  # noqa: F401 - first, since its error says what to do without numba

# isort: split
from collections.abc import Callable, Iterator

from numba.core.event import Event, Listener, install_listener

from levilab.simulator.kernels.splitting import advance
from levilab.texts.text import Text


@contextlib.contextmanager
def announce_compilation(message: Callable[[str], None]) -> Iterator[None]:
    """Send a message when the kernel begins to be compiled, and one when it is; one that lies on the disk is not."""
    with install_listener("numba:compile", _Announcement(message)):
        yield


class _Announcement(Listener):
    """Sends its messages at the first compilation of the integrator's loop."""

    def __init__(self, message: Callable[[str], None]) -> None:
        self._message = message
        self._start: tuple[Event, float] | None = None  # with its time [s]
        self._ended = False

    def on_start(self, event: Event) -> None:
        if event.data["dispatcher"] is advance and self._start is None:
            self._start = event, time.monotonic()
            self._message("compiling for this kind of scene: a few seconds, once")

    def on_end(self, event: Event) -> None:
        if event.data["dispatcher"] is not advance or self._start is None or self._ended:
            return
        start, began = self._start
        if event.is_failed == start.is_failed:  # numba 0.68 returns False for a failure alone; no start is one
            self._ended = True
            self._message(Text("compiled in {seconds:.1f} s", seconds=time.monotonic() - began))
